//! What the built page was made from: a fingerprint of every source file and every built file.
//!
//! A test compares it with the files as they are, so a page that is older than its sources is noticed without building
//! it. The fingerprint notices forgetting, not forging.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result, bail};

/// Where the built page is.
pub const DIST: &str = "apps/web/dist";
/// The manifest's own name in it.
pub const NAME: &str = "manifest.txt";

/// Files and folders the page is built from, and the built page. `Cargo.lock`, `Cargo.toml` of the workspace and those of the crates in
/// `crates/` are not among them, though versions and profiles in them reach the page: most of their changes do not, and each would ask
/// for a new build. Whoever changes one that does builds the page too; the tests of the built module (`apps/web/tests`) compare it with
/// the native code.
const SOURCES: [&str; 19] = [
    "apps/web/.npmrc",
    "apps/web/Cargo.toml",
    "apps/web/build.mjs",
    "apps/web/package-lock.json",
    "apps/web/package.json",
    "apps/web/page",
    "apps/web/src",
    "apps/web/tsconfig.json",
    "assets/anymal_d.urdf",
    "crates/physics/src",
    "crates/policy/src",
    "crates/robot/src",
    "crates/spatial/src",
    "crates/tasks/src",
    "crates/terrain/src",
    "policies/locomotion.onnx",
    "policies/supervisor.onnx",
    "xtask/src/web.rs",
    DIST,
];

/// Path from the root of the repository to fingerprint.
pub type Fingerprints = BTreeMap<String, String>;

/// Fingerprints of all sources and built files as they are.
///
/// # Errors
/// A file cannot be read.
pub fn compute(root: &Path) -> Result<Fingerprints> {
    let mut found = Fingerprints::new();
    for source in SOURCES {
        collect(root, source, &mut found)?;
    }
    found.remove(&format!("{DIST}/{NAME}"));
    Ok(found)
}

fn collect(root: &Path, name: &str, found: &mut Fingerprints) -> Result<()> {
    let path = root.join(name);
    if path.is_dir() {
        for entry in fs::read_dir(&path).with_context(|| name.to_owned())? {
            let file = entry?.file_name();
            collect(root, &format!("{name}/{}", file.to_string_lossy()), found)?;
        }
    } else {
        let bytes = fs::read(&path).with_context(|| name.to_owned())?;
        found.insert(name.to_owned(), format!("{:016x}", fnv1a(&bytes)));
    }
    Ok(())
}

/// FNV-1a, 64 bits (Fowler, Noll, Vo).
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// The manifest as text: a line a file.
pub fn to_text(fingerprints: &Fingerprints) -> String {
    fingerprints.iter().map(|(path, print)| format!("{print} {path}\n")).collect()
}

/// Reads what [`to_text`] wrote.
///
/// # Errors
/// A line that is none.
pub fn from_text(text: &str) -> Result<Fingerprints> {
    let line = |line: &str| match line.split_once(' ') {
        Some((print, path)) => Ok((path.to_owned(), print.to_owned())),
        None => bail!("`{line}` is no fingerprint and path"),
    };
    text.lines().map(line).collect()
}

/// Names of the files in which two manifests differ.
pub fn differences<'a>(a: &'a Fingerprints, b: &'a Fingerprints) -> Vec<&'a str> {
    let mut names: Vec<&str> =
        a.keys().chain(b.keys()).filter(|name| a.get(*name) != b.get(*name)).map(String::as_str).collect();
    names.sort_unstable();
    names.dedup();
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fingerprints_are_the_published_ones() {
        // Test vectors of the authors (fnv64a).
        assert_eq!(fnv1a(b""), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn what_is_written_is_read_and_what_differs_is_named() {
        let one: Fingerprints = [("a".to_owned(), "1".to_owned()), ("b c".to_owned(), "2".to_owned())].into();
        assert_eq!(from_text(&to_text(&one)).unwrap(), one);
        let mut other = one.clone();
        other.insert("b c".into(), "3".into());
        other.insert("d".into(), "4".into());
        assert_eq!(differences(&one, &other), ["b c", "d"]);
        assert!(from_text("nonsense").is_err());
    }
}
