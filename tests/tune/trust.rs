//! How far tuned gains can be trusted: brute force over gains and delay, intervals, another plant made by another program, noise, friction
//! compensation, rotary axes, and how many simulations all that takes.

use super::*;
use sollwert::machine::load;

/// Deviation of one axis alone, with gains, through the drive: an own loop, not that of the library.
fn alone_lu(loaded: &Loaded, name: &str, positions: &[f64], change: impl Fn(&mut Axis)) -> Vec<f64> {
    let machine = &loaded.machine;
    let mut axis = machine.axis(machine.axis_by_name(name).unwrap()).clone();
    change(&mut axis);
    let mut drive = AxisDrive::new(&axis, &machine.cycle.time_base, Start::Held, positions[0]).unwrap();
    let input =
        |position: &f64| DriveInput { position_setpoint_lu: *position, load_n_m: 0.0, feedforward_active: true };
    positions.iter().map(|position| drive.step(input(position)).control_deviation_lu).collect()
}

#[test]
fn no_point_of_a_grid_of_gains_and_delay_is_better() {
    let loaded = machine(&[]);
    let text = "SOFT\nG1 X12 F8000\nX-3 F4000\nX0\nM30\n";
    let found = tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &TuneOptions::default());
    let reached_mm = found.courses[0].axes[0].deviation[1].rms;
    let x = loaded.machine.axis_by_name("X").unwrap();
    let positions = setpoints(&loaded, text, x);
    let mut best = (f64::INFINITY, [0.0; 3]);
    for velocity in [0.94, 0.97, 0.99, 1.0, 1.01, 1.03, 1.06] {
        for torque in [0.0, 0.4, 0.7, 0.9, 1.0, 1.1, 1.3, 1.7] {
            for delay_ms in [0.0, 0.3, 0.6, 0.8, 0.9, 1.0, 1.1, 1.2, 1.5, 2.0, 3.0] {
                let gains = [velocity, torque, delay_ms];
                let errors = alone_lu(&loaded, "X", &positions, |axis| {
                    let data = axis.drive.as_mut().unwrap();
                    data.velocity_feedforward_ratio = velocity;
                    data.torque_feedforward_ratio = torque;
                    data.setpoint_delay_s = s_from_ms(delay_ms);
                });
                if rms(&errors) < best.0 {
                    best = (rms(&errors), gains);
                }
            }
        }
    }
    assert!(reached_mm <= 1.01 * best.0, "{reached_mm} mm, the best of the grid {best:?}");
}

#[test]
fn axes_that_interpolate_together_share_their_delay_whatever_the_objective() {
    let loaded = machine(&[]);
    let text = "G17 G71 G90 G642 CTOL=0.02 SOFT\nG1 X10 Y5 F6000\nG2 X10 Y5 I8 J0\nG1 X0 Y0 F3000\nM30\n";
    for objective in [Objective::Deviation, Objective::Following, Objective::Contour] {
        let options = TuneOptions { objective, ..TuneOptions::default() };
        let found = tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &options);
        assert_eq!(gain(&found, "X", Gain::Delay), gain(&found, "Y", Gain::Delay), "{objective:?}");
        assert_eq!(found.axes[0].together, ["X", "Y"], "{objective:?}");
        let [before, after, _] = found.courses[0].objective;
        assert!(after.rms <= before.rms, "{objective:?}: {after:?}, before {before:?}");
    }
}

#[test]
fn two_axes_on_three_programs_take_few_simulations() {
    let loaded = machine(&[]);
    for (objective, most) in [(Objective::Deviation, 36), (Objective::Following, 36), (Objective::Contour, 36)] {
        let courses = (1..4).map(|seed| course(&loaded, "t.mpf", &random_program(seed), false)).collect();
        let found = tuned(&loaded, courses, &TuneOptions { objective, ..TuneOptions::default() });
        let of_one = found.simulations / 6;
        println!("{objective:?}: {} simulations, {of_one} of an axis on a program", found.simulations);
        assert!(of_one <= most, "{objective:?}: {of_one} simulations of an axis on a program");
    }
}

#[test]
fn friction_compensation_makes_quadrants_small() {
    // Circles: the velocity of each axis reverses twice a turn.
    let loaded = machine(&["axes.Y.mechanics.coulomb_friction_n_m=1.6", "axes.Y.mechanics.breakaway_friction_n_m=1.6"]);
    let text = "G17 G64\nG2 X0 Y0 I12 J0 F2000\nG2 X0 Y0 I12 J0\nM30\n";
    let with = |gains: &[Gain]| {
        let options = TuneOptions { gains: gains.to_vec(), ..TuneOptions::default() };
        tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &options)
    };
    let of_y = |found: &Tuned| found.courses[0].axes.iter().find(|axis| axis.name == "Y").unwrap().deviation;
    let amplitude = with(&[Gain::Friction]);
    let both = with(&[Gain::Friction, Gain::FrictionTime]);
    let [before, after, _] = of_y(&amplitude);
    // The largest deviation is that of the start, which no pulse at a reversal makes smaller.
    assert!(after.rms < 0.8 * before.rms && after.peak <= before.peak, "{after:?}, before {before:?}");
    let [_, best, _] = of_y(&both);
    assert!(best.rms <= after.rms * 1.001, "with its time {best:?}, without {after:?}");
    let pulse_mm_s = gain(&amplitude, "Y", Gain::Friction);
    assert!(pulse_mm_s > 0.0);

    // No amplitude of a scan through the drive alone is better, and no pair of amplitude and time.
    let positions = setpoints(&loaded, text, loaded.machine.axis_by_name("Y").unwrap());
    let scan = |time_ms: f64| {
        (0..24).map(move |step| (0.25 * f64::from(step) * pulse_mm_s / 4.0, time_ms)).map(|(pulse_mm_s, time_ms)| {
            rms(&alone_lu(&loaded, "Y", &positions, |axis| {
                let options = &mut axis.drive.as_mut().unwrap().options;
                options.friction_pulse_lu_s = pulse_mm_s;
                options.friction_pulse_time_s = s_from_ms(time_ms);
            }))
        })
    };
    let best_mm = scan(10.0).fold(f64::INFINITY, f64::min);
    assert!(after.rms <= 1.02 * best_mm, "{} mm, scan {best_mm} mm", after.rms);
    let best_mm = [3.0, 5.0, 10.0, 15.0, 20.0, 30.0].into_iter().flat_map(scan).fold(f64::INFINITY, f64::min);
    assert!(best.rms <= 1.05 * best_mm, "{} mm, scan {best_mm} mm", best.rms);

    // Both go to the control, in its units.
    let text = machine_text(&loaded, &both).unwrap();
    let data = machine_data(&text, "t.toml", &both).unwrap();
    assert!(data.contains("N32500 $MA_FRICT_COMP_ENABLE[AX2]=1"), "{data}");
    let value = |start: &str| -> f64 {
        data.lines()
            .find_map(|line| line.strip_prefix(start))
            .unwrap_or_else(|| panic!("{start}\n{data}"))
            .parse()
            .unwrap()
    };
    let pulse_mm_min = value("N32520 $MA_FRICT_COMP_CONST_MAX[0,AX2]=");
    assert!((pulse_mm_min - 60.0 * gain(&both, "Y", Gain::Friction)).abs() < 1e-6, "{data}");
    let time_s = value("N32540 $MA_FRICT_COMP_TIME[0,AX2]=");
    assert!((time_s - 1e-3 * gain(&both, "Y", Gain::FrictionTime)).abs() < 1e-9, "{data}");
}

#[test]
fn without_friction_there_is_nothing_to_compensate() {
    let sets = ["axes.X.mechanics.coulomb_friction_n_m=0", "axes.X.mechanics.breakaway_friction_n_m=0"];
    let loaded = machine(&sets);
    let text = "G1 X12 F8000\nX0\nM30\n";
    let gains = Gain::ALL.to_vec();
    let found =
        tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &TuneOptions { gains, ..TuneOptions::default() });
    let free: Vec<Gain> = found.axes[0].gains.iter().map(|gain| gain.gain).collect();
    assert!(!free.contains(&Gain::Friction), "{free:?}");
    let [before, after, _] = found.courses[0].objective;
    assert!(after.rms < 0.3 * before.rms, "{after:?}, before {before:?}");
}

/// Repetitions: 200 are seen with TUNE_REPETITIONS=200; every run has fewer.
fn asked() -> Option<u64> {
    std::env::var("TUNE_REPETITIONS").ok().and_then(|text| text.parse().ok())
}

/// Velocity, torque and delay (ms) of X for the deviation over 48 programs of 3 s: what a run with TUNE_REPETITIONS finds again.
const OF_48_PROGRAMS: [f64; 3] = [1.0001, 1.0140, 1.005];

/// How often the intervals of velocity, torque and delay hold what many programs say, of those gains that are called certain.
fn held(options: &TuneOptions, axes: &[&str], repetitions: u64, many: Option<u64>) -> [(u64, u64); 3] {
    let loaded = machine(&[]);
    // Three random programs in one: some 3 s.
    let long = |seed: u64| {
        let text: String = (0..3).map(|part| random_program(3 * seed + part).replace("M30\n", "")).collect();
        course(&loaded, "t.mpf", &(text + "M30\n"), false)
    };
    // None of these is one of the repetitions.
    let truth = many.map(|many| tuned(&loaded, (1000..1000 + many).map(long).collect(), options));
    let mut counts = [(0, 0); 3];
    for seed in 0..repetitions {
        let found = tuned(&loaded, vec![long(seed)], options);
        for (axis, (place, kind)) in axes.iter().flat_map(|axis| {
            [Gain::Velocity, Gain::Torque, Gain::Delay].into_iter().enumerate().map(move |gain| (axis, gain))
        }) {
            let of_axis = found.axes.iter().find(|found| found.name == *axis).unwrap();
            let one = of_axis.gains.iter().find(|one| one.gain == kind).unwrap();
            // What the others say is written with so many digits.
            let wanted = truth.as_ref().map_or(OF_48_PROGRAMS[place], |truth| gain(truth, axis, kind));
            let half = if kind == Gain::Delay { 0.5e-3 } else { 0.5e-4 };
            if std::env::var("VERBOSE").is_ok() {
                println!(
                    "  {seed} {axis} {kind:?}: {:.5} [{:.5}, {:.5}], many say {wanted:.5}",
                    one.value, one.low, one.high
                );
            }
            counts[place].0 += u64::from(one.certain);
            counts[place].1 += u64::from(one.certain && (one.low - half..=one.high + half).contains(&wanted));
        }
    }
    println!("{:?}: velocity, torque, delay (certain, held) {counts:?} of {repetitions}", options.objective);
    counts
}

/// Every one is at least 95 % less three standard errors of the repetitions.
fn enough(counts: [(u64, u64); 3]) {
    for (certain, held) in counts {
        let of = certain as f64;
        let least = 0.95 - 3.0 * (0.95 * 0.05 / of).sqrt();
        assert!(held as f64 >= least * of, "{counts:?}, at least {least}");
    }
}

#[test]
fn intervals_contain_what_many_programs_say() {
    let options = TuneOptions { axes: vec!["X".to_owned()], ..TuneOptions::default() };
    let repetitions = asked().unwrap_or(24);
    let counts = held(&options, &["X"], repetitions, asked().map(|_| 48));
    assert!(counts.iter().all(|(certain, _)| *certain == repetitions), "{counts:?}");
    enough(counts);
    let mean = counts.iter().map(|(certain, held)| *held as f64 / *certain as f64).sum::<f64>() / 3.0;
    assert!((0.90..=0.99).contains(&mean), "{counts:?}");
}

/// The common delay of two axes stands twice: both say the same. Nightly only.
#[test]
fn intervals_of_a_tuning_for_the_contour_contain_what_many_programs_say() {
    let Some(repetitions) = asked().map(|asked| asked.div_ceil(2)) else { return };
    let options = TuneOptions { objective: Objective::Contour, ..TuneOptions::default() };
    let counts = held(&options, &["X", "Y"], repetitions, Some(24));
    assert!(counts.iter().all(|(certain, _)| *certain > repetitions / 4), "{counts:?}");
    enough(counts);
}

#[test]
fn noise_and_the_quantum_of_the_scale_change_little() {
    let loaded = machine(&[]);
    let text = "SOFT\nG1 X40 F9000\nX0\nX25 F4000\nX-5\nX0 F12000\nM30\n";
    let x = loaded.machine.axis_by_name("X").unwrap();
    let positions = setpoints(&loaded, text, x);
    let errors_mm = alone_lu(&loaded, "X", &positions, |_| {});
    let mut random = Random::new(11);
    // 1 µm of the scale, and as much noise.
    let noisy: Vec<f64> =
        errors_mm.iter().map(|error| ((error + random.between(-1e-3, 1e-3)) * 1e3).round() * 1e-3).collect();
    let trace = |errors: Vec<f64>| Trace {
        name: "measured.mcap".to_owned(),
        signals: vec![
            signal("X.position_setpoint_mm", positions.clone(), 1e-3),
            signal("X.control_deviation_mm", errors, 1e-3),
        ],
        ..Trace::default()
    };
    let by = |errors: Vec<f64>| {
        let course = course_of_trace(&trace(errors), &loaded.machine, false).unwrap();
        tuned(&loaded, vec![course], &TuneOptions::default())
    };
    let (clean, noisy) = (by(errors_mm), by(noisy));
    for (kind, room) in [(Gain::Velocity, 0.001), (Gain::Torque, 0.02), (Gain::Delay, 0.03)] {
        let (one, other) = (gain(&clean, "X", kind), gain(&noisy, "X", kind));
        assert!((one - other).abs() <= room, "{kind:?}: {one} without noise, {other} with it");
    }
}

#[test]
fn rotary_axes_are_tuned_in_degrees_and_share_the_delay_of_the_tool() {
    let sets = ["axes.A.drive.velocity_feedforward=0.97".to_owned()];
    let loaded = load("mikron_ucp710", &sets).unwrap();
    let text = "G1 X20 A10 F3000\nX0 A-5\nA5 X10\nX0 A0\nM30\n";
    let found = tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &TuneOptions::default());
    assert_eq!(gain(&found, "X", Gain::Delay), gain(&found, "A", Gain::Delay));
    let velocity = gain(&found, "A", Gain::Velocity);
    assert!((velocity - 1.0).abs() < 0.01, "{velocity}");
    let a = found.courses[0].axes.iter().find(|axis| axis.name == "A").unwrap();
    assert_eq!(a.unit, "deg");
    assert!(a.deviation[1].rms < 0.7 * a.deviation[0].rms, "{:?}", a.deviation);
    // A program of A alone: degrees throughout.
    let text = "G1 A10 F1000\nA-5\nA0\nM30\n";
    let found = tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &TuneOptions::default());
    assert_eq!(found.courses[0].unit, "deg");
    let ratio = found.courses[0].objective[1].rms
        / found.courses[0].axes.iter().find(|axis| axis.moves).unwrap().deviation[1].rms;
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio}");
}

/// Set-points and deviations of tools/tune_reference.py.
const OTHER: &str = include_str!("other_plant.csv");
/// RMS of the deviation of that plant on a grid of gains.
const OTHER_GAINS: &str = include_str!("other_plant_gains.csv");

fn numbers(text: &str, program: &str) -> Vec<Vec<f64>> {
    let rows = text.lines().filter_map(|line| line.strip_prefix(program)?.strip_prefix(','));
    rows.map(|row| row.split(',').map(|cell| cell.parse().unwrap()).collect()).collect()
}

/// The polynomial through three points.
fn through(at: f64, nodes: [f64; 3], values: [f64; 3]) -> f64 {
    (0..3)
        .map(|i| {
            let others = (0..3).filter(|j| *j != i);
            values[i] * others.map(|j| (at - nodes[j]) / (nodes[i] - nodes[j])).product::<f64>()
        })
        .sum()
}

/// RMS of the plant with any gains: its mean square is a polynomial of second degree in each of them, the delay within one cycle.
fn rms_of_other_mm(program: &str, gains: [f64; 3]) -> f64 {
    let grid = numbers(OTHER_GAINS, program);
    let square = |velocity: f64, torque: f64, delay_ms: f64| {
        let row = grid.iter().find(|row| row[..3] == [velocity, torque, delay_ms]).unwrap();
        row[3] * row[3]
    };
    let delays = if gains[2] < 1.0 { [0.4, 0.7, 1.0] } else { [1.0, 1.3, 1.6] };
    let (velocities, torques) = ([0.985, 1.0, 1.015], [0.0, 0.75, 1.5]);
    let of_velocity = velocities.map(|velocity| {
        let of_torque =
            torques.map(|torque| through(gains[2], delays, delays.map(|delay_ms| square(velocity, torque, delay_ms))));
        through(gains[1], torques, of_torque)
    });
    through(gains[0], velocities, of_velocity).max(0.0).sqrt()
}

#[test]
fn on_a_plant_of_another_program_with_stribeck_friction_tuning_still_helps() {
    let loaded = machine(&["axes.X.drive.torque_feedforward=0", "axes.X.drive.setpoint_delay_ms=1.2"]);
    let rows = numbers(OTHER, "seen");
    let column = |place: usize| rows.iter().map(|row| row[place]).collect::<Vec<f64>>();
    let trace = Trace {
        name: "measured.csv".to_owned(),
        signals: vec![
            signal("X.position_setpoint_mm", column(0), 1e-3),
            signal("X.control_deviation_mm", column(1), 1e-3),
        ],
        ..Trace::default()
    };
    let course = course_of_trace(&trace, &loaded.machine, false).unwrap();
    let found = tuned(&loaded, vec![course], &TuneOptions::default());
    let gains = [Gain::Velocity, Gain::Torque, Gain::Delay].map(|kind| gain(&found, "X", kind));
    for program in ["seen", "unseen"] {
        let before_mm = rms(&numbers(OTHER, program).iter().map(|row| row[1]).collect::<Vec<_>>());
        let read_off_mm = rms_of_other_mm(program, [1.0, 0.0, 1.2]);
        assert!(
            (read_off_mm / before_mm - 1.0).abs() < 0.05,
            "{program}: the grid says {read_off_mm}, the run {before_mm}"
        );
        let after_mm = rms_of_other_mm(program, gains);
        let best_mm = numbers(OTHER_GAINS, program).iter().map(|row| row[3]).fold(f64::INFINITY, f64::min);
        println!("{program}: before {before_mm}, after {after_mm}, best of the grid {best_mm}, gains {gains:?}");
        assert!(after_mm < 0.8 * before_mm, "{program}: {after_mm} mm after, {before_mm} mm before, gains {gains:?}");
        assert!(after_mm < 1.15 * best_mm, "{program}: {after_mm} mm, the grid {best_mm} mm, gains {gains:?}");
    }
    // What the model foresees is not far from what the plant does.
    let foreseen_mm = found.courses[0].axes[0].deviation[1].rms;
    assert!((foreseen_mm / rms_of_other_mm("seen", gains) - 1.0).abs() < 0.5, "{foreseen_mm}");
}

#[test]
fn sensitivity_and_floor_are_those_of_a_drive_with_other_mechanics() {
    let loaded = machine(&[]);
    let text = "SOFT\nG1 X12 F8000\nX-3 F4000\nX0\nM30\n";
    let found = tuned(&loaded, vec![course(&loaded, "t.mpf", text, false)], &TuneOptions::default());
    let positions = setpoints(&loaded, text, loaded.machine.axis_by_name("X").unwrap());
    let tuned_gains = [Gain::Velocity, Gain::Torque, Gain::Delay].map(|kind| gain(&found, "X", kind));
    let with = |change: &dyn Fn(&mut sollwert::machine::DriveData)| {
        rms(&alone_lu(&loaded, "X", &positions, |axis| {
            let data = axis.drive.as_mut().unwrap();
            data.velocity_feedforward_ratio = tuned_gains[0];
            data.torque_feedforward_ratio = tuned_gains[1];
            data.setpoint_delay_s = s_from_ms(tuned_gains[2]);
            change(data);
        }))
    };
    let said = |what: &str, percent: f64| {
        let one = found.sensitivities.iter().find(|one| one.what == what && one.change_percent == percent).unwrap();
        one.objective[1].rms
    };
    assert_eq!(found.sensitivities.len(), 4, "inertia and friction of the one axis that moves, up and down");
    for percent in [-10.0, 10.0] {
        let ratio = 1.0 + 0.01 * percent;
        let inertia_mm = with(&|data| data.mechanics.inertia_kg_m2 *= ratio);
        let friction_mm = with(&|data| {
            data.mechanics.coulomb_friction_n_m *= ratio;
            data.mechanics.breakaway_friction_n_m *= ratio;
            data.mechanics.viscous_friction_n_m_s_per_rad *= ratio;
        });
        for (what, own_mm) in [("inertia", inertia_mm), ("friction", friction_mm)] {
            assert!(
                (said(what, percent) / own_mm - 1.0).abs() < 1e-6,
                "{what} {percent}: {} and {own_mm}",
                said(what, percent)
            );
        }
    }
    let floor_mm = with(&|data| {
        data.mechanics.coulomb_friction_n_m = 0.0;
        data.mechanics.breakaway_friction_n_m = 0.0;
    });
    let of_x = found.courses[0].objective;
    assert!((of_x[2].rms / floor_mm - 1.0).abs() < 1e-6 && floor_mm < of_x[1].rms, "{of_x:?}, {floor_mm}");
}

#[test]
fn a_course_on_which_an_axis_does_not_move_says_nothing_of_it() {
    let loaded = machine(&[]);
    let found =
        tuned(&loaded, vec![course(&loaded, "t.mpf", "G1 X12 F8000\nX0\nM30\n", false)], &TuneOptions::default());
    let names: Vec<&str> = found.axes.iter().map(|axis| axis.name.as_str()).collect();
    assert_eq!(names, ["X"]);
    // The machine file keeps what it said of the others.
    let text = machine_text(&loaded, &found).unwrap();
    let of = |text: &str, axis: &str| -> Vec<String> {
        let start = text.find(&format!("[axes.{axis}.drive]")).unwrap();
        text[start..].lines().skip(1).take_while(|line| !line.starts_with('[')).map(str::to_owned).collect()
    };
    for axis in ["Y", "Z"] {
        assert_eq!(of(&text, axis), of(&loaded.text_as_used, axis), "{axis}");
    }
    assert_ne!(of(&text, "X"), of(&loaded.text_as_used, "X"));
}

#[test]
fn what_is_not_used_or_recorded_too_slowly_is_said() {
    let loaded = machine(&[]);
    let codes = |course: Course| {
        let found = tuned(&loaded, vec![course], &TuneOptions::default());
        found.warnings.iter().map(|warning| warning.code).collect::<Vec<_>>()
    };
    let short = course(&loaded, "t.mpf", "G1 X5 F2000\nX0\nM30\n", false);
    assert!(!codes(short).contains(&"U0005"));
    let long = course(&loaded, "t.mpf", "G1 X5 F2000\nX0\nG4 F125\nG1 X3\nM30\n", false);
    assert!((long.duration_s - 120.0).abs() < 0.1, "{} s", long.duration_s);
    assert!(long.warnings.iter().any(|warning| warning.code == "U0005"));

    let x = loaded.machine.axis_by_name("X").unwrap();
    let positions = setpoints(&loaded, "SOFT\nG1 X12 F8000\nX0\nM30\n", x);
    let errors = alone_lu(&loaded, "X", &positions, |_| {});
    let every = |steps: usize| {
        let thin = |values: &[f64]| values.iter().step_by(steps).copied().collect::<Vec<f64>>();
        let trace = Trace {
            name: "measured.csv".to_owned(),
            signals: vec![
                signal("X.position_setpoint_mm", thin(&positions), 1e-3 * steps as f64),
                signal("X.control_deviation_mm", thin(&errors), 1e-3 * steps as f64),
            ],
            ..Trace::default()
        };
        codes(course_of_trace(&trace, &loaded.machine, false).unwrap())
    };
    assert!(!every(1).contains(&"U0006") && every(4).contains(&"U0006"));
}
