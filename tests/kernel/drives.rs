//! What the drives and the spindle do to a run: absurd data, braking after an alarm, the switch of the spindle.

use crate::runs::{machine, program, record, scratch};
use sollwert::base::units::rpm_from_rad_s;
use sollwert::feed::OverrideSchedule;
use sollwert::interpreter::Setup;
use sollwert::kernel::{Kernel, Preparation, RunOptions, Status, run};
use sollwert::program::ProgramSource;
use sollwert::recorder::{Content, Recording, SignalChoice, axis_field};
use std::path::Path;

/// Time, angle and speed of the spindle set-point, and the time of the alarm.
fn spindle(path: &Path) -> (Vec<(f64, f64, f64)>, Option<f64>) {
    let recording = Recording::open(path).unwrap();
    let (mut rows, mut alarm_s) = (Vec::new(), None);
    for message in recording.messages().unwrap().map(Result::unwrap) {
        let time_s = message.time_ns as f64 * 1e-9;
        match message.content {
            Content::Spindle(spindle) => {
                rows.push((time_s, spindle.angle_setpoint_deg.unwrap(), spindle.speed_setpoint_rpm.unwrap()));
            }
            Content::Event(event) if event.kind.as_deref() == Some("alarm") => alarm_s = Some(time_s),
            _ => {}
        }
    }
    (rows, alarm_s)
}

/// Weights of the feed-forward that nobody means are simulated as they are: limits hold, the run ends with an alarm, and every row up to it, and of the
/// braking behind it, is in the recording.
#[test]
fn absurd_feedforward_ends_with_an_alarm_and_a_whole_recording() {
    let cases: [&[&str]; 4] = [
        &["axes.X.drive.torque_feedforward=1e6"],
        &["axes.X.drive.torque_feedforward=1e12", "axes.X.drive.current_max_a=inf"],
        &["axes.X.drive.velocity_feedforward=1e5", "axes.X.drive.speed_setpoint_max_mm_s=inf"],
        &["axes.X.drive.velocity_feedforward=1e12", "axes.X.drive.torque_feedforward=1e12"],
    ];
    for (number, sets) in cases.into_iter().enumerate() {
        let loaded = machine("spinner_mvc850", sets);
        let path = scratch(&format!("absurd_{number}.mcap"));
        let outcome = record("G0 X20\nX0\nX20\nM30\n", &loaded, 1, &path);
        let alarm = outcome.alarm.unwrap_or_else(|| panic!("{sets:?}: no alarm"));
        assert!(["D0001", "D0004", "D0008"].contains(&alarm.code) && alarm.message.contains("axis X"), "{alarm:?}");
        let recording = Recording::open(&path).unwrap();
        assert_eq!(recording.summary().unwrap()["alarm"]["code"], alarm.code);
        let topic = recording.topics().iter().position(|topic| topic.name == "/axis/X").unwrap();
        let (mut times_ns, mut alarms) = (Vec::new(), 0);
        for message in recording.messages().unwrap().map(Result::unwrap) {
            match message.content {
                Content::Axis(sample) if message.topic == topic => {
                    let limit_mm_s = loaded.machine.axes[0].drive.as_ref().unwrap().speed_setpoint_max_lu_s;
                    let command = sample.get(axis_field("velocity_command").unwrap()).unwrap();
                    assert!(command.is_nan() || command.abs() <= limit_mm_s, "{sets:?}: {command}");
                    times_ns.push(message.time_ns);
                }
                Content::Event(event) if event.kind.as_deref() == Some("alarm") => alarms += 1,
                _ => {}
            }
        }
        assert_eq!(alarms, 1, "{sets:?}");
        assert!(times_ns.windows(2).all(|pair| pair[1] - pair[0] == 1_000_000), "{sets:?}: a row is missing");
    }
}

/// The alarm of X: Y and Z have their rows in that cycle, too, and their speed set-points go down on the same ramp from what they were.
#[test]
fn every_axis_brakes_on_its_ramp() {
    let loaded = machine("spinner_mvc850", &["axes.X.drive.contour_monitoring_um=10"]);
    let path = scratch("every_axis_brakes.mcap");
    let outcome = record("G17 G90 G64 F9000\nG0 X0 Y0 Z0\nG1 X100 Y100\nG1 X0 Y200\nM30\n", &loaded, 1, &path);
    let alarm = outcome.alarm.expect("an alarm");
    // The line of the message is that of the place, and so of the JSON.
    assert!(
        alarm.message.contains("axis X") && alarm.message.contains(&format!("line {}:", alarm.line())),
        "{alarm:?}"
    );
    let (_, alarm_s) = spindle(&path);
    let alarm_s = alarm_s.expect("an event");
    let recording = Recording::open(&path).unwrap();
    for axis in ["/axis/X", "/axis/Y", "/axis/Z"] {
        let topic = recording.topics().iter().position(|topic| topic.name == axis).unwrap();
        let rows: Vec<(f64, f64)> = recording
            .messages()
            .unwrap()
            .map(Result::unwrap)
            .filter(|message| message.topic == topic)
            .map(|message| {
                let Content::Axis(sample) = message.content else { panic!("an axis") };
                (message.time_ns as f64 * 1e-9, sample.get(axis_field("velocity_command").unwrap()).unwrap())
            })
            .collect();
        assert!(rows.windows(2).all(|pair| (pair[1].0 - pair[0].0 - 1e-3).abs() < 1e-9), "{axis}: a row is missing");
        let from = rows.iter().find(|row| (row.0 - alarm_s).abs() < 1e-9).expect("a row with the alarm").1;
        assert!(from.abs() > 1.0 || axis == "/axis/Z", "{axis}: {from}");
        for (time_s, command) in rows.iter().filter(|row| row.0 > alarm_s + 1e-9) {
            let wanted = from * (1.0 - (time_s - alarm_s) / 0.05).max(0.0);
            assert!((command - wanted).abs() < 1e-9 * from.abs().max(1.0), "{axis}, {time_s}: {command} {wanted}");
        }
    }
}

/// In a sub-program, found only at run time: its name and its line, in the place, the message, the figures and the event.
#[test]
fn an_alarm_in_a_sub_program_tells_its_file_and_line() {
    let loaded = machine("spinner_mvc850", &["axes.X.drive.contour_monitoring_um=10"]);
    let path = scratch("sub_program_alarm.mcap");
    let main = scratch("alarm_main.mpf");
    std::fs::write(&main, "G17 G90 G64\nG0 X0 Y0\nALARM_SUB\nG0 X0\nM30\n").unwrap();
    std::fs::write(scratch("ALARM_SUB.SPF"), "; a comment\nG4 F0.1\n\n  G1 X100 F15000\nM17\n").unwrap();
    let options = RunOptions {
        machine: &loaded,
        setup: ProgramSource::from_file(&main).unwrap().into(),
        overrides: OverrideSchedule::none(),
        drives: true,
        recording: Some(&path),
        mantissa_bits: None,
        signals: SignalChoice::all(),
        threads: 1,
        pace_ratio: None,
    };
    let outcome = run(options, &mut |_| {}).unwrap_or_else(|error| panic!("{error:?}"));
    let alarm = outcome.alarm.expect("an alarm");
    let place = alarm.place.as_ref().expect("a place");
    assert_eq!((&*place.file, place.line, place.line_text.as_str()), ("ALARM_SUB.SPF", 4, "  G1 X100 F15000"));
    assert!(
        alarm.message.contains("line 4:") && alarm.message.ends_with("in the sub-program ALARM_SUB.SPF"),
        "{alarm:?}"
    );
    let recording = Recording::open(&path).unwrap();
    assert_eq!(recording.summary().unwrap()["alarm"]["line"], 4);
    let events = recording.messages().unwrap().map(Result::unwrap).filter_map(|message| match message.content {
        Content::Event(event) if event.kind.as_deref() == Some("alarm") => Some((event.program, event.line)),
        _ => None,
    });
    assert_eq!(events.collect::<Vec<_>>(), [(Some("ALARM_SUB.SPF".to_owned()), Some(4))]);
}

/// After the alarm of an axis the spindle goes to rest with its own acceleration, and its angle with it.
#[test]
fn the_spindle_brakes_after_an_alarm() {
    let sets = ["axes.X.drive.current_max_a=1.5", "spindle.acceleration_rot_s2=400", "spindle.lag_ms=0"];
    let loaded = machine("spinner_mvc850", &sets);
    let path = scratch("spindle_brakes.mcap");
    let outcome = record("S900 M3\nG4 F0.1\nG0 X150\nG1 X100 F5000\nG0 X0\nM30\n", &loaded, 1, &path);
    assert_eq!(outcome.alarm.expect("an alarm").code, "D0004");
    let (rows, alarm_s) = spindle(&path);
    let alarm_s = alarm_s.expect("an event");
    let behind: Vec<_> = rows.iter().filter(|row| row.0 > alarm_s).collect();
    // 15 rev/s at 400 rev/s²: 37.5 ms; the axes brake for 50 ms.
    assert!(behind.len() > 45, "{} rows", behind.len());
    let (last_s, angle_deg, speed_rpm) = *rows.iter().rev().find(|row| row.0 <= alarm_s).expect("a row");
    assert!((speed_rpm - 900.0).abs() < 1e-9);
    for (time_s, angle, speed) in behind {
        let t = time_s - last_s;
        let run_s = t.min(15.0 / 400.0);
        assert!((speed - (900.0 - 24_000.0 * run_s)).abs() < 1e-6, "{t}: {speed}");
        assert!((angle - angle_deg - 360.0 * (15.0 * run_s - 200.0 * run_s * run_s)).abs() < 1e-5, "{t}: {angle}");
    }
}

/// The switch of the spindle acts on S, and with it on F a revolution, within the limits of the machine.
#[test]
fn the_switch_of_the_spindle() {
    let loaded = machine("spinner_mvc850", &["spindle.lag_ms=0"]);
    let fastest = |ratio: f64, text: &str| {
        let setup = Setup { spindle_override_ratio: ratio, ..Setup::from(program(text)) };
        let mut kernel = Kernel::new(loaded.machine.clone().into(), setup, false);
        let mut fastest = (0.0_f64, 0.0_f64);
        while kernel.cycle().unwrap() == Status::Running {
            let setpoint = kernel.output().setpoint.unwrap();
            let feed_mm_s =
                setpoint.axes.as_slice().iter().fold(0.0_f64, |most, axis| most.max(axis.velocity_lu_s.abs()));
            fastest.0 = fastest.0.max(rpm_from_rad_s(setpoint.spindle.speed_rad_s.abs()));
            fastest.1 = fastest.1.max(feed_mm_s);
        }
        assert!(kernel.take_findings().alarm.is_none());
        fastest
    };
    let turning = "G95 S1200 M3\nG1 X20 F0.5\nM30\n";
    for ratio in [0.5, 1.0, 1.2] {
        let (rpm, feed_mm_s) = fastest(ratio, turning);
        assert!((rpm - 1200.0 * ratio).abs() < 1e-9, "{ratio}: {rpm}");
        assert!((feed_mm_s - 10.0 * ratio).abs() < 1e-5, "{ratio}: {feed_mm_s}");
    }
    // OVRA is another factor, and both stay within the highest speed of the machine.
    assert!((fastest(0.5, &format!("OVRA[S1]=50\n{turning}")).0 - 300.0).abs() < 1e-9);
    assert!((fastest(1.5, "S10000 M3\nG4 F4\nM30\n").0 - 12_000.0).abs() < 1e-6);
    // G63 takes 100 % of both.
    let (rpm, feed_mm_s) = fastest(0.5, "S600 M3\nG4 F1\nOVR=50\nG63 Z-40 F600\nM30\n");
    assert!((rpm - 600.0).abs() < 1e-9 && (feed_mm_s - 10.0).abs() < 1e-6, "{rpm}, {feed_mm_s}");
    let (rpm, feed_mm_s) = fastest(0.5, "S600 M3\nG4 F1\nOVR=50\nG1 Z-40 F600\nM30\n");
    assert!((rpm - 300.0).abs() < 1e-9 && (feed_mm_s - 5.0).abs() < 1e-6, "{rpm}, {feed_mm_s}");
}

/// The switch of the feed does not hold G63: at 0 % and at 50 % its block is driven as at 100 %; a line waits.
#[test]
fn the_switch_of_the_feed_leaves_g63_alone() {
    let loaded = machine("spinner_mvc850", &["feed.time_law=continuous"]);
    let positions = |switch: &str, text: &str| {
        let overrides = OverrideSchedule::parse(switch).unwrap();
        let preparation = Preparation::new(program(text), &loaded.machine).with_overrides(&overrides);
        let mut kernel = Kernel::with_source(loaded.machine.clone().into(), preparation, false);
        let mut positions = Vec::new();
        while kernel.cycle().unwrap() == Status::Running {
            positions.push(kernel.output().setpoint.unwrap().axes.as_slice()[2].position_lu);
        }
        assert!(kernel.take_findings().alarm.is_none());
        positions
    };
    // 40 mm at 10 mm/s, from about 1 s on: the switch is turned within it.
    let tapping = "S600 M3\nG4 F1\nG63 Z-40 F600\nM30\n";
    let free = positions("0=100", tapping);
    for switch in ["1.5=50,3=20", "1.5=0,9=100", "0.5=0,9=100"] {
        let driven = positions(switch, tapping);
        assert_eq!(driven.len(), free.len(), "{switch}");
        assert!(driven.iter().zip(&free).all(|(a, b)| (a - b).abs() < 1e-9), "{switch}");
    }
    let line = "S600 M3\nG4 F1\nG1 Z-40 F600\nM30\n";
    let held = positions("1.5=0,9=100", line);
    assert!(held.len() > free.len() + 5000, "{} {}", held.len(), free.len());
}

/// The eight signals that people look at, of five axes that all move, at 1 ms with 36 bits: what one time round adds is less than 1 GB in an hour.
#[test]
fn an_hour_of_what_people_look_at_is_less_than_a_gigabyte() {
    let cycles = ["X", "Y", "Z", "A", "C"].map(|axis| format!("axes.{axis}.drive.position_cycle_ms=1"));
    let loaded = machine("mikron_ucp710", &cycles.each_ref().map(String::as_str));
    let once = "G1 X60 Y20 Z-10 A-20 C40 F3000\nX-60 Y40 Z-20 A-5 C-40\nX0 Y-40 Z-5 A-30 C10\nX0 Y0 Z0 A0 C0\n";
    let recorded = |times: usize| {
        let path = scratch(&format!("usual_{times}.mcap"));
        let options = RunOptions {
            machine: &loaded,
            setup: program(&format!("G17 G90 G64\n{}M30\n", once.repeat(times))).into(),
            overrides: OverrideSchedule::none(),
            drives: true,
            recording: Some(&path),
            mantissa_bits: Some(36),
            signals: SignalChoice::parse("usual", &loaded.machine).unwrap(),
            threads: 1,
            pace_ratio: None,
        };
        let outcome = run(options, &mut |_| {}).unwrap_or_else(|error| panic!("{error:?}"));
        (std::fs::metadata(&path).unwrap().len() as f64, outcome.summary.cycle_time_s)
    };
    let (one, two) = (recorded(1), recorded(2));
    let hour_bytes = (two.0 - one.0) / (two.1 - one.1) * 3600.0;
    assert!(two.1 - one.1 > 4.0 && hour_bytes < 1e9, "{hour_bytes}");
    // Not for want of messages.
    assert!(hour_bytes > 0.5e9, "{hour_bytes}");
}
