//! The machine file with identified values: comments and order kept.
//!
//! In: text of a machine file, results. Out: the text with the new values; behind each the interval and what stood there. Rounds a value to
//! what its interval is worth. Does not check the file: who writes it reads it again.

use super::wire::{AxisResult, Estimate, Parameter};
use crate::base::Diagnostic;
use crate::machine::Machine;
use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

/// Puts the values into the text. A drive counts as identified when its inertia and its friction are.
pub fn machine_text(text: &str, machine: &Machine, results: &[AxisResult]) -> Result<String, Diagnostic> {
    let fault = |reason: &str| {
        Diagnostic::error("T0204", format!("the machine file cannot take the values: {reason}"))
            .help("write it in tables ([axes.X.mechanics]), and check it with `sollwert machine check`")
    };
    let mut document: DocumentMut = text.parse().map_err(|_| fault("it is no TOML"))?;
    for result in results {
        let Some(axis) = machine.axis_by_name(&result.axis).map(|id| machine.axis(id)) else { continue };
        for estimate in &result.estimates {
            let key = format!("axes.{}.{}", axis.name, estimate.parameter.key(axis));
            let value = rounded(estimate);
            let comment =
                format!("identified, 95 %: {} to {}", shown(estimate.low, estimate), shown(estimate.high, estimate));
            put(&mut document, &key, Value::from(value), &comment).ok_or_else(|| fault(&key))?;
        }
        if let Some(coulomb) = result.estimate(Parameter::Coulomb) {
            let key = format!("axes.{}.{}", axis.name, Parameter::Coulomb.key(axis).replace("coulomb", "breakaway"));
            let before = axis.drive.as_ref().map(|drive| drive.mechanics.breakaway_friction_n_m);
            // Where the file has none it follows by itself.
            if holds(&document, &key) && before.is_some_and(|before| before < rounded(coulomb)) {
                let comment = "raised: it is not below the Coulomb friction that was identified";
                put(&mut document, &key, Value::from(rounded(coulomb)), comment).ok_or_else(|| fault(&key))?;
            }
        }
        let whole = [Parameter::Inertia, Parameter::Viscous, Parameter::Coulomb];
        if whole.iter().all(|parameter| result.estimate(*parameter).is_some()) {
            let key = format!("axes.{}.drive.identified", axis.name);
            put(&mut document, &key, Value::from(true), "inertia and friction from traces")
                .ok_or_else(|| fault(&key))?;
        }
    }
    Ok(document.to_string())
}

/// Decimals that the interval leaves a meaning, and two more.
fn decimals(estimate: &Estimate) -> i32 {
    let half = estimate.half();
    // An interval of no width comes from an exact law: nine digits are what a trace can hold.
    let size = if half > 0.0 { half } else { estimate.value.abs().max(1e-12) * 1e-7 };
    (2 - size.log10().floor() as i32).clamp(0, 15)
}

/// The value as it goes into a file.
fn rounded(estimate: &Estimate) -> f64 {
    let value = format!("{:.*}", decimals(estimate) as usize, estimate.value).parse().unwrap_or(estimate.value);
    match estimate.parameter {
        Parameter::Gravity | Parameter::GravitySin | Parameter::GravityCos => value,
        // Nothing else is negative: an estimate a little below 0 is none. (The sum makes 0 of -0.)
        _ => f64::max(value, 0.0) + 0.0,
    }
}

fn shown(value: f64, estimate: &Estimate) -> String {
    format!("{:.*}", decimals(estimate) as usize, value)
}

/// Whether the file has a dotted key.
fn holds(document: &DocumentMut, key: &str) -> bool {
    let mut item = Some(document.as_item());
    for part in key.split('.') {
        item = item.and_then(|item| item.get(part));
    }
    item.is_some()
}

/// Sets one dotted key; a table that is missing is made.
fn put(document: &mut DocumentMut, key: &str, value: Value, comment: &str) -> Option<()> {
    let mut parts: Vec<&str> = key.split('.').collect();
    let last = parts.pop()?;
    let mut table: &mut dyn TableLike = document.as_table_mut();
    for part in parts {
        if table.get(part).is_none() {
            table.insert(part, Item::Table(Table::new()));
        }
        table = table.get_mut(part)?.as_table_like_mut()?;
    }
    let mut value = value;
    match table.get_mut(last) {
        Some(item) => {
            let old = item.as_value()?;
            let decor = old.decor().clone();
            let mut bare = old.clone();
            bare.decor_mut().clear();
            let before =
                decor.suffix().and_then(|raw| raw.as_str()).unwrap_or("").trim().trim_start_matches('#').trim();
            let was = if before.is_empty() { format!("was {bare}") } else { format!("was {bare}: {before}") };
            value.decor_mut().set_prefix(decor.prefix().and_then(|raw| raw.as_str()).unwrap_or(" ").to_owned());
            value.decor_mut().set_suffix(format!(" # {comment}; {was}"));
            // In place: an insert would take the comments in front of the key along.
            *item = Item::Value(value);
        }
        None => {
            value.decor_mut().set_suffix(format!(" # {comment}"));
            table.insert(last, Item::Value(value));
        }
    }
    Some(())
}
