//! `[axes.*]`: from the file to checked axes in internal units.
//!
//! In: the section `axes`. Out: [`Axis`] values in order of their index, with the cycles of their drives still as ratios (see
//! `clock`). Checks names, indices, limits, travel and home. The drive is read in `drive`.

use super::checked::{AccelerationReduction, Axis, AxisDynamics, AxisLimits, DynamicsMode};
use super::clock::LoopCycles;
use super::document::Entry;
use super::drive;
use super::section::Section;
use crate::base::diagnostics::Diagnostic;
use crate::base::units::{mm_from_m, mm_s_from_m_min, rad_from_deg, rad_from_rot, rad_s_from_rpm};
use crate::base::{AXES_MAX, AxisKind};

/// Letters that mean something else in a program, and what.
const TAKEN_LETTERS: &[(char, &str)] = &[
    ('D', "a tool edge"),
    ('F', "the feed"),
    ('G', "a path condition"),
    ('H', "an auxiliary function"),
    ('I', "a centre of an arc"),
    ('J', "a centre of an arc"),
    ('K', "a centre of an arc"),
    ('L', "a sub-program"),
    ('M', "a machine function"),
    ('N', "a block number"),
    ('R', "an R parameter"),
    ('S', "a spindle speed"),
    ('T', "a tool"),
];

/// An axis as read, with what the clock still needs.
pub(super) struct AxisDraft<'f> {
    pub axis: Axis,
    pub cycles: Option<LoopCycles<'f>>,
    pub section: Section<'f>,
}

/// All axes, in order of their index.
pub(super) fn axes<'f>(root: &Section<'f>) -> Vec<AxisDraft<'f>> {
    let section = root.table("axes", "axes");
    let entries = section.entries();
    if entries.is_empty() {
        let diagnostic = Diagnostic::error("M0004", "the machine has no axes")
            .help("add a table [axes.X] with velocity_max_m_min, acceleration_max_m_s2 and jerk_max_m_s3");
        root.report(&section.mark, "", diagnostic);
    }
    if let Some(surplus) = entries.get(AXES_MAX) {
        let message = format!("the machine has {} axes, at most {AXES_MAX} are possible", entries.len());
        section.report(&surplus.key_mark, "", Diagnostic::error("M0008", message).help("remove the axes not needed"));
    }
    let mut drafts: Vec<AxisDraft<'f>> = entries.iter().take(AXES_MAX).map(|entry| axis(&section, entry)).collect();
    number_axes(&mut drafts);
    drafts.sort_by_key(|draft| draft.axis.index);
    drafts
}

fn axis<'f>(parent: &Section<'f>, entry: &'f Entry) -> AxisDraft<'f> {
    check_name(parent, entry);
    let section = parent.table(&entry.key, "axes.*");
    let kind: AxisKind = section.choice("kind");
    let section = section.with_kind(kind);
    let limits = limits(&section, None);
    let travel_lu = section.interval(by_kind(kind, "travel_mm", "travel_deg"));
    let home_lu = section.number(by_kind(kind, "home_mm", "home_deg"));
    let modulo = kind == AxisKind::Rotary && section.flag("modulo");
    check_travel(&section, travel_lu, home_lu, modulo);
    let (drive, cycles) = drive::drive(&section, &limits).unzip();
    let axis = Axis {
        name: entry.key.clone(),
        kind,
        index: section.whole("index").unwrap_or(0),
        machine_axis: section.text("machine_axis").map(str::to_owned),
        limits,
        dynamics: dynamics(&section, &limits),
        acceleration_reduction: AccelerationReduction {
            velocity_ratio: section.number("acceleration_reduction_velocity_ratio"),
            reduction_ratio: section.number("acceleration_reduction_ratio"),
        },
        follow_up_tolerance_lu: lu(
            kind,
            section.number(by_kind(kind, "follow_up_tolerance_mm", "follow_up_tolerance_deg")),
        ),
        travel_lu: travel_lu.map(|travel| travel.map(|position| lu(kind, position))),
        home_lu: lu(kind, home_lu),
        modulo,
        drive,
    };
    AxisDraft { axis, cycles, section }
}

/// The key for this kind of axis.
pub(super) fn by_kind(kind: AxisKind, linear: &'static str, rotary: &'static str) -> &'static str {
    match kind {
        AxisKind::Linear => linear,
        AxisKind::Rotary => rotary,
    }
}

/// mm stay mm, deg become rad.
pub(super) fn lu(kind: AxisKind, value_mm_or_deg: f64) -> f64 {
    match kind {
        AxisKind::Linear => value_mm_or_deg,
        AxisKind::Rotary => rad_from_deg(value_mm_or_deg),
    }
}

/// Longest name of an axis with several letters.
const LONG_NAME_MAX: usize = 15;

/// `ELX`, `SP1`: at least two capital letters, then letters, digits and underscores. Whether the language has such a word only the
/// room of the program knows.
fn is_long_name(name: &str) -> bool {
    let bytes = name.as_bytes();
    let rest = |byte: &u8| byte.is_ascii_uppercase() || byte.is_ascii_digit() || *byte == b'_';
    (2..=LONG_NAME_MAX).contains(&bytes.len())
        && bytes[..2].iter().all(u8::is_ascii_uppercase)
        && bytes[2..].iter().all(rest)
}

/// A letter, a letter and digits, or several letters, that mean nothing else in a program.
fn check_name(parent: &Section<'_>, entry: &Entry) {
    let name = entry.key.as_str();
    if is_long_name(name) {
        return;
    }
    let mut chars = name.chars();
    let letter = chars.next().unwrap_or(' ');
    let digits: String = chars.collect();
    let report = |message: String, help: String| {
        parent.report(&entry.key_mark, "axis name", Diagnostic::error("M0011", message).help(help));
    };
    let capital = letter.to_ascii_uppercase();
    if let Some((_, meaning)) = TAKEN_LETTERS.iter().find(|(taken, _)| *taken == capital) {
        let free = ('A'..='Z').filter(|letter| TAKEN_LETTERS.iter().all(|(taken, _)| taken != letter));
        let free: Vec<String> = free.map(String::from).collect();
        report(
            format!("the axis name {name} is taken: {capital} is {meaning} in a program"),
            format!("use one of {}", free.join(", ")),
        );
    } else if !letter.is_ascii_uppercase() || digits.len() > 2 || !digits.chars().all(|c| c.is_ascii_digit()) {
        let message = format!(
            "the axis name {name:?} is not a capital letter, one with one or two digits, or several capital letters"
        );
        let help = match (letter, digits.as_str()) {
            ('a'..='z', "") => format!("write [axes.{capital}]"),
            _ => "write a name such as X, X1 or SPX".to_owned(),
        };
        report(message, help);
    }
}

/// An axis without an index gets the lowest free number in the order of the file; two axes cannot share one.
fn number_axes(drafts: &mut [AxisDraft<'_>]) {
    for later in 1..drafts.len() {
        let index = drafts[later].axis.index;
        let Some(earlier) = drafts[..later].iter().find(|draft| index != 0 && draft.axis.index == index) else {
            continue;
        };
        let message =
            format!("axes.{} and axes.{} both have index = {index}", earlier.axis.name, drafts[later].axis.name);
        let help = "give each axis its own number from 1 to 31";
        drafts[later].section.report_at("index", "taken", Diagnostic::error("M0008", message).help(help));
    }
    for later in 1..drafts.len() {
        let Some(name) = drafts[later].axis.machine_axis.clone() else { continue };
        let Some(earlier) = drafts[..later].iter().find(|draft| draft.axis.machine_axis.as_ref() == Some(&name)) else {
            continue;
        };
        let (first, second) = (&earlier.axis.name, &drafts[later].axis.name);
        let message = format!("axes.{first} and axes.{second} both have machine_axis = \"{name}\"");
        let diagnostic = Diagnostic::error("M0008", message).help("name each machine axis once");
        drafts[later].section.report_at("machine_axis", "taken", diagnostic);
    }
    for place in 0..drafts.len() {
        if drafts[place].axis.index == 0 {
            let free = (1..).find(|index| drafts.iter().all(|draft| draft.axis.index != *index));
            drafts[place].axis.index = free.unwrap_or(0);
        }
    }
}

/// The four limits; what is missing in a dynamics set is that of the axis.
fn limits(section: &Section<'_>, of_axis: Option<&AxisLimits>) -> AxisLimits {
    let kind = section.kind().unwrap_or(AxisKind::Linear);
    let or_axis = |given: Option<f64>, convert: fn(f64) -> f64, axis: fn(&AxisLimits) -> f64| match (given, of_axis) {
        (Some(value), _) => convert(value),
        (None, Some(limits)) => axis(limits),
        (None, None) => f64::NAN,
    };
    let velocity = section.optional_number(by_kind(kind, "velocity_max_m_min", "velocity_max_rpm"));
    let acceleration = section.optional_number(by_kind(kind, "acceleration_max_m_s2", "acceleration_max_rot_s2"));
    let jerk = section.optional_number(by_kind(kind, "jerk_max_m_s3", "jerk_max_rot_s3"));
    let transition_jerk =
        section.optional_number(by_kind(kind, "transition_jerk_max_m_s3", "transition_jerk_max_rot_s3"));
    let velocity_unit = if kind == AxisKind::Linear { mm_s_from_m_min } else { rad_s_from_rpm };
    let unit = if kind == AxisKind::Linear { mm_from_m } else { rad_from_rot };
    let jerk_max_lu_s3 = or_axis(jerk, unit, |limits| limits.jerk_max_lu_s3);
    let transition_jerk_max_lu_s3 = match of_axis {
        // A set with its own jerk and no transition jerk: that jerk holds at transitions too, as for an axis.
        Some(_) if jerk.is_some() && transition_jerk.is_none() => jerk_max_lu_s3,
        Some(_) => or_axis(transition_jerk, unit, |limits| limits.transition_jerk_max_lu_s3),
        None => transition_jerk.map_or(jerk_max_lu_s3, unit),
    };
    AxisLimits {
        velocity_max_lu_s: or_axis(velocity, velocity_unit, |limits| limits.velocity_max_lu_s),
        acceleration_max_lu_s2: or_axis(acceleration, unit, |limits| limits.acceleration_max_lu_s2),
        jerk_max_lu_s3,
        transition_jerk_max_lu_s3,
    }
}

/// `[axes.*.dynamics.finish]` and its like.
fn dynamics(axis: &Section<'_>, limits_of_axis: &AxisLimits) -> AxisDynamics {
    let section = axis.table("dynamics", "axes.*.dynamics");
    let mut dynamics = AxisDynamics::default();
    for entry in section.entries() {
        let Some(mode) = DynamicsMode::ALL.into_iter().find(|mode| mode.word() == entry.key) else {
            let words: Vec<&str> = DynamicsMode::ALL.into_iter().map(DynamicsMode::word).collect();
            let message = format!("unknown dynamics set {}.{}", section.path, entry.key);
            let help = match crate::base::diagnostics::nearest(&entry.key, words.iter().copied()) {
                Some(near) => format!("did you mean {near}?"),
                None => format!("the sets are {}", words.join(", ")),
            };
            section.report(&entry.key_mark, "unknown set", Diagnostic::error("M0003", message).help(help));
            continue;
        };
        let set = section.table(&entry.key, "axes.*.dynamics.*");
        dynamics.set(mode, limits(&set, Some(limits_of_axis)));
    }
    dynamics
}

/// Travel in order, home inside it, and none on an endless axis. All in the unit of the file.
fn check_travel(section: &Section<'_>, travel: Option<[f64; 2]>, home_mm_or_deg: f64, modulo: bool) {
    let Some([lower, upper]) = travel.filter(|[lower, upper]| lower < upper) else { return };
    let kind = section.kind().unwrap_or(AxisKind::Linear);
    let (travel_key, home_key, unit) = match kind {
        AxisKind::Linear => ("travel_mm", "home_mm", "mm"),
        AxisKind::Rotary => ("travel_deg", "home_deg", "deg"),
    };
    if modulo {
        let message =
            format!("{} and modulo = true exclude each other: an endless axis has no travel", section.full(travel_key));
        section.report_at(travel_key, "", Diagnostic::error("M0008", message).help("remove one of the two"));
    } else if home_mm_or_deg < lower || home_mm_or_deg > upper {
        let message = format!(
            "{} = {home_mm_or_deg} {unit} is outside the travel {lower} .. {upper} {unit}",
            section.full(home_key)
        );
        let help = format!("write {home_key} inside {travel_key}; where it is missing it is 0");
        section.report_at(home_key, "outside the travel", Diagnostic::warning("M0101", message).help(help));
    }
}
