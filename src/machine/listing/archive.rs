//! The container `@@MMCIBN` in which a SINUMERIK saves its data.
//!
//! In: bytes. Out: the members, each with name and bytes. The container is a chain of blocks of 512 bytes like a tape: a header, then
//! the member, filled up to the next block. In the header: name on the control at 0, name on a PC at 50 (50 bytes each, ended by 0),
//! and, as decimal digits, the size at 124, the time at 136, and at 148 the sum of all other bytes of the header. So read from archives
//! of two controls (840D sl, Operate 4.x), of which one was damaged by a transfer as text: there the sums no longer hold, and nothing is
//! guessed. A zip (`.dsf`) is unpacked, too. What a member holds is not looked at here.

use crate::base::Diagnostic;
use std::io::{Cursor, Read};

/// How the container begins.
const MAGIC: &[u8] = b"@@MMCIBN";
const BLOCK: usize = 512;
const SIZE_AT: usize = 124;
const SIZE_DIGITS: usize = 12;
const SUM_AT: usize = 148;
const SUM_DIGITS: usize = 8;
const NAME_BYTES: usize = 50;

/// One file of an archive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member<'b> {
    /// As on the control: `_N_INITIAL_INI`.
    pub name: &'b str,
    pub bytes: &'b [u8],
}

/// Most bytes that come out of a zip.
const UNPACKED_MAX: u64 = 1 << 29;

/// A zip, as the newer controls (`.dsf`) and many people pack their data.
pub(super) fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

/// The members of a zip that are wanted by their name, with their bytes, in order of their names: those of drives last.
pub(super) fn unzipped(
    file: &str,
    bytes: &[u8],
    wanted: impl Fn(&str) -> bool,
) -> Result<Vec<(String, Vec<u8>)>, Diagnostic> {
    let damaged = |reason: String| {
        let message = format!("the archive `{file}` cannot be unpacked: {reason}");
        Diagnostic::error("M0302", message).help("copy it again as binary, or unpack it and name the listings inside")
    };
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| damaged(error.to_string()))?;
    let named = |place: usize| archive.name_for_index(place)?.ok().map(|name| (place, name.into_owned()));
    let mut names: Vec<(usize, String)> =
        (0..archive.len()).filter_map(named).filter(|(_, name)| wanted(name)).collect();
    names.sort_by_key(|(_, name)| (name.to_ascii_uppercase().contains("/DRV"), name.clone()));
    let (mut found, mut left) = (Vec::with_capacity(names.len()), UNPACKED_MAX);
    for (place, name) in names {
        let member = archive.by_index(place).map_err(|error| damaged(format!("{name}: {error}")))?;
        let mut content = Vec::new();
        let read = member.take(left + 1).read_to_end(&mut content);
        let read = read.map_err(|error| damaged(format!("{name}: {error}")))? as u64;
        left =
            left.checked_sub(read).ok_or_else(|| damaged(format!("more than {UNPACKED_MAX} bytes come out of it")))?;
        found.push((name, content));
    }
    Ok(found)
}

/// Whether the bytes are such a container.
pub(super) fn is_archive(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// All members in order; markers without content are left out.
pub(super) fn members<'b>(file: &str, bytes: &'b [u8]) -> Result<Vec<Member<'b>>, Diagnostic> {
    let (mut found, mut at) = (Vec::new(), 0);
    while let Some(header) = bytes.get(at..at + BLOCK) {
        if header.iter().all(|byte| *byte == 0) {
            at += BLOCK;
            continue;
        }
        let Some(size) = size(header) else {
            let message = format!("the archive `{file}` is damaged: at byte {at} there is no header of a member");
            let help =
                "copy it again as binary (a transfer as text changes line ends), or save the machine data as text";
            return Err(Diagnostic::error("M0302", message).help(help));
        };
        let start = at + BLOCK;
        let Some(content) = start.checked_add(size).and_then(|end| bytes.get(start..end)) else {
            let name = name(header);
            let message = format!("the archive `{file}` ends inside its member {name}");
            return Err(Diagnostic::error("M0302", message).help("copy it again; the file on the control is longer"));
        };
        if size > 0 {
            found.push(Member { name: name(header), bytes: content });
        }
        at = start + size.div_ceil(BLOCK) * BLOCK;
    }
    if bytes.get(at..).is_some_and(|rest| rest.iter().any(|byte| *byte != 0)) {
        let message = format!("the archive `{file}` ends inside the header of a member, at byte {at}");
        return Err(Diagnostic::error("M0302", message).help("copy it again; the file on the control is longer"));
    }
    Ok(found)
}

/// The size that the header states; `None` if its sum is wrong.
fn size(header: &[u8]) -> Option<usize> {
    let before: u64 = header[..SUM_AT].iter().map(|byte| u64::from(*byte)).sum();
    let after: u64 = header[SUM_AT + SUM_DIGITS..].iter().map(|byte| u64::from(*byte)).sum();
    let stated = digits(&header[SUM_AT..SUM_AT + SUM_DIGITS])?;
    (stated == before + after)
        .then(|| digits(&header[SIZE_AT..SIZE_AT + SIZE_DIGITS]))?
        .and_then(|size| size.try_into().ok())
}

fn digits(field: &[u8]) -> Option<u64> {
    std::str::from_utf8(until_zero(field)).ok()?.trim().parse().ok()
}

fn name(header: &[u8]) -> &str {
    std::str::from_utf8(until_zero(&header[..NAME_BYTES])).unwrap_or("?")
}

fn until_zero(field: &[u8]) -> &[u8] {
    let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
    &field[..end]
}
