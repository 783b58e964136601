//! The wire out of feed.
//!
//! In: nothing (plain data). Out: [`PlannedPiece`], [`TimeLaw`] and [`Limit`]. Does not plan.

use crate::base::AxisId;
use crate::kinematics::JointPath;

/// What holds the motion back at an instant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Limit {
    /// Sort of limit.
    pub kind: LimitKind,
    /// The axis it belongs to, if it belongs to one.
    pub axis: Option<AxisId>,
}

/// Sorts of limits; names as in the JSON key `limits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LimitKind {
    /// Programmed feed.
    Feed,
    /// Axis velocity.
    Velocity,
    /// Axis acceleration.
    Acceleration,
    /// Axis jerk.
    Jerk,
    /// Axis acceleration, share for curvature.
    RadialAcceleration,
    /// Axis jerk, share for curvature.
    RadialJerk,
    /// Axis jerk inside a blend or at a change of curvature.
    TransitionJerk,
    /// Axis-velocity step at an unrounded corner.
    Corner,
    /// A block cannot be shorter than a cycle.
    Cycle,
    /// The end of the look-ahead window, where a stop must be possible.
    LookAhead,
    /// Programmed dwell.
    Dwell,
    /// Waiting for the axes to come into position.
    InPosition,
    /// Waiting for an axis that moves on its own (POS, WAITP).
    Positioning,
    /// Feed override.
    Override,
}

impl LimitKind {
    /// Name in JSON and recordings.
    pub fn name(self) -> &'static str {
        match self {
            Self::Feed => "feed",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Jerk => "jerk",
            Self::RadialAcceleration => "radial_acceleration",
            Self::RadialJerk => "radial_jerk",
            Self::TransitionJerk => "transition_jerk",
            Self::Corner => "corner",
            Self::Cycle => "cycle",
            Self::LookAhead => "look_ahead",
            Self::Dwell => "dwell",
            Self::InPosition => "in_position",
            Self::Positioning => "positioning",
            Self::Override => "override",
        }
    }
}

/// A stretch of constant jerk along the path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase {
    /// Length in time.
    pub duration_s: f64,
    /// Path position at its start, from the start of the piece (mm, or rad where only rotary axes move).
    pub start_lu: f64,
    /// Path speed at its start.
    pub velocity_lu_s: f64,
    /// Path acceleration at its start.
    pub acceleration_lu_s2: f64,
    /// Path jerk, constant (0 under BRISK, where acceleration steps).
    pub jerk_lu_s3: f64,
    /// What holds the motion back here.
    pub limit: Limit,
}

/// s(t) over one piece: phases in order, without gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct TimeLaw {
    phases: [Phase; 7],
    count: usize,
    duration_s: f64,
}

/// State of the path at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathState {
    /// s, from the start of the piece.
    pub position_lu: f64,
    /// ds/dt.
    pub velocity_lu_s: f64,
    /// d²s/dt².
    pub acceleration_lu_s2: f64,
    /// d³s/dt³.
    pub jerk_lu_s3: f64,
    /// What holds the motion back.
    pub limit: Limit,
}

impl TimeLaw {
    /// Joins at most seven phases; those of zero length are dropped. Panics on more than seven.
    pub fn new(phases: impl IntoIterator<Item = Phase>) -> Self {
        let idle = Limit { kind: LimitKind::Feed, axis: None };
        let empty = Phase {
            duration_s: 0.0,
            start_lu: 0.0,
            velocity_lu_s: 0.0,
            acceleration_lu_s2: 0.0,
            jerk_lu_s3: 0.0,
            limit: idle,
        };
        let mut law = Self { phases: [empty; 7], count: 0, duration_s: 0.0 };
        for phase in phases.into_iter().filter(|phase| phase.duration_s > 0.0) {
            law.phases[law.count] = phase;
            law.count += 1;
            law.duration_s += phase.duration_s;
        }
        law
    }

    /// The phases in order.
    pub fn phases(&self) -> &[Phase] {
        &self.phases[..self.count]
    }

    /// Time from start to end of the piece.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// State `time_s` after the start of the piece; clamped to its ends. A law without phases is at rest at 0.
    pub fn at(&self, time_s: f64) -> PathState {
        let mut rest_s = time_s.max(0.0);
        let phases = self.phases();
        for (i, phase) in phases.iter().enumerate() {
            if rest_s <= phase.duration_s || i + 1 == phases.len() {
                return phase.at(rest_s.min(phase.duration_s));
            }
            rest_s -= phase.duration_s;
        }
        let phase = self.phases[0];
        PathState { position_lu: 0.0, velocity_lu_s: 0.0, acceleration_lu_s2: 0.0, jerk_lu_s3: 0.0, limit: phase.limit }
    }
}

impl Phase {
    /// State `time_s` after the start of the phase.
    pub fn at(&self, time_s: f64) -> PathState {
        let (t, j) = (time_s, self.jerk_lu_s3);
        let (v, a) = (self.velocity_lu_s, self.acceleration_lu_s2);
        PathState {
            position_lu: self.start_lu + t * (v + t * (a / 2.0 + t * j / 6.0)),
            velocity_lu_s: v + t * (a + t * j / 2.0),
            acceleration_lu_s2: a + t * j,
            jerk_lu_s3: j,
            limit: self.limit,
        }
    }
}

/// A piece of path with its time law: final, never replanned.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPiece {
    /// Geometry.
    pub path: JointPath,
    /// s(t).
    pub law: TimeLaw,
    /// Motion blocks that the look-ahead held beyond this one when it was fixed.
    pub buffered_blocks: u32,
    /// Axes that set out on their own when the piece begins; empty for most.
    pub positionings: Vec<AxisMotion>,
}

/// A motion of one axis beside the path, final.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisMotion {
    /// Which axis.
    pub axis: AxisId,
    /// Its whole way, with sign. The path already stands where the axis will arrive: what is left of the way is missing there.
    pub way_lu: f64,
    /// From the start of the piece to the start of the motion: not 0 where the axis was still on an earlier way.
    pub delay_s: f64,
    /// |way| over time, from rest to rest.
    pub law: TimeLaw,
}

impl AxisMotion {
    /// Time from the start of the piece until the axis has arrived.
    pub fn arrival_s(&self) -> f64 {
        self.delay_s + self.law.duration_s()
    }
}
