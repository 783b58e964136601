//! Words of a block: what each of them does, and in which order the block acts.
//!
//! In: [`Word`]s. Out: modal state, events, the words of a motion for `motion`. Order of action: words from left to right
//! (assignments, G functions), then F, frame, T and M6, motion with the other outputs, and last M0, M1, M2, M17 or M30.

use super::evaluate::{evaluate, integers, number};
use super::frame_words::FrameRequest;
use super::modal::Motion;
use super::motion::{AxisWord, MotionWords};
use super::path_words::CornerWords;
use super::positioning::PositionWords;
use super::run::Interpreter;
use super::value::Value;
use super::wire::{Event, Move, MoveKind};
use crate::base::units::S_PER_MIN;
use crate::program::syntax::{Address, AddressValue, Expr, Form, IndexedValue, Target, Typed, Word, WordKind};
use crate::program::words::{GFunction, IndexedAddress, Keyword, PoleOrigin, Procedure, Suppression};
use crate::program::{Columns, Fault, Outcome, codes, whole_number};
use std::sync::Arc;

/// M6: the tool change comes before the motion of its block, at rest.
const TOOL_CHANGE: u32 = 6;
/// M19: the spindle is positioned.
const SPINDLE_POSITION: u32 = 19;
/// M0, M1: stop. M2, M17, M30: end. They come after the motion of their block.
const STOPS: [u32; 5] = [0, 1, 2, 17, 30];
const ENDS: [u32; 3] = [2, 17, 30];
/// Most circles that TURN adds.
const TURNS_MAX: u32 = 999;
/// Smallest F of the control, in the unit of F.
pub(super) const FEED_MIN: f64 = 0.001;
/// Longest wait of the control.
const DWELL_MAX_S: f64 = 99999.999;

/// What the words of a block come to.
#[derive(Default)]
pub(super) struct Collected {
    pub motion: MotionWords,
    /// G groups seen, one bit each.
    groups: u64,
    addresses: Vec<Address>,
    pub feed: Option<(Typed, Columns)>,
    pub spindle_speed_rpm: Option<(f64, Columns)>,
    /// FB.
    pub block_feed: Option<(Typed, Columns)>,
    /// POS, POSA.
    pub positions: PositionWords,
    pub frame: FrameRequest,
    dwell: Option<Columns>,
    /// G110, G111, G112.
    pub pole: Option<(PoleOrigin, Columns)>,
    /// RND, CHF, CHR, FRC.
    pub corner: CornerWords,
    /// SPOS, M19, WAITS: the block ends when the master spindle has arrived.
    pub waits_for_spindle: bool,
    /// Output with the motion.
    pub events: Vec<Event>,
    /// T and M6: output before the motion where the block has an M6.
    pub tool_events: Vec<Event>,
    pub tool_change: bool,
    /// Events of the simulated spindle while another one is the master spindle, or that no S or M stands for.
    pub simulated_spindle: Vec<Event>,
    /// G63.
    taps_with_chuck: bool,
    /// T changes the tool without M6.
    pub tool_loads: bool,
    /// D.
    pub edge: Option<(u32, Columns)>,
    /// M0, M1, M2, M17, M30.
    last: Vec<Event>,
    ends: bool,
    stops: bool,
}

impl Collected {
    /// An address stands once in a block, and AC, IC and their kin only where there is something to go to.
    fn note_address(&mut self, address: Address, form: Form, columns: &Columns) -> Outcome<()> {
        if !matches!(address, Address::M | Address::MOf(_) | Address::H) {
            if self.addresses.contains(&address) {
                return Err(Fault::new(codes::TWICE, columns.clone(), "this address is programmed twice in the block")
                    .label("programmed again"));
            }
            self.addresses.push(address);
        }
        let has_form = matches!(
            address,
            Address::Axis(_)
                | Address::Centre(_)
                | Address::Intermediate(_)
                | Address::PolarAngle
                | Address::PolarRadius
                | Address::Tool
        );
        if has_form || form == Form::Modal {
            return Ok(());
        }
        Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "AC, IC and their kin are for axes")
            .label("expected a plain value"))
    }
}

impl Interpreter {
    /// Executes the words of a block.
    pub(super) fn words(&mut self, words: &[Word]) -> Outcome<()> {
        let mut block = Collected::default();
        for word in words {
            self.word(word, &mut block)?;
        }
        block.events.append(&mut self.trace_events);
        if let Some(columns) = block.dwell.take() {
            self.dwell(&mut block, &columns)?;
        } else {
            // Before S: with G25 and G26 it is a limit.
            self.frame_request(&mut block)?;
            self.take_lead_change(&mut block)?;
            self.take_feed(&mut block)?;
            self.pole_request(&mut block)?;
            self.act(&mut block)?;
        }
        if block.stops {
            self.emit(MoveKind::StopPreparation, self.standing_feed(), false, Vec::new());
        }
        if !block.last.is_empty() {
            self.emit_function(block.last, true);
        }
        if block.ends {
            self.end()?;
        }
        Ok(())
    }

    fn act(&mut self, block: &mut Collected) -> Outcome<()> {
        let mut events = self.take_events(block);
        self.tool_words(block, &mut events)?;
        self.start_positions(block)?;
        if !block.motion.any() && block.corner.has_shape() {
            let columns = block.corner.columns();
            return Err(Fault::new(codes::BAD_BLOCK, columns, "RND, CHF or CHR in a block without motion")
                .label("expected the block that leads to the corner")
                .help("RNDM= rounds all corners from here on"));
        }
        if block.motion.any() {
            self.move_block(block, &mut events)?;
            if let Some(last) = self.queue.pop_back() {
                let corner = self.corner_insert(&last.kind, &block.corner, block.motion.suppression);
                self.queue.push_back(Move { corner, ..last });
            }
        }
        if !events.is_empty() {
            self.emit_function(events, false);
        }
        self.finish_positions(block);
        if block.waits_for_spindle {
            self.emit_function(vec![Event::SpindleWait], true);
        }
        Ok(())
    }

    /// G63 is a straight line with F that ends at rest, in its block alone. The overrides of feed and spindle count as 100 % in it.
    fn move_block(&mut self, block: &mut Collected, events: &mut Vec<Event>) -> Outcome<()> {
        if !block.taps_with_chuck {
            return self.motion(&block.motion, events);
        }
        block.motion.exact_stop = true;
        let acting_rpm = self.simulated_speed_rpm();
        let fixed_rpm = self.modal.feed_modes.within_limits_rpm(self.modal.spindle_speed_rpm);
        let changes = acting_rpm > 0.0 && acting_rpm != fixed_rpm && self.modal.feed_modes.master_is_simulated();
        if changes {
            events.push(Event::SpindleSpeed { speed_rpm: fixed_rpm });
        }
        let programmed = self.modal.programmed.clone();
        self.set_programmed(|limits| limits.override_acts = false);
        let modal = std::mem::replace(&mut self.modal.motion, Motion::Line);
        let moved = self.motion(&block.motion, events);
        (self.modal.motion, self.modal.programmed) = (modal, programmed);
        if changes {
            self.emit_function(vec![Event::SpindleSpeed { speed_rpm: acting_rpm }], false);
        }
        moved
    }

    fn word(&mut self, word: &Word, block: &mut Collected) -> Outcome<()> {
        let columns = &word.columns;
        match &word.kind {
            WordKind::G(function) => self.g_function(*function, columns, block),
            WordKind::Address(address, value) => self.address(*address, value, columns, block),
            WordKind::Keyword(keyword) => self.keyword(*keyword, columns, block),
            WordKind::Message(text) => {
                let text = match text {
                    Some(text) => self.text_of(&evaluate(text, self)?, &text.columns)?,
                    None => "".into(),
                };
                block.events.push(Event::Message(text));
                Ok(())
            }
            WordKind::Assign(target, value) => {
                let result = evaluate(value, self)?;
                self.assign(target, &result, columns, &value.columns)
            }
            WordKind::Fill(target, filling) => match target {
                Target::Variable { name, indices } => {
                    let indices = integers(indices, self)?;
                    self.fill(name, &indices, filling, columns)
                }
                Target::Parameter(_) | Target::System(_) => {
                    Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "SET and REP fill arrays")
                        .label("this is none"))
                }
            },
            WordKind::Indexed { address, index, values } => {
                self.indexed(*address, index.as_ref(), values, columns, block)
            }
            WordKind::Procedure(procedure, given) => self.procedure(*procedure, given, columns, block),
            WordKind::Silent => Ok(()),
            WordKind::NotActedOn(entry) => {
                self.report_word(entry, columns);
                Ok(())
            }
        }
    }

    /// NAME[index]=value goes to the topic that it belongs to.
    fn indexed(
        &mut self,
        address: IndexedAddress,
        index: Option<&Expr>,
        values: &IndexedValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match address {
            IndexedAddress::Axis => self.computed_axis(index, values, columns, block),
            IndexedAddress::Polynomial => self.polynomial(index, values, columns, block),
            IndexedAddress::AxisTolerance => self.axis_tolerance(index, values, columns),
            _ => self.feed_indexed(address, index, values, columns, block),
        }
    }

    /// AX[axis]=value is the word of that axis.
    fn computed_axis(
        &mut self,
        index: Option<&Expr>,
        values: &IndexedValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match (index, values) {
            (Some(index), IndexedValue::One(value)) => {
                let axis = self.axis_of(index)?;
                self.address(Address::Axis(axis), value, columns, block)
            }
            _ => Err(Fault::new(codes::EXPECTED_VALUE, columns.clone(), "AX needs an axis in its brackets")
                .label("expected a form such as AX[X]=10")),
        }
    }

    /// NAME(arguments) goes to the topic that it belongs to.
    fn procedure(
        &mut self,
        procedure: Procedure,
        given: &[Option<Expr>],
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        match procedure {
            Procedure::HighSpeedSettings => self.high_speed_settings(given, columns),
            Procedure::RaiseAlarm => self.raise_alarm(given, columns),
            _ => self.feed_procedure(procedure, given, columns, block),
        }
    }

    fn g_function(&mut self, function: GFunction, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        let group = function.group();
        if group > 0 {
            let bit = 1 << group;
            if block.groups & bit != 0 {
                return Err(Fault::new(
                    codes::TWICE,
                    columns.clone(),
                    format!("a second G function of group {group} in this block"),
                )
                .label("contradicts the first"));
            }
            block.groups |= bit;
        }
        match function {
            GFunction::Rapid => self.modal.motion = Motion::Rapid,
            GFunction::Line => self.modal.motion = Motion::Line,
            GFunction::Clockwise => self.modal.motion = Motion::Clockwise,
            GFunction::CounterClockwise => self.modal.motion = Motion::CounterClockwise,
            GFunction::Thread(word) => self.modal.motion = Motion::Thread(word),
            GFunction::Dwell => block.dwell = Some(columns.clone()),
            GFunction::ExactStopOnce => block.motion.exact_stop = true,
            GFunction::TapWithChuck => block.taps_with_chuck = true,
            GFunction::Plane(plane) => self.modal.plane = plane,
            GFunction::SuppressFrames(which) => block.motion.suppress(which),
            GFunction::AxialOffset(coarse) => self.axial_offset(coarse, columns, block)?,
            GFunction::Pole(origin) => self.pole(origin, columns, block)?,
            GFunction::Limit(upper) => self.limit(upper, columns, block)?,
            GFunction::ExactStopWindow(window) => self.modal.exact_stop = window,
            GFunction::FeedType(feed_type) => self.feed_type(feed_type, columns)?,
            GFunction::ZeroOffset(number) => self.zero_offset(number),
            GFunction::Silent(_) => {}
            GFunction::PathMode(mode) => self.modal.path_mode = mode,
            GFunction::Measure(measure) => self.modal.measure = measure,
            GFunction::Absolute(absolute) => self.modal.absolute = absolute,
            GFunction::NotActedOn(entry, _) => self.report_word(entry, columns),
        }
        Ok(())
    }

    fn keyword(&mut self, keyword: Keyword, columns: &Columns, block: &mut Collected) -> Outcome<()> {
        match keyword {
            Keyword::Acceleration(mode) => self.modal.acceleration_mode = mode,
            Keyword::Dynamics(mode) => self.modal.dynamics = mode,
            Keyword::DynamicsPrecision => return self.dynamics_precision(columns),
            Keyword::WorkArea(on) => return self.work_area(on, columns),
            Keyword::Curve(word) => return self.curve(word, columns, block),
            Keyword::SplineStart(end) => return self.spline_start(end, columns),
            Keyword::SplineFinish(end) => return self.spline_finish(end, columns),
            Keyword::PathParameter(with_path) => return self.path_parameter(with_path, columns),
            Keyword::FeedShape(shape) => return self.feed_shape(shape, columns),
            Keyword::FeedCorrection(correction) => return self.feed_correction(correction, columns),
            Keyword::RapidLinear(linear) => return self.rapid_linear(linear, columns),
            Keyword::Compressor(compressor) => self.modal.compressor = compressor,
            Keyword::FeedforwardOn => self.modal.feedforward_active = true,
            Keyword::FeedforwardOff => self.modal.feedforward_active = false,
            Keyword::SuppressFrames => block.motion.suppress(Suppression::All),
            Keyword::Frame(word) => return self.frame_word(word, columns, block),
            Keyword::StopPreparation => block.stops = true,
        }
        Ok(())
    }

    fn address(
        &mut self,
        address: Address,
        value: &AddressValue,
        columns: &Columns,
        block: &mut Collected,
    ) -> Outcome<()> {
        block.note_address(address, value.form, columns)?;
        if address == Address::Tool {
            let name = self.tool(value)?;
            block.tool_loads |= self.select_tool(&name, columns)?;
            let tool = Event::Tool(name);
            block.tool_events.push(tool.clone());
            block.events.push(tool);
            return Ok(());
        }
        let typed = Typed(number(&value.value, self)?);
        match address {
            Address::Axis(axis) => {
                block.motion.axes[axis] = Some(AxisWord { typed, form: value.form, columns: columns.clone() });
            }
            Address::Centre(index) => {
                block.motion.centre[usize::from(index)] =
                    Some(AxisWord { typed, form: value.form, columns: columns.clone() });
            }
            Address::Radius => block.motion.radius = Some((typed, columns.clone())),
            Address::Turn => block.motion.turns = turns(typed, columns)?,
            Address::StartAngle => block.motion.start_angle = Some((typed, columns.clone())),
            Address::ThreadRun { leaves } => self.thread_run(leaves, typed, columns)?,
            Address::Feed => block.feed = Some((typed, columns.clone())),
            Address::SpindleSpeed => {
                let speed_rpm = spindle_speed(typed, columns)?;
                block.spindle_speed_rpm = Some((speed_rpm, columns.clone()));
                block.events.push(Event::SpindleSpeed { speed_rpm });
            }
            Address::Edge => {
                let edge = whole(typed, columns, "D")?;
                block.edge = Some((edge, columns.clone()));
                block.events.push(Event::Edge(edge));
            }
            Address::M => self.m_word(whole(typed, columns, "M")?, block),
            Address::RoundingDistance => self.modal.rounding_distance_mm = Some(self.not_negative_mm(typed, columns)?),
            Address::RapidRoundingDistance => {
                self.modal.rapid_rounding_distance_mm = Some(self.not_negative_mm(typed, columns)?)
            }
            // A negative tolerance deletes it: the machine's holds again.
            Address::ContourTolerance => {
                self.modal.contour_tolerance_mm = (typed.0 >= 0.0).then(|| self.modal.length_mm(typed));
            }
            Address::Tool => {}
            Address::OpeningAngle
            | Address::PolarAngle
            | Address::PolarRadius
            | Address::Intermediate(_)
            | Address::PointWeight
            | Address::SplineDegree
            | Address::ParameterLength => self.curve_address(address, typed, value.form, columns, block)?,
            Address::OrientationTolerance
            | Address::RapidToleranceFactor
            | Address::Fillet
            | Address::FilletModal
            | Address::Chamfer
            | Address::ChamferLeg
            | Address::CornerFeed
            | Address::CornerFeedModal => self.path_address(address, typed, columns, block)?,
            Address::PlaneRotation => self.plane_rotation(typed, columns, block)?,
            Address::BlockFeed
            | Address::SpindleLimit
            | Address::Override
            | Address::RapidOverride
            | Address::H
            | Address::SpindleSpeedOf(_)
            | Address::MOf(_) => self.feed_address(address, typed, columns, block)?,
        }
        Ok(())
    }

    pub(super) fn m_word(&mut self, number: u32, block: &mut Collected) {
        self.note_spindle(number);
        m_function(number, block);
        if number == SPINDLE_POSITION {
            self.home_spindle(block);
        }
    }

    fn not_negative_mm(&self, typed: Typed, columns: &Columns) -> Outcome<f64> {
        if typed.0 >= 0.0 {
            return Ok(self.modal.length_mm(typed));
        }
        Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("a rounding distance of {} is below 0", typed.0))
            .label("expected 0 or more"))
    }

    /// Name of the tool, or its number as text.
    fn tool(&self, value: &AddressValue) -> Outcome<Arc<str>> {
        Ok(match evaluate(&value.value, self)? {
            Value::Text(text) => text,
            number => whole(Typed(number.number(&value.value.columns)?), &value.value.columns, "T")?.to_string().into(),
        })
    }

    /// G4 F (seconds) or G4 S (revolutions): F and S of the path stay as they are.
    fn dwell(&mut self, block: &mut Collected, columns: &Columns) -> Outcome<()> {
        if block.motion.any() || block.frame.any() {
            return Err(Fault::new(codes::BAD_BLOCK, columns.clone(), "G4 with a motion or a frame in one block")
                .label("expected a block of its own"));
        }
        let time_s = self.dwell_time_s(block, columns)?;
        if !(0.0..=DWELL_MAX_S).contains(&time_s) {
            return Err(Fault::new(codes::DWELL, columns.clone(), format!("a wait of {time_s} s is not possible"))
                .label(format!("expected 0 to {DWELL_MAX_S} s")));
        }
        let mut events = self.take_events(block);
        self.change_and_apply(block)?;
        if block.tool_change {
            events.splice(0..0, block.tool_events.drain(..));
        }
        self.emit(MoveKind::Dwell { time_s }, self.standing_feed(), false, events);
        Ok(())
    }

    fn dwell_time_s(&self, block: &mut Collected, columns: &Columns) -> Outcome<f64> {
        let missing = |columns: &Columns, message: &str| {
            Fault::new(codes::DWELL, columns.clone(), message).label("expected F with seconds or S with revolutions")
        };
        match (block.feed.take(), block.spindle_speed_rpm.take()) {
            (Some((Typed(time_s), _)), None) => Ok(time_s),
            (None, Some((_, columns))) if self.dwell_rpm() <= 0.0 => {
                Err(missing(&columns, "G4 S counts revolutions, but no spindle speed is programmed"))
            }
            (None, Some((revolutions, _))) => {
                block.events.retain(|event| !matches!(event, Event::SpindleSpeed { .. }));
                Ok(revolutions / self.dwell_rpm() * S_PER_MIN)
            }
            (Some(_), Some((_, columns))) => Err(missing(&columns, "G4 with both F and S")),
            (None, None) => Err(missing(columns, "G4 without a time")),
        }
    }

    /// Speed of the master spindle; under G96 that where the axes stand.
    fn dwell_rpm(&self) -> f64 {
        let modes = &self.modal.feed_modes;
        let cutting_rpm = if modes.cutting { self.cutting_rpm_here() } else { None };
        cutting_rpm.unwrap_or_else(|| modes.limited_rpm(self.modal.spindle_speed_rpm))
    }
}

impl Collected {
    /// Takes the S word out of the block: it limits the spindle and is no speed.
    pub fn take_spindle_speed(&mut self) -> Option<(f64, Columns)> {
        self.events.retain(|event| !matches!(event, Event::SpindleSpeed { .. }));
        self.spindle_speed_rpm.take()
    }
}

fn m_function(number: u32, block: &mut Collected) {
    let event = Event::MFunction(number);
    if STOPS.contains(&number) {
        block.last.push(event);
        block.ends |= ENDS.contains(&number);
        return;
    }
    if number == TOOL_CHANGE {
        block.tool_change = true;
        // What stands before it is output at the tool change; a T in the block has been noted twice.
        block.events.retain(|event| !matches!(event, Event::Tool(_)));
        block.tool_events.push(event);
        return;
    }
    block.events.push(event);
}

fn spindle_speed(typed: Typed, columns: &Columns) -> Outcome<f64> {
    if (0.0..=SPINDLE_SPEED_MAX).contains(&typed.0) {
        return Ok(typed.0);
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("spindle speed {} rpm is not possible", typed.0))
        .label(format!("expected 0 to {SPINDLE_SPEED_MAX}"))
        .help("M3 and M4 give the direction"))
}

/// Highest S: of a spindle in rpm, of a cutting speed in m/min, of a dwell in revolutions.
const SPINDLE_SPEED_MAX: f64 = 1e6;

/// TURN counts to 999 on the control.
fn turns(typed: Typed, columns: &Columns) -> Outcome<u32> {
    let turns = whole(typed, columns, "TURN=")?;
    if turns <= TURNS_MAX {
        return Ok(turns);
    }
    Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("TURN={turns} is too much"))
        .label(format!("expected 0 to {TURNS_MAX}")))
}

pub(super) fn whole(typed: Typed, columns: &Columns, address: &str) -> Outcome<u32> {
    whole_number(typed.0).ok_or_else(|| {
        Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{address}{} is not possible", typed.0))
            .label("expected a whole number from 0 to 2147483647")
    })
}

/// The finding for a word that is known and not built.
pub(super) fn not_built(word: &str, columns: &Columns) -> Box<Fault> {
    Fault::new(codes::NOT_BUILT, columns.clone(), format!("{word}: not built yet")).label("not built yet")
}
