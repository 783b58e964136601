//! The signal map and its table in docs/traces.md say the same.

use sollwert::trace::{Quantity, Rule, SIGNAL_MAP, TraceFormat, Zero, axis_signal_name};

fn row(rule: &Rule) -> String {
    let format = match rule.format {
        TraceFormat::OperateXml => "Operate",
        TraceFormat::EdgeJson => "Edge",
        TraceFormat::TwinCatCsv => "TwinCAT",
        TraceFormat::Halscope => "halscope",
        other => panic!("{other:?} has no rows"),
    };
    let unit = match rule.quantity {
        Quantity::Position => "mm, deg",
        Quantity::Velocity => "mm/s, deg/s",
        Quantity::VelocityPerMinute => "mm/min, rev/min",
        Quantity::Acceleration => "mm/s^2, deg/s^2",
        Quantity::MotorSpeed => "rev/min",
        Quantity::Torque => "N m",
        Quantity::Current => "A",
        Quantity::Percent => "%",
        Quantity::Power => "W",
        Quantity::Unknown => "",
    };
    let ours = if rule.ours.is_empty() { String::new() } else { format!("`{}`", rule.ours) };
    let zero = if rule.zero == Zero::Encoder { "encoder" } else { "" };
    format!("| {format} | `{}` | {ours} | {unit} | {zero} | {} |", rule.controller, rule.remark)
}

#[test]
fn the_documented_table_is_the_one_in_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/traces.md");
    let text = std::fs::read_to_string(path).unwrap();
    let start = text.find("<!-- signal map").unwrap();
    let table = text[start..].lines().skip(3).take_while(|line| line.starts_with('|'));
    let rows: Vec<String> = SIGNAL_MAP.iter().map(row).collect();
    assert_eq!(table.collect::<Vec<_>>(), rows);
}

#[test]
fn every_row_names_a_field_of_ours() {
    for rule in SIGNAL_MAP.iter().filter(|rule| !rule.ours.is_empty()) {
        assert!(axis_signal_name("X", sollwert::base::AxisKind::Linear, rule.ours).is_some(), "{}", rule.controller);
    }
}
