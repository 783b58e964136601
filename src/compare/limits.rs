//! Limits on the figures of a comparison, as `--limit NAME=VALUE` gives them: they decide the exit code of a nightly job.
//!
//! In: `X.position_setpoint_mm.max=0.005`, the comparison's JSON document. Out: [`LimitCheck`]s. A name is a signal with a figure, or a
//! figure of the whole: `contour_error_max_mm`, `offset_s`, `cycle_time_difference_s`. A figure that is not there breaks its limit: silence
//! must not pass a test. Does not compute figures.

use crate::base::Diagnostic;
use crate::base::diagnostics::nearest;
use serde_json::Value;

/// A limit that the user gives.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitRule {
    /// Name as given.
    pub name: String,
    /// Largest magnitude that is allowed.
    pub value: f64,
}

/// A limit and what came out.
#[derive(Clone, Debug, PartialEq)]
pub struct LimitCheck {
    /// The rule.
    pub rule: LimitRule,
    /// Magnitude of the figure; `None` where it is not there.
    pub found: Option<f64>,
}

impl LimitCheck {
    /// Whether the limit holds.
    pub fn holds(&self) -> bool {
        self.found.is_some_and(|found| found <= self.rule.value)
    }
}

/// Figures of a signal that can be limited.
pub const SIGNAL_FIGURES: [&str; 9] =
    ["rms", "max", "p95", "bias", "delay_s", "rms_path", "max_path", "p95_path", "bias_path"];

/// Reads `NAME=VALUE`.
pub fn parse_limit(text: &str) -> Result<LimitRule, Diagnostic> {
    let wrong = |reason: &str| {
        Diagnostic::error("T0107", format!("`--limit {text}`: {reason}"))
            .help("write NAME=VALUE, such as X.position_setpoint_mm.max=0.005 or contour_error_max_mm=0.01")
    };
    let (name, value) = text.rsplit_once('=').ok_or_else(|| wrong("there is no `=`"))?;
    match value.trim().parse::<f64>() {
        Ok(value) if value.is_finite() && value >= 0.0 => Ok(LimitRule { name: name.trim().to_owned(), value }),
        _ => Err(wrong("the value is no number from 0 on")),
    }
}

/// Holds limits against the document of a comparison. A name that cannot be a figure of this comparison is an error with the nearest one.
pub fn check_limits(document: &Value, rules: &[LimitRule]) -> Result<Vec<LimitCheck>, Diagnostic> {
    rules.iter().map(|rule| Ok(LimitCheck { rule: rule.clone(), found: found(document, rule)? })).collect()
}

fn found(document: &Value, rule: &LimitRule) -> Result<Option<f64>, Diagnostic> {
    let number = |value: &Value| value.as_f64().map(f64::abs);
    if let Some(value) = document.get(&rule.name) {
        return match value {
            Value::Null => Ok(None),
            value => number(value).map(Some).ok_or_else(|| unknown(document, rule)),
        };
    }
    let (signal, figure) = rule.name.rsplit_once('.').ok_or_else(|| unknown(document, rule))?;
    if !SIGNAL_FIGURES.contains(&figure) {
        return Err(unknown(document, rule));
    }
    match document.get("signals").and_then(|signals| signals.get(signal)) {
        Some(figures) => Ok(figures.get(figure).and_then(number)),
        None => Err(unknown(document, rule)),
    }
}

fn unknown(document: &Value, rule: &LimitRule) -> Diagnostic {
    let mut names: Vec<String> = Vec::new();
    if let Some(figures) = document.as_object() {
        names.extend(figures.iter().filter(|(_, value)| value.is_number()).map(|(key, _)| key.clone()));
    }
    if let Some(signals) = document.get("signals").and_then(Value::as_object) {
        names.extend(signals.keys().flat_map(|signal| SIGNAL_FIGURES.iter().map(move |f| format!("{signal}.{f}"))));
    }
    let help = match nearest(&rule.name, names.iter().map(String::as_str)) {
        Some(near) => format!("`{near}` is one"),
        None => "the document of `--json` shows the names".to_owned(),
    };
    Diagnostic::error("T0108", format!("`{}` is no figure of this comparison", rule.name)).help(help)
}
