//! The printed motion law inside a blend (`blend_law = "published"`, models/local-smoothing.md section 4) [Essid 2019].
//!
//! In: a [`HermiteBlend`], the speed at its entry, the limits of the axes. Out: [`Crossing`]: the time law, the speed at its end, and how
//! often the loop broke its own rules. The state is u, u', u''; every step of t_s has a constant u''' and is integrated exactly:
//!
//! 1. `|u'''| = (min_j JT_j / |T_j| - |h|) / sigma` with `h = sigma'' u'³ + 3 sigma' u' u'' - v³ k²`: the symmetric part of what (d)
//!    leaves, 0 where nothing is left;
//! 2. `+|u'''|` if (a) to (e) hold in the state that it leads to, 3. else 0 if they hold there, 4. else `-|u'''|`, unchecked;
//! 5. until u = 1, where the last step ends.
//!
//! The loop is not safe: step 4 may break every rule, the feed at the end may be higher than the line after it can brake, and u' may
//! come to 0. The first is counted ([`Tally`]), the second is for the caller to see (`Crossing::exit_lu_s`), the third is [`Stalled`].
//! It begins with v' = 0 and ends with what comes: the line after the blend begins without acceleration, as published, so that the
//! acceleration steps there.
//!
//! A step of constant u''' is no polynomial in s. Its phase here is the cubic s(t) with the exact position and speed at both ends of the
//! step; between them it is off by `t_s⁴ |d⁴s/dt⁴| / 384` at most (below a nanometre at 1 ms), and its acceleration by
//! `t_s² |d⁴s/dt⁴| / 12`.

use super::limits::{AxisRules, FeedCap};
use super::{Limit, LimitKind, Phase, TimeLaw};
use crate::base::{AxisId, Diagnostic};
use crate::geometry::{BlendPoint, HermiteBlend};
use crate::machine::AxisLimits;
use crate::program::BlockRef;

/// Steps of one blend: 100 s at 1 ms.
const STEPS_MAX: usize = 100_000;

/// A rule holds up to rounding: the entry feed meets one of them exactly.
pub(super) const RULE_RATIO: f64 = 1.0 + 1e-9;

/// A shorter part of a step has no acceleration that differences of its ends could show.
const SHORT_STEP_RATIO: f64 = 1e-3;

/// Halvings of a step to find where u = 1: to the last bit.
const HALVINGS: usize = 60;

/// The rules (a) to (e).
const RULES: usize = 5;
const RULE_NAMES: [&str; RULES] = [
    "(a) feed and velocity",
    "(b) tangential acceleration",
    "(c) radial acceleration",
    "(d) tangential jerk",
    "(e) radial jerk",
];

/// A blend crossed by the printed loop.
#[derive(Clone, Debug)]
pub(super) struct Crossing {
    /// s(t).
    pub law: TimeLaw,
    /// Speed at its end.
    pub exit_lu_s: f64,
    /// What held the last step.
    pub limit: Limit,
    /// Steps after which each rule was broken.
    pub broken: [u64; RULES],
}

/// u' came to 0, or the end was not reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stalled;

/// The blends of a run, counted.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    blends: u64,
    blends_broken: u64,
    /// Crossed by the guarded law: the loop would have left faster than the path ahead allows.
    blends_guarded: u64,
    steps: [u64; RULES],
    first: Option<BlockRef>,
}

/// u and its derivatives.
#[derive(Clone, Copy)]
struct State {
    u: f64,
    first_per_s: f64,
    second_per_s2: f64,
}

/// What the rules compare, and the loop.
struct Loop<'a> {
    rules: &'a AxisRules,
    blend: &'a HermiteBlend,
    feed: FeedCap,
}

/// The printed loop from `entry_lu_s` at u = 0.
pub(super) fn crossing(
    rules: &AxisRules,
    blend: &HermiteBlend,
    feed: FeedCap,
    entry_lu_s: f64,
) -> Result<Crossing, Stalled> {
    let stepper = Loop { rules, blend, feed };
    let period_s = rules.setpoint_period_s;
    let start = blend.shape(0.0);
    let first_per_s = entry_lu_s / start.sigma_mm;
    // v' = 0.
    let second_per_s2 = -start.sigma_first_mm * first_per_s * first_per_s / start.sigma_mm;
    let mut state = State { u: 0.0, first_per_s, second_per_s2 };
    let (mut place_lu, mut velocity_lu_s) = (0.0, entry_lu_s);
    let (mut phases, mut broken) = (Vec::new(), [0; RULES]);
    while phases.len() < STEPS_MAX {
        let (third_per_s3, limit, after) = stepper.step(&state, period_s);
        for (count, _) in broken.iter_mut().zip(after).filter(|(_, broken)| broken.is_some()) {
            *count += 1;
        }
        let duration_s = if state.after(third_per_s3, period_s).u < 1.0 {
            period_s
        } else {
            state.time_of_end(third_per_s3, period_s)
        };
        let next = state.after(third_per_s3, duration_s);
        if next.first_per_s <= 0.0 || next.first_per_s.is_nan() {
            return Err(Stalled);
        }
        let ends = duration_s < period_s;
        let next_lu = if ends { blend.length_lu() } else { blend.arc_length_at_u_lu(next.u) };
        let next_lu_s = blend.shape(next.u).sigma_mm * next.first_per_s;
        let acceleration_lu_s2 = stepper.acceleration_lu_s2(&state, &blend.shape(state.u));
        phases.push(cubic(
            [place_lu, next_lu],
            [velocity_lu_s, next_lu_s],
            duration_s,
            period_s,
            acceleration_lu_s2,
            limit,
        ));
        if ends {
            return Ok(Crossing { law: TimeLaw::new(phases), exit_lu_s: next_lu_s, limit, broken });
        }
        (state, place_lu, velocity_lu_s) = (next, next_lu, next_lu_s);
    }
    Err(Stalled)
}

/// The phase between two places with their speeds.
fn cubic(
    place_lu: [f64; 2],
    velocity_lu_s: [f64; 2],
    duration_s: f64,
    period_s: f64,
    acceleration_lu_s2: f64,
    limit: Limit,
) -> Phase {
    let t = duration_s;
    let (way, gain) = (place_lu[1] - place_lu[0] - velocity_lu_s[0] * t, velocity_lu_s[1] - velocity_lu_s[0]);
    let (a, j) = if t > SHORT_STEP_RATIO * period_s {
        let a = 6.0 * way / (t * t) - 2.0 * gain / t;
        (a, 2.0 * (gain - a * t) / (t * t))
    } else {
        (acceleration_lu_s2, 0.0)
    };
    Phase {
        duration_s,
        start_lu: place_lu[0],
        velocity_lu_s: velocity_lu_s[0],
        acceleration_lu_s2: a,
        jerk_lu_s3: j,
        rate_per_s2: 0.0,
        limit,
    }
}

impl State {
    /// Exact integration of a constant u'''.
    fn after(&self, third_per_s3: f64, time_s: f64) -> Self {
        let (t, j) = (time_s, third_per_s3);
        let (d1, d2) = (self.first_per_s, self.second_per_s2);
        Self {
            u: self.u + t * (d1 + t * (d2 / 2.0 + t * j / 6.0)),
            first_per_s: d1 + t * (d2 + t * j / 2.0),
            second_per_s2: d2 + t * j,
        }
    }

    /// When u = 1 within a step that passes it.
    fn time_of_end(&self, third_per_s3: f64, period_s: f64) -> f64 {
        let (mut low_s, mut high_s) = (0.0, period_s);
        for _ in 0..HALVINGS {
            let middle_s = 0.5 * (low_s + high_s);
            if self.after(third_per_s3, middle_s).u < 1.0 { low_s = middle_s } else { high_s = middle_s }
        }
        // Less than the step, so that it is seen to be the last.
        high_s.min(period_s * (1.0 - f64::EPSILON))
    }
}

impl Loop<'_> {
    /// One step: u''', what held it, and what is broken after it.
    fn step(&self, state: &State, period_s: f64) -> (f64, Limit, [Option<Limit>; RULES]) {
        let point = self.blend.shape(state.u);
        let (most_per_s3, jerk_limit) = self.jerk(state, &point);
        let look = |third_per_s3: f64| self.broken(&state.after(third_per_s3, period_s), third_per_s3);
        let raised = look(most_per_s3);
        let Some(refused) = first(&raised) else { return (most_per_s3, jerk_limit, raised) };
        let held = look(0.0);
        match first(&held) {
            None => (0.0, refused, held),
            Some(refused) => (-most_per_s3, refused, look(-most_per_s3)),
        }
    }

    /// |u'''|, and the axis whose jerk sets it.
    fn jerk(&self, state: &State, point: &BlendPoint) -> (f64, Limit) {
        let share = 1.0 - self.rules.radial_jerk_share;
        let tangential = self.rules.largest(|axis, limits| {
            self.rules.blend_component(self.blend, point.tangent[axis], axis)
                / (share * limits.transition_jerk_max_lu_s3)
        });
        let h = self.turning_lu_s3(state, point);
        let most_lu_s3 = (1.0 / tangential.demand_ratio - h.abs()).max(0.0);
        (most_lu_s3 / point.sigma_mm, tangential.limit(LimitKind::TransitionJerk))
    }

    /// h.
    fn turning_lu_s3(&self, state: &State, point: &BlendPoint) -> f64 {
        let (d1, d2) = (state.first_per_s, state.second_per_s2);
        let k = point.curvature_per_mm;
        let v = point.sigma_mm * d1;
        point.sigma_second_mm * d1 * d1 * d1 + 3.0 * point.sigma_first_mm * d1 * d2 - v * v * v * k * k
    }

    fn acceleration_lu_s2(&self, state: &State, point: &BlendPoint) -> f64 {
        let d1 = state.first_per_s;
        point.sigma_first_mm * d1 * d1 + point.sigma_mm * state.second_per_s2
    }

    /// For each rule whether a state breaks it, and which limit that is.
    fn broken(&self, state: &State, third_per_s3: f64) -> [Option<Limit>; RULES] {
        let Self { rules, blend, feed } = self;
        let point = blend.shape(state.u);
        let v = point.sigma_mm * state.first_per_s;
        let a = self.acceleration_lu_s2(state, &point);
        let along = self.turning_lu_s3(state, &point) + point.sigma_mm * third_per_s3;
        let across = v * (3.0 * a * point.curvature_per_mm + v * v * point.curvature_slope_per_mm_mm);
        let (ra, rj) = (rules.radial_acceleration_share, rules.radial_jerk_share);
        let tangent = |axis: AxisId| rules.blend_component(blend, point.tangent[axis], axis);
        let normal = |axis: AxisId| rules.blend_component(blend, point.normal[axis], axis);
        let over = |kind, ratio: &dyn Fn(AxisId, &AxisLimits) -> f64| {
            let demand = rules.largest(ratio);
            (demand.demand_ratio > RULE_RATIO).then(|| demand.limit(kind))
        };
        let driven = rules.driven(*feed, tangent);
        let centripetal = v * v * point.curvature_per_mm;
        [
            (v > driven.velocity_lu_s * RULE_RATIO).then_some(driven.limit),
            over(LimitKind::Acceleration, &|axis, limits| {
                (a * tangent(axis)).abs() / ((1.0 - ra) * limits.acceleration_max_lu_s2)
            }),
            over(LimitKind::RadialAcceleration, &|axis, limits| {
                (centripetal * normal(axis)).abs() / (ra * limits.acceleration_max_lu_s2)
            }),
            over(LimitKind::TransitionJerk, &|axis, limits| {
                (along * tangent(axis)).abs() / ((1.0 - rj) * limits.transition_jerk_max_lu_s3)
            }),
            over(LimitKind::RadialJerk, &|axis, limits| {
                (across * normal(axis)).abs() / (rj * limits.transition_jerk_max_lu_s3)
            }),
        ]
    }
}

/// The first rule that is broken.
fn first(broken: &[Option<Limit>; RULES]) -> Option<Limit> {
    broken.iter().flatten().copied().next()
}

impl Tally {
    /// A blend crossed by the loop.
    pub(super) fn crossed(&mut self, block: BlockRef, crossing: &Crossing) {
        self.blends += 1;
        for (total, steps) in self.steps.iter_mut().zip(crossing.broken) {
            *total += steps;
        }
        if crossing.broken.iter().any(|steps| *steps > 0) {
            self.blends_broken += 1;
            self.first.get_or_insert(block);
        }
    }

    /// A blend crossed by the guarded law in its place.
    pub(super) fn guarded(&mut self, block: BlockRef) {
        self.blends += 1;
        self.blends_guarded += 1;
        self.first.get_or_insert(block);
    }

    /// What a person should know about all of them, with the block that ends in the first corner concerned.
    pub(super) fn warning(&self) -> Option<(BlockRef, Diagnostic)> {
        let block = self.first?;
        let Self { blends, blends_broken, blends_guarded, .. } = self;
        let counts = RULE_NAMES.iter().zip(self.steps).filter(|(_, steps)| *steps > 0);
        let counts: Vec<String> = counts.map(|(name, steps)| format!("{name} after {steps}")).collect();
        let mut message = format!("the printed blend law breaks its own limits in {blends_broken} of {blends} blends");
        if !counts.is_empty() {
            message += &format!(" (steps: {})", counts.join(", "));
        }
        if *blends_guarded > 0 {
            message +=
                &format!("; {blends_guarded} are crossed at the entry feed, because it would leave them too fast");
        }
        message += &format!("; first at the end of line {}", block.line);
        let help = "give --set smoothing.blend_law=limits for a law that keeps them";
        Some((block, Diagnostic::warning("P0004", message).help(help)))
    }
}

/// The alarm of a blend in which the loop comes to a stand.
pub(super) fn stalled(block: BlockRef) -> Diagnostic {
    let line = block.line;
    Diagnostic::error("P0003", format!("the printed blend law comes to a stand in the blend at the end of line {line}"))
        .help("give --set smoothing.blend_law=limits, or program a larger tolerance or a lower feed")
}
