//! Inertia, friction and gravity from all filtered samples at once.
//!
//! In: [`Motion`]s of one axis. Out: [`Mechanics`]: values in SI units at the motor with 95 % intervals, refusals, what the law leaves over.
//!
//! ```text
//! τ = J (w' - d w'') + B w + Tc sgn w + g0 + gs sin x + gc cos x            rows near a standstill are left out
//! ```
//! d is how late the torque stands behind the position in the trace.
//! The interval has two parts. The first is that of the noise (`normal`). The second is that of the law (`beyond`): where the value would be if a term that the
//! law does not have were there (friction that falls with speed or grows with its square, another viscosity in each direction, a spring
//! behind the motor). It reaches further to the side to which such a term moves the value.

use super::beyond::beyond;
use super::motion::Motion;
use super::normal::{Blocks, Solution};
use super::wire::{AxisResult, Estimate, Figure, Means, Parameter};
use crate::base::AxisKind;
use crate::base::units::{MS_PER_S, percent_from_ratio, rad_from_deg};
use crate::machine::Axis;
use nalgebra::DVector;

/// Columns of a row.
pub(super) const J: usize = 0;
pub(super) const B: usize = 1;
pub(super) const TC: usize = 2;
const G0: usize = 3;
const GS: usize = 4;
const GC: usize = 5;
const SHIFT: usize = 6;
pub(super) const SPRING: usize = 7;
pub(super) const STRIBECK: [usize; 4] = [8, 9, 10, 14];
pub(super) const SQUARE: usize = 11;
pub(super) const ONE_SIDED: usize = 12;
const PLACE: usize = 13;
const WIDTH: usize = 15;

/// Speeds of the Stribeck terms, as shares of the highest: friction that falls over more than a third of the speeds is bent, and no more told from a viscous one.
const STRIBECK_SHARES: [f64; 4] = [0.02, 0.05, 0.15, 0.3];
/// Shift of a value by terms beside the law from which the simulated axis, which has the same law, is not held against the trace.
const MISFIT_SHARE: f64 = 0.1;
/// Share of what looks like acceleration that may be the quantum of the scale, and how well that share is known.
const QUANTUM_SHARE: (f64, f64) = (0.25, 0.25);
/// Share of the highest torque that is next to none.
const NEAR_NONE_SHARE: f64 = 0.02;
/// Share of the torque that a law may leave over.
const UNEXPLAINED_SHARE: f64 = 0.25;
/// What differences at the position cycle do to the values at most, found on traces without noise: inertia and Coulomb friction, and the others.
const METHOD_SHARE: (f64, f64) = (1.5e-4, 5e-4);
/// Length of a block: many times the window and the memory of a speed loop.
const BLOCK_S: (f64, f64) = (0.25, 2.0);
/// Blocks aimed at.
const BLOCKS: f64 = 100.0;
/// Rows of one direction, and time in it, below which it does not count.
const DIRECTION_SHARE: f64 = 0.03;
const DIRECTION_S: f64 = 0.1;
/// Share of the highest acceleration below which the speed counts as constant, rows of it that count, and spread of one speed.
const CONSTANT_SHARE: f64 = 0.05;
const CONSTANT_ROWS: f64 = 100.0;
const ONE_SPEED_SHARE: f64 = 0.1;
/// Range of a rotary axis below which sine, cosine and constant are alike.
const TURN_DEG: f64 = 40.0;

/// What was found, in SI units at the motor.
#[derive(Clone, Debug, Default)]
pub(super) struct Mechanics {
    pub(super) estimates: Vec<Estimate>,
    pub(super) condition: f64,
    pub(super) rms_n_m: f64,
    pub(super) moving_s: f64,
    /// Terms beside the law move a value by more than a little.
    pub(super) misfit: bool,
    /// How much further than the noise terms beside the law let a value lie, downwards and upwards.
    pub(super) room: Vec<(Parameter, [f64; 2])>,
}

impl Mechanics {
    pub(super) fn value(&self, parameter: Parameter) -> Option<f64> {
        self.estimates.iter().find(|estimate| estimate.parameter == parameter).map(|estimate| estimate.value)
    }
}

/// Rows of all motions, and what they cover.
struct Covered {
    blocks: Blocks,
    speed_max_rad_s: f64,
    /// Sum of squares that the quantum of the scale adds to the accelerations.
    quantum_square: f64,
    torque_max_n_m: f64,
    /// Time of motion forward and backward.
    direction_s: [f64; 2],
    range_lu: f64,
    /// Rows without acceleration: time, sum of the speeds, of their squares.
    constant: [f64; 3],
}

impl Covered {
    /// All runs of constant speed have the same speed: that of the motor; `None` if there are several, or none.
    fn one_speed_rad_s(&self) -> Option<f64> {
        let [count, sum, square] = self.constant;
        let mean = sum / count;
        let spread = (square / count - mean * mean).max(0.0).sqrt();
        (count > CONSTANT_ROWS && spread < ONE_SPEED_SHARE * mean).then_some(mean)
    }
}

fn covered(motions: &[Motion]) -> Covered {
    let speed_max_rad_s = motions.iter().map(|motion| motion.speed_max_rad_s).fold(0.0, f64::max);
    let seconds = |motion: &Motion| motion.moves.iter().filter(|moves| **moves).count() as f64 * motion.period_s;
    let block_s = (motions.iter().map(seconds).sum::<f64>() / BLOCKS).clamp(BLOCK_S.0, BLOCK_S.1);
    let mut all = Covered {
        blocks: Blocks::new(WIDTH),
        speed_max_rad_s,
        quantum_square: 0.0,
        torque_max_n_m: 0.0,
        direction_s: [0.0; 2],
        range_lu: 0.0,
        constant: [0.0; 3],
    };
    let accelerations = motions.iter().flat_map(|motion| &motion.acceleration_rad_s2).filter(|a| a.is_finite());
    let acceleration_max_rad_s2 = accelerations.fold(0.0_f64, |most, a| most.max(a.abs()));
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for motion in motions {
        let per_block = ((block_s / motion.period_s).round() as usize).max(1);
        for k in (0..motion.moves.len()).filter(|k| motion.moves[*k]) {
            let row = row(motion, k, speed_max_rad_s);
            if !row.iter().all(|value| value.is_finite()) {
                continue;
            }
            all.blocks.push_in(k / per_block, &row, motion.torque_n_m[k]);
            all.quantum_square += motion.quantum_rad2_s4;
            all.torque_max_n_m = all.torque_max_n_m.max(motion.torque_n_m[k].abs());
            all.direction_s[usize::from(row[TC] < 0.0)] += motion.period_s;
            if row[J].abs() < CONSTANT_SHARE * acceleration_max_rad_s2 {
                let speed = row[B].abs();
                all.constant = [all.constant[0] + 1.0, all.constant[1] + speed, all.constant[2] + speed * speed];
            }
            lowest = motion.position_lu[k].min(lowest);
            highest = motion.position_lu[k].max(highest);
        }
        all.blocks.close();
    }
    all.range_lu = (highest - lowest).max(0.0);
    all
}

fn row(motion: &Motion, k: usize, speed_max_rad_s: f64) -> [f64; WIDTH] {
    let w = motion.speed_rad_s[k];
    let sign = w.signum();
    let (sin, cos) = motion.position_lu[k].sin_cos();
    let stribeck = |share: f64| sign * (-w.abs() / (share * speed_max_rad_s)).exp();
    [
        motion.acceleration_rad_s2[k],
        w,
        sign,
        1.0,
        sin,
        cos,
        motion.jerk_rad_s3(k),
        motion.snap_rad_s4(k),
        stribeck(STRIBECK_SHARES[0]),
        stribeck(STRIBECK_SHARES[1]),
        stribeck(STRIBECK_SHARES[2]),
        w * w.abs(),
        w.abs(),
        motion.position_lu[k],
        stribeck(STRIBECK_SHARES[3]),
    ]
}

/// Fits the law; refusals, figures and verdicts go into `result`.
pub(super) fn one_shot(motions: &[Motion], axis: &Axis, result: &mut AxisResult) -> Mechanics {
    let all = covered(motions);
    let moving_s = all.direction_s[0] + all.direction_s[1];
    let mut found = Mechanics { moving_s, ..Mechanics::default() };
    let Some((columns, both)) = columns(&all, axis, result) else { return found };
    let Some(solution) = all.blocks.solve(&columns) else {
        refuse_all(result, "its motion does not tell inertia, friction and speed apart", PLAN);
        return found;
    };
    (found.condition, found.rms_n_m) = (solution.condition, solution.rms);
    let beyond = beyond(&all.blocks, &columns, &solution, &mut result.verdicts);
    let moved = |place: usize| {
        matches!(columns[place], J | B | TC) && beyond.shifts[place] > MISFIT_SHARE * solution.theta[place].abs()
    };
    found.misfit = (0..columns.len()).any(moved);
    if beyond.open {
        let reason = "friction falls over a third of the speeds and more: what is constant and what grows with speed is not told apart";
        for parameter in [Parameter::Viscous, Parameter::Coulomb] {
            result.refuse(
                parameter,
                reason,
                "record more constant speeds, up to the highest (`sollwert identify --plan`)",
            );
        }
    }
    for (place, column) in columns.iter().enumerate() {
        let Some(parameter) = parameter_of(*column, both).filter(|parameter| result.refusal(*parameter).is_none())
        else {
            continue;
        };
        let (value, noise) = solution.value(place);
        let method = if matches!(*column, J | TC) { METHOD_SHARE.0 } else { METHOD_SHARE.1 };
        let half = noise.hypot(method * value);
        // How much further than the noise the law itself lets the value lie, downwards and upwards.
        let room = [(value - beyond.low[place] - half).max(0.0), (beyond.high[place] - value - half).max(0.0)];
        found.room.push((parameter, room));
        let mut estimate = Estimate::around(parameter, value, half, Means::OneShot).reaching(room);
        if parameter == Parameter::Viscous && estimate.value < 0.0 && estimate.high >= 0.0 {
            // No friction drives an axis.
            estimate.value = 0.0;
        }
        if parameter == Parameter::Inertia {
            // Noise of the scale in the acceleration makes a slope too small, by its share of what the column has of its own.
            let share = (all.quantum_square / solution.own_square[place]).min(1.0);
            if share > QUANTUM_SHARE.0 {
                let percent = percent_from_ratio(share);
                let reason = format!("{percent:.0} % of what looks like acceleration is the quantum of the scale");
                result.refuse(
                    parameter,
                    reason,
                    "record jerk-limited moves at the highest acceleration (`sollwert identify --plan`)",
                );
                continue;
            }
            estimate = estimate.scaled(1.0 / (1.0 - share)).widened(QUANTUM_SHARE.1 * share * value.abs());
        }
        match verdict(&estimate, &all, solution.stretches[place], found.value(Parameter::Coulomb)) {
            None => found.estimates.push(estimate),
            Some((reason, remedy)) => result.refuse(parameter, reason, remedy),
        }
    }
    figures(&all, &columns, &solution, both, result);
    late(&columns, &solution, motions, result);
    points(motions, &columns, &solution.theta, result);
    found
}

/// Which motions the law of the others does not explain. Those that a law of their own explains decide; without any of them, all are kept.
pub(super) fn unexplained(motions: &[Motion], rotary: bool) -> Vec<bool> {
    let none = vec![false; motions.len()];
    if motions.len() < 2 {
        return none;
    }
    let blocks: Vec<Blocks> = motions.iter().map(|motion| covered(std::slice::from_ref(motion)).blocks).collect();
    let left_share = |blocks: &Blocks, columns: &[usize], theta: &DVector<f64>| {
        (blocks.residual_square(columns, theta) / blocks.response_square()).sqrt()
    };
    let explains_itself = |blocks: &Blocks| {
        let (columns, solution) = any_law(blocks, rotary)?;
        (solution.theta[J] > 0.0 && left_share(blocks, &columns, &solution.theta) <= UNEXPLAINED_SHARE).then_some(())
    };
    let own: Vec<bool> = blocks.iter().map(|blocks| explains_itself(blocks).is_some()).collect();
    let good: Vec<Motion> =
        motions.iter().zip(&own).filter(|(_, own)| **own).map(|(motion, _)| motion.clone()).collect();
    if good.is_empty() || good.len() == motions.len() {
        return none;
    }
    let Some((columns, solution)) = any_law(&covered(&good).blocks, rotary) else { return none };
    let strange =
        |(blocks, own): (&Blocks, &bool)| !own && left_share(blocks, &columns, &solution.theta) > UNEXPLAINED_SHARE;
    blocks.iter().zip(&own).map(strange).collect()
}

/// The law with as many of its columns as the motion tells apart; the inertia is the first.
fn any_law(blocks: &Blocks, rotary: bool) -> Option<(Vec<usize>, Solution)> {
    let laws: [&[usize]; 4] =
        [&[J, B, TC, G0, SHIFT, GS, GC], &[J, B, TC, G0, SHIFT], &[J, B, G0, SHIFT], &[J, TC, G0, SHIFT]];
    laws.into_iter().skip(usize::from(!rotary)).find_map(|columns| Some((columns.to_vec(), blocks.solve(columns)?)))
}

const PLAN: &str =
    "record the programs of `sollwert identify --plan`: constant speeds in both directions, and jerk-limited moves";

fn refuse_all(result: &mut AxisResult, reason: &str, remedy: &str) {
    for parameter in [Parameter::Inertia, Parameter::Viscous, Parameter::Coulomb, Parameter::Gravity] {
        result.refuse(parameter, reason, remedy);
    }
}

/// Which columns the motion can tell apart, and whether it goes both ways.
fn columns(all: &Covered, axis: &Axis, result: &mut AxisResult) -> Option<(Vec<usize>, bool)> {
    let [forward_s, backward_s] = all.direction_s;
    let moving_s = forward_s + backward_s;
    if all.blocks.rows() < 10 * WIDTH || moving_s < 2.0 * DIRECTION_S {
        let reason = format!("the axis moves for {moving_s:.2} s only that can be used");
        refuse_all(result, &reason, PLAN);
        return None;
    }
    let both = forward_s.min(backward_s) >= (DIRECTION_SHARE * moving_s).max(DIRECTION_S);
    let mut columns = vec![J, B];
    if both {
        columns.push(TC);
    } else {
        let way = if forward_s > backward_s { "positive" } else { "negative" };
        let reason = format!("the axis moves in {way} direction only: friction and gravity are one constant torque");
        for parameter in [Parameter::Coulomb, Parameter::Gravity] {
            result.refuse(parameter, reason.as_str(), "record the same motion in the other direction as well");
        }
    }
    if let Some(speed) = all.one_speed_rad_s() {
        let reason = format!(
            "the axis runs at one constant speed only ({speed:.1} rad/s at the motor): both frictions are one torque there"
        );
        for parameter in [Parameter::Viscous, Parameter::Coulomb] {
            result.refuse(
                parameter,
                reason.as_str(),
                "record constant speeds from 5 to 90 % of the highest (`sollwert identify --plan`)",
            );
        }
    }
    columns.push(G0);
    if axis.kind == AxisKind::Rotary {
        if all.range_lu >= rad_from_deg(TURN_DEG) {
            columns.extend([GS, GC]);
        } else {
            // Over a small angle gravity is a straight line; it must not count as inertia or friction.
            columns.push(PLACE);
            for parameter in [Parameter::Gravity, Parameter::GravitySin, Parameter::GravityCos] {
                let reason =
                    format!("the axis turns by less than {TURN_DEG:.0} deg: constant, sine and cosine are one torque");
                result.refuse(parameter, reason, "record a motion over a quarter of a turn or more");
            }
        }
    }
    // Torque and position of a trace are never quite of one instant: a mean of samples is late by half a current cycle, a sample at the tick may be
    // early or late, and two clocks may stand apart.
    columns.push(SHIFT);
    Some((columns, both))
}

fn parameter_of(column: usize, both: bool) -> Option<Parameter> {
    match column {
        J => Some(Parameter::Inertia),
        B => Some(Parameter::Viscous),
        TC => Some(Parameter::Coulomb),
        G0 if both => Some(Parameter::Gravity),
        GS => Some(Parameter::GravitySin),
        GC => Some(Parameter::GravityCos),
        _ => None,
    }
}

/// Why an estimate is none, and what to do.
fn verdict(estimate: &Estimate, all: &Covered, stretches: f64, coulomb: Option<f64>) -> Option<(String, String)> {
    let (value, half) = (estimate.value, estimate.half());
    let percent = |share: f64| percent_from_ratio(share);
    if stretches < 3.0 {
        let reason = "it rests on one or two short stretches: no interval can be given".to_owned();
        return Some((reason, PLAN.to_owned()));
    }
    let wide = |limit: f64| half > limit * value.abs();
    match estimate.parameter {
        Parameter::Inertia if value <= 0.0 => Some((
            format!(
                "the torque falls where the axis accelerates (J = {value:.3e}): the sign of torque or transmission is wrong"
            ),
            "check pitch_mm or gear_ratio with its sign, and which signal is the torque".to_owned(),
        )),
        Parameter::Inertia if wide(0.3) => Some((
            format!(
                "the trace hardly accelerates the axis, or does not follow the law: ±{:.0} %",
                percent(half / value.abs())
            ),
            "record jerk-limited moves at the highest acceleration (`sollwert identify --plan`)".to_owned(),
        )),
        Parameter::Viscous if estimate.high < 0.0 => Some((
            "friction falls with speed: a viscous law does not hold here".to_owned(),
            "record more constant speeds, up to the highest (`sollwert identify --plan`)".to_owned(),
        )),
        // A viscous friction near none is a value too, where even the end of its interval makes next to no torque.
        Parameter::Viscous if wide(0.5) && half * all.speed_max_rad_s > NEAR_NONE_SHARE * all.torque_max_n_m => Some((
            format!(
                "the speeds are too much alike to tell it from constant friction: between {:.2e} and {:.2e}",
                estimate.low, estimate.high
            ),
            "record constant speeds from 5 to 90 % of the highest (`sollwert identify --plan`)".to_owned(),
        )),
        Parameter::Coulomb if wide(0.15) && half > NEAR_NONE_SHARE * all.torque_max_n_m => Some((
            format!("it is not told from friction that grows with speed: ±{:.0} %", percent(half / value.abs())),
            "record constant speeds from 5 to 90 % of the highest, in both directions".to_owned(),
        )),
        Parameter::Coulomb if estimate.high < 0.0 => Some((
            "it comes out negative: the sign of the torque, or the law, does not fit".to_owned(),
            "check which signal is the torque, and its sign".to_owned(),
        )),
        Parameter::Gravity | Parameter::GravitySin | Parameter::GravityCos
            if half > 0.5 * value.abs().max(coulomb.unwrap_or(0.0)).max(NEAR_NONE_SHARE * all.torque_max_n_m) =>
        {
            Some((format!("it is not told from friction: ±{half:.2e} N m"), PLAN.to_owned()))
        }
        _ => None,
    }
}

/// How late the torque stands behind the position: τ(t - d) is J w' - d J w''.
fn late(columns: &[usize], solution: &Solution, motions: &[Motion], result: &mut AxisResult) {
    let Some(shift) = columns.iter().position(|column| *column == SHIFT) else { return };
    let (late_s, half_s) = solution.function(shift, |theta| -theta[shift] / theta[0]);
    let period_s = motions.iter().map(|motion| motion.period_s).fold(0.0, f64::max);
    if late_s.abs() > half_s.max(LATE_SHARE * period_s) {
        let (late_ms, half_ms) = (late_s * MS_PER_S, half_s * MS_PER_S);
        result.verdicts.push(format!(
            "the torque stands {late_ms:.2} ms (±{half_ms:.2}) behind the position in this trace: that is taken out of the mechanics"
        ));
    }
}

/// Share of the cycle from which that is said.
const LATE_SHARE: f64 = 0.25;

/// Torque of each direction, and of the one direction where there is only one.
fn figures(all: &Covered, columns: &[usize], solution: &Solution, both: bool, result: &mut AxisResult) {
    let at = |column: usize| columns.iter().position(|known| *known == column).map(|place| solution.theta[place]);
    let mut push = |key, title: &str, value| {
        result.figures.push(Figure { key, title: title.to_owned(), value, unit: "N m" });
    };
    match (at(TC), at(G0)) {
        (Some(coulomb), Some(gravity)) if both => {
            push("dry_torque_positive_n_m", "dry torque in positive direction, gravity included", coulomb + gravity);
            push("dry_torque_negative_n_m", "dry torque in negative direction, gravity included", gravity - coulomb);
            if gravity.abs() > 0.05 * coulomb.abs() {
                result.verdicts.push(
                    "a constant torque is gravity or a difference of the friction of the two directions: motion alone does not tell which"
                        .to_owned(),
                );
            }
        }
        (None, Some(constant)) => {
            push("dry_torque_n_m", "constant torque in the one direction, friction and gravity", constant);
        }
        _ => {}
    }
    let rms = solution.rms;
    push("torque_residual_rms_n_m", "torque that the law leaves over, RMS after the filter", rms);
    if rms > UNEXPLAINED_SHARE * all.torque_max_n_m {
        result.verdicts.push(
            "a quarter of the torque and more is not explained by the law: something else moves this axis".to_owned(),
        );
    }
}

/// Speeds of a picture.
const POINTS: usize = 40;

/// Mean torque by speed, without inertia, and the torque of the law there.
fn points(motions: &[Motion], columns: &[usize], theta: &DVector<f64>, result: &mut AxisResult) {
    let speed_max_rad_s = motions.iter().map(|motion| motion.speed_max_rad_s).fold(0.0, f64::max);
    let mut bins = vec![(0_u32, 0.0_f64, 0.0_f64, 0.0_f64); POINTS];
    for motion in motions {
        for k in (0..motion.moves.len()).filter(|k| motion.moves[*k]) {
            let row = row(motion, k, speed_max_rad_s);
            let law: f64 = columns.iter().zip(theta.iter()).map(|(column, value)| row[*column] * value).sum();
            let inertia = row[J] * theta[0];
            let place = ((row[B] / speed_max_rad_s + 1.0) / 2.0 * POINTS as f64).clamp(0.0, POINTS as f64 - 1.0);
            let bin = &mut bins[place as usize];
            if law.is_finite() {
                *bin = (bin.0 + 1, bin.1 + row[B], bin.2 + motion.torque_n_m[k] - inertia, bin.3 + law - inertia);
            }
        }
    }
    let filled = bins.iter().filter(|bin| bin.0 > 20);
    result.friction_points = filled.map(|bin| [bin.1, bin.2, bin.3].map(|sum| sum / f64::from(bin.0))).collect();
}
