//! What a trace cannot tell is refused, with what to record instead; what it can tell is given all the same.

use crate::made::{ALL, Noise, legs, machine, moves, simulate, trace};
use sollwert::identify::{AxisResult, IdentifyOptions, Parameter, TorqueSource, identify, machine_text};

/// The drive of X of the Spinner on some motion, recorded in some signals.
fn of(legs: &[(f64, f64, f64)], stems: &[&str], sets: &[&str]) -> AxisResult {
    let machine = machine("spinner_mvc850", sets);
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let noise = Noise::usual(7);
    let signals = simulate(axis, &machine.cycle.time_base, &moves(1e-3, legs), noise.scale_lu);
    let trace = trace(axis, 1e-3, &signals, stems, noise);
    let options = IdentifyOptions { axes: Vec::new(), linear_only: true };
    identify(&[trace], &machine, &options, &mut |_| {}).expect("one axis").remove(0)
}

fn refused(result: &AxisResult, parameter: Parameter, word: &str) {
    let refusal =
        result.refusal(parameter).unwrap_or_else(|| panic!("{parameter:?} is given: {:?}", result.estimate(parameter)));
    assert!(refusal.reason.contains(word), "{parameter:?}: {refusal:?}");
    assert!(!refusal.remedy.is_empty());
    assert!(result.estimate(parameter).is_none());
}

#[test]
fn one_direction_does_not_tell_friction_from_gravity() {
    let result = of(&[(60.0, 40.0, 1000.0), (60.0, 120.0, 1000.0), (90.0, 250.0, 1500.0)], &ALL, &[]);
    refused(&result, Parameter::Coulomb, "positive direction only");
    refused(&result, Parameter::Gravity, "positive direction only");
    let constant = result.figures.iter().find(|figure| figure.key == "dry_torque_n_m").expect("the sum is told");
    assert!((constant.value - 0.6).abs() < 0.02, "{constant:?}");
    assert!(result.estimate(Parameter::Inertia).is_some(), "{:?}", result.refusals);
}

#[test]
fn one_speed_does_not_tell_viscous_friction() {
    let back_and_forth: Vec<(f64, f64, f64)> =
        (0..6).map(|k| (if k % 2 == 0 { 40.0 } else { -40.0 }, 40.0, 8000.0)).collect();
    let result = of(&back_and_forth, &ALL, &[]);
    refused(&result, Parameter::Viscous, "one constant speed only");
    refused(&result, Parameter::Coulomb, "one constant speed only");
}

#[test]
fn slow_ramps_do_not_tell_an_inertia() {
    let result = of(&[(20.0, 5.0, 8.0), (-20.0, 5.0, 8.0), (20.0, 10.0, 8.0), (-20.0, 10.0, 8.0)], &ALL, &[]);
    assert!(result.refusal(Parameter::Inertia).is_some(), "{:?}", result.estimate(Parameter::Inertia));
    assert!(result.estimate(Parameter::Coulomb).is_some(), "{:?}", result.refusals);
}

#[test]
fn position_alone_does_not_tell_feedforward_from_delay() {
    let result = of(&legs(), &["position_setpoint", "position_measured"], &[]);
    refused(&result, Parameter::VelocityFeedforward, "position alone");
    refused(&result, Parameter::SetpointDelay, "kvff - Kv d_pos");
    refused(&result, Parameter::Inertia, "no trace has a current");
    let lag = result.figures.iter().find(|figure| figure.key == "position_lag_ms").expect("the whole lag is told");
    // kvff = 1: what is left is the balancing delay of 1.2 ms.
    // Friction at the reversals moves it a little.
    assert!((lag.value - 1.2).abs() < 0.05, "{lag:?}");
}

#[test]
fn a_sampled_current_is_mended_and_a_mean_is_not_touched() {
    let sampled = ["position_setpoint", "position_measured", "current"];
    let identified = ["axes.X.drive.identified=true"];
    let result = of(&legs(), &sampled, &identified);
    assert_eq!(result.torque_source, Some(TorqueSource::Current));
    let inertia = result.estimate(Parameter::Inertia).expect("mended");
    assert!((inertia.low..=inertia.high).contains(&0.0085), "{inertia:?}");
    assert!((inertia.value / 0.0085 - 1.0).abs() < 0.01, "{inertia:?}");
    let said = result.verdicts.iter().find(|verdict| verdict.contains("sawtooth")).expect("it is said");
    assert!(said.contains("% of"), "{said}");
    // Guessed controllers: the correction is worth less.
    let guessed = of(&legs(), &sampled, &[]).estimate(Parameter::Inertia).copied().expect("mended");
    assert!(guessed.high - guessed.low > 1.5 * (inertia.high - inertia.low), "{guessed:?} against {inertia:?}");
    // Without set-points nobody can tell.
    refused(&of(&legs(), &["position_measured", "current"], &[]), Parameter::Inertia, "sawtooth");
}

#[test]
fn without_the_feedforward_signal_gain_and_feedforward_are_found_together() {
    let stems = ["position_setpoint", "position_measured", "control_deviation", "velocity_command"];
    let sets = ["axes.X.drive.velocity_feedforward=0.9", "axes.X.drive.feedforward_delay_ms=0.3"];
    let result = of(&legs(), &stems, &sets);
    let value = |parameter| result.estimate(parameter).unwrap_or_else(|| panic!("{:?}", result.refusals)).value;
    assert!((value(Parameter::PositionGain) - 50.0).abs() < 0.05);
    assert!((value(Parameter::VelocityFeedforward) - 0.9).abs() < 0.9e-3);
    assert!((value(Parameter::FeedforwardDelay) - 0.3).abs() < 0.1);
}

#[test]
fn a_feedforward_that_is_off_is_written_as_none_and_has_no_delay() {
    let stems = ["position_setpoint", "position_measured", "control_deviation", "velocity_command", "current_mean"];
    let result = of(&legs(), &stems, &["axes.X.drive.velocity_feedforward=0"]);
    let gain = result.estimate(Parameter::VelocityFeedforward).unwrap_or_else(|| panic!("{:?}", result.refusals));
    assert!(gain.value.abs() < 1e-3, "{gain:?}");
    assert!(
        result.refusal(Parameter::FeedforwardDelay).is_some(),
        "{:?}",
        result.estimate(Parameter::FeedforwardDelay)
    );
    // A file whose breakaway friction is lower than the Coulomb friction that was found takes the values all the same.
    let machine = machine("spinner_mvc850", &[]);
    let text = include_str!("../../machines/spinner_mvc850.toml");
    let low =
        text.replacen("coulomb_friction_n_m = ", "breakaway_friction_n_m = 0.3\ncoulomb_friction_n_m = 0.3 # ", 1);
    let source = |text: &str| sollwert::base::SourceText::new("machine.toml".to_owned(), text);
    let before = sollwert::machine::parse(&source(&low), &[]).expect("a machine");
    assert_eq!(before.machine.name, machine.name);
    let written = machine_text(&low, &before.machine, std::slice::from_ref(&result)).expect("tables take values");
    assert!(sollwert::machine::parse(&source(&written), &[]).is_ok(), "{written}");
}

#[test]
fn a_modulo_axis_that_passes_360_deg_is_identified() {
    let machine = machine("mikron_ucp710", &["axes.C.modulo=true"]);
    let axis = machine.axis(machine.axis_by_name("C").unwrap());
    let cycle_s = machine.cycle.time_base.seconds(axis.drive.as_ref().unwrap().position_cycle_ticks);
    let scale = axis.limits.velocity_max_lu_s / 333.3;
    let scaled: Vec<(f64, f64, f64)> =
        legs().iter().map(|(way, speed, a)| (way * scale * 4.0, speed * scale, a * scale)).collect();
    let noise = Noise { scale_lu: 5e-6, ..Noise::usual(5) };
    let mut setpoints = moves(cycle_s, &scaled);
    // In the middle of the motion zero is passed, again and again.
    let start = sollwert::base::units::rad_from_deg(350.0);
    setpoints.iter_mut().for_each(|x| *x += start);
    let signals = simulate(axis, &machine.cycle.time_base, &setpoints, noise.scale_lu);
    let mut wrapped = trace(axis, cycle_s, &signals, &ALL, noise);
    for signal in &mut wrapped.signals {
        if signal.name.as_deref().is_some_and(|name| name.contains("position_")) {
            signal.values.iter_mut().for_each(|value| *value = value.rem_euclid(360.0));
        }
    }
    let options = IdentifyOptions { axes: Vec::new(), linear_only: true };
    let result = identify(&[wrapped], &machine, &options, &mut |_| {}).expect("one axis").remove(0);
    let mechanics = &axis.drive.as_ref().unwrap().mechanics;
    let inertia = result.estimate(Parameter::Inertia).unwrap_or_else(|| panic!("{:?}", result.refusals));
    assert!((inertia.value / mechanics.inertia_kg_m2 - 1.0).abs() < 0.01, "{inertia:?}");
    assert!(result.estimate(Parameter::SetpointDelay).is_some(), "{:?}", result.refusals);
}

#[test]
fn a_machine_file_keeps_comments_and_order() {
    let result = of(&legs(), &ALL, &[]);
    let machine = machine("spinner_mvc850", &[]);
    let text = include_str!("../../machines/spinner_mvc850.toml");
    let written = machine_text(text, &machine, std::slice::from_ref(&result)).expect("tables take values");
    let comments = |text: &str| {
        text.lines().filter(|line| line.trim_start().starts_with('#')).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(comments(text), comments(&written));
    let keys = |text: &str| {
        text.lines().filter_map(|line| line.split_once(" =")).map(|(key, _)| key.to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(keys(text), keys(&written));
    let line = written.lines().find(|line| line.starts_with("inertia_kg_m2")).expect("X is the first axis");
    assert!(line.contains("identified, 95 %:") && line.contains("was 0.0085"), "{line}");
    assert!(written.contains("identified = true"));
}

/// The only axis of such traces, or that of the others where one of them is not in the units that it says.
fn by(traces: &[sollwert::trace::Trace]) -> AxisResult {
    let machine = machine("spinner_mvc850", &[]);
    let options = IdentifyOptions { axes: Vec::new(), linear_only: true };
    identify(traces, &machine, &options, &mut |_| {}).expect("one axis").remove(0)
}

/// The same with the values of some signals times a factor.
fn times(trace: &sollwert::trace::Trace, of: &str, factor: f64) -> sollwert::trace::Trace {
    let mut trace = trace.clone();
    for signal in trace.signals.iter_mut().filter(|signal| signal.original.contains(of)) {
        signal.values.iter_mut().for_each(|value| *value *= factor);
    }
    sollwert::trace::Trace { name: "other units".to_owned(), ..trace }
}

#[test]
fn traces_in_other_units_are_refused_with_what_contradicts_them() {
    let good = named("good", &legs(), &ALL);
    for (of, factor, word) in [
        ("_mm", 1.0 / 25.4, "inches taken for mm"),
        ("_mm", 1000.0, "the trace moves X at"),
        ("current_mean", 1000.0, "the drive of the machine file at most 28 A"),
    ] {
        let bad = times(&good, of, factor);
        let result = by(std::slice::from_ref(&bad));
        assert!(result.estimates.is_empty(), "{of} {factor}: {:?}", result.estimates);
        for parameter in Parameter::ALL {
            refused(&result, parameter, word);
        }
    }
    // Positions and speeds that do not belong to each other: an inch in one of them alone.
    let result = by(&[times(&good, "position_", 1.0 / 10.0)]);
    refused(&result, Parameter::VelocityFeedforward, "10.0");
    refused(&result, Parameter::PositionGain, "not in the units");
    // Beside a good trace the bad one is left out, and said.
    let [alone, beside] = [by(std::slice::from_ref(&good)), by(&[times(&good, "current_mean", 1000.0), good])];
    assert_eq!(alone.estimates, beside.estimates);
    assert!(beside.verdicts.iter().any(|verdict| verdict.contains("at most 28 A") && verdict.ends_with("left out")));
}

#[test]
fn a_gap_is_left_out_and_said_and_unknown_signals_are_named() {
    let mut trace = named("gappy", &legs(), &ALL);
    let count = trace.signals[0].values.len();
    let kept: Vec<usize> = (0..count).filter(|k| !(1200..1900).contains(k)).collect();
    let clock: std::sync::Arc<[f64]> = kept.iter().map(|k| *k as f64 * 1e-3).collect();
    for signal in &mut trace.signals {
        signal.values = kept.iter().map(|k| signal.values[*k]).collect();
        signal.times = sollwert::trace::TimeGrid::Explicit(clock.clone());
        signal.clock = sollwert::trace::Clock::Other;
    }
    let inch = sollwert::trace::Signal {
        name: None,
        original: "X.position_setpoint_in".to_owned(),
        ..trace.signals[0].clone()
    };
    trace.signals.push(inch);
    let result = by(&[trace]);
    for (parameter, truth, share) in [(Parameter::Inertia, 0.0085, 0.01), (Parameter::SetpointDelay, 1.2, 1e-3)] {
        let estimate = result.estimate(parameter).unwrap_or_else(|| panic!("{:?}", result.refusals));
        assert!((estimate.value / truth - 1.0).abs() < share, "{estimate:?}, truth {truth}");
    }
    let said = |word: &str| result.verdicts.iter().any(|verdict| verdict.contains(word));
    assert!(said("no samples for 0.701 s from 1.199 s on") && said("X.position_setpoint_in"), "{:?}", result.verdicts);
}

#[test]
fn what_a_trace_has_instead_of_the_axis_is_named() {
    let machine = machine("spinner_mvc850", &[]);
    let x = machine.axis_by_name("X").unwrap();
    let mut other = named("other", &legs(), &["position_setpoint", "current_mean"]);
    for signal in &mut other.signals {
        signal.original = signal.original.replace("X.", "Q.");
        signal.name = Some(signal.original.clone());
    }
    let options = IdentifyOptions { axes: vec![x], linear_only: true };
    let asked = |trace| identify(&[trace], &machine, &options, &mut |_| {}).expect("asked for").remove(0);
    refused(&asked(other), Parameter::Inertia, "there are Q.position_setpoint_mm, Q.current_mean_a");
    // A current alone is a signal of the axis: what is missing is the position.
    refused(
        &asked(named("current", &legs(), &["current_mean"])),
        Parameter::Inertia,
        "no trace has position and torque",
    );
    let mut cut = named("cut", &legs(), &["position_measured", "current_mean"]);
    for signal in &mut cut.signals {
        signal.values.truncate(1);
        signal.times = sollwert::trace::TimeGrid::Uniform { start_ns: 0.0, step_ns: 1e6, count: 1 };
    }
    refused(&asked(cut), Parameter::Inertia, "less than two samples");
}

/// A trace of X of the Spinner under a name.
fn named(name: &str, legs: &[(f64, f64, f64)], stems: &[&str]) -> sollwert::trace::Trace {
    let machine = machine("spinner_mvc850", &[]);
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let signals = simulate(axis, &machine.cycle.time_base, &moves(1e-3, legs), 1e-3);
    sollwert::trace::Trace { name: name.to_owned(), ..trace(axis, 1e-3, &signals, stems, Noise::usual(7)) }
}

#[test]
fn unfit_traces_beside_a_good_one_are_left_out_and_said() {
    let machine = machine("spinner_mvc850", &[]);
    let good = named("good", &legs(), &ALL);
    let by = |traces: &[sollwert::trace::Trace]| {
        identify(traces, &machine, &IdentifyOptions::default(), &mut |_| {}).expect("one axis").remove(0)
    };
    let alone = by(std::slice::from_ref(&good));
    let mut reversed = named("reversed", &legs(), &ALL);
    for signal in reversed.signals.iter_mut().filter(|signal| signal.original.contains("current")) {
        signal.values.iter_mut().for_each(|value| *value = -*value);
    }
    let mut coarse = named("coarse", &legs(), &["position_setpoint", "position_measured", "current"]);
    for signal in &mut coarse.signals {
        signal.values = signal.values.iter().step_by(5).copied().collect();
        let count = signal.values.len();
        signal.times = sollwert::trace::TimeGrid::Uniform { start_ns: 0.0, step_ns: 5e6, count };
    }
    let blind = named("blind", &legs(), &["position_setpoint", "position_measured"]);
    let mut off = named("off", &legs(), &ALL);
    for signal in off.signals.iter_mut().filter(|signal| signal.original.contains("feedforward")) {
        signal.values.iter_mut().for_each(|value| *value = 0.0);
    }
    off.signals.retain(|signal| !signal.original.contains("velocity_command"));
    let found = by(&[reversed, coarse, blind, good, off]);
    for parameter in Parameter::ALL {
        let [alone, beside] = [&alone, &found].map(|result| result.estimate(parameter).copied());
        assert_eq!(alone.is_some(), beside.is_some(), "{parameter:?}: {:?}", found.refusals);
        if let (Some(alone), Some(beside)) = (alone, beside) {
            let room = (alone.high - alone.low).max(1e-6 * alone.value.abs()).max(1e-4);
            assert!((alone.value - beside.value).abs() < room, "{parameter:?}: {alone:?}, beside others {beside:?}");
        }
    }
    for (name, of) in [
        ("reversed", "the mechanics"),
        ("coarse", "the mechanics"),
        ("coarse", "its controllers"),
        ("blind", "the mechanics"),
    ] {
        let said = |verdict: &&String| verdict.starts_with(&format!("`{name}` is left out for {of}"));
        assert!(found.verdicts.iter().any(|verdict| said(&verdict)), "{name} {of}: {:?}", found.verdicts);
    }
}

#[test]
fn a_viscous_friction_of_nothing_is_a_value() {
    let result = of(&legs(), &ALL, &["axes.X.mechanics.viscous_friction_n_m_s_per_rad=0"]);
    let viscous = result.estimate(Parameter::Viscous).unwrap_or_else(|| panic!("{:?}", result.refusals));
    assert!((viscous.low..=viscous.high).contains(&0.0), "{viscous:?}");
    assert!(viscous.value >= 0.0 && viscous.high < 5e-4, "{viscous:?}");
}
