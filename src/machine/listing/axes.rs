//! Which axes the control has, what programs call them, and which are no axes of a path.
//!
//! In: MD10000, MD20070, MD20080, MD30300, MD35000, MD37100, comments of ours, the user's choice. Out: [`FoundAxis`] in order of their
//! numbers, with `index`, `machine_axis`, `kind` in the draft. Spindles, synchronous axes of a gantry and axes outside channel 1 are left
//! out and said, unless the user names them.

use super::data::Scope;
use super::import::{Draft, Origin};
use crate::base::{AXES_MAX, AxisKind, Diagnostic};

/// An axis of the new machine.
#[derive(Clone, Debug)]
pub(super) struct FoundAxis {
    /// In programs.
    pub ours: String,
    /// `AX1`, `X1`: as data name it, in capitals.
    pub theirs: Vec<String>,
    /// Of the machine axis, from 1.
    pub number: u32,
    pub kind: AxisKind,
}

impl FoundAxis {
    /// Path of a key of this axis.
    pub fn key(&self, key: &str) -> String {
        format!("axes.{}.{key}", self.ours)
    }
}

/// Names for axes that nothing names, by number.
const BY_NUMBER: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
/// MD10000 has 31 places.
const MACHINE_AXES: u32 = 31;

/// Finds them. Errors: there are none.
pub(super) fn find(draft: &mut Draft<'_>) -> Result<Vec<FoundAxis>, Vec<Diagnostic>> {
    let mut found: Vec<FoundAxis> = Vec::new();
    for id in draft.listing.axes() {
        let taken: Vec<u32> = found.iter().map(|axis| axis.number).chain(numbered(draft)).collect();
        let free = (1..).find(|number| !taken.contains(number)).unwrap_or(MACHINE_AXES);
        let number = number_of(draft, &id, free);
        match found.iter_mut().find(|axis| axis.number == number) {
            Some(axis) => axis.theirs.push(id),
            None => found.push(FoundAxis { ours: String::new(), theirs: vec![id], number, kind: AxisKind::Linear }),
        }
    }
    found.sort_by_key(|axis| axis.number);
    found.retain(|axis| taken(draft, axis));
    for axis in &mut found {
        name(draft, axis);
    }
    merge(draft, &mut found);
    carried_only(draft, &mut found);
    if found.len() > AXES_MAX {
        let left: Vec<&str> = found[AXES_MAX..].iter().map(|axis| axis.ours.as_str()).collect();
        let message = format!("a machine has at most {AXES_MAX} axes: {} left out", left.join(", "));
        draft.warnings.push(Diagnostic::warning("M0309", message).help("choose with --axis AX1=X --axis AX2=Y ..."));
        found.truncate(AXES_MAX);
    }
    if found.is_empty() {
        let help =
            "expected axis data such as N32000 $MA_MAX_AX_VELO[AX1]=40000; --axis AX6=C takes a spindle as an axis";
        return Err(vec![Diagnostic::error("M0301", "the data name no axis of a path").help(help)]);
    }
    Ok(found)
}

/// Numbers that data name: `AX3`.
fn numbered(draft: &Draft<'_>) -> Vec<u32> {
    draft.listing.axes().iter().filter_map(|id| id.strip_prefix("AX")?.parse().ok()).collect()
}

fn number_of(draft: &mut Draft<'_>, id: &str, next: u32) -> u32 {
    if let Some(number) = id.strip_prefix("AX").and_then(|digits| digits.parse().ok()) {
        return number;
    }
    (0..MACHINE_AXES)
        .find(|place| machine_axis(draft, place + 1).is_some_and(|name| name == id))
        .map_or(next, |place| place + 1)
}

/// MD10000, in capitals.
fn machine_axis(draft: &mut Draft<'_>, number: u32) -> Option<String> {
    let text = draft.listing.text(Scope::General, "AXCONF_MACHAX_NAME_TAB", number.checked_sub(1)?)?;
    (!text.is_empty()).then(|| text.to_ascii_uppercase())
}

/// The user's name for an axis.
fn chosen(draft: &mut Draft<'_>, axis: &FoundAxis) -> Option<String> {
    let machine = machine_axis(draft, axis.number);
    let choice = draft.options.axes.iter().find(|choice| {
        let theirs = choice.theirs.to_ascii_uppercase();
        axis.theirs.contains(&theirs) || machine.as_ref() == Some(&theirs) || theirs == format!("AX{}", axis.number)
    })?;
    Some(choice.ours.clone())
}

/// Place of the axis in the channel, if MD20070 says anything. A listing of changed data leaves places out: there the axis of the place's own number
/// is, the default.
fn channel_place(draft: &mut Draft<'_>, number: u32) -> Option<Option<u32>> {
    let nobody = [String::new()];
    let mut used: Vec<Option<u32>> = (0..MACHINE_AXES)
        .map(|place| draft.listing.number(Scope::Channel, "AXCONF_MACHAX_USED", &nobody, place))
        .map(|found| found.map(|(value, _)| value as u32))
        .collect();
    let told = used.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
    if used[..told].iter().all(Option::is_some) {
        used.truncate(told);
    }
    let is_at = |wanted: u32| used.iter().position(|machine| *machine == Some(wanted));
    let by_default = || {
        let place = number.checked_sub(1)? as usize;
        used.get(place)?.is_none().then_some(place)
    };
    (told > 0).then(|| is_at(number).or_else(by_default).map(|place| place as u32))
}

/// Whether it is an axis of a path.
fn taken(draft: &mut Draft<'_>, axis: &FoundAxis) -> bool {
    let is_chosen = chosen(draft, axis).is_some();
    let spindle = draft.listing.number(Scope::Axis, "SPIND_ASSIGN_TO_MACHAX", &axis.theirs, 0);
    let gantry = draft.listing.number(Scope::Axis, "GANTRY_AXIS_TYPE", &axis.theirs, 0);
    let why = if spindle.is_some_and(|(number, _)| number > 0.0) {
        "a spindle (MD35000)"
    } else if gantry.is_some_and(|(kind, _)| kind >= 10.0) {
        "a synchronous axis of a gantry (MD37100)"
    } else if channel_place(draft, axis.number) == Some(None) {
        "not in channel 1 (MD20070)"
    } else {
        return true;
    };
    if !is_chosen {
        let name = machine_axis(draft, axis.number).unwrap_or_default();
        let first = axis.theirs.first().cloned().unwrap_or_default();
        let message = format!("{first} {name}: {why}, left out");
        draft
            .warnings
            .push(Diagnostic::note("M0309", message).help(format!("--axis {first}=NAME takes it as an axis")));
    }
    is_chosen
}

/// Name, number and kind.
fn name(draft: &mut Draft<'_>, axis: &mut FoundAxis) {
    let first = axis.theirs.first().cloned().unwrap_or_default();
    let machine = machine_axis(draft, axis.number);
    if let Some(machine) = machine.clone().filter(|machine| !axis.theirs.contains(machine)) {
        axis.theirs.push(machine);
    }
    // `$MD_` and some listings have the number where others have the name.
    let by_number = format!("AX{}", axis.number);
    if !axis.theirs.contains(&by_number) {
        axis.theirs.push(by_number);
    }
    let of_comment = carried_name(draft, axis);
    let of_channel = channel_place(draft, axis.number).flatten().and_then(|place| {
        let name = draft.listing.text(Scope::Channel, "AXCONF_CHANAX_NAME_TAB", place)?;
        (!name.is_empty()).then(|| name.to_ascii_uppercase())
    });
    axis.ours = match (chosen(draft, axis), of_comment, of_channel, machine) {
        (Some(name), ..) | (None, Some(name), ..) | (None, None, Some(name), _) => name,
        (None, None, None, Some(machine)) => machine.strip_suffix('1').unwrap_or(&machine).to_owned(),
        (None, None, None, None) => {
            let assumed = if first.starts_with("AX") {
                BY_NUMBER.get(axis.number as usize - 1).map_or(first.clone(), |name| (*name).to_owned())
            } else {
                first.strip_suffix('1').unwrap_or(&first).to_owned()
            };
            let message = format!("nothing names {first} (MD10000, MD20080): taken as {assumed}");
            draft.warnings.push(Diagnostic::warning("M0309", message).help(format!("--axis {first}=NAME names it")));
            assumed
        }
    };
    let rotary = draft.listing.number(Scope::Axis, "IS_ROT_AX", &axis.theirs, 0);
    let carried = draft.word_of(&axis.key("kind")) == Some("rotary");
    axis.kind = match rotary {
        Some((value, _)) if value != 0.0 => AxisKind::Rotary,
        Some(_) => AxisKind::Linear,
        None if carried => AxisKind::Rotary,
        None => AxisKind::Linear,
    };
    let (word, source) = match (axis.kind, &rotary) {
        (AxisKind::Linear, Some((_, source))) => ("linear", source.clone()),
        (AxisKind::Rotary, Some((_, source))) => ("rotary", source.clone()),
        (AxisKind::Linear, None) => ("linear", "no MD30300".to_owned()),
        (AxisKind::Rotary, None) => ("rotary", "no MD30300".to_owned()),
    };
    let origin = if rotary.is_some() { Origin::Datum } else { Origin::Assumed };
    draft.put_word(&axis.key("kind"), word, origin, &source);
    draft.put_number(&axis.key("index"), f64::from(axis.number), Origin::Datum, &first, None);
    let shown = if first.starts_with("AX") { first } else { format!("AX{}", axis.number) };
    draft.put_word(&axis.key("machine_axis"), &shown, Origin::Derived, "name in the data");
}

/// Data that name one axis in two ways, `AX1` and `X1`, and no MD10000 that says so.
fn merge(draft: &mut Draft<'_>, found: &mut Vec<FoundAxis>) {
    let mut merged: Vec<FoundAxis> = Vec::with_capacity(found.len());
    for axis in found.drain(..) {
        match merged.iter_mut().find(|known| known.ours == axis.ours) {
            Some(known) => {
                let message = format!(
                    "{} and {} are both named {}: taken as one axis",
                    known.theirs.join(", "),
                    axis.theirs.join(", "),
                    known.ours
                );
                let help = "if they are two, name them with --axis";
                draft.warnings.push(Diagnostic::warning("M0309", message).help(help));
                known.theirs.extend(axis.theirs);
                draft.put_number(&known.key("index"), f64::from(known.number), Origin::Datum, "of the axis", None);
                if let Some(first) = known.theirs.first().filter(|first| first.starts_with("AX")) {
                    draft.put_word(&known.key("machine_axis"), first, Origin::Derived, "name in the data");
                }
            }
            None => merged.push(axis),
        }
    }
    *found = merged;
}

/// The axis whose comment says `machine_axis = "AX1"`.
fn carried_name(draft: &Draft<'_>, axis: &FoundAxis) -> Option<String> {
    draft.listing.carried.iter().find_map(|(key, (value, _))| {
        let name = key.strip_prefix("axes.")?.strip_suffix(".machine_axis")?;
        axis.theirs.contains(&value.trim_matches('"').to_ascii_uppercase()).then(|| name.to_owned())
    })
}

/// Axes that only comments know.
fn carried_only(draft: &Draft<'_>, found: &mut Vec<FoundAxis>) {
    for key in draft.listing.carried.keys() {
        let Some((name, _)) = key.strip_prefix("axes.").and_then(|rest| rest.split_once('.')) else { continue };
        if !found.iter().any(|axis| axis.ours == name) {
            let rotary = draft.word_of(&format!("axes.{name}.kind")) == Some("rotary");
            let number = draft.number_of(&format!("axes.{name}.index")).map_or(0, |number| number as u32);
            let kind = if rotary { AxisKind::Rotary } else { AxisKind::Linear };
            found.push(FoundAxis { ours: name.to_owned(), theirs: Vec::new(), number, kind });
        }
    }
}
