//! Where the tool was: points in space from the positions of the axes of a trace.
//!
//! In: a trace, which positions (set-points, actual). Out: [`Track`]: X, Y, Z on one time base; with a machine file that turns the table or
//! the head, the tool tip in the part, so that five axes are judged where they cut: with the length of the tool where the recording tells
//! it, otherwise of a tool without length. Rotary axes without a machine file do not enter. Does not decide what is compared with what.

use super::path::Line;
use super::series::{Series, noise_of};
use crate::base::units::rad_from_deg;
use crate::base::{AxisId, AxisKind, AxisVector, MachinePoint, SourceText};
use crate::kinematics::Kinematics;
use crate::machine::{KinematicsSettings, Machine};
use crate::trace::{ProgrammedPath, Signal, TimeGrid, Trace};

/// Positions in space over time.
#[derive(Clone, Debug)]
pub struct Track {
    /// Field of the axes that it is made of, such as `position_actual`.
    pub stem: &'static str,
    /// Axes that it is made of.
    pub axes: Vec<String>,
    /// True: tool tip in the part, by the kinematics of the machine file. False: positions of X, Y, Z.
    pub in_part: bool,
    /// Times of the samples.
    pub times: TimeGrid,
    /// What the times are late by.
    pub delay_s: f64,
    /// Points, NaN in gaps.
    pub points_mm: Vec<[f64; 3]>,
    /// Standard deviation of the noise of the noisiest axis.
    pub noise_mm: f64,
}

impl Track {
    /// Time of a sample.
    pub fn time_s(&self, index: usize) -> f64 {
        self.times.time_s(index) - self.delay_s
    }

    /// The track as a line; steps within the noise make no vertices. `plane`: the coordinate to leave out.
    pub fn line(&self, plane: Option<usize>) -> Line {
        // Six standard deviations, and far below what anybody measures.
        let noise_mm = (6.0 * self.noise_mm).max(1e-6);
        let points = self.points_mm.iter().enumerate().map(|(i, point)| (self.time_s(i), flat(*point, plane)));
        Line::new(points, noise_mm)
    }
}

/// A point without one of its coordinates.
pub fn flat(mut point_mm: [f64; 3], plane: Option<usize>) -> [f64; 3] {
    if let Some(left_out) = plane.and_then(|i| point_mm.get_mut(i)) {
        *left_out = 0.0;
    }
    point_mm
}

/// Fields that say where the tool was, the best first.
pub const ACTUAL_STEMS: [&str; 3] = ["position_actual", "position_measured", "position_setpoint"];
/// Fields that say where it should be.
pub const SETPOINT_STEMS: [&str; 2] = ["position_setpoint", "position_reference"];

/// Machine that travelled with a trace.
pub fn machine_of(trace: &Trace) -> Option<Machine> {
    let (name, text) = trace.machine.as_ref()?;
    let source = SourceText::new(name.as_str(), text.as_str());
    crate::machine::parse(&source, &[]).ok().map(|loaded| loaded.machine)
}

/// The first of the fields of which X, Y or Z have signals that move; `None` if none does. `tools`: with the lengths of the tools, if the
/// trace knows them; matters only where the part or the tool turns.
pub fn track(trace: &Trace, machine: Option<&Machine>, stems: &[&'static str], tools: bool) -> Option<Track> {
    stems.iter().find_map(|stem| of_stem(trace, machine, stem, tools))
}

fn of_stem(trace: &Trace, machine: Option<&Machine>, stem: &'static str, tools: bool) -> Option<Track> {
    let linear = |name: &str| {
        trace.axis_signal(name, stem).filter(|s| s.axis_signal().is_some_and(|own| own.kind == AxisKind::Linear))
    };
    let signals: [Option<&Signal>; 3] = ["X", "Y", "Z"].map(linear);
    let base = signals.iter().flatten().max_by_key(|signal| signal.len())?;
    let joints = machine.filter(|m| !matches!(m.kinematics, KinematicsSettings::Cartesian)).and_then(|machine| {
        let rotary: Vec<(usize, &Signal)> = machine
            .axis_ids()
            .enumerate()
            .filter(|(_, id)| machine.axis(*id).kind == AxisKind::Rotary)
            .filter_map(|(i, id)| Some((i, trace.axis_signal(&machine.axis(id).name, stem)?)))
            .collect();
        (!rotary.is_empty()).then_some((machine, rotary))
    });
    let mut axes: Vec<String> = Vec::new();
    let on_base = |signal: &Signal| -> Vec<f64> {
        if signal.times == base.times && signal.meaning.delay_s == base.meaning.delay_s {
            return signal.values.clone();
        }
        let mut cursor = Series::of(signal).cursor();
        (0..base.len()).map(|i| cursor.value(base.times.time_s(i) - base.meaning.delay_s)).collect()
    };
    let mut points_mm = vec![[0.0; 3]; base.len()];
    let mut noise_mm: f64 = 0.0;
    for (i, (name, signal)) in ["X", "Y", "Z"].iter().zip(signals).enumerate() {
        let Some(signal) = signal else { continue };
        let values = on_base(signal);
        noise_mm = noise_mm.max(noise_of(&values));
        points_mm.iter_mut().zip(values).for_each(|(point, value)| point[i] = value);
        axes.push((*name).to_owned());
    }
    if let Some((machine, rotary)) = &joints {
        let angles: Vec<(usize, Vec<f64>)> = rotary.iter().map(|(i, signal)| (*i, on_base(signal))).collect();
        axes.extend(rotary.iter().filter_map(|(_, s)| Some(s.axis_signal()?.axis.to_owned())));
        let lengths = Lengths { path: tools.then_some(&trace.programmed), tips: Tips::new(machine) };
        let time_s = |k: usize| base.times.time_s(k) - base.meaning.delay_s;
        into_part(&lengths, &angles, &mut points_mm, &time_s);
    }
    let first = points_mm.iter().find(|p| p.iter().all(|x| x.is_finite()))?;
    let still_mm = (20.0 * noise_mm).max(1e-4);
    let moves = points_mm.iter().any(|p| (0..3).any(|i| (p[i] - first[i]).abs() > still_mm));
    moves.then(|| Track {
        stem,
        axes,
        in_part: joints.is_some(),
        times: base.times.clone(),
        delay_s: base.meaning.delay_s,
        points_mm,
        noise_mm,
    })
}

/// The tips of tools of a machine.
pub(super) struct Tips {
    kinematics: Kinematics,
    ids: Vec<AxisId>,
    geometry: [Option<AxisId>; 3],
    names: Vec<String>,
}

impl Tips {
    pub(super) fn new(machine: &Machine) -> Self {
        Self {
            kinematics: Kinematics::new(machine),
            ids: machine.axis_ids().collect(),
            geometry: ["X", "Y", "Z"].map(|name| machine.axis_by_name(name)),
            names: machine.axes.iter().map(|axis| axis.name.clone()).collect(),
        }
    }

    /// Places of axes in the machine, by their names.
    pub(super) fn places<'a>(&self, names: impl Iterator<Item = &'a str>) -> Vec<Option<AxisId>> {
        let place = |name: &str| self.names.iter().position(|own| own == name).map(|i| self.ids[i]);
        names.map(place).collect()
    }

    /// The tip in the part when the axes stand at `posture`. `length`: of the tool, as axes - tip.
    pub(super) fn in_part(&self, posture: &MachinePoint, length: &AxisVector) -> [f64; 3] {
        self.kinematics.tip_pose(posture, length).position_mm
    }
}

/// Lengths of the tools over time.
struct Lengths<'a> {
    path: Option<&'a ProgrammedPath>,
    tips: Tips,
}

impl Lengths<'_> {
    fn at(&self, time_s: f64, places: &[Option<AxisId>]) -> AxisVector {
        let mut length = AxisVector::zero();
        let block = self.path.and_then(|path| path.block(path.index_at(time_s + TICK_SLACK_S)?));
        for (value_mm, place) in block.iter().flat_map(|block| block.tool_length_mm).zip(places) {
            if let Some(axis) = place {
                length[*axis] = *value_mm;
            }
        }
        length
    }
}

/// An instant of a signal and that of a block are the same within this.
pub(super) const TICK_SLACK_S: f64 = 1e-9;

/// Points of the slides -> points of the tool tip in the part. `angles`: place of the axis in the machine, angles in deg.
fn into_part(
    lengths: &Lengths<'_>,
    angles: &[(usize, Vec<f64>)],
    points_mm: &mut [[f64; 3]],
    time_s: &dyn Fn(usize) -> f64,
) {
    let tips = &lengths.tips;
    let places = lengths.path.map_or_else(Vec::new, |path| tips.places(path.axes()));
    for (k, point) in points_mm.iter_mut().enumerate() {
        let mut posture = MachinePoint(AxisVector::zero());
        for (axis, value_mm) in tips.geometry.iter().zip(*point) {
            if let Some(axis) = axis {
                posture.0[*axis] = value_mm;
            }
        }
        for (place, values_deg) in angles {
            posture.0[tips.ids[*place]] = rad_from_deg(values_deg[k]);
        }
        *point = tips.in_part(&posture, &lengths.at(time_s(k), &places));
    }
}
