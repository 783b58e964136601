//! Error of a screw or gear over the position, and the compensation of it in the control (MD32700, $AA_ENC_COMP).
//!
//! In: a position. Out: the error there: linear between equidistant points; outside them the first or last value, or periodic. What
//! changes the value at run time (temperature, wear) is not modelled.

use crate::machine::{DriveData, ErrorTable, PositionSource};

/// More than enough to invert a table whose slope is at most a half: each round halves what is left.
const ROUNDS_MAX: u32 = 64;

/// Error of the screw and its compensation; boxed by the drive, as most axes have neither.
#[derive(Clone, Debug)]
pub(super) struct PitchError {
    screw: Option<ErrorTable>,
    compensation: Option<ErrorTable>,
    /// MD31040 = 0: the compensation works on the motor's position, else on that of the scale.
    motor_measures: bool,
}

impl PitchError {
    /// `None`: a true screw, and nothing compensated.
    pub(super) fn new(data: &DriveData) -> Option<Self> {
        let (screw, compensation) = (data.pitch_error.clone(), data.encoder_compensation.clone());
        let motor_measures = data.encoder.position_source == PositionSource::Motor;
        (screw.is_some() || compensation.is_some()).then_some(Self { screw, compensation, motor_measures })
    }

    /// Where the nominal position (pitch times motor angle) is when the axis measures `measured_lu`.
    pub(super) fn nominal_lu(&self, measured_lu: f64) -> f64 {
        let encoder_lu = inverse(self.compensation.as_ref(), measured_lu);
        if self.motor_measures { encoder_lu } else { inverse(self.screw.as_ref(), encoder_lu) }
    }

    /// The load, when pitch and angle say `nominal_lu`.
    pub(super) fn load_lu(&self, nominal_lu: f64) -> f64 {
        nominal_lu + self.screw.as_ref().map_or(0.0, |table| error(table, nominal_lu).0)
    }

    /// Velocity of the load over the nominal one.
    pub(super) fn velocity_ratio(&self, nominal_lu: f64) -> f64 {
        1.0 + self.screw.as_ref().map_or(0.0, |table| error(table, nominal_lu).1)
    }

    /// What the control adds to the position that its encoder gives.
    pub(super) fn correction_lu(&self, encoder_lu: f64) -> f64 {
        self.compensation.as_ref().map_or(0.0, |table| error(table, encoder_lu).0)
    }
}

/// The error at a position, and its slope.
fn error(table: &ErrorTable, position_lu: f64) -> (f64, f64) {
    let errors_lu = &table.errors_lu;
    let intervals = errors_lu.len().saturating_sub(1);
    let mut place = (position_lu - table.start_lu) / table.step_lu;
    if table.periodic {
        place = place.rem_euclid(intervals as f64);
    }
    // What lies before the table takes its first interval; the last one ends in the last point. NaN stays NaN in the fraction.
    let before = (place.floor().max(0.0) as usize).min(intervals.saturating_sub(1));
    let fraction_ratio = (place - before as f64).clamp(0.0, 1.0);
    let (Some(first_lu), Some(second_lu)) = (errors_lu.get(before), errors_lu.get(before + 1)) else {
        return (0.0, 0.0);
    };
    let outside = place < 0.0 || place > intervals as f64;
    let slope = if outside { 0.0 } else { (second_lu - first_lu) / table.step_lu };
    (first_lu + fraction_ratio * (second_lu - first_lu), slope)
}

/// The y with y + error(y) = `sum_lu`.
fn inverse(table: Option<&ErrorTable>, sum_lu: f64) -> f64 {
    let Some(table) = table else { return sum_lu };
    let mut position_lu = sum_lu;
    for _ in 0..ROUNDS_MAX {
        let next_lu = sum_lu - error(table, position_lu).0;
        if next_lu == position_lu {
            break;
        }
        position_lu = next_lu;
    }
    position_lu
}
