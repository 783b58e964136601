//! What is fuzzed: any bytes as a program. Used by the targets beside it, and by `tests/fuzz_corpus.rs` on stable Rust.
//!
//! In: bytes. Out: nothing; a panic if something is wrong. Nothing here judges what a program does: only that it ends, and ends well.

use sollwert::interpreter::{Interpreter, Listing};
use sollwert::machine::{self, Machine};
use sollwert::program::plain::plain_block;
use sollwert::program::{Dialect, ProgramSource, Window, parse, print};
use std::sync::LazyLock;

/// A program may loop for ever on purpose: so many moves are enough.
const MOVES_MAX: usize = 3_000;
/// And so many blocks: a loop that counts to 999999 between two moves is slow, and right.
const BLOCKS_MAX: u64 = 300_000;

static MACHINES: LazyLock<[Machine; 2]> = LazyLock::new(|| {
    ["spinner_mvc850", "huron_kx8_five"].map(|name| machine::load(name, &[]).expect("a shipped machine").machine)
});

/// Every line through the lexer, the parser and the fast path; what can be read comes back when it is printed.
pub fn text(bytes: &[u8]) {
    let source = ProgramSource::from_bytes("fuzz.mpf", bytes);
    for machine in &*MACHINES {
        let dialect = Dialect::new(machine);
        let mut cursor = source.first();
        let mut window = Window::default();
        while let Ok(Some((line, next))) = source.line(&mut window, cursor) {
            let _ = plain_block(&line, &dialect);
            let text = source.line_text(cursor);
            match parse(&text, &dialect) {
                Ok(block) => {
                    let printed = print(&block, &dialect);
                    let again = parse(&printed, &dialect)
                        .unwrap_or_else(|fault| panic!("`{text}` was printed as `{printed}`: {fault:?}"));
                    assert_eq!(print(&again, &dialect), printed, "`{text}`");
                }
                Err(fault) => {
                    let shown = fault.at("fuzz.mpf".into(), cursor.line, text);
                    assert!(!shown.render(false).is_empty());
                }
            }
            cursor = next;
        }
        let _ = source.structure();
    }
}

/// The program as a whole: moves, listing, warnings, alarm. The length of the text chooses the machine.
pub fn interpreter(bytes: &[u8]) {
    let machine = &MACHINES[bytes.len() % MACHINES.len()];
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("fuzz.mpf", bytes), machine);
    let mut listing = Listing::new(machine);
    for _ in 0..MOVES_MAX {
        match interpreter.next_move() {
            Ok(Some(next)) => {
                assert!(machine.axis_ids().all(|id| next.end.0[id].is_finite()), "{next:?}");
                assert!(!listing.line(&next).is_empty());
            }
            Ok(None) => break,
            Err(alarm) => {
                assert!(!alarm.render(false).is_empty());
                break;
            }
        }
        if interpreter.blocks() > BLOCKS_MAX {
            break;
        }
    }
    interpreter.take_warnings().iter().for_each(|warning| assert!(!warning.render(false).is_empty()));
}

/// Two traces in one input, the second behind a line of `%%%%`: they are compared, with budget and drift, and drawn.
#[allow(dead_code, reason = "tests/fuzz_corpus.rs has programs only")]
pub fn compare(bytes: &[u8]) {
    use sollwert::compare::{CompareOptions, document, prepare};
    const BORDER: &[u8] = b"\n%%%%\n";
    let border = bytes.windows(BORDER.len()).position(|window| window == BORDER);
    let parts = border.map_or([bytes, bytes], |at| [&bytes[..at], &bytes[at + BORDER.len()..]]);
    let path = |end: &str| std::env::temp_dir().join(format!("sollwert-fuzz-{}.{end}", std::process::id()));
    let read = |bytes: &[u8]| {
        std::fs::write(path("pair"), bytes).ok()?;
        let mut trace = sollwert::trace::import(&path("pair"), &sollwert::trace::ImportOptions::default()).ok()?;
        prepare(&mut trace);
        Some(trace)
    };
    let [Some(trace), Some(reference)] = parts.map(read) else { return };
    let options = CompareOptions { budget: true, drift: bytes.len().is_multiple_of(2), ..CompareOptions::default() };
    if let Ok(comparison) = sollwert::compare::compare(&trace, &reference, &options) {
        assert!(document(&comparison).is_object());
        let reference = Some((&reference, &comparison));
        let sheet = sollwert::report::Sheet { trace: &trace, side: &comparison.sides[0], reference };
        sollwert::report::write(&sheet, &path("html")).expect("a page");
    }
}

/// A trace of any format: it is read or refused, and what is read is in order. The importers read files, so that one is written.
#[allow(dead_code, reason = "tests/fuzz_corpus.rs has programs only")]
pub fn trace(bytes: &[u8]) {
    let path = std::env::temp_dir().join(format!("sollwert-fuzz-{}.trace", std::process::id()));
    if std::fs::write(&path, bytes).is_err() {
        return;
    }
    match sollwert::trace::import(&path, &sollwert::trace::ImportOptions::default()) {
        Ok(trace) => {
            for signal in &trace.signals {
                assert_eq!(signal.times.len(), signal.values.len(), "{}", signal.original);
                let next = signal.times.iter().skip(1);
                assert!(signal.times.iter().zip(next).all(|(one, next)| one < next), "{}", signal.original);
            }
            trace.notes.iter().for_each(|note| assert!(!note.render(false).is_empty()));
        }
        Err(finding) => assert!(!finding.render(false).is_empty()),
    }
}
