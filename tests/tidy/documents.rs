//! Rules about documents: a link between them leads to a file that is there, and the index of `docs/` leads to each.
//!
//! In: a [`Repository`]. Out: [`Fault`]s. Addresses on the web are not looked up: the tests need no network.

use super::scan::{Fault, Repository};

/// Links `[text](target)` and pictures `src="target"` of every Markdown file outside `src/` lead to a file or folder.
pub fn links(repository: &Repository) -> Vec<Fault> {
    let mut faults = Vec::new();
    for file in repository.files.iter().filter(|file| file.path.ends_with(".md")) {
        for (target, offset) in targets(&file.text) {
            let elsewhere = target.contains("://") || target.starts_with("mailto:") || target.starts_with('#');
            let place = target.split('#').next().unwrap_or_default();
            if elsewhere || place.is_empty() {
                continue;
            }
            let path = resolve(&file.path, place);
            let folder = format!("{path}/");
            let there = repository.paths.iter().any(|known| *known == path || known.starts_with(&folder));
            if !there {
                faults.push(file.fault(offset, "link", format!("`{target}` leads nowhere: there is no {path}")));
            }
        }
    }
    faults
}

/// `docs/README.md` links every document of `docs/`: one that no link leads to is not read.
pub fn index(repository: &Repository) -> Vec<Fault> {
    const INDEX: &str = "docs/README.md";
    let Some(index) = repository.file(INDEX) else { return Vec::new() };
    let linked: Vec<String> = targets(&index.text).iter().map(|(target, _)| resolve(INDEX, target)).collect();
    let documents = repository.files.iter().filter(|file| file.path.starts_with("docs/") && file.path.ends_with(".md"));
    documents
        .filter(|file| file.path != INDEX && !linked.contains(&file.path))
        .map(|file| file.fault(0, "index", format!("{INDEX} does not lead here")))
        .collect()
}

/// Link targets outside code blocks and `code`, with their places.
fn targets(text: &str) -> Vec<(&str, usize)> {
    let mut found = Vec::new();
    let (mut start, mut in_code) = (0, false);
    for line in text.split_inclusive('\n') {
        if line.trim_start().starts_with("```") {
            in_code = !in_code;
        } else if !in_code {
            for (opening, end) in [("](", ')'), ("src=\"", '"'), ("srcset=\"", '"'), ("href=\"", '"')] {
                for (at, _) in line.match_indices(opening) {
                    let inside = &line[at + opening.len()..];
                    let in_quotes = line[..at].matches('`').count() % 2 == 1;
                    if let Some(length) = inside.find(end)
                        && !in_quotes
                    {
                        found.push((inside[..length].trim(), start + at));
                    }
                }
            }
        }
        start += line.len();
    }
    found
}

/// Path from the root of what a document calls `target`.
fn resolve(document: &str, target: &str) -> String {
    let mut parts: Vec<&str> = document.split('/').collect();
    parts.pop();
    for part in target.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            name => parts.push(name),
        }
    }
    parts.join("/")
}
