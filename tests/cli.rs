//! The program from outside: what it prints, and how it refuses what it cannot use.

use std::process::{Command, Output};

fn guidedog(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guidedog")).args(arguments).output().expect("the program starts")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Bad input ends with code 2, nothing on stdout, and a message that has all of `parts`.
fn refuses(arguments: &[&str], parts: &[&str]) {
    let output = guidedog(arguments);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
    assert!(output.stdout.is_empty(), "{arguments:?}: {}", stdout(&output));
    for part in parts {
        assert!(message.contains(part), "{arguments:?}: {part:?} is not in {message:?}");
    }
}

#[test]
fn help_and_version_work_everywhere() {
    for verb in [&["--help"][..], &["inspect", "--help"], &["inspect", "robot", "--help"]] {
        let output = guidedog(verb);
        assert!(output.status.success() && stdout(&output).contains("Usage:"), "{verb:?}");
    }
    assert!(stdout(&guidedog(&["--version"])).starts_with("guidedog "));
}

#[test]
fn unknown_verbs_and_flags_are_refused_by_name() {
    refuses(&["dance"], &["dance"]);
    refuses(&["inspect", "robot", "--colour"], &["--colour"]);
}

#[test]
fn the_built_in_robot_is_shown_with_its_harness() {
    let text = stdout(&guidedog(&["inspect", "robot"]));
    assert!(text.starts_with("anymal_d: 53.5"), "{text}");
    let json: serde_json::Value =
        serde_json::from_slice(&guidedog(&["inspect", "robot", "--json"]).stdout).unwrap();
    let names: Vec<_> =
        json["joints"].as_array().unwrap().iter().map(|j| j["name"].as_str().unwrap()).collect();
    assert_eq!(names.len(), 12);
    assert_eq!(names[..5], ["LF_HAA", "LH_HAA", "RF_HAA", "RH_HAA", "LF_HFE"]);
}

#[test]
fn a_robot_file_that_is_missing_or_no_urdf_is_refused_with_its_name() {
    refuses(&["inspect", "robot", "no/such.urdf"], &["no/such.urdf", "No such file"]);
    refuses(&["inspect", "robot", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")], &["Cargo.toml"]);
}
