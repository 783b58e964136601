//! Frequency responses: against scipy (`tools/bode_reference.py`, alias sums), against the simulated axis, and against closed forms.

use crate::rig::{Rig, input, mvc_x};
use nalgebra::Complex;
use sollwert::drive::{FrequencyResponses, LOWEST_HZ, Point, frequency_responses};
use sollwert::machine::{Balancing, Filter, FilterShape, JerkFilter, JerkFilterKind, PositionSource};
use std::f64::consts::{PI, TAU};

const REFERENCE: &str = include_str!("bode.json");

fn linear(rig: Rig) -> Rig {
    rig.friction(0.0, 0.0).with(|data| {
        (data.mechanics.gravity_n_m, data.current_max_a, data.voltage_max_v) = (0.0, f64::INFINITY, f64::INFINITY);
        data.speed_setpoint_max_lu_s = f64::INFINITY;
    })
}

fn second_order(frequency_hz: f64, damping_ratio: f64, blocked_hz: f64, blocked_ratio: f64) -> Filter {
    Filter {
        shape: FilterShape::SecondOrder,
        frequency_hz,
        damping_ratio,
        numerator_frequency_hz: blocked_hz,
        numerator_damping_ratio: blocked_ratio,
    }
}

fn pt2(frequency_hz: f64, damping_ratio: f64) -> Filter {
    Filter { shape: FilterShape::Pt2, ..second_order(frequency_hz, damping_ratio, 1.0, 0.0) }
}

/// The cases of the script.
fn case(name: &str) -> Rig {
    linear(mvc_x()).with(|data| {
        let options = &mut data.options;
        if name.starts_with("two_mass") {
            data.mechanics.load_inertia_kg_m2 = 0.005;
            data.mechanics.coupling_stiffness_n_m_per_rad = 2500.0;
            data.mechanics.coupling_damping_n_m_s_per_rad = 0.02;
        }
        match name {
            "options" => {
                (data.velocity_feedforward_ratio, data.torque_feedforward_ratio) = (0.9, 0.6);
                (data.setpoint_delay_s, data.feedforward_delay_s) = (1.3e-3, 0.4e-3);
                options.jerk_filter =
                    JerkFilter { kind: JerkFilterKind::MovingAverage, time_s: 5e-3, ..JerkFilter::default() };
                options.speed_filter = second_order(400.0, 0.7, 300.0, 0.1);
                options.reference_model = pt2(120.0, 0.9);
                options.current_filters[1] = pt2(900.0, 0.6);
            }
            "dsc" => {
                options.stiffness_control = true;
                options.balancing = Balancing::Pt1;
                data.position_gain_per_s = 120.0;
                (data.velocity_feedforward_ratio, data.torque_feedforward_ratio) = (1.0, 0.5);
                data.setpoint_delay_s = 2.2e-3;
            }
            "two_mass" => {
                data.encoder.position_source = PositionSource::Motor;
                data.velocity_feedforward_ratio = 1.0;
            }
            "two_mass_scale" => {
                options.stiffness_control = true;
                options.current_filters[0] = second_order(150.0, 0.5, 147.0, 0.02);
            }
            _ => {}
        }
    })
}

fn responses(rig: &Rig, lowest_hz: f64) -> FrequencyResponses {
    frequency_responses(&rig.data, &rig.time_base, lowest_hz)
}

/// A curve begins at the lowest frequency.
fn at(points: &[Point], frequency_hz: f64) -> Complex<f64> {
    assert!((points[0].frequency_hz / frequency_hz - 1.0).abs() < 1e-12, "{} Hz", points[0].frequency_hz);
    points[0].response
}

/// Every loop in five sets of options at eight frequencies. Both routes round at 1e-16 and divide by 1 - z = 2π f T (3e-4 at 0.7 Hz
/// and T_i) up to three times where the open position loop integrates: 1e-9 of the value is asked for.
#[test]
fn every_loop_agrees_with_scipy() {
    let rows: Vec<serde_json::Value> = serde_json::from_str(REFERENCE).expect("JSON");
    let mut compared = 0;
    for row in &rows {
        let (name, hz) = (row["case"].as_str().expect("a name"), row["frequency_hz"].as_f64().expect("a number"));
        let got = responses(&case(name), hz);
        for (key, points) in [
            ("current_open", &got.current.open),
            ("current_closed", &got.current.closed),
            ("speed_open", &got.speed.open),
            ("speed_closed", &got.speed.closed),
            ("position_open", &got.position.open),
            ("position_closed", &got.position.closed),
            ("setpoint", &got.setpoint),
        ] {
            let part = |n: usize| row[key][n].as_f64().expect("a number");
            let expected = Complex::new(part(0), part(1));
            let error_share = (at(points, hz) - expected).norm() / expected.norm();
            assert!(error_share < 1e-9, "{name}, {hz} Hz, {key}: {} for {expected}", at(points, hz));
            compared += 1;
        }
    }
    assert_eq!(compared, 5 * 8 * 7);
}

/// The simulated axis follows a sine: amplitude and phase of x and e_fol by correlation over whole periods, when all else has died out.
#[test]
fn every_response_is_that_of_the_simulated_axis() {
    for name in ["plain", "options", "dsc", "two_mass", "two_mass_scale"] {
        let rig = case(name);
        for hz in [2.0, 25.0, 111.0] {
            let model = responses(&rig, hz);
            let signals = rig.run((0..3001_u32).map(|k| input((TAU * hz * f64::from(k) * 1e-3).sin())));
            // One second: whole periods, so that the correlation is exact.
            let measured = |value: &dyn Fn(usize) -> f64| {
                let sum = (2000..3000).fold(Complex::new(0.0, 0.0), |sum, k| {
                    sum + Complex::from_polar(1.0, -TAU * hz * k as f64 * 1e-3) * value(k)
                });
                // A sine is the imaginary part of the phasor.
                sum * Complex::new(0.0, 2.0) / 1000.0
            };
            let x = measured(&|k| signals[k].position_actual_lu);
            let deviation = measured(&|k| signals[k].control_deviation_lu);
            for (what, got, expected) in
                [("x", x, at(&model.setpoint, hz)), ("e_fol", deviation, at(&model.deviation, hz))]
            {
                // e^(-50 * 2) of the transient, the rest is rounding.
                assert!(
                    (got - expected).norm() < 1e-9,
                    "{name}, {hz} Hz, {what}: simulated {got}, computed {expected}"
                );
            }
        }
        // A sine of outside torque, set-point at rest.
        let hz = 25.0;
        let signals =
            rig.run((0..3001_u32).map(|k| sollwert::drive::DriveInput {
                load_n_m: (TAU * hz * f64::from(k) * 1e-3).sin(),
                ..input(0.0)
            }));
        let sum = (2000..3000).fold(Complex::new(0.0, 0.0), |sum, k| {
            sum + Complex::from_polar(1.0, -TAU * hz * k as f64 * 1e-3) * signals[k].position_actual_lu
        });
        let got = sum * Complex::new(0.0, 2.0) / 1000.0;
        let expected = at(&responses(&rig, hz).compliance, hz);
        assert!((got - expected).norm() < 1e-9 * expected.norm().max(1e-3), "{name}: {got} for {expected}");
    }
}

/// Current loop without integral part, back-EMF and load: L(z) = K (1 - a)/R / (z - a), a = exp(-R T/L). With g = K (1-a)/R: crossover
/// at cos(wT) = (1 + a² - g²)/(2a), gain margin (1 + a)/g at half the sampling frequency, one pole at a - g.
#[test]
fn margins_of_a_loop_with_a_closed_form() {
    let rig = linear(mvc_x()).with(|data| {
        data.motor.back_emf_v_s_per_rad = 0.0;
        data.current_reset_time_s = f64::INFINITY;
    });
    let (t, r, l, k) = (62.5e-6, 0.75, 6.5e-3, 22.0);
    let a = f64::exp(-r * t / l);
    let g = k * (1.0 - a) / r;
    let current = responses(&rig, LOWEST_HZ).current;
    let margin = current.phase_margin.expect("a crossover");
    let angle = ((1.0 + a * a - g * g) / (2.0 * a)).acos();
    assert!((margin.crossover_hz - angle / (TAU * t)).abs() < 1e-6, "{margin:?}");
    let open = Complex::new(g, 0.0) / (Complex::from_polar(1.0, angle) - a);
    assert!((margin.margin_deg - (180.0 + open.arg() * 180.0 / PI)).abs() < 1e-7, "{margin:?}");
    let gain = current.gain_margin.expect("a gain margin");
    assert!((gain.crossover_hz - 0.5 / t).abs() < 1e-6 && (gain.margin_ratio - (1.0 + a) / g).abs() < 1e-9, "{gain:?}");
    // B = 0.01 leaves the motor's own pole at exp(-B T/J) of the mechanics behind it.
    let slow: f64 = f64::exp(-0.010 * t / 0.0085);
    assert!(
        (current.spectral_radius_ratio - slow.max((a - g).abs())).abs() < 1e-12,
        "{}",
        current.spectral_radius_ratio
    );
    // -3 dB of g/(z - a + g): |z - p|² = 2 g², p = a - g.
    let p = a - g;
    let bandwidth_hz = ((1.0 + p * p - 2.0 * g * g) / (2.0 * p)).acos() / (TAU * t);
    assert!((current.bandwidth_hz.expect("a bandwidth") - bandwidth_hz).abs() < 1e-6, "{:?}", current.bandwidth_hz);
}

/// A margin is what it says: with the gain raised by it the loop stands at the border of stability, and just below it is stable.
#[test]
fn the_gain_margin_is_where_the_loop_becomes_unstable() {
    for name in ["plain", "options", "dsc", "two_mass_scale"] {
        let rig = case(name);
        let position = responses(&rig, LOWEST_HZ).position;
        assert!(position.spectral_radius_ratio < 1.0, "{name}: {}", position.spectral_radius_ratio);
        let margin = position.gain_margin.expect("a gain margin").margin_ratio;
        for (factor, stable) in [(0.999, true), (1.001, false)] {
            let raised = rig.clone().with(|data| data.position_gain_per_s *= margin * factor);
            let radius = responses(&raised, LOWEST_HZ).position.spectral_radius_ratio;
            assert_eq!(radius < 1.0, stable, "{name}: margin {margin}, factor {factor}: {radius}");
        }
    }
}

/// The speed loop of two masses: gain least at the anti-resonance sqrt(c/Jl), largest at the resonance sqrt(c/Jl + c/Jm), when hardly
/// damped. Sampling and the current loop move the resonance a little, not the anti-resonance.
#[test]
fn resonance_and_anti_resonance() {
    let (jl, jm, c) = (0.005, 0.0035, 2500.0);
    let rig = case("two_mass_scale").with(|data| {
        data.options.current_filters[0] = Filter::default();
        data.mechanics.coupling_damping_n_m_s_per_rad = 1e-4;
        // The drive's own gain hardly damps it.
        data.speed_gain_n_m_s_per_rad = 0.05;
    });
    let open = responses(&rig, 20.0).speed.open;
    let near = |hz: f64| open.iter().filter(move |p| (p.frequency_hz / hz - 1.0).abs() < 0.2);
    let (anti_hz, resonance_hz) = (f64::sqrt(c / jl) / TAU, f64::sqrt(c / jl + c / jm) / TAU);
    let least = near(anti_hz).min_by(|a, b| a.response.norm().total_cmp(&b.response.norm())).expect("points");
    let most = near(resonance_hz).max_by(|a, b| a.response.norm().total_cmp(&b.response.norm())).expect("points");
    assert!((least.frequency_hz / anti_hz - 1.0).abs() < 2e-3, "{} for {anti_hz}", least.frequency_hz);
    assert!((most.frequency_hz / resonance_hz - 1.0).abs() < 1e-2, "{} for {resonance_hz}", most.frequency_hz);
    assert!(most.response.norm() > 30.0 * least.response.norm());
}

/// Closed forms at low frequency: x follows 1 to 1; without feed-forward e_fol is s/Kv, with it nearly nothing.
#[test]
fn low_frequency_is_statics() {
    let rig = case("plain");
    let slow = responses(&rig, 0.01);
    assert!((at(&slow.setpoint, 0.01) - 1.0).norm() < 2e-3);
    let lag = at(&slow.deviation, 0.01);
    assert!((lag.im - TAU * 0.01 / 50.0).abs() < 1e-6 && lag.re.abs() < 1e-5, "{lag}");
    let forward = responses(&rig.with(|data| data.velocity_feedforward_ratio = 1.0), 0.01);
    assert!(at(&forward.deviation, 0.01).norm() < 1e-5);
}
