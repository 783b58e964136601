//! Language and modal state: programs with their moves worked out by hand.

use crate::nc_machine::{run, run_bytes, xyz, xyzbc};
use sollwert::base::units::{mm_s_from_mm_min, rad_from_deg};
use sollwert::interpreter::{Event, Feed, Interpreter, MoveKind};
use sollwert::machine::{AccelerationMode, PathMode};
use sollwert::program::ProgramSource;

/// Values of expressions as the X positions of a program.
fn values(expressions: &[&str]) -> Vec<f64> {
    let mut text = String::from("DEF INT WHOLE\nDEF REAL BROKEN\nDEF BOOL FLAG\nG1 F1000 X-400\n");
    for expression in expressions {
        text.push_str(&format!("R1={expression}\nX-400 Y=IC(1)\nX=R1\n"));
    }
    let result = run(&text);
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let x = sollwert::base::AxisId::new(0);
    result.moves.iter().skip(2).step_by(2).map(|shown| shown.end.0[x]).collect()
}

fn close(found: &[f64], wanted: &[f64]) {
    assert_eq!(found.len(), wanted.len(), "{found:?}");
    for (found, wanted) in found.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-9, "{found} is not {wanted}");
    }
}

#[test]
fn operators_have_the_priorities_of_the_control() {
    // Programming manual 12/2019, p. 444. AND binds tighter than ==: 1 == (1 AND 2) is 1, 2 == (2 AND 1) is 0.
    let found = values(&[
        "2+3*4",
        "(2+3)*4",
        "10-4-3",
        "7 DIV 2*2",
        "-2+5",
        "2*-3",
        "6 B_AND 3",
        "6 B_OR 1",
        "5 B_XOR 1",
        "B_NOT 0",
        "1+6 B_AND 3",
        "2==2 AND 1",
        "NOT 0+1",
        "1 OR 0 AND 0",
        "8/4/2",
        "7 MOD 4",
        "-7 MOD 4",
        "7/2",
        "5 B_OR 2 B_AND 3",
    ]);
    close(
        &found,
        &[14.0, 20.0, 3.0, 6.0, 3.0, -6.0, 2.0, 7.0, 4.0, -1.0, 3.0, 0.0, 2.0, 1.0, 1.0, 3.0, -3.0, 3.5, 7.0],
    );
}

#[test]
fn functions_take_degrees() {
    let found = values(&[
        "SIN(30)",
        "COS(60)",
        "TAN(45)",
        "SIN(180)",
        "COS(90)",
        "ASIN(1)",
        "ACOS(0)",
        "ATAN2(30,30)",
        "SQRT(16)",
        "POT(5)",
        "ABS(-3)",
        "TRUNC(-2.7)",
        "ROUND(2.5)",
        "ROUNDUP(2.1)",
        "LN(EXP(2))",
        "MINVAL(3,2)",
        "MAXVAL(3,2)",
        "BOUND(0,10,12)",
        "SIN(-90)",
        "COS(720)",
    ]);
    close(
        &found,
        &[0.5, 0.5, 1.0, 0.0, 0.0, 90.0, 90.0, 45.0, 4.0, 25.0, 3.0, -2.0, 3.0, 3.0, 2.0, 2.0, 3.0, 10.0, -1.0, 1.0],
    );
}

#[test]
fn numbers_have_all_their_forms() {
    close(
        &values(&["1.", ".5", "-.009", "1EX2", "25EX-1", "'HFF'", "'B101'", "TRUE"]),
        &[1.0, 0.5, -0.009, 100.0, 2.5, 255.0, 5.0, 1.0],
    );
}

#[test]
fn real_values_compare_with_a_relative_tolerance() {
    close(
        &values(&["0.1+0.2==0.3", "0.1+0.2>0.3", "1==1.00000000001", "100>=100.0", "1<>2"]),
        &[1.0, 0.0, 0.0, 1.0, 1.0],
    );
}

#[test]
fn assignment_to_an_integer_rounds() {
    let result = run("DEF INT COUNT=2.5, MORE=-1.4\nDEF BOOL FLAG=7\nG1 F1 X=COUNT Y=MORE Z=FLAG\nCOUNT=7/2\nX=COUNT");
    assert_eq!(result.lines(), ["3 line X3 Y-1 Z1 F1", "5 line X4 Y-1 Z1 F1"]);
}

#[test]
fn arrays_and_indirect_parameters() {
    let text = "DEF REAL FIELD[2,3]=SET(1,2,,4)\nDEF INT LIST[3]=REP(7)\nR[1+1]=5 R1=2\nG1 F1 X=FIELD[1,0] Y=FIELD[0,2] Z=R[R1]\nFIELD[0,2]=9 LIST[1]=8\nX=FIELD[0,2] Y=LIST[0] Z=LIST[1]";
    assert_eq!(run(text).lines(), ["4 line X4 Y0 Z5 F1", "6 line X9 Y7 Z8 F1"]);
    let outside = run("DEF INT LIST[3]\nLIST[3]=1");
    assert!(outside.alarm().message.contains("index 3"), "{}", outside.alarm().message);
}

#[test]
fn control_structures_nest() {
    let text = "DEF INT II, JJ\nG1 F1\nFOR II=1 TO 3\n  IF II==2\n    FOR JJ=1 TO 2\n      X=II Y=JJ\n    ENDFOR\n  ELSE\n    IF II>2 X=0\n    ENDIF\n    X=10*II\n  ENDIF\nENDFOR\nM30";
    // The inner IF carries a word behind its condition: that is not the language.
    assert_eq!(run(text).alarm().code, "E0106");
    let text = text.replace("IF II>2 X=0", "IF II>2");
    assert_eq!(
        run(&text).lines(),
        [
            "11 line X10 Y0 Z0 F1",
            "6 line X2 Y1 Z0 F1",
            "6 line X2 Y2 Z0 F1",
            "11 line X30 Y2 Z0 F1",
            "14 function X30 Y2 Z0 stops M30"
        ]
    );
}

#[test]
fn while_loop_repeat_and_case() {
    let text = "R1=0\nG1 F1\nWHILE R1<2\nR1=R1+1\nX=R1\nENDWHILE\nREPEAT\nR1=R1-1\nY=R1\nUNTIL R1<=0\nLOOP\nR1=R1+1\nZ=R1\nIF R1==2 GOTOF OUT\nENDLOOP\nOUT: CASE R1 OF 1 GOTOF ONE 2 GOTOF TWO DEFAULT GOTOF ONE\nONE: X100\nTWO: X7";
    assert_eq!(
        run(text).lines(),
        [
            "5 line X1 Y0 Z0 F1",
            "5 line X2 Y0 Z0 F1",
            "9 line X2 Y1 Z0 F1",
            "9 line X2 Y0 Z0 F1",
            "13 line X2 Y0 Z1 F1",
            "13 line X2 Y0 Z2 F1",
            "18 line X7 Y0 Z2 F1"
        ]
    );
}

#[test]
fn a_for_loop_may_run_no_pass_at_all() {
    assert_eq!(run("DEF INT II\nG1 F1\nFOR II=3 TO 2\nX=II\nENDFOR\nY1").lines(), ["6 line X0 Y1 Z0 F1"]);
}

#[test]
fn jumps_take_the_nearest_target_in_their_direction() {
    let text = "G1 F1\nGOTOF AA\nX1\nAA: X2\nGOTOF N90\nX3\nN90 X4\nR1=R1+1\nN100 X=10*R1\nIF R1<2 GOTOB BB\nGOTO CC\nBB: X99\nM30\nCC: X5\nN90 X6\nGOTOF 90\nX7\nN90 Y1\nGOTOC NOWHERE\nY2";
    let result = run(text);
    assert_eq!(result.alarm().code, "E0401");
    assert!(result.alarm().help.as_ref().unwrap().contains("other direction"), "{:?}", result.alarm().help);
    let text = text.replace("GOTOB BB", "GOTOB N90");
    assert_eq!(
        run(&text).lines(),
        [
            "4 line X2 Y0 Z0 F1",
            "7 line X4 Y0 Z0 F1",
            "9 line X10 Y0 Z0 F1",
            "7 line X4 Y0 Z0 F1",
            "9 line X20 Y0 Z0 F1",
            "14 line X5 Y0 Z0 F1",
            "15 line X6 Y0 Z0 F1",
            "18 line X6 Y1 Z0 F1",
            "20 line X6 Y2 Z0 F1"
        ]
    );
}

#[test]
fn a_jump_out_of_a_loop_leaves_nothing_behind() {
    // The inner loop is left by a jump, again and again; the outer one still counts to its end.
    let text =
        "DEF INT II, JJ\nG1 F1\nFOR II=1 TO 3\nFOR JJ=1 TO 5\nIF JJ==2 GOTOF OUT\nENDFOR\nOUT: X=10*II+JJ\nENDFOR\nM30";
    let lines = run(text).lines();
    assert_eq!(lines[..3], ["7 line X12 Y0 Z0 F1", "7 line X22 Y0 Z0 F1", "7 line X32 Y0 Z0 F1"]);
    assert_eq!(lines.len(), 4);
}

#[test]
fn computed_jump_targets() {
    let text = "DEF STRING[8] GOAL=\"LAB2\"\nG1 F1\nGOTOF GOAL\nLAB1: X1\nM30\nLAB2: X2\nGOTOB \"LAB\"<<1";
    assert_eq!(run(text).lines(), ["6 line X2 Y0 Z0 F1", "4 line X1 Y0 Z0 F1", "5 function X1 Y0 Z0 stops M30"]);
}

#[test]
fn searching_for_ever_is_an_endless_loop_too() {
    // Every pass searches another block number through the whole program.
    let text = format!("LOOP\nR1=R1+1\nGOTOC \"N\"<<TRUNC(R1)\nENDLOOP\n{}", "X1\n".repeat(20_000));
    assert_eq!(run(&text).alarm().code, "E0403");
}

#[test]
fn an_endless_loop_without_motion_is_an_alarm() {
    let result = run("G1 F1 X1\nLOOP\nR1=R1+1\nENDLOOP");
    assert_eq!(result.alarm().code, "E0403");
    assert_eq!(result.moves.len(), 1, "what came before it is executed");
}

#[test]
fn absolute_and_incremental() {
    let text = "G1 F1 X10 Y10\nG91 X5 Y=AC(3)\nX-1\nG90 X=IC(2) Y4";
    assert_eq!(
        run(text).lines(),
        ["1 line X10 Y10 Z0 F1", "2 line X15 Y3 Z0 F1", "3 line X14 Y3 Z0 F1", "4 line X16 Y4 Z0 F1"]
    );
}

#[test]
fn inch_and_metric() {
    // G70 converts positions only; G700 also F and CTOL.
    let text = "G70 G1 X1 F100\nG700 X2 F10 CTOL=0.01\nG71 X1 F100\nG700 Y1 TRANS";
    let result = run(&text.replace("\nG700 Y1 TRANS", ""));
    assert_eq!(result.lines(), ["1 line X25.4 Y0 Z0 F100", "2 line X50.8 Y0 Z0 F254", "3 line X1 Y0 Z0 F100"]);
    assert_eq!(result.moves[1].modes.contour_tolerance_mm, Some(0.254));
    assert_eq!(result.moves[0].modes.contour_tolerance_mm, None);
}

#[test]
fn frames_shift_and_can_be_suppressed() {
    let text = "G0 X1 Y1\nTRANS X100 Y20\nX2 Y2\nTRANS X10\nX3 Y3\nATRANS X5 Z1\nX0 Z0\nSUPA X0 Y0 Z0\nG53 X1\nX0\nTRANS\nX4\nATRANS X50\nX5\nROT\nX6";
    let ends: Vec<_> =
        run(text).lines().iter().map(|line| line.split_once("rapid ").unwrap().1.replace(" rapid", "")).collect();
    assert_eq!(
        ends,
        [
            "X1 Y1 Z0",
            "X102 Y22 Z0",
            "X13 Y3 Z0",
            "X15 Y3 Z1",
            "X0 Y0 Z0",
            "X1 Y0 Z0",
            "X15 Y0 Z0",
            "X4 Y0 Z0",
            "X55 Y0 Z0",
            "X6 Y0 Z0"
        ]
    );
}

#[test]
fn an_incremental_word_makes_good_a_changed_frame() {
    // SD42440 = 1: the new offset of X is traversed with the first incremental word of X, not with that of Y.
    let text = "G0 X10 Y10\nTRANS X100\nG91 Y1\nX1\nX1\nG90\nSUPA X=IC(1)";
    let result = run(text);
    assert_eq!(
        result.lines(),
        [
            "1 rapid X10 Y10 Z0 rapid",
            "3 rapid X10 Y11 Z0 rapid",
            "4 rapid X111 Y11 Z0 rapid",
            "5 rapid X112 Y11 Z0 rapid",
            "7 rapid X113 Y11 Z0 rapid"
        ]
    );
}

#[test]
fn events_come_in_order_around_their_motion() {
    let text = "G0 X1 S1000 M3 D1 M8\nT=\"MILL\" M6\nT5\nG0 X2 T1 M6 M3\nG1 X3 F100 M0\nX4 M30\nX5";
    assert_eq!(
        run(text).lines(),
        [
            "1 rapid X1 Y0 Z0 rapid S1000 M3 D1 M8",
            "2 function X1 Y0 Z0 stops T=\"MILL\" M6",
            "3 function X1 Y0 Z0 T=\"5\"",
            "4 function X1 Y0 Z0 stops T=\"1\" M6",
            "4 rapid X2 Y0 Z0 rapid M3",
            "5 line X3 Y0 Z0 F100",
            "5 function X3 Y0 Z0 stops M0",
            "6 line X4 Y0 Z0 F100",
            "6 function X4 Y0 Z0 stops M30"
        ]
    );
}

#[test]
fn every_end_of_a_program_ends_it() {
    for end in ["M2", "M30", "M17", "RET", "M02"] {
        let result = run(&format!("G0 X1\n{end}\nX2"));
        assert_eq!(result.moves.iter().filter(|shown| shown.kind == MoveKind::Rapid).count(), 1, "{end}");
    }
}

#[test]
fn dwells_leave_feed_and_speed_alone() {
    let text = "G1 X1 F600 S300\nG4 F1.5\nX2\nG4 S30\nX3\nG4 F0.5 M8";
    let result = run(text);
    assert_eq!(
        result.lines(),
        [
            "1 line X1 Y0 Z0 F600 S300",
            "2 dwell X1 Y0 Z0 1.5s",
            "3 line X2 Y0 Z0 F600",
            "4 dwell X2 Y0 Z0 6s",
            "5 line X3 Y0 Z0 F600",
            "6 dwell X3 Y0 Z0 0.5s M8"
        ]
    );
    assert_eq!(run("G4 S3").alarm().code, "E0507");
    assert_eq!(run("G4").alarm().code, "E0507");
    assert_eq!(run("G4 F1 X1").alarm().code, "E0207");
}

#[test]
fn feeds_must_be_there_and_above_zero() {
    assert_eq!(run("X1").alarm().code, "E0501");
    assert_eq!(run("G0 X1\nG1 X2").alarm().code, "E0501");
    assert_eq!(run("G1 X1 F0").alarm().code, "E0502");
    assert_eq!(run("G1 X1 F-5").alarm().code, "E0502");
    assert!(run("G0 X1").alarm.is_none());
}

#[test]
fn rotary_moves_have_a_feed_in_degrees() {
    let result = run_bytes(b"G1 X10 C90 F600\nC180\nB=IC(10)", &xyzbc());
    assert_eq!(
        result.lines(),
        ["1 line X10 Y0 Z0 B0 C90 F600", "2 line X10 Y0 Z0 B0 C180 F600", "3 line X10 Y0 Z0 B10 C180 F600"]
    );
    assert_eq!(result.moves[0].feed, Feed::Path { feed_lu_s: mm_s_from_mm_min(600.0) });
    assert_eq!(result.moves[1].feed, Feed::Path { feed_lu_s: rad_from_deg(10.0) });
}

#[test]
fn endless_axes_go_the_way_that_is_asked() {
    let result = run_bytes(b"G0 C350\nC=DC(10)\nC=ACN(0)\nC=ACP(350)\nC=DC(350)\nC=ACP(10)", &xyzbc());
    let ends: Vec<_> = result.lines().iter().map(|line| line.split(' ').nth(6).unwrap().to_owned()).collect();
    assert_eq!(ends, ["C350", "C370", "C360", "C710", "C710", "C730"], "{}", result.listing);
    assert_eq!(run_bytes(b"G0 B=ACP(10)", &xyzbc()).alarm().code, "E0508");
}

#[test]
fn modes_travel_with_the_moves() {
    let text = "G1 F1 X1\nG9 X2\nX3 G64 BRISK FFWOF\nG641 ADIS=0.5 ADISPOS=2 X4\nG0 X5\nG642 CTOL=0.02 SOFT FFWON G1 X6\nCTOL=-1 G60 X7\nG645 X8";
    let result = run(text);
    let modes: Vec<_> = result.moves.iter().map(|shown| shown.modes.clone()).collect();
    let path_modes: Vec<_> = modes.iter().map(|modes| modes.path_mode).collect();
    use PathMode::{ExactStop, G64, G641, G642, G645};
    assert_eq!(path_modes, [G642, ExactStop, G64, G641, G641, G642, ExactStop, G645]);
    assert_eq!((modes[2].acceleration_mode, modes[2].feedforward_active), (AccelerationMode::Brisk, false));
    assert_eq!((modes[3].rounding_distance_mm, modes[4].rounding_distance_mm), (Some(0.5), Some(2.0)));
    assert_eq!((modes[5].contour_tolerance_mm, modes[6].contour_tolerance_mm), (Some(0.02), None));
    assert_eq!((modes[5].acceleration_mode, modes[5].feedforward_active), (AccelerationMode::Soft, true));
    assert!(result.warnings.is_empty(), "{:?}", result.warnings);
}

#[test]
fn a_block_that_leads_to_where_the_axes_stand_is_a_move() {
    let result = run("G1 F100 X0\nX0 M8\nX1\nX1");
    let wanted = ["1 line X0 Y0 Z0 F100", "2 line X0 Y0 Z0 F100 M8", "3 line X1 Y0 Z0 F100", "4 line X1 Y0 Z0 F100"];
    assert_eq!(result.lines(), wanted);
    // It takes no time: a loop of nothing else is endless.
    let alarm = run("G1 F100 X1\nWHILE 1\nX1\nENDWHILE\nM30").alarm;
    assert_eq!(alarm.map(|alarm| alarm.code), Some("E0403"));
}

#[test]
fn the_first_move_opens_the_program() {
    let result = run("G0 X1");
    assert!(
        matches!(&result.moves[0].events[..], [Event::ProgramOpened(opened)] if &*opened.name == "test.mpf" && opened.bytes == (*b"G0 X1").into())
    );
    // Also of a program that does nothing, and of one that fails at once.
    assert_eq!(run("; nothing").moves.len(), 1);
    let failed = run("X1");
    assert!(failed.alarm.is_some() && failed.moves.len() == 1);
    let source = ProgramSource::from_bytes("parts/plates\\7.mpf", *b"G0 X1");
    let mut interpreter = Interpreter::new(source, &xyz());
    let first = interpreter.next_move().unwrap().unwrap();
    assert!(matches!(&first.events[..], [Event::ProgramOpened(opened)] if &*opened.name == "7.mpf"));
}

#[test]
fn skipped_blocks_are_executed_and_headers_are_not() {
    let text = "%_N_TEST_MPF\n;$PATH=/_N_MPF_DIR\n/G0 X1\n/1 N20 X2\n:30 X3\nN40 /2 X4\n\n%_N_OTHER_MPF\nX99";
    let ends: Vec<_> = run(text).lines().iter().map(|line| line.split(' ').nth(2).unwrap().to_owned()).collect();
    assert_eq!(ends, ["X1", "X2", "X3", "X4"]);
}

#[test]
fn words_need_no_blanks() {
    assert_eq!(run("N10G1X10Y-2.5F500M8S3000;cut").lines(), ["1 line X10 Y-2.5 Z0 F500 M8 S3000"]);
    assert_eq!(run("n10 g1 x 10 y=2*3 f500\nX=1Y=2").lines(), ["1 line X10 Y6 Z0 F500", "2 line X1 Y2 Z0 F500"]);
}

#[test]
fn travel_is_reported_once_an_axis() {
    let result = run("G0 X500 Y0\nX501 Z-1\nX502 Z-2");
    let shown: Vec<_> =
        result.warnings.iter().map(|warning| (warning.code, warning.line(), warning.message.as_str())).collect();
    assert_eq!(
        shown,
        [
            ("W0002", 1, "X goes to 500 mm, 75 mm beyond its travel limit of 425 mm"),
            ("W0002", 2, "Z goes to -1 mm, 1 mm beyond its travel limit of 0 mm")
        ]
    );
    assert_eq!(result.moves.len(), 3, "the moves are made");
}

#[test]
fn words_not_acted_on_are_reported_once() {
    let text = "MCALL CYCLE81(10,0,3,-6,,\"A\")\nG0 X1\nMCALL\nG41 X2\nG40 COMPOF TRAFOOF G601 FNORM ORIWKS\nACC[X]=50 ACC[Y]=20\nWHEN $AA_IW[X]>5 DO M8\nS2=500 M2=3 H7";
    let result = run(text);
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let (silent, others): (Vec<_>, Vec<_>) = result.warnings.iter().partition(|warning| warning.code == "W0001");
    let words: Vec<_> = silent.iter().map(|warning| warning.message.split('`').nth(1).unwrap()).collect();
    assert_eq!(words, ["CYCLE81", "G41", "WHEN"]);
    assert!(silent.iter().all(|warning| warning.line() > 0));
    // Spindle 2 is none of the machine's.
    assert_eq!(others.iter().map(|warning| (warning.code, warning.line())).collect::<Vec<_>>(), [("W0009", 8)]);
}

#[test]
fn a_tool_without_data_is_reported_once() {
    let cases = [
        ("G0 X1\nT=\"MILL_D8\" M6\nT5 D2 M6\nD1", 2, "tool `MILL_D8`", 0..11),
        ("G0 X1 T12\nM6\nT12", 1, "tool `12`", 6..9),
        ("T0 D0\nM6\nG0 X1 D2\nT=\"MILL\" M6", 3, "edge `D2`", 6..8),
        ("DEF STRING[8] NAME=\"DRILL\"\nT=NAME", 2, "tool `DRILL`", 0..6),
    ];
    for (text, line, name, columns) in cases {
        let result = run(text);
        assert!(result.alarm.is_none(), "{text}: {}", result.alarm().render(false));
        let [warning] = &result.warnings[..] else { panic!("{text}: {:?}", result.warnings) };
        assert_eq!((warning.code, warning.line()), ("W0004", line), "{text}");
        assert_eq!(warning.place.as_ref().unwrap().columns, columns, "{text}");
        assert!(warning.message.starts_with(&format!("{name} has no data: length and radius")), "{}", warning.message);
    }
    for text in ["T0 M6\nD0\nG0 X1", "M6\nG0 X1", "T=\"0\" D=0 M6"] {
        assert_eq!(run(text).warnings, [], "{text}: no tool, nothing to miss");
    }
}

#[test]
fn words_that_would_change_the_motion_are_errors() {
    for text in ["TRAORI", "A3=0 B3=0 C3=1", "TOFRAME", "G74 X1=0"] {
        let result = run(text);
        assert_eq!(result.alarm().code, "E0202", "{text}");
        assert!(result.alarm().message.contains("not built"), "{text}: {}", result.alarm().message);
    }
}

#[test]
fn run_time_errors_name_their_place() {
    let cases = [
        ("R1=1/R2", "E0304", 5..7),
        ("R1=SQRT(-1)", "E0305", 3..11),
        ("R1=1EX300*1EX300", "E0306", 3..16),
        ("DEF INT COUNT=3000000000", "E0306", 14..24),
        ("DEF STRING[3] TEXT=\"LONG\"", "E0308", 19..25),
        ("R1=\"A\"", "E0303", 3..6),
        ("R[-1]=0", "E0307", 2..4),
        ("DEF REAL BIG[1000,1000,1000]", "E0309", 9..12),
        ("WIDTH=3", "E0301", 0..7),
        ("GOTOF LOST", "E0401", 6..10),
        ("ENDIF", "E0402", 0..5),
        ("G1 G2 X1", "E0205", 3..5),
        ("G0 X1 X2", "E0205", 6..8),
        ("M3.5", "E0306", 0..4),
        ("S-5", "E0306", 0..3),
        ("G0 X1EX9", "E0306", 3..8),
        ("G1 F1 G3 X1 I-1EX300", "E0205", 6..8),
        ("G3 F1 X1 I-1EX300", "E0306", 9..17),
        ("G3 F1 X1 CR=1EX300", "E0306", 9..18),
        ("G3 F1 I5 TURN=1000", "E0306", 9..18),
        ("G4 F1EX9", "E0507", 0..2),
        ("G1 X1 F1EX-9", "E0502", 6..12),
    ];
    for (text, code, columns) in cases {
        let result = run(text);
        let alarm = result.alarm();
        assert_eq!((alarm.code, &alarm.place.as_ref().unwrap().columns), (code, &columns), "{text}: {}", alarm.message);
    }
}

#[test]
fn a_missing_value_says_what_to_write() {
    for text in ["G1 F1 X=", "R1=2+", "IF R1>"] {
        let alarm = run(text).alarm().clone();
        assert_eq!(alarm.code, "E0104", "{text}");
        assert!(alarm.help.is_some_and(|help| help.contains("write a number")), "{text}");
    }
}

#[test]
fn a_snapshot_goes_on_by_itself() {
    fn is_send<T: Send + Clone>(_: &T) {}
    let text = b"DEF INT II\nG1 F100\nFOR II=1 TO 5\nX=II\nENDFOR\nM30";
    let mut original = Interpreter::new(ProgramSource::from_bytes("a.mpf", *text), &xyz());
    is_send(&original);
    for _ in 0..2 {
        original.next_move().unwrap();
    }
    let mut copy = original.clone();
    let rest =
        |interpreter: &mut Interpreter| std::iter::from_fn(|| interpreter.next_move().unwrap()).collect::<Vec<_>>();
    let first = rest(&mut original);
    assert_eq!(first.len(), 4);
    assert_eq!(first, rest(&mut copy));
}

#[test]
fn blocks_are_numbered_as_they_are_executed() {
    let result = run("; comment\nG1 F1\n\nLA: X=R1+1\nR1=R1+1\nIF R1<2 GOTOB LA");
    let refs: Vec<_> = result.moves.iter().map(|shown| (shown.block.line, shown.block.number)).collect();
    assert_eq!(refs, [(4, 2), (4, 5)]);
}
