//! Calls of sub-programs, and returns from them.
//!
//! In: a [`Call`]. Out: the interpreter stands in another program; at its end it stands behind the call again. Decisions:
//!
//! * Every program has variables of its own; R parameters and GUD are common to all, the variables of the main program are not seen
//!   in sub-programs (MD11120 = 0).
//! * Values are evaluated from left to right in the calling program. A missing one is the default of PROC, else 0, FALSE or "".
//! * VAR: the variable is handed over at the call and handed back at the return.
//! * P counts passes, 1 to 9999; values are handed over once. DEF acts in every pass.
//! * M17, RET, M2, M30 and the end of the text return. M2 and M30 in a sub-program do not end the main program ("this means a
//!   return to the program level from where the subroutine was called up", 802D programming manual).
//! * SAVE brings back modal G functions and frames; F, S, T, D and addresses such as CTOL stay as the sub-program left them.
//! * Programs stand at most 16 levels deep (0 to 15; programming manual 12/2019, p. 493).
//! * MCALL: after every block with path motion, also in sub-programs called meanwhile, not in the called one itself; values are taken
//!   once, at MCALL. It ends with MCALL alone or with the program that it stands in.

use super::evaluate::{evaluate, integers};
use super::flow::Repeat;
use super::modal::Modal;
use super::parameters::{bit, check_type, whole_type};
use super::run::{Interpreter, Memory};
use super::value::Value;
use super::variables::Whole;
use super::wire::{Event, MoveKind};
use crate::base::diagnostics::nearest;
use crate::program::syntax::{Call, Callee, Direction, Expr, ExprKind, Header, Parameter, Return, Statement, Target};
use crate::program::{
    Columns, Cursor, Fault, Outcome, ProgramId, ProgramSource, UnitId, VariableType, Window, codes, did_you_mean, parse,
};
use std::sync::Arc;

/// Program levels, the main program included.
pub(super) const LEVELS_MAX: usize = 16;
/// Most passes of P.
const PASSES_MAX: i32 = 9999;
/// Comments and empty lines before PROC that are looked through.
const PREFACE_LINES_MAX: usize = 100_000;

/// A program that waits for the end of the one that it called.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    unit: UnitId,
    program: ProgramId,
    source: ProgramSource,
    window: Window,
    /// The call.
    current: Cursor,
    next: Cursor,
    known: Memory,
    repeats: Vec<Repeat>,
    /// Parameters of the called program that are variables here.
    by_reference: Vec<(Arc<str>, Target, Columns)>,
    /// Which parameters of the called program the call gave a value, one bit each.
    values_given: u128,
    /// Modal state at the call, if the called program begins with SAVE.
    saved: Option<Box<Modal>>,
    passes_left: i32,
    /// First block of the called program, behind PROC.
    body: Cursor,
    /// The called program was called by MCALL.
    modal: bool,
}

/// MCALL.
#[derive(Clone, Debug)]
pub(super) struct ModalCall {
    unit: UnitId,
    given: Given,
    passes: i32,
    /// Number of waiting programs where it stands.
    depth: usize,
}

/// What a call hands over.
#[derive(Clone, Debug, Default)]
struct Given {
    /// Which parameters have a value in the call, one bit each.
    values_given: u128,
    parameters: Vec<(Arc<str>, Whole)>,
    by_reference: Vec<(Arc<str>, Target, Columns)>,
    save: bool,
    columns: Columns,
}

/// What the first block of a program says.
#[derive(Clone, Debug)]
pub(super) struct Head {
    /// PROC; `None` without it.
    header: Option<Arc<Header>>,
    /// Its line.
    line: u32,
    /// The block behind it.
    body: Cursor,
    /// It cannot be read: the alarm comes when it is reached.
    broken: bool,
}

impl Interpreter {
    /// NAME(...), L12, CALL, PCALL, EXTCALL.
    pub(super) fn call(&mut self, call: &Call) -> Outcome<()> {
        let passes = self.passes(call.passes.as_ref(), 1)?;
        if call.callee == Callee::Own {
            return match &call.section {
                Some((first, last)) => self.call_own_section(first, last, passes, &call.columns),
                None => Ok(()),
            };
        }
        let unit = self.callee(call)?;
        let given = self.bind(call, unit)?;
        self.enter(unit, given, passes, false)?;
        match &call.section {
            Some((first, last)) => self.limit_to_section(first, last),
            None => Ok(()),
        }
    }

    /// MCALL.
    pub(super) fn modal_call(&mut self, call: Option<&Call>) -> Outcome<()> {
        self.modal_call = None;
        if let Some(call) = call {
            let passes = self.passes(call.passes.as_ref(), 1)?;
            let unit = self.callee(call)?;
            let given = self.bind(call, unit)?;
            self.modal_call = Some(Arc::new(ModalCall { unit, given, passes, depth: self.levels.len() }));
        }
        Ok(())
    }

    /// Calls what MCALL says, if the block in execution has moved along a path.
    pub(super) fn after_motion(&mut self) -> Outcome<()> {
        let moves = |kind: &MoveKind| {
            matches!(
                kind,
                MoveKind::Rapid
                    | MoveKind::Line
                    | MoveKind::Arc(_)
                    | MoveKind::SpatialArc(_)
                    | MoveKind::Spline(_)
                    | MoveKind::Polynomial(_)
            )
        };
        let has_moved = self.queue.iter().any(|queued| moves(&queued.kind));
        match self.modal_call.clone().filter(|_| has_moved && !self.levels.iter().any(|level| level.modal)) {
            Some(call) => self.enter(call.unit, call.given.clone(), call.passes, true),
            None => Ok(()),
        }
    }

    /// EXTERN: must be as PROC is, where the sub-program is at hand.
    pub(super) fn external(&mut self, external: &Header) -> Outcome<()> {
        let Some(unit) = self.find_unit(&external.name, &external.columns)? else { return Ok(()) };
        let head = self.head(unit)?;
        let Some(header) = head.header.as_deref() else { return Ok(()) };
        match mismatch(external, header) {
            None => Ok(()),
            Some(what) => Err(Fault::new(codes::BAD_ARGUMENT, external.columns.clone(), what)
                .label("differs from PROC")
                .help(format!("write EXTERN as PROC is: {}", text_of(header)))),
        }
    }

    /// P of a call or a repetition.
    pub(super) fn passes(&mut self, passes: Option<&Expr>, least: i32) -> Outcome<i32> {
        let Some(passes) = passes else { return Ok(1) };
        let number = evaluate(passes, self)?.integer(&passes.columns)?;
        if (least..=PASSES_MAX).contains(&number) {
            return Ok(number);
        }
        Err(Fault::new(codes::OUT_OF_RANGE, passes.columns.clone(), format!("P{number} is not possible"))
            .label(format!("expected {least} to {PASSES_MAX}")))
    }

    fn callee(&mut self, call: &Call) -> Outcome<UnitId> {
        let name: Arc<str> = match &call.callee {
            Callee::Name(name) | Callee::Path(name) => name.clone(),
            Callee::Text(text) => match evaluate(text, self)? {
                Value::Text(name) => name,
                _ => {
                    return Err(Fault::new(
                        codes::TYPE_MISMATCH,
                        text.columns.clone(),
                        "the name of a program is a text",
                    )
                    .label("expected a STRING"));
                }
            },
            Callee::Own => return Ok(self.unit),
        };
        match self.find_unit(&name, &call.columns)? {
            Some(unit) => Ok(unit),
            None => Err(self.not_found(&name, matches!(call.callee, Callee::Name(_)), &call.columns)),
        }
    }

    fn find_unit(&mut self, name: &str, columns: &Columns) -> Outcome<Option<UnitId>> {
        let found = self.library.find(name, self.unit).map_err(|unreadable| {
            Fault::new(codes::UNREADABLE, columns.clone(), unreadable.message).maybe_help(unreadable.help)
        })?;
        Ok(found.map(|found| {
            self.opened.extend(found.opened.map(Event::ProgramOpened));
            found.unit
        }))
    }

    /// A name alone may be a sub-program that is missing, or a word with a typo.
    fn not_found(&mut self, name: &str, may_be_word: bool, columns: &Columns) -> Box<Fault> {
        let names = self.library.names();
        missing(name, may_be_word, names.iter().map(String::as_str), columns)
    }

    /// PROC of a program, and where it goes on behind it.
    pub(super) fn head(&mut self, unit: UnitId) -> Outcome<Head> {
        if let Some(known) = self.heads.get(&unit) {
            return Ok(known.clone());
        }
        let source = self.library.source(unit).clone();
        let mut head = Head { header: None, line: 0, body: source.first(), broken: false };
        let (mut cursor, mut window) = (source.first(), Window::default());
        for _ in 0..PREFACE_LINES_MAX {
            let Some((line, next)) = source.line(&mut window, cursor)? else { break };
            match parse(&source.decode(&line), &self.dialect).map(|block| block.statement) {
                Ok(Statement::Words(words)) if words.is_empty() => cursor = next,
                Ok(Statement::Procedure(header)) => {
                    head = Head { header: Some(header), line: cursor.line, body: next, broken: false };
                    break;
                }
                outcome => {
                    head.broken = outcome.is_err();
                    break;
                }
            }
        }
        self.heads.insert(unit, head.clone());
        Ok(head)
    }

    /// Name of the program at a level in use; 0 is the main program.
    pub(super) fn program_name_at(&self, level: usize) -> Option<&str> {
        match self.levels.get(level) {
            Some(waiting) => Some(waiting.source.file_name()),
            None if level == self.levels.len() => Some(self.source.file_name()),
            None => None,
        }
    }

    /// True if the call of the program in execution gave a value for that parameter, from 1.
    pub(super) fn is_parameter_given(&self, number: usize) -> bool {
        let given = self.levels.last().map_or(0, |waiting| waiting.values_given);
        number > 0 && given & bit(number - 1) != 0
    }

    /// Values of a call for the parameters of a program.
    fn bind(&mut self, call: &Call, unit: UnitId) -> Outcome<Given> {
        let head = self.head(unit)?;
        let mut given = Given { columns: call.columns.clone(), ..Given::default() };
        if head.broken {
            return Ok(given);
        }
        let parameters = head.header.as_ref().map_or(&[][..], |header| &header.parameters);
        if call.arguments.len() > parameters.len() {
            let message = match &head.header {
                None => "this sub-program has no PROC: it takes no values".to_owned(),
                Some(header) => format!("`{}` takes {} values", header.name, parameters.len()),
            };
            return Err(Fault::new(codes::BAD_ARGUMENT, call.columns.clone(), message)
                .label(format!("{} given here", call.arguments.len()))
                .maybe_help(head.header.as_deref().map(text_of)));
        }
        given.save = head.header.as_ref().is_some_and(|header| header.save);
        for (at, parameter) in parameters.iter().enumerate() {
            let argument = call.arguments.get(at).and_then(Option::as_ref);
            if argument.is_some() {
                given.values_given |= bit(at);
            }
            let whole = match argument {
                None => self.default_of(parameter, head.line, &call.columns)?,
                Some(argument) if parameter.by_reference => {
                    let (target, whole) = self.reference(argument, parameter)?;
                    given.by_reference.push((parameter.name.clone(), target, argument.columns.clone()));
                    let kept = whole_type(parameter, &whole);
                    whole.converted(kept, head.line, &argument.columns)?
                }
                Some(argument) if parameter.dimensions.is_empty() => {
                    let value = evaluate(argument, self)?;
                    Whole::of(parameter.variable_type, &value, head.line, &argument.columns)?
                }
                Some(argument) => {
                    let whole = self.array(argument, parameter)?;
                    whole.converted(parameter.variable_type, head.line, &argument.columns)?
                }
            };
            given.parameters.push((parameter.name.clone(), whole));
        }
        Ok(given)
    }

    fn default_of(&mut self, parameter: &Parameter, line: u32, columns: &Columns) -> Outcome<Whole> {
        let value = match &parameter.default {
            Some(value) => evaluate(value, self)?,
            None => self.variables.initial(parameter.variable_type),
        };
        let mut sizes = Vec::new();
        for size in &parameter.dimensions {
            sizes.push(match size {
                Some(size) => evaluate(size, self)?.integer(columns)?,
                None => 1,
            });
        }
        Whole::filled(parameter.variable_type, &sizes, &value, line, columns)
    }

    /// The variable behind a VAR parameter, and what is in it.
    fn reference(&mut self, argument: &Expr, parameter: &Parameter) -> Outcome<(Target, Whole)> {
        let constant = |value: i32| Expr { columns: argument.columns.clone(), kind: ExprKind::Int(value) };
        let (target, whole) = match &argument.kind {
            ExprKind::Parameter(index) => {
                let number = evaluate(index, self)?.integer(&index.columns)?;
                let value = Value::Real(self.variables.parameter(number, &argument.columns)?);
                let whole = Whole::of(VariableType::Real, &value, 0, &argument.columns)?;
                (Target::Parameter(constant(number)), whole)
            }
            ExprKind::Variable { name, indices } => {
                let whole = self.variables.whole(name, &argument.columns)?;
                let places = integers(indices, self)?;
                let whole = if places.is_empty() {
                    whole
                } else {
                    let value = self.variables.get(name, &places, &argument.columns)?;
                    Whole::of(whole.variable_type(), &value, 0, &argument.columns)?
                };
                let indices = places.into_iter().map(constant).collect();
                (Target::Variable { name: name.clone(), indices }, whole)
            }
            _ => {
                return Err(Fault::new(
                    codes::BAD_ARGUMENT,
                    argument.columns.clone(),
                    format!("`{}` is a VAR parameter: it needs a variable", parameter.name),
                )
                .label("expected a variable"));
            }
        };
        check_type(&whole, parameter, &argument.columns)?;
        self.check_sizes(&whole, parameter, &argument.columns)?;
        Ok((target, whole))
    }

    fn array(&mut self, argument: &Expr, parameter: &Parameter) -> Outcome<Whole> {
        let whole = match &argument.kind {
            ExprKind::Variable { name, indices } if indices.is_empty() => {
                self.variables.whole(name, &argument.columns)?
            }
            _ => {
                return Err(Fault::new(
                    codes::BAD_ARGUMENT,
                    argument.columns.clone(),
                    format!("`{}` is an array", parameter.name),
                )
                .label("expected the name of an array"));
            }
        };
        self.check_sizes(&whole, parameter, &argument.columns)?;
        Ok(whole)
    }

    fn check_sizes(&mut self, whole: &Whole, parameter: &Parameter, columns: &Columns) -> Outcome<()> {
        let mut fits = whole.dimensions().len() == parameter.dimensions.len();
        for (size, wanted) in whole.dimensions().iter().zip(&parameter.dimensions) {
            if let Some(wanted) = wanted {
                let wanted = evaluate(wanted, self)?.integer(columns)?;
                fits &= usize::try_from(wanted) == Ok(*size);
            }
        }
        if fits {
            return Ok(());
        }
        let shape = |count: usize| if count == 0 { "a single value".to_owned() } else { format!("{count} dimensions") };
        Err(Fault::new(
            codes::BAD_ARGUMENT,
            columns.clone(),
            format!("`{}` has {} or other sizes", parameter.name, shape(parameter.dimensions.len())),
        )
        .label(format!("this has {}", shape(whole.dimensions().len()))))
    }

    /// Begins the execution of a program.
    fn enter(&mut self, unit: UnitId, given: Given, passes: i32, modal: bool) -> Outcome<()> {
        if self.levels.len() + 1 >= LEVELS_MAX {
            return Err(Fault::new(
                codes::CALL_DEPTH,
                given.columns,
                format!("this call is more than {LEVELS_MAX} programs deep"),
            )
            .label("one level too many")
            .help("a sub-program that calls itself needs a condition that ends it"));
        }
        let head = self.head(unit)?;
        self.variables.enter();
        for (name, whole) in given.parameters {
            if let Err(fault) = self.variables.define_parameter(&name, whole, &given.columns) {
                self.variables.leave();
                return Err(fault);
            }
        }
        let source = self.library.source(unit).clone();
        let memory = self.shelf.remove(&unit).unwrap_or_default();
        self.levels.push(Waiting {
            unit: std::mem::replace(&mut self.unit, unit),
            program: std::mem::replace(&mut self.program, self.library.program(unit)),
            source: std::mem::replace(&mut self.source, source),
            window: std::mem::take(&mut self.window),
            current: self.current,
            next: std::mem::replace(&mut self.next, head.body),
            known: std::mem::replace(&mut self.known, memory),
            repeats: std::mem::take(&mut self.repeats),
            by_reference: given.by_reference,
            values_given: given.values_given,
            saved: given.save.then(|| Box::new(self.modal.clone())),
            passes_left: passes,
            body: head.body,
            modal,
        });
        self.current = head.body;
        Ok(())
    }

    /// The end of the program in execution.
    pub(super) fn end(&mut self) -> Outcome<()> {
        self.idle_blocks = self.idle_blocks.saturating_add(1);
        self.repeats.clear();
        let Some(level) = self.levels.last_mut() else {
            self.finish();
            return Ok(());
        };
        if let Some(saved) = level.saved.clone() {
            self.modal.restore(*saved);
        }
        if level.passes_left > 1 {
            level.passes_left -= 1;
            self.next = level.body;
            return Ok(());
        }
        self.leave()
    }

    /// Goes back to the calling program.
    fn leave(&mut self) -> Outcome<()> {
        let Some(level) = self.levels.pop() else { return Ok(()) };
        let mut handed_back = Vec::new();
        for (name, target, columns) in level.by_reference {
            handed_back.push((target, self.variables.whole(&name, &columns)?, columns));
        }
        let memory = std::mem::replace(&mut self.known, level.known);
        self.shelf.insert(std::mem::replace(&mut self.unit, level.unit), memory);
        self.program = level.program;
        self.source = level.source;
        self.window = level.window;
        self.current = level.current;
        self.next = level.next;
        self.repeats = level.repeats;
        self.variables.leave();
        if self.modal_call.as_ref().is_some_and(|call| call.depth > self.levels.len()) {
            self.modal_call = None;
        }
        for (target, whole, columns) in handed_back {
            match (&target, whole.single()) {
                (Target::Variable { name, indices }, None) if indices.is_empty() => {
                    self.variables.set_whole(name, whole);
                }
                (_, Some(value)) => self.assign(&target, &value.clone(), &columns, &columns)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// RET, also to a block of the calling program, also over several levels.
    pub(super) fn return_from(&mut self, wanted: &Return) -> Outcome<()> {
        let target = match &wanted.target {
            None => None,
            Some(target) => match evaluate(target, self)? {
                Value::Text(text) => Some(text),
                number => Some(Arc::from(format!("N{}", number.integer(&target.columns)?))),
            },
        };
        let behind = self.flag(wanted.behind.as_ref())?;
        let from_start = self.flag(wanted.from_start.as_ref())?;
        let levels = match &wanted.levels {
            None => 1,
            Some(levels) => {
                let number = evaluate(levels, self)?.integer(&levels.columns)?;
                usize::try_from(number).ok().filter(|number| (1..LEVELS_MAX).contains(number)).ok_or_else(|| {
                    Fault::new(codes::OUT_OF_RANGE, levels.columns.clone(), format!("{number} levels are not possible"))
                        .label(format!("expected 1 to {}", LEVELS_MAX - 1))
                })?
            }
        };
        if target.is_none() && levels == 1 || self.levels.is_empty() {
            return self.end();
        }
        for _ in 0..levels {
            if let Some(level) = self.levels.last_mut() {
                level.passes_left = 0;
                self.end()?;
            }
        }
        let Some(target) = target else { return Ok(()) };
        let columns = Columns::default();
        if from_start && self.levels.is_empty() {
            self.current = self.source.first();
            self.next = self.current;
        }
        let Some(cursor) = self.find_text(&target, Direction::Both)? else {
            return Err(self.no_target(&target, Direction::Both, &columns));
        };
        self.jump_to(cursor);
        if behind { self.go_behind(cursor) } else { Ok(()) }
    }

    fn flag(&mut self, value: Option<&Expr>) -> Outcome<bool> {
        value.map_or(Ok(false), |value| evaluate(value, self)?.truth(&value.columns))
    }

    /// Where the waiting programs stand, innermost first: file and line of each call.
    pub(super) fn called_from(&self) -> Vec<(Arc<str>, u32)> {
        self.levels.iter().rev().map(|level| (level.source.shared_name(), level.current.line)).collect()
    }
}

/// The finding for a sub-program that is not there.
pub(super) fn missing<'a>(
    name: &str,
    may_be_word: bool,
    names: impl Iterator<Item = &'a str> + Clone,
    columns: &Columns,
) -> Box<Fault> {
    let near = nearest(&name.to_ascii_uppercase(), names).map(|near| format!("did you mean `{near}`?"));
    if may_be_word
        && near.is_none()
        && let Some(help) = did_you_mean(name)
    {
        return Fault::new(codes::UNKNOWN_WORD, columns.clone(), format!("unknown word `{name}`"))
            .label("neither a word of the language nor a sub-program")
            .help(help);
    }
    let otherwise = "put it beside the program, or give its folder with -I FOLDER".to_owned();
    Fault::new(codes::NO_SUBPROGRAMS, columns.clone(), format!("there is no sub-program `{name}`"))
        .label("not found")
        .help(near.unwrap_or(otherwise))
}

/// In what an EXTERN differs from PROC.
pub(super) fn mismatch(external: &Header, header: &Header) -> Option<String> {
    if external.parameters.len() != header.parameters.len() {
        let (here, there) = (external.parameters.len(), header.parameters.len());
        return Some(format!("EXTERN has {here} parameters, PROC {} has {there}", header.name));
    }
    let differs = |(one, other): &(&Parameter, &Parameter)| {
        one.by_reference != other.by_reference
            || one.variable_type.name() != other.variable_type.name()
            || one.dimensions.len() != other.dimensions.len()
    };
    let pairs = external.parameters.iter().zip(&header.parameters);
    let at = pairs.clone().position(|pair| differs(&pair))?;
    Some(format!(
        "parameter {} of EXTERN is not what `{}` of PROC {} is",
        at + 1,
        header.parameters[at].name,
        header.name
    ))
}

/// `PROC NAME(REAL A, VAR INT B)`.
fn text_of(header: &Header) -> String {
    let parameters = header.parameters.iter().map(|parameter| {
        let by = if parameter.by_reference { "VAR " } else { "" };
        format!("{by}{} {}", parameter.variable_type.name(), parameter.name)
    });
    format!("PROC {}({})", header.name, parameters.collect::<Vec<_>>().join(", "))
}
