//! Every key of a machine file: name, unit, range, default, machine data, meaning.
//!
//! In: nothing. Out: [`tables`]. One row a key, for the control here and for the axes in `axis_catalogue`.
//! The checks that need more than one key (lower < upper, whole ratios of cycles) are not here but in `control`, `axis`, `drive`.

use super::axis_catalogue::{AXIS, DYNAMICS};
use super::checked::{
    AccelerationMode, ArcLimits, BlendLaw, BlendLimits, BlendShape, CompressorBlocks, CornerRule, CurvatureJump,
    FineInterpolation, PathMode, TimeLawKind,
};
use super::choices::{Carries, KinematicsType, words};
use super::drive_catalogue::DRIVE;
use super::keys::{Absent, Accepts, Key, Range, TableKeys};
use super::mechanics_catalogue::{ENCODER, MECHANICS, MOTOR};
use Absent::{Means, No, Number as Value, Required, Word};
use Accepts::{Choice, Flag, Joints, Number, Text, Vector, Whole};

/// The version of the file format that this version of the program reads.
pub(super) const FORMAT: u32 = 1;
/// Longest control cycle, ms: a second is far beyond any control.
const CONTROL_CYCLE_MAX_MS: f64 = 1000.0;

/// Every table of a machine file, in the order of the documentation.
pub fn tables() -> &'static [TableKeys] {
    TABLES
}

const TABLES: &[TableKeys] = &[
    TableKeys {
        path: "",
        keys: ROOT,
        tables: &["cycle", "look_ahead", "feed", "smoothing", "spindle", "kinematics", "axes"],
    },
    TableKeys { path: "cycle", keys: CYCLE, tables: &[] },
    TableKeys { path: "look_ahead", keys: LOOK_AHEAD, tables: &[] },
    TableKeys { path: "feed", keys: FEED, tables: &[] },
    TableKeys { path: "smoothing", keys: SMOOTHING, tables: &[] },
    TableKeys { path: "spindle", keys: SPINDLE, tables: &[] },
    TableKeys { path: "kinematics", keys: KINEMATICS, tables: &[] },
    TableKeys { path: "kinematics.rotary", keys: JOINT, tables: &[] },
    TableKeys { path: "axes.*", keys: AXIS, tables: &["dynamics", "drive", "motor", "mechanics", "encoder"] },
    TableKeys { path: "axes.*.dynamics.*", keys: DYNAMICS, tables: &[] },
    TableKeys { path: "axes.*.drive", keys: DRIVE, tables: &[] },
    TableKeys { path: "axes.*.motor", keys: MOTOR, tables: &[] },
    TableKeys { path: "axes.*.mechanics", keys: MECHANICS, tables: &[] },
    TableKeys { path: "axes.*.encoder", keys: ENCODER, tables: &[] },
];

const ROOT: &[Key] = &[
    Key::new("format", "", Whole(FORMAT, FORMAT), Required, "version of the file format"),
    Key::new("name", "", Text, Required, "name of the machine, for people"),
    Key::new("control", "", Text, Word("generic"), "control, for people"),
];

const CYCLE: &[Key] = &[
    Key::new("t_cyl_ms", "ms", Number(Range::UpTo(0.0, CONTROL_CYCLE_MAX_MS)), Required, "cycle time of the control")
        .md("MD10071"),
    Key::new("f_s", "", Number(Range::UpTo(0.0, 1.0)), Value(1.0), "sampling factor: set-points every f_s * t_cyl"),
    Key::new(
        "fine_interpolation",
        "",
        Choice(words::<FineInterpolation>),
        Word("cubic"),
        "from the set-point cycle to the position cycle, where they differ",
    )
    .md("MD33000"),
];

const LOOK_AHEAD: &[Key] = &[Key::new(
    "blocks",
    "",
    Whole(1, 100_000),
    Value(100.0),
    "motion blocks that the look-ahead sees beyond the active one",
)
.md("MD28060")];

const FEED: &[Key] = &[
    Key::new(
        "time_law",
        "",
        Choice(words::<TimeLawKind>),
        Word("seven-phase"),
        "acceleration at block ends: zero, or carried over",
    ),
    Key::new(
        "default_path_mode",
        "",
        Choice(words::<PathMode>),
        Word("G642"),
        "path mode before the program says otherwise",
    )
    .md("MD20150"),
    Key::new(
        "default_acceleration_mode",
        "",
        Choice(words::<AccelerationMode>),
        Word("SOFT"),
        "jerk-limited or not, before the program says otherwise",
    )
    .md("MD20150"),
    Key::new(
        "corner_rule",
        "",
        Choice(words::<CornerRule>),
        Word("follow_up"),
        "axis-velocity step at a corner in G64: sqrt(8 A e), or overload_factor * A * t_s",
    ),
    Key::new(
        "overload_factor",
        "",
        Number(Range::Positive),
        Value(1.2),
        "factor on the acceleration of one set-point cycle, for corner_rule = \"overload\"",
    )
    .md("MD32310"),
    Key::new(
        "curvature_jump",
        "",
        Choice(words::<CurvatureJump>),
        Word("signed"),
        "transition feed between arcs: from the difference of the curvatures with their sense, or of their amounts, as printed",
    ),
    Key::new(
        "arc_limits",
        "",
        Choice(words::<ArcLimits>),
        Word("worst"),
        "feed limits of an arc: worst direction met, with the shares R_A and R_J, or as printed: all of A in the direction of the entry",
    ),
];

const SMOOTHING: &[Key] = &[
    Key::new(
        "alpha",
        "",
        Number(Range::Between(0.0, 4.0)),
        Value(2.5),
        "end tangents of a blend, in transition lengths",
    ),
    Key::new(
        "tolerance_ratio",
        "",
        Number(Range::UpTo(0.0, 1.0)),
        Value(0.8),
        "beta: executed over programmed contour tolerance",
    ),
    Key::new("tolerance_ratio_reversal", "", Number(Range::UpTo(0.0, 1.0)), Value(0.6), "beta where an axis reverses"),
    Key::new(
        "contour_tolerance_mm",
        "mm",
        Number(Range::Positive),
        Value(0.1),
        "contour tolerance of G642 without CTOL",
    )
    .md("SD42465"),
    Key::new(
        "rounding_distance_mm",
        "mm",
        Number(Range::NotNegative),
        Means("0: G641 is G64"),
        "rounding distance of G641 without ADIS",
    ),
    Key::new(
        "radial_acceleration_share",
        "",
        Number(Range::Between(0.0, 1.0)),
        Value(0.2),
        "R_A: share of the acceleration that curvature may use",
    )
    .md("MD20602"),
    Key::new(
        "radial_jerk_share",
        "",
        Number(Range::Between(0.0, 1.0)),
        Value(0.2),
        "R_J: share of the jerk that curvature may use",
    )
    .md("MD20603"),
    Key::new(
        "blend_law",
        "",
        Choice(words::<BlendLaw>),
        Word("limits"),
        "feed inside a blend: all limits hold, the entry feed is held, or the printed loop, which breaks its own limits (counted in a warning)",
    ),
    Key::new("shape", "", Choice(words::<BlendShape>), Word("hermite3"), "curve of a blend"),
    Key::new(
        "limits",
        "",
        Choice(words::<BlendLimits>),
        Word("axis"),
        "limits of a blend: per axis, or of the path, whatever its direction: the least of the axes that move in it",
    ),
    Key::new(
        "orientation_tolerance_deg",
        "deg",
        Number(Range::Positive),
        Value(0.1),
        "tolerance of rotary axes without OTOL",
    )
    .md("SD42466"),
    Key::new(
        "transition_tolerance_mm",
        "mm",
        Number(Range::Positive),
        Value(0.005),
        "tolerance of G645 where a tangential transition changes its curvature",
    )
    .md("MD33120"),
    Key::new(
        "rapid_tolerance_ratio",
        "",
        Number(Range::Positive),
        Value(1.0),
        "factor of the tolerances between two rapids without STOLF",
    )
    .md("MD20560"),
    Key::new(
        "compressor_blocks",
        "",
        Choice(words::<CompressorBlocks>),
        Word("lines"),
        "blocks that the compressor takes: G1 (hundreds digit 0), and circles (1), and G0 (2), and both (3)",
    )
    .md("MD20482"),
    Key::new(
        "compressor_length_max_mm",
        "mm",
        Number(Range::Positive),
        Value(20.0),
        "longest block that the compressor takes",
    )
    .md("MD20170"),
    Key::new(
        "compressor_corner_deg",
        "deg",
        Number(Range::Between(0.0, 90.0)),
        Value(36.0),
        "turning angle from which the compressor leaves a corner",
    )
    .md("SD42470"),
];

const SPINDLE: &[Key] = &[
    Key::new(
        "acceleration_rot_s2",
        "rot/s²",
        Number(Range::Between(0.1, 1e5)),
        Means("at its speed at once"),
        "acceleration of the master spindle in speed control",
    )
    .md("MD35200"),
    Key::new(
        "speed_max_rpm",
        "rpm",
        Number(Range::Between(0.1, 1e6)),
        Means("no limit"),
        "highest speed of the master spindle: a higher S turns it at this one",
    )
    .md("MD35100, MD35130"),
    Key::new("feed_starts_at_once", "", Flag, No, "a feed does not wait for the speed of the spindle (MD35500 = 0)")
        .md("MD35500"),
    Key::new(
        "speed_tolerance",
        "",
        Number(Range::Between(0.0, 1.0)),
        Value(0.1),
        "a feed waits until the speed is this near, as a share of it",
    )
    .md("MD35150, MD35500"),
    Key::new("feed_waits_for_stop", "", Flag, No, "a feed behind M5 waits until the spindle stands").md("MD35510"),
    Key::new(
        "positioning_speed_rpm",
        "rpm",
        Number(Range::Between(0.1, 1e5)),
        Value(500.0),
        "speed of SPOS and M19, and at which a spindle that turns goes over to them",
    )
    .md("MD35300"),
    Key::new(
        "positioning_acceleration_rot_s2",
        "rot/s²",
        Number(Range::Between(0.1, 1e5)),
        Means("as acceleration_rot_s2"),
        "acceleration of the master spindle in position control: SPOS, M19, G331, G332",
    )
    .md("MD35210, MD35212"),
    Key::new(
        "lag_ms",
        "ms",
        Number(Range::NotNegative),
        Value(0.0),
        "delay of first order from the set-point of the speed to the actual one",
    ),
];

const KINEMATICS: &[Key] = &[
    Key::new(
        "type",
        "",
        Choice(words::<KinematicsType>),
        Word("cartesian"),
        "linear axes only, two rotary axes in the table, or rotary axes in head and table",
    ),
    Key::new(
        "rotary",
        "",
        Joints,
        Means("none; required unless cartesian"),
        "rotary axes, in order from the machine base to the part or to the tool",
    ),
];

const JOINT: &[Key] = &[
    Key::new("axis", "", Text, Required, "name of the rotary axis"),
    Key::new(
        "direction",
        "",
        Vector,
        Required,
        "axis of rotation: a positive angle turns right-handed about it what the axis carries",
    ),
    Key::new("point_mm", "mm", Vector, Means("[0, 0, 0]"), "a point on the axis of rotation, at all angles 0"),
    Key::new(
        "carries",
        "",
        Choice(words::<Carries>),
        Means("\"part\"; required for \"head-table\""),
        "what the axis turns: an axis of the head carries the tool, one of the table the part",
    ),
];
