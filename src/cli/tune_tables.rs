//! Tables of `sollwert tune`.
//!
//! In: what was found. Out: text for people, errors in µm or thousandths of a degree. Computes no figures.

use super::output::table;
use crate::base::units::UM_PER_MM;
use crate::tune::{CourseFigures, Gain, Measure, Objective, Pair, TuneOptions, Tuned, TunedAxis, TunedGain};

/// All of them.
pub(super) fn tables(tuned: &Tuned, options: &TuneOptions) -> String {
    let mut text = gains(&tuned.axes);
    text += &format!("\n{}, before and after; floor: the new gains without dry friction\n", objective(options));
    text += &errors(&tuned.courses);
    text += &format!("\n{} after a change of one number, gains as found\n", objective(options));
    let rows: Vec<Vec<String>> = tuned
        .sensitivities
        .iter()
        .map(|one| {
            let [found, changed] = &one.objective;
            let (found, changed) = match options.measure {
                Measure::Rms => (found.rms, changed.rms),
                Measure::Peak => (found.peak, changed.peak),
            };
            let name = format!("{} {} {:+.0} %", one.axis, one.what, one.change_percent);
            vec![name, share_percent(found, changed)]
        })
        .collect();
    text + &table(&rows)
}

/// An error for people.
pub(super) fn shown(value: f64, unit: &str) -> String {
    let unit = if unit == "mm" { "µm" } else { "mdeg" };
    format!("{:.2} {unit}", value * UM_PER_MM)
}

/// How much a figure has changed.
pub(super) fn share_percent(before: f64, after: f64) -> String {
    // Less than a thousandth of the unit shown is none.
    if before.max(after) < 1e-6 {
        return "0.0 %".to_owned();
    }
    format!("{:+.1} %", 100.0 * (after / before.max(f64::MIN_POSITIVE) - 1.0))
}

/// What is small, in words.
pub(super) fn objective(options: &TuneOptions) -> String {
    let error = match options.objective {
        Objective::Deviation => "Control deviation",
        Objective::Following => "Following error",
        Objective::Contour => "Contour error",
    };
    let measure = if options.measure == Measure::Rms { "RMS" } else { "peak" };
    format!("{error} (tuned for {measure})")
}

fn gains(axes: &[TunedAxis]) -> String {
    let mut rows = vec![["gain", "before", "after", "95 %", ""].map(str::to_owned).to_vec()];
    for axis in axes {
        for gain in &axis.gains {
            let unit = gain.gain.unit(axis.kind);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            rows.push(vec![
                format!("{} {}", axis.name, gain.gain.key(axis.kind)),
                format!("{:.4}{unit}", gain.before),
                format!("{:.4}{unit}", gain.value),
                format!("{:.4} .. {:.4}", gain.low, gain.high),
                remark(gain, axis),
            ]);
        }
    }
    table(&rows)
}

/// What is to be known of a gain.
pub(super) fn remark(gain: &TunedGain, axis: &TunedAxis) -> String {
    let mut remarks = Vec::new();
    if !gain.certain {
        remarks.push("not told by the courses".to_owned());
    } else if gain.at_bound {
        remarks.push("at its bound".to_owned());
    }
    if gain.gain == Gain::Delay && axis.together.len() > 1 {
        remarks.push(format!("one for {}", axis.together.join(", ")));
    }
    remarks.join("; ")
}

fn errors(courses: &[CourseFigures]) -> String {
    let head = ["", "RMS before", "after", "floor", "peak before", "after", "floor"];
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    for course in courses {
        let kind = if course.validates { " (validation)" } else { "" };
        let measured = if course.measured { " (measured)" } else { "" };
        rows.push(row(&format!("{}{kind}{measured}", course.name), &course.objective, course.unit));
        for axis in course.axes.iter().filter(|axis| axis.moves) {
            rows.push(row(&format!("  {} deviation", axis.name), &axis.deviation, axis.unit));
            rows.push(row(&format!("  {} following", axis.name), &axis.following, axis.unit));
        }
        rows.push(row("  contour", &course.contour_mm, "mm"));
    }
    table(&rows)
}

fn row(name: &str, pairs: &[Pair; 3], unit: &str) -> Vec<String> {
    let mut cells = vec![name.to_owned()];
    for figure in [|pair: &Pair| pair.rms, |pair: &Pair| pair.peak] {
        cells.extend(pairs.iter().map(|pair| shown(figure(pair), unit)));
    }
    cells
}
