//! What the control watches: exact-stop windows, contour, positioning and standstill monitoring (MD36000 to MD36040, MD36400), speed set-point at its limit (MD36220).
//!
//! In: once a position cycle the set-point, the reference and the velocity feed-forward of the position controller, the measured
//! position, and whether the speed set-point is at its limit. Out: [`View`]: contour deviation, and bits of [`monitoring`](super::wire::monitoring). Watches only: the kernel makes alarms
//! of the bits, and block ends of the windows.

use super::limit::limited;
use super::wire::monitoring as bits;
use crate::machine::{DriveData, MonitoringData};

/// A set-point that moves less in a position cycle is at rest: two ways to compute the same place differ by their rounding.
const REST_LU: f64 = 1e-9;

/// What the control sees in one position cycle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct View {
    /// Lag of the axis minus that of its model.
    pub(super) contour_deviation_lu: f64,
    /// Bits of [`monitoring`](super::wire::monitoring).
    pub(super) bits: u32,
}

/// The axis as the control expects it: the position controller with its clamp, and a speed loop without any lag.
#[derive(Clone, Debug)]
struct AxisModel {
    gain_per_s: f64,
    velocity_max_lu_s: f64,
    position_lu: f64,
}

/// The box beside the position loop.
#[derive(Clone, Debug)]
pub(super) struct Monitor {
    model: AxisModel,
    coarse_lu: f64,
    fine_lu: f64,
    limits: MonitoringData,
    period_s: f64,
    setpoint_before_lu: f64,
    /// Position cycles since the set-point came to rest.
    rest_cycles: u64,
    /// The axis has been in the fine window since then.
    arrived: bool,
    /// Position cycles in which the speed set-point has been at its limit.
    limited_cycles: u64,
}

impl Monitor {
    /// At rest at `position_lu`, in position.
    pub(super) fn new(data: &DriveData, period_s: f64, position_lu: f64) -> Self {
        Self {
            model: AxisModel {
                gain_per_s: data.position_gain_per_s,
                velocity_max_lu_s: data.speed_setpoint_max_lu_s,
                position_lu,
            },
            coarse_lu: data.in_position_coarse_lu,
            fine_lu: data.in_position_fine_lu,
            limits: data.monitoring,
            period_s,
            setpoint_before_lu: position_lu,
            rest_cycles: 0,
            arrived: true,
            limited_cycles: 0,
        }
    }

    /// One position cycle, before the model moves on.
    #[inline]
    pub(super) fn watch(&mut self, setpoint_lu: f64, measured_lu: f64, limited: bool) -> View {
        let contour_deviation_lu = self.model.position_lu - measured_lu;
        let mut seen = 0;
        let mut set = |holds: bool, bit: u32| seen |= if holds { bit } else { 0 };
        set(contour_deviation_lu.abs() > self.limits.contour_lu, bits::CONTOUR);
        self.limited_cycles = if limited { self.limited_cycles + 1 } else { 0 };
        let limited_s = self.limited_cycles as f64 * self.period_s;
        set(limited && limited_s > self.limits.speed_limit_time_s, bits::SPEED_LIMIT);
        let rests = (setpoint_lu - self.setpoint_before_lu).abs() <= REST_LU;
        self.setpoint_before_lu = setpoint_lu;
        if rests {
            self.rest_cycles += 1;
            let (away_lu, rest_s) = ((setpoint_lu - measured_lu).abs(), self.rest_cycles as f64 * self.period_s);
            self.arrived |= away_lu <= self.fine_lu;
            set(away_lu <= self.coarse_lu, bits::IN_POSITION_COARSE);
            set(away_lu <= self.fine_lu, bits::IN_POSITION_FINE);
            set(!self.arrived && rest_s > self.limits.positioning_time_s, bits::POSITIONING);
            let watched = rest_s > self.limits.standstill_delay_s;
            set(watched && away_lu > self.limits.standstill_lu, bits::STANDSTILL);
        } else {
            (self.rest_cycles, self.arrived) = (0, false);
        }
        View { contour_deviation_lu, bits: seen }
    }

    /// The model over the time for which the controller holds its output.
    #[inline]
    pub(super) fn advance(&mut self, reference_lu: f64, velocity_feedforward_lu_s: f64, time_s: f64) {
        let AxisModel { gain_per_s, velocity_max_lu_s, position_lu } = &mut self.model;
        let wanted_lu_s = *gain_per_s * (reference_lu - *position_lu) + velocity_feedforward_lu_s;
        *position_lu += time_s * limited(wanted_lu_s, *velocity_max_lu_s);
    }
}
