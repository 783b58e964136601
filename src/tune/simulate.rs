//! Errors of drives with given data on a course: many data sets in one batch, batches on all cores.
//!
//! In: courses, axes, drive data. Out: [`Response`]s in the order asked for, so that the number of threads changes nothing. A drive that leaves
//! all bounds has an infinite error.

use super::course::{Course, Measured};
use crate::base::Diagnostic;
use crate::drive::{AxisDrive, DriveBatch, DriveInput, Start};
use crate::machine::{DriveData, Machine};
use rayon::prelude::*;

/// Data sets in a batch: as many as the drive steps together.
const LANES: usize = 8;

/// Errors at every position cycle.
#[derive(Clone, Debug, Default)]
pub(super) struct Response {
    pub deviation_lu: Vec<f64>,
    pub following_lu: Vec<f64>,
}

/// Data sets for one axis of one course.
pub(super) struct Job<'a> {
    pub course: &'a Course,
    /// Place in `course.axes`.
    pub place: usize,
    pub data: Vec<DriveData>,
}

/// All responses, job by job.
pub(super) fn responses(machine: &Machine, jobs: &[Job<'_>]) -> Vec<Vec<Response>> {
    let parts: Vec<(usize, &Job<'_>, &[DriveData])> = jobs
        .iter()
        .enumerate()
        .flat_map(|(number, job)| job.data.chunks(LANES).map(move |data| (number, job, data)))
        .collect();
    let done: Vec<Vec<Response>> = parts.par_iter().map(|(_, job, data)| batch(machine, job, data)).collect();
    let mut sorted: Vec<Vec<Response>> = jobs.iter().map(|job| Vec::with_capacity(job.data.len())).collect();
    for ((number, ..), part) in parts.iter().zip(done) {
        sorted[*number].extend(part);
    }
    sorted
}

fn batch(machine: &Machine, job: &Job<'_>, data: &[DriveData]) -> Vec<Response> {
    let Some(course) = job.course.axes.get(job.place) else { return Vec::new() };
    let rows = course.positions_lu.len();
    let start_lu = course.positions_lu.first().copied().unwrap_or(0.0);
    let axis = machine.axis(course.axis);
    let drives: Vec<AxisDrive> = data
        .iter()
        .filter_map(|data| {
            let mut axis = axis.clone();
            axis.drive = Some(data.clone());
            AxisDrive::new(&axis, &machine.cycle.time_base, Start::Held, start_lu)
        })
        .collect();
    let room = || Response { deviation_lu: vec![0.0; rows], following_lu: vec![0.0; rows] };
    let mut responses: Vec<Response> = drives.iter().map(|_| room()).collect();
    let mut batch = DriveBatch::new(drives);
    let mut inputs =
        vec![DriveInput { position_setpoint_lu: start_lu, load_n_m: 0.0, feedforward_active: true }; data.len()];
    for (row, position_lu) in course.positions_lu.iter().enumerate() {
        let feedforward_active = job.course.active.get(row / course.steps).copied().unwrap_or(true);
        inputs.fill(DriveInput { position_setpoint_lu: *position_lu, load_n_m: 0.0, feedforward_active });
        let offset_lu = course.offset_lu.get(row).copied().unwrap_or(0.0);
        batch.step(&inputs, |lane, signals| {
            responses[lane].deviation_lu[row] = bounded(signals.control_deviation_lu + offset_lu);
            responses[lane].following_lu[row] = bounded(signals.following_error_lu + offset_lu);
        });
    }
    responses
}

/// An error that is no number is the largest one.
fn bounded(error_lu: f64) -> f64 {
    const LARGEST_LU: f64 = 1e6;
    if error_lu.is_nan() { LARGEST_LU } else { error_lu.clamp(-LARGEST_LU, LARGEST_LU) }
}

/// RMS distance of trace and model over the RMS of the trace above which the model says little about the machine.
const FAR_SHARE: f64 = 0.5;

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// Brings the simulation with the machine's gains onto the measured errors of a trace: what is not in the model stays as it was measured.
pub(super) fn calibrate(machine: &Machine, courses: &mut [Course]) {
    for course in courses.iter_mut().filter(|course| course.measured) {
        let jobs: Vec<Job<'_>> = (0..course.axes.len())
            .map(|place| {
                let data = machine.axis(course.axes[place].axis).drive.clone();
                Job { course, place, data: data.into_iter().collect() }
            })
            .collect();
        let simulated = responses(machine, &jobs);
        for (axis, of_axis) in course.axes.iter_mut().zip(simulated) {
            let (Some(measured), Some(simulated)) = (&axis.measured_lu, of_axis.first()) else { continue };
            let (measured, simulated) = match measured {
                Measured::Deviation(measured) => (measured, &simulated.deviation_lu),
                Measured::Following(measured) => (measured, &simulated.following_lu),
            };
            let mut offset_lu: Vec<f64> =
                measured.iter().zip(simulated).map(|(measured, simulated)| measured - simulated).collect();
            let zero_lu = if axis.own_zero { mean(&offset_lu) } else { 0.0 };
            offset_lu.iter_mut().for_each(|offset| *offset -= zero_lu);
            let measured_lu: Vec<f64> = measured.iter().map(|measured| measured - zero_lu).collect();
            let [apart_lu, whole_lu] = [rms(&offset_lu), rms(&measured_lu)];
            if axis.moves && apart_lu > FAR_SHARE * whole_lu {
                let name = &machine.axis(axis.axis).name;
                let message = format!(
                    "`{}`: the error of {name} and that of its model are {:.0} % of it apart: gains tuned on this may be wrong",
                    course.name,
                    apart_lu / whole_lu * 100.0
                );
                course.warnings.push(Diagnostic::warning("U0008", message).help(
                    "was feed-forward on (FFWON) and are these the gains of the recording? Else identify the drive (`sollwert identify`) first",
                ));
            }
            axis.offset_lu = offset_lu;
        }
    }
}
