//! The interpreter itself: takes one line after another, hands out one move after another.
//!
//! In: a [`ProgramSource`] and the [`Machine`]. Out: [`Move`]s, warnings, at most one alarm. Words are executed in `block`, motion
//! in `motion`, jumps and loops in `flow`.

use super::active_frames::ActiveFrames;
use super::call::{Head, ModalCall, Waiting};
use super::curve_state::CurveState;
use super::flow::Repeat;
use super::frame::GeometryAxes;
use super::modal::Modal;
use super::path_words::CornerWords;
use super::placement::KnownPlace;
use super::setup::{Setup, geometry_axes};
use super::spline_blocks::{LastMotion, OpenSpline};
use super::system_values::ChannelMemory;
use super::tool_words::ToolState;
use super::variables::Variables;
use super::wire::{Event, Feed, MainRun, Move, MoveKind};
use super::work_area::WorkArea;
use super::zero_offsets::ZeroOffsets;
use crate::base::{AxisVector, Diagnostic, PartPoint, PerAxis};
use crate::machine::Machine;
use crate::program::plain::plain_block;
use crate::program::structure::skip_level_of;
use crate::program::syntax::{Direction, Statement};
use crate::program::visit::priority_trap;
use crate::program::{
    Block, BlockRef, Columns, Cursor, Dialect, Fault, Library, NotActedOn, Outcome, ProgramId, ProgramSource, UnitId,
    Window, codes, parse,
};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Blocks without a move after which a loop counts as endless: well under two seconds.
const IDLE_BLOCKS_MAX: u32 = 1_000_000;
/// Parsed blocks kept for loops.
const KEPT_BLOCKS_MAX: usize = 4096;
/// Longest line of which the parsed block is kept: memory stays bounded.
const KEPT_LINE_BYTES_MAX: usize = 512;

/// A program in execution. A clone goes on independently from the same state.
#[derive(Clone, Debug)]
pub struct Interpreter {
    pub(super) source: ProgramSource,
    /// What lies around the program.
    pub(super) setup: Arc<Setup>,
    pub(super) program: ProgramId,
    /// What of it is in memory.
    pub(super) window: Window,
    pub(super) machine: Arc<Machine>,
    pub(super) dialect: Arc<Dialect>,
    /// X, Y and Z of the machine: the geometry axes.
    pub(super) geometry: GeometryAxes,
    /// The line in execution.
    pub(super) current: Cursor,
    /// The line after it, or where a jump leads.
    pub(super) next: Cursor,
    /// Running number of the block.
    pub(super) number: u64,
    pub(super) modal: Modal,
    /// $P_UIFR and $P_UBFR.
    pub(super) zero_offsets: Arc<ZeroOffsets>,
    /// $P_UBFR was written since the last G500 or G54.
    pub(super) basic_is_pending: bool,
    pub(super) work_area: WorkArea,
    pub(super) tools: ToolState,
    /// All axes where the last move ended.
    pub(super) position: PartPoint,
    /// Where each axis was sent last, in the workpiece system of then: incremental words count from here.
    pub(super) programmed_lu: AxisVector,
    /// `position` in the workpiece system.
    pub(super) known_place: KnownPlace,
    /// Modal state of curves.
    pub(super) curves: CurveState,
    /// The spline whose blocks wait in the queue.
    pub(super) open_spline: Option<OpenSpline>,
    /// A spline that could not be made, to be raised before the next block.
    pub(super) spline_fault: Option<Box<Fault>>,
    /// The last move with a way.
    pub(super) last_motion: LastMotion,
    /// Moves taken from the queue.
    pub(super) handed_over_count: u64,
    pub(super) variables: Variables,
    /// Markers, parameters and clocks of the channel.
    pub(super) memory: ChannelMemory,
    /// What preparation said when the path came to rest last.
    pub(super) main_run: MainRun,
    /// Events of assignments in the block in execution.
    pub(super) trace_events: Vec<Event>,
    /// The path rests for the block in execution: it may read the main run.
    rests_for_main_run: bool,
    /// The definition files have been executed.
    globals_defined: bool,
    /// An executable block of the main program has been met: a DEF comes too late for the control.
    pub(super) main_begun: bool,
    /// A definition file is being executed.
    pub(super) in_definitions: bool,
    /// Moves of the block in execution.
    pub(super) queue: VecDeque<Move>,
    /// All programs of the run.
    pub(super) library: Library,
    /// The program in execution.
    pub(super) unit: UnitId,
    /// Programs that wait for its end, outermost first.
    pub(super) levels: Vec<Waiting>,
    /// Repeated parts in execution, outermost first.
    pub(super) repeats: Vec<Repeat>,
    /// What is known of the program in execution.
    pub(super) known: Memory,
    /// Memories of programs that are not in execution.
    pub(super) shelf: BTreeMap<UnitId, Memory>,
    pub(super) heads: BTreeMap<UnitId, Head>,
    pub(super) modal_call: Option<Arc<ModalCall>>,
    warnings: Vec<Diagnostic>,
    /// Words and codes that were reported.
    warned: BTreeSet<&'static str>,
    pub(super) travel_warned: PerAxis<bool>,
    /// Openings of programs that no move has told yet.
    pub(super) opened: Vec<Event>,
    state: State,
    pub(super) idle_blocks: u32,
    /// Where the move ended that was handed over last: the next one takes time only if it leads elsewhere.
    handed_over: PartPoint,
}

/// What is remembered of a program, so that loops and repeated calls are fast.
#[derive(Clone, Debug, Default)]
pub(super) struct Memory {
    /// Block numbers that jumps have found, by line and direction of the jump.
    pub found_numbers: BTreeMap<(u32, Direction, u64), Option<Cursor>>,
    kept_blocks: BTreeMap<u32, Arc<Block>>,
    furthest_line: u32,
}

#[derive(Clone, Debug)]
enum State {
    Running,
    /// To be raised after the queue is empty.
    Alarm(Box<Diagnostic>),
    Ended,
}

impl Interpreter {
    /// At the first line; all axes at home.
    pub fn new(setup: impl Into<Setup>, machine: &Machine) -> Self {
        let setup = setup.into();
        let source = setup.program.clone();
        let mut position = PartPoint::default();
        for id in machine.axis_ids() {
            position.0[id] = machine.axis(id).home_lu;
        }
        let geometry = geometry_axes(machine);
        let zero_offsets = setup.zero_offsets.clone();
        let mut modal = Modal::new(&machine.feed, initial_frames(&zero_offsets, geometry));
        modal.feed_modes.spindle_max_rpm = machine.spindle_speed_max_rpm;
        modal.feed_modes.spindle_override_ratio[1] = setup.spindle_override_ratio;
        let known_place = KnownPlace::new(modal.frames.clone(), position);
        let opened = source.opened(ProgramId(0));
        Self {
            program: ProgramId(0),
            window: Window::default(),
            dialect: Arc::new(Dialect::new(machine)),
            geometry,
            current: source.first(),
            next: source.first(),
            number: 0,
            modal,
            zero_offsets,
            basic_is_pending: false,
            work_area: WorkArea::default(),
            tools: ToolState::new(setup.tools.clone()),
            position,
            programmed_lu: known_place.work_lu(),
            known_place,
            curves: CurveState::default(),
            open_spline: None,
            spline_fault: None,
            last_motion: LastMotion { start: position, kind: None },
            handed_over_count: 0,
            variables: Variables::new(geometry),
            memory: ChannelMemory::default(),
            main_run: MainRun::default(),
            trace_events: Vec::new(),
            rests_for_main_run: false,
            globals_defined: false,
            main_begun: false,
            in_definitions: false,
            queue: VecDeque::new(),
            library: Library::new(source.clone(), setup.directories.clone(), setup.shipped),
            unit: UnitId(0),
            levels: Vec::new(),
            repeats: Vec::new(),
            known: Memory::default(),
            shelf: BTreeMap::new(),
            heads: BTreeMap::new(),
            modal_call: None,
            warnings: Vec::new(),
            warned: BTreeSet::new(),
            travel_warned: PerAxis::splat(false),
            opened: vec![Event::ProgramOpened(opened)],
            state: State::Running,
            idle_blocks: 0,
            handed_over: position,
            machine: Arc::new(machine.clone()),
            setup: Arc::new(setup),
            source,
        }
    }

    /// The next move; `Ok(None)` after the end of the program. The alarm of a block comes when the block is reached, after all
    /// moves before it; after an alarm there is nothing more.
    pub fn next_move(&mut self) -> Result<Option<Move>, Box<Diagnostic>> {
        loop {
            if let Some(next) = self.take_ready() {
                let takes_time = match next.kind {
                    MoveKind::Function { .. } | MoveKind::WaitPositioned(_) | MoveKind::StopPreparation => false,
                    MoveKind::Dwell { time_s } => time_s > 0.0,
                    MoveKind::Rapid | MoveKind::Line | MoveKind::Position(_) => next.end != self.handed_over,
                    MoveKind::Arc(_) | MoveKind::SpatialArc(_) | MoveKind::Spline(_) | MoveKind::Polynomial(_) => true,
                };
                if takes_time {
                    self.idle_blocks = 0;
                }
                self.handed_over = next.end;
                return Ok(Some(next));
            }
            if !matches!(self.state, State::Running) && self.open_spline.is_some() {
                self.close_spline(None);
                continue;
            }
            if let Some(fault) = self.spline_fault.take() {
                self.state = State::Alarm(Box::new(self.diagnostic(*fault)));
            }
            match std::mem::replace(&mut self.state, State::Ended) {
                State::Running => {}
                State::Alarm(alarm) => return Err(alarm),
                State::Ended => return Ok(None),
            }
            self.state = State::Running;
            if let Err(fault) = self.step() {
                self.state = State::Alarm(Box::new(self.diagnostic(*fault)));
            }
            if !matches!(self.state, State::Running) && self.queue.is_empty() && !self.opened.is_empty() {
                // The program is on record even if it does nothing.
                self.emit_function(Vec::new(), false);
            }
        }
    }

    /// Tells what the main run is at; called when the path rests for a `StopPreparation`, before the next move is asked for.
    pub fn tell_main_run(&mut self, main_run: MainRun) {
        self.main_run = main_run;
    }

    /// Warnings since the last call; each word once a run.
    pub fn take_warnings(&mut self) -> Vec<Diagnostic> {
        std::mem::take(&mut self.warnings)
    }

    /// Blocks executed so far; comments and empty lines do not count.
    pub fn blocks(&self) -> u64 {
        self.number
    }

    /// Line in execution.
    pub fn line(&self) -> u32 {
        self.current.line
    }

    /// Executes one line.
    fn step(&mut self) -> Outcome<()> {
        if !std::mem::replace(&mut self.globals_defined, true) {
            self.define_globals()?;
        }
        if !self.repeats.is_empty() && self.part_ends()? {
            return if self.idle_blocks > IDLE_BLOCKS_MAX { Err(self.endless()) } else { Ok(()) };
        }
        let Some((bytes, following)) = self.source.line(&mut self.window, self.next)? else {
            return self.end();
        };
        self.current = self.next;
        self.next = following;
        self.idle_blocks += 1;
        if self.idle_blocks > IDLE_BLOCKS_MAX {
            return Err(self.endless());
        }
        if let Some(plain) = plain_block(&bytes, &self.dialect)
            && self.plain_move(&plain)
        {
            self.main_begun = true;
            return if self.modal_call.is_some() { self.after_motion() } else { Ok(()) };
        }
        let skipped = self.setup.skip_levels;
        if skipped != 0 && skip_level_of(&bytes).is_some_and(|level| skipped >> level & 1 == 1) {
            return Ok(());
        }
        let block = self.parsed(&bytes)?;
        if block.reads_main_run && !std::mem::replace(&mut self.rests_for_main_run, true) {
            self.report_plc_reads(&block);
            // The block itself is executed when the path rests.
            self.next = self.current;
            self.emit(MoveKind::StopPreparation, self.standing_feed(), false, Vec::new());
            return Ok(());
        }
        self.rests_for_main_run = false;
        if block.statement != Statement::Words(Vec::new()) {
            self.number += 1;
            self.main_begun |=
                !matches!(block.statement, Statement::Define(_) | Statement::Procedure(_) | Statement::External(_));
        }
        let depth = self.levels.len();
        self.execute(&block.statement)?;
        if self.modal_call.is_some() && self.levels.len() == depth && matches!(self.state, State::Running) {
            return self.after_motion();
        }
        Ok(())
    }

    /// Parses the line in execution; what a loop passes again is kept.
    fn parsed(&mut self, bytes: &[u8]) -> Outcome<Arc<Block>> {
        let line = self.current.line;
        if let Some(kept) = self.known.kept_blocks.get(&line) {
            return Ok(kept.clone());
        }
        let block = Arc::new(parse(&self.source.decode(bytes), &self.dialect)?);
        if let Some(columns) = priority_trap(&block.statement) {
            self.warn_of_priority(columns);
        }
        if line <= self.known.furthest_line {
            self.known.keep(line, &block, bytes.len());
        }
        self.known.furthest_line = self.known.furthest_line.max(line);
        Ok(block)
    }

    /// The block at a line that was executed before.
    pub(super) fn block_at(&mut self, cursor: Cursor) -> Outcome<Arc<Block>> {
        if let Some(kept) = self.known.kept_blocks.get(&cursor.line) {
            return Ok(kept.clone());
        }
        let line = self.source.line(&mut self.window, cursor)?;
        let (text, length) = match &line {
            Some((bytes, _)) => (self.source.decode(bytes), bytes.len()),
            None => ("".into(), 0),
        };
        let block = Arc::new(parse(&text, &self.dialect)?);
        self.known.keep(cursor.line, &block, length);
        Ok(block)
    }

    /// Once a run; `check` finds all of them.
    fn warn_of_priority(&mut self, columns: Columns) {
        if self.first_report(codes::PRIORITY_TRAP) {
            self.warn(*priority_fault(columns));
        }
    }

    /// The end of the run.
    pub(super) fn finish(&mut self) {
        self.state = State::Ended;
    }

    /// The next move, unless it waits for its spline.
    fn take_ready(&mut self) -> Option<Move> {
        if self.open_spline.as_ref().is_some_and(|open| open.holds(self.handed_over_count)) {
            return None;
        }
        let next = self.queue.pop_front()?;
        self.handed_over_count += 1;
        Some(next)
    }

    /// Hands a move over.
    pub(super) fn emit(&mut self, kind: MoveKind, feed: Feed, exact_stop: bool, events: Vec<Event>) {
        self.leave_spline(&kind);
        self.emit_in_spline(kind, feed, exact_stop, events);
    }

    /// Hands a move over that does not end a spline.
    pub(super) fn emit_in_spline(&mut self, kind: MoveKind, feed: Feed, exact_stop: bool, mut events: Vec<Event>) {
        if !self.opened.is_empty() {
            events.splice(0..0, self.opened.drain(..));
        }
        let block = BlockRef { program: self.program, line: self.current.line, number: self.number };
        let mut modes = self.modal.modes(exact_stop);
        if self.modal.feed_modes.cutting {
            modes.cutting = self.cutting_speed();
        } else if matches!(feed, Feed::Path { .. }) {
            modes.revolution_rad_s = self.revolution_speed();
        }
        let corner = match self.modal.corner.radius_mm {
            Some(_) => self.corner_insert(&kind, &CornerWords::default(), None),
            None => None,
        };
        self.queue.push_back(Move { block, kind, end: self.position, feed, modes, corner, events });
    }

    /// Hands a move without motion over.
    pub(super) fn emit_function(&mut self, events: Vec<Event>, stops: bool) {
        self.emit(MoveKind::Function { stops }, self.standing_feed(), false, events);
    }

    /// Reports a word that is not acted on, once a run.
    pub(super) fn report_word(&mut self, entry: &'static NotActedOn, columns: &Columns) {
        if self.first_report(entry.word) {
            let fault = Fault::new(
                codes::NOT_ACTED_ON,
                columns.clone(),
                format!("`{}` is not acted on: {}", entry.word, entry.consequence),
            )
            .label("known, but not acted on");
            self.warn(*fault);
        }
    }

    /// True the first time that this word or code is to be reported.
    pub(super) fn first_report(&mut self, word_or_code: &'static str) -> bool {
        self.warned.insert(word_or_code)
    }

    /// Puts an error on the list that does not end the program.
    pub(super) fn report(&mut self, fault: Fault) {
        let diagnostic = self.diagnostic(fault);
        self.warnings.push(diagnostic);
    }

    /// Puts a finding on the list of warnings.
    pub(super) fn warn(&mut self, fault: Fault) {
        let mut diagnostic = self.diagnostic(fault);
        diagnostic.severity = crate::base::Severity::Warning;
        self.warnings.push(diagnostic);
    }

    fn diagnostic(&self, fault: Fault) -> Diagnostic {
        let text = self.source.line_text(self.current);
        let mut diagnostic = fault.at(self.source.shared_name(), self.current.line, text);
        diagnostic.called_from = self.called_from();
        diagnostic
    }

    fn endless(&self) -> Box<Fault> {
        let end = self.source.line_text(self.current).trim_end().len() as u32;
        let message = format!("{IDLE_BLOCKS_MAX} blocks were executed without a motion: this loop does not end");
        Fault::new(codes::ENDLESS, 0..end, message)
            .label("executed again and again")
            .help("check the condition of the loop or jump")
    }
}

/// G500 and the basic frame.
fn initial_frames(offsets: &ZeroOffsets, axes: GeometryAxes) -> ActiveFrames {
    let mut frames = ActiveFrames::new(axes);
    frames.set_basic(offsets.basic(axes));
    frames.set_settable(0, offsets.settable(0, axes));
    frames
}

impl Memory {
    /// Keeps a parsed block, within bounds.
    fn keep(&mut self, line: u32, block: &Arc<Block>, length: usize) {
        if length <= KEPT_LINE_BYTES_MAX && self.kept_blocks.len() < KEPT_BLOCKS_MAX {
            self.kept_blocks.insert(line, block.clone());
        }
    }
}

/// The finding for a condition that is read otherwise than it looks.
pub(super) fn priority_fault(columns: Columns) -> Box<Fault> {
    Fault::new(codes::PRIORITY_TRAP, columns, "AND, OR and XOR bind tighter than a comparison")
        .label("read as one comparison of a combined value")
        .help("write brackets around each comparison: (A == 1) AND (B == 2)")
}
