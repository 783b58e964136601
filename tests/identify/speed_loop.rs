//! Gain and reset time of the speed loop from a trace at its own cycle, for several controllers, and from several traces together.

use crate::made::{ALL, Noise, legs, machine, moves, simulate, trace};
use sollwert::drive::{AxisDrive, AxisSignals, DriveInput, Start};
use sollwert::identify::{AxisResult, IdentifyOptions, Means, Parameter, identify};
use sollwert::machine::Machine;
use sollwert::trace::{Signal, TimeGrid, Trace};

/// A jerk-limited move there and back, with the wires of the speed loop at every speed cycle; the torque stands on a grid of `step_n_m`.
fn at_speed_cycle(machine: &Machine, step_n_m: f64) -> Trace {
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let time_base = &machine.cycle.time_base;
    let data = axis.drive.as_ref().unwrap();
    let every = u32::try_from(data.speed_cycle_ticks / data.current_cycle_ticks).unwrap();
    let period_s = time_base.seconds(data.speed_cycle_ticks);
    let mut drive = AxisDrive::new(axis, time_base, Start::Held, 0.0).unwrap();
    let mut rows: Vec<AxisSignals> = Vec::new();
    for x in moves(1e-3, &[(30.0, 150.0, 1500.0), (-30.0, 150.0, 1500.0)]) {
        let input = DriveInput { position_setpoint_lu: x, load_n_m: 0.0, feedforward_active: true };
        drive.step_each(input, |tick, signals| {
            if tick % every == 0 {
                rows.push(*signals);
            }
        });
    }
    let stems = ["position_setpoint", "position_measured", "torque_feedforward", "torque_reference"];
    let mut trace =
        trace(axis, period_s, &rows, &stems, Noise { scale_lu: 0.0, current_a: 0.0, current_step_a: 0.0, seed: 1 });
    if step_n_m > 0.0 {
        let torque = trace.signals.iter_mut().find(|signal| signal.is_named("X.torque_reference")).unwrap();
        torque.values.iter_mut().for_each(|value| *value = (*value / step_n_m).round() * step_n_m);
    }
    let template: Signal = trace.signals[0].clone();
    type Of = fn(&AxisSignals) -> f64;
    let fields: [(&str, Of); 2] =
        [("motor_speed_reference", |s| s.motor_speed_reference_rad_s), ("motor_speed", |s| s.motor_speed_rad_s)];
    for (stem, of) in fields {
        let name = sollwert::trace::axis_signal_name("X", axis.kind, stem).expect("a known field");
        let values = rows.iter().map(of).collect();
        trace.signals.push(Signal { name: Some(name.clone()), original: name, values, ..template.clone() });
    }
    trace
}

fn found(traces: &[Trace], machine: &Machine) -> AxisResult {
    let options = IdentifyOptions { axes: Vec::new(), linear_only: true };
    identify(traces, machine, &options, &mut |_| {}).expect("one axis").remove(0)
}

#[test]
fn gain_and_reset_time_are_those_of_the_controller() {
    for (gain, reset_ms) in [(2.0, 10.0), (0.8, 5.0), (3.0, 20.0), (1.2, 40.0)] {
        let truth = machine(
            "spinner_mvc850",
            &[
                &format!("axes.X.drive.speed_gain_n_m_s_per_rad={gain}"),
                &format!("axes.X.drive.speed_reset_time_ms={reset_ms}"),
            ],
        );
        // The file that the identification gets has other gains.
        let file = machine("spinner_mvc850", &[]);
        for step_n_m in [0.0, 0.01] {
            let result = found(&[at_speed_cycle(&truth, step_n_m)], &file);
            for (parameter, truth) in [(Parameter::SpeedGain, gain), (Parameter::SpeedResetTime, reset_ms)] {
                let estimate = result.estimate(parameter).unwrap_or_else(|| panic!("{:?}", result.refusals));
                assert_eq!(estimate.means, Means::ControlLaw);
                assert!((estimate.value / truth - 1.0).abs() < 0.01, "{estimate:?}, truth {truth}, step {step_n_m}");
                let room = 1e-6 * truth;
                assert!(estimate.low - room <= truth && truth <= estimate.high + room, "{estimate:?}, truth {truth}");
            }
        }
    }
}

#[test]
fn position_ticks_do_not_show_the_speed_loop() {
    let machine = machine("spinner_mvc850", &[]);
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let signals = simulate(axis, &machine.cycle.time_base, &moves(1e-3, &legs()), 1e-3);
    let result = found(&[trace(axis, 1e-3, &signals, &ALL, Noise::usual(3))], &machine);
    let refusal = result.refusal(Parameter::SpeedGain).expect("refused");
    assert!(refusal.reason.contains("its own cycle") && refusal.remedy.contains("125.0 us"), "{refusal:?}");
}

/// One trace a motion.
fn traces(machine: &Machine, motions: &[&[(f64, f64, f64)]]) -> Vec<Trace> {
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let one = |(place, legs): (usize, &&[(f64, f64, f64)])| {
        let noise = Noise::usual(40 + place as u64);
        let signals = simulate(axis, &machine.cycle.time_base, &moves(1e-3, legs), noise.scale_lu);
        let mut trace = trace(axis, 1e-3, &signals, &ALL, noise);
        // Every trace has a clock of its own.
        for signal in &mut trace.signals {
            if let TimeGrid::Uniform { start_ns, .. } = &mut signal.times {
                *start_ns = 3.7e9 * place as f64 + 0.25e6;
            }
        }
        trace
    };
    motions.iter().enumerate().map(one).collect()
}

#[test]
fn several_traces_tell_together_what_none_of_them_tells_alone() {
    let machine = machine("spinner_mvc850", &["axes.X.mechanics.gravity_n_m=0.35"]);
    let forward: &[(f64, f64, f64)] = &[(20.0, 15.0, 1000.0), (60.0, 90.0, 1000.0), (90.0, 300.0, 1500.0)];
    let backward: &[(f64, f64, f64)] = &[(-20.0, 20.0, 1000.0), (-60.0, 120.0, 1000.0), (-90.0, 250.0, 1500.0)];
    let both = traces(&machine, &[forward, backward]);
    for one in &both {
        let alone = found(std::slice::from_ref(one), &machine);
        assert!(alone.refusal(Parameter::Coulomb).is_some(), "{:?}", alone.estimate(Parameter::Coulomb));
    }
    let together = found(&both, &machine);
    let truth = [
        (Parameter::Inertia, 0.0085, 0.01),
        (Parameter::Viscous, 0.010, 0.03),
        (Parameter::Coulomb, 0.6, 0.01),
        (Parameter::Gravity, 0.35, 0.01),
        (Parameter::PositionGain, 50.0, 0.01),
        (Parameter::SetpointDelay, 1.2, 0.01),
    ];
    for (parameter, truth, share) in truth {
        let estimate = together.estimate(parameter).unwrap_or_else(|| panic!("{parameter:?}: {:?}", together.refusals));
        assert!((estimate.value / truth - 1.0).abs() < share, "{estimate:?}, truth {truth}");
        assert!(estimate.low <= truth && truth <= estimate.high, "{estimate:?}, truth {truth}");
    }
    // The order of the files is no matter.
    let turned: Vec<Trace> = both.iter().rev().cloned().collect();
    let other = found(&turned, &machine);
    for (parameter, ..) in truth {
        let [a, b] = [&together, &other].map(|result| result.estimate(parameter).unwrap().value);
        assert!((a / b - 1.0).abs() < 1e-9, "{parameter:?}: {a} and {b}");
    }
    // More of the same makes no interval wider: three pairs against one.
    let six = traces(&machine, &[forward, backward, forward, backward, forward, backward]);
    let more = found(&six, &machine);
    for parameter in [Parameter::Viscous, Parameter::Coulomb] {
        let width = |result: &AxisResult| result.estimate(parameter).map(|e| e.high - e.low).unwrap();
        assert!(width(&more) < width(&together), "{parameter:?}");
    }
}
