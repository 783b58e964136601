//! Sub-programs: where they are found, what is handed over, how they end.

use crate::nc_machine::xyz;
use sollwert::base::Diagnostic;
use sollwert::interpreter::{Event, Interpreter, Listing, Move, Setup, check};
use sollwert::program::{ProgramId, ProgramSource, codes};
use std::path::{Path, PathBuf};

/// A folder of its own for each test, with files in it.
fn folder(name: &str, files: &[(&str, &str)]) -> PathBuf {
    let root = std::env::temp_dir().join(format!("sollwert-subprograms-{}", std::process::id())).join(name);
    for (file, text) in files {
        let path = root.join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    }
    root
}

fn setup(main: &Path, folders: &[PathBuf]) -> Setup {
    Setup { directories: folders.to_vec(), ..Setup::from(ProgramSource::from_file(main).unwrap()) }
}

struct Run {
    moves: Vec<Move>,
    lines: Vec<String>,
    warnings: Vec<Diagnostic>,
    alarm: Option<Diagnostic>,
}

fn run(setup: Setup) -> Run {
    let machine = xyz();
    let mut interpreter = Interpreter::new(setup, &machine);
    let mut listing = Listing::new(&machine);
    let mut run = Run { moves: Vec::new(), lines: Vec::new(), warnings: Vec::new(), alarm: None };
    for _ in 0..100_000 {
        match interpreter.next_move() {
            Ok(Some(next)) => {
                let line = listing.line(&next);
                // Line of the program, kind, X: enough to see where it was.
                run.lines.push(line.split_whitespace().take(3).collect::<Vec<_>>().join(" "));
                run.moves.push(next);
            }
            Ok(None) => break,
            Err(alarm) => {
                run.alarm = Some(*alarm);
                break;
            }
        }
    }
    run.warnings = interpreter.take_warnings();
    run
}

/// Runs `main.mpf` among files in a folder of its own; X of every motion.
fn xs_of(name: &str, files: &[(&str, &str)]) -> Vec<f64> {
    let root = folder(name, files);
    let done = run(setup(&root.join("main.mpf"), &[]));
    assert!(done.alarm.is_none(), "{}", done.alarm.unwrap().render(false));
    xs(&done)
}

fn xs(run: &Run) -> Vec<f64> {
    let x = xyz().axis_by_name("X").unwrap();
    let moving = run.moves.iter().filter(|next| !matches!(next.kind, sollwert::interpreter::MoveKind::Function { .. }));
    moving.map(|next| next.end.0[x]).collect()
}

fn alarm_of(name: &str, files: &[(&str, &str)]) -> Diagnostic {
    let root = folder(name, files);
    run(setup(&root.join("main.mpf"), &[])).alarm.expect("the program raises an alarm")
}

#[test]
fn a_sub_program_is_found_beside_the_program_in_any_spelling() {
    for (i, file) in ["HOLE.SPF", "hole.spf", "Hole.mpf", "hole", "_N_HOLE_SPF", "HOLE_SPF"].iter().enumerate() {
        let files = [("main.mpf", "G0 X1\nHole\nG0 X3\nM30\n"), (*file, "G0 X2\nM17\n")];
        assert_eq!(xs_of(&format!("spelling{i}"), &files), [1.0, 2.0, 3.0], "{file}");
    }
    // The control's order: the name alone, then SPF, then MPF.
    let both = [("main.mpf", "HOLE\nM30"), ("HOLE.SPF", "G0 X2\nRET"), ("HOLE.MPF", "G0 X5\nRET")];
    assert_eq!(xs_of("order", &both), [2.0]);
}

#[test]
fn folders_are_searched_in_the_control_s_order() {
    let spf = |x: u32| format!("G0 X{x}\nRET\n");
    let (cus, cma, other) = (spf(4), spf(5), spf(6));
    let root = folder(
        "archive",
        &[
            (
                "WKS.DIR/PART.WPD/MAIN.MPF",
                "ALPHA\nBETA\nGAMMA\nDELTA\nPCALL /_N_WKS_DIR/_N_OTHER_WPD/_N_ALPHA_SPF\nM30\n",
            ),
            ("WKS.DIR/PART.WPD/ALPHA.SPF", "G0 X1\nRET\n"),
            ("SPF.DIR/ALPHA.SPF", "G0 X99\nRET\n"),
            ("SPF.DIR/BETA.SPF", "G0 X2\nRET\n"),
            ("CUS.DIR/BETA.SPF", "G0 X98\nRET\n"),
            ("CUS.DIR/GAMMA.SPF", &cus),
            ("CMA.DIR/DELTA.SPF", &cma),
            ("WKS.DIR/OTHER.WPD/ALPHA.SPF", &other),
        ],
    );
    let main = root.join("WKS.DIR/PART.WPD/MAIN.MPF");
    let done = run(setup(&main, &[]));
    assert!(done.alarm.is_none(), "{}", done.alarm.unwrap().render(false));
    assert_eq!(xs(&done), [1.0, 2.0, 4.0, 5.0, 6.0]);
    // A given folder comes before the folders of the control, after the program's own.
    let given = folder("given", &[("ALPHA.SPF", "G0 X97\nRET"), ("BETA.SPF", "G0 X20\nRET")]);
    assert_eq!(xs(&run(setup(&main, &[given]))), [1.0, 20.0, 4.0, 5.0, 6.0]);
    // CALLPATH, and an archive beside the program.
    let files = [
        ("main.mpf", "CALLPATH(\"/_N_WKS_DIR/_N_TOOLS_WPD\")\nDRILL\nPACKED\nM30"),
        ("WKS.DIR/TOOLS.WPD/DRILL.SPF", "G0 X7\nRET"),
        ("cycles.arc", "%_N_UNUSED_SPF\nG0 X1\nRET\n%_N_PACKED_SPF\nG0 X8\nRET\n"),
    ];
    assert_eq!(xs_of("callpath", &files), [7.0, 8.0]);
}

#[test]
fn programs_of_an_archive_call_each_other() {
    let text = "\
%_N_PLATE_MPF
;$PATH=/_N_WKS_DIR/_N_PLATE_WPD
HOLES(2)
L12 P2
M30
%_N_HOLES_SPF
PROC HOLES(INT COUNT)
FOR R1=1 TO COUNT
G0 X=R1
ENDFOR
M17
%_N_L12_SPF
G0 X50
X60 M17
";
    let done = run(ProgramSource::from_bytes("plate.arc", text.as_bytes()).into());
    assert!(done.alarm.is_none(), "{}", done.alarm.unwrap().render(false));
    assert_eq!(xs(&done), [1.0, 2.0, 50.0, 60.0, 50.0, 60.0]);
    // One file: one program number; lines are those of the file.
    assert!(done.moves.iter().all(|next| next.block.program == ProgramId(0)));
    assert_eq!(done.moves[0].block.line, 9);
}

#[test]
fn values_are_handed_over() {
    let sub = "\
PROC SUB(REAL A, INT B=7, VAR REAL OUT, BOOL ON=TRUE, STRING[10] TEXT=\"abc\", CHAR C) DISPLOF SBLOF
OUT=A+B
G0 X=OUT Y=ON Z=C
MSG(TEXT)
RET
";
    let main = "\
DEF REAL RESULT
SUB(1.5, 2, RESULT, FALSE, \"xyz\", 65)
G0 X=RESULT*10
SUB(1.5, , R5)
G0 X=R5
SUB(, 3, RESULT)
M30
";
    let root = folder("values", &[("main.mpf", main), ("SUB.SPF", sub)]);
    let done = run(setup(&root.join("main.mpf"), &[]));
    assert!(done.alarm.is_none(), "{}", done.alarm.unwrap().render(false));
    assert_eq!(xs(&done), [3.5, 35.0, 8.5, 8.5, 3.0]);
    let messages: Vec<String> = done
        .moves
        .iter()
        .flat_map(|next| &next.events)
        .filter_map(|event| match event {
            Event::Message(text) => Some(text.to_string()),
            _ => None,
        })
        .collect();
    assert_eq!(messages, ["xyz", "abc", "abc"]);
    let y = xyz().axis_by_name("Y").unwrap();
    assert_eq!(done.moves[0].end.0[y], 0.0);
    assert_eq!(done.moves.iter().rev().find(|next| next.end.0[y] != 0.0).unwrap().end.0[y], 1.0);
}

#[test]
fn arrays_are_handed_over_whole() {
    let sub = "\
PROC SUM(REAL AA[3], VAR REAL BB[], VAR REAL TOTAL, INT MM[2,2])
DEF INT II
FOR II=0 TO 2
TOTAL=TOTAL+AA[II]
AA[II]=0
BB[II]=II*10
ENDFOR
TOTAL=TOTAL+MM[1,1]
RET
";
    let main = "\
DEF REAL AA[3]=SET(1,2,3), BB[3], TOTAL[2]
DEF INT MM[2,2]
MM[1,1]=100
SUM(AA, BB, TOTAL[1], MM)
G0 X=TOTAL[1]
X=AA[2]
X=BB[2]
X=TOTAL[0]
M30
";
    assert_eq!(xs_of("arrays", &[("main.mpf", main), ("SUM.SPF", sub)]), [106.0, 3.0, 20.0, 0.0]);
    let wrong = main.replace("AA[3]=SET(1,2,3)", "AA[4]");
    assert_eq!(alarm_of("wrong_size", &[("main.mpf", &wrong), ("SUM.SPF", sub)]).code, codes::BAD_ARGUMENT);
}

#[test]
fn every_program_has_variables_of_its_own() {
    let files = [
        ("main.mpf", "DEF INT NN=5\nR1=1\nSUB\nG0 X=NN\nX=R1\nSUB\nX=R1\nM30"),
        // A DEF acts in every call; R parameters are common to all.
        ("SUB.SPF", "DEF INT NN\nNN=NN+1\nR1=R1+NN\nG0 X=NN\nRET"),
    ];
    assert_eq!(xs_of("own", &files), [1.0, 5.0, 2.0, 1.0, 3.0]);
    let unseen = [("main.mpf", "DEF INT NN=5\nSUB\nM30"), ("SUB.SPF", "G0 X=NN\nRET")];
    let alarm = alarm_of("unseen", &unseen);
    assert_eq!((alarm.code, alarm.line()), (codes::UNDECLARED, 1));
    let place = alarm.place.as_ref().unwrap();
    assert!(place.file.ends_with("SUB.SPF"), "{}", place.file);
    assert_eq!(alarm.called_from.len(), 1);
    assert!(alarm.called_from[0].0.ends_with("main.mpf") && alarm.called_from[0].1 == 2);
    assert!(alarm.render(false).contains("called from"));
}

#[test]
fn calls_by_number_text_and_path_and_how_often() {
    let main = "\
DEF STRING[20] NAME=\"SUB\"
DEF STRING[20] NAMES[2]=SET(\"L0\", \"L07\")
R1=2
SUB P3
SUB P=R1
CALL NAME
CALL \"L\"<<7
CALL NAMES[1]
PCALL /_N_SPF_DIR/SUB
EXTCALL(\"SUB.SPF\")
EXTCALL \"L7\"
M30
";
    let files = [
        ("main.mpf", main),
        ("SUB.SPF", "R9=R9+1\nG0 X=R9\nRET"),
        ("L7.SPF", "G0 X70\nM17"),
        ("L07.SPF", "G0 X7\nM17"),
    ];
    // SUB counts its calls: five, then by CALL, PCALL and EXTCALL.
    assert_eq!(xs_of("forms", &files), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 70.0, 7.0, 7.0, 8.0, 70.0]);
}

#[test]
fn a_part_of_a_program_is_called() {
    let sub = "G0 X1\nBEGIN: G0 X2\nX3\nFIN: X4\nX5\nRET\n";
    let main = "CALL \"SUB\" BLOCK BEGIN TO FIN\nG0 X10\nCALL BLOCK AA TO BB\nM30\nAA: X20\nBB: X21\nX22\n";
    assert_eq!(xs_of("block", &[("main.mpf", main), ("SUB.SPF", sub)]), [2.0, 3.0, 4.0, 10.0, 20.0, 21.0]);
}

#[test]
fn returns() {
    // M30, M2, the end of the text: all return from a sub-program. RET does not stop the path, M17 does.
    for (i, end) in ["RET", "M17", "M30", "M2", ""].iter().enumerate() {
        let sub = format!("G0 X2\n{end}\n");
        let files = [("main.mpf", "G0 X1\nSUB\nX3\nM30\n"), ("SUB.SPF", sub.as_str())];
        assert_eq!(xs_of(&format!("end{i}"), &files), [1.0, 2.0, 3.0], "{end}");
    }
    let main = "ONE\nG0 X90\nN50 G0 X91\nBACK: X92\nM30\n";
    for (i, (ret, expected)) in [
        ("RET(\"BACK\")", &[2.0, 91.5, 92.0][..]),
        ("RET(\"N50\",1)", &[2.0, 91.5, 92.0]),
        ("RET(,,2)", &[2.0, 90.0, 91.0, 92.0]),
        ("RET(\"BACK\",,2)", &[2.0, 92.0]),
        ("RET", &[2.0, 3.0, 91.5, 90.0, 91.0, 92.0]),
    ]
    .iter()
    .enumerate()
    {
        let two = format!("G0 X2\n{ret}\n");
        // ONE has the labels too: one level back leads into it.
        let one = "TWO\nX3\nN50 R1=1\nBACK: X91.5\nRET\n";
        let files = [("main.mpf", main), ("ONE.SPF", one), ("TWO.SPF", two.as_str())];
        let expected: Vec<f64> = match i {
            0 | 1 => [&expected[..2], &[90.0, 91.0, 92.0]].concat(),
            _ => expected.to_vec(),
        };
        assert_eq!(xs_of(&format!("ret{i}"), &files), expected, "{ret}");
    }
}

#[test]
fn save_brings_modal_functions_back() {
    let body = "G91 G1 F500 X5\nTRANS X100\nRET\n";
    let plain = [("main.mpf", "G0 G90 X1\nSUB\nX10\nM30"), ("SUB.SPF", body)];
    assert_eq!(xs_of("nosave", &plain)[2..], [116.0]);
    let saved = format!("PROC SUB SAVE\n{body}");
    let root = folder("save", &[("main.mpf", "G0 G90 X1\nSUB\nX10\nM30"), ("SUB.SPF", &saved)]);
    let done = run(setup(&root.join("main.mpf"), &[]));
    assert_eq!(xs(&done), [1.0, 6.0, 10.0]);
    assert_eq!(done.moves[2].kind, sollwert::interpreter::MoveKind::Rapid);
}

#[test]
fn a_modal_call_follows_every_motion() {
    let files = [
        ("main.mpf", "G0 X1\nMCALL DRILL(5)\nX2\nY1\nM8\nPOINTS\nMCALL\nX4\nM30"),
        ("DRILL.SPF", "PROC DRILL(REAL DEPTH)\nZ=-DEPTH\nZ0\nRET"),
        ("POINTS.SPF", "X3\nRET"),
    ];
    // After X2, after Y1, and after the motion of POINTS: two moves each.
    assert_eq!(xs_of("mcall", &files), [1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 4.0]);
    let cycle = [("main.mpf", "MCALL CYCLE81(10,0,1,-5)\nG0 X1\nMCALL\nM30")];
    let root = folder("mcall_cycle", &cycle);
    let done = run(setup(&root.join("main.mpf"), &[]));
    assert_eq!(xs(&done), [1.0]);
    assert!(done.warnings[0].message.contains("CYCLE81"), "{}", done.warnings[0].message);
}

#[test]
fn every_file_is_opened_and_numbered_once() {
    let root = folder(
        "opened",
        &[
            ("main.mpf", "G0 X1\nSUB\nSUB\nOTHER\nSUB\nM30"),
            ("SUB.SPF", "G0 X2\nRET"),
            ("OTHER.SPF", "G0 X3\nSUB\nRET"),
        ],
    );
    let done = run(setup(&root.join("main.mpf"), &[]));
    let opened: Vec<_> = done
        .moves
        .iter()
        .flat_map(|next| &next.events)
        .filter_map(|event| match event {
            Event::ProgramOpened(opened) => Some((opened.id.0, opened.name.to_string())),
            _ => None,
        })
        .collect();
    assert_eq!(opened, [(0, "main.mpf".to_owned()), (1, "SUB.SPF".to_owned()), (2, "OTHER.SPF".to_owned())]);
    let programs: Vec<u16> = done.moves.iter().map(|next| next.block.program.0).collect();
    assert_eq!(programs, [0, 1, 1, 2, 1, 1, 0]);
}

#[test]
fn what_goes_wrong_is_said() {
    let missing = alarm_of("missing", &[("main.mpf", "G0 X1\nHOLEZ(1)\n"), ("HOLES.SPF", "RET")]);
    assert_eq!((missing.code, missing.line()), (codes::NO_SUBPROGRAMS, 2));
    assert_eq!(missing.help.as_deref(), Some("did you mean `HOLES`?"));
    let endless = alarm_of("recursion", &[("main.mpf", "SUB\nM30"), ("SUB.SPF", "SUB\nRET")]);
    assert_eq!(endless.code, codes::CALL_DEPTH);
    assert_eq!(endless.called_from.len(), 15);
    let sub = "PROC SUB(INT A, VAR REAL B)\nRET";
    for (i, (call, code)) in [
        ("SUB(1,2)", codes::BAD_ARGUMENT),
        ("SUB(1,R1,3)", codes::BAD_ARGUMENT),
        ("DEF INT NN\nSUB(1,NN)", codes::BAD_ARGUMENT),
        ("SUB(\"a\")", codes::TYPE_MISMATCH),
        ("SUB P0", codes::OUT_OF_RANGE),
        ("SUB P10000", codes::OUT_OF_RANGE),
        ("NOPROC(1)", codes::BAD_ARGUMENT),
        ("EXTERN SUB(REAL, VAR REAL)", codes::BAD_ARGUMENT),
        ("EXTERN SUB(INT)", codes::BAD_ARGUMENT),
        ("ISOCALL SUB", codes::NOT_BUILT),
        ("CALL 5", codes::TYPE_MISMATCH),
    ]
    .iter()
    .enumerate()
    {
        let main = format!("{call}\nM30");
        let files = [("main.mpf", main.as_str()), ("SUB.SPF", sub), ("NOPROC.SPF", "G0 X1")];
        assert_eq!(alarm_of(&format!("wrong{i}"), &files).code, *code, "{call}");
    }
    let fits = [("main.mpf", "EXTERN SUB(INT, VAR REAL)\nSUB(1, R1)\nM30"), ("SUB.SPF", sub)];
    assert_eq!(xs_of("fits", &fits), [0.0; 0]);
    // A sub-program without motion called for ever: found out as any other loop.
    let loops = alarm_of("loops", &[("main.mpf", "LOOP\nSUB\nENDLOOP"), ("SUB.SPF", "R1=R1+1\nRET")]);
    assert_eq!(loops.code, codes::ENDLESS);
}

#[test]
fn a_check_reads_every_sub_program() {
    let root = folder(
        "check",
        &[
            ("main.mpf", "GOTOF FIN\nSUB(1)\nNOWHERE\nFIN: SUB(1,2)\nM30"),
            ("SUB.SPF", "PROC SUB(INT A)\nG0 XX=A\nDEEP\nRET"),
            ("DEEP.SPF", "G0 X=B\nRET"),
        ],
    );
    let found = check(setup(&root.join("main.mpf"), &[]), &xyz());
    let shown: Vec<_> = found
        .iter()
        .map(|finding| {
            let place = finding.place.as_ref().unwrap();
            (place.file.rsplit('/').next().unwrap().to_owned(), finding.line(), finding.code)
        })
        .collect();
    let expected = [
        ("main.mpf", 3, codes::NO_SUBPROGRAMS),
        ("main.mpf", 4, codes::BAD_ARGUMENT),
        ("SUB.SPF", 2, shown[2].2),
        ("DEEP.SPF", 1, codes::UNDECLARED),
    ];
    assert_eq!(shown, expected.map(|(file, line, code)| (file.to_owned(), line, code)));
}
