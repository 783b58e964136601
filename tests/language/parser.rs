//! Text -> blocks: encodings, recovery, the table of words, the fast path against the parser, and that no input breaks anything.

use crate::nc_machine::{run_bytes, xyz, xyzbc};
use proptest::prelude::*;
use sollwert::base::Severity;
use sollwert::interpreter::{Event, check, known_words};
use sollwert::program::syntax::{ExprKind, Statement, WordKind};
use sollwert::program::{Dialect, NOT_ACTED_ON, ProgramSource, codes, parse};
use std::collections::BTreeSet;

fn message(bytes: &[u8]) -> String {
    let result = run_bytes(bytes, &xyz());
    assert!(result.alarm.is_none(), "{}", result.alarm().render(false));
    let texts = result.moves.iter().flat_map(|shown| &shown.events).filter_map(|event| match event {
        Event::Message(text) => Some(text.to_string()),
        _ => None,
    });
    texts.collect::<Vec<_>>().join("|")
}

#[test]
fn every_character_set_gives_the_same_text() {
    // UTF-8, with a byte-order mark, Latin-1, and a euro sign of Windows-1252; LF and CRLF.
    assert_eq!(message("MSG(\"Fräsen 20°\")\nG0 X1".as_bytes()), "Fräsen 20°");
    assert_eq!(message("\u{feff}MSG(\"Fräsen\")\r\nG0 X1\r\n".as_bytes()), "Fräsen");
    assert_eq!(message(b"MSG(\"Fr\xe4sen 20\xb0\")\r\nG0 X1"), "Fräsen 20°");
    assert_eq!(message(b"MSG(\"5 \x80\")"), "5 €");
    assert_eq!(message("; \u{e4}\nMSG(\"A\")".as_bytes()), "A");
}

#[test]
fn errors_mark_characters_also_in_latin_1() {
    let source = ProgramSource::from_bytes("a.mpf", *b"MSG(\"\xe4\xf6\xfc\") XYZ");
    let found = check(&source, &xyz());
    let place = found[0].place.as_ref().unwrap();
    assert_eq!((&place.line_text[place.columns.clone()], place.line), ("XYZ", 1));
    assert!(found[0].render(false).contains("MSG(\"äöü\") XYZ"));
}

#[test]
fn an_unreadable_file_is_told() {
    let error = ProgramSource::from_file(std::path::Path::new("no/such/file.mpf")).unwrap_err();
    assert!(error.code == "E0001" && error.message.contains("no/such/file.mpf") && error.help.is_some());
}

/// Line, code and marked text of all errors.
fn errors(text: &str) -> Vec<(u32, &'static str, String)> {
    let found = check(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
    let errors = found.iter().filter(|diagnostic| diagnostic.severity == Severity::Error);
    errors
        .map(|diagnostic| {
            let place = diagnostic.place.as_ref().unwrap();
            (diagnostic.line(), diagnostic.code, place.line_text[place.columns.clone()].to_owned())
        })
        .collect()
}

#[test]
fn one_typo_is_one_error() {
    let program = "DEF REAL WIDTH=10\nG1 F100\nIF WIDTH>5\nX=WIDTH\nENDIF\nFOR R1=1 TO 2\nY=R1\nENDFOR\nLAB: G4 F1\nX1 Y2 Z3\nM30\n";
    assert_eq!(errors(program), []);
    let cases = [
        ("Y2 Z3", "Y2. Z3,", (10, "E0105", ",")),
        ("Y2 Z3", "Y Z3", (10, "E0104", "Z3")),
        ("ENDIF", "ENDIFF", (5, "E0201", "ENDIFF")),
        ("ENDFOR", "ENDFO", (8, "E0201", "ENDFO")),
        ("X=WIDTH", "X=WITDH", (4, "E0301", "WITDH")),
        ("X=WIDTH", "X=(WIDTH", (4, "E0105", "")),
        ("DEF REAL WIDTH=10", "DEF REAL WIDTH=1O", (1, "E0106", "O")),
        ("DEF REAL", "DEF RAEL", (1, "E0105", "RAEL")),
        ("IF WIDTH>5", "IF WIDTH>", (3, "E0104", "")),
        ("IF WIDTH>5", "IFF WIDTH>5", (3, "E0201", "IFF")),
        ("1 TO 2", "1 UNTIL 2", (6, "E0105", "UNTIL")),
        ("F100", "F100 MSG(\"A)", (2, "E0103", "\"A)")),
        ("F100", "F100 $", (2, "E0310", "$")),
        ("F100", "F100 (A)", (2, "E0105", "(")),
        ("F100", "F1.0.0", (2, "E0105", ".0")),
        ("F100", "F100 G999", (2, "E0203", "G999")),
        ("F100", "F100 Q5", (2, "E0204", "Q")),
        ("X1 Y2", "X1O Y2", (10, "E0204", "O")),
        ("X1 Y2", "X1,5 Y2", (10, "E0105", ",")),
        ("F100", "F100 SOFTT", (2, "E0201", "SOFTT")),
    ];
    for (right, wrong, (line, code, marked)) in cases {
        let found = errors(&program.replacen(right, wrong, 1));
        assert_eq!(found.len(), 1, "{wrong}: {found:?}");
        assert!(found[0].0 == line && found[0].1 == code && found[0].2 == marked, "{wrong}: {found:?}");
    }
}

#[test]
fn lines_that_are_never_executed_are_checked_too() {
    let text = "M30\nX=NOWHERE\nG1 X1 Q2\nGOTOF\n";
    assert_eq!(errors(text).iter().map(|found| found.0).collect::<Vec<_>>(), [3, 4], "unreadable lines first");
    assert_eq!(
        errors("M30\nX=NOWHERE\nY=NOWHERE\nENDIF").iter().map(|found| (found.0, found.1)).collect::<Vec<_>>(),
        [(2, "E0301"), (4, "E0402")]
    );
}

#[test]
fn nearest_words_are_offered() {
    let help = |text: &str| {
        check(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz())[0].help.clone().unwrap_or_default()
    };
    assert!(help("GOTOX LAB").contains("GOTOF") || help("GOTOX LAB").contains("GOTO"), "{}", help("GOTOX LAB"));
    assert!(help("R1=SQTR(4)").contains("SQRT"));
    assert!(help("DEF REAL WIDTH\nX=WITDH").contains("WIDTH"));
    assert!(help("LABEL1: G0\nGOTOB LABLE1").contains("LABEL1"));
    assert!(help("G1 X1 F1 A5").contains("X, Y, Z"));
    assert!(help("G1 X1O F1").contains("digit 0"));
    assert!(help("G1 X1,5 F1").contains("point"));
    assert!(help("XR1").is_empty() || !help("XR1").contains("Sn="));
    let call = check(ProgramSource::from_bytes("a.mpf", *b"PLATE_CONTOUR(5)"), &xyz());
    assert!(call[0].code == "E0206" && call[0].message.contains("sub-program"), "{}", call[0].message);
}

#[test]
fn a_check_reports_each_finding_once_in_order() {
    let text = "G1 X500 F100\nCYCLE800(0.1)\nX499\nY1 G41\nR1=1/R2\nG41";
    let found = check(ProgramSource::from_bytes("a.mpf", text.as_bytes()), &xyz());
    let shown: Vec<_> = found.iter().map(|diagnostic| (diagnostic.line(), diagnostic.code)).collect();
    assert_eq!(shown, [(1, "W0002"), (2, "W0001"), (4, "W0001"), (5, "E0304")]);
}

#[test]
fn a_check_of_an_endless_program_ends() {
    let found = check(ProgramSource::from_bytes("a.mpf", *b"LOOP\nG0 X1\nX2\nENDLOOP"), &xyz());
    assert_eq!(
        found.iter().map(|diagnostic| (diagnostic.code, diagnostic.severity)).collect::<Vec<_>>(),
        [("W0003", Severity::Note)]
    );
}

#[test]
fn the_documentation_lists_exactly_the_words_not_acted_on() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/not-acted-on.md")).unwrap();
    let rows = text.lines().filter_map(|line| line.strip_prefix("| `")?.strip_suffix(" |")?.split_once("` | "));
    let documented: Vec<(&str, &str)> = rows.collect();
    let table: Vec<(&str, &str)> = NOT_ACTED_ON.iter().map(|entry| (entry.word, entry.consequence)).collect();
    assert_eq!(documented, table);
}

#[test]
fn the_documentation_names_every_warning() {
    let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/not-acted-on.md")).unwrap();
    for (code, title) in codes::CODES.iter().filter(|(code, _)| code.starts_with('W')) {
        assert!(text.contains(&format!("`{code}`")), "{code}: {title}");
    }
}

#[test]
fn words_and_codes_stand_once() {
    let words: Vec<_> = known_words().collect();
    assert!(words.windows(2).all(|pair| pair[0] < pair[1]), "sorted, and none twice");
    let unique: BTreeSet<_> = codes::CODES.iter().map(|(code, _)| code).collect();
    assert_eq!(unique.len(), codes::CODES.len());
}

#[test]
fn a_block_carries_its_spans() {
    let block = parse("  N10 LAB: X=1+R2*3 ; comment", &Dialect::new(&xyz())).unwrap();
    assert_eq!((block.number.unwrap().number, block.label.as_deref()), (10, Some("LAB")));
    let Statement::Words(words) = &block.statement else { panic!("words") };
    assert_eq!(words[0].columns, 11..19);
    let WordKind::Address(_, value) = &words[0].kind else { panic!("an address") };
    let ExprKind::Binary(_, operands) = &value.value.kind else { panic!("an operator") };
    assert_eq!(operands.1.columns, 15..19);
}

#[test]
fn deep_and_long_lines_are_refused_in_time() {
    for text in [
        format!("R1={}1{}", "(".repeat(100_000), ")".repeat(100_000)),
        format!("R1={}1", "-".repeat(100_000)),
        format!("R1={}1", "NOT ".repeat(100_000)),
        format!("R1=1{}", "+1".repeat(100_000)),
        format!("R1={}1{}", "R[".repeat(100_000), "]".repeat(100_000)),
        format!("CYCLE81({})", ",".repeat(100_000)),
        format!("R1={}1{}", "SIN(".repeat(100_000), ")".repeat(100_000)),
    ] {
        let found = errors(&text);
        assert_eq!((found.len(), found[0].1), (1, "E0107"));
    }
    // A long block is not a deep one.
    let many = "R1=1 ".repeat(100_000);
    assert_eq!(errors(&many), []);
}

const PIECES: &[&str] = &[
    "G0",
    "G1",
    "G2",
    "G3",
    "G4",
    "G9",
    "G17",
    "G18",
    "G53",
    "G70",
    "G90",
    "G91",
    "G642",
    "X",
    "Y",
    "Z",
    "B",
    "C",
    "I",
    "J",
    "CR=",
    "F",
    "S",
    "M",
    "T",
    "D",
    "R1",
    "R[",
    "]",
    "=",
    "==",
    "<",
    ">",
    "<>",
    "<<",
    "+",
    "-",
    "*",
    "/",
    "(",
    ")",
    ",",
    ";",
    ":",
    "1",
    "2.5",
    ".",
    "-3",
    "1EX3",
    "'HFF'",
    "\"",
    "\"A\"",
    "N10",
    "N20",
    " ",
    " ",
    " ",
    "\n",
    "\n",
    "\n",
    "\r\n",
    "IF ",
    "ELSE",
    "ENDIF",
    "FOR ",
    " TO ",
    "ENDFOR",
    "WHILE ",
    "ENDWHILE",
    "LOOP",
    "ENDLOOP",
    "REPEAT",
    "UNTIL ",
    "GOTOF ",
    "GOTOB ",
    "LAB",
    "LAB:",
    "CASE ",
    " OF ",
    "DEFAULT ",
    "DEF ",
    "INT ",
    "REAL ",
    "STRING[5] ",
    "AA",
    "SIN(",
    "SET(",
    "REP(",
    "AC(",
    "IC(",
    "TRANS ",
    "ATRANS ",
    "SUPA ",
    "MSG(",
    "CYCLE81(",
    "MCALL ",
    "M30",
    "SOFT",
    "TRAORI",
    "%",
    "$AA_IW[X]",
    "ä",
    "\u{0}",
    "_",
];

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_never_break_anything(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        run_bytes(&bytes, &xyzbc());
        for diagnostic in check(ProgramSource::from_bytes("r.mpf", bytes), &xyzbc()) {
            diagnostic.render(false);
        }
    }

    #[test]
    fn random_pieces_never_break_anything(pieces in proptest::collection::vec(proptest::sample::select(PIECES), 0..120)) {
        let text = pieces.concat();
        let source = ProgramSource::from_bytes("r.mpf", text.as_bytes());
        // A loop that moves for ever would keep the check busy: its run is bounded here.
        if run_bytes(text.as_bytes(), &xyzbc()).moves.len() < 100_000 {
            for diagnostic in check(&source, &xyzbc()) {
                diagnostic.render(false);
            }
        }
    }

    #[test]
    fn mutated_programs_never_break_anything(at in 0usize..2000, byte in any::<u8>(), cut in 0usize..40) {
        let mut bytes = include_bytes!("../../programs/pocket.mpf").to_vec();
        let at = at % bytes.len();
        bytes[at] = byte;
        bytes.drain(at..(at + cut).min(bytes.len()));
        let result = run_bytes(&bytes, &xyz());
        prop_assert!(result.moves.iter().all(|shown| shown.end.0.as_slice().iter().all(|value| value.is_finite())));
    }

    /// The fast path reads what it reads as the parser does: a skip sign keeps a line off it.
    #[test]
    fn the_fast_path_agrees_with_the_parser(
        lines in proptest::collection::vec(
            (0u8..4, "[+-]?[0-9]{0,6}\\.?[0-9]{0,6}", "[+-]?[0-9]{1,3}(\\.[0-9]{0,3})?", prop::sample::select(&["", " ", ";x", "EX1", "=5", " =5", "E", "Y", "_", "A"][..])),
            1..6,
        )
    ) {
        let text = |prefix: &str| {
            let mut text = String::from("G1 F100\n");
            for (g, x, y, tail) in &lines {
                text.push_str(&format!("{prefix}N5 G{g} X{x} Y{y}{tail}\n"));
            }
            text
        };
        let fast = run_bytes(text("").as_bytes(), &xyzbc());
        let slow = run_bytes(text("/").as_bytes(), &xyzbc());
        let alarm = |run: &crate::nc_machine::Run| run.alarm.as_ref().map(|alarm| (alarm.code, alarm.line(), alarm.message.clone()));
        prop_assert_eq!(alarm(&fast), alarm(&slow));
        let strip = |run: &crate::nc_machine::Run| run.moves.iter().map(|shown| (shown.block, shown.kind.clone(), shown.end, shown.feed.clone(), shown.modes.clone())).collect::<Vec<_>>();
        prop_assert_eq!(strip(&fast), strip(&slow));
        prop_assert_eq!(fast.warnings.len(), slow.warnings.len());
    }
}
