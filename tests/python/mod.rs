//! Python for the cross-checks: the interpreter of the environment variable `PYTHON`, else `python3`.

use std::process::Command;

/// A call of the interpreter.
pub(crate) fn python() -> Command {
    Command::new(std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into()))
}

/// Whether Python has these packages; says that the test is skipped where it has not.
pub(crate) fn has_packages(packages: &str) -> bool {
    let imported = python().args(["-c", &format!("import {packages}")]).output();
    let at_hand = imported.is_ok_and(|output| output.status.success());
    if !at_hand {
        println!("skipped: python3 with {packages} is not at hand");
    }
    at_hand
}
