//! From a controller's name of a signal to a head: axis, our name, unit, factor.
//!
//! In: names as they stand in a file; the signal map; machine, `--axis-name` and `--map`. Out: a [`Head`] and the factor that brings
//! the values of the file into its unit; findings about names that nobody gave. Two signals never get the same name of ours: the
//! higher row of the map wins, the other keeps its own name. Does not read files.

use super::import::ImportOptions;
use super::signal_map::{Quantity, Rule, SIGNAL_MAP, rule_for};
use super::sink::Head;
use super::wire::{AxisSignal, Meaning, TraceFormat, axis_signal_name};
use crate::base::units::{deg_from_rad, mm_s_from_mm_min, rad_s_from_rpm};
use crate::base::{AxisKind, Diagnostic};
use crate::recorder::AXIS_FIELDS;
use std::collections::{BTreeMap, BTreeSet};

/// A controller's name, taken apart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Named {
    /// Name without path, width and axis.
    pub(super) stem: String,
    /// Axis by number or by name.
    pub(super) axis: AxisMark,
}

/// How a file tells an axis.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum AxisMark {
    /// Not at all.
    #[default]
    None,
    /// Number of the machine axis (Siemens, from 1) or of the joint (LinuxCNC, from 0).
    Number(u32),
    /// By name.
    Name(String),
}

/// A signal with the factor of its values.
#[derive(Clone, Debug, Default)]
pub(super) struct NamedHead {
    pub(super) head: Head,
    /// Value in the unit of the head = value in the file * factor.
    pub(super) factor: f64,
    rank: usize,
}

/// Finds names.
pub(super) struct Naming<'a> {
    format: TraceFormat,
    options: &'a ImportOptions<'a>,
    /// Names of axes by number as the file itself tells them: they come after what the user and the machine say.
    pub(super) of_file: BTreeMap<u32, String>,
    /// Sort of the axes that nobody named, as their signals say.
    pub(super) guessed: BTreeMap<u32, AxisKind>,
    unnamed: BTreeSet<u32>,
    assumed_linear: BTreeSet<String>,
    pub(super) notes: Vec<Diagnostic>,
}

impl<'a> Naming<'a> {
    pub(super) fn new(format: TraceFormat, options: &'a ImportOptions<'a>) -> Self {
        Self {
            format,
            options,
            of_file: BTreeMap::new(),
            guessed: BTreeMap::new(),
            unnamed: BTreeSet::new(),
            assumed_linear: BTreeSet::new(),
            notes: Vec::new(),
        }
    }

    /// Head and factor of a signal.
    pub(super) fn head(&mut self, original: &str, named: &Named, period_s: Option<f64>) -> NamedHead {
        let format = self.format;
        self.head_in(format, original, named, period_s)
    }

    /// Head of a signal whose name is in the manner of another format: any name may stand in a table.
    pub(super) fn head_of(&mut self, format: TraceFormat, original: &str, named: &Named) -> NamedHead {
        let own = std::mem::replace(&mut self.format, format);
        let head = self.head_in(format, original, named, None);
        self.format = own;
        head
    }

    fn head_in(&mut self, format: TraceFormat, original: &str, named: &Named, period_s: Option<f64>) -> NamedHead {
        let rule = rule_for(format, &named.stem);
        let axis = self.axis(&named.axis);
        let kind = axis.as_ref().map_or(AxisKind::Linear, |(_, kind)| *kind);
        let (unit, factor) = rule.map_or(("", 1.0), |rule| unit_and_factor(rule.quantity, kind));
        let name = self.mapped(original, named).or_else(|| {
            let (axis, kind) = axis.as_ref()?;
            axis_signal_name(axis, *kind, rule.filter(|rule| !rule.ours.is_empty())?.ours)
        });
        let unit = match (unit, name.as_deref().and_then(AxisSignal::parse)) {
            ("", Some(signal)) => AXIS_FIELDS[signal.field].unit_name(signal.kind),
            (unit, _) => unit,
        };
        let delay_cycles = rule.map_or(0, |rule| rule.delay_cycles);
        let meaning = Meaning {
            delay_s: f64::from(delay_cycles) * period_s.unwrap_or(0.0),
            zero: rule.map(|rule| rule.zero).unwrap_or_default(),
            remark: rule.map_or("", |rule| rule.remark).to_owned(),
        };
        let rank = rule.and_then(|rule| SIGNAL_MAP.iter().position(|row: &Rule| row == rule)).unwrap_or(usize::MAX);
        let head =
            Head { name, original: original.to_owned(), unit: unit.to_owned(), meaning, period_s, ..Head::default() };
        NamedHead { head, factor, rank }
    }

    /// `--map`: by the whole name or by the name without axis; to a whole name of ours or to a field.
    fn mapped(&mut self, original: &str, named: &Named) -> Option<String> {
        let row = self.options.signal_map.iter().find(|(theirs, _)| theirs == original || *theirs == named.stem)?;
        if row.1.contains('.') {
            return Some(row.1.clone());
        }
        let (axis, kind) = self.axis(&named.axis)?;
        axis_signal_name(&axis, kind, &row.1)
    }

    /// Name and sort of an axis.
    pub(super) fn axis(&mut self, mark: &AxisMark) -> Option<(String, AxisKind)> {
        let (number, name) = match mark {
            AxisMark::None => return None,
            AxisMark::Name(name) => (None, Some(name.clone())),
            AxisMark::Number(number) => (Some(*number), self.name_of(*number)),
        };
        let Some(name) = name else {
            let number = number.unwrap_or(0);
            self.unnamed.insert(number);
            let kind = self.guessed.get(&number).copied().unwrap_or(AxisKind::Linear);
            return Some((format!("AX{number}"), kind));
        };
        let of_machine = self.options.machine.and_then(|machine| machine.axes.iter().find(|axis| axis.name == name));
        let by_signals = number.and_then(|number| self.guessed.get(&number).copied());
        let kind = of_machine.map(|axis| axis.kind).or_else(|| kind_by_letter(&name)).or(by_signals);
        if kind.is_none() {
            self.assumed_linear.insert(name.clone());
        }
        Some((name, kind.unwrap_or(AxisKind::Linear)))
    }

    fn name_of(&self, number: u32) -> Option<String> {
        if let Some((_, name)) = self.options.axis_names.iter().find(|(given, _)| *given == number) {
            return Some(name.clone());
        }
        if matches!(self.format, TraceFormat::Halscope | TraceFormat::Halsampler) {
            // Trivial kinematics: joint 0 is X and so on.
            return "XYZABCUVW".chars().nth(number as usize).map(String::from);
        }
        self.of_machine(number).or_else(|| self.of_file.get(&number).cloned())
    }

    fn of_machine(&self, number: u32) -> Option<String> {
        let machine = self.options.machine?;
        let by_name = machine.axes.iter().find(|axis| {
            let digits =
                axis.machine_axis.as_deref().map(|name| name.trim_start_matches(|c: char| !c.is_ascii_digit()));
            digits.and_then(|digits| digits.parse().ok()) == Some(number)
        });
        by_name.or_else(|| machine.axes.iter().find(|axis| axis.index == number)).map(|axis| axis.name.clone())
    }

    /// Numbers of axes whose sort nobody told.
    pub(super) fn is_open(&self, number: u32) -> bool {
        match self.name_of(number) {
            None => true,
            Some(name) => {
                let of_machine = self.options.machine.is_some_and(|m| m.axes.iter().any(|axis| axis.name == name));
                !of_machine && kind_by_letter(&name).is_none()
            }
        }
    }

    /// Takes names back that two signals share, and says what was found about names.
    pub(super) fn settle(&mut self, heads: &mut [NamedHead]) {
        let mut best: BTreeMap<String, (usize, usize)> = BTreeMap::new();
        for (place, head) in heads.iter().enumerate() {
            let Some(name) = &head.head.name else { continue };
            let entry = best.entry(name.clone()).or_insert((place, head.rank));
            if head.rank < entry.1 {
                *entry = (place, head.rank);
            }
        }
        for (place, entry) in heads.iter_mut().enumerate() {
            let Some(name) = entry.head.name.clone() else { continue };
            let winner = best.get(&name).map_or(place, |(winner, _)| *winner);
            if winner != place {
                entry.head.name = None;
                let message =
                    format!("`{}` could be `{name}` too, but another signal has that name", entry.head.original);
                self.notes.push(Diagnostic::note("T0021", message).help("choose with --map CONTROLLER=OURS"));
            }
        }
        for number in std::mem::take(&mut self.unnamed) {
            let sort = match self.guessed.get(&number) {
                Some(AxisKind::Rotary) => "its speed and position say that it is rotary",
                Some(AxisKind::Linear) => "its speed and position say that it is linear",
                None => "it is taken as linear",
            };
            let message = format!("axis {number} has no name: it is called `AX{number}`, and {sort}");
            self.notes.push(
                Diagnostic::note("T0011", message)
                    .help(format!("name it with --axis-name {number}=X, or give the machine with -m")),
            );
        }
        for name in std::mem::take(&mut self.assumed_linear) {
            let message = format!("axis `{name}` is taken as linear (mm): nothing says otherwise");
            self.notes.push(Diagnostic::note("T0012", message).help("give the machine with -m"));
        }
    }
}

/// X, Y, Z, U, V, W are linear, A, B, C and spindles (S, SP) rotary, with or without a number behind.
fn kind_by_letter(name: &str) -> Option<AxisKind> {
    let mut characters = name.chars();
    let letter = characters.next()?.to_ascii_uppercase();
    let rest = characters.as_str();
    let rest = if letter == 'S' { rest.trim_start_matches(['P', 'p']) } else { rest }.trim_start_matches('_');
    if !rest.chars().all(|c| c.is_ascii_digit()) {
        return None;
    }
    match letter {
        'X' | 'Y' | 'Z' | 'U' | 'V' | 'W' => Some(AxisKind::Linear),
        'A' | 'B' | 'C' | 'S' => Some(AxisKind::Rotary),
        _ => None,
    }
}

/// Our unit of a quantity, and what a number of the file is multiplied by.
pub(super) fn unit_and_factor(quantity: Quantity, kind: AxisKind) -> (&'static str, f64) {
    let rotary = kind == AxisKind::Rotary;
    match quantity {
        Quantity::Position => (if rotary { "deg" } else { "mm" }, 1.0),
        Quantity::Velocity => (if rotary { "deg/s" } else { "mm/s" }, 1.0),
        Quantity::VelocityPerMinute if rotary => ("deg/s", deg_from_rad(rad_s_from_rpm(1.0)).round()),
        Quantity::VelocityPerMinute => ("mm/s", mm_s_from_mm_min(1.0)),
        Quantity::Acceleration => (if rotary { "deg/s^2" } else { "mm/s^2" }, 1.0),
        Quantity::MotorSpeed => ("rad/s", rad_s_from_rpm(1.0)),
        Quantity::Torque => ("N m", 1.0),
        Quantity::Current => ("A", 1.0),
        Quantity::Percent => ("%", 1.0),
        Quantity::Power => ("W", 1.0),
        Quantity::Unknown => ("", 1.0),
    }
}

/// `/Nck/!SD/nckServoDataCmdPos2ndEnc64 [u1, 7]` -> `CmdPos2ndEnc`, axis 7. Signals of channels and R parameters have no axis.
pub(super) fn operate_name(original: &str) -> Named {
    let name = original.trim_start_matches(['$', '+']).trim();
    let (path, index) = match name.find('[') {
        Some(open) => (name[..open].trim_end(), name[open + 1..].trim_end_matches(']')),
        None => (name, ""),
    };
    let last = path.rsplit('/').next().unwrap_or(path);
    let bare = last
        .strip_prefix("nckServoData")
        .map_or(last, |rest| rest.strip_suffix("64").or_else(|| rest.strip_suffix("32")).unwrap_or(rest));
    // `[u1, 7]`, in tables also `[u1; 7]` and `[u1  7]`.
    let number = index.rsplit([',', ';', ' ']).find(|word| !word.is_empty());
    let of_axis = last.starts_with("nckServoData") || last.starts_with("measPos") || last.starts_with("aa");
    let axis = match number.and_then(|digits| digits.parse().ok()) {
        Some(number) if of_axis => AxisMark::Number(number),
        _ => AxisMark::None,
    };
    Named { stem: bare.to_owned(), axis }
}
