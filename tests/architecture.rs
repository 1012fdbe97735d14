//! The arrows between crates are those of ARCHITECTURE.md, and no others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Crate and the workspace crates it uses or may use, by short name.
type Arrows = BTreeMap<String, BTreeSet<String>>;

fn short_name(package: &str) -> String {
    package.strip_prefix("guidedog-").unwrap_or(package).to_owned()
}

/// The rows of the table headed "crate | what it is | may use".
fn allowed_arrows() -> Arrows {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    text.lines()
        .skip_while(|line| !line.starts_with("| crate |"))
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
            let uses = cells[2].split(',').map(str::trim).filter(|name| *name != "–").map(str::to_owned);
            (cells[0].trim_matches('`').to_owned(), uses.collect())
        })
        .collect()
}

/// What the manifests say; dependencies of tests alone are left out.
fn actual_arrows() -> Arrows {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--no-deps", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo metadata");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let name = |value: &serde_json::Value| value["name"].as_str().expect("name").to_owned();
    let members: BTreeSet<String> = packages.iter().map(name).collect();
    packages
        .iter()
        .map(|package| {
            let dependencies = package["dependencies"].as_array().expect("dependencies");
            let uses = dependencies.iter().filter(|d| d["kind"] != "dev").map(name);
            let inside = uses.filter(|used| members.contains(used)).map(|used| short_name(&used));
            (short_name(&name(package)), inside.collect())
        })
        .collect()
}

#[test]
fn crates_use_only_what_the_table_allows() {
    let (allowed, actual) = (allowed_arrows(), actual_arrows());
    assert!(allowed.len() >= 9, "the table was not found: {allowed:?}");
    for (name, uses) in &actual {
        let allowed = allowed.get(name).unwrap_or_else(|| panic!("{name} is not in ARCHITECTURE.md"));
        let extra: Vec<_> = uses.difference(allowed).collect();
        assert!(extra.is_empty(), "{name} uses {extra:?}; ARCHITECTURE.md allows {allowed:?}");
    }
    for name in allowed.keys() {
        assert!(actual.contains_key(name), "ARCHITECTURE.md lists {name}, which is no crate");
    }
}

#[test]
fn the_two_borders_hold() {
    let actual = actual_arrows();
    for stranger in ["ppo", "policy", "tasks"] {
        assert!(!actual["physics"].contains(stranger), "physics knows {stranger}");
    }
    for stranger in ["physics", "robot", "terrain", "tasks"] {
        assert!(!actual["ppo"].contains(stranger), "PPO knows {stranger}");
    }
}
