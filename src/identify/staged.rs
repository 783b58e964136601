//! The published procedure in stages: friction from runs of constant speed, then inertia from what is left where the axis accelerates.
//!
//! In: [`Motion`]s of one axis. Out: estimates in SI units at the motor, to be held against those of least squares over everything.
//!
//! ```text
//! mean τ of a run = Tc sgn w + B w + g0        runs of 0.1 s and more, 0.1 s after the speed is reached
//! J = Σ (τ - Tc sgn w - B w - g0) w' / Σ w'²   where |w'| is large
//! ```
//! [Prévost 2009]. Does not know gravity that turns with the axis, and gives nothing where there are fewer than four runs or one direction.

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
/// Runs at least.
const RUNS_MIN: usize = 4;

/// Friction and inertia in stages; empty where the traces do not hold the runs.
pub(super) fn staged(motions: &[Motion]) -> Vec<Estimate> {
    let fastest = motions.iter().flat_map(|motion| &motion.acceleration_rad_s2).filter(|a| a.is_finite());
    let acceleration_max_rad_s2 = fastest.fold(0.0_f64, |most, a| most.max(a.abs()));
    let mut runs = Blocks::new(3);
    let (mut count, mut forward) = (0_usize, 0_usize);
    for motion in motions {
        for (from, to) in constant_runs(motion, CONSTANT_SHARE * acceleration_max_rad_s2) {
            let mean = |values: &[f64]| values[from..to].iter().sum::<f64>() / (to - from) as f64;
            let (w, torque) = (mean(&motion.speed_rad_s), mean(&motion.torque_n_m));
            // A longer run counts for more.
            let weight = ((to - from) as f64 * motion.period_s).sqrt();
            runs.push_in(count, &[w * weight, w.signum() * weight, weight], torque * weight);
            count += 1;
            forward += usize::from(w > 0.0);
        }
    }
    if count < RUNS_MIN || forward == 0 || forward == count {
        return Vec::new();
    }
    let Some(friction) = runs.solve(&[0, 1, 2]) else { return Vec::new() };
    let mut found: Vec<Estimate> = [Parameter::Viscous, Parameter::Coulomb, Parameter::Gravity]
        .into_iter()
        .enumerate()
        .map(|(place, parameter)| {
            let (value, half) = friction.value(place);
            Estimate::around(parameter, value, half, Means::Staged)
        })
        .collect();
    let [viscous, coulomb, gravity] = [0, 1, 2].map(|place| friction.theta[place]);
    let mut pushes = Blocks::new(1);
    for motion in motions {
        let per_block = ((0.25 / motion.period_s).round() as usize).max(1);
        for k in (0..motion.moves.len()).filter(|k| motion.moves[*k]) {
            let (w, a) = (motion.speed_rad_s[k], motion.acceleration_rad_s2[k]);
            if a.abs() > ACCELERATING_SHARE * acceleration_max_rad_s2 {
                let left = motion.torque_n_m[k] - coulomb * w.signum() - viscous * w - gravity;
                pushes.push_in(k / per_block, &[a], left);
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
