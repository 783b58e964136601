//! Errors with the gains before and after, without dry friction, and with other inertia and friction.
//!
//! In: courses, the gains found. Out: figures of every axis and of the tool, in the units of the border (mm, deg). All axes with a drive are
//! simulated; those that were not tuned keep their gains.

use super::Objective;
use super::contour::Tool;
use super::course::Course;
use super::gains::Gains;
use super::simulate::{Job, Response, responses};
use crate::base::units::deg_from_rad;
use crate::base::{AxisId, AxisKind};
use crate::machine::{DriveData, Machine};

/// Change of inertia and friction.
const CHANGE_PERCENT: f64 = 10.0;

/// Two figures of one error.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Pair {
    /// Root of the mean square.
    pub rms: f64,
    /// Largest amount.
    pub peak: f64,
}

/// Errors of one axis: before, after, after without dry friction.
#[derive(Clone, Debug)]
pub struct AxisFigures {
    /// Its name.
    pub name: String,
    /// mm or deg.
    pub unit: &'static str,
    /// It moves here.
    pub moves: bool,
    /// Control deviation.
    pub deviation: [Pair; 3],
    /// Following error.
    pub following: [Pair; 3],
}

/// Errors on one course.
#[derive(Clone, Debug)]
pub struct CourseFigures {
    /// As the user named it.
    pub name: String,
    /// Never used for tuning.
    pub validates: bool,
    /// Before is measured, after is what the model adds to it.
    pub measured: bool,
    /// Time.
    pub duration_s: f64,
    /// Axes with a drive.
    pub axes: Vec<AxisFigures>,
    /// Distance of the tool from the path: before, after, without dry friction.
    pub contour_mm: [Pair; 3],
    /// Of the objective over the tuned axes: before, after, without dry friction; mm, or deg where only rotary axes are tuned.
    pub objective: [Pair; 3],
    /// Its unit.
    pub unit: &'static str,
}

/// What a change of one number does to the objective, on the courses for tuning.
#[derive(Clone, Debug)]
pub struct Sensitivity {
    /// Axis that is changed.
    pub axis: String,
    /// Key of `mechanics`, without unit.
    pub what: &'static str,
    /// Change.
    pub change_percent: f64,
    /// Objective with the gains found, unchanged and changed.
    pub objective: [Pair; 2],
}

/// Figures of a row of numbers, `components` a tick.
fn pair(values: &[f64], components: usize) -> Pair {
    let squares = values.chunks(components).map(|tick| tick.iter().map(|part| part * part).sum::<f64>());
    let (sum, largest) = squares.fold((0.0, 0.0_f64), |(sum, largest), square| (sum + square, largest.max(square)));
    Pair { rms: (sum / (values.len() / components).max(1) as f64).sqrt(), peak: largest.sqrt() }
}

fn shown(pair: Pair, kind: AxisKind) -> Pair {
    match kind {
        AxisKind::Linear => pair,
        AxisKind::Rotary => Pair { rms: deg_from_rad(pair.rms), peak: deg_from_rad(pair.peak) },
    }
}

/// And without the pulse against it, which would be an error of its own there.
fn without_dry_friction(mut data: DriveData) -> DriveData {
    data.options.friction_pulse_lu_s = 0.0;
    data.mechanics.coulomb_friction_n_m = 0.0;
    data.mechanics.breakaway_friction_n_m = 0.0;
    data
}

fn data_of(machine: &Machine, axis: AxisId, after: &[(AxisId, Gains)]) -> Option<[DriveData; 2]> {
    let before = machine.axis(axis).drive.clone()?;
    let found = after.iter().find(|(tuned, _)| *tuned == axis);
    let new = found.map_or_else(|| before.clone(), |(_, gains)| gains.applied(&before));
    Some([before, new])
}

/// Of every course.
pub(super) fn course_figures(
    machine: &Machine,
    courses: &[Course],
    tool: &Tool,
    paths_mm: &[Vec<[f64; 3]>],
    after: &[(AxisId, Gains)],
    objective: Objective,
) -> Vec<CourseFigures> {
    let mut jobs = Vec::new();
    for course in courses {
        for (place, axis) in course.axes.iter().enumerate() {
            let data = data_of(machine, axis.axis, after);
            let data = data.map(|[before, new]| vec![before, new.clone(), without_dry_friction(new)]);
            jobs.push(Job { course, place, data: data.unwrap_or_default() });
        }
    }
    let mut simulated = responses(machine, &jobs).into_iter();
    let figures = |(number, course): (usize, &Course)| {
        let of_axes: Vec<Vec<Response>> = simulated.by_ref().take(course.axes.len()).collect();
        let axes = course
            .axes
            .iter()
            .zip(&of_axes)
            .map(|(of_axis, responses)| {
                let axis = machine.axis(of_axis.axis);
                let at = |place: usize, error: fn(&Response) -> &Vec<f64>| {
                    shown(responses.get(place).map_or(Pair::default(), |response| pair(error(response), 1)), axis.kind)
                };
                let all = |error: fn(&Response) -> &Vec<f64>| [0, 1, 2].map(|place| at(place, error));
                AxisFigures {
                    name: axis.name.clone(),
                    unit: if axis.kind == AxisKind::Linear { "mm" } else { "deg" },
                    moves: of_axis.moves,
                    deviation: all(|response| &response.deviation_lu),
                    following: all(|response| &response.following_lu),
                }
            })
            .collect();
        let of_variant = |place: usize| {
            let lags: Vec<(AxisId, usize, &Response)> = course
                .axes
                .iter()
                .zip(&of_axes)
                .filter_map(|(of_axis, responses)| Some((of_axis.axis, of_axis.steps, responses.get(place)?)))
                .collect();
            (contour(course, tool, &paths_mm[number], &lags), combined(machine, course, &lags, after, objective))
        };
        let variants = [0, 1, 2].map(of_variant);
        let contour_mm = variants.map(|(contour, _)| contour);
        let whole =
            variants.map(|(contour, combined)| if objective == Objective::Contour { contour } else { combined.0 });
        let unit = if objective == Objective::Contour { "mm" } else { variants[0].1.1 };
        CourseFigures {
            name: course.name.clone(),
            validates: course.validates,
            measured: course.measured,
            duration_s: course.duration_s,
            axes,
            contour_mm,
            objective: whole,
            unit,
        }
    };
    courses.iter().enumerate().map(figures).collect()
}

fn contour(course: &Course, tool: &Tool, path_mm: &[[f64; 3]], lags: &[(AxisId, usize, &Response)]) -> Pair {
    let lags: Vec<(AxisId, usize, &[f64])> =
        lags.iter().map(|(axis, steps, response)| (*axis, *steps, response.following_lu.as_slice())).collect();
    pair(&tool.errors_mm(course, path_mm, &lags), 3)
}

/// The errors of the tuned axes of one kind, as a vector: of the linear ones, of the rotary ones where no linear one is tuned.
fn combined(
    machine: &Machine,
    course: &Course,
    lags: &[(AxisId, usize, &Response)],
    after: &[(AxisId, Gains)],
    objective: Objective,
) -> (Pair, &'static str) {
    let tuned = |axis: &AxisId| after.iter().any(|(other, _)| other == axis);
    let kind = |axis: &AxisId| machine.axis(*axis).kind;
    let linear = lags.iter().any(|(axis, ..)| tuned(axis) && kind(axis) == AxisKind::Linear);
    let wanted = if linear { AxisKind::Linear } else { AxisKind::Rotary };
    let mut values = Vec::with_capacity(course.postures.len());
    for k in 0..course.postures.len() {
        let square = lags
            .iter()
            .filter(|(axis, ..)| tuned(axis) && kind(axis) == wanted)
            .map(|(_, steps, response)| {
                let errors_lu =
                    if objective == Objective::Following { &response.following_lu } else { &response.deviation_lu };
                let error_lu = errors_lu.get(k * steps).copied().unwrap_or(0.0);
                error_lu * error_lu
            })
            .sum::<f64>();
        values.push(square.sqrt());
    }
    (shown(pair(&values, 1), wanted), if linear { "mm" } else { "deg" })
}

/// Changed data of the plant with the gains found: the controllers keep what they have been told.
fn changed(data: &DriveData, what: &str, change_ratio: f64) -> DriveData {
    let mut data = data.clone();
    let mechanics = &mut data.mechanics;
    if what == "inertia" {
        mechanics.inertia_kg_m2 *= change_ratio;
        mechanics.load_inertia_kg_m2 *= change_ratio;
    } else {
        mechanics.coulomb_friction_n_m *= change_ratio;
        mechanics.breakaway_friction_n_m *= change_ratio;
        mechanics.viscous_friction_n_m_s_per_rad *= change_ratio;
    }
    data
}

/// One number of one tuned axis at a time.
pub(super) fn sensitivities(
    machine: &Machine,
    courses: &[Course],
    tool: &Tool,
    paths_mm: &[Vec<[f64; 3]>],
    after: &[(AxisId, Gains)],
    objective: Objective,
) -> Vec<Sensitivity> {
    let changes = [
        ("inertia", -CHANGE_PERCENT),
        ("inertia", CHANGE_PERCENT),
        ("friction", -CHANGE_PERCENT),
        ("friction", CHANGE_PERCENT),
    ];
    let mut jobs = Vec::new();
    for course in courses {
        for (place, axis) in course.axes.iter().enumerate() {
            let tuned = after.iter().any(|(other, _)| *other == axis.axis);
            let new = data_of(machine, axis.axis, after).map(|[_, new]| new);
            let data = new.map_or_else(Vec::new, |new| {
                let changed =
                    changes.iter().filter(|_| tuned).map(|(what, percent)| changed(&new, what, 1.0 + 0.01 * percent));
                std::iter::once(new.clone()).chain(changed).collect()
            });
            jobs.push(Job { course, place, data });
        }
    }
    let simulated = responses(machine, &jobs);
    // Of all courses: mean of the squares, largest of the peaks.
    let whole = |axis: Option<AxisId>, variant: usize| {
        let (mut sum, mut peak, mut first) = (0.0, 0.0_f64, 0);
        for (number, course) in courses.iter().enumerate() {
            let of_axes = &simulated[first..first + course.axes.len()];
            first += course.axes.len();
            let lags: Vec<(AxisId, usize, &Response)> = course
                .axes
                .iter()
                .zip(of_axes)
                .filter_map(|(of_axis, responses)| {
                    let place = if Some(of_axis.axis) == axis { variant } else { 0 };
                    Some((of_axis.axis, of_axis.steps, responses.get(place)?))
                })
                .collect();
            let one = match objective {
                Objective::Contour => contour(course, tool, &paths_mm[number], &lags),
                _ => combined(machine, course, &lags, after, objective).0,
            };
            sum += one.rms * one.rms;
            peak = peak.max(one.peak);
        }
        Pair { rms: (sum / courses.len().max(1) as f64).sqrt(), peak }
    };
    let unchanged = whole(None, 0);
    let mut found = Vec::new();
    for (axis, _) in after {
        for (place, (what, percent)) in changes.iter().enumerate() {
            found.push(Sensitivity {
                axis: machine.axis(*axis).name.clone(),
                what,
                change_percent: *percent,
                objective: [unchanged, whole(Some(*axis), place + 1)],
            });
        }
    }
    found
}
