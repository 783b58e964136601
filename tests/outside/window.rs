//! The look-ahead window: more of it is never slower, less of it always stops in time, and nothing depends on threads.

use crate::replay::{Replay, machine, replay};
use crate::text::{Kind, dense, program};

fn with_window(blocks: u32, text: &str) -> Replay {
    replay(&machine("spinner_mvc850", &[format!("look_ahead.blocks={blocks}")]), text)
}

#[test]
fn a_wider_window_is_never_slower() {
    let mut cases: Vec<(String, String)> = ["G64", "G642 CTOL=0.02", "G641 ADIS=0.1"]
        .iter()
        .map(|mode| (format!("dense {mode}"), dense(mode, 9000.0, 300)))
        .collect();
    for seed in 1000..1006 {
        cases.push((format!("seed {seed}"), program(seed, Kind::Mixed, 60, &[])));
        cases.push((format!("seed {seed} rounded"), program(seed, Kind::Rounded, 60, &[])));
    }
    for (case, text) in cases {
        let times: Vec<f64> =
            [1, 2, 3, 8, 20, 100, 400].iter().map(|blocks| with_window(*blocks, &text).summary.cycle_time_s).collect();
        for pair in times.windows(2) {
            // The planner's documented 1e-3, and a cycle.
            assert!(pair[1] <= pair[0] * 1.001 + 1e-3, "{case}: {times:?}");
        }
    }
}

/// With `blocks` known ahead the speed is one from which the path can rest within the way that is left in these blocks.
#[test]
fn a_stop_is_always_possible_inside_the_window() {
    for blocks in [1_u32, 2, 8] {
        let run = with_window(blocks, &dense("G64", 20000.0, 300));
        let (a, j) = (1000.0 * 2_f64.sqrt(), 15000.0 * 2_f64.sqrt());
        for row in &run.rows {
            // Points are 0.5 mm apart: at most blocks + 1 of them are ahead.
            let way_mm = 0.5 * f64::from(blocks + 1) + 1e-3;
            let v = row.feed;
            let ramp_s = if v > a * a / j { v / a + a / j } else { 2.0 * (v / j).sqrt() };
            // The ramp that is running may be one that ends the acceleration first: the bound is without it.
            assert!(v * ramp_s / 2.0 <= way_mm, "{blocks} blocks: {v} mm/s at line {}", row.line);
        }
        // It is used: the fastest row needs more than half of the window.
        let fastest = run.rows.iter().map(|row| row.feed).fold(0.0, f64::max);
        assert!(fastest > 0.3 * (f64::from(blocks) * 0.5 * a).sqrt().min(70.0), "{blocks} blocks: {fastest}");
    }
}

/// A line in two, three or ten pieces is the same motion.
#[test]
fn splitting_a_line_does_not_change_the_motion() {
    let whole = with_window(100, "G64\nG1 X100 Y30 F6000\nM30\n");
    for pieces in [2, 3, 10] {
        let points: String = (1..=pieces)
            .map(|n| f64::from(n) / f64::from(pieces))
            .map(|share| format!("X={} Y={}\n", 100.0 * share, 30.0 * share))
            .collect();
        let split = with_window(100, &format!("G64\nG1 F6000\n{points}M30\n"));
        let difference = split.summary.cycle_time_s - whole.summary.cycle_time_s;
        // Acceleration is zero where blocks meet (seven phases): a split inside a ramp costs, and never saves, time.
        assert!(difference >= -1e-3 && difference < 0.2 * whole.summary.cycle_time_s, "{pieces}: {difference}");
    }
}
