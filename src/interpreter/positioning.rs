//! Axes that move on their own: POS, POSA, WAITP, and G0 under RTLIOF.
//!
//! In: words of a block. Out: [`MoveKind::Position`] and [`MoveKind::WaitPositioned`]. Order in a block: the positioning axes start, the
//! path moves, and with POS the block ends when all of them have arrived. POSA goes on beside the blocks that follow; a block that
//! moves such an axis, or sends it elsewhere, waits for it first, and so does the end of the program.
//!
//! * Without FA an axis goes as fast as it can (the control: MD32060, which the machine file does not have). Its jerk is limited
//!   unless BRISKA or DRIVEA says otherwise. Its acceleration is that of DYNNORM with ACC.
//! * An axis of the transformation of a five-axis machine cannot move on its own: an error, because the others would jump.
//! * RTLIOF acts only where the control lets it: G60 or G9, no compressor and no transformation. Every axis of the rapid then takes its own time.
//!
//! Does not know how long a motion takes: that is feed's.

use super::block::Collected;
use super::motion::{AxisWord, MotionWords};
use super::run::Interpreter;
use super::wire::{AxisPositioning, Compressor, Event, Feed, MoveKind};
use crate::base::{AxisId, PartPoint, PerAxis};
use crate::machine::{KinematicsSettings, PathMode};
use crate::program::syntax::{AddressValue, Typed};
use crate::program::{Columns, Fault, Outcome, codes};

/// POS and POSA of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct PositionWords {
    words: Vec<(AxisId, AxisWord)>,
    /// POS: the block waits for these.
    waits: PerAxis<bool>,
}

impl Interpreter {
    /// POS[axis], POSA[axis].
    pub(super) fn position_word(
        &mut self,
        axis: AxisId,
        typed: Typed,
        value: &AddressValue,
        waits: bool,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        if block.positions.words.iter().any(|(known, _)| *known == axis) {
            return Err(Fault::new(codes::TWICE, columns.clone(), "this axis is positioned twice in the block")
                .label("programmed again"));
        }
        if self.in_transformation(axis) {
            let name = &self.machine.axis(axis).name;
            let message = format!("{name} belongs to the transformation of the machine and cannot move on its own");
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), message)
                .label("the other axes would have to jump")
                .help(format!(
                    "write G0 {name}=... or G1 {name}=... F...: the tool tip then stays where it is programmed"
                )));
        }
        block.positions.words.push((axis, AxisWord { typed, form: value.form, columns: columns.clone() }));
        block.positions.waits[axis] |= waits;
        Ok(())
    }

    /// Starts the positioning axes of a block.
    pub(super) fn start_positions(&mut self, block: &Collected) -> Outcome<()> {
        let mut words = MotionWords { suppression: block.motion.suppression, ..MotionWords::default() };
        for (axis, word) in &block.positions.words {
            if block.motion.axes[*axis].is_some() {
                let message = "an axis of the path cannot be positioned in the same block";
                return Err(Fault::new(codes::BAD_BLOCK, word.columns.clone(), message)
                    .label("expected another axis, or a block of its own"));
            }
            words.axes[*axis] = Some(word.clone());
        }
        if block.positions.words.is_empty() {
            return Ok(());
        }
        let end = self.end_point(&words)?;
        self.check_work_area(&words, &MoveKind::Rapid, &end)?;
        self.check_travel(&words, end);
        let named = PerAxis::from_fn(|axis| words.axes[axis].is_some());
        let start = self.position;
        self.position_axes(end, named, false);
        self.note_programmed(&words, start);
        Ok(())
    }

    /// Waits for the axes of POS.
    pub(super) fn finish_positions(&mut self, block: &Collected) {
        if block.positions.waits.as_slice().contains(&true) {
            self.wait_positioned(block.positions.waits);
        }
    }

    /// True where G0 moves every axis on its own.
    pub(super) fn rapid_by_axis(&self, exact_stop: bool) -> bool {
        let stops = exact_stop || self.modal.path_mode == PathMode::ExactStop;
        let transformed = matches!(self.machine.kinematics, KinematicsSettings::Rotary { .. });
        self.modal.feed_modes.rapid_by_axis && stops && self.modal.compressor == Compressor::Off && !transformed
    }

    /// An axis whose position the transformation computes from several programmed ones.
    fn in_transformation(&self, axis: AxisId) -> bool {
        match &self.machine.kinematics {
            KinematicsSettings::Cartesian => false,
            KinematicsSettings::Rotary { table, head } => {
                let joint = table.iter().chain(head).any(|joint| joint.axis == axis);
                joint || self.geometry.contains(&Some(axis))
            }
        }
    }

    /// G0 under RTLIOF.
    pub(super) fn rapid_axes(&mut self, end: PartPoint, named: PerAxis<bool>, events: Vec<Event>) {
        if !events.is_empty() {
            self.emit_function(events, false);
        }
        self.position_axes(end, named, true);
        self.wait_positioned(named);
    }

    fn position_axes(&mut self, end: PartPoint, named: PerAxis<bool>, rapid: bool) {
        self.wait_for_moving(named);
        let modes = &self.modal.feed_modes;
        let rapid_ratio = self.modal.programmed.as_ref().map_or(1.0, |limits| limits.rapid_override_ratio.min(1.0));
        let mut axes = Vec::new();
        for id in self.machine.axis_ids().filter(|id| named[*id]) {
            let fastest_lu_s = self.machine.axis(id).limits.velocity_max_lu_s;
            let (feed_lu_s, ratio) = if rapid {
                (None, rapid_ratio)
            } else {
                (modes.positioning_feed_lu_s[id], modes.positioning_override_ratio[id])
            };
            let limited = feed_lu_s.is_some() || ratio < 1.0;
            axes.push(AxisPositioning {
                axis: id,
                start_lu: self.position.0[id],
                end_lu: end.0[id],
                feed_lu_s: limited.then(|| feed_lu_s.unwrap_or(fastest_lu_s) * ratio),
                jerk_limited: !modes.positioning_brisk[id],
            });
        }
        self.position = end;
        for axis in &axes {
            self.modal.feed_modes.positioning[axis.axis] = true;
        }
        self.modal.feed_modes.note_plain();
        self.emit(MoveKind::Position(axes.into()), Feed::Rapid, false, Vec::new());
    }

    /// Waits for those of the axes that are still on their way.
    pub(super) fn wait_for_moving(&mut self, axes: PerAxis<bool>) {
        let moving = self.modal.feed_modes.positioning;
        let both = PerAxis::from_fn(|id| axes[id] && moving[id]);
        if both.as_slice().contains(&true) {
            self.wait_positioned(both);
        }
    }

    /// WAITP.
    pub(super) fn wait_positioned(&mut self, axes: PerAxis<bool>) {
        for id in self.machine.axis_ids().filter(|id| axes[*id]) {
            self.modal.feed_modes.positioning[id] = false;
        }
        self.modal.feed_modes.note_plain();
        self.emit(MoveKind::WaitPositioned(axes), self.standing_feed(), false, Vec::new());
    }
}
