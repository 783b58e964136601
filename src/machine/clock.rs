//! `[cycle]` and the loop cycles of all axes: one integer clock.
//!
//! In: the section `cycle` and the axes as read. Out: [`Cycle`], and the cycles of each drive in ticks. t_s is a whole multiple of
//! each position cycle, that of its speed cycle, that of its current cycle; a ratio that is not whole is an error that names both.

use super::axis::AxisDraft;
use super::checked::Cycle;
use super::periods::{RATIO_MAX, common_multiple, time_base, whole_ratio};
use super::section::Section;
use crate::base::TimeBase;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::{MS_PER_S, US_PER_S, s_from_ms};

/// Shortest t_s: a thousandth of what controls have, and a run would take for ever.
const SETPOINT_PERIOD_MIN_S: f64 = 1e-6;

/// Cycles of the loops of a drive, as written, and where.
#[derive(Clone)]
pub(super) struct LoopCycles<'f> {
    pub drive: Section<'f>,
    pub position_cycle_s: f64,
    pub speed_cycle_s: f64,
    pub current_cycle_s: f64,
}

/// Whole ratios between the cycles of an axis: t_s / T_p, T_p / T_v, T_v / T_i.
#[derive(Clone, Copy)]
struct Ratios {
    position: u64,
    speed: u64,
    current: u64,
}

/// Reads `[cycle]` and puts ticks into the drives.
pub(super) fn cycle(root: &Section<'_>, drafts: &mut [AxisDraft<'_>]) -> Cycle {
    let section = root.table("cycle", "cycle");
    let t_cyl_ms = section.number("t_cyl_ms");
    let f_s = section.number("f_s");
    let t_s_s = s_from_ms(t_cyl_ms * f_s);
    if t_s_s < SETPOINT_PERIOD_MIN_S {
        let message = format!(
            "t_s = cycle.f_s * cycle.t_cyl_ms = {f_s} * {t_cyl_ms} ms = {} ms is out of range, allowed: 0.001 ms to 1000 ms",
            shown(t_s_s * MS_PER_S)
        );
        let help = "set-points come every f_s * t_cyl_ms; a control has some milliseconds";
        section.report_at("t_cyl_ms", "out of range", Diagnostic::error("M0006", message).help(help));
    }
    let mut ticks_per_setpoint = 1;
    let mut ratios = Vec::with_capacity(drafts.len());
    for draft in drafts.iter() {
        let of_axis = draft.cycles.as_ref().and_then(|cycles| axis_ratios(t_s_s, cycles));
        ratios.push(of_axis);
        let Some(Ratios { position, speed, current }) = of_axis else { continue };
        let all = position.checked_mul(speed).and_then(|product| product.checked_mul(current));
        match all.and_then(|all| common_multiple(ticks_per_setpoint, all)) {
            Some(multiple) => ticks_per_setpoint = multiple,
            None => {
                let message = format!(
                    "{}: t_s has no common tick of at least 1/{RATIO_MAX} with its cycles and those of the axes before",
                    draft.section.full("drive")
                );
                let help = "use cycles that are simple multiples of each other, such as 1 ms, 125 µs and 62.5 µs";
                draft.section.report_at("drive", "", Diagnostic::error("M0009", message).help(help));
            }
        }
    }
    for (draft, ratios) in drafts.iter_mut().zip(ratios) {
        let (Some(drive), Some(ratios)) = (&mut draft.axis.drive, ratios) else { continue };
        drive.position_cycle_ticks = ticks_per_setpoint / ratios.position;
        drive.speed_cycle_ticks = drive.position_cycle_ticks / ratios.speed;
        drive.current_cycle_ticks = drive.speed_cycle_ticks / ratios.current;
    }
    Cycle {
        time_base: checked_time_base(&section, t_cyl_ms, f_s, ticks_per_setpoint),
        control_cycle_s: s_from_ms(t_cyl_ms),
        sampling_ratio: f_s,
        fine_interpolation: section.choice("fine_interpolation"),
    }
}

fn checked_time_base(section: &Section<'_>, t_cyl_ms: f64, f_s: f64, ticks_per_setpoint: u64) -> TimeBase {
    if let Some(time_base) = time_base(t_cyl_ms, f_s, ticks_per_setpoint) {
        return time_base;
    }
    // NaN was reported where it was read; what is left has too many digits.
    if !(t_cyl_ms * f_s).is_nan() {
        let message =
            format!("t_s = cycle.f_s * cycle.t_cyl_ms = {f_s} * {t_cyl_ms} ms has too many digits for an exact clock");
        let help = "write simple numbers such as 0.125 and 8.0, or a simple fraction to at least 10 digits";
        section.report_at("t_cyl_ms", "", Diagnostic::error("M0009", message).help(help));
    }
    TimeBase::new((1, 1), 1)
}

/// The three ratios; reports what is not whole.
fn axis_ratios(t_s_s: f64, cycles: &LoopCycles<'_>) -> Option<Ratios> {
    let drive = &cycles.drive;
    let position = RatioCheck {
        longer: ("t_s = cycle.f_s * cycle.t_cyl_ms", t_s_s * MS_PER_S, "ms"),
        shorter: ("position_cycle_ms", cycles.position_cycle_s * MS_PER_S, "ms"),
        unit_ratio: 1.0,
    };
    let speed = RatioCheck {
        longer: ("position_cycle_ms", cycles.position_cycle_s * MS_PER_S, "ms"),
        shorter: ("speed_cycle_us", cycles.speed_cycle_s * US_PER_S, "µs"),
        unit_ratio: US_PER_S / MS_PER_S,
    };
    let current = RatioCheck {
        longer: ("speed_cycle_us", cycles.speed_cycle_s * US_PER_S, "µs"),
        shorter: ("current_cycle_us", cycles.current_cycle_s * US_PER_S, "µs"),
        unit_ratio: 1.0,
    };
    let (position, speed, current) = (position.whole(drive), speed.whole(drive), current.whole(drive));
    Some(Ratios { position: position?, speed: speed?, current: current? })
}

/// Two cycles with their keys and units; `unit_ratio` = unit of the longer over unit of the shorter.
struct RatioCheck {
    longer: (&'static str, f64, &'static str),
    shorter: (&'static str, f64, &'static str),
    unit_ratio: f64,
}

impl RatioCheck {
    fn whole(&self, drive: &Section<'_>) -> Option<u64> {
        let (long_key, long, long_unit) = self.longer;
        let (short_key, short, short_unit) = self.shorter;
        let long_in_short = long * self.unit_ratio;
        if let Some(whole) = whole_ratio(long_in_short / short) {
            return Some(whole);
        }
        // NaN was reported where it was read.
        if !(long_in_short / short).is_nan() {
            let long_name = if long_key.contains('=') { long_key.to_owned() } else { drive.full(long_key) };
            let message = format!(
                "{long_name} = {} {long_unit} must be a whole multiple of {} = {} {short_unit}, and is {} times as long",
                shown(long),
                drive.full(short_key),
                shown(short),
                shown(long_in_short / short)
            );
            let nearest = (long_in_short / short).round().clamp(1.0, RATIO_MAX as f64);
            let help = format!("the nearest that fits: {short_key} = {}", long_in_short / nearest);
            drive.report_at(short_key, "not a whole ratio", Diagnostic::error("M0009", message).help(help));
        }
        None
    }
}

/// Up to 12 significant digits: what a conversion added is not shown.
fn shown(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let digits = (11.0 - value.abs().log10().floor()).clamp(0.0, 30.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}
