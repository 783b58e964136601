//! The catalogue of keys against what is made from it: the JSON Schema and the user's documentation.

use crate::{EXAMPLE, MINIMAL};
use serde_json::Value;
use sollwert::machine;

#[test]
fn the_schema_beside_the_machines_is_current() {
    let file: Value = serde_json::from_str(include_str!("../../machines/machine.schema.json")).expect("JSON");
    assert!(file == machine::schema(), "run: sollwert machine schema > machines/machine.schema.json");
}

/// What of JSON Schema ours uses: types of tables and lists, known, required and dependent keys, words, bounds.
fn validate(schema: &Value, root: &Value, value: &Value, path: &str, faults: &mut Vec<String>) {
    if let Some(name) = schema["$ref"].as_str().and_then(|name| name.strip_prefix("#/$defs/")) {
        return validate(&root["$defs"][name], root, value, path, faults);
    }
    if let Some(condition) = schema.get("if") {
        let mut not_met = Vec::new();
        validate(condition, root, value, path, &mut not_met);
        let branch = if not_met.is_empty() { "then" } else { "else" };
        validate(&schema[branch], root, value, path, faults);
    }
    if let Some(options) = schema["oneOf"].as_array() {
        let fits = |option: &&Value| {
            let mut not_met = Vec::new();
            validate(option, root, value, path, &mut not_met);
            not_met.is_empty()
        };
        if options.iter().filter(fits).count() != 1 {
            faults.push(format!("{path}: not one of {options:?}"));
        }
    }
    let mut fault = |text: String| faults.push(format!("{path}: {text}"));
    for (key, wanted) in
        [("enum", schema["enum"].as_array().cloned()), ("const", schema.get("const").map(|c| vec![c.clone()]))]
    {
        if wanted.is_some_and(|words| !words.contains(value)) {
            fault(format!("{key}: {value}"));
        }
    }
    let is_type = match schema["type"].as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("number") => value.is_number(),
        Some("integer") => value.is_u64(),
        Some("boolean") => value.is_boolean(),
        Some("string") => value.is_string(),
        _ => true,
    };
    if !is_type {
        fault(format!("type: {value}"));
    }
    if let Some(number) = value.as_f64() {
        let bound =
            |name: &str, holds: fn(f64, f64) -> bool| schema[name].as_f64().is_none_or(|bound| holds(number, bound));
        let inside = bound("minimum", |x, b| x >= b) && bound("exclusiveMinimum", |x, b| x > b);
        if !inside || !bound("maximum", |x, b| x <= b) || !bound("exclusiveMaximum", |x, b| x < b) {
            fault(format!("bounds: {value}"));
        }
    }
    if let (Some(list), Some(items)) = (value.as_array(), schema.get("items")) {
        list.iter().for_each(|item| validate(items, root, item, path, faults));
    }
    let Some(object) = value.as_object() else { return };
    let needed = schema["required"].as_array().into_iter().flatten();
    let dependent = object.keys().filter_map(|key| schema["dependentRequired"][key].as_array()).flatten();
    for key in needed.chain(dependent).filter_map(Value::as_str).filter(|key| !object.contains_key(*key)) {
        faults.push(format!("{path}: no {key}"));
    }
    for (key, value) in object {
        let named = schema["patternProperties"].as_object().and_then(|patterns| patterns.values().next());
        match schema["properties"].get(key).or(named) {
            Some(schema) => validate(schema, root, value, &format!("{path}.{key}"), faults),
            None if schema["additionalProperties"] == Value::Bool(false) => {
                faults.push(format!("{path}: unknown {key}"))
            }
            None => {}
        }
    }
}

fn faults(text: &str) -> Vec<String> {
    let value: toml::Value = text.parse::<toml::Table>().expect("TOML").into();
    let schema = machine::schema();
    let mut faults = Vec::new();
    validate(&schema, &schema, &serde_json::to_value(value).expect("JSON"), "", &mut faults);
    faults
}

#[test]
fn the_schema_accepts_every_good_file() {
    let good = machine::shipped().iter().map(|(_, text)| *text).chain([EXAMPLE, MINIMAL]);
    for text in good {
        assert_eq!(faults(text), [] as [String; 0], "{text}");
    }
}

#[test]
fn the_schema_finds_what_the_check_finds() {
    let broken = [
        ("pitch_mm = 12.0", "ptich_mm = 12.0"),
        ("pitch_mm = 12.0 ", "# "),
        ("pitch_mm = 12.0 ", "pitch_mm = 12.0\npinion_diameter_mm = 80.0 "),
        ("jerk_max_m_s3 = 15.0", "jerk_max_m_s3 = -15.0"),
        ("velocity_max_m_min = 20.0", "velocity_max_rpm = 20.0"),
        ("[axes.X.motor]", "[axes.X.moto]"),
        ("\"follow_up\"", "\"follow-up\""),
        ("[axes.X]", "[axes.x]"),
        ("format = 1", "format = 2"),
        ("blocks = 8", "blocks = 0"),
    ];
    for (from, to) in broken {
        let text = crate::with(EXAMPLE, from, to);
        // A capital in the pattern of names is beyond the small validator of this test.
        assert!(to == "[axes.x]" || !faults(&text).is_empty(), "the schema accepts {to}");
        assert!(crate::parse(&text).is_err(), "the check accepts {to}");
    }
}

/// Row of the table of keys in the documentation.
fn row(key: &machine::Key) -> String {
    let machine_data = if key.machine_data.is_empty() { "-" } else { key.machine_data };
    format!("| `{}` | {} | {} | {machine_data} | {} |", key.name, key.describe_range(), key.describe_absent(), key.help)
}

#[test]
fn the_documentation_has_every_key_with_range_default_and_machine_data() {
    let text = include_str!("../../docs/machine-file.md");
    let missing: Vec<String> = machine::tables()
        .iter()
        .flat_map(|table| table.keys.iter().map(row))
        .filter(|row| !text.lines().any(|line| line == row))
        .collect();
    assert!(missing.is_empty(), "docs/machine-file.md has no row\n{}", missing.join("\n"));
}

#[test]
fn every_key_of_the_catalogue_is_read() {
    // A key in the catalogue that no code reads would be accepted and do nothing: a wrong type in it must be reported.
    let (_, mikron) = machine::shipped()[2];
    for table in machine::tables() {
        for key in table.keys.iter().filter(|_| !table.path.starts_with("kinematics")) {
            let rotary = key.kind == Some(sollwert::base::AxisKind::Rotary);
            let axis = if rotary { "C" } else { "X" };
            let path = table.path.replacen('*', axis, 1).replacen('*', "finish", 1);
            let name = if path.is_empty() { key.name.to_owned() } else { format!("{path}.{}", key.name) };
            let source = sollwert::base::SourceText::new("mikron.toml", mikron);
            let mut sets = vec![format!("{name}=2020-01-01")];
            if key.motor == Some(machine::MotorKind::Linear) {
                sets.push("axes.X.motor.kind=linear".to_owned());
            }
            let found = machine::parse(&source, &sets);
            let reported =
                found.err().is_some_and(|found| found.iter().any(|f| f.code == "M0005" && f.message.contains(&name)));
            assert!(reported, "{name} = 2020-01-01 is not reported");
        }
    }
}
