//! The JSON Schema of a machine file, for editors.
//!
//! In: the catalogue of keys. Out: a schema (draft 2020-12) that knows every table, key, range, word and required key. It cannot know
//! what needs two keys, such as whole ratios of cycles: `machine check` does.

use super::catalogue::tables;
use super::checked::DynamicsMode;
use super::keys::{Absent, Accepts, Key, MotorKind, Range, TableKeys};
use crate::base::AxisKind;
use serde_json::{Map, Value, json};

/// The schema; `machines/machine.schema.json` is this, printed.
pub fn schema() -> Value {
    let mut root = object("", None, None);
    let tables = ["cycle", "look_ahead", "feed", "smoothing", "spindle", "kinematics"];
    for table in tables {
        set(&mut root, &["properties", table], object(table, None, None));
    }
    set(
        &mut root,
        &["properties", "kinematics", "properties", "rotary", "items"],
        object("kinematics.rotary", None, None),
    );
    let axis = json!({
        "if": { "properties": { "kind": { "const": "rotary" } }, "required": ["kind"] },
        "then": { "$ref": "#/$defs/rotary_axis" },
        "else": {
            "if": {
                "properties": { "motor": { "properties": { "kind": { "const": "linear" } }, "required": ["kind"] } },
                "required": ["motor"],
            },
            "then": { "$ref": "#/$defs/linear_motor_axis" },
            "else": { "$ref": "#/$defs/linear_axis" },
        },
    });
    let axes = json!({
        "type": "object",
        "description": "the axes, by their names in programs: a capital letter, or one with digits",
        "patternProperties": { "^([A-CEO-QU-Z][0-9]{0,2}|[A-Z]{2}[A-Z0-9_]{0,13})$": axis },
        "additionalProperties": false,
        "minProperties": 1,
        "maxProperties": crate::base::AXES_MAX,
    });
    set(&mut root, &["properties", "axes"], axes);
    set(&mut root, &["required"], json!(["format", "name", "cycle", "axes"]));
    let mut schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "sollwert machine file, format 1",
        "$defs": {
            "linear_axis": axis_object(AxisKind::Linear, MotorKind::Rotary),
            "linear_motor_axis": axis_object(AxisKind::Linear, MotorKind::Linear),
            "rotary_axis": axis_object(AxisKind::Rotary, MotorKind::Rotary),
        },
    });
    if let (Value::Object(schema), Value::Object(root)) = (&mut schema, root) {
        schema.extend(root);
    }
    schema
}

fn axis_object(kind: AxisKind, motor: MotorKind) -> Value {
    let mut axis = object("axes.*", Some(kind), None);
    for table in ["drive", "motor", "mechanics", "encoder"] {
        let path = format!("axes.*.{table}");
        set(&mut axis, &["properties", table], object(&path, Some(kind), Some(motor)));
    }
    if (kind, motor) == (AxisKind::Linear, MotorKind::Rotary) {
        let one_of = json!([{ "required": ["pitch_mm"] }, { "required": ["pinion_diameter_mm"] }]);
        set(&mut axis, &["properties", "mechanics", "oneOf"], one_of);
    }
    if kind == AxisKind::Rotary {
        push(&mut axis, &["properties", "mechanics", "required"], json!("gear_ratio"));
    }
    let sets: Map<String, Value> = DynamicsMode::ALL
        .into_iter()
        .map(|mode| (mode.word().to_owned(), object("axes.*.dynamics.*", Some(kind), None)))
        .collect();
    set(
        &mut axis,
        &["properties", "dynamics"],
        json!({ "type": "object", "properties": sets, "additionalProperties": false }),
    );
    let together = json!({
        "drive": ["motor", "mechanics"],
        "motor": ["drive", "mechanics"],
        "mechanics": ["drive", "motor"],
        "encoder": ["drive", "motor", "mechanics"],
    });
    set(&mut axis, &["dependentRequired"], together);
    axis
}

/// A table with its keys.
fn object(path: &str, kind: Option<AxisKind>, motor: Option<MotorKind>) -> Value {
    let keys: &[Key] = tables().iter().find(|table| table.path == path).map_or(&[], |table: &TableKeys| table.keys);
    let keys = || keys.iter().filter(|key| key.fits(kind, motor));
    let properties: Map<String, Value> = keys().map(|key| (key.name.to_owned(), property(key))).collect();
    let required: Vec<&str> = keys().filter(|key| key.absent == Absent::Required).map(|key| key.name).collect();
    json!({ "type": "object", "properties": properties, "required": required, "additionalProperties": false })
}

fn property(key: &Key) -> Value {
    let mut property = accepted(key);
    let mut description = key.help.to_owned();
    for (label, text) in [("unit", key.unit), ("machine data", key.machine_data)] {
        if !text.is_empty() {
            description.push_str(&format!("; {label} {text}"));
        }
    }
    description.push_str(&format!("; without it: {}", key.describe_absent()));
    set(&mut property, &["description"], json!(description));
    match key.absent {
        // A whole number reads 100, not 100.0.
        Absent::Number(value) if matches!(key.accepts, Accepts::Whole(..)) => {
            set(&mut property, &["default"], json!(value as u32));
        }
        Absent::Number(value) => set(&mut property, &["default"], json!(value)),
        Absent::Word(word) => set(&mut property, &["default"], json!(word)),
        Absent::No => set(&mut property, &["default"], json!(false)),
        Absent::Required | Absent::Means(_) => {}
    }
    property
}

fn accepted(key: &Key) -> Value {
    match key.accepts {
        Accepts::Number(Range::Any) => json!({ "type": "number" }),
        Accepts::Number(Range::Positive | Range::PositiveOrInfinite) => {
            json!({ "type": "number", "exclusiveMinimum": 0 })
        }
        Accepts::Number(Range::NotNegative) => json!({ "type": "number", "minimum": 0 }),
        Accepts::Number(Range::NotZero) => json!({ "type": "number", "not": { "const": 0 } }),
        Accepts::Number(Range::Between(low, high)) => {
            json!({ "type": "number", "exclusiveMinimum": low, "exclusiveMaximum": high })
        }
        Accepts::Number(Range::UpTo(low, high)) => {
            json!({ "type": "number", "exclusiveMinimum": low, "maximum": high })
        }
        Accepts::Number(Range::Within(low, high)) => {
            json!({ "type": "number", "minimum": low, "maximum": high })
        }
        Accepts::Whole(least, most) => json!({ "type": "integer", "minimum": least, "maximum": most }),
        Accepts::Flag => json!({ "type": "boolean" }),
        Accepts::Text => json!({ "type": "string", "minLength": 1 }),
        Accepts::Choice(words) => json!({ "enum": words() }),
        Accepts::Interval => numbers(2),
        Accepts::Vector => numbers(3),
        Accepts::Values(most) => {
            json!({ "type": "array", "items": { "type": "number" }, "minItems": 2, "maxItems": most })
        }
        Accepts::Joints => json!({ "type": "array", "maxItems": 2 }),
    }
}

fn numbers(count: usize) -> Value {
    json!({ "type": "array", "items": { "type": "number" }, "minItems": count, "maxItems": count })
}

/// Puts a value at a path, making the objects on the way.
fn set(target: &mut Value, path: &[&str], value: Value) {
    match path.split_first() {
        None => *target = value,
        Some((first, rest)) => {
            if let Value::Object(map) = target {
                set(map.entry(*first).or_insert_with(|| json!({})), rest, value);
            }
        }
    }
}

/// Adds a value to the list at a path.
fn push(target: &mut Value, path: &[&str], value: Value) {
    let found = path.iter().try_fold(target, |node, key| node.get_mut(*key));
    if let Some(Value::Array(list)) = found {
        list.push(value);
    }
}
