//! Gain and reset time of the speed loop, from a trace as fast as that loop.
//!
//! In: [`FineRecord`]s. Out: `Kp` and `Tn`. From one speed cycle to the next the law of the controller is
//!
//! ```text
//! t[k] - t[k-1] - (t_ff[k] - t_ff[k-1]) = Kp (e[k] - e[k-1]) + Kp T_v/Tn e[k]          e = w_ref - w
//! ```
//! Rows at the torque limit are left out. From position ticks alone it cannot be told: the integral runs between them. Does not know
//! filters of the speed set-point or a reference model; what they leave over is said.

use super::normal::Blocks;
use super::record::{AxisRecord, FineRecord};
use super::wire::{AxisResult, Estimate, Means, Parameter};
use crate::base::units::{US_PER_S, percent_from_ratio};
use crate::machine::DriveData;

/// Rows of a block.
const BLOCK_S: f64 = 0.1;
/// Share of the change of torque that may be left over.
const LEFT_OVER_SHARE: f64 = 0.05;

/// Fits the law.
pub(super) fn speed_loop(
    records: &[AxisRecord],
    data: &DriveData,
    speed_cycle_s: f64,
    result: &mut AxisResult,
) -> Vec<Estimate> {
    let remedy = format!(
        "record speed set-point, speed and torque set-point of the drive every {:.1} us (`run --record-rate speed`; a drive trace)",
        speed_cycle_s * US_PER_S
    );
    let refuse = |result: &mut AxisResult, reason: &str| {
        result.refuse(Parameter::SpeedGain, reason, remedy.as_str());
        result.refuse(Parameter::SpeedResetTime, reason, remedy.as_str());
        Vec::new()
    };
    let fast = |record: &&FineRecord| (record.period_s / speed_cycle_s - 1.0).abs() < 1e-3;
    let fine: Vec<&FineRecord> = records.iter().filter_map(|record| record.fine.as_ref()).filter(fast).collect();
    if fine.is_empty() {
        return refuse(
            result,
            "no trace shows the speed loop at its own cycle: its integral runs between the position ticks",
        );
    }
    let mut blocks = Blocks::new(2);
    let mut square = 0.0;
    let limit_n_m = 0.999 * data.current_max_a * data.motor.torque_constant_n_m_per_a;
    for record in &fine {
        let per_block = ((BLOCK_S / record.period_s).round() as usize).max(1);
        for k in 1..record.speed_rad_s.len() {
            let error = |k: usize| record.speed_reference_rad_s[k] - record.speed_rad_s[k];
            let ahead = |k: usize| record.torque_feedforward_n_m.as_ref().map_or(0.0, |torque| torque[k]);
            let torque = |k: usize| record.torque_reference_n_m[k] - ahead(k);
            let free = record.torque_reference_n_m[k].abs().max(record.torque_reference_n_m[k - 1].abs()) < limit_n_m;
            let (row, y) = ([error(k) - error(k - 1), error(k)], torque(k) - torque(k - 1));
            if free && y.is_finite() && row.iter().all(|value| value.is_finite()) {
                blocks.push_in(k / per_block, &row, y);
                square += y * y;
            }
        }
        blocks.close();
    }
    let Some(solution) = blocks.solve(&[0, 1]) else {
        return refuse(result, "the speed loop has nothing to do in this trace");
    };
    let share = (blocks.residual_square(&[0, 1], &solution.theta) / square).sqrt();
    if share > LEFT_OVER_SHARE {
        let percent = percent_from_ratio(share);
        let reason = format!(
            "a PI controller leaves {percent:.0} % of the torque over: a filter or a reference model is in the loop"
        );
        return refuse(result, &reason);
    }
    let (gain, gain_half) = solution.value(0);
    let reset = |theta: &nalgebra::DVector<f64>| theta[0] * speed_cycle_s / theta[1];
    let (reset_s, reset_half_s) = solution.function(1, reset);
    let mut found = vec![Estimate::around(Parameter::SpeedGain, gain, gain_half, Means::ControlLaw)];
    if reset_s > 0.0 && reset_half_s < 0.5 * reset_s {
        found.push(Estimate::around(Parameter::SpeedResetTime, reset_s, reset_half_s, Means::ControlLaw));
    } else {
        result.refuse(Parameter::SpeedResetTime, "the integral part hardly acts in this trace", remedy.as_str());
    }
    found
}
