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

/// The text in one line, without the marks of comments.
fn flat(text: &str) -> String {
    let line = |line: &str| line.trim().trim_start_matches(['/', '!', '#']).trim().to_owned();
    text.lines().map(line).collect::<Vec<_>>().join(" ")
}

#[test]
fn every_heading_that_is_cited_exists() {
    let mut cited = 0;
    for path in all(&["crates", "src", "configs", "policies", "docs"], &["rs", "toml", "md"]) {
        let text = flat(&fs::read_to_string(&path).unwrap());
        for citation in text.split("docs/").skip(1) {
            let Some((document, rest)) = citation.split_once(".md, \"") else { continue };
            if !document.chars().all(|c| c.is_ascii_lowercase()) {
                continue;
            }
            let (title, _) = rest.split_once('"').unwrap();
            let whole = fs::read_to_string(root().join(format!("docs/{document}.md"))).unwrap();
            let heading = |line: &str| line.starts_with('#') && line.trim_start_matches('#').trim() == title;
            assert!(whole.lines().any(heading), "{}: docs/{document}.md has no {title:?}", path.display());
            cited += 1;
        }
    }
    assert!(cited > 20, "{cited}");
}

#[test]
fn every_link_between_documents_leads_somewhere() {
    let mut documents = all(&["docs", "policies", "benches", "scripts"], &["md"]);
    documents
        .extend(["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md"].map(|n| root().join(n)));
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
