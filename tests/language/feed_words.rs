//! Feed, dynamics, spindles and positioning axes, from the word to the set-point: closed forms and differences of positions.

use crate::random::Random;
use sollwert::base::AxisId;
use sollwert::interpreter::{Event, Feed, Interpreter, Move, MoveKind};
use sollwert::kernel::{Kernel, Status};
use sollwert::machine::Machine;
use sollwert::program::ProgramSource;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

/// Limits of the linear axes of the test machine: 20 m/min, 1 m/s², 15 m/s³.
const V: f64 = 20_000.0 / 60.0;
const A: f64 = 1000.0;
const J: f64 = 15_000.0;

struct Row {
    q: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    limit: String,
    line: u32,
}

struct Replay {
    rows: Vec<Row>,
    t_s: f64,
}

fn source(text: &str) -> ProgramSource {
    ProgramSource::from_bytes("part.mpf", text.as_bytes())
}

fn machine(sets: &[&str]) -> Machine {
    crate::nc_machine::test_machine::with_axes(&["X", "Y", "Z", "U", "A"], sets)
}

fn replay(machine: &Machine, text: &str) -> Replay {
    let mut kernel = Kernel::new(Arc::new(machine.clone()), source(text), false);
    let mut rows = Vec::new();
    while kernel.cycle().unwrap() == Status::Running {
        let setpoint = kernel.output().setpoint.unwrap();
        let of = |get: fn(&sollwert::interpolator::AxisSetpoint) -> f64| {
            machine.axis_ids().map(|id| get(&setpoint.axes[id])).collect::<Vec<_>>()
        };
        let limit = setpoint.path.limit;
        let name = limit.axis.map_or(String::new(), |axis| format!("{}.", machine.axis(axis).name));
        rows.push(Row {
            q: of(|axis| axis.position_lu),
            velocity: of(|axis| axis.velocity_lu_s),
            acceleration: of(|axis| axis.acceleration_lu_s2),
            limit: format!("{name}{}", limit.kind.name()),
            line: setpoint.path.block.line,
        });
    }
    if let Some(alarm) = kernel.take_findings().alarm {
        panic!("{}", alarm.render(false));
    }
    Replay { rows, t_s: machine.cycle.time_base.setpoint_period_s() }
}

impl Replay {
    fn time_s(&self) -> f64 {
        (self.rows.len() - 1) as f64 * self.t_s
    }

    /// The last set-point stands on the first tick at or after the end.
    fn lasts(&self, expected_s: f64) {
        let late_s = self.time_s() - expected_s;
        assert!((-1e-9..=self.t_s + 1e-9).contains(&late_s), "{} s, expected {expected_s} s", self.time_s());
    }

    /// Greatest n-th difference quotient of an axis.
    fn greatest(&self, axis: usize, order: usize) -> f64 {
        let mut values: Vec<f64> = self.rows.iter().map(|row| row.q[axis]).collect();
        for _ in 0..order {
            values = values.windows(2).map(|pair| (pair[1] - pair[0]) / self.t_s).collect();
        }
        values.into_iter().fold(0.0, |greatest, value| greatest.max(value.abs()))
    }

    /// The axis within its limits, and close to them where `reached`.
    fn within(&self, axis: usize, limits: [f64; 3]) {
        for (order, limit) in (1..=3).zip(limits) {
            let found = self.greatest(axis, order);
            let rounding = 4e-13 / self.t_s.powi(order as i32);
            assert!(found <= limit * (1.0 + 1e-6) + rounding, "order {order}: {found}, limit {limit}");
        }
    }

    fn share(&self, limit: &str) -> f64 {
        self.rows.iter().filter(|row| row.limit == limit).count() as f64 / self.rows.len() as f64
    }
}

/// From rest to rest where v is reached: L/v + v/a + a/j.
fn rest_to_rest_s(length: f64, v: f64, a: f64, j: f64) -> f64 {
    assert!(v >= a * a / j && length >= v * v / a + v * a / j, "v is reached");
    length / v + v / a + a / j
}

fn moves(machine: &Machine, text: &str) -> Vec<Move> {
    let mut interpreter = Interpreter::new(source(text), machine);
    let mut moves = Vec::new();
    while let Some(next) = interpreter.next_move().unwrap_or_else(|alarm| panic!("{}", alarm.render(false))) {
        moves.push(next);
    }
    moves
}

fn alarm(machine: &Machine, text: &str) -> String {
    let mut interpreter = Interpreter::new(source(text), machine);
    loop {
        match interpreter.next_move() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("no alarm: {text}"),
            Err(alarm) => return alarm.render(false),
        }
    }
}

fn feeds(next: &Move) -> Vec<f64> {
    match &next.feed {
        Feed::Rapid => Vec::new(),
        Feed::Path { feed_lu_s } => vec![*feed_lu_s],
        Feed::Varying { feeds_lu_s } => feeds_lu_s.to_vec(),
    }
}

fn motions(moves: &[Move]) -> Vec<&Move> {
    moves.iter().filter(|next| matches!(next.kind, MoveKind::Line | MoveKind::Arc(_) | MoveKind::Rapid)).collect()
}

fn close(value: f64, expected: f64) {
    assert!((value - expected).abs() <= 1e-9 * expected.abs().max(1.0), "{value}, expected {expected}");
}

#[test]
fn acc_velolim_and_jerklim_change_the_limits_of_their_axis() {
    let m = machine(&[]);
    let plain = replay(&m, "SOFT G60 G1 X400 F100000\nM30\n");
    plain.lasts(rest_to_rest_s(400.0, V, A, J));
    for (word, limits) in [
        ("ACC[X]=50", [V, A / 2.0, J]),
        ("ACC[X]=150", [V, A * 1.5, J]),
        ("VELOLIM[X]=60", [0.6 * V, A, J]),
        ("JERKLIM[X]=40", [V, A, 0.4 * J]),
        ("ACC[X]=50 VELOLIM[X]=60 JERKLIM[X]=40", [0.6 * V, A / 2.0, 0.4 * J]),
    ] {
        let run = replay(&m, &format!("SOFT G60 {word}\nG1 X400 F100000\nM30\n"));
        let [v, a, j] = limits;
        run.lasts(rest_to_rest_s(400.0, v, a, j));
        run.within(0, limits);
        assert!(run.greatest(0, 1) > 0.999 * v && run.greatest(0, 2) > 0.999 * a && run.greatest(0, 3) > 0.999 * j);
        // The other axes keep theirs, and 100 % takes it back.
        replay(&m, &format!("SOFT G60 {word}\nG1 Y400 F100000\nM30\n")).lasts(rest_to_rest_s(400.0, V, A, J));
        let back = "ACC[X]=100 VELOLIM[X]=100 JERKLIM[X]=100";
        let run = replay(&m, &format!("SOFT G60 {word}\n{back}\nG1 X400 F100000\nM30\n"));
        run.lasts(rest_to_rest_s(400.0, V, A, J));
    }
    assert!(alarm(&m, "VELOLIM[X]=101\nM30\n").contains("at most 100"));
    for (text, named) in
        [("JERKLIM[X]=0", "JERKLIM[X] of 0 %"), ("OVR=300", "OVR of 300 %"), ("ACC[Y]=-1", "ACC[Y] of -1 %")]
    {
        let said = alarm(&m, &format!("{text}\nM30\n"));
        assert!(said.contains(named), "{said}");
    }
    assert!(alarm(&m, "ACC[X]=0\nM30\n").contains("0 %"));
}

#[test]
fn dynamics_sets_and_drive_change_the_limits() {
    let m = machine(&[
        "axes.X.dynamics.rough.acceleration_max_m_s2=0.5",
        "axes.X.dynamics.finish.jerk_max_m_s3=6",
        "axes.X.acceleration_reduction_velocity_ratio=0.5",
        "axes.X.acceleration_reduction_ratio=0.4",
    ]);
    let run = |word: &str| replay(&m, &format!("SOFT G60 {word}\nG1 X400 F100000\nM30\n"));
    run("DYNROUGH").lasts(rest_to_rest_s(400.0, V, A / 2.0, J));
    run("DYNFINISH").lasts(rest_to_rest_s(400.0, V, A, 6000.0));
    run("DYNPREC").lasts(rest_to_rest_s(400.0, V, A, 6000.0));
    run("DYNROUGH ACC[X]=80").lasts(rest_to_rest_s(400.0, V, 0.4 * A, J));
    run("DYNPOS").lasts(rest_to_rest_s(400.0, V, A, J));
    // BRISK: L/v + v/a. DRIVE: slower, and above half the velocity never more than 60 % of the acceleration.
    run("BRISK").lasts(400.0 / V + V / A);
    let drive = run("DRIVE");
    assert!(drive.time_s() > 400.0 / V + V / A + 0.1);
    for row in &drive.rows {
        let allowed = if row.velocity[0] > 0.5 * V * (1.0 + 1e-9) { 0.6 * A } else { A };
        assert!(row.acceleration[0].abs() <= allowed * (1.0 + 1e-9));
    }
    // Slow motion keeps the whole acceleration.
    let slow = replay(&m, "G60 DRIVE\nG1 X40 F9000\nM30\n");
    slow.lasts(40.0 / 150.0 + 150.0 / A);
}

#[test]
fn a_corner_between_two_modes_obeys_the_stricter_of_both() {
    let m = machine(&[]);
    let speed = |first: &str, second: &str| {
        let run = replay(&m, &format!("G64 {first}\nG1 X100 F100000\n{second}\nG1 X200 Y100\nM30\n"));
        let corner = run.rows.iter().position(|row| row.line == 4).unwrap();
        run.rows[corner].velocity[0].hypot(run.rows[corner].velocity[1])
    };
    let (weak, strong) = (speed("ACC[Y]=10", ""), speed("", ""));
    assert!(weak < 0.5 * strong, "{weak} {strong}");
    let later = speed("", "ACC[Y]=10");
    assert!(later < 0.5 * strong, "{later} {strong}");
}

#[test]
fn overrides_hold_by_name() {
    let m = machine(&[]);
    let run = replay(&m, "SOFT G60 OVR=50\nG1 X100 F6000\nM30\n");
    run.lasts(100.0 / 50.0 + 2.0 * (50.0 / J).sqrt());
    assert!(run.share("override") > 0.85 && run.share("feed") < 0.01);
    let run = replay(&m, "SOFT G60 OVR=150\nG1 X100 F6000\nM30\n");
    run.lasts(rest_to_rest_s(100.0, 150.0, A, J));
    assert!(run.share("feed") > 0.5);
    let run = replay(&m, "SOFT G60 OVRRAP=30 OVR=50\nG0 X100\nM30\n");
    run.lasts(rest_to_rest_s(100.0, 0.3 * V, A, J));
    assert!(run.share("override") > 0.5);
    // A rapid is never faster than the axes.
    replay(&m, "SOFT G60 OVRRAP=200\nG0 X400\nM30\n").lasts(rest_to_rest_s(400.0, V, A, J));
    assert!(alarm(&m, "OVR=0\nM30\n").contains("more than 0"));
}

#[test]
fn fgroup_says_of_which_axes_f_is_the_speed() {
    let m = machine(&[]);
    // Rotary alone: F is deg/min; in FGROUP with FGREF=10 it is mm/min at 10 mm: 10 mm/s are 1 rad/s.
    let a = &m.axis(AxisId::new(4)).limits;
    let (a4, j4) = (a.acceleration_max_lu_s2, a.jerk_max_lu_s3);
    replay(&m, "SOFT G60 G1 A90 F3600\nM30\n").lasts(rest_to_rest_s(FRAC_PI_2, PI / 3.0, a4, j4));
    replay(&m, "SOFT G60 FGROUP(A) FGREF[A]=10\nG1 A90 F600\nM30\n").lasts(rest_to_rest_s(FRAC_PI_2, 1.0, a4, j4));
    // Without FGREF a degree counts as a millimetre.
    replay(&m, "SOFT G60 FGROUP(A)\nG1 A90 F3600\nM30\n").lasts(rest_to_rest_s(FRAC_PI_2, PI / 3.0, a4, j4));
    // X and A together: way sqrt(30² + (20 * pi/2)²) at 10 mm/s.
    let run = replay(&m, "BRISK G60 FGROUP(X,A) FGREF[A]=20\nG1 X30 A90 F600\nM30\n");
    let way = 30.0_f64.hypot(20.0 * FRAC_PI_2);
    let middle = &run.rows[run.rows.len() / 2];
    close(middle.velocity[0].hypot(20.0 * middle.velocity[4]), 10.0);
    assert!((run.time_s() - way / 10.0).abs() < 0.1);
    // X alone in the group: Y follows.
    let run = replay(&m, "G60 FGROUP(X)\nG1 X30 Y40 F600\nM30\n");
    close(run.rows[run.rows.len() / 2].velocity[0], 10.0);
    // FL bounds what follows: 6 mm/s for Y are 4.5 mm/s for X.
    let run = replay(&m, "G60 FGROUP(X) FL[Y]=360\nG1 X30 Y40 F600\nM30\n");
    close(run.rows[run.rows.len() / 2].velocity[1], 6.0);
    assert!(run.share("Y.velocity") > 0.9);
    // FGROUP() takes it back.
    let run = replay(&m, "G60 FGROUP(X)\nFGROUP()\nG1 X30 Y40 F600\nM30\n");
    close(run.rows[run.rows.len() / 2].velocity[0], 6.0);
}

#[test]
fn g93_and_g931_give_the_time_of_a_block() {
    let m = machine(&[]);
    for text in [
        "G64 G93\nG1 X10 F20\nG1 X20 F20\nG1 X30 F20\nM30\n",
        "G64 G931\nG1 X10 F3\nG1 X20 F3\nG1 X30 F3\nM30\n",
        "G64 G931\nG1 X10 A90 F3\nG1 X20 A180 F3\nG1 X30 A270 F3\nM30\n",
    ] {
        let run = replay(&m, text);
        let middle = run.rows.iter().filter(|row| row.line == 3).count();
        assert!((middle as f64 * run.t_s - 3.0).abs() < 1.5 * run.t_s, "{middle} {text}");
    }
    // A half circle of radius 10 in 3 s, and a rotary axis alone.
    let found = moves(&m, "G93\nG3 X0 Y20 J10 F20\nG1 A90 F10\nM30\n");
    let found = motions(&found);
    close(feeds(found[0])[0], PI * 10.0 / 3.0);
    close(feeds(found[1])[0], FRAC_PI_2 / 6.0);
    assert!(alarm(&m, "G93 G1 X10 F20\nX20\nM30\n").contains("G93"));
}

#[test]
fn g95_and_g96_follow_the_spindle() {
    let m = machine(&[]);
    let found = moves(&m, "S1200 M3 G95 F0.1\nG1 X10\nFB=0.2 X20\nX30\nG94 F600\nX40\nM30\n");
    let found: Vec<f64> = motions(&found).iter().map(|next| feeds(next)[0]).collect();
    for (value, expected) in found.iter().zip([2.0, 4.0, 2.0, 10.0]) {
        close(*value, expected);
    }
    assert!(alarm(&m, "S1200 G95 F0.1\nG1 X10\nM30\n").contains("the spindle stands"));
    assert!(alarm(&m, "M3 G95 F0.1\nG1 X10\nM30\n").contains("no spindle speed"));
    assert!(alarm(&m, "F100\nG95 M3 S100\nG1 X10\nM30\n").contains("no F"));
    // S = 100 m/min at r = 20 mm; LIMS bounds it; G97 keeps it.
    let rpm = 100_000.0 / (2.0 * PI * 20.0);
    let found = moves(&m, "G0 X20\nG96 S100 M3 F0.3\nG1 Z10\nLIMS=500\nZ20\nG97\nZ30\nM30\n");
    let speeds: Vec<f64> = motions(&found)[1..].iter().map(|next| feeds(next)[0] / 0.3 * 60.0).collect();
    for (value, expected) in speeds.iter().zip([rpm, 500.0, 500.0]) {
        close(*value, expected);
    }
    let spindle = found.iter().flat_map(|next| &next.events).find_map(|event| match event {
        Event::SpindleSpeed { speed_rpm } => Some(*speed_rpm),
        _ => None,
    });
    close(spindle.unwrap(), rpm);
    // Facing from r = 40 to r = 10: 32 stretches, each with the speed in its middle.
    let found = moves(&m, "G0 X40\nG96 S100 M3 F0.3\nG1 X10\nM30\n");
    let found = feeds(motions(&found)[1]);
    assert_eq!(found.len(), 32);
    for (i, feed) in found.iter().enumerate() {
        let r = 40.0 - 30.0 * (i as f64 + 0.5) / 32.0;
        close(*feed, 0.3 * 100_000.0 / (2.0 * PI * r) / 60.0);
    }
    // G4 S counts the revolutions of that speed.
    let found = moves(&m, "G0 X20\nG96 S100 M3 F0.3\nG4 S10\nM30\n");
    let time_s =
        found.iter().find_map(|next| if let MoveKind::Dwell { time_s } = next.kind { Some(time_s) } else { None });
    close(time_s.unwrap(), 10.0 / rpm * 60.0);
}

#[test]
fn flin_and_fcub_lead_from_one_f_to_the_next() {
    let m = machine(&[]);
    let found = moves(&m, "F600\nG1 X10\nFLIN\nX20 F1200\nX30\nFCUB X40 F600\nFNORM X50 F1200\nM30\n");
    let found: Vec<Vec<f64>> = motions(&found).iter().map(|next| feeds(next)).collect();
    assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [1, 32, 1, 32, 1]);
    for (i, (linear, cubic)) in found[1].iter().zip(&found[3]).enumerate() {
        let u = (i as f64 + 0.5) / 32.0;
        close(*linear, 10.0 + 10.0 * u);
        close(*cubic, 20.0 - 10.0 * (3.0 * u * u - 2.0 * u * u * u));
    }
    close(found[2][0], 20.0);
    close(found[4][0], 20.0);
}

#[test]
fn a_changing_feed_is_driven_along_the_block() {
    let m = machine(&[]);
    let lasts = |run: &Replay, line: u32| run.rows.iter().filter(|row| row.line == line).count() as f64 * run.t_s;
    // Facing with F of a revolution and a constant cutting speed v: dt = 2 pi r dr / (F v), so t = pi (r0² - r1²) / (F v). Both ramps
    // to and from rest come on top, half their time each: sqrt(f / J).
    let (f_v, r0, r1) = (0.3 * 100_000.0 / 60.0, 40.0, 10.0);
    let feed = |r: f64| f_v / (2.0 * PI * r);
    let run = replay(&m, "SOFT G60\nG0 X40\nG96 S100 M3 F0.3\nG1 X10\nM30\n");
    let expected_s = PI * (r0 * r0 - r1 * r1) / f_v + (feed(r0) / J).sqrt() + (feed(r1) / J).sqrt();
    assert!((lasts(&run, 4) - expected_s).abs() < 0.02, "{} s, expected {expected_s} s", lasts(&run, 4));
    run.within(0, [V, A, J]);
    for row in run.rows.iter().filter(|row| row.line == 4 && (11.0..39.0).contains(&row.q[0])) {
        let ratio = row.velocity[0].abs() / feed(row.q[0]);
        // A stretch has the feed of its middle; it is 30/32 mm long.
        assert!((ratio - 1.0).abs() < 0.6 * 30.0 / 32.0 / row.q[0] + 0.06, "{ratio} at {}", row.q[0]);
    }
    // The end of a linear change: t = L ln(f1/f0) / (f1 - f0); the path does not stop at the borders of the stretches.
    for (words, time_s) in [("G64 FLIN", 100.0 * 2.0_f64.ln() / 10.0), ("G64 FNORM", 100.0 / 20.0)] {
        let run = replay(&m, &format!("SOFT G64\nF600 G1 X10\n{words}\nX110 F1200\nX120\nM30\n"));
        assert!((lasts(&run, 4) - time_s).abs() < 0.02, "{words}: {} s, expected {time_s} s", lasts(&run, 4));
        run.within(0, [V, A, J]);
        assert!(run.rows.iter().filter(|row| row.line == 4).all(|row| row.velocity[0] > 9.9));
    }
    // On an arc too, and where the block is too short for stretches the lowest feed holds.
    let run = replay(&m, "SOFT G64\nF600 G1 X10\nFLIN\nG3 X10 Y40 J20 F1200\nG1 X0\nM30\n");
    assert!((lasts(&run, 4) - 20.0 * PI * 2.0_f64.ln() / 10.0).abs() < 0.03);
    let run = replay(&m, "SOFT G64\nF600 G1 X10\nFLIN\nX10.01 F1200\nX20\nM30\n");
    assert!(run.rows.iter().filter(|row| row.line == 4).all(|row| row.velocity[0] < 10.0 + 1e-9));
}

#[test]
fn pos_takes_its_own_time_and_posa_runs_beside_the_path() {
    let m = machine(&[]);
    let alone_s = rest_to_rest_s(300.0, V, A, J);
    let run = replay(&m, "POS[U]=300\nM30\n");
    run.lasts(alone_s);
    run.within(3, [V, A, J]);
    assert!(run.share("U.positioning") > 0.99);
    replay(&m, "ACC[U]=50 FA[U]=6000\nPOS[U]=300\nM30\n").lasts(rest_to_rest_s(300.0, 100.0, A / 2.0, J));
    replay(&m, "FA[U]=6000 OVRA[U]=50 BRISKA(U)\nPOS[U]=300\nM30\n").lasts(300.0 / 50.0 + 50.0 / A);
    // Beside a slow path: the path alone counts.
    let path_s = 100.0 / 10.0 + 2.0 * (10.0 / J).sqrt();
    let run = replay(&m, "SOFT G60\nPOSA[U]=300\nG1 X100 F600\nM30\n");
    run.lasts(path_s);
    run.within(3, [V, A, J]);
    let arrived = run.rows.iter().position(|row| row.q[3] == 300.0).unwrap();
    assert!((arrived as f64 * run.t_s - alone_s).abs() <= 1.5 * run.t_s);
    // Beside a short path: the end of the program waits; WAITP waits in the middle; so does a path motion of the axis.
    replay(&m, "SOFT G60\nPOSA[U]=300\nG1 X1 F600\nM30\n").lasts(alone_s);
    let x_s = 1.0 / 10.0 + 2.0 * (10.0 / J).sqrt();
    let run = replay(&m, "SOFT G60\nPOSA[U]=300\nWAITP(U)\nG1 X1 F600\nM30\n");
    run.lasts(alone_s + x_s);
    let run = replay(&m, "SOFT G60\nPOSA[U]=300\nG1 X1 F600\nG1 X2 U301\nM30\n");
    run.within(3, [V, A, J]);
    let begins = run.rows.iter().position(|row| row.q[0] > 1.0 + 1e-9).unwrap();
    assert!(begins as f64 * run.t_s >= alone_s - 1e-9);
    // Sent on before it has arrived: one way after the other.
    let run = replay(&m, "POSA[U]=300\nPOSA[U]=0\nM30\n");
    run.lasts(2.0 * alone_s);
    run.within(3, [V, A, J]);
    // In the block of a path motion both begin together, and the block ends with the later one.
    let run = replay(&m, "SOFT G60\nG1 X1 F600 POS[U]=300\nX2\nM30\n");
    run.lasts(alone_s + x_s);
    assert!(alarm(&m, "G1 U10 F100 POS[U]=300\nM30\n").contains("positioned"));
}

#[test]
fn axes_of_a_transformation_cannot_move_on_their_own() {
    let m = sollwert::machine::load("xyzbc", &[]).unwrap().machine;
    for axis in ["X", "B", "C"] {
        assert!(alarm(&m, &format!("POS[{axis}]=10\nM30\n")).contains("transformation"));
    }
}

#[test]
fn random_positioning_beside_a_path_is_continuous_and_within_the_limits() {
    let m = machine(&[]);
    for seed in 0..40 {
        let mut random = Random::new(seed);
        let mut text = String::from("SOFT G60 F6000\n");
        for _ in 0..12 {
            let at = |random: &mut Random, most: f64| (random.between(0.0, most) * 1000.0).round() / 1000.0;
            let (u, x, y) = (at(&mut random, 200.0), at(&mut random, 60.0), at(&mut random, 60.0));
            text += &match random.below(9) {
                0 | 1 => format!("POSA[U]={u}\n"),
                2 => format!("POS[U]={u}\n"),
                3 => format!("G1 X{x} Y{y} POS[U]={u}\n"),
                4 => format!("G1 X{x} Y{y} POSA[U]={u}\n"),
                5 => format!("G1 X{x} U{u}\n"),
                6 => format!("ACC[U]={} VELOLIM[U]={} JERKLIM[U]={}\n", 20.0 + u / 4.0, 30.0 + x, 40.0 + y),
                7 => format!("FA[U]={}\n", 500.0 + 80.0 * u),
                _ => format!("G1 X{x} Y{y}\n"),
            };
        }
        text += "M30\n";
        let run = replay(&m, &text);
        for axis in [0, 1, 3] {
            run.within(axis, [V, A, J]);
        }
        // It ends where it was sent last.
        let moved = moves(&m, &text).last().unwrap().end;
        assert_eq!(run.rows.last().unwrap().q[3], moved.0[AxisId::new(3)], "{text}");
    }
}

#[test]
fn posa_does_not_stop_a_continuous_path() {
    let m = machine(&[]);
    let with = replay(&m, "G64\nG1 X50 F6000\nPOSA[U]=40\nX100\nM30\n");
    let without = replay(&m, "G64\nG1 X50 F6000\nX100\nM30\n");
    assert_eq!(with.rows.len(), without.rows.len());
    for (a, b) in with.rows.iter().zip(&without.rows) {
        assert_eq!(a.q[0], b.q[0]);
    }
    with.within(3, [V, A, J]);
    assert_eq!(with.rows.last().unwrap().q[3], 40.0);
    let before = with.rows.iter().filter(|row| row.q[0] < 49.0).map(|row| row.q[3]).fold(0.0, f64::max);
    assert_eq!(before, 0.0);
}

#[test]
fn rtliof_lets_every_axis_of_a_rapid_take_its_own_time() {
    let m = machine(&[]);
    let run = replay(&m, "G60 RTLIOF\nG0 X300 Y150\nM30\n");
    run.lasts(rest_to_rest_s(300.0, V, A, J));
    let arrived = run.rows.iter().position(|row| row.q[1] == 150.0).unwrap() as f64 * run.t_s;
    assert!((arrived - rest_to_rest_s(150.0, V, A, J)).abs() <= 1.5 * run.t_s);
    (0..2).for_each(|axis| run.within(axis, [V, A, J]));
    // Not under G64: a straight line.
    let run = replay(&m, "G64 RTLIOF\nG0 X300 Y150\nM30\n");
    assert!(run.rows.iter().all(|row| (row.q[0] - 2.0 * row.q[1]).abs() < 1e-9));
}

#[test]
fn the_main_run_tells_when_the_path_rests() {
    let m = machine(&[]);
    // The wait lasts as long as everything before it, to the set-point.
    let first_s = 100.0 / 10.0 + 2.0 * (10.0 / J).sqrt();
    let text = "SOFT G64\nG1 X100 F600\nR1=$AC_CYCLE_TIME\nG4 F=R1\nG1 X101\nM30\n";
    let run = replay(&m, text);
    let rounded_s = (first_s / run.t_s).ceil() * run.t_s;
    run.lasts(first_s + rounded_s + 1.0 / 10.0 + 2.0 * (10.0 / J).sqrt());
    let rests = run.rows.iter().filter(|row| row.q[0] == 100.0 && row.velocity[0] == 0.0).count();
    assert!(rests as f64 * run.t_s > rounded_s - 2.0 * run.t_s);
    // Looking ahead over STOPRE is not possible: the path rests there.
    let run = replay(&m, "G64\nG1 X50 F6000\nSTOPRE\nX100\nM30\n");
    assert!(run.rows.iter().any(|row| (row.q[0] - 50.0).abs() < 1e-3 && row.velocity[0] < 1.0));
}
