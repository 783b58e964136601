//! Machines made by hand, and short ways to run a program: for tests and benches of the rooms `program` and `interpreter`.
#![allow(dead_code)]

use sollwert::base::units::rad_from_deg;
use sollwert::base::{AxisKind, Diagnostic, TimeBase};
use sollwert::interpreter::{Interpreter, Listing, Move};
use sollwert::machine::*;
use sollwert::program::ProgramSource;

/// A linear axis.
pub fn linear(name: &str, travel_mm: [f64; 2]) -> Axis {
    Axis {
        name: name.to_owned(),
        kind: AxisKind::Linear,
        index: 1,
        machine_axis: None,
        limits: AxisLimits {
            velocity_max_lu_s: 500.0,
            acceleration_max_lu_s2: 1000.0,
            jerk_max_lu_s3: 15000.0,
            transition_jerk_max_lu_s3: 10000.0,
        },
        follow_up_tolerance_lu: 0.01,
        travel_lu: Some(travel_mm),
        home_lu: 0.0,
        modulo: false,
        drive: None,
    }
}

/// A rotary axis; endless without travel.
pub fn rotary(name: &str, travel_deg: Option<[f64; 2]>) -> Axis {
    Axis {
        kind: AxisKind::Rotary,
        travel_lu: travel_deg.map(|travel| travel.map(rad_from_deg)),
        modulo: travel_deg.is_none(),
        ..linear(name, [0.0, 0.0])
    }
}

/// A machine with these axes.
pub fn machine(axes: Vec<Axis>) -> Machine {
    Machine {
        name: "Test".to_owned(),
        control: "SINUMERIK 840D".to_owned(),
        cycle: Cycle {
            time_base: TimeBase::new((1_000_000, 1), 16),
            control_cycle_s: 0.001,
            sampling_ratio: 1.0,
            fine_interpolation: FineInterpolation::Linear,
        },
        look_ahead_blocks: 8,
        feed: FeedSettings {
            time_law: TimeLawKind::SevenPhase,
            default_path_mode: PathMode::G642,
            default_acceleration_mode: AccelerationMode::Soft,
            corner_rule: CornerRule::FollowUp,
            overload_ratio: 1.2,
            curvature_jump: CurvatureJump::Signed,
            arc_limits: ArcLimits::Worst,
        },
        smoothing: SmoothingSettings {
            alpha_ratio: 2.5,
            tolerance_ratio: 0.8,
            tolerance_reversal_ratio: 0.6,
            contour_tolerance_mm: 0.1,
            rounding_distance_mm: None,
            radial_acceleration_share: 0.2,
            radial_jerk_share: 0.2,
            blend_law: BlendLaw::Limits,
            shape: BlendShape::Hermite3,
            limits: BlendLimits::Axis,
        },
        kinematics: KinematicsSettings::Cartesian,
        axes,
    }
}

/// Three linear axes with the travel of the Spinner MVC 850.
pub fn xyz() -> Machine {
    machine(vec![linear("X", [-425.0, 425.0]), linear("Y", [-250.0, 250.0]), linear("Z", [0.0, 500.0])])
}

/// Head B, table C (endless).
pub fn xyzbc() -> Machine {
    machine(vec![
        linear("X", [-400.0, 400.0]),
        linear("Y", [-300.0, 300.0]),
        linear("Z", [-100.0, 650.0]),
        rotary("B", Some([-110.0, 110.0])),
        rotary("C", None),
    ])
}

/// What a program comes to.
pub struct Run {
    pub moves: Vec<Move>,
    pub warnings: Vec<Diagnostic>,
    pub alarm: Option<Diagnostic>,
    /// `.moves` text.
    pub listing: String,
}

/// Runs bytes on a machine, at most a million moves.
pub fn run_bytes(bytes: &[u8], machine: &Machine) -> Run {
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("test.mpf", bytes), machine);
    let mut listing = Listing::new(machine);
    let mut run = Run { moves: Vec::new(), warnings: Vec::new(), alarm: None, listing: String::new() };
    for _ in 0..1_000_000 {
        match interpreter.next_move() {
            Ok(Some(next)) => {
                run.listing.push_str(&listing.line(&next));
                run.listing.push('\n');
                run.moves.push(next);
            }
            Ok(None) => break,
            Err(alarm) => {
                run.alarm = Some(*alarm);
                assert_eq!(interpreter.next_move(), Ok(None), "nothing comes after an alarm");
                break;
            }
        }
    }
    run.warnings = interpreter.take_warnings();
    run
}

/// Runs a program on [`xyz`].
pub fn run(text: &str) -> Run {
    run_bytes(text.as_bytes(), &xyz())
}

impl Run {
    /// Lines of the listing without modes and without the opening of the program, for short comparisons.
    pub fn lines(&self) -> Vec<String> {
        assert!(self.alarm.is_none(), "{}", self.alarm.as_ref().unwrap().render(false));
        self.bare_lines()
    }

    /// The same, whatever happened at the end.
    pub fn bare_lines(&self) -> Vec<String> {
        let without = |line: &str, from: &str, to: &str| match line.split_once(from) {
            Some((before, rest)) => format!("{before}{}", rest.split_once(to).map_or("", |(_, after)| after)),
            None => line.to_owned(),
        };
        let bare = |line: &str| without(&without(line, " [", "]"), " open=\"", "\"");
        self.listing.lines().map(bare).collect()
    }

    /// The alarm.
    pub fn alarm(&self) -> &Diagnostic {
        self.alarm.as_ref().expect("the program raises an alarm")
    }
}
