//! The error budget: chords, blends and drives against closed forms, in programs with sub-programs, zero offsets, tools and turning tables.

use crate::command::sollwert;
use crate::made::{signal, trace};
use serde_json::Value;
use sollwert::base::AxisKind;
use sollwert::compare::{BudgetGround, budget, machine_of};
use sollwert::recorder::schema::proto::sollwert::Programmed;
use sollwert::trace::{ProgrammedPath, TimeGrid, Trace};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A trace whose set-points pass through `points` at 1 s each, with straight lines of 100 samples between, under a program of straight blocks
/// through `programmed`, a block a second.
fn recorded(programmed: &[[f64; 2]], points: &[[f64; 2]]) -> Trace {
    let n = 100 * (points.len() - 1) + 1;
    let times = TimeGrid::Uniform { start_ns: 0.0, step_ns: 1e7, count: n };
    let at = |t: f64, axis: usize| {
        let i = (t.floor() as usize).min(points.len() - 2);
        points[i][axis] + (t - i as f64) * (points[i + 1][axis] - points[i][axis])
    };
    let mut made = trace(vec![
        signal("X.position_setpoint_mm", "mm", &times, |t| at(t, 0)),
        signal("Y.position_setpoint_mm", "mm", &times, |t| at(t, 1)),
    ]);
    let machine = include_str!("../../machines/spinner_mvc850.toml");
    made.machine = Some(("spinner_mvc850.toml".into(), machine.into()));
    made.programmed = ProgrammedPath::new(["X", "Y"].map(|name| (name.to_owned(), AxisKind::Linear)).into());
    for (i, pair) in programmed.windows(2).enumerate() {
        let message = Programmed {
            program: Some("part.mpf".to_owned()),
            block: Some(i as u64 + 1),
            line: Some(i as u32 + 1),
            motion: Some("line".to_owned()),
            points: pair.concat(),
            tool_length_mm: Vec::new(),
        };
        made.programmed.push(i as f64, &message);
    }
    made
}

fn of(made: &Trace) -> sollwert::compare::Budget {
    budget(made, &BudgetGround { machine: machine_of(made).as_ref(), ..BudgetGround::default() })
}

#[test]
fn chords_of_a_circle_are_off_by_their_sagitta() {
    let radius_mm = 50.0;
    let count = 60;
    let mut points = vec![[0.0, 0.0], [radius_mm, 0.0]];
    for k in 1..=count {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(count);
        points.push([radius_mm * angle.cos(), radius_mm * angle.sin()]);
    }
    let found = of(&recorded(&points, &points));
    assert!(found.missing.is_empty(), "{:?}", found.missing);
    let chord = found.chord.expect("chords");
    // R (1 - cos(pi / n)).
    let sagitta_um = 1000.0 * radius_mm * (1.0 - (std::f64::consts::PI / f64::from(count)).cos());
    assert!((chord.figures.max - sagitta_um).abs() < 0.01 * sagitta_um, "{} {sagitta_um}", chord.figures.max);
    // The first block leads to the circle: it is straight, and its corner is meant.
    assert!((chord.figures.bias - sagitta_um * f64::from(count) / f64::from(count + 1)).abs() < 0.01 * sagitta_um);
    // The set-points are the program.
    assert!(found.interpolator.expect("set-points").figures.max < 1e-3);
}

#[test]
fn a_cut_corner_is_an_error_of_the_interpolator_in_its_line() {
    let program = [[0.0, 0.0], [20.0, 0.0], [20.0, 10.0], [20.0, 20.0]];
    let found = of(&recorded(&program, &[[0.0, 0.0], [19.9, 0.0], [20.0, 0.1], [20.0, 20.0]]));
    // Middle of a chamfer of 0.1 by 0.1: 0.05 from either leg.
    let interpolator = found.interpolator.expect("set-points");
    assert!((interpolator.figures.max - 50.0).abs() < 0.5, "{:?}", interpolator.figures);
    assert_eq!(found.chord.expect("blocks").figures.max, 0.0);
}

/// A pass beside the one that is executed does not hide its error: only the blocks around it count.
#[test]
fn a_neighbouring_pass_does_not_hide_an_error() {
    // Forth, and back 0.2 mm beside; the set-points of the way back run on the way forth.
    let program = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [20.0, 5.0], [20.0, 0.2], [0.0, 0.2]];
    let driven = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [20.0, 5.0], [20.0, 0.0], [0.0, 0.0]];
    let interpolator = of(&recorded(&program, &driven)).interpolator.expect("set-points");
    assert!((interpolator.figures.max - 200.0).abs() < 1e-6, "{:?}", interpolator.figures);
    let on_the_way_back = |place: &((std::sync::Arc<str>, u32), f64)| place.0.1 == 5 && (place.1 - 200.0).abs() < 1e-6;
    assert!(interpolator.worst.iter().any(on_the_way_back), "{:?}", interpolator.worst);
}

#[test]
fn a_file_without_a_program_is_said() {
    let made = recorded(&[[0.0, 0.0]], &[[0.0, 0.0], [20.0, 0.0]]);
    let found = of(&made);
    assert!(found.interpolator.is_none() && found.chord.is_none() && found.missing.len() == 1, "{:?}", found.missing);
    let without = trace(made.signals.clone());
    assert!(of(&without).missing[0].message.contains("machine file"));
}

fn folder(name: &str, files: &[(&str, String)]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    folder
}

fn run(folder: &Path, arguments: &[&str]) -> Value {
    let (code, text, errors) = sollwert(folder, arguments);
    assert_eq!(code, Some(0), "{errors}");
    serde_json::from_str(&text).expect("JSON")
}

/// Budget of the recording `run.mcap`, held against itself.
fn budget_of(folder: &Path) -> Value {
    let document = run(folder, &["compare", "run.mcap", "run.mcap", "--budget", "--json"]);
    let found = document["sides"][0]["budget"].clone();
    assert_eq!(found["missing"], Value::Array(Vec::new()), "{found}");
    found
}

const TOOLS: &str = "format = 1\n[[tools]]\nnumber = 1\nname = \"T1\"\n[[tools.edges]]\nlength_mm = 80.0\nradius_mm = 5.0\n\
                     [frames.G54]\ntranslation = { X_mm = 12.0, Y_mm = -7.0, Z_mm = 30.0 }\n";

#[test]
fn sub_programs_tools_zero_offsets_and_fillets_are_part_of_the_program() {
    let mut circle = String::from("G1 X20 Y0\n");
    for k in 1..=90 {
        let angle = std::f64::consts::TAU * f64::from(k) / 90.0;
        let _ = writeln!(circle, "G1 X{:.9} Y{:.9}", 20.0 * angle.cos(), 20.0 * angle.sin());
    }
    circle += "M17\n";
    let main = "N10 T1 D1 M6\nN20 G54 G64 G0 X20 Y0 Z5\nN30 G1 F1200 Z0\nN40 CIRCLE\nN50 G1 X40 RND=5\nN60 Y30\nN70 G642 CTOL=0.03\n\
                N80 X10\nN90 Y60\nN100 G1 X0 G60\nN110 M30\n";
    let folder =
        folder("budget_whole", &[("a.mpf", main.into()), ("CIRCLE.spf", circle), ("tools.toml", TOOLS.into())]);
    let summary =
        run(&folder, &["run", "a.mpf", "-m", "spinner_mvc850", "-t", "tools.toml", "-o", "run.mcap", "--json"]);
    let found = budget_of(&folder);
    // The polygon stands in the sub-program: R (1 - cos(pi / n)).
    let sagitta_um = 20e3 * (1.0 - (std::f64::consts::PI / 90.0).cos());
    let chord = &found["chord"];
    assert!((chord["max_um"].as_f64().unwrap() - sagitta_um).abs() < 0.01 * sagitta_um, "{chord} {sagitta_um}");
    assert_eq!(chord["worst"][0]["program"], "CIRCLE.spf", "{chord}");
    // Of the programmed contour only the blends depart, by their tolerance: a fillet is programmed, G64 does not round.
    let tolerances =
        summary["corners"].as_array().unwrap().iter().map(|corner| corner["tolerance_mm"].as_f64().unwrap());
    // The blend of a right angle passes its corner at the tolerance along the bisector: by 1 / sqrt 2 of it off either leg.
    let tolerance_um = 1000.0 * tolerances.fold(0.0, f64::max) / 2.0_f64.sqrt();
    let interpolator = &found["interpolator"];
    let max_um = interpolator["max_um"].as_f64().unwrap();
    assert!(max_um <= 1.001 * tolerance_um && max_um > 0.95 * tolerance_um, "{max_um} {tolerance_um}");
    let blended = |place: &Value| place["line"].as_u64().is_some_and(|line| (7..=10).contains(&line));
    for place in interpolator["worst"].as_array().unwrap() {
        assert!(blended(place) || place["error_um"].as_f64().unwrap() < 0.1, "{place}");
    }
    // The drives are the contour error that `compare` has anyway.
    assert!(found["drives"]["max_um"].as_f64().unwrap() > 0.1);
}

#[test]
fn a_turning_table_with_a_tool_is_judged_at_the_tip_in_the_part() {
    // Exact stops: the axes run straight from end to end, and the tip does not leave the programmed path in the part.
    let program =
        "N10 T1 D1 M6\nN20 G60 G0 X30 Y0 Z0 C0\nN30 G1 F2000 X40 C30\nN40 Y10 A10 C60\nN50 X20 Z5 A0\nN60 M30\n";
    let tools = TOOLS.split("[frames").next().unwrap().to_owned();
    let folder = folder("budget_turned", &[("a.mpf", program.into()), ("tools.toml", tools)]);
    let call = ["run", "a.mpf", "-m", "mikron_ucp710", "-t", "tools.toml", "-o", "run.mcap", "--json"];
    run(&folder, &call);
    let interpolator = budget_of(&folder)["interpolator"].clone();
    assert!(interpolator["max_um"].as_f64().unwrap() < 0.2, "{interpolator}");
    // Rounded corners leave it: by X, Y, Z and by the turned table.
    std::fs::write(folder.join("a.mpf"), program.replace("G60", "G642 CTOL=0.05")).unwrap();
    run(&folder, &call);
    let interpolator = budget_of(&folder)["interpolator"].clone();
    assert!(interpolator["max_um"].as_f64().unwrap() > 10.0, "{interpolator}");
    assert!(interpolator["worst"][0]["line"].as_u64().is_some_and(|line| (3..=5).contains(&line)), "{interpolator}");
}

/// The set-points of a control are held against the program of the recording that they are compared with.
#[test]
fn set_points_of_a_control_are_held_against_the_program_of_the_recording() {
    let program = "N10 G642 CTOL=0.03 G1 X20 F2000\nN20 Y20\nN30 X0\nN40 M30\n";
    let folder = folder("budget_control", &[("a.mpf", program.into())]);
    run(&folder, &["run", "a.mpf", "-m", "spinner_mvc850", "-o", "run.mcap", "--json"]);
    run(&folder, &["export", "run.mcap", "-m", "spinner_mvc850", "-o", "control.xml", "--json"]);
    let document = run(&folder, &["compare", "control.xml", "run.mcap", "--budget", "--json"]);
    let [control, own] = [0, 1].map(|side| document["sides"][side]["budget"].clone());
    assert!(control["program_of_other"] == true && own["program_of_other"] == false, "{document}");
    let max_um = |found: &Value| found["interpolator"]["max_um"].as_f64().unwrap();
    // The XML has six decimals.
    assert!((max_um(&control) - max_um(&own)).abs() < 0.01 && max_um(&own) > 10.0, "{control} {own}");
    assert_eq!(control["interpolator"]["worst"][0]["line"], own["interpolator"]["worst"][0]["line"]);
}
