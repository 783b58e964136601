//! Program files: streamed from the disk as from memory, changed while they are read, archives.

use crate::nc_machine::{run_bytes, xyz};
use sollwert::interpreter::{Interpreter, Listing};
use sollwert::program::{ProgramSource, ProgramText, Window, codes};
use std::fmt::Write as _;
use std::path::PathBuf;

/// A file of its own for each test.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("sollwert-program-files-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Opened as a file of ten million blocks is: not held in memory.
fn streamed(path: &std::path::Path) -> ProgramSource {
    ProgramSource::from_bytes(&path.to_string_lossy(), ProgramText::open_holding(path, 0).unwrap())
}

fn listing(source: &ProgramSource) -> String {
    let machine = xyz();
    let mut interpreter = Interpreter::new(source.clone(), &machine);
    let mut listing = Listing::new(&machine);
    let mut text = String::new();
    loop {
        match interpreter.next_move() {
            Ok(Some(next)) => _ = writeln!(text, "{}", listing.line(&next)),
            Ok(None) => return text,
            Err(alarm) => return text + &alarm.render(false),
        }
    }
}

#[test]
fn a_streamed_program_gives_the_same_moves() {
    // Longer than several windows; jumps in both directions and a loop across a window's border.
    let mut text = String::from("\u{feff}DEF INT COUNT\nG1 F1000\nGOTOF FAR\nNEAR: MSG(\"näher\")\nX1\nGOTOF N99999\n");
    for i in 0..40_000 {
        writeln!(text, "N{} X{}.5 Y{} ; a comment", i, i % 400, i % 7).unwrap();
    }
    text += "FAR: X0\nFOR COUNT=1 TO 3\n";
    for i in 0..3_000 {
        writeln!(text, "X{} Y=COUNT\r", i % 300).unwrap();
    }
    text += "ENDFOR\nGOTOB NEAR\nN99999 Z=SIN(30)\nM30";
    let path = file("long.mpf", text.as_bytes());
    let held = ProgramSource::from_bytes(&path.to_string_lossy(), text.as_bytes());
    let (one, other) = (listing(&held), listing(&streamed(&path)));
    assert_eq!(one.lines().count(), 1 + 3 * 3_000 + 3 + 1);
    // Line by line: a difference shows where it is.
    for (one, other) in one.lines().zip(other.lines()) {
        assert_eq!(one, other);
    }
    assert_eq!(one.len(), other.len());
}

#[test]
fn lines_of_any_length_come_through_a_window() {
    for ending in ["\n", "\r\n", ""] {
        let long = "x".repeat(300_000);
        let text = format!("a\n\n{long}\nb\r\n{long}{ending}");
        let path = file(&format!("lines{}.mpf", ending.len()), text.as_bytes());
        let source = streamed(&path);
        let (mut window, mut cursor, mut lines) = (Window::default(), source.first(), Vec::new());
        while let Some((line, next)) = source.line(&mut window, cursor).unwrap() {
            lines.push(source.decode(&line).into_owned());
            cursor = next;
        }
        assert_eq!(lines, ["a", "", long.as_str(), "b", long.as_str()]);
        assert_eq!(source.text_of_line(4).as_deref(), Some("b"));
        assert_eq!(source.text_of_line(6), None);
    }
    let path = file("endless.mpf", &vec![b'x'; 6_000_000]);
    let source = streamed(&path);
    let fault = source.line(&mut Window::default(), source.first()).unwrap_err();
    assert_eq!(fault.code, codes::BAD_BLOCK);
}

#[test]
fn a_file_that_changes_while_it_is_read_is_an_alarm() {
    let text = "G1 F1000 X1\n".repeat(100_000);
    let path = file("changed.mpf", text.as_bytes());
    let mut interpreter = Interpreter::new(streamed(&path), &xyz());
    for _ in 0..100 {
        interpreter.next_move().unwrap();
    }
    std::fs::write(&path, "G1 F1000 X2\n".repeat(90_000)).unwrap();
    let alarm = loop {
        match interpreter.next_move() {
            Ok(Some(_)) => {}
            Ok(None) => panic!("the program ends as if nothing had happened"),
            Err(alarm) => break alarm,
        }
    };
    assert_eq!(alarm.code, codes::LOST);
    assert!(alarm.message.contains("changed"), "{}", alarm.message);
}

#[test]
fn the_character_set_belongs_to_the_whole_file() {
    // One byte that is no UTF-8, behind the first window, makes all of it Windows-1252.
    let mut bytes = "MSG(\"\u{e4}\")\n".repeat(20_000).into_bytes();
    let utf8 = streamed(&file("utf8.mpf", &bytes));
    assert_eq!(utf8.line_text(utf8.first()), "MSG(\"ä\")");
    bytes.extend_from_slice(b"MSG(\"\xe4\")");
    let latin = streamed(&file("latin.mpf", &bytes));
    assert_eq!(latin.line_text(latin.first()), "MSG(\"Ã¤\")");
    assert_eq!(latin.text_of_line(20_001).as_deref(), Some("MSG(\"ä\")"));
}

#[test]
fn an_archive_is_several_programs() {
    let text = "\
%_N_PLATE_MPF
;$PATH=/_N_WKS_DIR/_N_PLATE_WPD
G0 X1
M30
%_N_HOLES_SPF
;$PATH=/_N_SPF_DIR
G0 X2
M17
%SPF12
G0 X3
";
    let source = ProgramSource::from_bytes("plate.arc", text.as_bytes());
    let names: Vec<_> = source.sections().iter().map(|found| (&*found.name, &*found.extension)).collect();
    assert_eq!(names, [("PLATE", "MPF"), ("HOLES", "SPF"), ("L12", "SPF")]);
    assert_eq!(source.sections()[0].folders, ["WKS.DIR", "PLATE.WPD"]);
    let moves = run_bytes(text.as_bytes(), &xyz()).bare_lines();
    assert_eq!(moves, ["3 rapid X1 Y0 Z0 rapid", "4 function X1 Y0 Z0 stops M30"]);
    // Without M30 the program ends where the next one begins; sub-programs may stand first.
    let mixed = text.replace("M30\n", "").replace("PLATE_MPF", "PLATE_SPF").replace("HOLES_SPF", "HOLES_MPF");
    assert_eq!(run_bytes(mixed.as_bytes(), &xyz()).bare_lines()[0], "6 rapid X2 Y0 Z0 rapid");
    // What stands before the first header is a program too, unless it is a comment.
    let headless = format!("G0 X9\n{text}");
    let moves = run_bytes(headless.as_bytes(), &xyz()).bare_lines();
    assert_eq!(moves, ["1 rapid X9 Y0 Z0 rapid"]);
    assert_eq!(run_bytes(format!("; made by\n\n%\n{text}").as_bytes(), &xyz()).bare_lines().len(), 2);
}

#[test]
fn the_number_of_an_iso_tape_is_no_block() {
    let text = "%\nO1234 (PLATE)\nG0 X1\nM30\n%\n";
    assert_eq!(run_bytes(text.as_bytes(), &xyz()).lines()[0], "3 rapid X1 Y0 Z0 rapid");
    // Elsewhere an O is a typo.
    let typo = run_bytes(b"G0 X1\nO1234\n", &xyz());
    assert_eq!(typo.alarm().code, codes::UNKNOWN_AXIS);
}
