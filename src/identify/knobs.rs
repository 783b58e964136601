//! What a calibration of the control may change: numbers (knobs) and words (switches) of the machine file.
//!
//! In: a machine. Out: the same with a knob turned or a switch thrown, and what `--set` makes the same of its file. Shares move as ln(x/(1-x)),
//! all other numbers as ln x: what limits a feed is a power of them, so that a fit of ln(feed) is nearly linear. Does not fit anything.

use crate::base::units::{MM_PER_M, RAD_PER_REV, deg_from_rad};
use crate::base::{AxisId, AxisKind};
use crate::machine::{
    ArcLimits, Axis, AxisLimits, BlendLaw, BlendLimits, BlendShape, Choice, CornerRule, CurvatureJump, DynamicsMode,
    Machine, TimeLawKind,
};

/// A number of the machine file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Knob {
    Alpha,
    Ratio,
    RatioReversal,
    RadialAcceleration,
    RadialJerk,
    /// A factor on the transition jerk of all axes, or of one.
    TransitionJerk(Option<AxisId>),
    /// A factor on the jerk of all axes, or of one.
    Jerk(Option<AxisId>),
    /// A factor on the tolerances of all axes.
    FollowUp,
    Overload,
}

impl Knob {
    /// Those of the path.
    pub(super) const SHAPE: [Self; 3] = [Self::Alpha, Self::Ratio, Self::RatioReversal];

    /// Key of the machine file; a factor says so.
    pub(super) fn key(self, machine: &Machine) -> String {
        let of_axes = |axis: Option<AxisId>, key: &str| {
            let name = axis.map_or("*", |id| machine.axis(id).name.as_str());
            format!("axes.{name}.{key} factor")
        };
        match self {
            Self::Alpha => "smoothing.alpha".to_owned(),
            Self::Ratio => "smoothing.tolerance_ratio".to_owned(),
            Self::RatioReversal => "smoothing.tolerance_ratio_reversal".to_owned(),
            Self::RadialAcceleration => "smoothing.radial_acceleration_share".to_owned(),
            Self::RadialJerk => "smoothing.radial_jerk_share".to_owned(),
            Self::TransitionJerk(axis) => of_axes(axis, "transition_jerk_max"),
            Self::Jerk(axis) => of_axes(axis, "jerk_max"),
            Self::FollowUp => of_axes(None, "follow_up_tolerance"),
            Self::Overload => "feed.overload_factor".to_owned(),
        }
    }

    pub(super) fn title(self) -> &'static str {
        match self {
            Self::Alpha => "end tangents of a corner",
            Self::Ratio => "executed over programmed tolerance",
            Self::RatioReversal => "the same where an axis reverses",
            Self::RadialAcceleration => "share of acceleration across the path",
            Self::RadialJerk => "share of jerk across the path",
            Self::TransitionJerk(_) => "transition jerk, times that of the file",
            Self::Jerk(_) => "jerk, times that of the file",
            Self::FollowUp => "step of speed at corners, times that of the file",
            Self::Overload => "step of speed at corners, over acceleration times cycle",
        }
    }

    fn range(self) -> (f64, f64) {
        match self {
            Self::Alpha => (0.5, 3.9),
            Self::Ratio | Self::RatioReversal => (0.05, 1.0),
            Self::RadialAcceleration | Self::RadialJerk => (0.02, 0.95),
            Self::TransitionJerk(_) | Self::Jerk(_) => (0.05, 20.0),
            Self::FollowUp => (0.01, 100.0),
            Self::Overload => (0.05, 200.0),
        }
    }

    /// The value in a file; a factor is 1.
    pub(super) fn get(self, machine: &Machine) -> f64 {
        match self {
            Self::Alpha => machine.smoothing.alpha_ratio,
            Self::Ratio => machine.smoothing.tolerance_ratio,
            Self::RatioReversal => machine.smoothing.tolerance_reversal_ratio,
            Self::RadialAcceleration => machine.smoothing.radial_acceleration_share,
            Self::RadialJerk => machine.smoothing.radial_jerk_share,
            Self::Overload => machine.feed.overload_ratio,
            Self::TransitionJerk(_) | Self::Jerk(_) | Self::FollowUp => 1.0,
        }
    }

    pub(super) fn set(self, machine: &mut Machine, value: f64) {
        match self {
            Self::Alpha => machine.smoothing.alpha_ratio = value,
            Self::Ratio => machine.smoothing.tolerance_ratio = value,
            Self::RatioReversal => machine.smoothing.tolerance_reversal_ratio = value,
            Self::RadialAcceleration => machine.smoothing.radial_acceleration_share = value,
            Self::RadialJerk => machine.smoothing.radial_jerk_share = value,
            Self::FollowUp => machine.axes.iter_mut().for_each(|axis| axis.follow_up_tolerance_lu *= value),
            Self::Overload => machine.feed.overload_ratio = value,
            Self::TransitionJerk(axis) => scale_jerk(machine, axis, |limits| limits.transition_jerk_max_lu_s3 *= value),
            Self::Jerk(axis) => scale_jerk(machine, axis, |limits| limits.jerk_max_lu_s3 *= value),
        }
    }

    /// Of the path, not of the time along it.
    pub(super) fn is_of_shape(self) -> bool {
        Self::SHAPE.contains(&self)
    }

    fn is_share(self) -> bool {
        matches!(self, Self::RadialAcceleration | Self::RadialJerk)
    }

    /// The number in which a fit moves.
    pub(super) fn free(self, value: f64) -> f64 {
        let (low, high) = self.range();
        let value = value.clamp(low, high);
        if self.is_share() { (value / (1.0 - value)).ln() } else { value.ln() }
    }

    /// The range of it.
    pub(super) fn free_range(self) -> (f64, f64) {
        let (low, high) = self.range();
        (self.free(low), self.free(high))
    }

    /// And back, into the range.
    pub(super) fn value(self, free: f64) -> f64 {
        let (low, high) = self.range();
        let value = if self.is_share() { 1.0 / (1.0 + (-free).exp()) } else { free.exp() };
        value.clamp(low, high)
    }

    /// What makes the same of the file of `before`, of which `after` was made.
    pub(super) fn sets(self, before: &Machine, after: &Machine) -> Vec<String> {
        let pairs = || before.axes.iter().zip(&after.axes);
        match self {
            Self::TransitionJerk(_) | Self::Jerk(_) => pairs().flat_map(|(old, new)| jerk_sets(old, new)).collect(),
            Self::FollowUp => pairs().filter_map(|(old, new)| follow_up_set(old, new)).collect(),
            _ => vec![format!("{}={:.6}", self.key(after), self.get(after))],
        }
    }
}

/// Jerks of every kind of machining, of one axis or of all.
fn scale_jerk(machine: &mut Machine, of: Option<AxisId>, scale: impl Fn(&mut AxisLimits)) {
    let chosen = |place: usize| of.is_none_or(|id| id.index() == place);
    for (_, axis) in machine.axes.iter_mut().enumerate().filter(|(place, _)| chosen(*place)) {
        scale(&mut axis.limits);
        for mode in DynamicsMode::ALL {
            // DYNPREC may be that of DYNFINISH: to give it limits of its own changes nothing.
            if let Some(mut limits) = axis.dynamics.get(mode).copied() {
                scale(&mut limits);
                axis.dynamics.set(mode, limits);
            }
        }
    }
}

fn follow_up_set(old: &Axis, new: &Axis) -> Option<String> {
    let value = new.follow_up_tolerance_lu;
    let (key, value) = if new.kind == AxisKind::Linear { ("mm", value) } else { ("deg", deg_from_rad(value)) };
    (old.follow_up_tolerance_lu != new.follow_up_tolerance_lu)
        .then(|| format!("axes.{}.follow_up_tolerance_{key}={value:.6}", new.name))
}

/// The jerks of an axis, where they are others than before.
fn jerk_sets(old: &Axis, new: &Axis) -> Vec<String> {
    let linear = new.kind == AxisKind::Linear;
    let name = &new.name;
    let both = |table: &str, limits: &AxisLimits| {
        let unit = if linear { "m_s3" } else { "rot_s3" };
        let border = |jerk: f64| if linear { jerk / MM_PER_M } else { jerk / RAD_PER_REV };
        let (jerk, transition) = (border(limits.jerk_max_lu_s3), border(limits.transition_jerk_max_lu_s3));
        // Both: a transition jerk that is not given follows the other.
        [
            format!("axes.{name}.{table}jerk_max_{unit}={jerk:.6}"),
            format!("axes.{name}.{table}transition_jerk_max_{unit}={transition:.6}"),
        ]
    };
    let mut sets = Vec::new();
    if old.limits != new.limits {
        sets.extend(both("", &new.limits));
    }
    for mode in DynamicsMode::ALL {
        let own = new.dynamics.get(mode).filter(|limits| {
            old.dynamics.get(mode) != Some(*limits)
                && (mode != DynamicsMode::Precision || new.dynamics.get(DynamicsMode::Finish) != Some(*limits))
        });
        sets.extend(own.iter().flat_map(|limits| both(&format!("dynamics.{}.", mode.word()), limits)));
    }
    sets
}

/// A word of the machine file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Switch {
    Shape,
    TimeLaw,
    BlendLaw,
    Limits,
    CornerRule,
    CurvatureJump,
    ArcLimits,
}

impl Switch {
    /// Those of time.
    pub(super) const TIME: [Self; 6] =
        [Self::TimeLaw, Self::BlendLaw, Self::Limits, Self::CornerRule, Self::CurvatureJump, Self::ArcLimits];

    /// Those of time beside the law.
    pub(super) const WORDS: [Self; 5] =
        [Self::BlendLaw, Self::Limits, Self::CornerRule, Self::CurvatureJump, Self::ArcLimits];

    pub(super) fn key(self) -> &'static str {
        match self {
            Self::Shape => "smoothing.shape",
            Self::TimeLaw => "feed.time_law",
            Self::BlendLaw => "smoothing.blend_law",
            Self::Limits => "smoothing.limits",
            Self::CornerRule => "feed.corner_rule",
            Self::CurvatureJump => "feed.curvature_jump",
            Self::ArcLimits => "feed.arc_limits",
        }
    }

    /// The word that a machine has.
    pub(super) fn word(self, machine: &Machine) -> &'static str {
        match self {
            Self::Shape => machine.smoothing.shape.word(),
            Self::TimeLaw => machine.feed.time_law.word(),
            Self::BlendLaw => machine.smoothing.blend_law.word(),
            Self::Limits => machine.smoothing.limits.word(),
            Self::CornerRule => machine.feed.corner_rule.word(),
            Self::CurvatureJump => machine.feed.curvature_jump.word(),
            Self::ArcLimits => machine.feed.arc_limits.word(),
        }
    }

    /// The same machine with the other words.
    pub(super) fn others(self, machine: &Machine) -> Vec<Machine> {
        match self {
            Self::Shape => others(machine, |m, word: BlendShape| m.smoothing.shape = word),
            Self::TimeLaw => others(machine, |m, word: TimeLawKind| m.feed.time_law = word),
            // The printed loop breaks its own limits: no control is driven by it.
            Self::BlendLaw => others(machine, |m, word: BlendLaw| {
                if word != BlendLaw::Published {
                    m.smoothing.blend_law = word;
                }
            }),
            Self::Limits => others(machine, |m, word: BlendLimits| m.smoothing.limits = word),
            Self::CornerRule => others(machine, with_corner_rule),
            Self::CurvatureJump => others(machine, |m, word: CurvatureJump| m.feed.curvature_jump = word),
            Self::ArcLimits => others(machine, |m, word: ArcLimits| m.feed.arc_limits = word),
        }
        .into_iter()
        .filter(|other| self.word(other) != self.word(machine))
        .collect()
    }
}

fn others<T: Choice>(machine: &Machine, set: impl Fn(&mut Machine, T)) -> Vec<Machine> {
    let with = |(_, word): &(&'static str, T)| {
        let mut other = machine.clone();
        set(&mut other, *word);
        other
    };
    T::WORDS.iter().map(with).collect()
}

/// Another corner rule, with steps that are those of the present one in the geometric mean of the linear axes: what the file has for a rule that was not in
/// use means nothing.
fn with_corner_rule(machine: &mut Machine, rule: CornerRule) {
    if machine.feed.corner_rule == rule {
        return;
    }
    let period_s = machine.cycle.time_base.setpoint_period_s();
    let ratio =
        |axis: &Axis| (8.0 * axis.follow_up_tolerance_lu / axis.limits.acceleration_max_lu_s2).sqrt() / period_s;
    let linear: Vec<f64> =
        machine.axes.iter().filter(|axis| axis.kind == AxisKind::Linear).map(|axis| ratio(axis).ln()).collect();
    let mean = (linear.iter().sum::<f64>() / linear.len().max(1) as f64).exp();
    match rule {
        CornerRule::Overload => machine.feed.overload_ratio = mean,
        CornerRule::FollowUp => {
            let factor = (machine.feed.overload_ratio / mean).powi(2);
            machine.axes.iter_mut().for_each(|axis| axis.follow_up_tolerance_lu *= factor);
        }
    }
    machine.feed.corner_rule = rule;
}
