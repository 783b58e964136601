//! Which signals stand in which plot.
//!
//! In: the signals of a trace, and of a reference with its pairs. Out: [`Plot`]s in the order of the page, each of one unit, and of at most
//! [`SIGNALS_MAX`] signals. Does not draw.

use super::bands::is_constant;
use crate::compare::{Alignment, Comparison, Part, Series, Side};
use crate::trace::{AxisSignal, Signal, TimeGrid, Trace};

/// Curves of one plot at most: more cannot be told apart.
const SIGNALS_MAX: usize = 24;

/// Curves of a page at most.
const CURVES_MAX: usize = 240;

/// One plot.
#[derive(Debug)]
pub struct Plot<'a> {
    /// For people.
    pub title: String,
    /// Unit of all curves.
    pub unit: String,
    /// Curves in order.
    pub curves: Vec<Curve<'a>>,
}

/// One curve.
#[derive(Debug)]
pub struct Curve<'a> {
    /// Name in the legend.
    pub name: String,
    /// Axis that decides the colour; the name of the signal where there is none.
    pub family: String,
    /// Set-points and references are dashed.
    pub dashed: bool,
    /// Shown at first.
    pub shown: bool,
    /// Of the reference: drawn lighter, its times are brought to those of the trace.
    pub of_reference: bool,
    /// The samples.
    pub samples: Samples<'a>,
}

impl Curve<'_> {
    /// Share of the room in the page: positions run over a hundred millimetres and are read to a micrometre.
    pub fn room_share(&self) -> usize {
        if is_constant(&self.samples.series()) {
            return 0;
        }
        match self.name.split(' ').next().unwrap_or_default() {
            name if name.contains(".position_") => 4,
            name if name.contains(".control_deviation") || name.contains(".following_error") => 2,
            _ => 1,
        }
    }
}

/// Samples of a curve.
#[derive(Debug)]
pub enum Samples<'a> {
    /// Of a signal.
    Signal(&'a Signal),
    /// Formed for the page.
    Made {
        /// Times.
        times: TimeGrid,
        /// Values.
        values: Vec<f64>,
    },
}

impl Samples<'_> {
    /// As a series.
    pub fn series(&self) -> Series<'_> {
        match self {
            Self::Signal(signal) => Series::of(signal),
            Self::Made { times, values } => Series::smooth(times, values),
        }
    }
}

/// Title, and the fields (of axes without unit, of the path with it) in it; `true` = dashed.
const GROUPS: [(&str, &[(&str, bool)]); 14] = [
    ("Feed", &[("path.feed_mm_min", false), ("path.programmed_feed_mm_min", true)]),
    ("Contour error", &[("path.contour_error_mm", false)]),
    ("Control deviation", &[("control_deviation", false)]),
    ("Following error", &[("following_error", false)]),
    (
        "Position",
        &[
            ("position_actual", false),
            ("position_measured", false),
            ("position_setpoint", true),
            ("position_reference", true),
        ],
    ),
    (
        "Velocity",
        &[
            ("velocity_actual", false),
            ("velocity_setpoint", true),
            ("velocity_command", true),
            ("velocity_feedforward", true),
        ],
    ),
    ("Acceleration", &[("acceleration_setpoint", false), ("path.acceleration_mm_s2", false)]),
    ("Jerk", &[("jerk_setpoint", false), ("path.jerk_mm_s3", false)]),
    (
        "Torque",
        &[
            ("torque_reference", false),
            ("torque_feedforward", true),
            ("friction_torque", true),
            ("gravity_torque", true),
        ],
    ),
    ("Current", &[("current", false), ("current_mean", false), ("current_reference", true)]),
    ("Motor speed", &[("motor_speed", false), ("motor_speed_reference", true)]),
    ("Voltage", &[("voltage", false)]),
    ("Spindle speed", &[("spindle.speed_actual_rpm", false), ("spindle.speed_setpoint_rpm", true)]),
    ("Spindle angle", &[("spindle.angle_actual_deg", false), ("spindle.angle_setpoint_deg", true)]),
];

/// Fields that are in a plot but not shown at first: they say nearly the same as another.
const HIDDEN: [&str; 8] = [
    "position_measured",
    "position_reference",
    "velocity_command",
    "velocity_feedforward",
    "current_mean",
    "gravity_torque",
    "path.acceleration_mm_s2",
    "path.jerk_mm_s3",
];

/// All plots of a page, and how many curves it has no room for.
pub fn plots<'a>(trace: &'a Trace, side: &Side, reference: Option<(&'a Trace, &Comparison)>) -> (Vec<Plot<'a>>, usize) {
    let mut plots: Vec<Plot<'a>> = Vec::new();
    if let Some((other, comparison)) = reference {
        plots.extend(differences(trace, other, comparison));
    }
    for (title, fields) in GROUPS {
        for (rank, (field, dashed)) in fields.iter().enumerate() {
            let leading = fields[0].0;
            let sides = [Some(trace), reference.map(|(other, _)| other)];
            for (side, of_reference) in sides.into_iter().zip([false, true]) {
                for signal in side.into_iter().flat_map(|side| &side.signals).filter(|s| is_of(s, field)) {
                    if rank > 0 && side.is_some_and(|side| repeats(side, signal, leading)) {
                        continue;
                    }
                    // What says nearly the same as another is hidden where there is the other.
                    let alone =
                        |own: AxisSignal<'_>| side.is_some_and(|side| side.axis_signal(own.axis, leading).is_none());
                    let shown = !HIDDEN.contains(field) || rank == 0 || signal.axis_signal().is_some_and(alone);
                    add(&mut plots, title, curve(signal, *dashed || of_reference, shown, of_reference), &signal.unit);
                }
            }
        }
    }
    let known = |signal: &Signal| GROUPS.iter().any(|(_, fields)| fields.iter().any(|(field, _)| is_of(signal, field)));
    let sides = [Some(trace), reference.map(|(other, _)| other)];
    for (side, of_reference) in sides.into_iter().zip([false, true]) {
        for signal in side.into_iter().flat_map(|side| &side.signals) {
            let path = signal.name.as_deref().is_some_and(|name| {
                name.starts_with("path.") || name.starts_with("spindle.") || name.ends_with(".flags")
            });
            if !known(signal) && !path && signal.labels.is_empty() {
                add(&mut plots, "Other signals", curve(signal, of_reference, true, of_reference), &signal.unit);
            }
        }
    }
    // Axes that rest in a simulation and are not in the control's trace at all.
    let of_interest = |curve: &Curve<'_>| !curve.of_reference || !is_constant(&curve.samples.series());
    plots.retain(|plot| plot.curves.iter().any(of_interest));
    add_budget(&mut plots, side);
    let mut room = CURVES_MAX;
    let mut left_out = 0;
    for plot in &mut plots {
        left_out += plot.curves.len().saturating_sub(room);
        plot.curves.truncate(room);
        room -= plot.curves.len();
    }
    plots.retain(|plot| !plot.curves.is_empty());
    (plots, left_out)
}

/// Where the error comes from over time, behind the contour error.
fn add_budget(plots: &mut Vec<Plot<'_>>, side: &Side) {
    let Some(budget) = &side.budget else { return };
    let curve = |name: &str, part: &Part| {
        let (times_s, values): (Vec<f64>, Vec<f64>) = part.course.iter().copied().unzip();
        let times = TimeGrid::from_times(times_s, 1e-9);
        let samples = Samples::Made { times, values };
        Curve {
            name: name.to_owned(),
            family: name.to_owned(),
            dashed: false,
            shown: true,
            of_reference: false,
            samples,
        }
    };
    let named = [("chords", &budget.chord), ("interpolator", &budget.interpolator), ("drives", &budget.drives)];
    let curves: Vec<Curve<'_>> = named.iter().filter_map(|(name, part)| Some(curve(name, part.as_ref()?))).collect();
    // Drives alone are the contour error, which has a plot.
    if curves.len() > 1 {
        let place = plots.iter().position(|plot| plot.title == "Contour error").map_or(plots.len().min(1), |i| i + 1);
        plots.insert(place, Plot { title: "Where the error comes from".to_owned(), unit: "µm".to_owned(), curves });
    }
}

/// Whether a signal says value by value what the leading one of its plot says for the same axis: an ideal encoder, say.
fn repeats(side: &Trace, signal: &Signal, leading: &str) -> bool {
    let Some(own) = signal.axis_signal() else { return false };
    side.axis_signal(own.axis, leading)
        .is_some_and(|first| first.values == signal.values && first.times == signal.times)
}

fn is_of(signal: &Signal, field: &str) -> bool {
    if field.starts_with("path.") {
        return signal.name.as_deref() == Some(field) && signal.values.iter().any(|value| value.is_finite());
    }
    if field.starts_with("spindle.") {
        // A spindle that stands all along says nothing.
        return signal.name.as_deref() == Some(field)
            && signal.values.iter().any(|value| value.is_finite() && *value != 0.0);
    }
    signal.axis_signal().is_some_and(|own| own.stem() == field) && signal.values.iter().any(|value| value.is_finite())
}

fn curve(signal: &Signal, dashed: bool, shown: bool, of_reference: bool) -> Curve<'_> {
    let family = signal.axis_signal().map_or_else(|| signal.shown_name().to_owned(), |own| own.axis.to_owned());
    let name = signal.shown_name();
    let name = if of_reference { format!("{name} (reference)") } else { name.to_owned() };
    Curve { name, family, dashed, shown, of_reference, samples: Samples::Signal(signal) }
}

/// Puts a curve into the plot of its title and unit that has room.
fn add<'a>(plots: &mut Vec<Plot<'a>>, title: &str, curve: Curve<'a>, unit: &str) {
    let place = plots.iter().position(|p| p.title == title && p.unit == unit && p.curves.len() < SIGNALS_MAX);
    match place {
        Some(i) => plots[i].curves.push(curve),
        None => plots.push(Plot { title: title.to_owned(), unit: unit.to_owned(), curves: vec![curve] }),
    }
}

/// Difference of every pair at equal times, a plot for each unit.
fn differences<'a>(trace: &'a Trace, reference: &'a Trace, comparison: &Comparison) -> Vec<Plot<'a>> {
    let at = comparison.alignment.unwrap_or_else(Alignment::none);
    let mut plots = Vec::new();
    for pair in &comparison.pairs {
        let (Some(a), Some(b)) = (trace.signal(&pair.name), reference.signal(&pair.reference_name)) else { continue };
        // What says nearly the same as another is in the table.
        if a.axis_signal().is_some_and(|own| HIDDEN.contains(&own.stem())) {
            continue;
        }
        let (one, mut other) = (Series::of(a), Series::of(b).cursor());
        let difference = |i: usize| one.values[i] - other.value(at.reference_s(one.time_s(i))) - pair.zero;
        let values: Vec<f64> = (0..one.len()).map(difference).collect();
        let family = a.axis_signal().map_or_else(|| pair.name.clone(), |own| own.axis.to_owned());
        let made = Samples::Made { times: a.times.clone(), values };
        let name = format!("Δ {}", pair.name);
        let curve = Curve { name, family, dashed: false, shown: true, of_reference: false, samples: made };
        let title = match a.axis_signal() {
            Some(own) => format!("Difference of {}", own.stem().replace('_', " ")),
            None => "Difference".to_owned(),
        };
        add(&mut plots, &title, curve, &pair.unit);
    }
    // A plot of zeros tells nothing that the table does not say; where all are zero, that is what is to be seen.
    let differs = |plot: &Plot<'_>| {
        plot.curves.iter().any(|curve| matches!(&curve.samples, Samples::Made { values, .. } if values.iter().any(|v| *v != 0.0 && !v.is_nan())))
    };
    if plots.iter().any(differs) {
        plots.retain(differs);
    }
    plots
}
