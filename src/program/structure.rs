//! The map of a program: where its labels are, and which IF belongs to which ENDIF.
//!
//! In: a [`ProgramSource`], scanned once, line heads only. Out: [`Structure`]: jumps and loops never rescan the file. Its size grows
//! with labels and control words, not with lines. Block numbers are not kept (every line may have one): they are searched.

use super::codes::Outcome;
use super::source::{Cursor, ProgramSource, Window};
use super::syntax::Direction;
use super::words::{self, Control, Role};
use std::collections::BTreeMap;

/// Labels and partners of control words.
#[derive(Debug, Default)]
pub struct Structure {
    /// Lines of each label, in capitals, in order.
    labels: BTreeMap<String, Vec<Cursor>>,
    /// From the line of a control word to the line of its partner: IF to ELSE or ENDIF, ELSE to ENDIF, FOR to ENDFOR and back, ...
    partners: BTreeMap<u32, Cursor>,
    /// Lines of control words without a partner, with the word and the one that is missing.
    unmatched: BTreeMap<u32, Unmatched>,
}

/// A control word without its partner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unmatched {
    /// Where it stands.
    pub cursor: Cursor,
    /// The word that is there.
    pub word: &'static str,
    /// The word that is not.
    pub missing: &'static str,
}

/// A control word that waits for its end.
struct Open {
    control: Control,
    cursor: Cursor,
}

impl Structure {
    /// Reads the heads of all lines.
    pub(super) fn scan(source: &ProgramSource) -> Outcome<Self> {
        let mut structure = Self::default();
        let mut open: Vec<Open> = Vec::new();
        let mut cursor = source.first();
        let mut window = Window::default();
        while let Some((line, next)) = source.line(&mut window, cursor)? {
            let line = &*line;
            let (label, word) = head(line);
            if let Some(label) = label {
                let label = String::from_utf8_lossy(label).to_ascii_uppercase();
                structure.labels.entry(label).or_default().push(cursor);
            }
            if let Some(control) = word.and_then(|word| structural(word, line)) {
                structure.enter(control, cursor, &mut open);
            }
            cursor = next;
        }
        while let Some(left) = open.pop() {
            structure.miss(left.control, left.cursor);
        }
        Ok(structure)
    }

    /// The line of the partner of the control word in `line`.
    pub fn partner(&self, line: u32) -> Option<Cursor> {
        self.partners.get(&line).copied()
    }

    /// What is missing to the control word in `line`.
    pub fn unmatched(&self, line: u32) -> Option<Unmatched> {
        self.unmatched.get(&line).copied()
    }

    /// All control words without a partner.
    pub fn all_unmatched(&self) -> impl Iterator<Item = Unmatched> {
        self.unmatched.values().copied()
    }

    /// The nearest line with `label` (in capitals) as seen from `from`.
    pub fn label(&self, label: &str, from: u32, direction: Direction) -> Option<Cursor> {
        let lines = self.labels.get(label)?;
        let after = lines.partition_point(|cursor| cursor.line <= from);
        let forward = lines.get(after).copied();
        let backward = after.checked_sub(1).map(|before| lines[before]);
        match direction {
            Direction::Forward => forward,
            Direction::Backward => backward,
            // Towards the end first, then the first one from the start of the program.
            Direction::Both | Direction::BothQuiet => forward.or_else(|| backward.and(lines.first().copied())),
            Direction::Start => None,
        }
    }

    /// Names of all labels: for help texts.
    pub fn label_names(&self) -> impl Iterator<Item = &str> {
        self.labels.keys().map(String::as_str)
    }

    fn enter(&mut self, control: Control, cursor: Cursor, open: &mut Vec<Open>) {
        let Some(opener) = opener(control) else {
            open.push(Open { control, cursor });
            return;
        };
        // The nearest open word that this one can belong to; what was opened inside and not closed lacks its end.
        let fits = |waiting: &Open| {
            waiting.control == opener || (control == Control::EndIf && waiting.control == Control::Else)
        };
        let Some(found) = open.iter().rposition(fits) else {
            self.miss(control, cursor);
            return;
        };
        for left in open.drain(found + 1..).rev().collect::<Vec<_>>() {
            self.miss(left.control, left.cursor);
        }
        let Some(partner) = open.pop() else { return };
        self.partners.insert(partner.cursor.line, cursor);
        match control {
            Control::Else => open.push(Open { control, cursor }),
            _ => _ = self.partners.insert(cursor.line, partner.cursor),
        }
    }

    fn miss(&mut self, control: Control, cursor: Cursor) {
        let (word, missing) = names(control);
        self.unmatched.insert(cursor.line, Unmatched { cursor, word, missing });
    }
}

/// The word that opens what `control` closes.
fn opener(control: Control) -> Option<Control> {
    match control {
        Control::Else | Control::EndIf => Some(Control::If),
        Control::EndFor => Some(Control::For),
        Control::EndWhile => Some(Control::While),
        Control::EndLoop => Some(Control::Loop),
        Control::Until => Some(Control::Repeat),
        _ => None,
    }
}

/// Word and missing partner.
fn names(control: Control) -> (&'static str, &'static str) {
    match control {
        Control::If => ("IF", "ENDIF"),
        Control::Else => ("ELSE", "IF or ENDIF"),
        Control::EndIf => ("ENDIF", "IF"),
        Control::For => ("FOR", "ENDFOR"),
        Control::EndFor => ("ENDFOR", "FOR"),
        Control::While => ("WHILE", "ENDWHILE"),
        Control::EndWhile => ("ENDWHILE", "WHILE"),
        Control::Loop => ("LOOP", "ENDLOOP"),
        Control::EndLoop => ("ENDLOOP", "LOOP"),
        Control::Repeat => ("REPEAT", "UNTIL"),
        Control::Until => ("UNTIL", "REPEAT"),
        _ => ("", ""),
    }
}

/// Block number of a line, without decoding it: for jumps to block numbers.
pub fn number_of(line: &[u8]) -> Option<u64> {
    let mut at = skip_blanks_and_level(line);
    if !matches!(line.get(at), Some(b'N' | b'n' | b':')) {
        return None;
    }
    at += 1;
    let digits = &line[at..];
    let count = digits.iter().take_while(|byte| byte.is_ascii_digit()).count();
    if count == 0 {
        return None;
    }
    digits[..count].iter().try_fold(0_u64, |number, digit| number.checked_mul(10)?.checked_add(u64::from(digit - b'0')))
}

/// Skip level of a line, without decoding it: `/` and `/0` are level 0.
pub fn skip_level_of(line: &[u8]) -> Option<u8> {
    let mut at = blanks(line);
    if line.get(at) != Some(&b'/') {
        // The level may stand behind the block number.
        number_of(line)?;
        at += 1 + blanks(&line[at + 1..]);
        at += line[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        at += blanks(&line[at..]);
    }
    if line.get(at) != Some(&b'/') {
        return None;
    }
    let digit = line.get(at + 1).filter(|byte| byte.is_ascii_digit());
    Some(digit.map_or(0, |digit| digit - b'0'))
}

/// Label and first word of a line.
fn head(line: &[u8]) -> (Option<&[u8]>, Option<&[u8]>) {
    let mut at = skip_blanks_and_level(line);
    if number_of(line).is_some() {
        at += 1;
        at += line[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    }
    at += blanks(&line[at..]);
    let word = word_at(line, at);
    let Some(found) = word else { return (None, None) };
    let behind = at + found.len() + blanks(&line[at + found.len()..]);
    if found.len() > 1 && line.get(behind) == Some(&b':') {
        let next = behind + 1 + blanks(&line[behind + 1..]);
        return (Some(found), word_at(line, next));
    }
    (None, word)
}

fn skip_blanks_and_level(line: &[u8]) -> usize {
    let mut at = blanks(line);
    if line.get(at) == Some(&b'/') {
        at += 1;
        at += line[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        at += blanks(&line[at..]);
    }
    at
}

fn blanks(bytes: &[u8]) -> usize {
    bytes.iter().take_while(|byte| matches!(byte, b' ' | b'\t' | b'\r')).count()
}

fn word_at(line: &[u8], at: usize) -> Option<&[u8]> {
    let rest = line.get(at..)?;
    let first = rest.first()?;
    if !(first.is_ascii_alphabetic() || *first == b'_') {
        return None;
    }
    let length = rest.iter().take_while(|byte| byte.is_ascii_alphanumeric() || **byte == b'_').count();
    Some(&rest[..length])
}

/// The control word, if `word` is one that has a partner. An IF with a jump in the same line has none.
fn structural(word: &[u8], line: &[u8]) -> Option<Control> {
    // Most lines end here: an axis word is no name of two letters.
    if word.len() < 2 || !matches!(word[0].to_ascii_uppercase(), b'I' | b'E' | b'F' | b'W' | b'L' | b'R' | b'U') {
        return None;
    }
    let Some(Role::Control(control)) = std::str::from_utf8(word).ok().and_then(words::role) else { return None };
    match control {
        Control::If if has_jump(line) => None,
        Control::Repeat if !repeat_stands_alone(line) => None,
        control => (!names(control).0.is_empty()).then_some(control),
    }
}

/// True if GOTO stands in the line, outside texts and comments.
fn has_jump(line: &[u8]) -> bool {
    let mut in_text = false;
    for (i, byte) in line.iter().enumerate() {
        match byte {
            b'"' => in_text = !in_text,
            b';' if !in_text => return false,
            b'G' | b'g' if !in_text => {
                let begins_word = i == 0 || !(line[i - 1].is_ascii_alphanumeric() || line[i - 1] == b'_');
                if begins_word && line.len() >= i + 4 && line[i..i + 4].eq_ignore_ascii_case(b"GOTO") {
                    return true;
                }
            }
            _ => {}
        }
    }
    false
}

/// REPEAT with a label behind it repeats blocks: it has no UNTIL.
fn repeat_stands_alone(line: &[u8]) -> bool {
    let text = line.to_ascii_uppercase();
    let behind = text.windows(6).position(|window| window == b"REPEAT").map_or(&[][..], |at| &text[at + 6..]);
    matches!(behind.get(blanks(behind)), None | Some(b';'))
}
