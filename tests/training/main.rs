//! Training from outside: runs are watched, stopped, resumed, refused and short of disk.

mod bench;
mod disks;
mod kills;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use guidedog::policy::Checkpoint;
use guidedog::spatial::{Philox, Purpose};
use tempfile::TempDir;

/// A folder that goes with the test; runs are made in it.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
        command.current_dir(&self.0).args(arguments);
        command
    }

    /// A small training of `iterations` iterations.
    fn train(&self, iterations: u32, more: &[&str]) -> Output {
        self.command(&small(iterations)).args(more).output().unwrap()
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join("runs/small").join(name)
    }
}

fn small(iterations: u32) -> Vec<&'static str> {
    let iterations = format!("training.iterations={iterations}").leak();
    let mut arguments = vec!["train", "locomotion", "--name", "small"];
    for setting in [
        &*iterations,
        "training.num_envs=16",
        "training.checkpoint_period_s=0.000001",
        "task.terrain=flat",
        "ppo.actor_hidden=[8]",
        "ppo.critic_hidden=[8]",
    ] {
        arguments.extend(["--set", setting]);
    }
    arguments
}

fn message(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn newest(folder: &Folder) -> (PathBuf, Vec<u8>) {
    let checkpoints = fs::read_dir(folder.file("checkpoints")).unwrap();
    let numbered = checkpoints
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.file_stem().unwrap().to_str().unwrap().parse::<u64>().is_ok());
    let path = numbered.max().expect("a checkpoint");
    let bytes = fs::read(&path).unwrap();
    (path, bytes)
}

/// Checkpoints of the run that were not written to their end.
fn half_written(folder: &Folder) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder.file("checkpoints")).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths.filter(|path| path.extension().is_some_and(|extension| extension == "tmp")).collect()
}

#[test]
fn a_terminal_shows_progress_and_scores_in_place_and_a_log_is_quiet() {
    let folder = Folder::new();
    let logged = folder.train(20, &[]);
    let said = message(&logged);
    assert!(logged.status.success() && !said.contains('\u{1b}'), "{said}");
    assert!(said.lines().count() <= 2 && said.contains("iteration 20/20"), "{said}");
    let last = String::from_utf8_lossy(&logged.stdout).into_owned();
    assert!(last.contains("plots: runs/small/plots.svg") && folder.file("plots.svg").is_file(), "{last}");
    let words: String = small_quoted(60);
    let inside = format!("stty cols 90 rows 30; '{}' {words} --resume", env!("CARGO_BIN_EXE_guidedog"));
    let mut command = Command::new("script");
    command.current_dir(&folder.0).args(["--quiet", "--return", "--command", &inside, "/dev/null"]);
    let Ok(shown) = command.stdin(Stdio::null()).output() else {
        println!("skipped: there is no `script` to make a terminal with");
        return;
    };
    let text = String::from_utf8_lossy(&shown.stdout).into_owned();
    assert!(shown.status.success(), "{text}");
    // Two lines up, and each cleared: drawn again in place.
    assert!(text.contains("\u{1b}[2A\r\u{1b}[2K"), "{text:?}");
    for word in ["60/60", "steps/s", "tracking_linear", "tracking_yaw", "terrain_level", "falls_per_1000"] {
        assert!(text.contains(word), "{word} is not in {text:?}");
    }
}

/// The small training as words of a shell.
fn small_quoted(iterations: u32) -> String {
    small(iterations).iter().map(|word| format!("'{word}' ")).collect()
}

#[test]
fn a_loss_that_is_no_number_stops_the_run_and_names_the_last_good_checkpoint() {
    let folder = Folder::new();
    assert!(folder.train(2, &[]).status.success());
    let (path, _) = newest(&folder);
    let mut checkpoint = Checkpoint::load(&path).unwrap();
    // The critic's last weights, so large that the square of an error is beyond all numbers.
    let parameters = &mut checkpoint.tensors.get_mut("parameters").unwrap().1;
    let end = parameters.len() - 12;
    parameters[end - 9..end].fill(1e30);
    checkpoint.save(&path).unwrap();
    let output = folder.train(9, &["--resume"]);
    let said = message(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let expected = "the last good checkpoint is runs/small/checkpoints/00000002.safetensors";
    assert!(said.contains(expected) && said.contains("is not finite"), "{said}");
    assert_eq!(newest(&folder).0, path, "what broke was saved");
}

#[test]
fn a_run_of_another_version_and_a_damaged_one_are_refused_with_the_reason() {
    let folder = Folder::new();
    assert!(folder.train(1, &[]).status.success());
    let (path, bytes) = newest(&folder);
    let at = bytes.windows(25).position(|w| w == br#""guidedog_checkpoint":"1""#).unwrap();
    let mut other = bytes.clone();
    other[at + 23] = b'7';
    fs::write(&path, other).unwrap();
    let refused = folder.train(2, &["--resume"]);
    assert!(!refused.status.success());
    assert!(message(&refused).contains("checkpoint version is `7`, must be `1`"), "{}", message(&refused));
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let refused = folder.train(2, &["--resume"]);
    assert!(!refused.status.success());
    assert!(message(&refused).contains("not a whole checkpoint"), "{}", message(&refused));
    fs::write(&path, &bytes).unwrap();
    assert!(folder.train(2, &["--resume"]).status.success());
}

#[test]
fn a_run_begins_with_the_policy_of_a_file_and_refuses_one_that_does_not_fit() {
    let folder = Folder::new();
    assert!(folder.train(1, &[]).status.success());
    let policy = folder.file("policy.onnx");
    let from = |extra: &[&str], name: &str| {
        let mut arguments = small(1);
        arguments[3] = name.to_owned().leak();
        let mut command = folder.command(&arguments);
        command.args(["--init-from", policy.to_str().unwrap()]).args(extra).output().unwrap()
    };
    assert!(from(&[], "second").status.success());
    let refused = from(&["--set", "ppo.actor_hidden=[9]"], "third");
    assert_eq!(refused.status.code(), Some(2));
    assert!(message(&refused).contains("layer 0 is 235 to 8, must be 235 to 9"), "{}", message(&refused));
}

#[test]
fn settings_that_cannot_be_are_refused_by_name() {
    let folder = Folder::new();
    let table = [
        ("ppo.gama=0.9", r#"unknown key "ppo.gama"; the nearest known key is "ppo.gamma""#),
        ("ppo.gamma=1.5", "gamma is 1.5, must be in (0, 1]"),
        ("training.num_envs=17", "num_envs is 17, must be a multiple of 16"),
        ("task.command.standing_share=2", "standing_share is 2, must be from 0 to 1"),
        ("task.command.standing_share=0.9", "shares of commands add up to"),
        ("task.terrain=moon", "moon"),
    ];
    for (setting, expected) in table {
        let output = folder.train(1, &["--set", setting]);
        assert_eq!(output.status.code(), Some(2), "{setting}: {}", message(&output));
        assert!(message(&output).contains(expected), "{setting}: {}", message(&output));
    }
    assert!(!Path::new(&folder.file("checkpoints/00000001.safetensors")).exists());
}
