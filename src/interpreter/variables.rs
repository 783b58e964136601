//! Variables of a run: R parameters and what DEF made.
//!
//! In: definitions, assignments. Out: values. Memory is bounded. Undeclared names are findings with the nearest declared one.

use super::frame::{Frame, GeometryAxes};
use super::value::Value;
use crate::base::diagnostics::nearest;
use crate::program::syntax::VariableType;
use crate::program::{Columns, Fault, Outcome, codes};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Highest R parameter (MD28050 allows 32535 of them).
pub const R_MAX: i32 = 32534;
/// Elements of all variables together.
const ELEMENTS_MAX: usize = 100_000;

/// All variables.
#[derive(Clone, Debug, Default)]
pub struct Variables {
    parameters: Vec<f64>,
    /// Those of the program in execution.
    declared: BTreeMap<Arc<str>, Variable>,
    /// Those of the programs that wait for its end, outermost first: out of its sight (MD11120 = 0).
    waiting: Vec<BTreeMap<Arc<str>, Variable>>,
    /// GUD: known to all programs.
    global: BTreeMap<Arc<str>, Variable>,
    elements: usize,
    /// Axes that the frames of a program turn.
    frame_axes: GeometryAxes,
}

/// A whole variable, outside of [`Variables`].
#[derive(Clone, Debug)]
pub struct Whole(Variable);

impl Whole {
    /// A single value, converted to its type; `line` is where it is declared.
    pub fn of(variable_type: VariableType, value: &Value, line: u32, columns: &Columns) -> Outcome<Self> {
        let value = convert(variable_type, value, columns)?;
        Ok(Self(Variable { variable_type, line, dimensions: Vec::new(), values: vec![value] }))
    }

    /// All values the same; `line` is where it is declared.
    pub fn filled(
        variable_type: VariableType,
        sizes: &[i32],
        value: &Value,
        line: u32,
        columns: &Columns,
    ) -> Outcome<Self> {
        let Self(mut variable) = Self::of(variable_type, value, line, columns)?;
        let sizes: Vec<usize> = sizes.iter().map(|size| usize::try_from(*size).unwrap_or(0).max(1)).collect();
        let count = sizes.iter().fold(1_usize, |count, size| count.saturating_mul(*size));
        if count > ELEMENTS_MAX {
            return Err(Fault::new(codes::TOO_MUCH_MEMORY, columns.clone(), format!("an array of {count} elements"))
                .label(format!("at most {ELEMENTS_MAX}")));
        }
        variable.values.resize(count, variable.values[0].clone());
        variable.dimensions = sizes;
        Ok(Self(variable))
    }

    /// The same as a parameter of that type, declared in `line`: every value is converted.
    pub fn converted(mut self, variable_type: VariableType, line: u32, columns: &Columns) -> Outcome<Self> {
        for value in &mut self.0.values {
            *value = convert(variable_type, value, columns)?;
        }
        self.0.variable_type = variable_type;
        self.0.line = line;
        Ok(self)
    }

    /// Its type.
    pub fn variable_type(&self) -> VariableType {
        self.0.variable_type
    }

    /// Sizes of its dimensions; empty for a single value.
    pub fn dimensions(&self) -> &[usize] {
        &self.0.dimensions
    }

    /// The value of a single one.
    pub fn single(&self) -> Option<&Value> {
        self.0.values.first().filter(|_| self.0.dimensions.is_empty())
    }
}

/// Value before the first assignment.
fn zero(variable_type: VariableType, frame_axes: GeometryAxes) -> Value {
    match variable_type {
        VariableType::Bool => Value::Bool(false),
        VariableType::Char | VariableType::Int => Value::Int(0),
        VariableType::Real => Value::Real(0.0),
        VariableType::Text(_) => Value::Text(Arc::from("")),
        VariableType::Axis => Value::Axis(None),
        VariableType::Frame => Value::Frame(Arc::new(Frame::identity(frame_axes))),
    }
}

#[derive(Clone, Debug)]
struct Variable {
    variable_type: VariableType,
    /// Line of its DEF: a loop may pass it again.
    line: u32,
    dimensions: Vec<usize>,
    /// Row by row.
    values: Vec<Value>,
}

impl Variables {
    /// None yet; frames of the program turn these axes.
    pub fn new(frame_axes: GeometryAxes) -> Self {
        Self { frame_axes, ..Self::default() }
    }

    /// Number of dimensions of a variable of type FRAME; `None`: it is none.
    pub fn frame_dimensions(&self, name: &str) -> Option<usize> {
        let variable = self.find(name).filter(|variable| variable.variable_type == VariableType::Frame)?;
        Some(variable.dimensions.len())
    }

    /// A sub-program begins: it sees R parameters and none of the variables of its caller.
    pub fn enter(&mut self) {
        self.waiting.push(std::mem::take(&mut self.declared));
    }

    /// It ends: its variables are gone.
    pub fn leave(&mut self) {
        let gone = std::mem::replace(&mut self.declared, self.waiting.pop().unwrap_or_default());
        self.elements -= gone.values().map(|variable| variable.values.len()).sum::<usize>();
    }

    /// R parameter; 0 before the first assignment.
    pub fn parameter(&self, number: i32, columns: &Columns) -> Outcome<f64> {
        Ok(self.parameters.get(parameter_index(number, columns)?).copied().unwrap_or(0.0))
    }

    /// Sets an R parameter.
    pub fn set_parameter(&mut self, number: i32, value: f64, columns: &Columns) -> Outcome<()> {
        let index = parameter_index(number, columns)?;
        if self.parameters.len() <= index {
            self.parameters.resize(index + 1, 0.0);
        }
        self.parameters[index] = value;
        Ok(())
    }

    /// True if there is a variable of that name.
    pub fn is_declared(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    fn find(&self, name: &str) -> Option<&Variable> {
        self.declared.get(name).or_else(|| self.global.get(name))
    }

    fn find_mut(&mut self, name: &str) -> Option<&mut Variable> {
        self.declared.get_mut(name).or_else(|| self.global.get_mut(name))
    }

    /// What has been defined so far becomes global: the end of a definition file.
    pub fn make_global(&mut self) {
        self.global.append(&mut self.declared);
    }

    /// True if the name stands for a STRING without indices: a computed jump target.
    pub fn text(&self, name: &str) -> Option<Arc<str>> {
        match self.find(name)?.values.as_slice() {
            [Value::Text(text)] => Some(text.clone()),
            _ => None,
        }
    }

    /// DEF: a new variable of zeros, or the same one again.
    pub fn define(
        &mut self,
        name: &Arc<str>,
        variable_type: VariableType,
        dimensions: &[i32],
        at: (u32, &Columns),
    ) -> Outcome<()> {
        let (line, columns) = at;
        if let Some(known) = self.declared.get(name)
            && known.line != line
        {
            return Err(Fault::new(
                codes::REDECLARED,
                columns.clone(),
                format!("`{name}` is already defined in line {}", known.line),
            )
            .label("defined again"));
        }
        let mut count = 1_usize;
        let mut sizes = Vec::new();
        for size in dimensions {
            let size = usize::try_from(*size).ok().filter(|size| *size > 0).ok_or_else(|| {
                Fault::new(codes::BAD_INDEX, columns.clone(), format!("an array of {size} elements is not possible"))
                    .label("expected a size from 1")
            })?;
            count = count.saturating_mul(size);
            sizes.push(size);
        }
        let replaced = self.declared.get(name).map_or(0, |known| known.values.len());
        let elements = (self.elements - replaced).saturating_add(count);
        if elements > ELEMENTS_MAX {
            return Err(Fault::new(
                codes::TOO_MUCH_MEMORY,
                columns.clone(),
                format!("all variables together would have {elements} elements"),
            )
            .label(format!("at most {ELEMENTS_MAX}")));
        }
        self.elements = elements;
        let zero = zero(variable_type, self.frame_axes);
        self.declared
            .insert(name.clone(), Variable { variable_type, line, dimensions: sizes, values: vec![zero; count] });
        Ok(())
    }

    /// What a variable of that type holds before the first assignment.
    pub fn initial(&self, variable_type: VariableType) -> Value {
        zero(variable_type, self.frame_axes)
    }

    /// A whole variable, to be handed to a sub-program.
    pub fn whole(&self, name: &str, columns: &Columns) -> Outcome<Whole> {
        self.declared(name, columns).map(|variable| Whole(variable.clone()))
    }

    /// A whole variable as a sub-program left it: stored in one of the same size.
    pub fn set_whole(&mut self, name: &str, whole: Whole) {
        if let Some(variable) = self.find_mut(name)
            && variable.values.len() == whole.0.values.len()
        {
            variable.values = whole.0.values;
        }
    }

    /// A parameter of a sub-program.
    pub fn define_parameter(&mut self, name: &Arc<str>, whole: Whole, columns: &Columns) -> Outcome<()> {
        let elements = self.elements.saturating_add(whole.0.values.len());
        if elements > ELEMENTS_MAX {
            let message = format!("all variables together would have {elements} elements");
            return Err(
                Fault::new(codes::TOO_MUCH_MEMORY, columns.clone(), message).label(format!("at most {ELEMENTS_MAX}"))
            );
        }
        self.elements = elements;
        self.declared.insert(name.clone(), whole.0);
        Ok(())
    }

    /// Value of a variable or array element.
    pub fn get(&self, name: &str, indices: &[i32], columns: &Columns) -> Outcome<Value> {
        let variable = self.declared(name, columns)?;
        if let Some((at, indices)) = variable.character(indices) {
            let place = variable.place(name, indices, columns)?;
            return character(&variable.values[place], at, columns);
        }
        let place = variable.place(name, indices, columns)?;
        Ok(match (variable.variable_type, &variable.values[place]) {
            (VariableType::Char, Value::Int(code)) => Value::Char(character_of(*code)),
            (_, value) => value.clone(),
        })
    }

    /// Sets a variable or array element, converted to its type.
    pub fn set(&mut self, name: &str, indices: &[i32], value: &Value, columns: (&Columns, &Columns)) -> Outcome<()> {
        let (name_columns, value_columns) = columns;
        let variable = self.declared(name, name_columns)?;
        let (place, converted) = match variable.character(indices) {
            Some((at, indices)) => {
                let place = variable.place(name, indices, name_columns)?;
                let code = convert(VariableType::Char, value, value_columns)?;
                (place, with_character(&variable.values[place], at, &code, name_columns)?)
            }
            None => {
                let place = variable.place(name, indices, name_columns)?;
                (place, convert(variable.variable_type, value, value_columns)?)
            }
        };
        if let Some(variable) = self.find_mut(name) {
            variable.values[place] = converted;
        }
        Ok(())
    }

    /// Number of elements from the one with these indices to the end: what SET and REP may fill.
    pub fn fill_range(&self, name: &str, indices: &[i32], columns: &Columns) -> Outcome<std::ops::Range<usize>> {
        let variable = self.declared(name, columns)?;
        let start = if indices.is_empty() { 0 } else { variable.place(name, indices, columns)? };
        Ok(start..variable.values.len())
    }

    /// Sets the element at a place given by [`Self::fill_range`].
    pub fn set_place(&mut self, name: &str, place: usize, value: &Value, columns: &Columns) -> Outcome<()> {
        if let Some(variable) = self.find_mut(name)
            && let Some(element) = variable.values.get_mut(place)
        {
            *element = convert(variable.variable_type, value, columns)?;
        }
        Ok(())
    }

    fn declared(&self, name: &str, columns: &Columns) -> Outcome<&Variable> {
        self.find(name).ok_or_else(|| {
            let near = nearest(name, self.declared.keys().chain(self.global.keys()).map(|known| &**known));
            undeclared(name, near, columns)
        })
    }
}

/// The finding for a name without DEF.
pub fn undeclared(name: &str, near: Option<&str>, columns: &Columns) -> Box<Fault> {
    Fault::new(codes::UNDECLARED, columns.clone(), format!("the variable `{name}` has no DEF"))
        .label("not defined")
        .help(near.map_or_else(
            || format!("write `DEF REAL {name}` at the start of the program"),
            |near| format!("did you mean `{near}`?"),
        ))
}

/// Character `at` of a text, as CHAR.
fn character(text: &Value, at: i32, columns: &Columns) -> Outcome<Value> {
    let Value::Text(text) = text else { return Ok(Value::Char('\0')) };
    let found = usize::try_from(at).ok().and_then(|at| text.chars().nth(at));
    found.map(Value::Char).ok_or_else(|| no_character(text, at, columns))
}

/// The character of a code.
fn character_of(code: i32) -> char {
    u32::try_from(code).ok().and_then(char::from_u32).unwrap_or('\0')
}

/// The text with another character `at`; the character 0 ends it there.
fn with_character(text: &Value, at: i32, code: &Value, columns: &Columns) -> Outcome<Value> {
    let (Value::Text(text), Value::Int(code)) = (text, code) else { return Ok(text.clone()) };
    let mut characters: Vec<char> = text.chars().collect();
    let new = character_of(*code);
    let Some(at) = usize::try_from(at).ok().filter(|at| *at < characters.len()) else {
        return Err(no_character(text, at, columns));
    };
    characters[at] = new;
    if new == '\0' {
        characters.truncate(at);
    }
    Ok(Value::Text(characters.into_iter().collect::<String>().into()))
}

fn no_character(text: &str, at: i32, columns: &Columns) -> Box<Fault> {
    let length = text.chars().count();
    Fault::new(codes::BAD_INDEX, columns.clone(), format!("this text has no character {at}")).label(if length == 0 {
        "the text is empty".to_owned()
    } else {
        format!("expected 0 to {}", length - 1)
    })
}

impl Variable {
    /// One index more than dimensions, of a STRING: the place of a character, and the indices before it.
    fn character<'i>(&self, indices: &'i [i32]) -> Option<(i32, &'i [i32])> {
        let (last, before) = indices.split_last()?;
        (matches!(self.variable_type, VariableType::Text(_)) && before.len() == self.dimensions.len())
            .then_some((*last, before))
    }

    fn place(&self, name: &str, indices: &[i32], columns: &Columns) -> Outcome<usize> {
        if indices.len() != self.dimensions.len() {
            let message = format!("`{name}` has {} dimensions", self.dimensions.len());
            return Err(
                Fault::new(codes::BAD_INDEX, columns.clone(), message).label(format!("{} given here", indices.len()))
            );
        }
        let mut place = 0;
        for (index, size) in indices.iter().zip(&self.dimensions) {
            let Some(index) = usize::try_from(*index).ok().filter(|index| index < size) else {
                let message = format!("index {index} is outside `{name}`");
                return Err(
                    Fault::new(codes::BAD_INDEX, columns.clone(), message).label(format!("expected 0 to {}", size - 1))
                );
            };
            place = place * size + index;
        }
        Ok(place)
    }
}

fn parameter_index(number: i32, columns: &Columns) -> Outcome<usize> {
    usize::try_from(number).ok().filter(|_| number <= R_MAX).ok_or_else(|| {
        Fault::new(codes::BAD_INDEX, columns.clone(), format!("there is no R parameter {number}"))
            .label(format!("expected 0 to {R_MAX}"))
    })
}

fn convert(variable_type: VariableType, value: &Value, columns: &Columns) -> Outcome<Value> {
    Ok(match (variable_type, value) {
        (VariableType::Text(length), Value::Text(text)) if text.chars().count() <= usize::from(length) => value.clone(),
        (VariableType::Text(length), Value::Text(text)) => {
            let message = format!("this text has {} characters", text.chars().count());
            return Err(Fault::new(codes::TEXT_TOO_LONG, columns.clone(), message)
                .label(format!("the variable holds {length}")));
        }
        (VariableType::Text(_), Value::Char(_) | Value::Bool(_)) => {
            return convert(variable_type, &Value::Text(value.text().unwrap_or_default()), columns);
        }
        (VariableType::Text(_), _) => {
            return Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "a number cannot be stored in a STRING")
                .label("expected a text")
                .help("join it to a text: \"\"<<value"));
        }
        (VariableType::Char, Value::Text(text)) if text.chars().count() == 1 => {
            Value::Int(text.chars().next().map_or(0, |c| c as i32))
        }
        (VariableType::Axis, Value::Axis(_)) => value.clone(),
        (VariableType::Axis, _) => {
            return Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "only an axis can be stored in an AXIS")
                .label("expected the name of an axis")
                .help("AXNAME makes an axis of a text"));
        }
        (VariableType::Frame, Value::Frame(_)) => value.clone(),
        (VariableType::Frame, _) => {
            return Err(Fault::new(codes::TYPE_MISMATCH, columns.clone(), "only a frame can be stored in a FRAME")
                .label("expected a frame such as CTRANS(X, 10)"));
        }
        (VariableType::Bool, Value::Text(text)) => Value::Bool(!text.is_empty()),
        (VariableType::Char, Value::Char(character)) => Value::Int(*character as i32),
        (VariableType::Bool, value) => Value::Bool(value.truth(columns)?),
        (VariableType::Real, value) => Value::Real(value.number(columns)?),
        (VariableType::Int, value) => Value::Int(value.integer(columns)?),
        (VariableType::Char, value) => match value.integer(columns)? {
            code @ 0..=255 => Value::Int(code),
            code => {
                return Err(Fault::new(codes::OUT_OF_RANGE, columns.clone(), format!("{code} is not a CHAR"))
                    .label("expected 0 to 255"));
            }
        },
    })
}
