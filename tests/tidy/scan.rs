//! The text that the rules look at: files of the repository, Rust code without comments and strings, tokens.
//!
//! In: a folder. Out: [`Repository`] with [`TextFile`]s, [`Token`]s of Rust code. It is no parser: it knows comments, strings,
//! words and brackets, which is all that the rules need.

use std::fmt;
use std::path::{Path, PathBuf};

/// A place that breaks a rule.
#[derive(Debug)]
pub struct Fault {
    pub path: String,
    pub line: usize,
    pub rule: &'static str,
    pub reason: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{}:{}: {}: {}", self.path, self.line, self.rule, self.reason)
    }
}

/// A text file, named by its path from the root of the repository, with `/` everywhere.
pub struct TextFile {
    pub path: String,
    pub text: String,
}

impl TextFile {
    pub fn new(path: &str, text: &str) -> Self {
        Self { path: path.to_owned(), text: text.to_owned() }
    }

    /// Line of a byte of the text, from 1.
    pub fn line_at(&self, offset: usize) -> usize {
        self.text[..offset].matches('\n').count() + 1
    }

    pub fn fault(&self, offset: usize, rule: &'static str, reason: impl Into<String>) -> Fault {
        Fault { path: self.path.clone(), line: self.line_at(offset), rule, reason: reason.into() }
    }

    /// The room of the house that a file under `src/` belongs to; `None` for `lib.rs`, `main.rs` and everything else.
    pub fn room(&self) -> Option<&str> {
        let inside = self.path.strip_prefix("src/")?;
        match inside.split_once('/') {
            Some((room, _)) => Some(room),
            None => inside.strip_suffix(".rs").filter(|stem| !["lib", "main"].contains(stem)),
        }
    }
}

/// All text files of a repository that somebody wrote: no build output, nothing installed.
pub struct Repository {
    pub files: Vec<TextFile>,
    /// Every path, those of files that are not text included.
    pub paths: Vec<String>,
}

impl Repository {
    /// The repository that this test belongs to.
    pub fn here() -> Self {
        Self::read(Path::new(env!("CARGO_MANIFEST_DIR")))
    }

    pub fn read(root: &Path) -> Self {
        let mut found = Vec::new();
        walk(root, &mut found);
        found.sort();
        let mut repository = Self { files: Vec::new(), paths: Vec::new() };
        for path in found {
            let inside = path.strip_prefix(root).expect("a path below the root");
            let name = inside.to_string_lossy().replace('\\', "/");
            if let Ok(text) = std::fs::read_to_string(&path) {
                repository.files.push(TextFile { path: name.clone(), text });
            }
            repository.paths.push(name);
        }
        repository
    }

    /// A repository made of snippets: (path, text).
    pub fn of(snippets: &[(&str, &str)]) -> Self {
        Self {
            files: snippets.iter().map(|(path, text)| TextFile::new(path, text)).collect(),
            paths: snippets.iter().map(|(path, _)| (*path).to_owned()).collect(),
        }
    }

    pub fn file(&self, path: &str) -> Option<&TextFile> {
        self.files.iter().find(|file| file.path == path)
    }

    /// Rust files of the library and the program.
    pub fn sources(&self) -> impl Iterator<Item = &TextFile> {
        self.files.iter().filter(|file| file.path.starts_with("src/") && file.path.ends_with(".rs"))
    }

    /// Names of the rooms in the order of `src/lib.rs`, which is the order of the data flow.
    pub fn rooms(&self) -> Vec<String> {
        self.file("src/lib.rs").map(|lib| declared_modules(&tokens(&code_only(&lib.text)))).unwrap_or_default()
    }
}

fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
    let skipped = ["target", "node_modules", ".git", ".venv"];
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = entry.file_name();
        if skipped.iter().any(|skip| name == *skip) {
            continue;
        }
        if path.is_dir() {
            walk(&path, found);
        } else {
            found.push(path);
        }
    }
}

/// Names in `mod name;`.
pub fn declared_modules(tokens: &[Token<'_>]) -> Vec<String> {
    tokens
        .windows(3)
        .filter(|w| w[0].text == "mod" && w[1].is_word() && w[2].text == ";")
        .map(|w| w[1].text.to_owned())
        .collect()
}

/// Rust code with comments and the insides of strings and characters turned into spaces: offsets and lines stay as they are.
pub fn code_only(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut code = bytes.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let end = match opaque_end(bytes, at) {
            Some(end) => end,
            None => {
                at += 1;
                continue;
            }
        };
        for byte in &mut code[at..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        at = end;
    }
    String::from_utf8(code).expect("whole characters were blanked")
}

/// End of the comment, string or character literal that begins at `at`, if one does.
fn opaque_end(bytes: &[u8], at: usize) -> Option<usize> {
    let rest = &bytes[at..];
    let after_word = at > 0 && (bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
    if rest.starts_with(b"//") {
        return Some(at + rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len()));
    }
    if rest.starts_with(b"/*") {
        return Some(at + block_comment_length(rest));
    }
    if rest[0] == b'"' {
        return Some(at + quoted_length(rest, b'"'));
    }
    if !after_word && (rest.starts_with(b"r\"") || rest.starts_with(b"r#") || rest.starts_with(b"br")) {
        return raw_string_length(rest).map(|length| at + length);
    }
    if rest[0] == b'\'' {
        return character_length(rest).map(|length| at + length);
    }
    None
}

fn block_comment_length(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if rest[at..].starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    rest.len()
}

fn quoted_length(rest: &[u8], quote: u8) -> usize {
    let mut at = 1;
    while at < rest.len() {
        match rest[at] {
            b'\\' => at += 2,
            byte if byte == quote => return at + 1,
            _ => at += 1,
        }
    }
    rest.len()
}

/// `r"..."`, `r#"..."#`, `br"..."`; `None` for a raw identifier or a plain word.
fn raw_string_length(rest: &[u8]) -> Option<usize> {
    let start = if rest[0] == b'b' { 2 } else { 1 };
    let hashes = rest[start..].iter().take_while(|b| **b == b'#').count();
    if rest.get(start + hashes) != Some(&b'"') {
        return None;
    }
    let closing: Vec<u8> = std::iter::once(b'"').chain(std::iter::repeat_n(b'#', hashes)).collect();
    let body = start + hashes + 1;
    let inside = rest[body..].windows(closing.len()).position(|window| window == closing)?;
    Some(body + inside + closing.len())
}

/// `'x'`, `'\n'`, `'µ'`; `None` for a lifetime.
fn character_length(rest: &[u8]) -> Option<usize> {
    if rest.get(1) == Some(&b'\\') {
        return Some(quoted_length(rest, b'\''));
    }
    // One character of any length in UTF-8, then the closing quote.
    let length = rest[1..].iter().skip(1).take_while(|b| **b & 0xC0 == 0x80).count() + 1;
    (rest.get(1 + length) == Some(&b'\'')).then_some(length + 2)
}

/// A word, a number, a lifetime or a punctuation mark (`::` and `->` are one mark each).
#[derive(Clone, Copy, Debug)]
pub struct Token<'a> {
    pub text: &'a str,
    pub offset: usize,
}

impl Token<'_> {
    pub fn is_word(&self) -> bool {
        self.text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
    }
}

/// Tokens of code that has gone through [`code_only`].
pub fn tokens(code: &str) -> Vec<Token<'_>> {
    let bytes = code.as_bytes();
    let is_word = |b: &u8| b.is_ascii_alphanumeric() || *b == b'_' || *b >= 0x80;
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let rest = &bytes[at..];
        let length = match rest[0] {
            b if b.is_ascii_whitespace() => {
                at += 1;
                continue;
            }
            b'\'' => 1 + rest[1..].iter().take_while(|b| is_word(b)).count(),
            b if is_word(&b) => rest.iter().take_while(|b| is_word(b)).count(),
            b':' if rest.starts_with(b"::") => 2,
            b'-' if rest.starts_with(b"->") => 2,
            b'=' if rest.starts_with(b"=>") => 2,
            _ => 1,
        };
        found.push(Token { text: &code[at..at + length], offset: at });
        at += length;
    }
    found
}

/// Index of the bracket that closes the one at `open`; the last token if none does.
pub fn closing(tokens: &[Token<'_>], open: usize) -> usize {
    let (opens, closes) = match tokens[open].text {
        "{" => ("{", "}"),
        "(" => ("(", ")"),
        "[" => ("[", "]"),
        _ => ("<", ">"),
    };
    let mut depth = 0;
    for (i, token) in tokens.iter().enumerate().skip(open) {
        if token.text == opens {
            depth += 1;
        } else if token.text == closes {
            depth -= 1;
            if depth == 0 {
                return i;
            }
        }
    }
    tokens.len() - 1
}

/// Splits at the commas that stand in no bracket.
pub fn split_at_commas<'t, 'a>(tokens: &'t [Token<'a>]) -> Vec<&'t [Token<'a>]> {
    let mut parts = Vec::new();
    let (mut depth, mut start) = (0_i32, 0);
    for (i, token) in tokens.iter().enumerate() {
        match token.text {
            "(" | "[" | "{" | "<" => depth += 1,
            ")" | "]" | "}" | ">" => depth -= 1,
            "," if depth == 0 => {
                parts.push(&tokens[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&tokens[start..]);
    parts.retain(|part| !part.is_empty());
    parts
}
