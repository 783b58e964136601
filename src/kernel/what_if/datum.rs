//! The data that hold a motion back, and machines on which one of them is larger.
//!
//! In: a limit that holds on a piece. Out: the [`Datum`]s behind it, their keys, and a machine with one of them raised. Does not plan.

use crate::base::{AxisId, AxisKind};
use crate::feed::{Limit, LimitKind, PlannedPiece};
use crate::geometry::Curve;
use crate::interpreter::{Feed, Move};
use crate::machine::{AxisLimits, CornerRule, DynamicsMode, Machine, PathMode, tables};
use crate::smoothing::PieceKind;
use std::sync::Arc;

/// A datum is raised by this.
const RAISED_RATIO: f64 = 1.1;

/// A share that is raised leaves something.
const SHARE_MAX_RATIO: f64 = 0.99;

/// Something that a motion depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Datum {
    /// A limit of an axis, in one of its dynamics sets if it has such.
    Axis {
        axis: AxisId,
        set: Option<DynamicsMode>,
        what: AxisDatum,
    },
    /// The tolerance of the corner rule "follow_up".
    CornerTolerance {
        axis: AxisId,
    },
    /// The factor of the corner rule "overload".
    Overload,
    /// R_A, R_J.
    RadialAcceleration,
    RadialJerk,
    ContourTolerance,
    LookAhead,
    /// F of the program.
    ProgrammedFeed,
}

/// A limit of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AxisDatum {
    Velocity,
    Acceleration,
    Jerk,
    TransitionJerk,
}

/// The data behind a limit that holds on a piece.
pub(super) fn behind(machine: &Machine, piece: &PlannedPiece, limit: Limit) -> Vec<Datum> {
    let contour = &piece.path.contour;
    let blend = matches!(contour.kind, PieceKind::Blend(..));
    let of = |what: AxisDatum| {
        limit.axis.map(|axis| {
            let set = set_of(machine, axis, contour.modes.dynamics);
            // A transition jerk that is not given is the jerk.
            let limits = limits_of(machine, axis, set);
            let given = limits.transition_jerk_max_lu_s3 != limits.jerk_max_lu_s3;
            let what = if what == AxisDatum::TransitionJerk && !given { AxisDatum::Jerk } else { what };
            Datum::Axis { axis, set, what }
        })
    };
    let jerk = if blend { AxisDatum::TransitionJerk } else { AxisDatum::Jerk };
    let bends = matches!(limit.kind, LimitKind::RadialAcceleration | LimitKind::RadialJerk);
    // On a line it is a neighbour that bends, and may be a blend.
    let blend = blend || bends && matches!(contour.curve(), Some(Curve::Line(_)));
    let mut data: Vec<Option<Datum>> = match limit.kind {
        LimitKind::Feed => vec![Some(Datum::ProgrammedFeed)],
        LimitKind::Velocity => vec![of(AxisDatum::Velocity)],
        LimitKind::Acceleration => vec![of(AxisDatum::Acceleration)],
        LimitKind::Jerk => vec![of(jerk)],
        LimitKind::RadialAcceleration => vec![of(AxisDatum::Acceleration), Some(Datum::RadialAcceleration)],
        LimitKind::RadialJerk if blend && jerk == AxisDatum::Jerk => {
            vec![of(jerk), of(AxisDatum::TransitionJerk), Some(Datum::RadialJerk)]
        }
        LimitKind::RadialJerk => vec![of(jerk), Some(Datum::RadialJerk)],
        LimitKind::TransitionJerk => vec![of(AxisDatum::TransitionJerk)],
        LimitKind::Corner => match machine.feed.corner_rule {
            CornerRule::FollowUp => {
                vec![of(AxisDatum::Acceleration), limit.axis.map(|axis| Datum::CornerTolerance { axis })]
            }
            CornerRule::Overload => vec![of(AxisDatum::Acceleration), Some(Datum::Overload)],
        },
        LimitKind::LookAhead => vec![Some(Datum::LookAhead)],
        LimitKind::Cycle
        | LimitKind::Dwell
        | LimitKind::InPosition
        | LimitKind::Positioning
        | LimitKind::Override
        | LimitKind::Spindle => Vec::new(),
    };
    // A G641 blend is as long as ADIS says.
    let by_tolerance = contour.modes.path_mode != PathMode::G641 && contour.modes.contour_tolerance_mm.is_none();
    if blend && limit.kind != LimitKind::Feed && by_tolerance {
        data.push(Some(Datum::ContourTolerance));
    }
    let mut data: Vec<Datum> = data.into_iter().flatten().collect();
    data.dedup();
    data
}

/// Data that matter on a piece beside those behind its limit: what is left for changing the speed inside a blend depends on the transition jerk of
/// every axis that bends.
pub(super) fn beside(machine: &Machine, piece: &PlannedPiece) -> Vec<Datum> {
    let contour = &piece.path.contour;
    if !matches!(contour.kind, PieceKind::Blend(..)) {
        return Vec::new();
    }
    let ends = [piece.path.at(0.0), piece.path.at(piece.path.length_lu())];
    let bends = |axis: &AxisId| ends[0].first[*axis] != ends[1].first[*axis];
    let datum = |axis: AxisId| {
        let set = set_of(machine, axis, contour.modes.dynamics);
        let limits = limits_of(machine, axis, set);
        let given = limits.transition_jerk_max_lu_s3 != limits.jerk_max_lu_s3;
        Datum::Axis { axis, set, what: if given { AxisDatum::TransitionJerk } else { AxisDatum::Jerk } }
    };
    machine.axis_ids().filter(bends).map(datum).collect()
}

/// The dynamics set whose limits hold, if it has its own.
fn set_of(machine: &Machine, axis: AxisId, mode: DynamicsMode) -> Option<DynamicsMode> {
    let sets = &machine.axis(axis).dynamics;
    let own = sets.get(mode)?;
    // DYNPREC without a set of its own is DYNFINISH.
    let borrowed = mode == DynamicsMode::Precision && sets.get(DynamicsMode::Finish) == Some(own);
    Some(if borrowed { DynamicsMode::Finish } else { mode })
}

fn limits_of(machine: &Machine, axis: AxisId, set: Option<DynamicsMode>) -> AxisLimits {
    let axis = machine.axis(axis);
    *set.and_then(|set| axis.dynamics.get(set)).unwrap_or(&axis.limits)
}

impl Datum {
    /// Its key in a machine file; `F` for the program's feed.
    pub fn key(self, machine: &Machine) -> String {
        match self {
            Self::Axis { axis, set, .. } => {
                let name = &machine.axis(axis).name;
                let set = set.map_or(String::new(), |set| format!("dynamics.{}.", set.word()));
                format!("axes.{name}.{set}{}", self.last_key(machine))
            }
            Self::CornerTolerance { axis } => format!("axes.{}.{}", machine.axis(axis).name, self.last_key(machine)),
            Self::Overload => format!("feed.{}", self.last_key(machine)),
            Self::LookAhead => format!("look_ahead.{}", self.last_key(machine)),
            Self::ProgrammedFeed => "F".to_owned(),
            _ => format!("smoothing.{}", self.last_key(machine)),
        }
    }

    fn last_key(self, machine: &Machine) -> &'static str {
        let by_kind =
            |axis: AxisId, linear, rotary| if machine.axis(axis).kind == AxisKind::Linear { linear } else { rotary };
        match self {
            Self::Axis { axis, what, .. } => match what {
                AxisDatum::Velocity => by_kind(axis, "velocity_max_m_min", "velocity_max_rpm"),
                AxisDatum::Acceleration => by_kind(axis, "acceleration_max_m_s2", "acceleration_max_rot_s2"),
                AxisDatum::Jerk => by_kind(axis, "jerk_max_m_s3", "jerk_max_rot_s3"),
                AxisDatum::TransitionJerk => by_kind(axis, "transition_jerk_max_m_s3", "transition_jerk_max_rot_s3"),
            },
            Self::CornerTolerance { axis } => by_kind(axis, "follow_up_tolerance_mm", "follow_up_tolerance_deg"),
            Self::Overload => "overload_factor",
            Self::RadialAcceleration => "radial_acceleration_share",
            Self::RadialJerk => "radial_jerk_share",
            Self::ContourTolerance => "contour_tolerance_mm",
            Self::LookAhead => "blocks",
            Self::ProgrammedFeed => "",
        }
    }

    /// Machine data of the control, empty without one.
    pub fn machine_data(self, machine: &Machine) -> &'static str {
        let path = match self {
            Self::Axis { set: None, .. } | Self::CornerTolerance { .. } => "axes.*",
            Self::Axis { .. } => "axes.*.dynamics.*",
            Self::Overload => "feed",
            Self::LookAhead => "look_ahead",
            _ => "smoothing",
        };
        let name = self.last_key(machine);
        let keys = tables().iter().filter(|table| table.path == path).flat_map(|table| table.keys);
        keys.filter(|key| key.name == name).map(|key| key.machine_data).next().unwrap_or("")
    }

    /// In words: "X jerk".
    pub fn words(self, machine: &Machine) -> String {
        match self {
            Self::Axis { axis, what, .. } => {
                let what = match what {
                    AxisDatum::Velocity => "velocity",
                    AxisDatum::Acceleration => "acceleration",
                    AxisDatum::Jerk => "jerk",
                    AxisDatum::TransitionJerk => "transition jerk",
                };
                format!("{} {what}", machine.axis(axis).name)
            }
            Self::CornerTolerance { axis } => format!("{} tolerance at corners", machine.axis(axis).name),
            Self::Overload => "velocity step at corners".to_owned(),
            Self::RadialAcceleration => "share of acceleration for curvature".to_owned(),
            Self::RadialJerk => "share of jerk for curvature".to_owned(),
            Self::ContourTolerance => "contour tolerance".to_owned(),
            Self::LookAhead => "blocks of look-ahead".to_owned(),
            Self::ProgrammedFeed => "programmed feed".to_owned(),
        }
    }

    /// The machine with the datum raised, and by how many percent it is. F is the program's: the machine stays as it is.
    pub fn raised(self, machine: &Machine) -> (Machine, f64) {
        let mut raised = machine.clone();
        let percent = |ratio: f64| ratio.mul_add(100.0, -100.0);
        let share = |share: &mut f64| {
            let before = std::mem::replace(share, (*share * RAISED_RATIO).min(SHARE_MAX_RATIO).max(*share));
            percent(*share / before)
        };
        let changed = match self {
            Self::Axis { axis, set, what } => {
                let mut limits = limits_of(machine, axis, set);
                what.raise(&mut limits);
                let axis = &mut raised.axes[axis.index()];
                match set {
                    None => axis.limits = limits,
                    Some(set) => axis.dynamics.set(set, limits),
                }
                percent(RAISED_RATIO)
            }
            Self::CornerTolerance { axis } => {
                raised.axes[axis.index()].follow_up_tolerance_lu *= RAISED_RATIO;
                percent(RAISED_RATIO)
            }
            Self::Overload => {
                raised.feed.overload_ratio *= RAISED_RATIO;
                percent(RAISED_RATIO)
            }
            Self::RadialAcceleration => share(&mut raised.smoothing.radial_acceleration_share),
            Self::RadialJerk => share(&mut raised.smoothing.radial_jerk_share),
            Self::ContourTolerance => {
                raised.smoothing.contour_tolerance_mm *= RAISED_RATIO;
                percent(RAISED_RATIO)
            }
            Self::LookAhead => {
                let blocks = machine.look_ahead_blocks as f64;
                raised.look_ahead_blocks = (blocks * RAISED_RATIO).ceil() as usize;
                percent(raised.look_ahead_blocks as f64 / blocks)
            }
            Self::ProgrammedFeed => percent(RAISED_RATIO),
        };
        // Shortest form: 10 and not 10.000000000000009.
        (raised, (changed * 1e6).round() / 1e6)
    }

    /// A move as it is with the datum raised.
    pub fn applied(self, mut next: Move) -> Move {
        if self == Self::ProgrammedFeed {
            next.feed = match next.feed {
                Feed::Rapid => Feed::Rapid,
                Feed::Path { feed_lu_s } => Feed::Path { feed_lu_s: RAISED_RATIO * feed_lu_s },
                Feed::Varying { feeds_lu_s } => {
                    let raised: Arc<[f64]> = feeds_lu_s.iter().map(|feed_lu_s| RAISED_RATIO * feed_lu_s).collect();
                    Feed::Varying { feeds_lu_s: raised }
                }
            };
        }
        next
    }
}

impl AxisDatum {
    fn raise(self, limits: &mut AxisLimits) {
        let value = match self {
            Self::Velocity => &mut limits.velocity_max_lu_s,
            Self::Acceleration => &mut limits.acceleration_max_lu_s2,
            Self::TransitionJerk => &mut limits.transition_jerk_max_lu_s3,
            Self::Jerk => {
                // A transition jerk that is not given is the jerk.
                if limits.transition_jerk_max_lu_s3 == limits.jerk_max_lu_s3 {
                    limits.transition_jerk_max_lu_s3 *= RAISED_RATIO;
                }
                &mut limits.jerk_max_lu_s3
            }
        };
        *value *= RAISED_RATIO;
    }
}
