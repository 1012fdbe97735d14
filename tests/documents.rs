//! What code, settings and documents cite of the documents is there: the file, and the heading by its name.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Files below a folder with one of these endings.
fn files(folder: &Path, endings: &[&str], found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, endings, found);
        } else if path.extension().is_some_and(|ending| endings.iter().any(|wanted| ending == *wanted)) {
            found.push(path);
        }
    }
}

fn all(folders: &[&str], endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    folders.iter().for_each(|folder| files(&root().join(folder), endings, &mut found));
    found
}

/// README and what else lies beside it.
fn root_documents() -> Vec<PathBuf> {
    let entries = fs::read_dir(root()).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect()
}

/// The text in one line, without the marks of comments.
fn flat(text: &str) -> String {
    let line = |line: &str| line.trim().trim_start_matches(['/', '!', '#']).trim().to_owned();
    text.lines().map(line).collect::<Vec<_>>().join(" ")
}

/// Documents of docs/ and headings that a text cites: `docs/a.md, "B"` or, as a link, `(a.md), "B" and "C"`.
fn citations(text: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    for (at, ending) in text.match_indices(".md") {
        let document = text[..at].rsplit(|c: char| !c.is_ascii_lowercase()).next().unwrap();
        let rest = &text[at + ending.len()..];
        let (mut rest, mut before) = (rest.strip_prefix(')').unwrap_or(rest), ", \"");
        while let Some((title, after)) = rest.strip_prefix(before).and_then(|rest| rest.split_once('"')) {
            found.push((document, title));
            (rest, before) = (after, " and \"");
        }
    }
    found
}

#[test]
fn every_heading_that_is_cited_exists() {
    let text = r#"see docs/a.md, "B" and [c.md](c.md), "D" and "E", or "F""#;
    assert_eq!(citations(text), [("a", "B"), ("c", "D"), ("c", "E")]);
    let mut cited = 0;
    let mut citing = all(&["crates", "src", "configs", "policies", "docs"], &["rs", "toml", "md"]);
    citing.extend(root_documents());
    for path in citing {
        let text = flat(&fs::read_to_string(&path).unwrap());
        for (document, title) in citations(&text) {
            let whole = fs::read_to_string(root().join(format!("docs/{document}.md"))).unwrap();
            let heading = |line: &str| line.starts_with('#') && line.trim_start_matches('#').trim() == title;
            assert!(whole.lines().any(heading), "{}: docs/{document}.md has no {title:?}", path.display());
            cited += 1;
        }
    }
    assert!(cited > 40, "{cited}");
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    let mut documents = all(&["docs", "policies", "benches", "scripts"], &["md"]);
    documents.extend(root_documents());
    let mut followed = 0;
    for path in documents {
        let text = fs::read_to_string(&path).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(link, _)| link) {
            let (file, _) = link.split_once('#').unwrap_or((link, ""));
            let is_path = !file.is_empty() && !file.contains("://") && !file.contains(' ');
            if is_path {
                let target = path.parent().unwrap().join(file);
                assert!(target.exists(), "{}: {link} leads nowhere", path.display());
                followed += 1;
            }
        }
    }
    assert!(followed > 30, "{followed}");
}
