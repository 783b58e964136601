//! From text to assignments.
//!
//! In: files, archives taken apart. Out: [`Listing`]. Known lines: `N32300 $MA_MAX_AX_ACCEL[0,AX1]=6` with or without the number,
//! `p1460[0]=5`, `CHANDATA(1)`, `INCH`, comments of ours, each with or without a sum behind it (`'38c0`); everything else is counted. A line that begins like an assignment and is none is
//! an error with its place: a number that cannot be read must not be passed over. Values are not judged.

use super::archive::{is_archive, is_zip, members, unzipped};
use super::data::{Datum, DriveObject, Listing, Literal, Scope, Spot};
use super::{CARRIED, ListingFile, digital};
use crate::base::Diagnostic;
use std::sync::Arc;

/// Bytes looked at to tell text from binary.
const HEAD: usize = 4096;
/// Longest line that a finding shows.
const LINE_MAX: usize = 400;
/// Findings shown at most: a file that is something else has thousands.
const ERRORS_MAX: usize = 20;
/// Most data of one import: an archive of a large control has some 30,000.
const DATA_MAX: usize = 2_000_000;

/// Reads all files.
pub(super) fn read(files: &[ListingFile]) -> Result<Listing, Vec<Diagnostic>> {
    let mut reader = Reader::default();
    for file in files {
        if is_archive(&file.bytes) {
            reader.archive(&file.name, &file.bytes).map_err(|finding| vec![finding])?;
        } else if is_zip(&file.bytes) {
            for (name, bytes) in unzipped(&file.name, &file.bytes, of_interest).map_err(|finding| vec![finding])? {
                let shown = format!("{}/{name}", file.name);
                if is_archive(&bytes) {
                    reader.archive(&shown, &bytes).map_err(|finding| vec![finding])?;
                } else {
                    reader.member(&shown, &name, &bytes);
                }
            }
        } else if is_text(&file.bytes) {
            reader.text(&file.name, &decoded(&file.bytes));
        } else {
            return Err(vec![binary(file)]);
        }
    }
    if !reader.errors.is_empty() {
        return Err(reader.errors);
    }
    if reader.listing.is_empty() {
        let names: Vec<String> = files.iter().map(|file| format!("`{}`", file.name)).collect();
        let message = format!("{}: there are no machine data", names.join(", "));
        let help =
            "expected lines such as N32300 $MA_MAX_AX_ACCEL[0,AX1]=6 or p1460[0]=5, or an archive (@@MMCIBN) with them";
        return Err(vec![Diagnostic::error("M0301", message).help(help)]);
    }
    Ok(reader.listing)
}

fn binary(file: &ListingFile) -> Diagnostic {
    let message = format!("`{}` is binary, and no archive that begins with @@MMCIBN", file.name);
    let help = "save the machine data as text (ASCII): of the NC as INI or TEA, of the drives as ASCII archive";
    Diagnostic::error("M0303", message).help(help)
}

/// Members that may hold machine data; programs and cycles read them and do not set them.
fn of_interest(name: &str) -> bool {
    let upper = name.to_ascii_uppercase();
    ["_INI", "_TEA", ".INI", ".TEA", "_TEX", "_ACX", ".ACX", "_TXT", "_TOA", "_BOT", ".ARC"]
        .iter()
        .any(|end| upper.ends_with(end))
}

/// Text in two bytes a character opens with a mark that says which of them is first.
fn is_wide(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff])
}

fn is_text(bytes: &[u8]) -> bool {
    is_wide(bytes) || !bytes.iter().take(HEAD).any(|byte| *byte == 0)
}

/// UTF-16 behind its mark, UTF-8, else Latin-1.
fn decoded(bytes: &[u8]) -> String {
    if is_wide(bytes) {
        let little = bytes[0] == 0xff;
        let unit = |pair: &[u8]| match pair {
            [one, other] if little => u16::from_le_bytes([*one, *other]),
            [one, other] => u16::from_be_bytes([*one, *other]),
            _ => 0,
        };
        let units: Vec<u16> = bytes.chunks(2).skip(1).map(unit).collect();
        return String::from_utf16_lossy(&units);
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => text.trim_start_matches('\u{feff}').to_owned(),
        Err(_) => bytes.iter().map(|byte| char::from(*byte)).collect(),
    }
}

#[derive(Default)]
struct Reader {
    listing: Listing,
    errors: Vec<Diagnostic>,
    /// Of `CHANDATA`.
    channel: u32,
    /// Inside a program of an archive in text form.
    in_program: bool,
    count: usize,
}

/// A line that begins like an assignment and is none.
struct Broken {
    expected: &'static str,
}

impl Reader {
    /// The members of a container that may hold machine data.
    fn archive(&mut self, name: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
        for member in members(name, bytes)?.iter().filter(|member| of_interest(member.name)) {
            self.member(&format!("{name}/{}", member.name), member.name, member.bytes);
        }
        Ok(())
    }

    fn member(&mut self, shown: &str, name: &str, bytes: &[u8]) {
        if is_text(bytes) {
            self.text(shown, &decoded(bytes));
        } else {
            self.listing.binary.push(name.to_owned());
        }
    }

    fn text(&mut self, name: &str, text: &str) {
        self.channel = 1;
        self.in_program = false;
        let file: Arc<str> = name.into();
        self.listing.drives.push(DriveObject { file: name.to_owned(), ..DriveObject::default() });
        for (number, line) in text.lines().enumerate() {
            let shown: String = line.chars().take(LINE_MAX).collect();
            let spot = Spot { file: file.clone(), line: number as u32 + 1, text: shown.trim_end().into() };
            if let Err(broken) = self.line(line.trim(), &spot)
                && self.errors.len() < ERRORS_MAX
            {
                let finding = Diagnostic::error("M0304", "an assignment of a machine datum that cannot be read");
                self.errors.push(
                    spot.mark(finding, broken.expected)
                        .help("write it as the control does: N32300 $MA_MAX_AX_ACCEL[0,AX1]=6"),
                );
            }
            if self.count > DATA_MAX {
                let finding = Diagnostic::error("M0304", format!("more than {DATA_MAX} machine data"));
                self.errors.push(spot.mark(finding, "").help("import fewer files at once"));
                break;
            }
        }
        self.listing.drives.retain(|drive| !drive.parameters.is_empty());
    }

    fn line(&mut self, line: &str, spot: &Spot) -> Result<(), Broken> {
        if let Some(rest) = line.strip_prefix(CARRIED.trim_end()) {
            return self.carried(rest.trim(), spot);
        }
        if let Some(member) = line.strip_prefix('%') {
            // An archive in text form: `%_N_MILL_SPF` opens a program, whose assignments are not data.
            self.in_program =
                member.starts_with("_N_") && !of_interest(member.split([' ', ';']).next().unwrap_or(member));
            return Ok(());
        }
        if line.is_empty() || line.starts_with(';') || self.in_program {
            return Ok(());
        }
        let line = match without_sum(line) {
            Some(rest) => {
                self.listing.summed_lines += 1;
                rest
            }
            None => line,
        };
        if line.eq_ignore_ascii_case("METRIC") {
            self.listing.metric = true;
            return Ok(());
        }
        if line.eq_ignore_ascii_case("INCH") {
            self.listing.inch = Some(spot.clone());
            return Ok(());
        }
        if let Some(rest) = line.strip_prefix("CHANDATA(") {
            let digits = rest.trim_end_matches(')').trim();
            self.channel = digits.parse().map_err(|_| Broken { expected: "expected CHANDATA(1)" })?;
            return Ok(());
        }
        if let Some((number, rest)) = parameter(line) {
            return self.parameter(number, rest, spot);
        }
        let (number, rest) = block_number(line);
        if rest.starts_with('$') {
            return self.datum(number, rest, spot);
        }
        if line.starts_with('[') {
            // A header of a section: of a new drive, if it is one.
            self.new_drive(None);
        }
        self.listing.other_lines += 1;
        Ok(())
    }

    /// `drive X` opens the parameters of a drive, anything else is a key.
    fn carried(&mut self, rest: &str, spot: &Spot) -> Result<(), Broken> {
        if let Some(axis) = rest.strip_prefix("drive ") {
            self.new_drive(Some(axis.trim().to_owned()));
            return Ok(());
        }
        let (key, value) = rest.split_once('=').ok_or(Broken { expected: "expected KEY = VALUE" })?;
        self.listing.carried.insert(key.trim().to_owned(), (value.trim().to_owned(), spot.clone()));
        Ok(())
    }

    fn new_drive(&mut self, axis: Option<String>) {
        let Some(last) = self.listing.drives.last_mut() else { return };
        if last.parameters.is_empty() {
            last.axis = axis.or(last.axis.take());
        } else {
            let file = last.file.clone();
            self.listing.drives.push(DriveObject { file, axis, ..DriveObject::default() });
        }
    }

    /// `[0]=5` behind `p1460`.
    fn parameter(&mut self, number: u32, rest: &str, spot: &Spot) -> Result<(), Broken> {
        let (index, rest) = match rest.strip_prefix('[') {
            Some(rest) => {
                let (index, rest) = rest.split_once(']').ok_or(Broken { expected: "expected p1460[0]=5" })?;
                (index.trim().parse().map_err(|_| Broken { expected: "expected a number in the brackets" })?, rest)
            }
            None => (0, rest),
        };
        let value = rest.trim_start().strip_prefix('=').ok_or(Broken { expected: "expected =" })?;
        // A connection (`722.0`, `0:0.0`) and a text are no numbers, and nothing asks for them.
        let literal = literal(value).unwrap_or_else(|_| Literal::Text(value.trim().to_owned()));
        self.count += 1;
        if let Some(drive) = self.listing.drives.last_mut() {
            drive.parameters.insert((number, index), Datum { literal, spot: spot.clone(), used: false });
        }
        Ok(())
    }

    fn datum(&mut self, number: Option<u32>, line: &str, spot: &Spot) -> Result<(), Broken> {
        let end = line.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_' || c == '$')).unwrap_or(line.len());
        let (word, rest) = (line[..end].to_ascii_uppercase(), line[end..].trim_start());
        let (inside, rest) = match rest.strip_prefix('[') {
            Some(rest) => rest.split_once(']').ok_or(Broken { expected: "expected ]" })?,
            None => ("", rest),
        };
        let rest = rest.trim_start();
        self.count += 1;
        if let Some(name) = word.strip_prefix("$MD_") {
            return self.drive_datum(name, number, inside, rest, spot);
        }
        let all = [Scope::General, Scope::Channel, Scope::ChannelSetting, Scope::Axis];
        let carrier = word.starts_with("$TC_CARR").then_some(Scope::ToolCarrier);
        let scope = carrier.or_else(|| all.into_iter().find(|scope| word.starts_with(scope.prefix())));
        let foreign_channel = matches!(scope, Some(Scope::Channel | Scope::ChannelSetting)) && self.channel != 1;
        let Some(scope) = scope.filter(|_| !foreign_channel) else {
            let shown = match foreign_channel {
                true => format!("{word} of channel {}", self.channel),
                false => word,
            };
            *self.listing.foreign.entry(shown).or_default() += 1;
            return Ok(());
        };
        let value = rest.strip_prefix('=').ok_or(Broken { expected: "expected =" })?;
        let (axis, index) = address(inside, scope)?;
        let name = word[scope.prefix().len()..].to_owned();
        // A tool carrier names axes, `(X)`, which are no numbers.
        let read = match (literal(value), scope) {
            (Err(_), Scope::ToolCarrier) => Literal::Text(value.trim().to_owned()),
            (read, _) => read?,
        };
        let datum = Datum { literal: read, spot: spot.clone(), used: false };
        self.listing.add(scope, &name, number, (axis, index), datum);
        Ok(())
    }
}

impl Reader {
    /// `N1407 $MD_SPEEDCTRL_GAIN_1[0,AX1]=5`, of the 840D pl: a parameter of the drive of that axis, or with that number.
    fn drive_datum(
        &mut self,
        name: &str,
        number: Option<u32>,
        inside: &str,
        rest: &str,
        spot: &Spot,
    ) -> Result<(), Broken> {
        let value = rest.strip_prefix('=').ok_or(Broken { expected: "expected =" })?;
        let parts: Vec<&str> = inside.split(',').map(str::trim).filter(|part| !part.is_empty()).collect();
        let (index, drive) = match parts.as_slice() {
            [drive] => ("0", *drive),
            [index, drive] => (*index, *drive),
            _ => return Err(Broken { expected: "expected a drive, such as [0,AX1]" }),
        };
        let read = match literal(value)? {
            Literal::Number(value) => digital::counterpart(name, number, value).filter(|_| index == "0"),
            Literal::Text(_) => None,
        };
        let Some((parameter, place, value)) = read else {
            *self.listing.foreign.entry(format!("$MD_{name}")).or_default() += 1;
            return Ok(());
        };
        let drive = drive.trim_matches('"').to_ascii_uppercase();
        let digits = drive.trim_start_matches(|c: char| c.is_ascii_alphabetic() || c == '_');
        let module: Option<u32> = if drive.starts_with("AX") { None } else { digits.parse().ok() };
        let is_axis = drive.starts_with(|c: char| c.is_ascii_alphabetic()) && !drive.starts_with('D');
        let file = format!("$MD_ of {drive}");
        let place_of = self.listing.drives.iter().position(|known| known.file == file);
        let place_of = place_of.unwrap_or_else(|| {
            // Before the object that is being read, which is the last.
            let object = DriveObject {
                file,
                axis: is_axis.then_some(drive),
                module: module.filter(|_| !is_axis),
                ..DriveObject::default()
            };
            self.listing.drives.insert(0, object);
            0
        });
        if let Some(object) = self.listing.drives.get_mut(place_of) {
            let datum = Datum { literal: Literal::Number(value), spot: spot.clone(), used: false };
            object.parameters.insert((parameter, place), datum);
        }
        Ok(())
    }
}

/// `0,AX1` or `AX1` or `0`; a second index is folded into the first, so that it is told apart. An axis may be its number: `[0,1]`, `[1]`.
fn address(inside: &str, scope: Scope) -> Result<(String, u32), Broken> {
    let (mut axis, mut index, mut numbers) = (String::new(), 0_u32, Vec::new());
    for part in inside.split(',').map(str::trim).filter(|part| !part.is_empty()) {
        if !axis.is_empty() && !part.starts_with(|c: char| c.is_ascii_digit()) {
            // `[u1,AX1]` is how a panel asks for data: what counts from 0 here counts from 1 there.
            return Err(Broken { expected: "expected one axis, such as [0,AX1]" });
        }
        if part.starts_with(|c: char| c.is_ascii_digit()) {
            let given: u32 = part.parse().map_err(|_| Broken { expected: "expected an index" })?;
            index = index.saturating_mul(1000).saturating_add(given);
            numbers.push(given);
        } else {
            axis = part.trim_matches('"').to_ascii_uppercase();
        }
    }
    if scope == Scope::Axis
        && axis.is_empty()
        && let Some((last, before)) = numbers.split_last()
        && *last > 0
    {
        let first = before.first().copied().unwrap_or(0);
        return Ok((format!("AX{last}"), before.iter().skip(1).fold(first, |all, one| all.saturating_mul(1000) + one)));
    }
    if scope == Scope::Axis && axis.is_empty() {
        return Err(Broken { expected: "expected an axis, such as [0,AX1]" });
    }
    Ok((axis, index))
}

/// The line before its sum, ` '38c0`: MD11230 (bit 0, as delivered) writes one behind every line. How it is reckoned is not published.
fn without_sum(line: &str) -> Option<&str> {
    let (rest, sum) = line.rsplit_once('\'')?;
    let is_sum = (1..=4).contains(&sum.len()) && sum.bytes().all(|byte| byte.is_ascii_hexdigit());
    (is_sum && rest.ends_with([' ', '\t'])).then(|| rest.trim_end())
}

/// `6`, `1EX-5`, `'H2f'`, `'B101'`, `"X1"`, up to a comment.
fn literal(value: &str) -> Result<Literal, Broken> {
    let value = value.trim();
    if let Some(text) = value.strip_prefix('"') {
        let (text, _) = text.split_once('"').ok_or(Broken { expected: "expected a closing quote" })?;
        return Ok(Literal::Text(text.to_owned()));
    }
    let value = value.split(';').next().unwrap_or(value).trim();
    if let Some(coded) = value.strip_prefix('\'').and_then(|text| text.strip_suffix('\'')) {
        let (radix, digits) = match coded.split_at_checked(1) {
            Some(("H" | "h", digits)) => (16, digits),
            Some(("B" | "b", digits)) => (2, digits),
            _ => return Ok(Literal::Text(coded.to_owned())),
        };
        let number =
            u64::from_str_radix(digits, radix).map_err(|_| Broken { expected: "expected digits after 'H or 'B" })?;
        return Ok(Literal::Number(number as f64));
    }
    // `1 EX -5` is one number, `6 7` is two.
    let parts: Vec<&str> = value.split_whitespace().collect();
    let digit = |byte: Option<u8>| byte.is_some_and(|byte| byte.is_ascii_digit() || byte == b'.');
    if parts.windows(2).any(|pair| digit(pair[0].bytes().last()) && digit(pair[1].bytes().next())) {
        return Err(Broken { expected: "expected one number" });
    }
    let plain = parts.concat().to_ascii_uppercase().replace("EX", "E");
    match plain.parse::<f64>() {
        Ok(number) if number.is_finite() && !plain.contains("INF") => Ok(Literal::Number(number)),
        _ if matches!(plain.as_str(), "TRUE" | "FALSE") => Ok(Literal::Number(f64::from(u8::from(plain == "TRUE")))),
        _ => Err(Broken { expected: "expected a number" }),
    }
}

/// `N32300 rest`.
fn block_number(line: &str) -> (Option<u32>, &str) {
    let Some(rest) = line.strip_prefix(['N', 'n']) else { return (None, line) };
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    match rest[..digits].parse() {
        Ok(number) => (Some(number), rest[digits..].trim_start()),
        Err(_) => (None, line),
    }
}

/// `p1460` and what follows; `r0107` is read likewise.
fn parameter(line: &str) -> Option<(u32, &str)> {
    let rest = line.strip_prefix(['p', 'r', 'P'])?;
    let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
    let rest_after = &rest[digits..];
    let follows = rest_after.trim_start().starts_with(['[', '=']);
    (digits > 0 && follows).then(|| rest[..digits].parse().ok())?.map(|number| (number, rest_after))
}
