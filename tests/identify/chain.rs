//! The chain closes: planned programs, run here, recorded, tell the drive that ran them.

use sollwert::feed::OverrideSchedule;
use sollwert::identify::{IdentifyOptions, PLANNED_SIGNALS, Parameter, TorqueSource, identify, plan};
use sollwert::interpreter::Setup;
use sollwert::kernel::{RunOptions, run};
use sollwert::machine;
use sollwert::program::ProgramSource;
use sollwert::recorder::SignalChoice;
use sollwert::trace::{ImportOptions, Trace, import};
use std::path::PathBuf;

/// A file that goes away.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// Runs a program with its drives, and reads the recording back.
fn recorded(loaded: &machine::Loaded, name: &str, text: &str) -> Trace {
    let path = std::env::temp_dir().join(format!("sollwert-identify-{}-{name}.mcap", std::process::id()));
    let scratch = Scratch(path);
    let options = RunOptions {
        machine: loaded,
        setup: Setup::from(ProgramSource::from_bytes(name, text.as_bytes())),
        overrides: OverrideSchedule::none(),
        drives: true,
        recording: Some(&scratch.0),
        mantissa_bits: None,
        signals: SignalChoice::all(),
        threads: 1,
        pace_ratio: None,
    };
    let outcome = run(options, &mut |_| {}).unwrap_or_else(|error| panic!("{}", error.0.render(false)));
    assert!(outcome.alarm.is_none(), "{}", outcome.alarm.unwrap().render(false));
    import(&scratch.0, &ImportOptions::default()).expect("our own recording")
}

#[test]
fn planned_programs_tell_the_drive_that_ran_them() {
    let sets: Vec<String> =
        ["axes.X.drive.setpoint_delay_ms=1.6", "axes.X.drive.velocity_feedforward=0.95"].map(str::to_owned).to_vec();
    let loaded = machine::load("spinner_mvc850", &sets).expect("a shipped machine");
    let x = loaded.machine.axis_by_name("X").unwrap();
    let programs = plan(&loaded.machine, &[x]);
    assert_eq!(programs.len(), 1, "a circle needs two axes");
    let program = &programs[0];
    for word in ["$AN_SLTRACE=1", "$AN_SLTRACE=2", "FFWON", "SOFT"] {
        assert!(program.text.contains(word), "{word} is missing:\n{}", program.text);
    }
    // Inside the travel, with a margin.
    let [low, high] = loaded.machine.axis(x).travel_lu.unwrap();
    for position in program.text.split("X=").skip(1).map(|rest| rest.split_whitespace().next().unwrap()) {
        let position: f64 = position.parse().expect("a number");
        assert!(position > low + 0.05 * (high - low) && position < high - 0.05 * (high - low), "X={position}");
    }
    let trace = recorded(&loaded, &program.name, &program.text);
    let (start_s, end_s) = trace.span_s().unwrap();
    assert!(
        (end_s - start_s) > program.trace_s && (end_s - start_s) < 1.3 * program.trace_s + 10.0,
        "{}",
        program.trace_s
    );
    let planned: Vec<&str> = PLANNED_SIGNALS.iter().map(|signal| signal.ours).collect();
    let only_planned = Trace {
        signals: trace
            .signals
            .iter()
            .filter(|s| s.axis_signal().is_some_and(|own| planned.contains(&own.stem())))
            .cloned()
            .collect(),
        ..trace
    };
    let options = IdentifyOptions { axes: vec![x], linear_only: true };
    let found = identify(&[only_planned], &loaded.machine, &options, &mut |_| {}).expect("one axis").remove(0);
    assert_eq!(found.torque_source, Some(TorqueSource::MeanCurrent));
    let truth = [
        (Parameter::Inertia, 0.0085, 0.002),
        (Parameter::Viscous, 0.010, 0.005),
        (Parameter::Coulomb, 0.6, 0.002),
        (Parameter::PositionGain, 50.0, 1e-6),
        (Parameter::VelocityFeedforward, 0.95, 1e-6),
        (Parameter::SetpointDelay, 1.6, 1e-6),
    ];
    for (parameter, truth, share) in truth {
        let estimate = found.estimate(parameter).unwrap_or_else(|| panic!("{parameter:?}: {:?}", found.refusals));
        assert!((estimate.value / truth - 1.0).abs() < share, "{estimate:?}, truth {truth}");
    }
}

#[test]
fn every_shipped_machine_gets_programs_that_run() {
    for name in ["spinner_mvc850", "huron_kx10", "huron_kx8_five", "mikron_ucp710", "xyzbc"] {
        let loaded = machine::load(name, &[]).expect("a shipped machine");
        for program in plan(&loaded.machine, &[]) {
            let setup = Setup::from(ProgramSource::from_bytes(&program.name, program.text.as_bytes()));
            let options = RunOptions {
                machine: &loaded,
                setup,
                overrides: OverrideSchedule::none(),
                drives: false,
                recording: None,
                mantissa_bits: None,
                signals: SignalChoice::setpoints(),
                threads: 1,
                pace_ratio: None,
            };
            let outcome = run(options, &mut |_| {}).unwrap_or_else(|error| panic!("{}", error.0.render(false)));
            assert!(outcome.alarm.is_none(), "{name} {}: {}", program.name, outcome.alarm.unwrap().render(false));
            // Corners that all but turn back are part of what a control is to show.
            let errors = outcome.warnings.iter().filter(|warning| !matches!(warning.code, "D0002" | "K0002" | "P0010"));
            assert_eq!(
                errors.map(|w| w.message.as_str()).collect::<Vec<_>>(),
                Vec::<&str>::new(),
                "{name} {}",
                program.name
            );
        }
    }
}
