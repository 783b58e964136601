//! `--record-rate`, `--record .../N`, `--record-decimate`: the same signals, more or less often; recordings are held against each other.

use crate::trace::{Trace, trace};
use sollwert::recorder::{Content, Recording, axis_field};
use std::process::Command;

const TEXT: &str = "G60 G1 X12 Y4 F5000\nG64 X0 Z2\nM30\n";
const SPINNER: [&str; 2] = ["-m", "spinner_mvc850"];
/// Spinner: 1 ms, 125 µs, 62.5 µs.
const CURRENT_TICKS: usize = 16;
const SPEED_TICKS: usize = 8;

fn at(test: &str, rate: &str) -> Trace {
    trace(&format!("{test}_{rate}"), TEXT, &[&SPINNER[..], &["--record-rate", rate]].concat())
}

#[test]
fn inner_loops_are_recorded_at_their_own_rate() {
    let (position, speed, current) = (at("rates", "position"), at("rates", "speed"), at("rates", "current"));
    for axis in ["X", "Y", "Z"] {
        let (times, columns) = &position.axes[axis];
        let setpoints = times.len() - 1;
        for (run, ticks) in [(&speed, SPEED_TICKS), (&current, CURRENT_TICKS)] {
            let (inner_times, inner_columns) = &run.axes[axis];
            assert_eq!(inner_times.len(), setpoints * ticks + 1, "{axis}: ends at the last set-point");
            assert!(inner_times.iter().enumerate().all(|(k, ns)| *ns == k as u64 * 1_000_000 / ticks as u64));
            // A row at a position tick is the same row; the wires of the position loop are held in between.
            for (field, values) in columns {
                let inner = &inner_columns[field];
                assert!(values.iter().enumerate().all(|(k, value)| *value == inner[k * ticks]), "{axis} {field}");
                if ["position_setpoint", "control_deviation", "motor_speed_reference", "monitoring"].contains(field) {
                    assert!((0..inner.len()).all(|k| inner[k] == inner[k - k % ticks]), "{axis} {field}");
                }
            }
        }
        // Every second row of the current loop is one of the speed loop, whose output is held.
        for (field, values) in &speed.axes[axis].1 {
            let inner = &current.axes[axis].1[field];
            assert!(values.iter().enumerate().all(|(k, value)| *value == inner[2 * k]), "{axis} {field}");
        }
        let torque = current.column(axis, "torque_reference");
        assert!((0..torque.len()).all(|k| torque[k] == torque[k - k % 2]));
        assert!((0..torque.len() - 16).any(|k| torque[k + 2] != torque[k]));
        // The mean current of a position cycle is that of its samples.
        let (i, mean) = (current.column(axis, "current"), position.column(axis, "current_mean"));
        for k in 1..=setpoints {
            let sum: f64 = i[(k - 1) * CURRENT_TICKS..k * CURRENT_TICKS].iter().sum();
            assert!((sum / CURRENT_TICKS as f64 - mean[k]).abs() < 1e-12, "{axis} row {k}");
        }
    }
    // The angle of the motor is the integral of its speed: by the trapezoid rule, whose error is w'' T³/12.
    let (w, x) = (current.column("X", "motor_speed"), current.column("X", "position_actual"));
    for k in 1..w.len() {
        let way_mm = (w[k] + w[k - 1]) / 2.0 * 62.5e-6 * 12.0 / std::f64::consts::TAU;
        assert!((x[k] - x[k - 1] - way_mm).abs() < 1e-6, "row {k}");
    }
    let figures = |run: &Trace| run.recording.summary().unwrap()["axes"].clone();
    assert_eq!(figures(&position), figures(&current), "figures count position ticks");
}

/// The drives alone give the same rows between the position cycles as the drives behind the interpolator.
#[test]
fn follow_records_the_inner_loops_as_run_does() {
    let (position, current) = (at("follow", "position"), at("follow", "current"));
    let output = position.path.with_file_name("followed.mcap");
    let follow = Command::new(env!("CARGO_BIN_EXE_sollwert"))
        .arg("follow")
        .arg(&position.path)
        .args(SPINNER)
        .args(["--record-rate", "current", "--record", "X.current,Y.*,Z", "-o"])
        .arg(&output)
        .output()
        .unwrap();
    assert!(follow.status.success(), "{}", String::from_utf8_lossy(&follow.stderr));
    let recording = Recording::open(&output).unwrap();
    let field = axis_field("current").unwrap();
    let mut rows = [0; 3];
    for message in recording.messages().unwrap().map(Result::unwrap) {
        let Content::Axis(sample) = message.content else { continue };
        let (k, axis) = (rows[message.topic], ["X", "Y", "Z"][message.topic]);
        assert_eq!(
            (message.time_ns, sample.get(field).unwrap()),
            (k as u64 * 62_500, current.column(axis, "current")[k])
        );
        rows[message.topic] += 1;
    }
    assert_eq!(rows, [current.column("X", "current").len(); 3]);
}

#[test]
fn a_signal_may_be_recorded_less_often_than_others() {
    let whole = at("thin", "position");
    let words = ["--record", "X.position*, x.current/4,Y/10,Z.flags", "--record-decimate", "2"];
    let thin = trace("thinned", TEXT, &[&SPINNER[..], &words].concat()).path;
    let recording = Recording::open(&thin).unwrap();
    let (position, current) = (axis_field("position_setpoint").unwrap(), axis_field("current").unwrap());
    let topic = |name: &str| recording.topics().iter().position(|topic| topic.name == name).unwrap();
    let (x, y) = (topic("/axis/X"), topic("/axis/Y"));
    let last = whole.axes["X"].0.len() - 1;
    let (mut seen_x, mut seen_y) = ([0, 0], 0);
    for message in recording.messages().unwrap().map(Result::unwrap) {
        let Content::Axis(sample) = message.content else { continue };
        let k = (message.time_ns / 1_000_000) as usize;
        let column = |axis: &str, field: &str| Some(whole.column(axis, field)[k]);
        if message.topic == x {
            for (n, (place, field, every)) in
                [(position, "position_setpoint", 2), (current, "current", 8)].into_iter().enumerate()
            {
                let Some(value) = sample.get(place) else { continue };
                assert!(k.is_multiple_of(every) || k == last, "{field} at {k}");
                assert_eq!(Some(value), column("X", field));
                seen_x[n] += 1;
            }
        } else if message.topic == y {
            assert!(k.is_multiple_of(20) || k == last);
            assert_eq!(sample.get(current), column("Y", "current"));
            seen_y += 1;
        }
    }
    let expected = |every: usize| last / every + 1 + usize::from(!last.is_multiple_of(every));
    assert_eq!((seen_x, seen_y), ([expected(2), expected(8)], expected(20)));
    let about = recording.metadata("sollwert").unwrap();
    assert_eq!((about["decimation"].as_str(), about["record_rate"].as_str()), ("2", "position"));

    // In the table each signal is held until it comes again.
    let csv = thin.with_extension("csv");
    let export =
        Command::new(env!("CARGO_BIN_EXE_sollwert")).arg("export").arg(&thin).arg("-o").arg(&csv).output().unwrap();
    assert!(export.status.success(), "{}", String::from_utf8_lossy(&export.stderr));
    let text = std::fs::read_to_string(&csv).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().unwrap();
    let place = |name: &str| header.iter().position(|column| *column == name).unwrap();
    for (row, line) in lines.enumerate() {
        let k = (line[0].parse::<f64>().unwrap() * 1000.0).round() as usize;
        assert_eq!(k, (2 * row).min(last));
        let held = |every: usize| if k == last { last } else { k - k % every };
        let value = |name: &str| line[place(name)].parse::<f64>().unwrap();
        assert_eq!(value("X.position_setpoint_mm"), whole.column("X", "position_setpoint")[k]);
        assert_eq!(value("X.current_a"), whole.column("X", "current")[held(8)]);
        assert_eq!(value("Y.current_a"), whole.column("Y", "current")[held(20)]);
    }
}

#[test]
fn what_cannot_be_recorded_is_refused_with_the_nearest_name() {
    let folder = crate::trace::folder("refused");
    std::fs::write(folder.join("part.mpf"), TEXT).unwrap();
    for (words, expected) in [
        (["--record", "X.curent"], "did you mean `current`"),
        (["--record", "X.current/0"], "number of samples"),
        (["--record", "X.current/ten"], "number of samples"),
        (["--record-decimate", "0"], "record-decimate"),
        (["--record-rate", "motor"], "speed"),
    ] {
        let run = Command::new(env!("CARGO_BIN_EXE_sollwert"))
            .args(["run", "part.mpf", "-o", "part.mcap"])
            .args(words)
            .current_dir(&folder)
            .output()
            .unwrap();
        let told = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains(expected), "{words:?}: {told}");
        assert!(!folder.join("part.mcap").exists(), "{words:?}");
    }
}

/// Between set-points of 8 ms the fine interpolator works for a position cycle of 1 ms: against the run that has a set-point every millisecond.
/// With |x'''| <= J the cubic through positions and velocities is off by at most J h³/96 (Peano's kernel, worst in the middle), the chord with
/// |x''| <= A by A h²/8. Law and shape are those that keep the jerk limit everywhere.
#[test]
fn a_fine_interpolator_is_as_good_as_its_closed_form() {
    let text = "G642 CTOL=0.2\nG1 X80 F12000\nX120 Y30\nG3 X100 Y50 I-20 J0\nG0 X0 Y0\nM30\n";
    let run = |name: &str, sets: &[&str]| {
        let laws = ["feed.time_law=\"continuous\"", "smoothing.shape=\"quintic\""];
        let sets = laws.iter().chain(sets).flat_map(|set| ["--set", *set]);
        trace(&format!("fine_8ms_{name}"), text, &SPINNER.into_iter().chain(sets).collect::<Vec<_>>())
    };
    let fine = run("whole", &["cycle.f_s=0.125"]);
    let cubic = run("cubic", &["cycle.f_s=1"]);
    let linear = run("linear", &["cycle.f_s=1", "cycle.fine_interpolation=\"linear\""]);
    let (h, jerk, acceleration) = (8e-3_f64, 15_000.0, 1000.0);
    let bounds = [(&cubic, jerk * h.powi(3) / 96.0), (&linear, acceleration * h * h / 8.0)];
    for (coarse, bound_mm) in bounds {
        let mut worst_mm = 0.0_f64;
        for axis in ["X", "Y"] {
            let (whole, held) = (fine.column(axis, "position_setpoint"), coarse.column(axis, "position_setpoint"));
            assert!(whole.len().abs_diff(held.len()) < 8 && whole.len() > 1500);
            let both = whole.len().min(held.len());
            for k in 0..both {
                let off_mm = (whole[k] - held[k]).abs();
                assert!(off_mm <= bound_mm * (1.0 + 1e-6) + 1e-12, "{axis} row {k}: {off_mm:e} of {bound_mm:e}");
                assert!(k % 8 != 0 || off_mm < 1e-12, "{axis} row {k} is a set-point of both: {off_mm:e}");
                worst_mm = worst_mm.max(off_mm);
            }
        }
        assert!(worst_mm > 0.3 * bound_mm, "the bound is met by this motion: {worst_mm:e} of {bound_mm:e}");
    }
    // What the axis makes of it: feed-forward takes the differences of a set-point whose velocity is off by less than J h²/24.
    let (x, y) = (fine.column("X", "position_actual"), cubic.column("X", "position_actual"));
    let apart_mm = x.iter().zip(y).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
    assert!(apart_mm < 3.0 * jerk * h.powi(3) / 96.0, "{apart_mm:e}");
}

/// A jerk filter of 40 ms holds back what the axis does: without the option the recording ends before it has arrived.
#[test]
fn a_recording_may_go_on_until_the_axes_have_arrived() {
    let sets = ["--set", "axes.X.drive.jerk_filter=\"moving_average\"", "--set", "axes.X.drive.jerk_filter_time_ms=40"];
    let words = [&SPINNER[..], &sets, &["--record-rate", "speed"]].concat();
    let text = "G642\nG1 X20 F9000\nM30\n";
    let (plain, whole) =
        (trace("to_setpoint", text, &words), trace("to_rest", text, &[&words[..], &["--record-to-rest"]].concat()));
    let last = |run: &Trace, field: &str| *run.column("X", field).last().unwrap();
    assert!((last(&plain, "position_setpoint") - 20.0).abs() < 1e-9 && last(&plain, "position_actual") < 19.99);
    assert!((last(&whole, "position_setpoint") - 20.0).abs() < 1e-9);
    assert!((last(&whole, "position_measured") - 20.0).abs() <= 0.01);
    let figures = |run: &Trace, key: &str| run.recording.summary().unwrap()[key].clone();
    for key in ["setpoints", "cycle_time_s", "limits"] {
        assert_eq!(figures(&plain, key), figures(&whole, key), "{key}");
    }
    // Up to the last set-point nothing is different; behind it the filter and the delay have at least to run empty.
    for (field, values) in &plain.axes["X"].1 {
        assert!(values[..] == whole.column("X", field)[..values.len()], "{field}");
    }
    // The filter alone takes 40 rows more, of which the last bring the axis less than its window.
    let longer = whole.rows.len() - plain.rows.len();
    assert!((25..60).contains(&longer), "{longer} rows");
    assert!(whole.rows[plain.rows.len()..].iter().all(|row| row.limit_kind == "in_position" && row.feed_mm_min == 0.0));
}
