//! The shipped programs, and the constructs of a real CAM program.
//!
//! `programs/*.moves` are golden: after a wanted change run with `SOLLWERT_BLESS=1` and read the difference.

use crate::nc_machine::{Run, run_bytes, xyz, xyzbc};
use sollwert::base::{AxisId, Severity};
use sollwert::interpreter::{Event, MoveKind, check};
use sollwert::machine::PathMode;
use sollwert::program::ProgramSource;
use std::path::PathBuf;

const X: AxisId = AxisId::new(0);
const Y: AxisId = AxisId::new(1);

fn folder() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/programs"))
}

fn shipped(name: &str) -> Run {
    let bytes = std::fs::read(folder().join(name)).unwrap();
    let result = run_bytes(&bytes, &xyz());
    assert!(result.alarm.is_none(), "{name}: {}", result.alarm().render(false));
    result
}

fn names() -> Vec<String> {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut names: Vec<_> = files.filter(|name| name.ends_with(".mpf")).collect();
    names.sort();
    names
}

#[test]
fn listings_are_golden() {
    assert!(names().len() >= 4);
    for name in names() {
        let listing = shipped(&name).listing.replace("test.mpf", &name);
        let golden = folder().join(name.replace(".mpf", ".moves"));
        if std::env::var_os("SOLLWERT_BLESS").is_some() {
            std::fs::write(&golden, &listing).unwrap();
        }
        let wanted = std::fs::read_to_string(&golden).unwrap();
        for (number, (found, wanted)) in listing.lines().zip(wanted.lines()).enumerate() {
            assert_eq!(found, wanted, "{name}, move {}", number + 1);
        }
        assert_eq!(listing.lines().count(), wanted.lines().count(), "{name}");
    }
}

#[test]
fn shipped_programs_are_clean_and_end_at_rest() {
    for name in names() {
        let source = ProgramSource::from_file(&folder().join(&name)).unwrap();
        // Also inside the travel. The pocket is milled with a tool, and there is no tool table.
        let found: Vec<_> = check(&source, &xyz()).iter().map(|found| (found.code, found.line())).collect();
        let wanted: &[_] = match name.as_str() {
            "pocket.mpf" => &[("W0004", 8)],
            _ => &[],
        };
        assert_eq!(found, wanted, "{name}: nothing else to report");
        let last = shipped(&name).moves.pop().unwrap();
        assert_eq!(
            (last.kind, &last.events[..]),
            (MoveKind::Function { stops: true }, &[Event::MFunction(30)][..]),
            "{name}"
        );
    }
}

#[test]
fn the_spline_keeps_its_chord_error() {
    let result = shipped("spline.mpf");
    let curve = |u: f64| [100.0 * u, 100.0 * (3.0 * u.powi(3) - 4.0 * u * u + u)];
    let mut start = [0.0, 0.0];
    let lines: Vec<_> = result.moves.iter().filter(|shown| shown.kind == MoveKind::Line).collect();
    let mut worst_mm = 0.0_f64;
    for line in &lines {
        let end = [line.end.0[X], line.end.0[Y]];
        let on_curve = curve(end[0] / 100.0);
        assert!((end[1] - on_curve[1]).abs() < 1.5e-3, "the points lie on the curve");
        let length = (end[0] - start[0]).hypot(end[1] - start[1]);
        for k in 0..=200 {
            let [x, y] = curve((start[0] + (end[0] - start[0]) * f64::from(k) / 200.0) / 100.0);
            worst_mm = worst_mm
                .max(((end[0] - start[0]) * (y - start[1]) - (end[1] - start[1]) * (x - start[0])).abs() / length);
        }
        start = end;
        assert_eq!((line.modes.path_mode, line.modes.contour_tolerance_mm), (PathMode::G642, Some(0.1)));
    }
    assert_eq!(start, [100.0, 0.0]);
    assert!(worst_mm <= 0.5 && worst_mm > 0.3, "{worst_mm}");
}

#[test]
fn the_corners_turn_by_30_90_and_60_degrees() {
    let result = shipped("corners.mpf");
    let mut points = vec![[0.0, 0.0]];
    points.extend(
        result.moves.iter().filter(|shown| shown.kind == MoveKind::Line).map(|shown| [shown.end.0[X], shown.end.0[Y]]),
    );
    let headings: Vec<_> =
        points.windows(2).map(|pair| (pair[1][1] - pair[0][1]).atan2(pair[1][0] - pair[0][0]).to_degrees()).collect();
    let turns: Vec<_> = headings.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    for (turn, wanted) in turns.iter().zip([30.0, 90.0, 60.0]) {
        assert!((turn - wanted).abs() < 0.01, "{turns:?}");
    }
}

#[test]
fn the_circles_are_reached_and_left_tangentially() {
    let moves = shipped("circle.mpf").moves;
    let arcs: Vec<usize> = (0..moves.len()).filter(|i| matches!(moves[*i].kind, MoveKind::Arc(_))).collect();
    assert_eq!(arcs.len(), 4);
    for i in arcs {
        let MoveKind::Arc(arc) = moves[i].kind else { continue };
        assert_eq!((arc.radius_mm, arc.centre_mm, arc.sweep_rad.abs()), (50.0, [0.0, 0.0], std::f64::consts::TAU));
        // At (50, 0) a G3 goes towards +Y, a G2 towards -Y; so must the straight moves beside it.
        let (before, after) =
            (moves[i - 1].end.0[Y] - moves[i - 2].end.0[Y], moves[i + 1].end.0[Y] - moves[i].end.0[Y]);
        for way in [before, after] {
            assert!(way == 0.0 || way.signum() == arc.sweep_rad.signum());
        }
        assert_eq!((moves[i].end.0[X], moves[i].end.0[Y]), (50.0, 0.0));
    }
}

#[test]
fn the_pocket_has_levels_arcs_and_short_segments() {
    let result = shipped("pocket.mpf");
    let z = AxisId::new(2);
    let mut levels: Vec<f64> = result
        .moves
        .iter()
        .filter(|shown| matches!(shown.kind, MoveKind::Arc(_)))
        .map(|shown| shown.end.0[z])
        .collect();
    levels.dedup();
    assert_eq!(levels, [99.0, 98.0, 97.5]);
    let ends: Vec<_> = result.moves.iter().map(|shown| shown.end.0).collect();
    let lengths = ends.windows(2).map(|pair| (pair[1] - pair[0]).norm());
    assert!(lengths.filter(|length| *length > 0.0 && *length < 1.0).count() > 100);
}

/// What NX-style posts write: home positions as variables, tool change, cycles, rotary axes, a drilling call.
const CAM: &str = "N10 ;Start
N20 DEF REAL _tolerance
N30 DEF REAL _X_HOME, _Y_HOME, _Z_HOME, _B_HOME, _C_HOME
N40 G40 G17 G710 G94 G90 G60 G601 FNORM
N50 M9 M50
N60 CYCLE800()
N70 _tolerance=.02
N80 _X_HOME=-365. _Y_HOME=224. _Z_HOME=610.
N90 _B_HOME=0.0 _C_HOME=0.0
N100 TRAFOOF
N110 SUPA G0 Z=_Z_HOME D0
N120 SUPA G0 X=_X_HOME Y=_Y_HOME B=_B_HOME C=_C_HOME D1
N130 T=\"MILL_D8_90\"
N140 M6
N150 MSG(\"FINISH\")
N160 SUPA G0 Z=_Z_HOME D0
N170 G0 B10. C-90.
N180 CYCLE832(_tolerance,1,1)
N190 COMPOF
N200 G54
N210 G0 X-10.46 Y-22.721 Z16. S10345 D1 M3 M7
N220 G1 Z0.0 F2069.
N230 G3 X-11.76 Y-24.021 I0.0 J-1.3
N240 G1 Y-27.041
N250 X-11.754 Y-26.964 Z-.009
N260 F3308.
N270 MCALL CYCLE81(10.,0.,3.,-6.1835)
N280 X-12.5 Y-58.
N290 MCALL
N300 M29 M51 ;chips
N310 T0
N320 M6
N330 M30
";

#[test]
fn a_cam_program_runs_from_first_to_last_block() {
    let result = run_bytes(CAM.replace('\n', "\r\n").as_bytes(), &xyzbc());
    let wanted = [
        "5 function X0 Y0 Z0 B0 C0 M9 M50",
        "11 rapid X0 Y0 Z610 B0 C0 rapid D0",
        "12 rapid X-365 Y224 Z610 B0 C0 rapid D1",
        "13 function X-365 Y224 Z610 B0 C0 T=\"MILL_D8_90\"",
        "14 function X-365 Y224 Z610 B0 C0 stops M6",
        "15 function X-365 Y224 Z610 B0 C0 MSG(\"FINISH\")",
        "16 rapid X-365 Y224 Z610 B0 C0 rapid D0",
        "17 rapid X-365 Y224 Z610 B10 C-90 rapid",
        "21 rapid X-10.46 Y-22.721 Z16 B10 C-90 rapid S10345 D1 M3 M7",
        "22 line X-10.46 Y-22.721 Z0 B10 C-90 F2069",
        "23 arc X-11.76 Y-24.021 Z0 B10 C-90 F2069 XY C-10.46,-24.021 R1.3 sweep=90",
        "24 line X-11.76 Y-27.041 Z0 B10 C-90 F2069",
        "25 line X-11.754 Y-26.964 Z-0.009 B10 C-90 F2069",
        "28 line X-12.5 Y-58 Z-0.009 B10 C-90 F3308",
        "30 function X-12.5 Y-58 Z-0.009 B10 C-90 M29 M51",
        "31 function X-12.5 Y-58 Z-0.009 B10 C-90 T=\"0\"",
        "32 function X-12.5 Y-58 Z-0.009 B10 C-90 stops M6",
        "33 function X-12.5 Y-58 Z-0.009 B10 C-90 stops M30",
    ];
    assert_eq!(result.lines(), wanted);
    // CYCLE832 with mode 1: finishing, G645 with the tolerance; before it the exact stop of the machine.
    let modes = |line: u32| &result.moves.iter().find(|shown| shown.block.line == line).expect("a move").modes;
    assert_eq!(modes(17).path_mode, PathMode::ExactStop);
    assert_eq!((modes(21).path_mode, modes(21).contour_tolerance_mm), (PathMode::G645, Some(0.02)));
    let reported: Vec<_> =
        result.warnings.iter().map(|warning| (warning.line(), warning.message.split('`').nth(1).unwrap())).collect();
    assert_eq!(reported, [(6, "CYCLE800"), (12, "D1"), (27, "CYCLE81")]);
    assert!(
        check(ProgramSource::from_bytes("cam.mpf", CAM.as_bytes()), &xyzbc())
            .iter()
            .all(|found| found.severity == Severity::Warning)
    );
}
