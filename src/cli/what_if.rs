//! How `time` shows what each datum costs.
//!
//! In: a [`WhatIf`], the program's text. Out: JSON, or lines for people: "N1240-N1312: X jerk (MD32431); +10 % saves 2.1 s". Does not
//! compute any of them.

use crate::kernel::{Saving, WhatIf};
use crate::program::ProgramSource;
use serde_json::{Value, json};

/// Lines at most this far apart are one place.
const PLACE_LINES: u32 = 3;

/// Savings that a person wants to see: not below this, and not more of them.
const SAVES_MIN_S: f64 = 5e-4;
const SHOWN_MAX: usize = 12;

pub(super) fn json_of(what_if: &WhatIf) -> Value {
    let saving = |saving: &Saving| {
        let lines: Vec<u32> = saving.lines.iter().map(|(line, _)| *line).collect();
        json!({
            "key": saving.key,
            "machine_data": saving.machine_data,
            "change_percent": saving.change_percent,
            "saves_s": saving.saves_s,
            "binds_s": saving.binds_s,
            "lines": lines,
        })
    };
    Value::Array(what_if.savings.iter().map(saving).collect())
}

pub(super) fn text_of(what_if: &WhatIf, program: &ProgramSource) -> String {
    let mut text = "\nwhat each datum costs\n".to_owned();
    let shown = what_if.savings.iter().filter(|saving| saving.saves_s >= SAVES_MIN_S);
    let mut any = false;
    for saving in shown.take(SHOWN_MAX) {
        any = true;
        let Saving { words, machine_data, key, change_percent, saves_s, .. } = saving;
        let name = if machine_data.is_empty() { key } else { machine_data };
        let place = place_of(saving, program);
        text += &format!("  {place}: {words} ({name}); +{change_percent} % saves {saves_s:.3} s\n");
    }
    if !any {
        text += "  nothing: no datum of the axes or of the control holds the motion back\n";
    }
    if what_if.cut_short {
        text += &format!("  (of the first {} blocks)\n", what_if.moves);
    }
    text
}

/// "N1240-N1312": where it binds longest, and in how many other places.
fn place_of(saving: &Saving, program: &ProgramSource) -> String {
    let mut places: Vec<([u32; 2], f64)> = Vec::new();
    for (line, time_s) in &saving.lines {
        match places.last_mut() {
            Some((range, sum_s)) if line - range[1] <= PLACE_LINES => {
                range[1] = *line;
                *sum_s += time_s;
            }
            _ => places.push(([*line, *line], *time_s)),
        }
    }
    let Some((range, _)) = places.iter().reduce(|most, next| if next.1 > most.1 { next } else { most }) else {
        return "in sub-programs".to_owned();
    };
    let [from, to] = range.map(|line| block_name(line, program));
    let place = if range[0] == range[1] { from } else { format!("{from}-{to}") };
    match places.len() {
        1 => place,
        2 => format!("{place} and another place"),
        count => format!("{place} and {} more places", count - 1),
    }
}

/// The block number if the block has one.
fn block_name(line: u32, program: &ProgramSource) -> String {
    let number = program.text_of_line(line).and_then(|text| {
        let text = text.trim_start().trim_start_matches(|c: char| c == '/' || c.is_ascii_digit()).trim_start();
        let digits: String = text.strip_prefix(['N', 'n'])?.chars().take_while(char::is_ascii_digit).collect();
        (!digits.is_empty()).then(|| format!("N{digits}"))
    });
    number.unwrap_or_else(|| format!("line {line}"))
}
