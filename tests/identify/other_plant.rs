//! No inverse crime: traces of another plant than the one that is fitted (tools/identify_reference.py: a load behind a spring with play,
//! Stribeck friction; and its port `stranger`, for the many that it draws). There the intervals widen until they hold the truth, or the value is refused.

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

/// The numbers behind the first cell of a row of the script's table.
fn cells(row: &str) -> Vec<f64> {
    row.split(',').skip(1).map(|text| text.parse().expect("a number")).collect()
}

/// The plants that the script drew, and how far each moves.
fn drawn() -> Vec<(Stranger, f64)> {
    let table = include_str!("other_plants.csv").lines().skip(1).take_while(|row| !row.starts_with("row"));
    let plant = |row: &str| {
        let [inertia, viscous, coulomb, over, stribeck, load, stiffness, damping, play, scale] = cells(row)[..] else {
            panic!("{row}")
        };
        (Stranger { inertia, viscous, coulomb, over, stribeck, load, stiffness, damping, play }, scale)
    };
    table.map(plant).collect()
}

/// The motion of a plant: that of the cases, longer or shorter.
fn setpoint(scale: f64) -> Vec<f64> {
    columns("mild")[0].iter().map(|x| x * scale).collect()
}

#[test]
fn the_strangers_are_those_that_the_script_drew() {
    let rows: Vec<(usize, Vec<f64>)> = include_str!("other_plants.csv")
        .lines()
        .filter_map(|row| Some((row.strip_prefix("row ")?.split_once(',')?.0.parse().ok()?, cells(row))))
        .collect();
    assert!(rows.len() > 80);
    for (place, (plant, scale)) in drawn().iter().take(rows[0].1.len() / 2).enumerate() {
        let trace = plant.trace(&setpoint(*scale), None);
        let of = |signal: usize, k: usize| trace.signals[signal].values[k];
        let far = rows.iter().filter(|(k, row)| (of(1, *k) - row[2 * place]).abs() > 1.5e-3).count();
        assert!(far * 20 < rows.len(), "plant {place}: {far} of {} positions are apart", rows.len());
        let square: f64 = rows.iter().map(|(k, row)| (of(2, *k) - row[2 * place + 1]).powi(2)).sum();
        let rms = (square / rows.len() as f64).sqrt();
        // What a quantum of the scale that one sees a cycle earlier makes of a current.
        assert!(rms < 0.1, "plant {place}: the currents differ by {rms:.4} A RMS");
    }
}

/// Given and held by the interval, of all plants: inertia, viscous, Coulomb.
fn counted(plants: usize) -> [(usize, usize); 3] {
    let (mut counts, mut missed) = ([(0, 0); 3], Vec::new());
    for (seed, (plant, scale)) in drawn().into_iter().take(plants).enumerate() {
        let result = found(plant.trace(&setpoint(scale), Some(seed as u64)), true);
        for ((parameter, truth), (given, inside)) in truth(&plant).into_iter().zip(&mut counts) {
            let Some(estimate) = result.estimate(parameter) else {
                assert!(result.refusal(parameter).is_some(), "{parameter:?} is neither given nor refused");
                continue;
            };
            *given += 1;
            let holds = (estimate.low..=estimate.high).contains(&truth);
            *inside += usize::from(holds);
            // What misses at all misses by next to nothing.
            let (near, far) = (estimate.low.min(truth), estimate.high.max(truth));
            let beyond = (estimate.low - near).max(far - estimate.high) / truth;
            let most = if parameter == Parameter::Viscous { 0.05 } else { 0.01 };
            let said = || format!("plant {seed}, {plant:?}: {estimate:?} misses {truth} by {beyond:.3} of it");
            if beyond > most {
                missed.push(said());
            }
            if !holds && std::env::var("VERBOSE").is_ok() {
                println!("  {}; {:?}", said(), result.verdicts);
            }
        }
    }
    println!("inertia, viscous, Coulomb of {plants} other plants (given, inside): {counts:?}");
    assert!(missed.is_empty(), "{missed:?}");
    counts
}

/// `IDENTIFY_REPETITIONS=200` is the nightly run. 95 % less two standard errors, and 90 % of many.
#[test]
fn on_other_plants_intervals_hold_the_truth_or_values_are_refused() {
    let plants = std::env::var("IDENTIFY_REPETITIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(PLANTS);
    let counts = counted(plants);
    assert!(counts[0].0 * 10 > plants * 9, "an inertia is given for {} of {plants}", counts[0].0);
    for ((given, inside), what) in counts.into_iter().zip(["inertia", "viscous friction", "Coulomb friction"]) {
        let by_chance = (0.05 * given as f64 + 2.0 * (0.95 * 0.05 * given as f64).sqrt()).max(0.1 * given as f64);
        let outside = (given - inside) as f64;
        assert!(outside <= by_chance, "{what}: {inside} of {given} intervals hold the truth");
    }
}

/// Plants that always run.
const PLANTS: usize = 24;
