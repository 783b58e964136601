//! The five-axis transformation (TRAORI) of the control as `[kinematics]`, and the way back.
//!
//! In: MD24100 ff. `$MC_TRAFO_TYPE_n`, MD24110 ff. `$MC_TRAFO_AXES_IN_n`, `$MC_TRAFO5_*_k`; with type 72 the tool carrier `$TC_CARRm[k]`. Out:
//! rotary axes with direction and point. Types: 16 to 21 head, 32 to 35 table, 48 to 51 head then table, with the letters of the axes in
//! the type; 24, 40, 56 the same with vectors. Offsets run from the tool towards the machine: of a head from the tool's mount
//! (MD24550) over axis 2 (MD24560) to axis 1, which closes with MD24500; of a table from machine zero to axis 1 (MD24550) and on to axis 2
//! (MD24560), closed by MD24500; of head and table MD24550 and MD24558. So the commissioning manual has it, and so the cycles of a table
//! machine (840D sl, axes A and C) reckon. A vector is the sense in which the element itself turns: the table of that machine has -X and
//! -Z. Types with letters: a table turns against its letter (ISO 841). TRANSMIT, TRACYL, TRAANG, a third rotary axis and kinematic chains
//! (`$NK_`) are not read.

use super::axes::FoundAxis;
use super::data::Scope;
use super::export::number as written;
use super::import::{Draft, Origin};
use super::write;
use crate::base::{AxisKind, Diagnostic};
use crate::machine::{KinematicsSettings, Machine, RotaryJoint};
use toml_edit::DocumentMut;

/// A control has this many transformations in a channel.
const TRANSFORMATIONS: u32 = 20;
/// Offsets that should close a chain and leave more than this do not.
const CLOSED_MM: f64 = 0.001;
/// Numbers of a comment and of data that are the same.
const SAME: f64 = 1e-9;
/// The letters of types 16, 32 and 48 plus this.
const LETTERS: [[char; 2]; 6] = [['A', 'B'], ['A', 'C'], ['B', 'A'], ['B', 'C'], ['C', 'A'], ['C', 'B']];
/// The type that takes its vectors from a tool carrier.
const BY_CARRIER: u32 = 72;

/// What two rotary axes carry.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Head,
    Table,
    HeadAndTable,
}

/// A rotary axis as the file has it.
#[derive(Clone, Debug)]
struct Joint {
    axis: String,
    direction: [f64; 3],
    point_mm: [f64; 3],
    of_tool: bool,
}

/// Offsets and vectors of a transformation.
struct Chain {
    vectors: [[f64; 3]; 2],
    /// MD24550, MD24560, MD24558, MD24500.
    base_tool_mm: [f64; 3],
    joint_mm: [f64; 3],
    joint_part_mm: [f64; 3],
    part_mm: [f64; 3],
}

/// The form of a type, and its letters.
fn form(kind: u32) -> Option<(Form, Option<[char; 2]>)> {
    let letters = |first: u32| LETTERS.get((kind - first) as usize).copied();
    match kind {
        16..=21 => Some((Form::Head, letters(16))),
        24 => Some((Form::Head, None)),
        32..=35 => Some((Form::Table, letters(32))),
        40 => Some((Form::Table, None)),
        48..=51 => Some((Form::HeadAndTable, letters(48))),
        56 => Some((Form::HeadAndTable, None)),
        _ => None,
    }
}

/// Transformations that turn no tool, by their type.
fn other(kind: u32) -> &'static str {
    match kind {
        256 | 257 => " (TRANSMIT)",
        512..=514 => " (TRACYL)",
        1024 => " (TRAANG)",
        8192 => " (TRACON)",
        _ => "",
    }
}

/// Takes over the first five-axis transformation; says what is left out.
pub(super) fn import(draft: &mut Draft<'_>, axes: &[FoundAxis]) {
    let nobody = [String::new()];
    let (mut five, mut others, mut prepared) = (Vec::new(), Vec::new(), false);
    for place in 1..=TRANSFORMATIONS {
        let kind = draft.listing.number(Scope::Channel, &format!("TRAFO_TYPE_{place}"), &nobody, 0);
        match kind {
            Some((kind, source)) if kind == f64::from(BY_CARRIER) || form(kind as u32).is_some() => {
                five.push((place, kind as u32, source));
            }
            Some((kind, source)) if kind != 0.0 => others.push(format!("{source} = {kind}{}", other(kind as u32))),
            Some(_) => {
                let fourth = draft.listing.number(Scope::Channel, &format!("TRAFO_AXES_IN_{place}"), &nobody, 3);
                prepared |= fourth.is_some_and(|(axis, _)| axis > 0.0);
            }
            None => {}
        }
    }
    let known = draft.values.contains_key("kinematics.type");
    if !others.is_empty() {
        let message = format!("{}: no five-axis transformation, left out", others.join(", "));
        draft.warnings.push(Diagnostic::note("M0310", message).help(
            "TRANSMIT, TRACYL and TRAANG are not simulated; each of their data is in the list of those without counterpart",
        ));
    }
    let Some((place, kind, source)) = five.first() else {
        if prepared && !known {
            let message = "axes of a five-axis transformation are named, and its type (MD24100 ff.) is 0: the machine is cartesian";
            let help = "a cycle of the manufacturer sets the type; write [kinematics] by hand (docs/machine-file.md)";
            draft.warnings.push(Diagnostic::warning("M0310", message).help(help));
        }
        return;
    };
    if five.len() > 1 {
        let left: Vec<&str> = five.iter().skip(1).map(|(_, _, source)| source.as_str()).collect();
        let message = format!("{source} is taken, further five-axis transformations are left out: {}", left.join(", "));
        draft.warnings.push(Diagnostic::note("M0310", message));
    }
    match joints(draft, axes, *place, *kind) {
        Ok(joints) => put(draft, &joints, &format!("{source} = {kind}")),
        Err(why) => {
            let message = format!("{source} = {kind}: {why}: the machine is cartesian");
            let help = "write [kinematics] by hand (docs/machine-file.md)";
            draft.warnings.push(Diagnostic::warning("M0310", message).help(help));
        }
    }
}

/// The rotary axes of transformation `place`; its data are numbered 1, as it is the first.
fn joints(draft: &mut Draft<'_>, axes: &[FoundAxis], place: u32, kind: u32) -> Result<Vec<Joint>, String> {
    for name in ["X", "Y", "Z"] {
        if !axes.iter().any(|axis| axis.ours == name && axis.kind == AxisKind::Linear) {
            return Err(format!("there is no linear axis {name}"));
        }
    }
    let mut turning = Vec::new();
    for input in [3, 4] {
        let nobody = [String::new()];
        let channel = draft.listing.number(Scope::Channel, &format!("TRAFO_AXES_IN_{place}"), &nobody, input);
        let channel = channel.map_or(0.0, |(channel, _)| channel);
        if channel <= 0.0 {
            continue;
        }
        let used =
            draft.listing.number(Scope::Channel, "AXCONF_MACHAX_USED", &nobody, (channel as u32).saturating_sub(1));
        let number = used.map_or(channel, |(number, _)| number) as u32;
        let axis = axes.iter().find(|axis| axis.number == number && axis.kind == AxisKind::Rotary);
        turning.push(axis.ok_or_else(|| format!("its axis {channel} of the channel is no rotary axis here"))?);
    }
    if turning.is_empty() {
        return Err("MD24110 ff. name no rotary axes".to_owned());
    }
    let (form, letters, chain) = match kind == BY_CARRIER {
        true => carrier(draft)?,
        false => {
            let (form, letters) = form(kind).ok_or("an unknown type")?;
            (form, letters, chain(draft))
        }
    };
    let offset = (0..3).find_map(|place| {
        draft
            .listing
            .number(Scope::Channel, "TRAFO5_ROT_AX_OFFSET_1", &[String::new()], place)
            .filter(|one| one.0 != 0.0)
    });
    if let Some((angle, source)) = offset {
        return Err(format!("{source} = {angle}, and a machine file has no such offset"));
    }
    check_closed(draft, form, &chain);
    let of_tool = match form {
        Form::Head => [true, true],
        Form::Table => [false, false],
        Form::HeadAndTable => [true, false],
    };
    let points = match form {
        Form::Head => [sum(chain.base_tool_mm, chain.joint_mm), chain.base_tool_mm],
        Form::Table => [chain.base_tool_mm, sum(chain.base_tool_mm, chain.joint_mm)],
        Form::HeadAndTable => [chain.base_tool_mm, chain.joint_part_mm],
    };
    let mut found = Vec::new();
    for (number, axis) in turning.iter().enumerate() {
        let signs = draft.listing.number(Scope::Channel, "TRAFO5_ROT_SIGN_IS_PLUS_1", &[String::new()], number as u32);
        let sign = if signs.is_some_and(|(plus, _)| plus == 0.0) { -1.0 } else { 1.0 };
        let vector = match letters.map(|letters| letters[number]) {
            Some(letter) => of_letter(letter, of_tool[number]),
            None => chain.vectors[number],
        };
        if vector.iter().all(|part| *part == 0.0) {
            return Err(format!("the vector of {} (MD24570, MD24572) is 0", axis.ours));
        }
        found.push(Joint {
            axis: axis.ours.clone(),
            direction: vector.map(|part| if part == 0.0 { 0.0 } else { sign * part }),
            point_mm: points[number],
            of_tool: of_tool[number],
        });
    }
    Ok(found)
}

/// A head turns as its letter says, a table the other way.
fn of_letter(letter: char, of_tool: bool) -> [f64; 3] {
    let sign = if of_tool { 1.0 } else { -1.0 };
    ['A', 'B', 'C'].map(|known| if known == letter { sign } else { 0.0 })
}

fn sum(one: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|part| one[part] + other[part])
}

/// `$MC_TRAFO5_*_1`; what is not there is 0.
fn chain(draft: &mut Draft<'_>) -> Chain {
    let mut vector = |name: &str| -> [f64; 3] {
        [0, 1, 2].map(|part| {
            let found = draft.listing.number(Scope::Channel, &format!("TRAFO5_{name}_1"), &[String::new()], part);
            found.map_or(0.0, |(value, _)| value)
        })
    };
    Chain {
        vectors: [vector("AXIS1"), vector("AXIS2")],
        base_tool_mm: vector("BASE_TOOL"),
        joint_mm: vector("JOINT_OFFSET"),
        joint_part_mm: vector("JOINT_OFFSET_PART"),
        part_mm: vector("PART_OFFSET"),
    }
}

/// A tool carrier with orientable axes: `$TC_CARR1[m]` to `$TC_CARR23[m]`.
fn carrier(draft: &mut Draft<'_>) -> Result<(Form, Option<[char; 2]>, Chain), String> {
    let number = draft.listing.number(Scope::Channel, "TRAFO5_TCARR_NO_1", &[String::new()], 0);
    let number = number.map_or(1.0, |(number, _)| number) as u32;
    let word = draft.listing.text(Scope::ToolCarrier, "CARR23", number);
    let form = match word.as_deref().map(str::trim) {
        Some("T" | "t") => Form::Head,
        Some("P" | "p") => Form::Table,
        Some("M" | "m") => Form::HeadAndTable,
        _ => return Err(format!("the data hold no kinematics of the tool carrier ($TC_CARR23[{number}])")),
    };
    let mut vector = |first: u32| -> [f64; 3] {
        [first, first + 1, first + 2].map(|part| {
            let found = draft.listing.number(Scope::ToolCarrier, &format!("CARR{part}"), &[String::new()], number);
            found.map_or(0.0, |(value, _)| value)
        })
    };
    let offsets = [vector(1), vector(4), vector(15), vector(18)];
    let vectors = [vector(7), vector(10)];
    // l1 to l4 in the order in which the types with machine data have them.
    let [base_tool_mm, joint_mm, joint_part_mm, part_mm] = match form {
        Form::Head => [offsets[2], offsets[1], [0.0; 3], offsets[0]],
        Form::Table => [offsets[1], offsets[2], [0.0; 3], offsets[3]],
        Form::HeadAndTable => [offsets[1], offsets[0], offsets[2], offsets[3]],
    };
    Ok((form, None, Chain { vectors, base_tool_mm, joint_mm, joint_part_mm, part_mm }))
}

/// An open chain moves the part's zero by a constant vector, which zero offsets of programs take up.
fn check_closed(draft: &mut Draft<'_>, form: Form, chain: &Chain) {
    let gaps = match form {
        Form::Head | Form::Table => vec![sum(sum(chain.base_tool_mm, chain.joint_mm), chain.part_mm)],
        Form::HeadAndTable => {
            vec![sum(chain.base_tool_mm, chain.joint_mm), sum(chain.joint_part_mm, chain.part_mm)]
        }
    };
    for gap in gaps.into_iter().filter(|gap| gap.iter().any(|part| part.abs() > CLOSED_MM)) {
        let message = format!(
            "the vector chain of the transformation is open by {} mm: part zero is taken as machine zero",
            shown(&gap)
        );
        let help = "a program with a zero offset measured on the control needs that vector added to it";
        draft.warnings.push(Diagnostic::note("M0310", message).help(help));
    }
}

fn shown(vector: &[f64; 3]) -> String {
    format!("[{}]", vector.map(|part| write::number(if part == 0.0 { 0.0 } else { part })).join(", "))
}

/// Sets both keys, unless a comment says the same.
fn put(draft: &mut Draft<'_>, joints: &[Joint], source: &str) {
    let carried = draft.values.get("kinematics.rotary").filter(|known| known.origin == Origin::Carried);
    if let Some(carried) = carried {
        if joints_of(&carried.value).is_some_and(|known| same(&known, joints)) {
            return;
        }
        let message = format!("kinematics.rotary: {source} and the comment {} differ: the data count", carried.source);
        draft.warnings.push(Diagnostic::note("M0308", message));
        draft.values.remove("kinematics.rotary");
        draft.values.remove("kinematics.type");
    }
    let table = joints.iter().all(|joint| !joint.of_tool);
    let entry = |joint: &Joint| {
        let carries = match (table, joint.of_tool) {
            (true, _) => "",
            (false, true) => ", carries = \"tool\"",
            (false, false) => ", carries = \"part\"",
        };
        let (direction, point) = (shown(&joint.direction), shown(&joint.point_mm));
        format!("{{ axis = \"{}\", direction = {direction}, point_mm = {point}{carries} }}", joint.axis)
    };
    let entries: Vec<String> = joints.iter().map(entry).collect();
    draft.put_word("kinematics.type", if table { "table-table" } else { "head-table" }, Origin::Derived, source);
    draft.put("kinematics.rotary", format!("[{}]", entries.join(", ")), Origin::Derived, source.to_owned());
}

/// The rotary axes of a value of a machine file.
fn joints_of(text: &str) -> Option<Vec<Joint>> {
    let document = format!("rotary = {text}").parse::<DocumentMut>().ok()?;
    let vector = |value: Option<&toml_edit::Value>| -> Option<[f64; 3]> {
        let parts = value?.as_array()?.iter();
        let parts: Vec<f64> =
            parts.filter_map(|part| part.as_float().or_else(|| part.as_integer().map(|part| part as f64))).collect();
        parts.try_into().ok()
    };
    let entries = document.get("rotary")?.as_array()?.iter().map(|entry| {
        let entry = entry.as_inline_table()?;
        Some(Joint {
            axis: entry.get("axis")?.as_str()?.to_owned(),
            direction: vector(entry.get("direction"))?,
            point_mm: match entry.get("point_mm") {
                Some(point) => vector(Some(point))?,
                None => [0.0; 3],
            },
            of_tool: entry.get("carries").and_then(|carries| carries.as_str()) == Some("tool"),
        })
    });
    entries.collect()
}

/// The same chain: the order of an axis in the head and one in the table does not matter.
fn same(one: &[Joint], other: &[Joint]) -> bool {
    let unit = |vector: &[f64; 3]| {
        let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
        vector.map(|part| part / length)
    };
    let near = |one: [f64; 3], other: [f64; 3]| {
        one.iter().zip(other).all(|(one, other)| (one - other).abs() <= SAME * (1.0 + other.abs()))
    };
    let order = |joints: &[Joint], of_tool: bool| -> Vec<Joint> {
        joints.iter().filter(|joint| joint.of_tool == of_tool).cloned().collect()
    };
    [false, true].into_iter().all(|of_tool| {
        let (one, other) = (order(one, of_tool), order(other, of_tool));
        one.len() == other.len()
            && one.iter().zip(&other).all(|(one, other)| {
                one.axis == other.axis
                    && near(unit(&one.direction), unit(&other.direction))
                    && near(one.point_mm, other.point_mm)
            })
    })
}

/// Lines of a listing for the machine's rotary axes.
pub(super) fn export(lines: &mut Vec<String>, machine: &Machine) {
    let KinematicsSettings::Rotary { table, head } = &machine.kinematics else { return };
    let minus = |vector: [f64; 3]| vector.map(|part| if part == 0.0 { 0.0 } else { -part });
    let between = |from: [f64; 3], to: [f64; 3]| sum(to, minus(from));
    let zero = [0.0; 3];
    // MD24550, MD24560, MD24558, MD24500.
    let (kind, joints, offsets): (u32, Vec<&RotaryJoint>, [[f64; 3]; 4]) = match (head.as_slice(), table.as_slice()) {
        ([], [only]) => (40, vec![only], [only.point_mm, zero, zero, minus(only.point_mm)]),
        ([], [first, second]) => {
            let joint_mm = between(first.point_mm, second.point_mm);
            (40, vec![first, second], [first.point_mm, joint_mm, zero, minus(second.point_mm)])
        }
        ([only], []) => (24, vec![only], [zero, only.point_mm, zero, minus(only.point_mm)]),
        ([first, second], []) => {
            let joint_mm = between(second.point_mm, first.point_mm);
            (24, vec![first, second], [second.point_mm, joint_mm, zero, minus(first.point_mm)])
        }
        ([of_head], [of_table]) => {
            let offsets = [of_head.point_mm, minus(of_head.point_mm), of_table.point_mm, minus(of_table.point_mm)];
            (56, vec![of_head, of_table], offsets)
        }
        _ => return,
    };
    lines.push(format!("N24100 $MC_TRAFO_TYPE_1={kind}"));
    let linear = ["X", "Y", "Z"].map(|name| machine.axis_by_name(name));
    let all = linear.into_iter().chain([joints.first(), joints.get(1)].map(|joint| joint.map(|joint| joint.axis)));
    for (input, axis) in all.enumerate() {
        // Axes of the channel are numbered in the order of the machine.
        lines.push(format!("N24110 $MC_TRAFO_AXES_IN_1[{input}]={}", axis.map_or(0, |axis| axis.index() + 1)));
    }
    let vector = |lines: &mut Vec<String>, datum: u32, name: &str, value: [f64; 3]| {
        for (part, value) in value.iter().enumerate() {
            let value = if *value == 0.0 { 0.0 } else { *value };
            lines.push(format!("N{datum} $MC_TRAFO5_{name}_1[{part}]={}", written(value)));
        }
    };
    vector(lines, 24500, "PART_OFFSET", offsets[3]);
    for place in 0..2 {
        lines.push(format!("N24520 $MC_TRAFO5_ROT_SIGN_IS_PLUS_1[{place}]=1"));
    }
    vector(lines, 24550, "BASE_TOOL", offsets[0]);
    vector(lines, 24558, "JOINT_OFFSET_PART", offsets[2]);
    vector(lines, 24560, "JOINT_OFFSET", offsets[1]);
    for (joint, (datum, name)) in joints.iter().zip([(24570, "AXIS1"), (24572, "AXIS2")]) {
        vector(lines, datum, name, joint.direction);
    }
}
