//! No inverse crime: traces of another plant than the one that is fitted (tools/identify_reference.py: a load behind a spring with play,
//! Stribeck friction). There the intervals widen until they hold the truth, or the value is refused.

use sollwert::identify::{AxisResult, IdentifyOptions, Parameter, identify};
use sollwert::trace::{Clock, Meaning, Signal, TimeGrid, Trace};

/// The controllers of the script.
const SETS: &[&str] = &["axes.X.drive.setpoint_delay_ms=2"];

/// Inertia, viscous and Coulomb friction of both cases, as the script prints them.
const TRUTH: [(Parameter, f64); 3] =
    [(Parameter::Inertia, 0.0135), (Parameter::Viscous, 0.012), (Parameter::Coulomb, 1.6)];

fn trace(case: &str) -> Trace {
    let mut columns: [Vec<f64>; 3] = Default::default();
    for line in include_str!("other_plant.csv").lines().filter(|line| line.starts_with(case)) {
        for (column, text) in columns.iter_mut().zip(line.split(',').skip(1)) {
            column.push(text.parse().expect("a number"));
        }
    }
    let names = ["X.position_setpoint_mm", "X.position_measured_mm", "X.current_mean_a"];
    let signal = |(name, values): (&str, Vec<f64>)| Signal {
        name: Some(name.to_owned()),
        original: name.to_owned(),
        unit: String::new(),
        clock: Clock::Servo,
        times: TimeGrid::Uniform { start_ns: 0.0, step_ns: 2e6, count: values.len() },
        values,
        labels: Vec::new(),
        discrete: false,
        meaning: Meaning::default(),
    };
    Trace { name: case.to_owned(), signals: names.into_iter().zip(columns).map(signal).collect(), ..Trace::default() }
}

fn found(case: &str) -> AxisResult {
    let machine = crate::made::machine("mikron_ucp710", SETS);
    identify(&[trace(case)], &machine, &IdentifyOptions::default(), &mut |_| {}).expect("one axis").remove(0)
}

/// Every value holds the truth in its interval, or is not given. Returns how many are given.
fn honest(result: &AxisResult) -> usize {
    let mut given = 0;
    for (parameter, truth) in TRUTH {
        if let Some(estimate) = result.estimate(parameter) {
            given += 1;
            let holds = (estimate.low..=estimate.high).contains(&truth);
            assert!(holds, "{parameter:?}: {estimate:?} without {truth}; verdicts {:?}", result.verdicts);
        } else {
            assert!(result.refusal(parameter).is_some(), "{parameter:?} is neither given nor refused");
        }
    }
    given
}

#[test]
fn a_stiff_machine_with_a_little_stribeck_is_identified_within_wider_intervals() {
    let result = found("mild");
    assert!(honest(&result) >= 2, "{:?}", result.refusals);
    let inertia = result.estimate(Parameter::Inertia).expect("an inertia");
    assert!((inertia.value / 0.0135 - 1.0).abs() < 0.03, "{inertia:?}");
}

#[test]
fn a_machine_that_does_not_follow_the_law_is_refused_or_given_with_room() {
    let result = found("strong");
    honest(&result);
    assert!(result.verdicts.iter().any(|verdict| verdict.contains("Stribeck")), "{:?}", result.verdicts);
}
