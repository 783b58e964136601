//! On synthetic traces with 1 um scale, 0.05 A current noise and 0.02 A quantum the values are right and the intervals hold.
//!
//! `IDENTIFY_REPETITIONS=200 cargo test --release --test identify` is the nightly run; fewer repetitions always run.

use crate::made::{ALL, Noise, legs, machine, moves, simulate, trace};
use crate::random::Random;
use sollwert::identify::{AxisResult, IdentifyOptions, Parameter, identify};

/// A drive with everything that is to be found.
pub const SETS: &[&str] = &[
    "axes.X.drive.velocity_feedforward=0.93",
    "axes.X.drive.torque_feedforward=0.6",
    "axes.X.drive.setpoint_delay_ms=1.37",
    "axes.X.drive.feedforward_delay_ms=0.45",
    "axes.X.mechanics.gravity_n_m=0.35",
];
/// Truth, and the share (the delay: ms) within which it is to be found.
const TRUTH: [(Parameter, f64, f64); 9] = [
    (Parameter::Inertia, 0.0085, 0.01 * 0.0085),
    (Parameter::Viscous, 0.010, 0.03 * 0.010),
    (Parameter::Coulomb, 0.6, 0.005 * 0.6),
    (Parameter::Gravity, 0.35, 0.005 * 0.35),
    (Parameter::PositionGain, 50.0, 0.01 * 50.0),
    (Parameter::VelocityFeedforward, 0.93, 0.001 * 0.93),
    (Parameter::TorqueFeedforward, 0.6, 0.001 * 0.6),
    (Parameter::SetpointDelay, 1.37, 0.1),
    (Parameter::FeedforwardDelay, 0.45, 0.1),
];

/// One repetition: noise by the seed, and another place on the scale.
fn repetition(seed: u64, linear_only: bool) -> AxisResult {
    let machine = machine("spinner_mvc850", SETS);
    let axis = machine.axis(machine.axis_by_name("X").unwrap());
    let noise = Noise::usual(seed);
    let mut x = moves(1e-3, &legs());
    let start_mm = Random::new(seed + 1000).between(-50.0, 50.0);
    x.iter_mut().for_each(|x| *x += start_mm);
    let signals = simulate(axis, &machine.cycle.time_base, &x, noise.scale_lu);
    let trace = trace(axis, 1e-3, &signals, &ALL, noise);
    let options = IdentifyOptions { axes: Vec::new(), linear_only };
    identify(&[trace], &machine, &options, &mut |_| {}).expect("a trace with one axis").remove(0)
}

#[test]
fn values_are_right() {
    for (seed, linear_only) in [(1, true), (1, false), (2, false)] {
        let found = repetition(seed, linear_only);
        for (parameter, truth, within) in TRUTH {
            let estimate = found.estimate(parameter).unwrap_or_else(|| panic!("{parameter:?}: {:?}", found.refusals));
            let off = (estimate.value - truth).abs();
            assert!(off < within, "seed {seed}, linear {linear_only}: {parameter:?} {estimate:?}, truth {truth}");
        }
        if !linear_only {
            for (parameter, truth) in [(Parameter::SpeedGain, 2.0), (Parameter::SpeedResetTime, 10.0)] {
                let estimate = found.estimate(parameter).expect("the motion tells the speed loop");
                assert!((estimate.value / truth - 1.0).abs() < 0.02, "seed {seed}: {parameter:?} {estimate:?}");
            }
        }
    }
}

/// Repetitions that always run; the nightly run asks for 200.
const REPETITIONS: u64 = 30;

#[test]
fn intervals_contain_the_truth() {
    let asked = std::env::var("IDENTIFY_REPETITIONS").ok().and_then(|text| text.parse().ok());
    let repetitions: u64 = asked.unwrap_or(REPETITIONS);
    // The simulated axis takes ten times as long: nightly only.
    let linear_only = asked.is_none();
    let mechanics = [
        (Parameter::Inertia, 0.0085),
        (Parameter::Viscous, 0.010),
        (Parameter::Coulomb, 0.6),
        (Parameter::Gravity, 0.35),
    ];
    let loops = [(Parameter::SpeedGain, 2.0), (Parameter::SpeedResetTime, 10.0)];
    let counted: Vec<(Parameter, f64)> =
        if linear_only { mechanics.to_vec() } else { [&mechanics[..], &loops].concat() };
    let mut inside = vec![0_u64; counted.len()];
    for seed in 0..repetitions {
        let found = repetition(seed, linear_only);
        for ((parameter, truth), inside) in counted.iter().zip(&mut inside) {
            let estimate = found.estimate(*parameter).unwrap_or_else(|| panic!("seed {seed}: {:?}", found.refusals));
            *inside += u64::from((estimate.low..=estimate.high).contains(truth));
        }
    }
    println!("{counted:?}: inside {inside:?} of {repetitions}");
    for ((parameter, _), inside) in counted.iter().zip(&inside) {
        // 90 % is what is asked for; of few repetitions some more may fail by chance (two standard errors of 95 %).
        let least = if linear_only { 0.95 - 2.0 * (0.95_f64 * 0.05 / repetitions as f64).sqrt() } else { 0.9 };
        let share = *inside as f64 / repetitions as f64;
        assert!(share >= least, "{parameter:?}: the interval holds in {inside} of {repetitions}");
    }
    // An interval that always holds is too wide: not all of them may.
    let all: u64 = inside.iter().sum();
    assert!(all < repetitions * counted.len() as u64, "every interval of {repetitions} repetitions holds");
}
