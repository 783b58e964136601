//! The data that are one key each.
//!
//! In: the listing. Out: keys of the draft, through [`super::rows::ROWS`] in units of the file. A value that the file cannot hold is a warning.

use super::axes::FoundAxis;
use super::data::Scope;
use super::import::{Draft, Origin};
use super::rows::{DYNAMICS_ROWS, DYNAMICS_SETS, ROWS};
use crate::base::AxisKind;

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
pub(super) fn axis(draft: &mut Draft<'_>, axis: &FoundAxis) {
    for row in ROWS.iter().filter(|row| row.scope == Scope::Axis) {
        if let Some((value, source)) = draft.listing.number(row.scope, row.name, &axis.theirs, row.index) {
            // A filter without a time is off, which `special` says.
            if row.name == "AX_JERK_TIME" && value == 0.0 {
                continue;
            }
            let spot = draft.listing.spot(row.scope, row.name, &axis.theirs, row.index);
            let value = row.unit.to_key(axis.kind, value);
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
