//! The figures at the border: the document of `run --json` and `time --json`, in customary units.
//!
//! In: [`Figures`], the machine, warnings. Out: [`RunSummary`], which serialises to the keys of the contract. Holds no path, host or
//! wall-clock time, because it is also recorded: the command adds the name of the recording when it prints.

use super::figures::{AxisFigures, Figures};
use crate::base::{AxisId, AxisKind, Diagnostic, Severity, units};
use crate::feed::{Limit, OverrideChange, OverrideSchedule};
use crate::machine::Machine;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// `run --json`.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary {
    /// Version of this document.
    pub format: u32,
    /// Program file name.
    pub program: String,
    /// Machine name.
    pub machine: String,
    /// N * t_s.
    pub cycle_time_s: f64,
    /// Length / F.
    pub cam_time_s: f64,
    /// cycle_time_s / cam_time_s; null without motion.
    pub time_ratio: Option<f64>,
    /// Share of the cycle time within 0.1 % of the programmed F.
    pub programmed_feed_share: f64,
    /// Executed path of the linear axes.
    pub path_length_mm: f64,
    /// Motion blocks executed.
    pub blocks: u64,
    /// N, the start posture not counted.
    pub setpoints: u64,
    /// Share of the cycle time per limit; sums to 1.
    pub limits: BTreeMap<String, f64>,
    /// All blended corners.
    pub corners_total: u64,
    /// The first 10,000 of them.
    pub corners: Vec<CornerSummary>,
    /// Per axis, in the machine's order; rotary axes in deg.
    pub axes: Map<String, Value>,
    /// Changes of the feed override at run time (`--override`), in order; left out without any.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<OverrideSummary>,
    /// What a person should know.
    pub warnings: Vec<Warning>,
    /// The alarm that ended the program early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alarm: Option<Warning>,
}

/// One change of the feed override.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct OverrideSummary {
    /// As asked for; it acts from the first set-point at or after it.
    pub time_s: f64,
    /// Of the programmed feed.
    pub override_percent: f64,
}

/// One blended corner.
#[derive(Clone, Debug, Serialize)]
pub struct CornerSummary {
    /// Line of the block that ends in the corner.
    pub line: u32,
    /// Turning angle.
    pub angle_deg: f64,
    /// epsilon as executed.
    pub tolerance_mm: f64,
    /// T.
    pub transition_length_mm: f64,
    /// Feed at the entry.
    pub feed_mm_s: f64,
}

/// One finding in JSON.
#[derive(Clone, Debug, Serialize, PartialEq, Eq)]
pub struct Warning {
    /// Stable code.
    pub code: String,
    /// File, as the user named it; left out without a place.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Line in it, 0 without one.
    pub line: u32,
    /// What it is.
    pub message: String,
}

impl From<&Diagnostic> for Warning {
    fn from(finding: &Diagnostic) -> Self {
        // Without folders: a recording knows no path.
        let name = |file: &str| file.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        let file = finding.place.as_ref().map(|place| name(&place.file));
        Self { code: finding.code.to_owned(), file, line: finding.line(), message: finding.message.clone() }
    }
}

impl RunSummary {
    /// Brings figures to the border. With `drives` the deviations of the drives are included.
    pub fn new(machine: &Machine, program: &str, figures: &Figures, drives: bool) -> Self {
        let cycle_time_s = machine.cycle.time_base.seconds(machine.cycle.time_base.setpoint_tick(figures.setpoints).0);
        let share = |ticks: u64| if figures.setpoints == 0 { 0.0 } else { ticks as f64 / figures.setpoints as f64 };
        let mut axes = Map::new();
        for id in machine.axis_ids() {
            let axis = machine.axis(id);
            axes.insert(axis.name.clone(), axis_json(axis.kind, &figures.axes[id], drives));
        }
        Self {
            format: 1,
            program: program.to_owned(),
            machine: machine.name.clone(),
            cycle_time_s,
            cam_time_s: figures.cam_time_s,
            time_ratio: (figures.cam_time_s > 0.0).then(|| cycle_time_s / figures.cam_time_s),
            programmed_feed_share: share(figures.at_programmed_feed),
            path_length_mm: figures.path_length_mm,
            blocks: figures.blocks,
            setpoints: figures.setpoints,
            limits: limit_shares(machine, figures),
            corners_total: figures.corners_total,
            corners: figures
                .corners
                .iter()
                .map(|(block, corner, entry_feed_mm_s)| CornerSummary {
                    line: block.line,
                    angle_deg: units::deg_from_rad(corner.angle_rad),
                    tolerance_mm: corner.tolerance_mm,
                    transition_length_mm: corner.transition_length_mm,
                    feed_mm_s: *entry_feed_mm_s,
                })
                .collect(),
            axes,
            overrides: Vec::new(),
            warnings: Vec::new(),
            alarm: None,
        }
    }

    /// Notes the changes of the feed override.
    pub fn add_overrides(&mut self, schedule: &OverrideSchedule) {
        let change = |change: &OverrideChange| OverrideSummary {
            time_s: change.time_s,
            override_percent: units::percent_from_ratio(change.override_ratio),
        };
        self.overrides.extend(schedule.changes().iter().map(change));
    }

    /// Adds findings: warnings and notes to `warnings`, errors too where they did not end the run.
    pub fn add_warnings<'a>(&mut self, findings: impl IntoIterator<Item = &'a Diagnostic>) {
        self.warnings.extend(findings.into_iter().map(Warning::from));
    }

    /// Notes the alarm that ended the run.
    pub fn set_alarm(&mut self, alarm: &Diagnostic) {
        debug_assert_eq!(alarm.severity, Severity::Error);
        self.alarm = Some(alarm.into());
    }
}

/// "feed", "X.jerk": a limit as a key.
pub(super) fn limit_name(machine: &Machine, limit: Limit) -> String {
    match limit.axis {
        Some(axis) if carries_axis(limit) => format!("{}.{}", machine.axis(axis).name, limit.kind.name()),
        _ => limit.kind.name().to_owned(),
    }
}

/// One warning for all axes whose drives are representative, one for all that are ideal.
pub fn drive_warnings(machine: &Machine, drives: bool) -> Vec<Diagnostic> {
    let mut warnings = Vec::new();
    if !drives {
        return warnings;
    }
    let names = |axes: Vec<AxisId>| {
        let names: Vec<&str> = axes.iter().map(|id| machine.axis(*id).name.as_str()).collect();
        (!names.is_empty()).then(|| names.join(", "))
    };
    if let Some(names) = names(machine.representative_drives().collect()) {
        let message = format!(
            "representative drive: the drive data of {names} are not identified on a real machine, so that deviations, following errors and \
             currents show the class of machine, not this one"
        );
        warnings.push(Diagnostic::warning("D0002", message));
    }
    if let Some(names) = names(machine.ideal_axes().collect()) {
        let message = format!("ideal axis: {names} without drive data: actual = set-point");
        warnings.push(Diagnostic::warning("D0003", message));
    }
    warnings
}

/// Shares by name. Limits of one name are added up: a corner, say, may be limited by one axis here and by another there.
fn limit_shares(machine: &Machine, figures: &Figures) -> BTreeMap<String, f64> {
    let mut ticks: BTreeMap<String, u64> = BTreeMap::new();
    for (limit, count) in &figures.limits {
        *ticks.entry(limit_name(machine, *limit)).or_insert(0) += count;
    }
    ticks.into_iter().map(|(name, count)| (name, count as f64 / figures.setpoints as f64)).collect()
}

/// The contract's keys without an axis: feed, corner, cycle, look_ahead, dwell, in_position, override.
fn carries_axis(limit: Limit) -> bool {
    use crate::feed::LimitKind::*;
    matches!(
        limit.kind,
        Velocity | Acceleration | Jerk | RadialAcceleration | RadialJerk | TransitionJerk | Positioning
    )
}

fn axis_json(kind: AxisKind, figures: &AxisFigures, drives: bool) -> Value {
    let (unit, scale) = match kind {
        AxisKind::Linear => ("mm", 1.0),
        AxisKind::Rotary => ("deg", units::DEG_PER_RAD),
    };
    let mut fields = Map::new();
    let mut put = |name: String, value_lu: f64| {
        fields.insert(name, json!(value_lu * scale));
    };
    put(format!("velocity_max_{unit}_s"), figures.velocity_max_lu_s);
    put(format!("acceleration_max_{unit}_s2"), figures.acceleration_max_lu_s2);
    put(format!("jerk_max_{unit}_s3"), figures.jerk_max_lu_s3);
    if drives {
        put(format!("control_deviation_max_{unit}"), figures.control_deviation_lu.max());
        put(format!("control_deviation_rms_{unit}"), figures.control_deviation_lu.rms());
        put(format!("following_error_max_{unit}"), figures.following_error_lu.max());
        put(format!("following_error_rms_{unit}"), figures.following_error_lu.rms());
    }
    Value::Object(fields)
}
