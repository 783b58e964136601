//! The data that are one key each.
//!
//! In: the listing. Out: keys of the draft, through [`super::rows::ROWS`] in units of the file. A value that the file cannot hold is a warning.

use super::axes::FoundAxis;
use super::data::Scope;
use super::import::{Draft, Origin};
use super::rows::{DYNAMICS_ROWS, DYNAMICS_SETS, ROWS, Unit};
use crate::base::AxisKind;

/// Data of the adaptation of friction compensation.
const ADAPTATION: [u32; 4] = [32530, 32550, 32560, 32570];

/// MD10230[9] as it is delivered: 16.667 1/s are 1 (m/min)/mm.
fn is_standard(gain_per_s: Option<f64>) -> bool {
    let standard = Unit::Gain.to_key(AxisKind::Linear, 1.0);
    gain_per_s.is_none_or(|gain_per_s| (gain_per_s - standard).abs() < 1e-4 * standard)
}

/// Data of the control.
pub(super) fn control(draft: &mut Draft<'_>) {
    let nobody = [String::new()];
    for row in ROWS.iter().filter(|row| row.scope != Scope::Axis) {
        if let Some((value, source)) = draft.listing.number(row.scope, row.name, &nobody, row.index) {
            let spot = draft.listing.spot(row.scope, row.name, &nobody, row.index);
            let value = row.unit.to_key(AxisKind::Linear, value);
            draft.put_number(row.linear, value, Origin::Datum, &source, spot.as_ref());
        }
    }
}

/// Data of an axis. Those of its drive wait until it has one (`special::finish` removes them else).
pub(super) fn axis(draft: &mut Draft<'_>, axis: &FoundAxis, gain_per_s: Option<f64>) {
    let adapted = draft.listing.number(Scope::Axis, "FRICT_COMP_ADAPT_ENABLE", &axis.theirs, 0);
    let adapted = adapted.is_some_and(|(flag, _)| flag != 0.0);
    for row in ROWS.iter().filter(|row| row.scope == Scope::Axis) {
        if let Some((value, source)) = draft.listing.number(row.scope, row.name, &axis.theirs, row.index) {
            // A filter without a time is off, which `special` says.
            if row.name == "AX_JERK_TIME" && value == 0.0 {
                continue;
            }
            // Without adaptation they do nothing, and are often 0.
            if !adapted && ADAPTATION.contains(&row.number) {
                continue;
            }
            let spot = draft.listing.spot(row.scope, row.name, &axis.theirs, row.index);
            let value = match gain_per_s.filter(|_| row.unit == Unit::Gain && !is_standard(gain_per_s)) {
                Some(gain_per_s) => value * gain_per_s,
                None => row.unit.to_key(axis.kind, value),
            };
            draft.put_number(&axis.key(row.key(axis.kind)), value, Origin::Datum, &source, spot.as_ref());
        }
    }
    for (index, set) in DYNAMICS_SETS {
        for (_, name, linear, rotary) in DYNAMICS_ROWS {
            let of_axis = draft.listing.number(Scope::Axis, name, &axis.theirs, 0);
            let of_set = draft.listing.number(Scope::Axis, name, &axis.theirs, index);
            let Some((value, source)) = of_set else { continue };
            if of_axis.is_none_or(|(norm, _)| norm != value) {
                let key = if axis.kind == AxisKind::Linear { linear } else { rotary };
                let spot = draft.listing.spot(Scope::Axis, name, &axis.theirs, index);
                draft.put_number(
                    &axis.key(&format!("dynamics.{set}.{key}")),
                    value,
                    Origin::Datum,
                    &source,
                    spot.as_ref(),
                );
            }
        }
    }
    // A set with its own jerk and no transition jerk would take its jerk for both: the axis' value is said.
    for (index, set) in DYNAMICS_SETS {
        let [_, (_, _, jerk, jerk_rotary), (_, name, transition, transition_rotary)] = DYNAMICS_ROWS;
        let (jerk, transition) =
            if axis.kind == AxisKind::Linear { (jerk, transition) } else { (jerk_rotary, transition_rotary) };
        let key = axis.key(&format!("dynamics.{set}.{transition}"));
        let has_jerk = draft.values.contains_key(&axis.key(&format!("dynamics.{set}.{jerk}")));
        if has_jerk && let Some((value, source)) = draft.listing.number(Scope::Axis, name, &axis.theirs, index) {
            draft.put_number(&key, value, Origin::Datum, &source, None);
        }
    }
}
