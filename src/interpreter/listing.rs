//! Moves as text: the `.moves` format.
//!
//! In: [`Move`]s. Out: one line a move, stable from version to version. Words of a line, separated by one blank:
//!
//! ```text
//! 12 arc X50 Y0 Z-2 F3000 XY C0,0 R50 sweep=360 [G642 CTOL0.1 SOFT FFWON] S10000 M3
//! |  |   |          |     |                     |                         events, in order of output
//! |  |   |          |     |                     modes, where they differ from the line before
//! |  |   |          |     arcs: plane, centre, radius (mm), swept angle (deg, positive = G3)
//! |  |   |          F in mm/min (deg/min where only rotary axes move), `F-`: none programmed, or `rapid`
//! |  |   all axes at the end, after all frames: mm, deg
//! |  rapid, line, arc, dwell, function
//! line of the program
//! ```
//!
//! An arc in another plane has its directions and centre in X, Y, Z in place of the plane. A spline or polynomial has the last value of
//! its parameter and the coefficients of u^0, u^1, ... of the axes that move, `D` for the denominator, its pieces after `|`:
//! `p2.5 X(0,1,0.2) Y(0,0,1)`.
//!
//! A thread adds the path in a revolution: `thread=2`, with `SF=90` and `change=0.1` where they are programmed; a tapped one `tap=0.8`, negative
//! where the spindle turns as with M4. A corner that RND, RNDM, CHF or CHR fills adds `RND=5`, `CHF=2` or `CHR=2` before the modes, with FRC or FRCM as `FRC300`.
//! A dwell adds `4s`, a function that brings the path to rest adds `stops`. Numbers have at most six decimals and no trailing
//! zeros. Does not read them back.

use super::listing_curves::curve_text;
use super::motion::rotary_alone;
use super::value::trimmed;
use super::wire::{
    Compressor, CornerInsert, CornerShape, Event, ExactStop, Feed, Modes, Move, MoveKind, ProgrammedLimits, Thread,
    ThreadCoupling,
};
use crate::base::units::{S_PER_MIN, deg_from_rad, mm_min_from_mm_s, percent_from_ratio};
use crate::base::{AxisKind, PartPoint};
use crate::machine::{AccelerationMode, Axis, DynamicsMode, Machine, PathMode};
use std::fmt::Write;

/// Writes moves line by line; remembers the modes of the last one.
#[derive(Clone, Debug)]
pub struct Listing<'m> {
    machine: &'m Machine,
    modes: Option<Modes>,
    start: PartPoint,
}

impl<'m> Listing<'m> {
    /// A listing of moves on `machine`, from its home position.
    pub fn new(machine: &'m Machine) -> Self {
        let mut start = PartPoint::default();
        for id in machine.axis_ids() {
            start.0[id] = machine.axis(id).home_lu;
        }
        Self { machine, modes: None, start }
    }

    /// The line of the next move, without a line end.
    pub fn line(&mut self, next: &Move) -> String {
        let modes = (self.modes.as_ref() != Some(&next.modes)).then(|| self.modes_text(&next.modes));
        // Another tool, say, is a change of the modes that no word shows.
        let modes = modes.filter(|text| !text.is_empty());
        self.modes = Some(next.modes.clone());
        let start = std::mem::replace(&mut self.start, next.end);
        format_with(self.machine, start, next, modes.as_deref())
    }

    /// Only what differs from the line before.
    fn modes_text(&self, modes: &Modes) -> String {
        let before = self.modes.as_ref();
        let mut words = Vec::new();
        if before.is_none_or(|before| before.path_mode != modes.path_mode) {
            words.push(path_mode_name(modes.path_mode).to_owned());
        }
        let length = |name: &str, length_mm: Option<f64>| match length_mm {
            Some(length_mm) => format!("{name}{}", trimmed(length_mm)),
            None => format!("{name}-"),
        };
        if before.map_or(modes.contour_tolerance_mm.is_some(), |before| {
            before.contour_tolerance_mm != modes.contour_tolerance_mm
        }) {
            words.push(length("CTOL", modes.contour_tolerance_mm));
        }
        if before.map_or(modes.rounding_distance_mm.is_some(), |before| {
            before.rounding_distance_mm != modes.rounding_distance_mm
        }) {
            words.push(length("ADIS", modes.rounding_distance_mm));
        }
        if before.map_or(modes.compressor != Compressor::Off, |before| before.compressor != modes.compressor) {
            words.push(compressor_name(modes.compressor).to_owned());
        }
        let known = self.tolerance_words(before.and_then(|before| before.programmed.as_deref()));
        let now = self.tolerance_words(modes.programmed.as_deref());
        words.extend(now.into_iter().zip(known).filter(|(now, known)| now != known).map(|(now, _)| now));
        if before.is_none_or(|before| before.acceleration_mode != modes.acceleration_mode) {
            words.push(match modes.acceleration_mode {
                AccelerationMode::Soft => "SOFT".to_owned(),
                AccelerationMode::Brisk => "BRISK".to_owned(),
                AccelerationMode::Drive => "DRIVE".to_owned(),
            });
        }
        if before.map_or(modes.dynamics != DynamicsMode::Norm, |before| before.dynamics != modes.dynamics) {
            words.push(format!("DYN={}", modes.dynamics.word()));
        }
        if before.map_or(modes.exact_stop != ExactStop::Fine, |before| before.exact_stop != modes.exact_stop) {
            words.push(
                match modes.exact_stop {
                    ExactStop::Fine => "G601",
                    ExactStop::Coarse => "G602",
                    ExactStop::Setpoint => "G603",
                }
                .to_owned(),
            );
        }
        if before.is_none_or(|before| before.feedforward_active != modes.feedforward_active) {
            words.push(if modes.feedforward_active { "FFWON" } else { "FFWOF" }.to_owned());
        }
        words.join(" ")
    }

    /// ACC and its kin, OVR, FGROUP.
    fn limit_words(&self, limits: &ProgrammedLimits, words: &mut Vec<String>) {
        let share = |ratio: f64| trimmed(ratio * 100.0);
        for id in self.machine.axis_ids() {
            let Axis { name, kind, .. } = self.machine.axis(id);
            words.push(format!("ACC[{name}]{}", share(limits.acceleration_ratio[id])));
            words.push(format!("VELOLIM[{name}]{}", share(limits.velocity_ratio[id])));
            words.push(format!("JERKLIM[{name}]{}", share(limits.jerk_ratio[id])));
            let highest = limits.synchronous_max_lu_s[id].map(|feed_lu_s| match kind {
                AxisKind::Linear => mm_min_from_mm_s(feed_lu_s),
                AxisKind::Rotary => deg_from_rad(feed_lu_s) * S_PER_MIN,
            });
            words.push(format!("FL[{name}]{}", highest.map_or_else(|| "-".to_owned(), trimmed)));
            words.push(format!("FGREF[{name}]{}", trimmed(limits.reference_radius_mm[id])));
        }
        words.push(format!("OVR{}", share(limits.override_ratio)));
        words.push(format!("OVRRAP{}", share(limits.rapid_override_ratio)));
        let group = limits.feed_group.map(|group| {
            let members = self.machine.axis_ids().filter(|id| group[*id]);
            members.map(|id| self.machine.axis(id).name.as_str()).collect::<Vec<_>>().join(",")
        });
        words.push(format!("FGROUP({})", group.unwrap_or_default()));
    }

    /// OTOL, ATOL and STOLF; `-` where none is programmed.
    fn tolerance_words(&self, limits: Option<&ProgrammedLimits>) -> Vec<String> {
        let none = ProgrammedLimits::default();
        let limits = limits.unwrap_or(&none);
        let shown = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), trimmed);
        let mut words = vec![format!("OTOL{}", shown(limits.orientation_tolerance_rad.map(deg_from_rad)))];
        for id in self.machine.axis_ids() {
            let Axis { name, kind, .. } = self.machine.axis(id);
            let tolerance = limits.axis_tolerance_lu[id];
            let customary = if *kind == AxisKind::Rotary { tolerance.map(deg_from_rad) } else { tolerance };
            words.push(format!("ATOL[{name}]{}", shown(customary)));
        }
        words.push(format!("STOLF{}", shown(limits.rapid_tolerance_ratio)));
        self.limit_words(limits, &mut words);
        words
    }
}

/// All moves, one line each.
pub fn listing<'a>(machine: &Machine, moves: impl IntoIterator<Item = &'a Move>) -> String {
    let mut listing = Listing::new(machine);
    moves.into_iter().fold(String::new(), |mut text, next| {
        text.push_str(&listing.line(next));
        text.push('\n');
        text
    })
}

/// One move that begins at `start`, without its modes.
pub fn format_move(machine: &Machine, start: PartPoint, shown: &Move) -> String {
    format_with(machine, start, shown, None)
}

/// Feed of a move that begins at `start` as a programmer writes it: mm/min, or deg/min where only rotary axes move. `None` for
/// rapids, dwells and functions.
pub fn feed_per_minute(machine: &Machine, start: PartPoint, shown: &Move) -> Option<f64> {
    let feed_lu_s = match &shown.feed {
        Feed::Rapid => return None,
        Feed::Path { feed_lu_s } => *feed_lu_s,
        Feed::Varying { feeds_lu_s } => feeds_lu_s.last().copied()?,
    };
    match &shown.kind {
        MoveKind::Line | MoveKind::Spline(_) | MoveKind::Polynomial(_) if rotary_alone(machine, start, shown.end) => {
            Some(deg_from_rad(feed_lu_s) * S_PER_MIN)
        }
        MoveKind::Line | MoveKind::Arc(_) | MoveKind::SpatialArc(_) | MoveKind::Spline(_) | MoveKind::Polynomial(_) => {
            Some(mm_min_from_mm_s(feed_lu_s))
        }
        _ => None,
    }
}

fn format_with(machine: &Machine, start: PartPoint, shown: &Move, modes: Option<&str>) -> String {
    let kind = kind_name(&shown.kind);
    let mut text = format!("{} {kind}", shown.block.line);
    for id in machine.axis_ids() {
        let axis = machine.axis(id);
        let end = match axis.kind {
            AxisKind::Linear => shown.end.0[id],
            AxisKind::Rotary => deg_from_rad(shown.end.0[id]),
        };
        add(&mut text, &named(&axis.name, &trimmed(end)));
    }
    match &shown.kind {
        MoveKind::Rapid => add(&mut text, "rapid"),
        MoveKind::Line | MoveKind::Arc(_) | MoveKind::SpatialArc(_) | MoveKind::Spline(_) | MoveKind::Polynomial(_) => {
            let feed = feed_per_minute(machine, start, shown);
            add(&mut text, &feed.map_or_else(|| "F-".to_owned(), |feed| format!("F{}", trimmed(feed))));
        }
        MoveKind::Dwell { time_s } => add(&mut text, &format!("{}s", trimmed(*time_s))),
        MoveKind::Function { stops: true } => add(&mut text, "stops"),
        MoveKind::StopPreparation => add(&mut text, "stops"),
        MoveKind::Function { stops: false } | MoveKind::Position(_) | MoveKind::WaitPositioned(_) => {}
    }
    if let Some(curve) = curve_text(machine, &shown.kind) {
        add(&mut text, &curve);
    }
    if let Some(thread) = &shown.modes.thread {
        add(&mut text, &thread_text(thread));
    }
    if let Some(corner) = &shown.corner {
        add(&mut text, &corner_text(corner));
    }
    if let Some(modes) = modes {
        add(&mut text, &format!("[{modes}]"));
    }
    shown.events.iter().for_each(|event| add(&mut text, &event_text(event)));
    text
}

/// Word for the kind of a move, in listings and JSON.
pub fn kind_name(kind: &MoveKind) -> &'static str {
    match kind {
        MoveKind::Rapid => "rapid",
        MoveKind::Line => "line",
        MoveKind::Arc(_) | MoveKind::SpatialArc(_) => "arc",
        MoveKind::Spline(_) => "spline",
        MoveKind::Polynomial(_) => "polynomial",
        MoveKind::Position(_) => "position",
        MoveKind::Dwell { .. } => "dwell",
        MoveKind::Function { .. } | MoveKind::WaitPositioned(_) | MoveKind::StopPreparation => "function",
    }
}

fn add(text: &mut String, word: &str) {
    // Writing to a String cannot fail.
    let _ = write!(text, " {word}");
}

/// `X10`, and `X1=10` for names with digits.
fn named(name: &str, value: &str) -> String {
    if name.len() == 1 { format!("{name}{value}") } else { format!("{name}={value}") }
}

fn path_mode_name(mode: PathMode) -> &'static str {
    match mode {
        PathMode::ExactStop => "G60",
        PathMode::G64 => "G64",
        PathMode::G641 => "G641",
        PathMode::G642 => "G642",
        PathMode::G643 => "G643",
        PathMode::G644 => "G644",
        PathMode::G645 => "G645",
    }
}

fn compressor_name(compressor: Compressor) -> &'static str {
    match compressor {
        Compressor::Off => "COMPOF",
        Compressor::On => "COMPON",
        Compressor::Curvature => "COMPCURV",
        Compressor::Cad => "COMPCAD",
        Compressor::Surface => "COMPSURF",
    }
}

/// `RND=5`, `CHF=2 FRC300`.
fn corner_text(corner: &CornerInsert) -> String {
    let (word, length_mm) = match corner.shape {
        CornerShape::Fillet { radius_mm } => ("RND", radius_mm),
        CornerShape::ChamferBase { length_mm } => ("CHF", length_mm),
        CornerShape::ChamferLeg { length_mm } => ("CHR", length_mm),
    };
    let feed = corner.feed_mm_s.map_or_else(String::new, |feed| format!(" FRC{}", trimmed(mm_min_from_mm_s(feed))));
    format!("{word}={}{feed}", trimmed(length_mm))
}

/// `thread=2 SF=90 change=0.1`, `tap=-0.8`: path in a revolution, its sense.
fn thread_text(thread: &Thread) -> String {
    match thread.coupling {
        ThreadCoupling::Tap { sense_ratio } => format!("tap={}", trimmed(sense_ratio * thread.rise_mm)),
        ThreadCoupling::Cut { start_angle_rad } => {
            let start = start_angle_rad.map_or_else(String::new, |rad| format!(" SF={}", trimmed(deg_from_rad(rad))));
            let change = match thread.rise_change_mm {
                0.0 => String::new(),
                change_mm => format!(" change={}", trimmed(change_mm)),
            };
            format!("thread={}{start}{change}", trimmed(thread.rise_mm))
        }
    }
}

fn event_text(event: &Event) -> String {
    match event {
        Event::ProgramOpened(opened) => format!("open={:?}", &*opened.name),
        Event::MFunction(number) => format!("M{number}"),
        Event::SpindleSpeed { speed_rpm } => format!("S{}", trimmed(*speed_rpm)),
        Event::Tool(tool) => format!("T={:?}", &**tool),
        Event::Edge(number) => format!("D{number}"),
        Event::Message(text) => format!("MSG({:?})", &**text),
        Event::Trace(starts) => format!("trace={}", if *starts { "start" } else { "stop" }),
        Event::HFunction(value) => format!("H{}", trimmed(*value)),
        Event::Position(_) => "position".to_owned(),
        Event::Synchronised(action) => format!("$AC_OVR={}", trimmed(percent_from_ratio(action.override_ratio))),
        Event::CancelSynchronised(ids) => format!("CANCEL{ids:?}"),
        Event::Spindle(text) => text.to_string(),
        Event::SpindlePosition(positioning) if positioning.text.is_empty() => "spindle=0".to_owned(),
        Event::SpindlePosition(positioning) => positioning.text.to_string(),
        Event::SpindleWait => "spindle=wait".to_owned(),
        Event::SpindleAcceleration { ratio } => format!("acceleration={ratio}"),
        Event::Programmed(block) => format!("programmed={}", block.motion.word()),
    }
}
