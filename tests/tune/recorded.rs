//! Gains of the machine outside the bounds; traces with feed-forward off, late signals and encoders with a zero of their own.

use super::{course, gain, machine, setpoints, signal, tuned};
use sollwert::drive::{AxisDrive, AxisSignals, DriveInput, Start};
use sollwert::machine::Loaded;
use sollwert::trace::{Signal, Trace, Zero};
use sollwert::tune::{Gain, TuneOptions, course_of_trace};

const PROGRAM: &str = "SOFT\nG1 X40 F9000\nX0\nX25 F4000\nX-5\nX0 F12000\nM30\n";

#[test]
fn gains_of_the_machine_outside_the_usual_bounds_may_stay_and_outside_those_of_the_user_not() {
    // No feed-forward at all, where the usual bounds begin at a half: 0 stays, or a half and more is proposed, never "kept" as a half.
    let sets = ["axes.X.drive.velocity_feedforward=0", "axes.X.drive.torque_feedforward=0"];
    let loaded = machine(&sets);
    let of = |bounds: Vec<(Gain, [f64; 2])>| {
        let options = TuneOptions { gains: vec![Gain::Velocity], bounds, ..TuneOptions::default() };
        tuned(&loaded, vec![course(&loaded, "t.mpf", "G1 X0.0002 F1\nX0\nM30\n", false)], &options)
    };
    // So slow that friction alone makes the error: no gain is better by more than chance.
    let found = of(Vec::new());
    let kept = found.warnings.iter().any(|warning| warning.code == "U0003");
    let value = gain(&found, "X", Gain::Velocity);
    assert!(if kept { value == 0.0 } else { value >= 0.5 }, "kept {kept}, {value}");
    assert_eq!(found.axes[0].gains[0].before, 0.0);
    assert!(kept, "{:?}", found.warnings);
    // Bounds of the user hold, and the words say what was done.
    let found = of(vec![(Gain::Velocity, [0.5, 1.5])]);
    assert!((0.5..=1.5).contains(&gain(&found, "X", Gain::Velocity)));
    let said =
        found.warnings.iter().any(|warning| warning.message.contains("velocity_feedforward = 0, outside the bounds"));
    assert!(said, "{:?}", found.warnings);
    assert!(found.warnings.iter().all(|warning| !warning.message.ends_with("are those of the machine")));
}

/// Signals of X alone, with feed-forward on or off.
fn signals(loaded: &Loaded, positions: &[f64], feedforward_active: bool) -> Vec<AxisSignals> {
    let axis = loaded.machine.axis(loaded.machine.axis_by_name("X").unwrap());
    let mut drive = AxisDrive::new(axis, &loaded.machine.cycle.time_base, Start::Held, positions[0]).unwrap();
    let step =
        |position: &f64| drive.step(DriveInput { position_setpoint_lu: *position, load_n_m: 0.0, feedforward_active });
    positions.iter().map(step).collect()
}

fn trace(signals: Vec<Signal>) -> Trace {
    Trace { name: "measured.mcap".to_owned(), signals, ..Trace::default() }
}

#[test]
fn a_trace_with_feed_forward_off_is_said_or_simulated_so() {
    let loaded = machine(&[]);
    let positions = setpoints(&loaded, PROGRAM, loaded.machine.axis_by_name("X").unwrap());
    let found = |active: bool, recorded: bool| {
        let of_drive = signals(&loaded, &positions, active);
        let values = |of: fn(&AxisSignals) -> f64| of_drive.iter().map(of).collect::<Vec<f64>>();
        let mut all = vec![
            signal("X.position_setpoint_mm", positions.clone(), 1e-3),
            signal("X.control_deviation_mm", values(|signals| signals.control_deviation_lu), 1e-3),
        ];
        if recorded {
            all.push(signal("X.velocity_feedforward_mm_s", values(|signals| signals.velocity_feedforward_lu_s), 1e-3));
        }
        let course = course_of_trace(&trace(all), &loaded.machine, false).unwrap();
        let found = tuned(&loaded, vec![course], &TuneOptions::default());
        found.warnings.iter().any(|warning| warning.code == "U0008")
    };
    assert!(!found(true, false) && !found(true, true), "feed-forward was on");
    assert!(found(false, false), "off, and nothing in the trace says so");
    assert!(!found(false, true), "off, and the trace says so: the model is that of the machine");
}

#[test]
fn a_late_encoder_with_a_zero_of_its_own_gives_the_gains_of_the_actual_position() {
    let loaded = machine(&[]);
    let positions = setpoints(&loaded, PROGRAM, loaded.machine.axis_by_name("X").unwrap());
    let actual: Vec<f64> =
        signals(&loaded, &positions, true).iter().map(|signals| signals.position_actual_lu).collect();
    let setpoint = || signal("X.position_setpoint_mm", positions.clone(), 1e-3);
    let gains = |encoder: Signal| {
        let course = course_of_trace(&trace(vec![setpoint(), encoder]), &loaded.machine, false).unwrap();
        let found = tuned(&loaded, vec![course], &TuneOptions::default());
        assert!(found.warnings.iter().all(|warning| warning.code != "U0008"), "{:?}", found.warnings);
        [Gain::Velocity, Gain::Torque, Gain::Delay].map(|one| gain(&found, "X", one))
    };
    let plain = gains(signal("X.position_actual_mm", actual.clone(), 1e-3));
    // 4 ms late, and 12.5 mm away.
    let mut late: Vec<f64> = vec![actual[0] + 12.5; 4];
    late.extend(actual.iter().map(|actual| actual + 12.5));
    let mut encoder = signal("X.position_measured_mm", late, 1e-3);
    encoder.meaning.delay_s = 4e-3;
    encoder.meaning.zero = Zero::Encoder;
    let of_encoder = gains(encoder);
    for (one, other) in plain.iter().zip(of_encoder) {
        assert!((one - other).abs() < 2e-3, "{plain:?} {of_encoder:?}");
    }
}

#[test]
fn a_delay_above_the_usual_bounds_stays_where_nothing_is_better_and_goes_where_it_is_wrong() {
    // The usual bounds end at 4 ms.
    let sets = ["X", "Y", "Z"].map(|axis| format!("axes.{axis}.drive.setpoint_delay_ms=6"));
    let loaded = machine(&sets.each_ref().map(String::as_str));
    let of = |text: &str, bounds: Vec<(Gain, [f64; 2])>| {
        let options = TuneOptions { gains: vec![Gain::Delay], bounds, ..TuneOptions::default() };
        tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &options)
    };
    let slow = of("G1 X0.0002 F1\nX0\nM30\n", Vec::new());
    assert_eq!(gain(&slow, "X", Gain::Delay), 6.0, "{:?}", slow.warnings);
    assert!(slow.warnings.iter().any(|warning| warning.code == "U0003"), "{:?}", slow.warnings);
    let fast = of(PROGRAM, Vec::new());
    assert!((gain(&fast, "X", Gain::Delay) - 1.0).abs() < 0.15, "{:?}", fast.axes[0].gains);
    let bounded = of("G1 X0.0002 F1\nX0\nM30\n", vec![(Gain::Delay, [0.0, 4.0])]);
    assert!(gain(&bounded, "X", Gain::Delay) <= 4.0, "{:?}", bounded.axes[0].gains);
}

#[test]
fn a_trace_of_a_modulo_axis_that_passes_360_deg_tunes_as_one_that_does_not() {
    let loaded = sollwert::machine::load("mikron_ucp710", &[]).unwrap();
    let c = loaded.machine.axis_by_name("C").unwrap();
    assert!(loaded.machine.axis(c).modulo, "the round table goes round");
    let positions = setpoints(&loaded, "G1 C=IC(250) F8000\nC=IC(300)\nC=IC(-200)\nM30\n", c);
    let mut drive =
        AxisDrive::new(loaded.machine.axis(c), &loaded.machine.cycle.time_base, Start::Held, positions[0]).unwrap();
    let step = |position: &f64| {
        drive.step(DriveInput { position_setpoint_lu: *position, load_n_m: 0.0, feedforward_active: true })
    };
    let actual: Vec<f64> = positions.iter().map(step).map(|signals| signals.position_measured_lu).collect();
    let cycle_s =
        loaded.machine.cycle.time_base.seconds(loaded.machine.axis(c).drive.as_ref().unwrap().position_cycle_ticks);
    let by = |shown: fn(f64) -> f64| {
        let of = |values: &[f64]| values.iter().map(|rad| shown(rad.to_degrees())).collect::<Vec<f64>>();
        let signals = vec![
            signal("C.position_setpoint_deg", of(&positions), cycle_s),
            signal("C.position_actual_deg", of(&actual), cycle_s),
        ];
        tuned(&loaded, vec![course_of_trace(&trace(signals), &loaded.machine, false).unwrap()], &TuneOptions::default())
    };
    let [on, round] = [by(|deg| deg), by(|deg| deg.rem_euclid(360.0))];
    assert!(positions.iter().any(|rad| rad.to_degrees() > 400.0), "it passes 360 deg");
    let key =
        |found: &sollwert::tune::Tuned| [Gain::Velocity, Gain::Torque, Gain::Delay].map(|one| gain(found, "C", one));
    for (one, other) in key(&on).into_iter().zip(key(&round)) {
        assert!((one - other).abs() < 2e-3, "{:?} and {:?}", key(&on), key(&round));
    }
}
