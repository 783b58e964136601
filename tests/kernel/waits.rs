//! Block ends that wait for the axes have an end, whatever the drives do.

use crate::runs::{alarm_ns, column, machine, record, scratch, timed_column_of};
use sollwert::drive::monitoring;

/// Without an integral part friction holds the axis off its set-point by up to Tc / (Kp Kv) r = 95 µm: for ever.
#[test]
fn an_axis_that_never_arrives_is_an_alarm_and_no_hang() {
    let sets = [
        "axes.X.drive.speed_reset_time_ms=inf",
        "axes.X.mechanics.coulomb_friction_n_m=5",
        "axes.X.mechanics.breakaway_friction_n_m=5",
        "axes.X.drive.positioning_time_ms=300",
    ];
    let loaded = machine("spinner_mvc850", &sets);
    let path = scratch("stuck.mcap");
    let outcome = record("G60 G1 X30 F3000\nX0\nM30\n", &loaded, 2, &path);
    let alarm = outcome.alarm.expect("an alarm");
    assert!(alarm.code == "D0005" && alarm.message.contains("25080"), "{alarm:?}");
    let sent = column(&path, "position_setpoint");
    let rest = sent.iter().position(|x| *x == 30.0).unwrap();
    assert!((301..=302).contains(&(sent.len() - 1 - rest)), "{} rows at rest", sent.len() - 1 - rest);
    assert!(sent[rest..].iter().all(|x| *x == 30.0));
    // With G603 the block ends with its set-point: the axis sets out again before anybody asks.
    let free = record("G60 G603 G1 X30 F3000\nX0\nM30\n", &loaded, 2, &scratch("free.mcap"));
    assert!(free.alarm.is_none() && !free.summary.limits.contains_key("in_position"));
}

/// Position loops that are unstable and held by their limits swing for ever, with nothing watched: each axis is in its window again and again, never both
/// at once. The block end gives up after ten times the positioning time, and names line and axes.
#[test]
fn axes_that_are_never_in_position_together_are_an_alarm_and_no_hang() {
    let mut sets = Vec::new();
    for (axis, gain) in [("X", "1400"), ("Y", "1530")] {
        sets.push(format!("axes.{axis}.drive.position_gain_per_s={gain}"));
        for (key, value) in [("standstill_um", "inf"), ("contour_monitoring_um", "inf"), ("positioning_time_ms", "200")]
        {
            sets.push(format!("axes.{axis}.drive.{key}={value}"));
        }
    }
    sets.push("axes.Z.drive.positioning_time_ms=100".to_owned());
    let loaded = machine("spinner_mvc850", &sets.iter().map(String::as_str).collect::<Vec<&str>>());
    let path = scratch("apart.mcap");
    let outcome = record("G64\nG60 G1 X30 Y20 F3000\nX0 Y0\nM30\n", &loaded, 2, &path);
    let alarm = outcome.alarm.expect("an alarm");
    assert_eq!((alarm.code, alarm.line()), ("D0009", 2), "{alarm:?}");
    for words in
        ["axes X, Y at", "line 2", "X has left its window", "Y has left its window", "never in position (fine)"]
    {
        assert!(alarm.message.contains(words), "{words}: {}", alarm.message);
    }
    // From the recording: the wait has lasted for 2 s, both were in their windows, never at the same time.
    let sent = column(&path, "position_setpoint");
    let rest = sent.iter().position(|x| *x == 30.0).unwrap();
    let inside = |axis: &str| -> Vec<bool> {
        let bits = timed_column_of(&path, axis, "monitoring");
        bits[rest..sent.len()].iter().map(|(_, bits)| *bits as u32 & monitoring::IN_POSITION_FINE != 0).collect()
    };
    let (x, y) = (inside("X"), inside("Y"));
    assert!(x.contains(&true) && y.contains(&true));
    assert!(!x.iter().zip(&y).any(|(x, y)| *x && *y));
    let alarm_s = alarm_ns(&path).unwrap() as f64 * 1e-9;
    assert!((alarm_s - (rest as f64 * 1e-3 + 2.0)).abs() < 2.1e-3, "{alarm_s}");
}
