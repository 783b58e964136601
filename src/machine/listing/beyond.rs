//! What the control does with its axes and a machine file has no word for: said, so that nobody believes it simulated.
//!
//! In: the listing. Out: notes and warnings; units of its own refuse the import, because every number would be wrong. Compensation of
//! leadscrew errors and sag takes away errors that the simulated mechanics do not have: nothing is lost without it.

use super::axes::FoundAxis;
use super::data::Scope;
use super::import::Draft;
use crate::base::Diagnostic;

/// MD10220: bit and standard factor of the only unit that has one.
const GAIN_BIT: u32 = 9;
/// Units that MD10230 can change.
const UNITS: u32 = 16;

/// Refuses inches and units of its own; returns the factor from the listing to 1/s of the position gain, if it is not the standard one.
pub(super) fn units(draft: &mut Draft<'_>) -> Result<Option<f64>, Diagnostic> {
    let nobody = [String::new()];
    if let Some(spot) = &draft.listing.inch {
        let finding = Diagnostic::error("M0305", "the listing is in inches");
        return Err(spot.mark(finding, "INCH").help("save it with the metric system (MD10240 = 1)"));
    }
    let metric = draft.listing.number(Scope::General, "SCALING_SYSTEM_IS_METRIC", &nobody, 0);
    if metric.is_some_and(|(metric, _)| metric == 0.0) && !draft.listing.metric {
        let finding = Diagnostic::error("M0305", "the control works in inches, and the listing has no line METRIC");
        let help =
            "save it with the metric system (MD10240 = 1); if its values are metric, write METRIC into its first line";
        let spot = draft.listing.spot(Scope::General, "SCALING_SYSTEM_IS_METRIC", &nobody, 0);
        return Err(spot.map_or_else(|| finding.clone(), |spot| spot.mark(finding.clone(), "")).help(help));
    }
    let Some((mask, _)) = draft.listing.number(Scope::General, "SCALING_USER_DEF_MASK", &nobody, 0) else {
        return Ok(None);
    };
    let mut gain = None;
    for bit in (0..UNITS).filter(|bit| mask as u32 >> bit & 1 == 1) {
        let factor = draft.listing.number(Scope::General, "SCALING_FACTORS_USER_DEF", &nobody, bit);
        match factor {
            Some((factor, _)) if bit == GAIN_BIT => gain = Some(factor),
            Some((factor, source)) if factor != 1.0 => {
                let finding =
                    Diagnostic::error("M0305", format!("the listing has units of its own: {source} = {factor}"));
                let help = "save it with the units of the manual (MD10220 = 'H200')";
                let spot = draft.listing.spot(Scope::General, "SCALING_FACTORS_USER_DEF", &nobody, bit);
                return Err(spot.map_or_else(|| finding.clone(), |spot| spot.mark(finding.clone(), "")).help(help));
            }
            _ => {}
        }
    }
    Ok(gain)
}

/// What is said of axes.
pub(super) fn axes(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let on = |draft: &mut Draft<'_>, axis: &FoundAxis, name: &str, place: u32| {
        draft.listing.number(Scope::Axis, name, &axis.theirs, place).is_some_and(|(value, _)| value != 0.0)
    };
    let mut said: Vec<(&str, &str, Vec<String>)> = [
        (
            "MD32900, MD32910: a time that adapts the lag of the axis to others (DYN_MATCH) is not simulated",
            "under feed-forward it does nothing; else give the axis the time as setpoint_delay_ms with feedforward_balancing = \"pt1\"",
        ),
        ("MD32890, MD32895: a delay of the set-points is not simulated", "it shifts the axis in time against the others"),
        ("MD32490 = 2: friction compensation by a learnt characteristic is not simulated", "MD32520 is taken as it stands"),
        (
            "MD32700, MD32710: compensation tables are not taken over",
            "the simulated mechanics have no error of the leadscrew and do not sag: there is nothing to compensate",
        ),
    ]
    .map(|(message, help)| (message, help, Vec::new()))
    .into();
    for axis in axes {
        let matched = on(draft, axis, "DYN_MATCH_ENABLE", 0) && on(draft, axis, "DYN_MATCH_TIME", 0);
        let delayed = on(draft, axis, "DESVAL_DELAY_ENABLE", 0) && on(draft, axis, "DESVAL_DELAY_TIME", 0);
        let mode = draft.listing.number(Scope::Axis, "FRICT_COMP_MODE", &axis.theirs, 0);
        let learnt = mode.is_some_and(|(mode, _)| mode == 2.0) && on(draft, axis, "FRICT_COMP_ENABLE", 0);
        let encoders = [0, 1].map(|place| on(draft, axis, "ENC_COMP_ENABLE", place));
        let tables = on(draft, axis, "CEC_ENABLE", 0) || encoders.contains(&true);
        for (place, holds) in [matched, delayed, learnt, tables].into_iter().enumerate() {
            if holds && let Some((_, _, names)) = said.get_mut(place) {
                names.push(axis.ours.clone());
            }
        }
    }
    for (message, help, names) in said.into_iter().filter(|(_, _, names)| !names.is_empty()) {
        let finding = Diagnostic::note("M0312", format!("{}: {message}", names.join(", ")));
        draft.warnings.push(finding.help(help));
    }
}
