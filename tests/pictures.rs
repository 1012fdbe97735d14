//! Pictures without a window, and files for another engine, from the command line.

use std::path::Path;
use std::process::{Command, Output};

use tempfile::TempDir;

fn guidedog(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guidedog")).args(arguments).output().expect("the program starts")
}

fn refusal(arguments: &[&str]) -> String {
    let output = guidedog(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn file(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).display().to_string()
}

fn bytes(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(path)).unwrap()
}

#[test]
fn films_and_figures_are_written_and_odd_pulls_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (film, series) = (file(&folder, "stop.gif"), file(&folder, "tug.svg"));
    let picture = |what: &str, rest: &[&str]| guidedog(&[&["picture", what][..], rest].concat());
    assert!(picture("film", &["--case=-60/0", "--seconds", "0.4", "--out", &film]).status.success());
    assert!(bytes(&film).starts_with(b"GIF89a"));
    let tug = ["--suite", "dynamic", "--case", "tug 0/60, 0.5 s", "--out", &series];
    assert!(picture("series", &tug).status.success());
    let text = String::from_utf8(bytes(&series)).unwrap();
    assert!(text.starts_with("<svg") && text.contains("tug 0/60, 0.5 s"));
    let paths = file(&folder, "paths.svg");
    assert!(picture("paths", &["--suite", "edges", "--out", &paths]).status.success());
    let text = String::from_utf8(bytes(&paths)).unwrap();
    assert!(text.starts_with("<svg") && text.contains("-40/20 noisy"));
    assert!(refusal(&["picture", "paths", "--suite", "none", "--out", &paths]).contains("--suite none"));
    assert!(refusal(&["picture", "film", "--case", "hard", "--out", &film]).contains("--case hard"));
    assert!(refusal(&["picture", "film", "--case", "0/1000", "--out", &film]).contains("500 N"));
    let no_run = refusal(&["picture", "curves", &file(&folder, ""), "--out", &series]);
    assert!(no_run.contains("metrics.csv"), "{no_run}");
}

#[test]
fn a_plan_is_written_and_is_not_itself_a_record() {
    let folder = tempfile::tempdir().unwrap();
    let plan = file(&folder, "edges.plan");
    assert!(guidedog(&["evaluate", "--suite", "edges", "--episodes", "1", "--plan", &plan]).status.success());
    let message = refusal(&["evaluate", "--recorded", &plan]);
    assert!(message.contains("edges.plan") && message.contains("`samples`"), "{message}");
}
