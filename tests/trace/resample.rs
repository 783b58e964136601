//! Resampling: exact for the polynomials that a method stands for, and a gap stays a gap.

use sollwert::trace::{Clock, Meaning, Method, Signal, TimeGrid};

fn signal(times: &[f64], value: impl Fn(f64) -> f64) -> Signal {
    Signal {
        name: None,
        original: "test".to_owned(),
        unit: String::new(),
        clock: Clock::Other,
        values: times.iter().map(|time_s| value(*time_s)).collect(),
        times: TimeGrid::from_times(times.to_vec(), 1e-9),
        labels: Vec::new(),
        discrete: false,
        meaning: Meaning::default(),
    }
}

fn uniform() -> Vec<f64> {
    (0..50).map(|k| f64::from(k) / 500.0).collect()
}

/// Steps of 1, 3, 2 ms and so on.
fn irregular() -> Vec<f64> {
    let steps = [1, 3, 2, 7, 1, 4].iter().cycle();
    let mut at = 0;
    steps
        .take(40)
        .map(|step| {
            at += step;
            f64::from(at) * 0.001
        })
        .collect()
}

fn between(times: &[f64]) -> Vec<f64> {
    let (first, last) = (times[0], times[times.len() - 1]);
    (0..=777).map(|k| first + (last - first) * f64::from(k) / 777.0).collect()
}

#[test]
fn times_of_a_file_become_a_grid_only_where_they_are_one() {
    assert_eq!(TimeGrid::from_times(uniform(), 1e-9), TimeGrid::Uniform { start_ns: 0.0, step_ns: 2e6, count: 50 });
    assert!(matches!(TimeGrid::from_times(irregular(), 1e-9), TimeGrid::Explicit(_)));
    assert_eq!(TimeGrid::from_times(uniform(), 1e-9).iter().collect::<Vec<_>>(), uniform());
    // 250 us in three: not whole nanoseconds, and not rounded to them either.
    let thirds: Vec<f64> = (0..3_000_000).map(|k| f64::from(k) * 250e-6 / 3.0).collect();
    let grid = TimeGrid::from_times(thirds.clone(), 1e-9);
    assert!(matches!(grid, TimeGrid::Uniform { .. }));
    assert!((grid.end_s().unwrap() - thirds[thirds.len() - 1]).abs() < 1e-9);
    for k in [0, 1, 17, 49] {
        let grid = TimeGrid::from_times(uniform(), 1e-9);
        assert_eq!(grid.index_at(grid.time_s(k)), Some(k));
        assert_eq!(grid.index_at(grid.time_s(k) + 0.0019), Some(k));
    }
    assert_eq!(TimeGrid::from_times(uniform(), 1e-9).index_at(-0.001), None);
}

#[test]
fn a_method_is_exact_for_what_it_stands_for() {
    for times in [uniform(), irregular()] {
        let wanted = between(&times);
        let line = |t: f64| 3.0 - 70.0 * t;
        for (value, time_s) in signal(&times, line).resampled(&wanted, Method::Linear).iter().zip(&wanted) {
            assert!((value - line(*time_s)).abs() < 1e-12);
        }
        let cubic = |t: f64| 1.0 + t * (2.0 + t * (-300.0 + t * 5000.0));
        let inner = &wanted[50..700];
        for (value, time_s) in signal(&times, cubic).resampled(inner, Method::Cubic).iter().zip(inner) {
            assert!((value - cubic(*time_s)).abs() < 1e-10, "{time_s}: {value}");
        }
        let held = signal(&times, cubic);
        for (value, time_s) in held.resampled(&wanted, Method::Hold).iter().zip(&wanted) {
            let before = times.iter().rev().find(|time| **time <= time_s + 1e-9).unwrap();
            assert_eq!(*value, cubic(*before));
        }
    }
}

#[test]
fn a_gap_stays_a_gap_and_outside_there_is_nothing() {
    let mut gappy = signal(&uniform(), |t| t);
    gappy.values[10] = f64::NAN;
    for method in [Method::Linear, Method::Cubic] {
        let values = gappy.resampled(&[0.018, 0.0185, 0.020, 0.0215, 0.022, 0.0225], method);
        assert_eq!(
            values.iter().map(|value| value.is_nan()).collect::<Vec<_>>(),
            [false, true, true, true, false, false]
        );
    }
    // Held until its successor, which is the gap.
    let values = gappy.resampled(&[0.018, 0.0195, 0.020, 0.0215, 0.022], Method::Hold);
    assert_eq!(values.iter().map(|value| value.is_nan()).collect::<Vec<_>>(), [false, false, true, true, false]);
    for method in [Method::Linear, Method::Hold, Method::Cubic] {
        assert!(gappy.value_at(-0.001, method).is_nan());
        assert!(gappy.value_at(0.0981, method).is_nan());
        assert_eq!(gappy.value_at(0.098, method), 0.098);
    }
}

#[test]
fn instants_out_of_order_find_their_place_too() {
    let held = signal(&irregular(), |t| t);
    let wanted: Vec<f64> = irregular().into_iter().rev().collect();
    assert_eq!(held.resampled(&wanted, Method::Linear), wanted);
}
