//! `[cycle]`, `[look_ahead]`, `[feed]`, `[smoothing]`, `[spindle]` and `[kinematics]`: from the file to checked settings.
//!
//! In: the sections of a machine file. Out: the settings in internal units. Checks what needs more than one key: that the axes of
//! the kinematics exist and turn, that a direction is one. The clock is made in `clock`, after the axes.

use super::checked::{Axis, FeedSettings, KinematicsSettings, RotaryJoint, SmoothingSettings, SpindleSettings};
use super::choices::{Carries, Choice, KinematicsType};
use super::document::Node;
use super::section::Section;
use crate::base::diagnostics::{Diagnostic, nearest};
use crate::base::units::{rad_from_deg, rad_from_rot, rad_s_from_rpm, s_from_ms};
use crate::base::{AxisId, AxisKind};

/// Rotary axes that a kinematic chain may have.
const JOINTS_MAX: usize = 2;

pub(super) fn look_ahead_blocks(root: &Section<'_>) -> usize {
    root.table("look_ahead", "look_ahead").whole("blocks").map_or(1, |blocks| blocks as usize)
}

pub(super) fn feed(root: &Section<'_>) -> FeedSettings {
    let feed = root.table("feed", "feed");
    FeedSettings {
        time_law: feed.choice("time_law"),
        default_path_mode: feed.choice("default_path_mode"),
        default_acceleration_mode: feed.choice("default_acceleration_mode"),
        corner_rule: feed.choice("corner_rule"),
        overload_ratio: feed.number("overload_factor"),
        curvature_jump: feed.choice("curvature_jump"),
        arc_limits: feed.choice("arc_limits"),
    }
}

pub(super) fn smoothing(root: &Section<'_>) -> SmoothingSettings {
    let smoothing = root.table("smoothing", "smoothing");
    SmoothingSettings {
        alpha_ratio: smoothing.number("alpha"),
        tolerance_ratio: smoothing.number("tolerance_ratio"),
        tolerance_reversal_ratio: smoothing.number("tolerance_ratio_reversal"),
        contour_tolerance_mm: smoothing.number("contour_tolerance_mm"),
        rounding_distance_mm: smoothing.optional_number("rounding_distance_mm"),
        radial_acceleration_share: smoothing.number("radial_acceleration_share"),
        radial_jerk_share: smoothing.number("radial_jerk_share"),
        blend_law: smoothing.choice("blend_law"),
        shape: smoothing.choice("shape"),
        limits: smoothing.choice("limits"),
        orientation_tolerance_rad: rad_from_deg(smoothing.number("orientation_tolerance_deg")),
        transition_tolerance_mm: smoothing.number("transition_tolerance_mm"),
        rapid_tolerance_ratio: smoothing.number("rapid_tolerance_ratio"),
        compressor_blocks: smoothing.choice("compressor_blocks"),
        compressor_length_max_mm: smoothing.number("compressor_length_max_mm"),
        compressor_corner_rad: rad_from_deg(smoothing.number("compressor_corner_deg")),
    }
}

pub(super) fn spindle(root: &Section<'_>) -> Option<SpindleSettings> {
    let spindle = root.table("spindle", "spindle");
    let tolerance_share = spindle.number("speed_tolerance");
    let acceleration_rot_s2 = spindle.optional_number("acceleration_rot_s2");
    let positioning_rot_s2 = spindle.optional_number("positioning_acceleration_rot_s2");
    let [waits_for_stop, starts_at_once] = ["feed_waits_for_stop", "feed_starts_at_once"].map(|key| spindle.flag(key));
    let [positioning_speed_rpm, lag_ms] = ["positioning_speed_rpm", "lag_ms"].map(|key| spindle.number(key));
    let acceleration_rot_s2 = acceleration_rot_s2?;
    let positioning_rot_s2 = positioning_rot_s2.unwrap_or(acceleration_rot_s2);
    Some(SpindleSettings {
        acceleration_rad_s2: rad_from_rot(acceleration_rot_s2),
        tolerance_share,
        starts_at_once,
        waits_for_stop,
        positioning_speed_rad_s: rad_s_from_rpm(positioning_speed_rpm),
        positioning_acceleration_rad_s2: rad_from_rot(positioning_rot_s2),
        lag_s: s_from_ms(lag_ms),
    })
}

pub(super) fn kinematics(root: &Section<'_>, axes: &[Axis]) -> KinematicsSettings {
    let section = root.table("kinematics", "kinematics");
    let kind: KinematicsType = section.choice("type");
    let joints = section.list("rotary");
    if kind == KinematicsType::Cartesian {
        if joints.is_some_and(|joints| !joints.is_empty()) {
            let message =
                "kinematics.rotary needs type = \"table-table\" or \"head-table\", and the type is \"cartesian\"";
            section.report_at(
                "rotary",
                "",
                Diagnostic::error("M0008", message).help("write the type, or remove rotary"),
            );
        }
        return KinematicsSettings::Cartesian;
    }
    require_linear_axes(&section, axes);
    let joints = joints.unwrap_or(&[]);
    if joints.is_empty() || joints.len() > JOINTS_MAX {
        let message = format!(
            "kinematics.type = \"{}\" needs one or two rotary axes, and kinematics.rotary has {}",
            kind.word(),
            joints.len()
        );
        let help = "write rotary = [{ axis = \"A\", direction = [-1, 0, 0], point_mm = [0, 0, 0] }, ...], \
                    in order from the machine base to the part or to the tool";
        section.report_at("rotary", "", Diagnostic::error("M0008", message).help(help));
    }
    let (mut table, mut head) = (Vec::new(), Vec::new());
    for (place, node) in joints.iter().enumerate() {
        let (carries, joint) = joint(&section, place, node, kind, axes);
        let Some(joint) = joint else { continue };
        if table.iter().chain(&head).any(|known: &RotaryJoint| known.axis == joint.axis) {
            let name = &axes[joint.axis.index()].name;
            let message = format!("kinematics.rotary names the axis {name} twice");
            let diagnostic = Diagnostic::error("M0008", message).help("an axis turns at one place of the chain only");
            section.report(&node.mark, "", diagnostic);
        }
        match carries {
            Carries::Part => table.push(joint),
            Carries::Tool => head.push(joint),
        }
    }
    KinematicsSettings::Rotary { table, head }
}

/// The transformation works on the linear axes X, Y and Z.
fn require_linear_axes(section: &Section<'_>, axes: &[Axis]) {
    for name in ["X", "Y", "Z"] {
        if !axes.iter().any(|axis| axis.name == name && axis.kind == AxisKind::Linear) {
            let message =
                format!("kinematics with rotary axes needs the linear axes X, Y and Z, and there is no {name}");
            let help = format!("add [axes.{name}], or write type = \"cartesian\"");
            section.report_at("type", "", Diagnostic::error("M0008", message).help(help));
        }
    }
}

fn joint(
    parent: &Section<'_>,
    place: usize,
    node: &Node,
    kind: KinematicsType,
    axes: &[Axis],
) -> (Carries, Option<RotaryJoint>) {
    let section = parent.item("rotary", place, node, "kinematics.rotary");
    let carries: Carries = if section.has("carries") { section.choice("carries") } else { Carries::Part };
    if kind == KinematicsType::HeadTable && !section.has("carries") {
        let message = format!("{} does not say what the axis carries", section.path);
        let help = "add carries = \"tool\" for an axis of the head, carries = \"part\" for one of the table";
        section.report(&section.mark, "", Diagnostic::error("M0004", message).help(help));
    }
    if kind == KinematicsType::TableTable && carries == Carries::Tool {
        let message = format!("{} carries the tool, and the type is \"table-table\"", section.path);
        section.report_at("carries", "", Diagnostic::error("M0008", message).help("write type = \"head-table\""));
    }
    let axis = section.text("axis").and_then(|name| rotary_axis(&section, name, axes));
    let direction = section.numbers::<3>("direction").map(|direction| unit_vector(&section, direction));
    let point_mm = section.numbers::<3>("point_mm").unwrap_or([0.0; 3]);
    let joint = axis.zip(direction).map(|(axis, direction)| RotaryJoint { axis, direction, point_mm });
    (carries, joint)
}

fn rotary_axis(section: &Section<'_>, name: &str, axes: &[Axis]) -> Option<AxisId> {
    let names = || axes.iter().filter(|axis| axis.kind == AxisKind::Rotary).map(|axis| axis.name.as_str());
    let Some(place) = axes.iter().position(|axis| axis.name == name) else {
        let message = format!("{}.axis = \"{name}\": the machine has no such axis", section.path);
        let help = match nearest(name, names()) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None => format!("add [axes.{name}] with kind = \"rotary\"; the rotary axes are: {}", list(names())),
        };
        section.report_at("axis", "no such axis", Diagnostic::error("M0008", message).help(help));
        return None;
    };
    if axes[place].kind != AxisKind::Rotary {
        let message = format!("{}.axis = \"{name}\" is a linear axis", section.path);
        let help = format!("name a rotary axis: {}", list(names()));
        section.report_at("axis", "linear axis", Diagnostic::error("M0008", message).help(help));
        return None;
    }
    Some(AxisId::new(place))
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

fn unit_vector(section: &Section<'_>, direction: [f64; 3]) -> [f64; 3] {
    // Scaled first, so that the squares neither overflow nor vanish.
    let largest = direction.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 && direction.iter().all(|x| !x.is_nan()) {
        let message = format!("{}.direction = [0, 0, 0] is no direction", section.path);
        let help = "write the axis of rotation, such as [0, 0, 1]; its length does not matter";
        section.report_at("direction", "", Diagnostic::error("M0006", message).help(help));
    }
    let scaled = direction.map(|x| x / largest);
    let length = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    scaled.map(|x| x / length)
}
