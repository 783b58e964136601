//! `sollwert explain`: the page behind a code such as `E0104`.
//!
//! In: a code. Out: its page of `docs/errors/`, which is inside the binary. Renders nothing: a page is plain text on GitHub and here.

use super::failure::Failure;
use super::output::{print, print_json};
use crate::base::Diagnostic;
use crate::base::diagnostics::nearest;
use clap::Args;
use serde_json::json;

#[derive(Args)]
#[command(after_help = "Example:\n  sollwert explain E0104")]
pub(super) struct ExplainArguments {
    /// Code of a finding, such as E0104; without it, all codes with their titles
    code: Option<String>,
    /// One JSON document on stdout
    #[arg(long)]
    pub(super) json: bool,
}

const PAGES: [&str; 2] = [include_str!("../../docs/errors/program.md"), include_str!("../../docs/errors/other.md")];

/// What stands behind one code.
struct Page {
    code: &'static str,
    title: &'static str,
    text: &'static str,
}

pub(super) fn explain(arguments: &ExplainArguments) -> Result<(), Failure> {
    let Some(code) = &arguments.code else { return list(arguments.json) };
    let wanted = code.trim().to_ascii_uppercase();
    let Some(page) = pages().find(|page| page.code == wanted) else { return Err(unknown(&wanted)) };
    if arguments.json {
        return print_json(&json!({"format": 1, "code": page.code, "title": page.title, "text": page.text}));
    }
    let below = if page.text.is_empty() { String::new() } else { format!("\n{}\n", page.text) };
    print(&format!("{}: {}\n{below}", page.code, page.title))
}

/// All codes, in order of the pages.
fn list(json: bool) -> Result<(), Failure> {
    if json {
        let codes: Vec<_> = pages().map(|page| json!({"code": page.code, "title": page.title})).collect();
        return print_json(&json!({"format": 1, "codes": codes}));
    }
    print(&pages().fold(String::new(), |text, page| text + page.code + "  " + page.title + "\n"))
}

/// A page is what stands below `## CODE: title`, up to the next one.
fn pages() -> impl Iterator<Item = Page> {
    PAGES.iter().flat_map(|file| file.split("\n## ").skip(1)).filter_map(|section| {
        let (heading, text) = section.split_once('\n').unwrap_or((section, ""));
        let (code, title) = heading.split_once(": ")?;
        Some(Page { code, title: title.trim(), text: text.trim() })
    })
}

fn unknown(code: &str) -> Failure {
    let finding = Diagnostic::error("C0005", format!("there is no code `{code}`"));
    Failure::unreadable(match nearest(code, pages().map(|page| page.code)) {
        Some(near) => finding.help(format!("did you mean `{near}`? `sollwert explain` lists all")),
        None => finding.help("`sollwert explain` lists all codes"),
    })
}
