//! What comes out of an identification: estimates, refusals, figures about the trace.
//!
//! In: nothing (plain data). Out: [`AxisResult`]. Values are in the unit of their key of the machine file, so that a table, a JSON
//! document and a machine file show the same number.

use crate::base::AxisKind;
use crate::base::Diagnostic;
use crate::base::units::MM_PER_M;
use crate::machine::Axis;

/// What can be identified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// J.
    Inertia,
    /// B.
    Viscous,
    /// Tc.
    Coulomb,
    /// g0.
    Gravity,
    /// gs.
    GravitySin,
    /// gc.
    GravityCos,
    /// `Kv`.
    PositionGain,
    /// `kvff`.
    VelocityFeedforward,
    /// `ktff`.
    TorqueFeedforward,
    /// `d_pos`.
    SetpointDelay,
    /// `d_ff`.
    FeedforwardDelay,
    /// `Kp`.
    SpeedGain,
    /// `Tn`.
    SpeedResetTime,
}

impl Parameter {
    /// All of them, in the order of the tables.
    pub const ALL: [Self; 13] = [
        Self::Inertia,
        Self::Viscous,
        Self::Coulomb,
        Self::Gravity,
        Self::GravitySin,
        Self::GravityCos,
        Self::PositionGain,
        Self::VelocityFeedforward,
        Self::TorqueFeedforward,
        Self::SetpointDelay,
        Self::FeedforwardDelay,
        Self::SpeedGain,
        Self::SpeedResetTime,
    ];

    /// Its key in the machine file, below the axis.
    pub fn key(self, axis: &Axis) -> &'static str {
        let linear = has_linear_motor(axis);
        match self {
            Self::Inertia if linear => "mechanics.mass_kg",
            Self::Inertia => "mechanics.inertia_kg_m2",
            Self::Viscous if linear => "mechanics.viscous_friction_n_s_per_m",
            Self::Viscous => "mechanics.viscous_friction_n_m_s_per_rad",
            Self::Coulomb if linear => "mechanics.coulomb_friction_n",
            Self::Coulomb => "mechanics.coulomb_friction_n_m",
            Self::Gravity if linear => "mechanics.gravity_n",
            Self::Gravity => "mechanics.gravity_n_m",
            Self::GravitySin => "mechanics.gravity_sin_n_m",
            Self::GravityCos => "mechanics.gravity_cos_n_m",
            Self::PositionGain => "drive.position_gain_per_s",
            Self::VelocityFeedforward => "drive.velocity_feedforward",
            Self::TorqueFeedforward => "drive.torque_feedforward",
            Self::SetpointDelay => "drive.setpoint_delay_ms",
            Self::FeedforwardDelay => "drive.feedforward_delay_ms",
            Self::SpeedGain if linear => "drive.speed_gain_n_s_per_m",
            Self::SpeedGain => "drive.speed_gain_n_m_s_per_rad",
            Self::SpeedResetTime => "drive.speed_reset_time_ms",
        }
    }

    /// Unit of that key; empty for a ratio.
    pub fn unit(self, axis: &Axis) -> &'static str {
        let linear = has_linear_motor(axis);
        match self {
            Self::Inertia => ["kg m^2", "kg"][usize::from(linear)],
            Self::Viscous | Self::SpeedGain => ["N m s/rad", "N s/m"][usize::from(linear)],
            Self::Coulomb | Self::Gravity => ["N m", "N"][usize::from(linear)],
            Self::GravitySin | Self::GravityCos => "N m",
            Self::PositionGain => "1/s",
            Self::VelocityFeedforward | Self::TorqueFeedforward => "",
            Self::SetpointDelay | Self::FeedforwardDelay | Self::SpeedResetTime => "ms",
        }
    }

    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::Inertia => "inertia",
            Self::Viscous => "viscous friction",
            Self::Coulomb => "Coulomb friction",
            Self::Gravity => "gravity, constant",
            Self::GravitySin => "gravity, sine",
            Self::GravityCos => "gravity, cosine",
            Self::PositionGain => "position gain",
            Self::VelocityFeedforward => "velocity feed-forward",
            Self::TorqueFeedforward => "torque feed-forward",
            Self::SetpointDelay => "set-point delay",
            Self::FeedforwardDelay => "feed-forward delay",
            Self::SpeedGain => "speed-loop gain",
            Self::SpeedResetTime => "speed-loop reset time",
        }
    }
}

/// A linear motor is kept with 1000 mm per "radian" (see the room `machine`).
pub(super) fn has_linear_motor(axis: &Axis) -> bool {
    let r = axis.drive.as_ref().map(|drive| drive.mechanics.transmission_lu_per_rad);
    axis.kind == AxisKind::Linear && r == Some(MM_PER_M)
}

/// How a value was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Means {
    /// Least squares over all filtered samples.
    OneShot,
    /// Constant-speed runs, then acceleration.
    Staged,
    /// Two adjacent lags of the set-point.
    Lags,
    /// The recorded law of the controller.
    ControlLaw,
    /// The simulated axis, fitted to the trace.
    OutputError,
}

impl Means {
    /// For people and JSON.
    pub fn title(self) -> &'static str {
        match self {
            Self::OneShot => "least squares",
            Self::Staged => "staged",
            Self::Lags => "two lags",
            Self::ControlLaw => "control law",
            Self::OutputError => "output error",
        }
    }
}

/// A value with its 95 % interval, in the unit of its key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// What.
    pub parameter: Parameter,
    /// Best value.
    pub value: f64,
    /// Lower end of the 95 % interval.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// How it was found.
    pub means: Means,
}

impl Estimate {
    /// A value with the half width of its interval.
    pub(super) fn around(parameter: Parameter, value: f64, half: f64, means: Means) -> Self {
        Self { parameter, value, low: value - half, high: value + half, means }
    }

    /// The same in another unit.
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { value: self.value * factor, low: self.low * factor, high: self.high * factor, ..self }
    }

    /// The interval made wider on both sides.
    pub(super) fn widened(self, by: f64) -> Self {
        Self { low: self.low - by, high: self.high + by, ..self }
    }

    /// The interval made wider by so much downwards and upwards.
    pub(super) fn reaching(self, [down, up]: [f64; 2]) -> Self {
        Self { low: self.low - down, high: self.high + up, ..self }
    }

    /// Half of the width of the interval.
    pub(super) fn half(&self) -> f64 {
        (self.high - self.low) / 2.0
    }
}

/// A parameter that the traces cannot tell.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// What.
    pub parameter: Parameter,
    /// Why, in half a sentence.
    pub reason: String,
    /// What to record or to program instead.
    pub remedy: String,
}

/// Something else worth a number: a lag that is a sum of two things, the torque of one direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Key in lower case with its unit.
    pub key: &'static str,
    /// For people.
    pub title: String,
    /// Number.
    pub value: f64,
    /// Unit of it.
    pub unit: &'static str,
}

/// Where the torque of the motor comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TorqueSource {
    /// Mean of the current over each position cycle: nothing is folded.
    MeanCurrent,
    /// Mean that was formed here of samples faster than the position cycle.
    FineCurrent,
    /// The current at the position ticks.
    Current,
    /// The set-point of the torque at the position ticks.
    TorqueReference,
}

impl TorqueSource {
    /// For people.
    pub fn title(self) -> &'static str {
        match self {
            Self::MeanCurrent => "current, mean of each position cycle",
            Self::FineCurrent => "current, averaged from faster samples",
            Self::Current => "current, one sample a position cycle",
            Self::TorqueReference => "torque set-point, one sample a position cycle",
        }
    }

    /// Samples on the sawtooth of a position cycle.
    pub(super) fn is_folded(self) -> bool {
        matches!(self, Self::Current | Self::TorqueReference)
    }
}

/// What the traces say about one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisResult {
    /// Name of the axis.
    pub axis: String,
    /// What was found, in the order of [`Parameter::ALL`].
    pub estimates: Vec<Estimate>,
    /// Values of the staged procedure, and of least squares where another method gave the result: to compare.
    pub others: Vec<Estimate>,
    /// What was not.
    pub refusals: Vec<Refusal>,
    /// Other numbers.
    pub figures: Vec<Figure>,
    /// Verdict on the traces, one sentence each.
    pub verdicts: Vec<String>,
    /// Where the torque came from.
    pub torque_source: Option<TorqueSource>,
    /// For a picture: speed of the motor in rad/s (m/s), mean torque there without inertia, and torque of the fitted law, in N m (N).
    pub friction_points: Vec<[f64; 3]>,
    /// Findings worth a warning.
    pub notes: Vec<Diagnostic>,
}

impl AxisResult {
    /// Nothing is known of the axis yet.
    pub(super) fn new(axis: &str) -> Self {
        Self {
            axis: axis.to_owned(),
            estimates: Vec::new(),
            others: Vec::new(),
            refusals: Vec::new(),
            figures: Vec::new(),
            verdicts: Vec::new(),
            torque_source: None,
            friction_points: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// The estimate of a parameter.
    pub fn estimate(&self, parameter: Parameter) -> Option<&Estimate> {
        self.estimates.iter().find(|estimate| estimate.parameter == parameter)
    }

    /// Why a parameter is not there.
    pub fn refusal(&self, parameter: Parameter) -> Option<&Refusal> {
        self.refusals.iter().find(|refusal| refusal.parameter == parameter)
    }

    pub(super) fn refuse(&mut self, parameter: Parameter, reason: impl Into<String>, remedy: impl Into<String>) {
        if self.refusal(parameter).is_none() {
            self.refusals.push(Refusal { parameter, reason: reason.into(), remedy: remedy.into() });
        }
    }
}
