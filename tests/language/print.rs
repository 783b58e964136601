//! A printed block parses to the block that was printed: on every line of every program here, and on random lines of the grammar.
//!
//! Columns are left out of the comparison: they say where a word stands, and a printed line stands elsewhere.

use crate::nc_machine::{xyz, xyzbc};
use crate::random::Random;
use sollwert::program::{Block, Dialect, ProgramSource, Window, parse, print};
use std::path::{Path, PathBuf};

/// The tree as text, without columns.
fn tree(block: &Block) -> String {
    let text = format!("{block:?}");
    let mut bare = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("..") {
        let before = rest[..at].trim_end_matches(|letter: char| letter.is_ascii_digit());
        bare.push_str(before);
        rest = rest[at + 2..].trim_start_matches(|letter: char| letter.is_ascii_digit());
    }
    bare + rest
}

/// True if the line can be read at all.
fn comes_back(line: &str, dialect: &Dialect) -> bool {
    let Ok(block) = parse(line, dialect) else { return false };
    let printed = print(&block, dialect);
    let again =
        parse(&printed, dialect).unwrap_or_else(|fault| panic!("`{line}` was printed as `{printed}`: {fault:?}"));
    assert_eq!(tree(&again), tree(&block), "`{line}` was printed as `{printed}`");
    assert_eq!(print(&again, dialect), printed);
    true
}

fn programs(folder: PathBuf, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_program =
            ["mpf", "spf"].iter().any(|ending| path.extension().is_some_and(|has| has.eq_ignore_ascii_case(ending)));
        if path.is_dir() {
            programs(path, found);
        } else if is_program {
            found.push(path);
        }
    }
}

#[test]
fn every_line_of_every_program_comes_back() {
    let mut paths = Vec::new();
    for folder in ["programs", "tests"] {
        programs(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut paths);
    }
    let dialects = [Dialect::new(&xyz()), Dialect::new(&xyzbc())];
    let mut lines = 0;
    for path in paths {
        let source = ProgramSource::from_file(&path).unwrap();
        let (mut cursor, mut window) = (source.first(), Window::default());
        while let Some((_, next)) = source.line(&mut window, cursor).unwrap() {
            lines += usize::from(dialects.iter().any(|dialect| comes_back(&source.line_text(cursor), dialect)));
            cursor = next;
        }
    }
    assert!(lines > 600, "{lines} lines were read");
}

/// Writes random lines that a programmer could have written.
struct Grammar {
    random: Random,
}

impl Grammar {
    fn below(&mut self, count: u32) -> usize {
        self.random.below(count) as usize
    }

    fn one_of<'a>(&mut self, words: &[&'a str]) -> &'a str {
        words[self.below(words.len() as u32)]
    }

    fn number(&mut self) -> String {
        match self.below(7) {
            0 => self.below(1000).to_string(),
            1 => format!("{}.{}", self.below(100), self.below(1000)),
            2 => format!(".{}", self.below(100)),
            3 => format!("{}EX{}", self.below(10), self.below(40)),
            4 => format!("{}.", self.below(100)),
            5 => self
                .one_of(&["'HFF'", "'B101'", "'H80000000'", "2147483648", "1EX-12", "0.1EX-3", "00", "3."])
                .to_owned(),
            _ => format!("{}", self.below(1 << 31)),
        }
    }

    fn expression(&mut self, depth: usize) -> String {
        if depth == 0 {
            return match self.below(6) {
                0 => format!("R{}", self.below(100)),
                1 => self
                    .one_of(&[
                        "WIDTH",
                        "level",
                        "_A1",
                        "TRUE",
                        "FALSE",
                        "\"TEXT\"",
                        "\"\"",
                        "$P_EP[X]",
                        "CTRANS(X,1):CROT(Z,2)",
                    ])
                    .to_owned(),
                _ => self.number(),
            };
        }
        match self.below(8) {
            0 => format!("({})", self.expression(depth - 1)),
            1 => format!("{}{}", self.one_of(&["-", "+", "NOT ", "B_NOT ", "- -"]), self.expression(depth - 1)),
            2 => {
                format!("{}({})", self.one_of(&["SIN", "sqrt", "ABS", "TRUNC", "ROUNDUP"]), self.expression(depth - 1))
            }
            3 => format!("R[{}]", self.expression(depth - 1)),
            4 => format!("LEVEL[{},{}]", self.expression(depth - 1), self.expression(0)),
            _ => {
                const OPERATORS: [&str; 19] = [
                    "*", "/", " DIV ", " MOD ", "+", "-", " B_AND ", " B_XOR ", " B_OR ", " AND ", " XOR ", " OR ",
                    "<<", "==", "<>", ">", "<", ">=", "<=",
                ];
                let (left, right) = (self.expression(depth - 1), self.expression(depth - 1));
                format!("{left}{}{right}", self.one_of(&OPERATORS))
            }
        }
    }

    fn word(&mut self) -> String {
        let value = self.expression(2);
        let number = self.number();
        let sign = self.one_of(&["", "-", "+"]);
        match self.below(14) {
            0 => format!("{}{sign}{number}", self.one_of(&["X", "y", "Z"])),
            1 => format!("X={}({value})", self.one_of(&["AC", "ic", "DC", "ACP", "ACN", "QU"])),
            2 => self
                .one_of(&["G0", "G1", "g02", "G17", "G54", "G509", "G60", "G642", "G70", "G95", "G601", "G111"])
                .to_owned(),
            3 => format!(
                "{}={value}",
                self.one_of(&["I", "J", "K", "CR", "TURN", "F", "ADIS", "CTOL", "RPL", "AP", "FB"])
            ),
            4 => self
                .one_of(&["SOFT", "FFWON", "ATRANS", "CIP", "BNAT", "COMPCAD", "DYNROUGH", "SUPA", "RTLIOF"])
                .to_owned(),
            5 => format!("M{}", self.below(100)),
            6 => format!("S{}={value}", 1 + self.below(3)),
            7 => format!("T=\"MILL_{}\"", self.below(100)),
            8 => format!("MSG({value})"),
            9 => format!("R[{value}]={}", self.expression(1)),
            10 => format!("LEVEL[1]={}", self.one_of(&["SET(1,,2)", "REP(3)", "REP(3,R1)", "5"])),
            11 => format!("{}[X]={value}", self.one_of(&["ACC", "POS", "FA", "PO", "ATOL"])),
            12 => format!("PO[]=({value},,{number})"),
            _ => format!("{}({value})", self.one_of(&["FGROUP", "CYCLE832", "WAITP"])),
        }
    }

    fn jump(&mut self) -> String {
        let word = self.one_of(&["GOTO", "GOTOF", "gotob", "GOTOC"]);
        let place = match self.below(4) {
            0 => "LABEL".to_owned(),
            1 => format!("N{}", self.below(1000)),
            2 => format!("{}", self.below(1000)),
            _ => format!("\"LAB\"<<{}", self.expression(1)),
        };
        if self.below(8) == 0 { "GOTOS".to_owned() } else { format!("{word} {place}") }
    }

    fn line(&mut self) -> String {
        let head = ["", "/", "/3 ", "N10 ", "N20 ABC: ", ":30 ", "/1 N40 ", "  "];
        let mut line = self.one_of(&head).to_owned();
        let value = self.expression(3);
        line += &match self.below(12) {
            0 => format!("IF {value}"),
            1 => format!("IF {value} {}", self.jump()),
            2 => format!("FOR {}={value} TO {}", self.one_of(&["R1", "I_", "LEVEL[2]"]), self.expression(1)),
            3 => format!("{} {value}", self.one_of(&["WHILE", "UNTIL"])),
            4 => self.jump(),
            5 => format!("CASE {value} OF 1 {} -2 GOTOF A_B DEFAULT {}", self.jump(), self.jump()),
            6 => format!(
                "DEF {} AB=5, CD[3]=SET(1,{value}), EF[2,R1]=REP({value},2)",
                self.one_of(&["REAL", "INT", "STRING[20]"])
            ),
            7 => self.one_of(&["ELSE", "ENDIF", "ENDFOR", "ENDWHILE", "LOOP", "ENDLOOP", "REPEAT"]).to_owned(),
            _ => {
                let count = self.below(5);
                (0..count).map(|_| self.word()).collect::<Vec<_>>().join(" ")
            }
        };
        if self.below(6) == 0 {
            line += " ; a comment";
        }
        line
    }
}

#[test]
fn random_lines_come_back() {
    const SEED: u64 = 20_190_412;
    let mut grammar = Grammar { random: Random::new(SEED) };
    let dialect = Dialect::new(&xyz());
    let read = (0..20_000).filter(|_| comes_back(&grammar.line(), &dialect)).count();
    assert!(read > 10_000, "{read} of 20000 lines were read, seed {SEED}");
}
