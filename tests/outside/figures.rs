//! The figures of a run against the rows and the program: starts, ends, lengths, feeds, shares, lines.

use crate::corners::{Transition, transitions};
use crate::replay::{Element, MACHINES, Replay, home, linear, machine, minus, norm, replay};
use crate::text::{Kind, dense, program};
use sollwert::machine::Machine;

fn check(machine: &Machine, case: &str, text: &str, run: &Replay) {
    let (rows, summary) = (&run.rows, &run.summary);
    let linear = linear(machine);
    assert_eq!(rows.len() as u64, summary.setpoints + 1, "{case}");
    assert!((summary.cycle_time_s - summary.setpoints as f64 * run.t_s).abs() < 1e-9, "{case}");
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    assert_eq!(first.q, home(machine), "{case}: starts at home");
    assert_eq!(first.velocity, [0.0; 5], "{case}: starts at rest");
    let end = run.elements.values().last().map_or(home(machine), |element| element.end);
    assert_eq!(last.q, end, "{case}: ends at the programmed end");
    assert_eq!(last.velocity, [0.0; 5], "{case}: ends at rest");

    let mut chords_mm = 0.0;
    for pair in rows.windows(2) {
        let (a, b) = (&pair[0], &pair[1]);
        let step = minus(&b.q, &a.q);
        let chord: f64 = (0..5).filter(|i| linear[*i]).map(|i| step[i] * step[i]).sum::<f64>().sqrt();
        chords_mm += chord;
        assert!(b.s_mm >= a.s_mm, "{case} line {}: s falls", b.line);
        assert!(b.s_mm - a.s_mm >= chord - 1e-9, "{case} line {}: s grows by less than the chord", b.line);
        assert!(b.block >= a.block, "{case}");
    }
    assert!((last.s_mm - summary.path_length_mm).abs() < 1e-9 * summary.path_length_mm.max(1.0), "{case}");
    assert!(chords_mm <= summary.path_length_mm + 1e-6, "{case}");
    lengths(machine, case, run);

    for row in rows {
        let feed = norm(&std::array::from_fn::<f64, 5, _>(|i| if linear[i] { row.velocity[i] } else { 0.0 }));
        if !row.rotary_only {
            assert!((feed - row.feed).abs() <= 1e-6 * row.feed + 1e-9, "{case} line {}: {feed} {}", row.line, row.feed);
        }
        if let Some(programmed) = row.programmed_feed {
            assert!(row.feed <= programmed * (1.0 + 1e-9), "{case} line {}: {} above F", row.line, row.feed);
        }
        let said = text.lines().nth(row.line as usize - 1).unwrap_or_default();
        let moves = ["X", "Y", "Z", "A", "B", "C", "G4", "M30"].iter().any(|word| said.contains(word));
        assert!(moves, "{case}: line {} is `{said}`", row.line);
    }
    let shares: f64 = summary.limits.values().sum();
    assert!((shares - 1.0).abs() < 1e-12 && summary.limits.values().all(|share| *share > 0.0), "{case}: {shares}");
    let at_feed = rows[1..]
        .iter()
        .filter(|row| row.programmed_feed.is_some_and(|programmed| (row.feed - programmed).abs() <= 1e-3 * programmed));
    let share = at_feed.count() as f64 / summary.setpoints as f64;
    assert!((share - summary.programmed_feed_share).abs() < 1e-12, "{case}");
}

/// Path length = blocks, less 2 T a blend, plus the blend, whose length lies between its chord and its two legs.
fn lengths(machine: &Machine, case: &str, run: &Replay) {
    let linear = linear(machine);
    let blocks: f64 = run.elements.values().map(|element: &Element| element.length_mm(&linear)).sum();
    let (mut low, high) = (blocks, blocks);
    for (_, transition) in transitions(machine, &run.elements) {
        match transition {
            Transition::Blend(blend) => low -= 2.0 * blend.t_mm * (1.0 - (blend.angle_rad / 2.0).cos()),
            // It takes half of each block at most, of 0.3 mm of tolerance no more than a few millimetres.
            Transition::Smooth => low -= 5.0,
            Transition::Stop | Transition::Pass => {}
        }
    }
    let length = run.summary.path_length_mm;
    assert!(length >= low - 1e-5 && length <= high + 1e-5, "{case}: {low} {length} {high}");
}

#[test]
fn random_programs() {
    for name in MACHINES {
        let machine = machine(name, &[]);
        for seed in 900..912 {
            let kind = [Kind::Rounded, Kind::Continuous, Kind::Mixed][seed as usize % 3];
            let text = program(seed, kind, 60, &[]);
            check(&machine, &format!("{name} seed {seed}"), &text, &replay(&machine, &text));
        }
        let text = dense("G642 CTOL=0.02", 6000.0, 300);
        check(&machine, &format!("{name} dense"), &text, &replay(&machine, &text));
    }
    for (name, rotary) in [("mikron_ucp710", ["A", "C"]), ("xyzbc", ["B", "C"])] {
        let machine = machine(name, &[]);
        for seed in 920..926 {
            let text = program(seed, Kind::Mixed, 60, &rotary);
            check(&machine, &format!("{name} seed {seed}"), &text, &replay(&machine, &text));
        }
    }
}

/// What holds a long motion is what its words say.
#[test]
fn limits_are_those_that_hold() {
    let spinner = machine("spinner_mvc850", &[]);
    // 400 mm at 3 m/min: 8 s, of which two ramps of 2 sqrt(50 / 15000) = 0.115 s hang on the jerk of X.
    let run = replay(&spinner, "G1 X400 F3000\nM30\n");
    let ramps = 4.0 * (50.0 / 15000.0_f64).sqrt() / run.summary.cycle_time_s;
    assert!((run.summary.limits["X.jerk"] - ramps).abs() < 2e-3, "{:?}", run.summary.limits);
    assert!((run.summary.limits["feed"] - (1.0 - ramps)).abs() < 2e-3);
    // A rapid hangs on the velocity of Z (250 mm/s), its ramps on acceleration (0.8 m/s²) with jerk phases of 12 m/s³.
    let run = replay(&spinner, "G0 Z400\nM30\n");
    let (v, a, j) = (250.0, 800.0, 12000.0);
    let total: f64 = 400.0 / v + v / a + a / j;
    let wanted = [("Z.velocity", 400.0 / v - v / a - a / j), ("Z.acceleration", 2.0 * (v / a + a / j))];
    let ramps: f64 = run.summary.limits.iter().filter(|(key, _)| *key != "Z.velocity").map(|(_, share)| share).sum();
    assert!((run.summary.limits["Z.velocity"] - wanted[0].1 / total).abs() < 3e-3, "{:?}", run.summary.limits);
    assert!((ramps - wanted[1].1 / total).abs() < 3e-3, "{:?}", run.summary.limits);
    // A dwell.
    let run = replay(&spinner, "G1 X10 F6000\nG4 F2\nX20\nM30\n");
    assert!((run.summary.limits["dwell"] * run.summary.cycle_time_s - 2.0).abs() <= run.t_s);
}
