//! Two machines, and short ways to run a program: for tests and benches of the rooms `program` and `interpreter`.
#![allow(dead_code)]

#[path = "../test_machine/mod.rs"]
pub mod test_machine;

use sollwert::base::Diagnostic;
use sollwert::interpreter::{Interpreter, Listing, Move};
use sollwert::machine::Machine;
use sollwert::program::ProgramSource;
use std::sync::LazyLock;

/// The Spinner MVC 850: three linear axes.
pub fn xyz() -> Machine {
    // Once: thousands of random programs run on it.
    static MACHINE: LazyLock<Machine> = LazyLock::new(|| test_machine::shipped("spinner_mvc850", &[]));
    MACHINE.clone()
}

/// Head B, table C (endless), all at home at 0.
pub fn xyzbc() -> Machine {
    static MACHINE: LazyLock<Machine> = LazyLock::new(|| {
        let sets = [
            "axes.X.travel_mm=[-400, 400]",
            "axes.Y.travel_mm=[-300, 300]",
            "axes.Z.travel_mm=[-100, 650]",
            "axes.B.travel_deg=[-110, 110]",
            "axes.C.modulo=true",
        ];
        test_machine::with_axes(&["X", "Y", "Z", "B", "C"], &sets)
    });
    MACHINE.clone()
}

/// What a program comes to.
pub struct Run {
    pub moves: Vec<Move>,
    pub warnings: Vec<Diagnostic>,
    pub alarm: Option<Diagnostic>,
    /// `.moves` text.
    pub listing: String,
}

/// Runs bytes on a machine, at most a million moves.
pub fn run_bytes(bytes: &[u8], machine: &Machine) -> Run {
    let mut interpreter = Interpreter::new(ProgramSource::from_bytes("test.mpf", bytes), machine);
    let mut listing = Listing::new(machine);
    let mut run = Run { moves: Vec::new(), warnings: Vec::new(), alarm: None, listing: String::new() };
    for _ in 0..1_000_000 {
        match interpreter.next_move() {
            Ok(Some(next)) => {
                run.listing.push_str(&listing.line(&next));
                run.listing.push('\n');
                run.moves.push(next);
            }
            Ok(None) => break,
            Err(alarm) => {
                run.alarm = Some(*alarm);
                assert_eq!(interpreter.next_move(), Ok(None), "nothing comes after an alarm");
                break;
            }
        }
    }
    run.warnings = interpreter.take_warnings();
    run
}

/// Runs a program on [`xyz`].
pub fn run(text: &str) -> Run {
    run_bytes(text.as_bytes(), &xyz())
}

impl Run {
    /// Lines of the listing without modes and without the opening of the program, for short comparisons.
    pub fn lines(&self) -> Vec<String> {
        assert!(self.alarm.is_none(), "{}", self.alarm.as_ref().unwrap().render(false));
        self.bare_lines()
    }

    /// The same, whatever happened at the end.
    pub fn bare_lines(&self) -> Vec<String> {
        let without = |line: &str, from: &str, to: &str| match line.split_once(from) {
            Some((before, rest)) => format!("{before}{}", rest.split_once(to).map_or("", |(_, after)| after)),
            None => line.to_owned(),
        };
        let bare = |line: &str| without(&without(line, " [", "]"), " open=\"", "\"");
        self.listing.lines().map(bare).collect()
    }

    /// The alarm.
    pub fn alarm(&self) -> &Diagnostic {
        self.alarm.as_ref().expect("the program raises an alarm")
    }
}
