//! What the control watches: exact-stop windows, contour, positioning and standstill monitoring (MD36000 to MD36040, MD36400), speed set-point at its limit (MD36220).
//!
//! In: once a position cycle the set-point, the reference and the velocity feed-forward of the position controller, the measured
//! position, and whether the speed set-point is at its limit. Out: [`View`]: contour deviation, and bits of [`monitoring`](super::wire::monitoring). Watches only: the kernel makes alarms
//! of the bits, and block ends of the windows.

use super::limit::limited;
use super::wire::monitoring as bits;
use crate::machine::DriveData;

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

/// What the control expects of the axis, and what it allows.
#[derive(Clone, Copy, Debug)]
pub(super) struct MonitorLaw {
    /// Of the model: the position controller with its clamp, and a speed loop without any lag.
    pub(super) gain_per_s: f64,
    pub(super) velocity_max_lu_s: f64,
    pub(super) coarse_lu: f64,
    pub(super) fine_lu: f64,
    pub(super) contour_lu: f64,
    pub(super) speed_limit_time_s: f64,
    pub(super) positioning_time_s: f64,
    pub(super) standstill_delay_s: f64,
    pub(super) standstill_lu: f64,
    pub(super) period_s: f64,
}

/// The box beside the position loop.
#[derive(Clone, Copy, Debug)]
pub(super) struct Monitor {
    pub(super) law: MonitorLaw,
    /// Where the model of the axis is.
    pub(super) model_lu: f64,
    pub(super) setpoint_before_lu: f64,
    /// Position cycles since the set-point came to rest.
    pub(super) rest_cycles: u32,
    /// The axis has been in the fine window since then.
    pub(super) arrived: bool,
    /// Position cycles in which the speed set-point has been at its limit.
    pub(super) limited_cycles: u32,
}

impl Monitor {
    /// At rest at `position_lu`, in position.
    pub(super) fn new(data: &DriveData, period_s: f64, position_lu: f64) -> Self {
        Self {
            law: MonitorLaw {
                gain_per_s: data.position_gain_per_s,
                velocity_max_lu_s: data.speed_setpoint_max_lu_s,
                coarse_lu: data.in_position_coarse_lu,
                fine_lu: data.in_position_fine_lu,
                contour_lu: data.monitoring.contour_lu,
                speed_limit_time_s: data.monitoring.speed_limit_time_s,
                positioning_time_s: data.monitoring.positioning_time_s,
                standstill_delay_s: data.monitoring.standstill_delay_s,
                standstill_lu: data.monitoring.standstill_lu,
                period_s,
            },
            model_lu: position_lu,
            setpoint_before_lu: position_lu,
            rest_cycles: 0,
            arrived: true,
            limited_cycles: 0,
        }
    }

    /// One position cycle, before the model moves on. Without branches: `block` does it for several axes at once.
    #[inline(always)]
    pub(super) fn watch(&mut self, setpoint_lu: f64, measured_lu: f64, limited: bool) -> View {
        let law = self.law;
        let contour_deviation_lu = self.model_lu - measured_lu;
        self.limited_cycles = if limited { self.limited_cycles.saturating_add(1) } else { 0 };
        let limited_s = f64::from(self.limited_cycles) * law.period_s;
        let rests = (setpoint_lu - self.setpoint_before_lu).abs() <= REST_LU;
        self.setpoint_before_lu = setpoint_lu;
        self.rest_cycles = if rests { self.rest_cycles.saturating_add(1) } else { 0 };
        let rest_s = f64::from(self.rest_cycles) * law.period_s;
        let away_lu = (setpoint_lu - measured_lu).abs();
        self.arrived = rests & (self.arrived | (away_lu <= law.fine_lu));
        let mut seen = 0;
        let mut set = |holds: bool, bit: u32| seen |= if holds { bit } else { 0 };
        set(contour_deviation_lu.abs() > law.contour_lu, bits::CONTOUR);
        set(limited & (limited_s > law.speed_limit_time_s), bits::SPEED_LIMIT);
        set(rests & (away_lu <= law.coarse_lu), bits::IN_POSITION_COARSE);
        set(rests & (away_lu <= law.fine_lu), bits::IN_POSITION_FINE);
        set(rests & !self.arrived & (rest_s > law.positioning_time_s), bits::POSITIONING);
        set(rests & (rest_s > law.standstill_delay_s) & (away_lu > law.standstill_lu), bits::STANDSTILL);
        View { contour_deviation_lu, bits: seen }
    }

    /// The model over the time for which the controller holds its output.
    #[inline(always)]
    pub(super) fn advance(&mut self, reference_lu: f64, velocity_feedforward_lu_s: f64, time_s: f64) {
        let wanted_lu_s = self.law.gain_per_s * (reference_lu - self.model_lu) + velocity_feedforward_lu_s;
        self.model_lu += time_s * limited(wanted_lu_s, self.law.velocity_max_lu_s);
    }
}
