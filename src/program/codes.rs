//! Every diagnostic code of NC programs, and the finding before it knows its file.
//!
//! In: nothing. Out: [`Fault`], the constants below, [`CODES`] (code, title) for help texts. A code is never reused or renumbered.
//! Does not render: that is [`crate::base::Diagnostic`]'s.

use crate::base::Diagnostic;
use crate::base::diagnostics::Place;
use std::ops::Range;

/// Bytes of a line.
pub type Columns = Range<u32>;

/// A finding in one line: everything but the file and the line. Boxed on its way up, because it is rare.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// One of the constants below.
    pub code: &'static str,
    /// What is wrong.
    pub message: String,
    /// Marked bytes of the decoded line.
    pub columns: Columns,
    /// Text under the mark.
    pub label: String,
    /// What to do.
    pub help: Option<String>,
}

impl Fault {
    /// A new finding.
    pub fn new(code: &'static str, columns: Columns, message: impl Into<String>) -> Box<Self> {
        Box::new(Self { code, message: message.into(), columns, label: String::new(), help: None })
    }

    /// Says what stands under the mark, such as "expected a number".
    pub fn label(mut self: Box<Self>, label: impl Into<String>) -> Box<Self> {
        self.label = label.into();
        self
    }

    /// Says what to do.
    pub fn help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// Says what to do, if there is something to say.
    pub fn maybe_help(mut self: Box<Self>, help: Option<String>) -> Box<Self> {
        self.help = self.help.take().or(help);
        self
    }

    /// The finding with its place.
    pub fn at(self, file: std::sync::Arc<str>, line: u32, line_text: String) -> Diagnostic {
        let columns = self.columns.start as usize..self.columns.end as usize;
        let place = Place { file, line, line_text, columns, label: self.label };
        let diagnostic = Diagnostic::error(self.code, self.message).at(place);
        match self.help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }
}

/// Value or finding.
pub type Outcome<T> = Result<T, Box<Fault>>;

macro_rules! codes {
    ($($name:ident $code:literal $title:literal;)*) => {
        $(#[doc = $title] pub const $name: &str = $code;)*
        /// Every code with its title, in order.
        pub const CODES: &[(&str, &str)] = &[$(($code, $title)),*];
    };
}

codes! {
    UNREADABLE "E0001" "The program file cannot be read";
    LOST "E0002" "The program file changed or went away while it was read";
    BAD_CHARACTER "E0101" "A character that has no meaning here";
    BAD_NUMBER "E0102" "A number that cannot be read";
    OPEN_STRING "E0103" "A string without its closing quote";
    EXPECTED_VALUE "E0104" "An address or operator without a value";
    EXPECTED_SYMBOL "E0105" "A missing bracket, comma, equals sign or keyword";
    TRAILING_TEXT "E0106" "Something is left over at the end of the block";
    TOO_DEEP "E0107" "An expression is nested too deeply";
    UNKNOWN_WORD "E0201" "A word that the language does not have";
    NOT_BUILT "E0202" "A word that the language has and this program does not do yet";
    UNKNOWN_G "E0203" "A G function that does not exist";
    UNKNOWN_AXIS "E0204" "An axis that the machine does not have";
    TWICE "E0205" "An address or a G group programmed twice in one block";
    NO_SUBPROGRAMS "E0206" "A call of a sub-program that is not found";
    BAD_BLOCK "E0207" "Words that cannot stand in one block";
    UNDECLARED "E0301" "A variable without DEF";
    REDECLARED "E0302" "A variable defined twice, or with a reserved name";
    TYPE_MISMATCH "E0303" "A value of the wrong type";
    DIVISION_BY_ZERO "E0304" "A division by zero";
    OUT_OF_DOMAIN "E0305" "A function outside its domain";
    OUT_OF_RANGE "E0306" "A value outside the range of its type or address";
    BAD_INDEX "E0307" "An index outside the array";
    TEXT_TOO_LONG "E0308" "A text longer than its variable";
    TOO_MUCH_MEMORY "E0309" "Variables larger than the memory of the control";
    UNKNOWN_SYSTEM_VARIABLE "E0310" "A system variable that is not known here";
    NO_TARGET "E0401" "A jump to a label or block number that is not there";
    UNBALANCED "E0402" "IF, FOR, WHILE, LOOP or REPEAT without its end, or the other way round";
    ENDLESS "E0403" "A loop without motion that does not end";
    CALL_DEPTH "E0404" "Sub-programs or repeated parts inside one another, too many levels deep";
    BAD_ARGUMENT "E0405" "The values of a call do not fit the parameters of the sub-program";
    NO_FEED "E0501" "A feed motion without F";
    BAD_FEED "E0502" "A feed of zero or below";
    ARC_WITHOUT_CENTRE "E0503" "G2 or G3 without centre and without radius";
    ARC_END_OFF "E0504" "The end of an arc is not on its circle";
    ARC_RADIUS "E0505" "A radius that does not reach the end of the arc";
    ARC_PLANE "E0506" "A plane whose axes the machine does not have";
    DWELL "E0507" "A G4 without a time, or with revolutions of a spindle that stands";
    MODULO "E0508" "DC, ACP or ACN for an axis that is not endless";
    UNEQUAL_SCALE "E0509" "A circle that the frames would make an ellipse";
    BAD_FRAME "E0510" "A frame that is not possible";
    WORK_AREA "E0511" "A position outside the work area";
    UNKNOWN_TOOL "E0512" "A tool or an edge that the tool table does not have";
    BAD_CURVE "E0513" "A curve that these words do not make";
    RAISED "E0601" "An alarm that the program itself raises (SETAL)";
    NOT_ACTED_ON "W0001" "A word that is known but not acted on";
    TRAVEL "W0002" "A position outside the travel of an axis";
    CHECK_STOPPED "W0003" "The check did not run the program to its end";
    NO_TOOL_DATA "W0004" "A tool or tool edge without data: its length and radius count as 0";
    PRIORITY_TRAP "W0005" "AND, OR or XOR beside a comparison, without brackets";
    LATE_DEFINITION "W0006" "A DEF behind the first executable block";
    RAISED_AND_SHOWN "W0007" "An alarm of the program that does not stop it (SETAL)";
    SPINDLE_TIME "W0008" "A spindle position that takes no time";
    SPINDLE_UNKNOWN "W0009" "A spindle that is not simulated";
    SPINDLE_LIMITED "W0010" "A spindle speed above the highest one";
}
