//! No inverse crime: traces of another plant than the one that is fitted (tools/identify_reference.py: a load behind a spring with play,
//! Stribeck friction; and its port `stranger`, for the many that it draws). There the intervals widen until they hold the truth, or the value is refused.

use crate::stranger::{CYCLE, MILD, STRONG, Stranger, as_trace};
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
        (Stranger { inertia, viscous, coulomb, over, stribeck, load, stiffness, damping, play, gravity: 0.0 }, scale)
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

/// Constant speeds from 1 to 80 % of the highest, there and back, as `--plan` has them.
fn many_speeds(scale: f64) -> Vec<f64> {
    const LEGS: [(f64, f64, f64); 6] = [
        (4.0, 6.0, 800.0),
        (12.0, 20.0, 1000.0),
        (25.0, 50.0, 1500.0),
        (50.0, 120.0, 2500.0),
        (80.0, 250.0, 3500.0),
        (120.0, 450.0, 4000.0),
    ];
    let there_and_back = |(way, speed, acceleration): (f64, f64, f64)| {
        [1.0, -1.0].map(|sense| (sense * scale * way, speed, acceleration))
    };
    crate::made::moves(CYCLE, &LEGS.into_iter().flat_map(there_and_back).collect::<Vec<_>>())
}

/// Given and held by the interval, of all plants: inertia, viscous, Coulomb. Stribeck friction and its speed are those drawn times two shares.
fn counted(plants: usize, (over_share, stribeck_share): (f64, f64)) -> [(usize, usize); 3] {
    let (mut counts, mut missed) = ([(0, 0); 3], Vec::new());
    for (seed, (drawn, scale)) in drawn().into_iter().take(plants).enumerate() {
        let plant = Stranger { over: over_share * drawn.over, stribeck: stribeck_share * drawn.stribeck, ..drawn };
        let result = found(plant.trace(&many_speeds(scale), Some(seed as u64)), true);
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
    // 95 % less two standard errors, and 90 % of many.
    for ((given, inside), what) in counts.into_iter().zip(["inertia", "viscous friction", "Coulomb friction"]) {
        let by_chance = (0.05 * given as f64 + 2.0 * (0.95 * 0.05 * given as f64).sqrt()).max(0.1 * given as f64);
        let outside = (given - inside) as f64;
        assert!(outside <= by_chance, "{what}: {inside} of {given} intervals hold the truth");
    }
    counts
}

/// Plants that always run of each kind; `IDENTIFY_REPETITIONS=200` is the nightly run.
const PLANTS: usize = 26;

fn asked() -> usize {
    std::env::var("IDENTIFY_REPETITIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(PLANTS)
}

/// Up to 80 % more friction at low speed, which falls over up to a third of the speeds.
#[test]
fn on_other_plants_with_much_stribeck_friction_the_inertia_holds_and_most_frictions_are_refused() {
    let plants = asked();
    let [(inertias, _), ..] = counted(plants, (1.0, 1.0));
    assert!(inertias * 10 > plants * 9, "an inertia is given for {inertias} of {plants}");
}

/// Up to a quarter more, over up to an eighth of the speeds: frictions are given, with room.
#[test]
fn on_other_plants_with_some_stribeck_friction_intervals_hold_all_values() {
    let plants = asked();
    let given = counted(plants, (0.3, 0.6)).map(|(given, _)| given);
    assert!(given[0] * 10 > plants * 9, "an inertia is given for {} of {plants}", given[0]);
    assert!(given[1] * 2 > plants && given[2] * 5 > plants * 2, "{given:?} values of {plants} plants");
}
