//! The wire out of feed.
//!
//! In: nothing (plain data). Out: [`PlannedPiece`], [`TimeLaw`], [`SpindleMotion`] and [`Limit`]. Does not plan.

use crate::base::AxisId;
use crate::base::Portable;
use crate::kinematics::JointPath;
use std::sync::Arc;

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
    /// Waiting for the spindle to come to its speed.
    Spindle,
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
            Self::Spindle => "spindle",
        }
    }
}

/// A stretch of the path with one law of motion: `d²s/dt² = a + j t + k (s - s_start)`, where `j` or `k` is 0. Constant jerk (`k = 0`)
/// is what a ramp in time is made of; with `j = 0` the square of the speed is a parabola in s, and the jerk is `k v`.
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
    /// Change of the path acceleration with the path, `k`; 0 where the jerk is constant.
    pub rate_per_s2: f64,
    /// What holds the motion back here.
    pub limit: Limit,
}

/// s(t) over one piece: phases in order, without gaps.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TimeLaw {
    phases: Vec<Phase>,
    /// When each phase begins.
    starts_s: Vec<f64>,
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
    /// Joins phases; those of zero length are dropped.
    pub fn new(phases: impl IntoIterator<Item = Phase>) -> Self {
        let mut law = Self::default();
        for phase in phases.into_iter().filter(|phase| phase.duration_s > 0.0) {
            law.starts_s.push(law.duration_s);
            law.phases.push(phase);
            law.duration_s += phase.duration_s;
        }
        law
    }

    /// The phases in order.
    pub fn phases(&self) -> &[Phase] {
        &self.phases
    }

    /// Time from start to end of the piece.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// The phases up to a time.
    pub(super) fn until(&self, time_s: f64) -> impl Iterator<Item = Phase> + '_ {
        let begun = self.phases.iter().zip(&self.starts_s).take_while(move |(_, start_s)| **start_s < time_s);
        begun.map(move |(phase, start_s)| Phase { duration_s: phase.duration_s.min(time_s - start_s), ..*phase })
    }

    /// State `time_s` after the start of the piece; clamped to its ends. A law without phases is at rest at 0.
    pub fn at(&self, time_s: f64) -> PathState {
        let index = self.starts_s.partition_point(|start_s| *start_s < time_s).saturating_sub(1);
        let Some(phase) = self.phases.get(index) else { return PathState::at_rest() };
        phase.at((time_s - self.starts_s[index]).max(0.0).min(phase.duration_s))
    }
}

impl PathState {
    /// Nothing moves, at 0.
    fn at_rest() -> Self {
        let limit = Limit { kind: LimitKind::Feed, axis: None };
        Self { position_lu: 0.0, velocity_lu_s: 0.0, acceleration_lu_s2: 0.0, jerk_lu_s3: 0.0, limit }
    }
}

impl Phase {
    /// State `time_s` after the start of the phase.
    pub fn at(&self, time_s: f64) -> PathState {
        let (t, j, k) = (time_s, self.jerk_lu_s3, self.rate_per_s2);
        let (v, a) = (self.velocity_lu_s, self.acceleration_lu_s2);
        if k == 0.0 {
            return PathState {
                position_lu: self.start_lu + t * (v + t * (a / 2.0 + t * j / 6.0)),
                velocity_lu_s: v + t * (a + t * j / 2.0),
                acceleration_lu_s2: a + t * j,
                jerk_lu_s3: j,
                limit: self.limit,
            };
        }
        // The solution of s'' = a + k s: with z = k t² that of sinh and cosh, for k < 0 that of sin and cos.
        let z = k * t * t;
        let [first, second] = [sine_ratio(z), cosine_ratio(z)];
        let velocity_lu_s = v * (1.0 + z * second) + a * t * first;
        PathState {
            position_lu: self.start_lu + t * (v * first + a * t * second),
            velocity_lu_s,
            acceleration_lu_s2: a * (1.0 + z * second) + k * v * t * first,
            jerk_lu_s3: k * velocity_lu_s,
            limit: self.limit,
        }
    }
}

/// Below this |z| the series of [`sine_ratio`] and [`cosine_ratio`] are exact to the last bit or two.
const SERIES_MAX_RATIO: f64 = 0.5;

/// sinh(x)/x with z = x²; sin(x)/x with z = -x².
fn sine_ratio(z: f64) -> f64 {
    if z.abs() <= SERIES_MAX_RATIO {
        let tail = 1.0 + z / 110.0 * (1.0 + z / 156.0 * (1.0 + z / 210.0));
        1.0 + z / 6.0 * (1.0 + z / 20.0 * (1.0 + z / 42.0 * (1.0 + z / 72.0 * tail)))
    } else if z > 0.0 {
        z.sqrt().portable_sinh() / z.sqrt()
    } else {
        (-z).sqrt().portable_sin() / (-z).sqrt()
    }
}

/// (cosh(x) - 1)/x² with z = x²; (1 - cos(x))/x² with z = -x².
fn cosine_ratio(z: f64) -> f64 {
    if z.abs() <= SERIES_MAX_RATIO {
        let tail = 1.0 + z / 90.0 * (1.0 + z / 132.0 * (1.0 + z / 182.0));
        0.5 * (1.0 + z / 12.0 * (1.0 + z / 30.0 * (1.0 + z / 56.0 * tail)))
    } else if z > 0.0 {
        (z.sqrt().portable_cosh() - 1.0) / z
    } else {
        ((-z).sqrt().portable_cos() - 1.0) / z
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
    /// The feed override at its start, and its changes after that; empty where it is 100 % from end to end.
    pub overrides: Vec<OverrideStep>,
    /// The master spindle from here on, where its motion is another one than before.
    pub spindle: Option<SpindleMotion>,
    /// The next piece begins only when the axes are in position.
    pub waits_at_end: bool,
    /// What the junction at its start holds the speed with, where the path passes it as fast as that allows: a corner that stays, a jump of the curvature.
    pub junction: Option<Limit>,
}

/// How the master spindle moves from the start of a piece on.
#[derive(Clone, Debug, PartialEq)]
pub struct SpindleMotion {
    /// In order; times from the start of the piece, the first one at or before it. The last one goes on.
    pub phases: Arc<[SpindlePhase]>,
    /// G331, G332: turned on by so much per unit of the piece's path on top of that.
    pub follows_rad_per_lu: Option<f64>,
}

/// A stretch of constant acceleration of the spindle, which is also its state where it begins. Right-handed (M3) is positive.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpindlePhase {
    /// When it begins.
    pub from_s: f64,
    /// Angle there, all revolutions counted.
    pub angle_rad: f64,
    /// Speed there.
    pub speed_rad_s: f64,
    /// Acceleration all along.
    pub acceleration_rad_s2: f64,
}

impl SpindlePhase {
    /// State at a time, if nothing follows.
    pub fn at(&self, time_s: f64) -> Self {
        let t = time_s - self.from_s;
        Self {
            from_s: time_s,
            angle_rad: self.angle_rad + t * (self.speed_rad_s + t * self.acceleration_rad_s2 / 2.0),
            speed_rad_s: self.speed_rad_s + t * self.acceleration_rad_s2,
            ..*self
        }
    }

    /// State at a time: of the last of `phases` that has begun, of the first before that.
    pub fn of(phases: &[Self], time_s: f64) -> Self {
        let begun = phases.partition_point(|phase| phase.from_s <= time_s).saturating_sub(1);
        phases.get(begun).map_or(Self { from_s: time_s, ..Self::default() }, |phase| phase.at(time_s))
    }
}

/// The feed override from a time on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OverrideStep {
    /// From the start of the piece.
    pub from_s: f64,
    /// 1: the programmed feed.
    pub override_ratio: f64,
}

impl PlannedPiece {
    /// The feed override `time_s` after the start of the piece.
    pub fn override_ratio(&self, time_s: f64) -> f64 {
        let before = self.overrides.iter().take_while(|step| step.from_s <= time_s);
        before.last().map_or(1.0, |step| step.override_ratio)
    }
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
