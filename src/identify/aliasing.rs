//! An inertia from a current that was sampled once a position cycle, brought to what its mean would have given.
//!
//! In: the trace, drive data with the values found so far. Out: the factor between the two inertias. The speed set-point steps once a position
//! cycle, the current follows it as a sawtooth, and a sample at the tick lies at the end of a tooth: an inertia fitted to such samples is
//! wrong by -5 % at 1 ms and -16 % at 2 ms, a friction by some tenths of a percent. The simulated axis (the same set-points, the controllers of the machine file) shows both, the
//! sample and the mean, and both go through the same fit as the trace. Does not mend the trace itself.

use super::friction::one_shot;
use super::motion::Motion;
use super::record::AxisRecord;
use super::wire::{AxisResult, Parameter};
use crate::base::TimeBase;
use crate::drive::{AxisDrive, DriveInput, Start};
use crate::machine::{Axis, DriveData};

/// What sampling did to an inertia.
pub(super) struct Folding {
    /// Inertia from samples over inertia from means.
    pub(super) inertia_ratio: f64,
    /// By how much samples move the other values.
    pub(super) shifts: Vec<(Parameter, f64)>,
}

/// `None`: the trace has no set-points at the position cycle, or the simulated axis gives no inertia either.
pub(super) fn folding(
    records: &[AxisRecord],
    axis: &Axis,
    data: &DriveData,
    time_base: &TimeBase,
    torque_reference: bool,
) -> Option<Folding> {
    let r = data.mechanics.transmission_lu_per_rad;
    let kt = data.motor.torque_constant_n_m_per_a;
    let simulated = Axis { drive: Some(data.clone()), ..axis.clone() };
    let (mut sampled, mut meant) = (Vec::new(), Vec::new());
    for record in records {
        let setpoint = record.setpoint_lu.as_ref()?;
        let first = setpoint.iter().copied().find(|value| value.is_finite())?;
        let mut drive = AxisDrive::new(&simulated, time_base, Start::Held, first)?;
        let (mut position, mut at_tick, mut mean) = (Vec::new(), Vec::new(), Vec::new());
        let mut last = first;
        for value in setpoint {
            // A gap holds the axis; its rows are not used.
            last = if value.is_finite() { *value } else { last };
            let input = DriveInput { position_setpoint_lu: last, load_n_m: 0.0, feedforward_active: true };
            let signals = drive.step(input);
            position.push(if value.is_finite() { signals.position_measured_lu } else { f64::NAN });
            at_tick.push(if torque_reference { signals.torque_reference_n_m } else { kt * signals.current_a });
            mean.push(kt * signals.current_mean_a);
        }
        if !drive.is_finite() {
            return None;
        }
        sampled.push(Motion::from_series(&position, &at_tick, true, record.period_s, r));
        meant.push(Motion::from_series(&position, &mean, false, record.period_s, r));
    }
    let of = |motions: &[Motion]| {
        let mut unused = AxisResult::new(&axis.name);
        one_shot(motions, axis, &mut unused)
    };
    let (sampled, meant) = (of(&sampled), of(&meant));
    let inertia_ratio = sampled.value(Parameter::Inertia)? / meant.value(Parameter::Inertia)?;
    let shift = |parameter| Some((parameter, (sampled.value(parameter)? - meant.value(parameter)?).abs()));
    let shifts = [Parameter::Viscous, Parameter::Coulomb, Parameter::Gravity].into_iter().filter_map(shift).collect();
    (inertia_ratio.is_finite() && inertia_ratio > 0.2).then_some(Folding { inertia_ratio, shifts })
}
