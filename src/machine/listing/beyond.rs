//! What the control does with its axes and a machine file has no word for: said, so that nobody believes it simulated.
//!
//! In: the listing. Out: notes and warnings; units of its own refuse the import, because every number would be wrong. Compensation of
//! leadscrew errors and sag takes away errors that the simulated mechanics do not have: nothing is lost without it.

use super::axes::FoundAxis;
use super::data::Scope;
use super::import::Draft;
use crate::base::units::{MM_PER_INCH, MM_PER_M};
use crate::base::{AxisKind, Diagnostic};

/// MD10220: bit and standard factor of the only unit that has one.
const GAIN_BIT: u32 = 9;
/// Units that MD10230 can change.
const UNITS: u32 = 16;

/// How the numbers of a listing are to be read.
pub(super) struct Units {
    /// From the listing to 1/s of the position gain, if it is not the standard one.
    pub gain_per_s: Option<f64>,
    /// Of a listing in inches: mm in one.
    pub inch_mm: Option<f64>,
}

/// Refuses units of its own; inches are converted when the axes are known.
pub(super) fn units(draft: &mut Draft<'_>) -> Result<Units, Diagnostic> {
    let gain_per_s = gain(draft)?;
    let nobody = [String::new()];
    let system = draft.listing.number(Scope::General, "SCALING_SYSTEM_IS_METRIC", &nobody, 0);
    let works_in_inches = system.as_ref().is_some_and(|(metric, _)| *metric == 0.0) && !draft.listing.metric;
    let written = draft.listing.inch.as_ref().map(|spot| format!("INCH ({}:{})", spot.file, spot.line));
    let Some(why) = written.or(system.filter(|_| works_in_inches).map(|(_, source)| format!("{source} = 0"))) else {
        return Ok(Units { gain_per_s, inch_mm: None });
    };
    let inch = draft.listing.number(Scope::General, "SCALING_VALUE_INCH", &nobody, 0);
    let inch_mm = inch.map_or(MM_PER_INCH, |(inch_mm, _)| inch_mm);
    if !(inch_mm > 0.0 && inch_mm.is_finite()) {
        let finding = Diagnostic::error("M0305", format!("the listing is in inches of {inch_mm} mm (MD10250)"));
        let spot = draft.listing.spot(Scope::General, "SCALING_VALUE_INCH", &nobody, 0);
        return Err(spot.map_or_else(|| finding.clone(), |spot| spot.mark(finding.clone(), "")).help("expected 25.4"));
    }
    let message = format!("{why}: the listing is in inches, its lengths are multiplied by {inch_mm}");
    let help = "if its values are metric, write METRIC into its first line; the comments beside the values name the data as they stood";
    draft.warnings.push(Diagnostic::note("M0305", message).help(help));
    Ok(Units { gain_per_s, inch_mm: Some(inch_mm) })
}

/// Data in mm, mm/min or mm/rev that something is made of.
const LENGTHS: [(Scope, &str); 6] = [
    (Scope::Channel, "COMPRESS_BLOCK_PATH_LIMIT"),
    (Scope::ChannelSetting, "SMOOTH_CONTUR_TOL"),
    (Scope::Channel, "TRAFO5_BASE_TOOL_1"),
    (Scope::Channel, "TRAFO5_JOINT_OFFSET_1"),
    (Scope::Channel, "TRAFO5_JOINT_OFFSET_PART_1"),
    (Scope::Channel, "TRAFO5_PART_OFFSET_1"),
];
/// Of a tool carrier: l1, l2, l3, l4.
const CARRIER_LENGTHS: [u32; 12] = [1, 2, 3, 4, 5, 6, 15, 16, 17, 18, 19, 20];
/// Of linear axes.
const AXIS_LENGTHS: [&str; 15] = [
    "ENC_GRID_POINT_DIST",
    "LEADSCREW_PITCH",
    "MAX_AX_VELO",
    "BACKLASH",
    "FRICT_COMP_CONST_MAX",
    "FRICT_COMP_CONST_MIN",
    "PATH_TRANS_POS_TOL",
    "COMPRESS_POS_TOL",
    "STOP_LIMIT_COARSE",
    "STOP_LIMIT_FINE",
    "STANDSTILL_POS_TOL",
    "CLAMP_POS_TOL",
    "POS_LIMIT_MINUS",
    "POS_LIMIT_PLUS",
    "CONTOUR_TOL",
];
/// Of linear axes, in m/s² or m/s³ on a metric control: inch/s², inch/s³ on the other.
const AXIS_ACCELERATIONS: [&str; 6] = [
    "MAX_AX_ACCEL",
    "MAX_AX_JERK",
    "PATH_TRANS_JERK_LIM",
    "FRICT_COMP_ACCEL1",
    "FRICT_COMP_ACCEL2",
    "FRICT_COMP_ACCEL3",
];

/// From inches, as the manual describes MD10240: inch, inch/min, inch/s², inch/s³; the gain in 1000/min stays.
pub(super) fn from_inches(draft: &mut Draft<'_>, axes: &[FoundAxis], inch_mm: f64) {
    let linear: Vec<String> =
        axes.iter().filter(|axis| axis.kind == AxisKind::Linear).flat_map(|axis| axis.theirs.clone()).collect();
    let nobody = [String::new()];
    for (scope, name) in LENGTHS {
        draft.listing.scale(scope, name, &nobody, inch_mm);
    }
    for number in CARRIER_LENGTHS {
        draft.listing.scale(Scope::ToolCarrier, &format!("CARR{number}"), &nobody, inch_mm);
    }
    for name in AXIS_LENGTHS {
        draft.listing.scale(Scope::Axis, name, &linear, inch_mm);
    }
    for name in AXIS_ACCELERATIONS {
        draft.listing.scale(Scope::Axis, name, &linear, inch_mm / MM_PER_M);
    }
}

/// Sums behind lines, kinematic chains: what the reader passes over.
pub(super) fn passed_over(draft: &mut Draft<'_>) {
    let lines = draft.listing.summed_lines;
    if lines > 0 {
        let message = format!("{lines} lines carry a sum ('38c0, MD11230), which is not checked");
        draft.warnings.push(Diagnostic::note("M0312", message).help("after a transfer as text look at the values"));
    }
    let of = |start: &str| -> usize {
        let all = draft.listing.foreign.iter();
        all.filter(|(datum, _)| datum.starts_with(start)).map(|(_, count)| count).sum()
    };
    let (elements, transformations) = (of("$NK_"), of("$NT_"));
    if elements + transformations > 0 {
        let message = format!(
            "a kinematic chain ({elements} data $NK_, {transformations} data $NT_) is not taken over: the machine is cartesian unless MD24100 ff. say more"
        );
        let help = "write [kinematics] by hand: directions are $NK_OFF_DIR of the rotary axes, points the sum of the offsets before them; each datum is in the list of those without counterpart";
        draft.warnings.push(Diagnostic::warning("M0310", message).help(help));
    }
}

/// Refuses units of its own (MD10220); the factor from the listing to 1/s of the position gain, if it is not the standard one.
fn gain(draft: &mut Draft<'_>) -> Result<Option<f64>, Diagnostic> {
    let nobody = [String::new()];
    let Some((mask, _)) = draft.listing.number(Scope::General, "SCALING_USER_DEF_MASK", &nobody, 0) else {
        return Ok(None);
    };
    let mut gain = None;
    for bit in (0..UNITS).filter(|bit| mask as u32 >> bit & 1 == 1) {
        let factor = draft.listing.number(Scope::General, "SCALING_FACTORS_USER_DEF", &nobody, bit);
        match factor {
            Some((factor, _)) if bit == GAIN_BIT => gain = Some(factor),
            Some((factor, source)) if factor != 1.0 => {
                let finding =
                    Diagnostic::error("M0305", format!("the listing has units of its own: {source} = {factor}"));
                let help = "save it with the units of the manual (MD10220 = 'H200')";
                let spot = draft.listing.spot(Scope::General, "SCALING_FACTORS_USER_DEF", &nobody, bit);
                return Err(spot.map_or_else(|| finding.clone(), |spot| spot.mark(finding.clone(), "")).help(help));
            }
            _ => {}
        }
    }
    Ok(gain)
}

/// What is said of axes.
pub(super) fn axes(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let on = |draft: &mut Draft<'_>, axis: &FoundAxis, name: &str, place: u32| {
        draft.listing.number(Scope::Axis, name, &axis.theirs, place).is_some_and(|(value, _)| value != 0.0)
    };
    let mut said: Vec<(&str, &str, Vec<String>)> = [
        (
            "MD32900, MD32910: a time that adapts the lag of the axis to others (DYN_MATCH) is not simulated",
            "under feed-forward it does nothing; else give the axis the time as setpoint_delay_ms with feedforward_balancing = \"pt1\"",
        ),
        ("MD32890, MD32895: a delay of the set-points is not simulated", "it shifts the axis in time against the others"),
        ("MD32490 = 2: friction compensation by a learnt characteristic is not simulated", "MD32520 is taken as it stands"),
        (
            "MD32700, MD32710: compensation tables are not taken over",
            "the simulated mechanics have no error of the leadscrew and do not sag: there is nothing to compensate",
        ),
    ]
    .map(|(message, help)| (message, help, Vec::new()))
    .into();
    for axis in axes {
        let matched = on(draft, axis, "DYN_MATCH_ENABLE", 0) && on(draft, axis, "DYN_MATCH_TIME", 0);
        let delayed = on(draft, axis, "DESVAL_DELAY_ENABLE", 0) && on(draft, axis, "DESVAL_DELAY_TIME", 0);
        let mode = draft.listing.number(Scope::Axis, "FRICT_COMP_MODE", &axis.theirs, 0);
        let learnt = mode.is_some_and(|(mode, _)| mode == 2.0) && on(draft, axis, "FRICT_COMP_ENABLE", 0);
        let encoders = [0, 1].map(|place| on(draft, axis, "ENC_COMP_ENABLE", place));
        let tables = on(draft, axis, "CEC_ENABLE", 0) || encoders.contains(&true);
        for (place, holds) in [matched, delayed, learnt, tables].into_iter().enumerate() {
            if holds && let Some((_, _, names)) = said.get_mut(place) {
                names.push(axis.ours.clone());
            }
        }
    }
    for (message, help, names) in said.into_iter().filter(|(_, _, names)| !names.is_empty()) {
        let finding = Diagnostic::note("M0312", format!("{}: {message}", names.join(", ")));
        draft.warnings.push(finding.help(help));
    }
}
