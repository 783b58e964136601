//! A plant that is not ours: a load behind a spring with play, Stribeck friction, smooth in speed, integrated with the classical Runge-Kutta
//! method; controllers written once more. Held against what tools/tune_reference.py made with numpy. On it two axes that interpolate together
//! are tuned from their traces, and the gains are tried on it, seen path and unseen.

use super::*;

/// Controllers: gain and time of the speed loop, inertia of the feed-forward. Plants: inertias of motor and load, spring, damping, play; Coulomb,
/// viscous, share above it at rest, Stribeck speed. As tools/tune_reference.py has them.
struct Foreign {
    control: [f64; 3],
    plant: [f64; 9],
}

const X: Foreign =
    Foreign { control: [2.0, 0.010, 0.0085], plant: [0.0060, 0.0035, 2000.0, 0.25, 0.0008, 0.75, 0.011, 0.35, 6.0] };
const Y: Foreign =
    Foreign { control: [2.2, 0.011, 0.011], plant: [0.0065, 0.0060, 2600.0, 0.40, 0.0012, 1.35, 0.016, 0.25, 8.0] };
/// Gains with which the traces were made: velocity, torque, delay in ms.
const BEFORE: [f64; 3] = [1.0, 0.0, 1.2];
const PATHS: &str = include_str!("other_plant_xy.csv");

impl Foreign {
    /// Of current, motor speed and angle, load speed and angle.
    fn slope(&self, y: [f64; 5], voltage: f64) -> [f64; 5] {
        let [motor, load, spring, damping, play, coulomb, viscous, over, stribeck] = self.plant;
        let [current, speed, angle, load_speed, load_angle] = y;
        let twist = angle - load_angle;
        let beyond = if twist.abs() > play / 2.0 { twist - twist.signum() * play / 2.0 } else { 0.0 };
        let coupled = if beyond == 0.0 { 0.0 } else { spring * beyond + damping * (speed - load_speed) };
        let friction = (load_speed / 0.02).tanh() * coulomb * (1.0 + over * (-(load_speed / stribeck).powi(2)).exp())
            + viscous * load_speed;
        [
            (voltage - 0.75 * current - 0.43 * speed) / 6.5e-3,
            (1.30 * current - coupled) / motor,
            speed,
            (coupled - friction) / load,
            load_speed,
        ]
    }

    /// Deviation and actual position at every ms, with gains.
    fn run(&self, setpoints_mm: &[f64], [velocity, torque, delay_ms]: [f64; 3]) -> (Vec<f64>, Vec<f64>) {
        const STEP_S: f64 = 62.5e-6 / 10.0;
        let [gain, reset_s, believed] = self.control;
        let radius = 12.0 / std::f64::consts::TAU;
        let at = |k: usize, back: usize| setpoints_mm[k.saturating_sub(back)];
        let (whole, share) = (delay_ms.floor() as usize, delay_ms.fract());
        let (mut y, mut speed_sum, mut current_sum, mut v_before) = ([0.0; 5], 0.0, 0.0, 0.0);
        let (mut deviations, mut actuals) = (Vec::new(), Vec::new());
        for k in 0..setpoints_mm.len() {
            let v = (at(k, 0) - at(k, 1)) / 1e-3;
            let a = (v - v_before) / 1e-3;
            v_before = v;
            let reference = (1.0 - share) * at(k, whole) + share * at(k, whole + 1);
            let error = reference - (radius * y[4] / 1e-3 + 0.5).floor() * 1e-3;
            deviations.push(error);
            actuals.push(radius * y[4]);
            let speed_wanted = (50.0 * error + velocity * v) / radius;
            let forward = torque * believed * a / radius;
            for _ in 0..8 {
                let speed_error = speed_wanted - y[1];
                let more = gain * 125e-6 / reset_s * speed_error;
                let unbound = gain * speed_error + speed_sum + more + forward;
                let bound = unbound.clamp(-1.30 * 28.0, 1.30 * 28.0);
                if bound == unbound || speed_error * unbound < 0.0 {
                    speed_sum += more;
                }
                for _ in 0..2 {
                    let current_error = bound / 1.30 - y[0];
                    let more = 22.0 * 62.5e-6 / 2e-3 * current_error;
                    let unbound = 22.0 * current_error + current_sum + more;
                    let voltage = unbound.clamp(-245.0, 245.0);
                    if voltage == unbound || current_error * unbound < 0.0 {
                        current_sum += more;
                    }
                    for _ in 0..10 {
                        let add = |k: [f64; 5], h: f64| -> [f64; 5] { std::array::from_fn(|i| y[i] + h * k[i]) };
                        let k1 = self.slope(y, voltage);
                        let k2 = self.slope(add(k1, STEP_S / 2.0), voltage);
                        let k3 = self.slope(add(k2, STEP_S / 2.0), voltage);
                        let k4 = self.slope(add(k3, STEP_S), voltage);
                        let mean = |i: usize| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0;
                        y = std::array::from_fn(|i| y[i] + STEP_S * mean(i));
                    }
                }
            }
        }
        (deviations, actuals)
    }
}

/// Set-points and deviation of X, then of Y.
fn columns(program: &str) -> [Vec<f64>; 4] {
    let rows: Vec<Vec<f64>> = PATHS
        .lines()
        .filter_map(|line| line.strip_prefix(program)?.strip_prefix(','))
        .map(|row| row.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    std::array::from_fn(|place| rows.iter().map(|row| row[place]).collect())
}

/// RMS of the contour error and of the deviations of both axes, with gains of each.
fn on_the_plant(program: &str, gains: [[f64; 3]; 2]) -> [f64; 2] {
    let [x_mm, _, y_mm, _] = columns(program);
    let (x_deviation, x_actual) = X.run(&x_mm, gains[0]);
    let (y_deviation, y_actual) = Y.run(&y_mm, gains[1]);
    let pairs = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| [*x, *y]).collect::<Vec<[f64; 2]>>();
    let contour = contour_rms_mm(&pairs(&x_mm, &y_mm), &pairs(&x_actual, &y_actual));
    [contour, rms(&x_deviation).hypot(rms(&y_deviation))]
}

#[test]
fn two_axes_of_another_plant_are_tuned_together_from_their_traces() {
    let mut sets = Vec::new();
    for axis in ["X", "Y"] {
        sets.push(format!("axes.{axis}.drive.torque_feedforward=0"));
        sets.push(format!("axes.{axis}.drive.setpoint_delay_ms=1.2"));
    }
    let loaded = machine(&sets.iter().map(String::as_str).collect::<Vec<_>>());
    let [x_mm, x_deviation_mm, y_mm, y_deviation_mm] = columns("seen");
    // This plant is that of numpy: a count of the scale may fall on the other side.
    for (plant, setpoints_mm, deviation_mm) in [(X, &x_mm, &x_deviation_mm), (Y, &y_mm, &y_deviation_mm)] {
        let own_mm = plant.run(setpoints_mm, BEFORE).0;
        let far = own_mm.iter().zip(deviation_mm).map(|(own, other)| (own - other).abs()).fold(0.0, f64::max);
        assert!(far < 2.5e-3 && (rms(&own_mm) / rms(deviation_mm) - 1.0).abs() < 1e-3, "{far} mm");
    }
    let trace = Trace {
        name: "measured.csv".to_owned(),
        signals: vec![
            signal("X.position_setpoint_mm", x_mm.clone(), 1e-3),
            signal("X.control_deviation_mm", x_deviation_mm, 1e-3),
            signal("Y.position_setpoint_mm", y_mm.clone(), 1e-3),
            signal("Y.control_deviation_mm", y_deviation_mm, 1e-3),
        ],
        ..Trace::default()
    };
    for objective in [Objective::Deviation, Objective::Contour] {
        let course = course_of_trace(&trace, &loaded.machine, false).unwrap();
        let found = tuned(&loaded, vec![course], &TuneOptions { objective, ..TuneOptions::default() });
        let gains =
            ["X", "Y"].map(|axis| [Gain::Velocity, Gain::Torque, Gain::Delay].map(|kind| gain(&found, axis, kind)));
        assert_eq!(gains[0][2], gains[1][2], "one delay for both");
        for program in ["seen", "unseen"] {
            let [before, after] = [[BEFORE; 2], gains].map(|gains| on_the_plant(program, gains));
            println!(
                "{objective:?} {program}: contour and deviation {before:?} mm before, {after:?} mm after, {gains:?}"
            );
            assert!(after[0] < 0.8 * before[0], "{objective:?} {program}: contour {before:?} {after:?}, {gains:?}");
            assert!(after[1] < 0.8 * before[1], "{objective:?} {program}: deviation {before:?} {after:?}, {gains:?}");
        }
        // What the trace foresees is near what the plant does.
        let foreseen = found.courses[0].contour_mm[1].rms;
        let done = on_the_plant("seen", gains)[0];
        assert!((foreseen / done - 1.0).abs() < 0.5, "{objective:?}: {foreseen} mm foreseen, {done} mm done");
    }
}

/// Moves from rest to rest with the acceleration of a raised cosine: way in mm, time in s of each.
fn moves(legs: &[(f64, f64)]) -> Vec<f64> {
    let mut x_mm = vec![0.0; 30];
    for (way_mm, time_s) in legs {
        let start_mm = x_mm[x_mm.len() - 1];
        let steps = (time_s / 1e-3) as usize;
        // s - sin(2 pi s)/(2 pi): speed is zero at both ends, the acceleration too.
        let share = |k: usize| k as f64 / steps as f64;
        let at = |s: f64| start_mm + way_mm * (s - (std::f64::consts::TAU * s).sin() / std::f64::consts::TAU);
        x_mm.extend((1..=steps).map(|k| (at(share(k)) * 1e6).round() * 1e-6));
        x_mm.extend(std::iter::repeat_n(start_mm + way_mm, 20));
    }
    x_mm
}

/// Ten plants drawn around X, each measured with gains of its own, tuned from that trace, and driven on a motion that was not measured.
#[test]
fn many_other_plants_get_better_on_a_motion_that_was_not_measured() {
    let seen_mm = moves(&[(30.0, 0.35), (-12.0, 0.3), (4.0, 0.15)]);
    let unseen_mm = moves(&[(-18.0, 0.3), (25.0, 0.4)]);
    let mut ratios = Vec::new();
    for seed in 0..10 {
        let mut random = Random::new(900 + seed);
        let mut between = |low: f64, high: f64| random.between(low, high);
        let plant = [
            between(0.0045, 0.0075),
            between(0.0015, 0.0045),
            between(900.0, 3000.0),
            between(0.2, 0.4),
            between(0.0, 0.0015),
            between(0.5, 1.1),
            between(0.008, 0.016),
            between(0.0, 0.5),
            between(2.0, 10.0),
        ];
        let before = [between(0.96, 1.02), between(0.0, 0.5), between(0.4, 2.0)];
        let foreign = Foreign { plant, ..X };
        let key = ["velocity_feedforward", "torque_feedforward", "setpoint_delay_ms"];
        let sets: Vec<String> =
            key.iter().zip(before).map(|(key, value)| format!("axes.X.drive.{key}={value:.6}")).collect();
        let loaded = machine(&sets.iter().map(String::as_str).collect::<Vec<_>>());
        let trace = Trace {
            name: "measured.csv".to_owned(),
            signals: vec![
                signal("X.position_setpoint_mm", seen_mm.clone(), 1e-3),
                signal("X.control_deviation_mm", foreign.run(&seen_mm, before).0, 1e-3),
            ],
            ..Trace::default()
        };
        let course = course_of_trace(&trace, &loaded.machine, false).unwrap();
        let found = tuned(&loaded, vec![course], &TuneOptions::default());
        let gains = [Gain::Velocity, Gain::Torque, Gain::Delay].map(|kind| gain(&found, "X", kind));
        let [old, new] = [before, gains].map(|gains| rms(&foreign.run(&unseen_mm, gains).0));
        println!("{seed}: {before:?} {old:.5} mm, {gains:?} {new:.5} mm");
        assert!(new <= old, "plant {seed}, {plant:?}: {new} mm with {gains:?}, {old} mm with {before:?}");
        ratios.push(new / old);
    }
    ratios.sort_by(f64::total_cmp);
    assert!(ratios[ratios.len() / 2] < 0.5, "{ratios:?}");
}
