//! The published procedure in stages: friction from runs of constant speed, then inertia from what is left where the axis accelerates.
//!
//! In: [`Motion`]s of one axis. Out: estimates in SI units at the motor, to be held against those of least squares over everything.
//!
//! ```text
//! mean τ of a run = Tc sgn w + B w + Tg        runs of 0.1 s and more, 0.1 s after the speed is reached
//! J = Σ (τ - Tc sgn w - B w - Tg) w' / Σ w'²   where |w'| is large
//! ```
//! Tg = g0, and of a rotary axis that turns far enough g0 + gs mean(sin x) + gc mean(cos x) [Prévost 2009]. Gives nothing where there are fewer
//! runs than values and one more, or one direction.

use super::motion::Motion;
use super::normal::Blocks;
use super::wire::{Estimate, Means, Parameter};

/// Time after the end of a ramp that is left out.
const SETTLING_S: f64 = 0.1;
/// Shortest run after that.
const RUN_S: f64 = 0.1;
/// Share of the highest acceleration below which the speed counts as constant.
const CONSTANT_SHARE: f64 = 0.03;
/// Share of it above which inertia counts.
const ACCELERATING_SHARE: f64 = 0.2;
/// Friction and inertia in stages; empty where the traces do not hold the runs. `turns`: gravity turns with the axis.
pub(super) fn staged(motions: &[Motion], turns: bool) -> Vec<Estimate> {
    let fastest = motions.iter().flat_map(|motion| &motion.acceleration_rad_s2).filter(|a| a.is_finite());
    let acceleration_max_rad_s2 = fastest.fold(0.0_f64, |most, a| most.max(a.abs()));
    let parameters = &STAGES[..if turns { 5 } else { 3 }];
    let mut runs = Blocks::new(parameters.len());
    let (mut count, mut forward) = (0_usize, 0_usize);
    for motion in motions {
        for (from, to) in constant_runs(motion, CONSTANT_SHARE * acceleration_max_rad_s2) {
            // A longer run counts for more.
            let weight = ((to - from) as f64 * motion.period_s).sqrt();
            let mut mean = [0.0; 6];
            for k in from..to {
                let row = row(motion, k);
                let with_torque = row.iter().chain([&motion.torque_n_m[k]]);
                mean.iter_mut().zip(with_torque).for_each(|(mean, value)| *mean += weight * value / (to - from) as f64);
            }
            runs.push_in(count, &mean[..parameters.len()], mean[5]);
            count += 1;
            forward += usize::from(mean[0] > 0.0);
        }
    }
    if count <= parameters.len() || forward == 0 || forward == count {
        return Vec::new();
    }
    let columns: Vec<usize> = (0..parameters.len()).collect();
    let Some(friction) = runs.solve(&columns) else { return Vec::new() };
    let of = |(place, parameter): (usize, &Parameter)| {
        let (value, half) = friction.value(place);
        Estimate::around(*parameter, value, half, Means::Staged)
    };
    let mut found: Vec<Estimate> = parameters.iter().enumerate().map(of).collect();
    let mut pushes = Blocks::new(1);
    for motion in motions {
        let per_block = ((0.25 / motion.period_s).round() as usize).max(1);
        for k in (0..motion.moves.len()).filter(|k| motion.moves[*k]) {
            let a = motion.acceleration_rad_s2[k];
            if a.abs() > ACCELERATING_SHARE * acceleration_max_rad_s2 {
                let without: f64 =
                    friction.theta.iter().zip(row(motion, k)).map(|(value, column)| value * column).sum();
                pushes.push_in(k / per_block, &[a], motion.torque_n_m[k] - without);
            }
        }
        pushes.close();
    }
    if let Some(inertia) = pushes.solve(&[0]).filter(|solution| solution.stretches[0] > 2.0) {
        let (value, half) = inertia.value(0);
        found.insert(0, Estimate::around(Parameter::Inertia, value, half, Means::Staged));
    }
    found
}

/// What the runs tell, in the order of a row.
const STAGES: [Parameter; 5] =
    [Parameter::Viscous, Parameter::Coulomb, Parameter::Gravity, Parameter::GravitySin, Parameter::GravityCos];

fn row(motion: &Motion, k: usize) -> [f64; 5] {
    let (w, (sin, cos)) = (motion.speed_rad_s[k], motion.position_lu[k].sin_cos());
    [w, w.signum(), 1.0, sin, cos]
}

/// Stretches of constant speed, the settling left out.
fn constant_runs(motion: &Motion, slow_change_rad_s2: f64) -> Vec<(usize, usize)> {
    let constant = |k: usize| motion.moves[k] && motion.acceleration_rad_s2[k].abs() <= slow_change_rad_s2;
    let (settling, shortest) = ((SETTLING_S / motion.period_s) as usize, (RUN_S / motion.period_s) as usize);
    let mut runs = Vec::new();
    let mut start = None;
    for k in 0..=motion.moves.len() {
        let holds = k < motion.moves.len() && constant(k);
        match (start, holds) {
            (None, true) => start = Some(k),
            (Some(from), false) => {
                if k - from >= settling + shortest.max(1) {
                    runs.push((from + settling, k));
                }
                start = None;
            }
            _ => {}
        }
    }
    runs
}
