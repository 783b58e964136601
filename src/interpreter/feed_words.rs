//! Words of feed, dynamics and spindles.
//!
//! In: words of a block. Out: modal state, events. Decisions where the manuals leave room:
//!
//! * A change of the unit of F (G93, G931, G94 and kin, G95 and kin) forgets F: the control asks for a new one.
//! * G97, G971, G972, G973, G942 and G952 keep the spindle speed that G96 came to last.
//! * CFC, CFTCP and CFIN are kept, and have no effect without tool radius compensation (G41, G42), which is not built.
//! * OVR acts on F, OVRRAP on rapids, each from more than 0 to 200 %; a rapid is never faster than its axes. 0 would hold the axes for ever.
//! * ACC of 1 to 200 %, VELOLIM of 1 to 100 %, JERKLIM of 1 to 200 %.
//!
//! Spindles are in `spindle_words`, positioning axes are in `positioning`, the feed of a motion in `path_feed`.

use super::block::{Collected, FEED_MIN, not_built, whole};
use super::evaluate::number;
use super::feed_state::FeedBase;
use super::path_feed::inverse_time_s;
use super::run::Interpreter;
use super::value::trimmed;
use super::wire::{Event, ProgrammedLimits};
use crate::base::{AxisId, AxisKind, PerAxis};
use crate::machine::{AccelerationMode, DynamicsMode};
use crate::program::syntax::{Address, Expr, ExprKind, IndexedValue, Typed};
use crate::program::words::{FeedCorrection, FeedShape, FeedType, IndexedAddress, Procedure};
use crate::program::{Columns, Fault, Outcome, codes};

/// M functions of a spindle: turning right, left, stop, positioned, axis mode.
const SPINDLE_TURNS: [u32; 2] = [3, 4];
const SPINDLE_STANDS: [u32; 3] = [5, 19, 70];

impl Interpreter {
    /// G93, G94, G95, G96, G97 and their kin.
    pub(super) fn feed_type(&mut self, feed_type: FeedType, _columns: &Columns) -> Outcome<()> {
        let before = self.modal.feed_modes.base;
        let was_cutting = self.modal.feed_modes.cutting;
        let speed_rpm = self.cutting_rpm_here();
        self.modal.feed_modes.select(feed_type);
        let modes = &self.modal.feed_modes;
        if modes.base != before {
            self.modal.feed = None;
        }
        if was_cutting && !modes.cutting {
            self.keep_speed(speed_rpm.unwrap_or(0.0));
        }
        Ok(())
    }

    /// FNORM, FLIN, FCUB.
    pub(super) fn feed_shape(&mut self, shape: FeedShape, _columns: &Columns) -> Outcome<()> {
        let modes = &mut self.modal.feed_modes;
        if modes.shape == FeedShape::Constant {
            modes.before = self.modal.feed;
        }
        modes.shape = shape;
        modes.note_plain();
        Ok(())
    }

    /// CFC, CFTCP, CFIN: they tell what F means under G41 and G42.
    pub(super) fn feed_correction(&mut self, _correction: FeedCorrection, _columns: &Columns) -> Outcome<()> {
        Ok(())
    }

    /// RTLION, RTLIOF.
    pub(super) fn rapid_linear(&mut self, linear: bool, _columns: &Columns) -> Outcome<()> {
        self.modal.feed_modes.rapid_by_axis = !linear;
        self.modal.feed_modes.note_plain();
        Ok(())
    }

    /// DYNPREC.
    pub(super) fn dynamics_precision(&mut self, _columns: &Columns) -> Outcome<()> {
        self.modal.dynamics = DynamicsMode::Precision;
        Ok(())
    }

    /// F, FB and S of a block, after all its G functions.
    pub(super) fn take_feed(&mut self, block: &mut Collected) -> Outcome<()> {
        let base = self.modal.feed_modes.base;
        let time_s = |typed: Typed| if base == FeedBase::InverseTime { inverse_time_s(typed.0) } else { typed.0 };
        let timed = matches!(base, FeedBase::InverseTime | FeedBase::Time);
        if let Some((typed, columns)) = block.feed.take() {
            positive_feed(typed, &columns)?;
            if timed {
                block.motion.block_time_s = Some(time_s(typed));
                self.modal.feed_modes.last_time_s = block.motion.block_time_s;
            } else {
                self.modal.feed = Some(self.modal.programmed_feed(typed));
            }
        }
        if let Some((typed, columns)) = block.block_feed.take() {
            positive_feed(typed, &columns)?;
            if timed {
                block.motion.block_time_s = Some(time_s(typed));
            } else {
                block.motion.block_feed = Some(self.modal.programmed_feed(typed));
            }
        }
        if let Some((speed, columns)) = block.spindle_speed_rpm.clone() {
            self.take_spindle_speed(speed, &columns, block);
        }
        Ok(())
    }

    /// M3, M4, M5 and the like.
    pub(super) fn note_spindle(&mut self, m_function: u32) {
        let modes = &mut self.modal.feed_modes;
        modes.spindle_turns = turns_after(m_function).unwrap_or(modes.spindle_turns);
    }

    /// FB, LIMS, OVR, OVRRAP, H, S of other spindles, M of other spindles.
    pub(super) fn feed_address(
        &mut self,
        address: Address,
        typed: Typed,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match address {
            Address::BlockFeed => block.block_feed = Some((typed, columns.clone())),
            Address::SpindleLimit => {
                let limit_rpm = within(typed.0, [0.1, 1e6], "rpm", columns)?;
                self.modal.feed_modes.cutting_limit_rpm = Some(limit_rpm);
            }
            Address::Override => {
                let ratio = percent("OVR", typed.0, 200.0, columns)?;
                self.set_programmed(|limits| limits.override_ratio = ratio);
            }
            Address::RapidOverride => {
                let ratio = percent("OVRRAP", typed.0, 200.0, columns)?;
                self.set_programmed(|limits| limits.rapid_override_ratio = ratio);
            }
            Address::H => block.events.push(Event::HFunction(typed.0)),
            Address::SpindleSpeedOf(spindle) => {
                let speed_rpm = within(typed.0, [0.0, 1e6], "rpm", columns)?;
                self.speed_of(spindle, speed_rpm, columns, block);
            }
            Address::MOf(spindle) => {
                let function = whole(typed, columns, "M")?;
                self.function_of(spindle, function, columns, block);
            }
            _ => return Err(not_built("this address", columns)),
        }
        Ok(())
    }

    /// Changes speed and sense of a spindle, the master spindle included.
    pub(super) fn other_spindle(&mut self, spindle: u32, change: impl FnOnce(&mut (f64, bool))) {
        let modal = &mut self.modal;
        if spindle == modal.feed_modes.master_spindle {
            let mut state = (modal.spindle_speed_rpm, modal.feed_modes.spindle_turns);
            change(&mut state);
            (modal.spindle_speed_rpm, modal.feed_modes.spindle_turns) = state;
        } else {
            change(modal.feed_modes.other_spindles.entry(spindle).or_insert((0.0, false)));
        }
    }

    /// ACC, VELOLIM, JERKLIM, FL, FA, FGREF, OVRA, POS, POSA, SPOS, SPOSA.
    pub(super) fn feed_indexed(
        &mut self,
        address: IndexedAddress,
        index: Option<&Expr>,
        values: &IndexedValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        let IndexedValue::One(value) = values else {
            return Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "a list where one value is needed")
                .label("expected one value"));
        };
        if matches!(address, IndexedAddress::SpindlePosition | IndexedAddress::SpindlePositionAsync) {
            return self.position_spindle(address, index, value, columns, block);
        }
        let Some(index) = index else {
            return Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "no axis in the brackets")
                .label("expected an axis in [ ]"));
        };
        let typed = Typed(number(&value.value, self)?);
        if let Some((spindle, name)) = spindle_name(index) {
            return self.spindle_word(address, (spindle, &name), typed.0, columns, block);
        }
        let axis = self.axis_of(index)?;
        let share = |most_percent| {
            let word = format!("{}[{}]", word_of(address), self.machine.axis(axis).name);
            percent(&word, typed.0, most_percent, columns)
        };
        match address {
            IndexedAddress::Position | IndexedAddress::PositionAsync => {
                let waits = address == IndexedAddress::Position;
                return self.position_word(axis, typed, value, waits, columns, block);
            }
            IndexedAddress::Acceleration => {
                let ratio = share(200.0)?;
                self.set_programmed(|limits| limits.acceleration_ratio[axis] = ratio);
            }
            IndexedAddress::Velocity => {
                let ratio = share(100.0)?;
                self.set_programmed(|limits| limits.velocity_ratio[axis] = ratio);
            }
            IndexedAddress::Jerk => {
                let ratio = share(200.0)?;
                self.set_programmed(|limits| limits.jerk_ratio[axis] = ratio);
            }
            IndexedAddress::SynchronousLimit => {
                let feed_lu_s = self.axis_feed(axis, typed, columns)?;
                self.set_programmed(|limits| limits.synchronous_max_lu_s[axis] = Some(feed_lu_s));
            }
            IndexedAddress::PositioningFeed => {
                let feed_lu_s = self.axis_feed(axis, typed, columns)?;
                self.modal.feed_modes.positioning_feed_lu_s[axis] = Some(feed_lu_s);
            }
            IndexedAddress::AxisOverride => {
                self.modal.feed_modes.positioning_override_ratio[axis] = share(200.0)?;
            }
            IndexedAddress::ReferenceRadius => {
                let radius_mm = self.modal.position_lu(AxisKind::Linear, typed);
                let radius_mm = within(radius_mm, [1e-6, 1e7], "mm", columns)?;
                self.set_programmed(|limits| limits.reference_radius_mm[axis] = radius_mm);
            }
            _ => return Err(not_built("this word", columns)),
        }
        Ok(())
    }

    /// Velocity of one axis: mm/min, inch/min with G700, deg/min.
    fn axis_feed(&self, axis: AxisId, typed: Typed, columns: &Columns) -> Outcome<f64> {
        positive_feed(typed, columns)?;
        let feed = self.modal.programmed_feed(typed);
        Ok(match self.machine.axis(axis).kind {
            AxisKind::Linear => feed.linear_mm_s,
            AxisKind::Rotary => feed.rotary_rad_s,
        })
    }

    /// FGROUP, WAITP, WAITS, SOFTA, SPCON, SETMS, POSP.
    pub(super) fn feed_procedure(
        &mut self,
        procedure: Procedure,
        given: &[Option<Expr>],
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match procedure {
            Procedure::FeedGroup => {
                let group = if given.is_empty() { None } else { Some(self.axes_of(given)?) };
                self.set_programmed(|limits| limits.feed_group = group);
            }
            Procedure::WaitPositioned => {
                let axes = self.axes_of(given)?;
                self.wait_positioned(axes);
            }
            Procedure::AxisAcceleration(mode) => {
                // Without an axis: all of them.
                let axes = if given.is_empty() { PerAxis::splat(true) } else { self.axes_of(given)? };
                for id in self.machine.clone().axis_ids().filter(|id| axes[*id]) {
                    self.modal.feed_modes.positioning_brisk[id] = mode != AccelerationMode::Soft;
                }
            }
            Procedure::WaitSpindle => {
                self.record_procedure(procedure, given, block)?;
                block.waits_for_spindle |= self.machine.spindle.is_some();
            }
            Procedure::SpindleControl => self.record_procedure(procedure, given, block)?,
            Procedure::MasterSpindle => {
                let spindle = match given.first().and_then(Option::as_ref) {
                    Some(expr) => whole(Typed(number(expr, self)?), &expr.columns, "SETMS")?,
                    None => 1,
                };
                self.set_master(spindle, columns);
                block.events.push(Event::Spindle(format!("SETMS({spindle})").into()));
            }
            _ => return Err(not_built("POSP", columns)),
        }
        Ok(())
    }

    fn record_procedure(&mut self, procedure: Procedure, given: &[Option<Expr>], block: &mut Collected) -> Outcome<()> {
        let mut numbers = Vec::new();
        for expr in given.iter().flatten() {
            numbers.push(trimmed(number(expr, self)?));
        }
        let name = if procedure == Procedure::WaitSpindle { "WAITS" } else { "SPCON" };
        block.events.push(Event::Spindle(format!("{name}({})", numbers.join(",")).into()));
        Ok(())
    }

    /// The axes that a list names.
    fn axes_of(&self, given: &[Option<Expr>]) -> Outcome<PerAxis<bool>> {
        let mut axes = PerAxis::splat(false);
        for expr in given.iter().flatten() {
            axes[self.axis_of(expr)?] = true;
        }
        Ok(axes)
    }

    /// Changes what is programmed about the axes; nothing is kept of what is as without a program.
    pub(super) fn set_programmed(&mut self, set: impl FnOnce(&mut ProgrammedLimits)) {
        let mut limits = self.modal.programmed.as_deref().cloned().unwrap_or_default();
        set(&mut limits);
        self.modal.programmed = (limits != ProgrammedLimits::default()).then(|| limits.into());
    }
}

/// Whether a spindle turns after this M function; `None`: as before.
pub(super) fn turns_after(m_function: u32) -> Option<bool> {
    let turns = SPINDLE_TURNS.contains(&m_function);
    (turns || SPINDLE_STANDS.contains(&m_function)).then_some(turns)
}

/// S1, S2: a spindle where an axis may stand.
fn spindle_name(index: &Expr) -> Option<(u32, String)> {
    let ExprKind::Variable { name, indices } = &index.kind else { return None };
    let digits = name.strip_prefix('S').filter(|digits| !digits.is_empty() && indices.is_empty())?;
    Some((digits.parse().ok()?, name.to_string()))
}

pub(super) fn word_of(address: IndexedAddress) -> &'static str {
    match address {
        IndexedAddress::Acceleration => "ACC",
        IndexedAddress::Velocity => "VELOLIM",
        IndexedAddress::Jerk => "JERKLIM",
        IndexedAddress::AxisOverride => "OVRA",
        IndexedAddress::SpindlePosition => "SPOS",
        IndexedAddress::SpindlePositionAsync => "SPOSA",
        IndexedAddress::PositioningFeed => "FA",
        _ => "spindle",
    }
}

fn positive_feed(typed: Typed, columns: &Columns) -> Outcome<()> {
    if typed.0 >= FEED_MIN && typed.0.is_finite() {
        return Ok(());
    }
    Err(Fault::new(codes::BAD_FEED, columns.clone(), format!("feed {} is not possible", typed.0))
        .label(format!("expected {FEED_MIN} or more"))
        .help("no feed moves nothing: write a feed above 0, G0 for a rapid, or M0 to stop"))
}

/// A percentage above 0, as a share; `word` is what it was given to.
pub(super) fn percent(word: &str, value_percent: f64, most_percent: f64, columns: &Columns) -> Outcome<f64> {
    if value_percent > 0.0 && value_percent <= most_percent {
        return Ok(value_percent / 100.0);
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{word} of {value_percent} % is not possible"))
        .label(format!("expected more than 0 and at most {most_percent} %"))
        .help(format!("give 1 to {most_percent} %: with 0 the path would stand for ever")))
}

fn within(value: f64, [low, high]: [f64; 2], unit: &str, columns: &Columns) -> Outcome<f64> {
    if (low..=high).contains(&value) {
        return Ok(value);
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{value} {unit} is not possible"))
        .label(format!("expected {low} to {high} {unit}")))
}
