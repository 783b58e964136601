//! What on a trace no setting of the control explains: another machine, another feed.
//!
//! In: a traced program, and the same planned with the machine file; or the agreement that a fit reached. Out: a finding with advice, or `None`. Velocities
//! and accelerations of the axes, F and the override are not fitted: a trace that contradicts them is refused before a fit makes something
//! else of it, and a fit that leaves much over is none. Does not fit anything.

use super::control::Agreement;
use super::profile::{CELLS, PathProfile};
use crate::base::units::{mm_min_from_mm_s, percent_from_ratio};
use crate::base::{AxisId, Diagnostic};
use crate::machine::{DynamicsMode, Machine};

/// Speed above that of the machine file that is no rounding.
const TOO_FAST_SHARE: f64 = 0.05;
/// A feed that stands still differs by less than this share from one stretch to another.
const STANDS_SHARE: f64 = 2e-3;
/// Stretches to each side over which it does, and the bend of the path that counts as none.
const AROUND: usize = 5;
const BEND_RATIO: f64 = 1e-3;
/// Share of the path that must do so, share of it that must tell the same, and what is told by it.
const PATH_SHARE: f64 = 0.02;
const ALIKE_SHARE: f64 = 0.8;
const RATIO_OFF: (f64, f64) = (0.01, 0.03);
/// Ratios that an override makes; 1 ms for 1 s is a thousandth.
const OVERRIDES: std::ops::RangeInclusive<f64> = 0.005..=2.05;
/// What may be left over of the fitted programs: more is another machine, or another program.
const FEED_LEFT_SHARE: f64 = 0.1;
const TIME_LEFT_SHARE: f64 = 0.05;

const ADVICE: &str = "give the machine file of the machine that was traced, and F and override as they were: velocities and accelerations of the axes are taken from the file and are not fitted";

fn finding(reason: &str) -> Diagnostic {
    Diagnostic::error("T0208", format!("the control cannot be calibrated: {reason}")).help(ADVICE)
}

/// What a trace contradicts before anything is fitted; `planned` is its program on the machine as in the file.
pub(super) fn contradiction(
    traced: &PathProfile,
    planned: &PathProfile,
    axes: &[AxisId],
    machine: &Machine,
) -> Option<Diagnostic> {
    let reason = too_fast(traced, axes, machine).or_else(|| other_feed(traced, planned))?;
    Some(finding(&reason))
}

/// An axis that moves faster on the trace than the machine file allows.
fn too_fast(traced: &PathProfile, axes: &[AxisId], machine: &Machine) -> Option<String> {
    let too_fast = |(id, speed_mm_s): (&AxisId, f64)| {
        let axis = machine.axis(*id);
        let modes = DynamicsMode::ALL.iter().filter_map(|mode| axis.dynamics.get(*mode));
        let allowed = modes.map(|limits| limits.velocity_max_lu_s).fold(axis.limits.velocity_max_lu_s, f64::max);
        (speed_mm_s > (1.0 + TOO_FAST_SHARE) * allowed).then(|| {
            let [traced, allowed] = [speed_mm_s, allowed].map(mm_min_from_mm_s);
            format!("the trace moves {} at {traced:.0} mm/min, the machine file allows {allowed:.0} mm/min", axis.name)
        })
    };
    axes.iter().zip(traced.speeds_mm_s()).find_map(too_fast)
}

/// On straight lines where the plan stands at its highest feed the trace stands at another one: the override, or F.
fn other_feed(traced: &PathProfile, planned: &PathProfile) -> Option<String> {
    let highest_mm_s = planned.feeds_mm_s.iter().copied().fold(0.0, f64::max);
    let stands = |feeds: &[f64], k: usize| {
        let around = &feeds[k - AROUND..=k + AROUND];
        around.iter().all(|feed| (feed / feeds[k] - 1.0).abs() < STANDS_SHARE)
    };
    let told = |k: &usize| {
        let at_most = planned.feeds_mm_s[*k] > (1.0 - RATIO_OFF.0) * highest_mm_s;
        at_most && is_straight(planned, *k) && stands(&planned.feeds_mm_s, *k) && stands(&traced.feeds_mm_s, *k)
    };
    let mut ratios: Vec<f64> =
        (AROUND..CELLS - AROUND).filter(told).map(|k| traced.feeds_mm_s[k] / planned.feeds_mm_s[k]).collect();
    if (ratios.len() as f64) < PATH_SHARE * CELLS as f64 {
        return None;
    }
    ratios.sort_by(f64::total_cmp);
    let ratio = ratios[ratios.len() / 2];
    let alike = ratios.iter().filter(|other| (**other / ratio - 1.0).abs() < RATIO_OFF.0).count();
    let told = (ratio - 1.0).abs() > RATIO_OFF.1 && alike as f64 > ALIKE_SHARE * ratios.len() as f64;
    told.then(|| {
        let percent = percent_from_ratio(ratio);
        if !OVERRIDES.contains(&ratio) {
            return format!(
                "on straight lines the trace goes on at {percent:.3} % of the programmed feed, which no override makes: its times are not in s, or its positions not in mm (--time NAME:SECONDS tells another unit of time)"
            );
        }
        format!("on straight lines the trace goes on at {percent:.1} % of the programmed feed, as an override makes it")
    })
}

/// The path does not bend around a stretch.
fn is_straight(profile: &PathProfile, k: usize) -> bool {
    let places = &profile.places_mm;
    let (Some(before), Some(at), Some(after)) = (places.get(k - AROUND), places.get(k), places.get(k + AROUND)) else {
        return false;
    };
    let bend = before.iter().zip(at).zip(after).map(|((a, b), c)| (a - 2.0 * b + c).powi(2)).sum::<f64>().sqrt();
    let way = before.iter().zip(after).map(|(a, c)| (c - a).powi(2)).sum::<f64>().sqrt();
    bend < BEND_RATIO * way
}

/// Why a fit is none.
pub(super) fn nothing_fits(fitted: &[(Agreement, Agreement)]) -> Option<Diagnostic> {
    let off = |agreement: &Agreement| (agreement.planned_s / agreement.traced_s - 1.0).abs();
    let (_, worst) = fitted.iter().find(|(_, a)| a.feed_rms_share > FEED_LEFT_SHARE || off(a) > TIME_LEFT_SHARE)?;
    let (feed, time) = (percent_from_ratio(worst.feed_rms_share), percent_from_ratio(off(worst)));
    Some(finding(&format!(
        "with the best settings the feed is still off by {feed:.0} % of F (RMS) and the time by {time:.1} %: something differs that is not fitted"
    )))
}
