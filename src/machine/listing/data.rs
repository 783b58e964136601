//! Machine data as written: every assignment with its place, and which of them something was made of.
//!
//! In: assignments in the order of the files. Out: [`Listing`], which answers "MAX_AX_ACCEL[0] of AX1": the last assignment counts, as on
//! the control. Does not know what a datum means.

use crate::base::Diagnostic;
use crate::base::diagnostics::SourceText;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where a datum belongs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Scope {
    /// `$MN_`.
    General,
    /// `$MC_` of the first channel.
    Channel,
    /// `$SC_` of the first channel.
    ChannelSetting,
    /// `$MA_`.
    Axis,
    /// `$TC_CARRm[n]`: tool carriers with orientable axes.
    ToolCarrier,
}

impl Scope {
    /// As written.
    pub const fn prefix(self) -> &'static str {
        match self {
            Self::General => "$MN_",
            Self::Channel => "$MC_",
            Self::ChannelSetting => "$SC_",
            Self::Axis => "$MA_",
            Self::ToolCarrier => "$TC_",
        }
    }
}

/// A right-hand side.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Literal {
    Number(f64),
    Text(String),
}

/// Where an assignment stands; the text is made into a place only when something is wrong.
#[derive(Clone, Debug)]
pub(super) struct Spot {
    pub file: Arc<str>,
    pub line: u32,
    pub text: Arc<str>,
}

impl Spot {
    /// A finding that marks the whole assignment.
    pub fn mark(&self, finding: Diagnostic, label: &str) -> Diagnostic {
        let source = SourceText::new(self.file.clone(), self.text.clone());
        let mut place = source.place(0..self.text.len(), label);
        place.line = self.line;
        finding.at(place)
    }
}

/// One assignment.
#[derive(Clone, Debug)]
pub(super) struct Datum {
    pub literal: Literal,
    pub spot: Spot,
    pub used: bool,
}

/// `AX1` or `X1`, in capitals; empty for general and channel data. Then the array index.
type Address = (String, u32);

/// All that was read.
#[derive(Clone, Debug, Default)]
pub(super) struct Listing {
    data: BTreeMap<(Scope, String), BTreeMap<Address, Datum>>,
    /// Numbers of data, as far as they stand before them: `N32300`.
    numbers: BTreeMap<(Scope, String), u32>,
    /// Assignments that nothing knows by name (other scopes, other channels), by how they are written.
    pub foreign: BTreeMap<String, usize>,
    /// `;#sollwert KEY = VALUE`: key, value, place.
    pub carried: BTreeMap<String, (String, Spot)>,
    pub drives: Vec<DriveObject>,
    /// Lines that are no assignment.
    pub other_lines: usize,
    /// Names of members that are compiled, and of those that are of no interest.
    pub binary: Vec<String>,
    pub inch: Option<Spot>,
    /// A line says that the values are metric.
    pub metric: bool,
    /// Lines with a sum behind them, which nobody here can check.
    pub summed_lines: usize,
}

/// The parameters of one drive.
#[derive(Clone, Debug, Default)]
pub(super) struct DriveObject {
    /// Member or file that it stands in.
    pub file: String,
    /// From `;#sollwert drive X`.
    pub axis: Option<String>,
    /// Of a drive of the 840D pl: its number, which MD30110 of an axis names.
    pub module: Option<u32>,
    pub parameters: BTreeMap<(u32, u32), Datum>,
}

impl DriveObject {
    /// p0199: the name, one character an index.
    pub fn name(&self) -> String {
        let codes = self.parameters.range((199, 0)..(200, 0)).filter_map(|(_, datum)| match datum.literal {
            Literal::Number(code) if (32.0..127.0).contains(&code) => Some(code as u8 as char),
            _ => None,
        });
        codes.collect()
    }

    /// The parameter of the first data set, taken.
    pub fn take(&mut self, number: u32, index: u32) -> Option<(f64, String)> {
        let datum = self.parameters.get_mut(&(number, index))?;
        datum.used = true;
        match datum.literal {
            // Data of the 840D pl stand for the parameters of today: they are named as they were written.
            Literal::Number(value) if datum.spot.text.contains("$MD_") => {
                Some((value, datum.spot.text.split('=').next().unwrap_or_default().trim().to_owned()))
            }
            Literal::Number(value) => Some((value, format!("p{number:04}[{index}]"))),
            Literal::Text(_) => None,
        }
    }

    /// Whether it is a drive of a motor: it has a speed controller.
    pub fn moves(&self) -> bool {
        self.parameters.contains_key(&(1460, 0))
    }
}

impl Listing {
    pub fn add(&mut self, scope: Scope, name: &str, number: Option<u32>, address: Address, datum: Datum) {
        let key = (scope, name.to_owned());
        if let Some(number) = number {
            self.numbers.insert(key.clone(), number);
        }
        self.data.entry(key).or_default().insert(address, datum);
    }

    fn at(&mut self, scope: Scope, name: &str, axes: &[String], index: u32) -> Option<(&mut Datum, String)> {
        let key = (scope, name.to_owned());
        let number = self.numbers.get(&key).copied();
        let addresses = self.data.get_mut(&key)?;
        let axis = axes.iter().find(|axis| addresses.contains_key(&((*axis).clone(), index)))?.clone();
        let shown = match (scope, number) {
            (Scope::ChannelSetting, Some(number)) => format!("SD{number}"),
            (_, Some(number)) => format!("MD{number}"),
            (_, None) => String::new(),
        };
        let datum = addresses.get_mut(&(axis, index))?;
        // The brackets as they stand there.
        let inside = datum.spot.text.split_once('[').and_then(|(_, rest)| rest.split_once(']'));
        let inside = inside.map_or_else(String::new, |(inside, _)| format!("[{inside}]"));
        let written = format!("{shown} {}{name}{inside}", scope.prefix()).trim_start().to_owned();
        Some((datum, written))
    }

    /// The number, and how the datum is written. `axes`: the names of the axis, or one empty name.
    pub fn number(&mut self, scope: Scope, name: &str, axes: &[String], index: u32) -> Option<(f64, String)> {
        let (datum, shown) = self.at(scope, name, axes, index)?;
        datum.used = true;
        match datum.literal {
            Literal::Number(value) => Some((value, shown)),
            Literal::Text(_) => None,
        }
    }

    /// The text of a datum.
    pub fn text(&mut self, scope: Scope, name: &str, index: u32) -> Option<String> {
        let (datum, _) = self.at(scope, name, &[String::new()], index)?;
        datum.used = true;
        match &datum.literal {
            Literal::Text(text) => Some(text.clone()),
            Literal::Number(_) => None,
        }
    }

    /// The place of a datum, for a finding.
    pub fn spot(&mut self, scope: Scope, name: &str, axes: &[String], index: u32) -> Option<Spot> {
        self.at(scope, name, axes, index).map(|(datum, _)| datum.spot.clone())
    }

    /// Multiplies all numbers of a datum, of these axes (of none: one empty name).
    pub fn scale(&mut self, scope: Scope, name: &str, axes: &[String], factor: f64) {
        let Some(addresses) = self.data.get_mut(&(scope, name.to_owned())) else { return };
        for (_, datum) in addresses.iter_mut().filter(|((axis, _), _)| axes.contains(axis)) {
            if let Literal::Number(value) = &mut datum.literal {
                *value *= factor;
            }
        }
    }

    /// Every axis that has data, in order of its name.
    pub fn axes(&self) -> Vec<String> {
        let mut names: Vec<String> = self
            .data
            .iter()
            .filter(|((scope, _), _)| *scope == Scope::Axis)
            .flat_map(|(_, addresses)| addresses.keys().map(|(axis, _)| axis.clone()))
            .collect();
        names.sort();
        names.dedup();
        names
    }

    /// Whether anything was found at all.
    pub fn is_empty(&self) -> bool {
        self.data.is_empty() && self.drives.is_empty() && self.carried.is_empty()
    }

    /// What was not used: how it is written, and how often.
    pub fn unused(&self) -> BTreeMap<String, usize> {
        let mut unused = self.foreign.clone();
        for (key, addresses) in &self.data {
            let count = addresses.values().filter(|datum| !datum.used).count();
            if count > 0 {
                let number = self.numbers.get(key).map_or_else(String::new, |number| format!("N{number} "));
                *unused.entry(format!("{number}{}{}", key.0.prefix(), key.1)).or_default() += count;
            }
        }
        for drive in &self.drives {
            for ((number, _), _) in drive.parameters.iter().filter(|(_, datum)| !datum.used) {
                *unused.entry(format!("p{number:04}")).or_default() += 1;
            }
        }
        unused
    }
}
