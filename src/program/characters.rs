//! Character sets of program files.
//!
//! In: bytes. Out: whether a file is UTF-8 as a whole ([`Utf8Check`]: one pass, stretch by stretch; every other file is
//! Windows-1252, of which Latin-1 is a part), and single characters. Refuses what is no program text. Holds no file.

/// The mark that some editors put before UTF-8.
pub(super) const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

/// Finds out whether stretches of bytes are UTF-8 together.
#[derive(Default)]
pub(super) struct Utf8Check {
    /// Bytes of a character that the last stretch has begun.
    begun: Vec<u8>,
    broken: bool,
}

impl Utf8Check {
    /// Takes the next stretch.
    pub(super) fn take(&mut self, mut bytes: &[u8]) {
        // A character has at most four bytes: finish the one that is begun first.
        while !self.begun.is_empty() && !self.broken {
            let Some((first, rest)) = bytes.split_first() else { return };
            self.begun.push(*first);
            bytes = rest;
            match std::str::from_utf8(&self.begun) {
                Ok(_) => self.begun.clear(),
                Err(error) => self.broken = error.error_len().is_some(),
            }
        }
        if self.broken {
            return;
        }
        if let Err(error) = std::str::from_utf8(bytes) {
            match error.error_len() {
                Some(_) => self.broken = true,
                None => self.begun.extend_from_slice(&bytes[error.valid_up_to()..]),
            }
        }
    }

    /// True if all of it was UTF-8.
    pub(super) fn is_utf8(&self) -> bool {
        !self.broken && self.begun.is_empty()
    }
}

/// One character of Windows-1252. The five bytes that it leaves open are the control characters of Latin-1.
pub(super) fn windows_1252(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘',
        '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => FROM_0X80[usize::from(byte - 0x80)],
        _ => char::from(byte),
    }
}

/// Bytes looked at to tell text from data.
const HEAD_BYTES: usize = 4096;

/// What a file is that cannot be an NC program, and what to do: text in two-byte characters, or no text at all.
pub(super) fn no_program(head: &[u8]) -> Option<(&'static str, &'static str)> {
    if head.starts_with(&[0xFF, 0xFE]) || head.starts_with(&[0xFE, 0xFF]) {
        return Some(("UTF-16 text", "save it as UTF-8, Latin-1 or Windows-1252"));
    }
    let head = &head[..head.len().min(HEAD_BYTES)];
    head.contains(&0).then_some(("no text: it holds zero bytes", "give the path of an NC program"))
}

#[cfg(test)]
mod tests {
    use super::Utf8Check;

    #[test]
    fn a_character_may_lie_across_stretches() {
        let text = "aä€😀b".as_bytes();
        for cut in 0..=text.len() {
            for second in cut..=text.len() {
                let mut check = Utf8Check::default();
                check.take(&text[..cut]);
                check.take(&text[cut..second]);
                check.take(&text[second..]);
                assert!(check.is_utf8(), "cut at {cut} and {second}");
                let mut check = Utf8Check::default();
                check.take(&text[..cut]);
                check.take(b"\xe4x");
                assert!(!check.is_utf8(), "a foreign byte at {cut}");
            }
        }
        let mut check = Utf8Check::default();
        check.take(&text[..2]);
        assert!(!check.is_utf8(), "a character without its end");
    }
}
