//! Pictures without a window, and files for another engine, from the command line.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn guidedog(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_guidedog")).args(arguments).output().expect("the program starts")
}

fn refusal(arguments: &[&str]) -> String {
    let output = guidedog(arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder of this test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("guidedog-pictures-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn file(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).ok();
    }
}

fn bytes(path: &str) -> Vec<u8> {
    std::fs::read(Path::new(path)).unwrap()
}

#[test]
fn a_film_and_a_figure_over_time_are_written_and_odd_pulls_refused() {
    let folder = Folder::new("episode");
    let (film, series) = (folder.file("stop.gif"), folder.file("tug.svg"));
    let picture = |what: &str, rest: &[&str]| guidedog(&[&["picture", what][..], rest].concat());
    assert!(picture("film", &["--case=-60/0", "--seconds", "0.4", "--out", &film]).status.success());
    assert!(bytes(&film).starts_with(b"GIF89a"));
    let tug = ["--suite", "dynamic", "--case", "tug 0/60, 0.5 s", "--out", &series];
    assert!(picture("series", &tug).status.success());
    let text = String::from_utf8(bytes(&series)).unwrap();
    assert!(text.starts_with("<svg") && text.contains("tug 0/60, 0.5 s"));
    assert!(refusal(&["picture", "film", "--case", "hard", "--out", &film]).contains("--case hard"));
    assert!(refusal(&["picture", "film", "--case", "0/1000", "--out", &film]).contains("500 N"));
    let no_run = refusal(&["picture", "curves", &folder.file(""), "--out", &series]);
    assert!(no_run.contains("metrics.csv"), "{no_run}");
}

#[test]
fn a_plan_is_written_and_is_not_itself_a_record() {
    let folder = Folder::new("plan");
    let plan = folder.file("edges.plan");
    assert!(guidedog(&["evaluate", "--suite", "edges", "--episodes", "1", "--plan", &plan]).status.success());
    let message = refusal(&["evaluate", "--recorded", &plan]);
    assert!(message.contains("edges.plan") && message.contains("`samples`"), "{message}");
}
