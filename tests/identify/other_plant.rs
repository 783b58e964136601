//! No inverse crime: traces of another plant than the one that is fitted (tools/identify_reference.py: a load behind a spring with play,
//! Stribeck friction; and its port `stranger`, for many of them). There the intervals widen until they hold the truth, or the value is refused.

use crate::random::Random;
use crate::stranger::{MILD, STRONG, Stranger, as_trace};
use sollwert::identify::{AxisResult, IdentifyOptions, Parameter, identify};
use sollwert::trace::Trace;

/// The controllers of the script.
const SETS: &[&str] = &["axes.X.drive.setpoint_delay_ms=2"];

fn columns(case: &str) -> [Vec<f64>; 3] {
    let mut columns: [Vec<f64>; 3] = Default::default();
    for line in include_str!("other_plant.csv").lines().filter(|line| line.starts_with(case)) {
        for (column, text) in columns.iter_mut().zip(line.split(',').skip(1)) {
            column.push(text.parse().expect("a number"));
        }
    }
    columns
}

fn found(trace: Trace, linear_only: bool) -> AxisResult {
    let machine = crate::made::machine("mikron_ucp710", SETS);
    let options = IdentifyOptions { axes: Vec::new(), linear_only };
    identify(&[trace], &machine, &options, &mut |_| {}).expect("one axis").remove(0)
}

fn truth(plant: &Stranger) -> [(Parameter, f64); 3] {
    [(Parameter::Inertia, plant.inertia), (Parameter::Viscous, plant.viscous), (Parameter::Coulomb, plant.coulomb)]
}

/// Every value holds the truth in its interval, or is not given. Returns how many are given.
fn honest(result: &AxisResult) -> usize {
    let mut given = 0;
    for (parameter, truth) in truth(&MILD) {
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
    let result = found(as_trace(columns("mild")), false);
    assert!(honest(&result) >= 2, "{:?}", result.refusals);
    let inertia = result.estimate(Parameter::Inertia).expect("an inertia");
    assert!((inertia.value / 0.0135 - 1.0).abs() < 0.03, "{inertia:?}");
}

#[test]
fn a_machine_that_does_not_follow_the_law_is_refused_or_given_with_room() {
    let result = found(as_trace(columns("strong")), false);
    honest(&result);
    assert!(result.verdicts.iter().any(|verdict| verdict.contains("Stribeck")), "{:?}", result.verdicts);
}

#[test]
fn the_stranger_is_that_of_the_script() {
    for (case, plant) in [("mild", MILD), ("strong", STRONG)] {
        let [setpoint, position, current] = columns(case);
        let trace = plant.trace(&setpoint, None);
        let of = |place: usize| &trace.signals[place].values;
        // Set-points stand in the file with six decimals: what that moves stays within a quantum, and the two may stand on either side of one.
        let far = of(1).iter().zip(&position).filter(|(a, b)| (*a - *b).abs() > 1.5e-3).count();
        assert!(far * 200 < position.len(), "{case}: {far} of {} rows are apart", position.len());
        let square: f64 = of(2).iter().zip(&current).map(|(a, b)| (a - b).powi(2)).sum();
        let rms = (square / current.len() as f64).sqrt();
        // Noise of 0.05 A and a quantum of 0.02 A.
        let noise = 0.05_f64.hypot(0.02 / 12.0_f64.sqrt());
        assert!((rms / noise - 1.0).abs() < 0.1, "{case}: the currents differ by {rms:.4} A RMS, noise {noise:.4} A");
    }
}

/// A plant between stiff and soft, with a little friction at low speed or much.
fn plant(random: &mut Random) -> Stranger {
    let inertia = random.between(0.010, 0.018);
    Stranger {
        inertia,
        viscous: random.between(0.008, 0.02),
        coulomb: random.between(1.0, 2.2),
        over: random.between(0.0, 0.8),
        stribeck: random.between(1.0, 25.0),
        load: inertia * random.between(0.25, 0.55),
        stiffness: 350.0 * (2500.0_f64 / 350.0).powf(random.unit()),
        damping: random.between(0.15, 0.4),
        play: random.between(0.0, 0.004),
    }
}

/// Given and held by the interval, of all plants: inertia, viscous, Coulomb.
fn counted(plants: u64) -> [(u64, u64); 3] {
    let mut setpoint = columns("mild")[0].clone();
    let mut counts = [(0, 0); 3];
    for seed in 0..plants {
        let mut random = Random::new(500 + seed);
        let plant = plant(&mut random);
        // The same motion, longer or shorter.
        let scale = random.between(0.7, 1.2);
        setpoint.iter_mut().for_each(|x| *x *= scale);
        let result = found(plant.trace(&setpoint, Some(seed)), true);
        setpoint.iter_mut().for_each(|x| *x /= scale);
        for ((parameter, truth), (given, inside)) in truth(&plant).into_iter().zip(&mut counts) {
            let Some(estimate) = result.estimate(parameter) else {
                assert!(result.refusal(parameter).is_some(), "{parameter:?} is neither given nor refused");
                continue;
            };
            *given += 1;
            let holds = (estimate.low..=estimate.high).contains(&truth);
            *inside += u64::from(holds);
            // A little Stribeck friction that no term can tell from noise is taken for Coulomb's and leans on the viscous one: no more than it is.
            let (near, far) = (estimate.low.min(truth), estimate.high.max(truth));
            let beyond = (estimate.low - near).max(far - estimate.high) / truth;
            let most = if parameter == Parameter::Viscous { 0.05 } else { 0.02 };
            assert!(beyond < most, "seed {seed}, {plant:?}: {estimate:?} misses {truth} by {beyond:.3} of it");
            if !holds && std::env::var("VERBOSE").is_ok() {
                println!("  seed {seed} {plant:?}: {estimate:?} without {truth}; {:?}", result.verdicts);
            }
        }
    }
    println!("inertia, viscous, Coulomb of {plants} other plants (given, inside): {counts:?}");
    counts
}

/// `IDENTIFY_REPETITIONS=200` is the nightly run.
#[test]
fn on_other_plants_intervals_hold_the_truth_or_values_are_refused() {
    let plants = std::env::var("IDENTIFY_REPETITIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(6);
    let [(given, inside), ..] = counted(plants);
    assert!(given * 2 > plants, "given {given} of {plants}");
    assert!(inside * 10 >= given * 9, "{inside} of {given} intervals of the inertia hold the truth");
}
