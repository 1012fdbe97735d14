//! Training from outside: runs are stopped, resumed, refused and short of disk.

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

#[test]
fn a_resumed_run_ends_with_the_bits_of_one_never_stopped() {
    let (whole, cut) = (Folder::new(), Folder::new());
    assert!(whole.train(6, &[]).status.success());
    assert!(cut.train(3, &[]).status.success());
    let again = cut.train(6, &[]);
    assert_eq!(again.status.code(), Some(2));
    assert!(message(&again).contains("--resume"), "{}", message(&again));
    assert!(cut.train(6, &["--resume"]).status.success());
    // The order of a file's header is left open, so what is in the files is compared.
    let content = |folder: &Folder| Checkpoint::load(&newest(folder).0).unwrap();
    assert!(content(&whole) == content(&cut));
    assert!(fs::read(whole.file("policy.onnx")).unwrap() == fs::read(cut.file("policy.onnx")).unwrap());
    let rows = fs::read_to_string(cut.file("metrics.csv")).unwrap();
    assert_eq!(rows.lines().count(), 7);
}

#[test]
fn a_polite_kill_saves_and_a_hard_one_loses_nothing_saved() {
    let folder = Folder::new();
    for signal in ["-TERM", "-KILL"] {
        let started = Instant::now();
        let mut child = folder
            .command(&small(1_000_000))
            .arg("--resume")
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let before = rows(&folder);
        while rows(&folder) < before + 3 {
            assert!(started.elapsed() < Duration::from_secs(120), "no progress");
            std::thread::sleep(Duration::from_millis(20));
        }
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().success(), signal == "-TERM");
    }
    let resumed = folder.train(1, &["--resume"]);
    assert!(resumed.status.success(), "{}", message(&resumed));
}

/// Kills trainings with SIGKILL after random times, so also while a checkpoint is being written, and lets each go on to the
/// end of one never stopped.
fn kills_lose_nothing(kills: u32) {
    let iterations = 120;
    let whole = Folder::new();
    let started = Instant::now();
    assert!(whole.train(iterations, &[]).status.success());
    let took = started.elapsed();
    let expected = Checkpoint::load(&newest(&whole).0).unwrap();
    let policy = fs::read(whole.file("policy.onnx")).unwrap();
    let seed = std::env::var("GUIDEDOG_KILL_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let mut random = Philox::new(seed, 0, 0, 0, Purpose::Evaluation);
    let (mut done, mut hit, mut while_saving) = (0, 0, 0);
    while done < kills {
        let folder = Folder::new();
        // A run is killed up to three times on its way.
        for _ in 0..3.min(kills - done) {
            let mut command = folder.command(&small(iterations));
            let mut child =
                command.arg("--resume").stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
            std::thread::sleep(took.mul_f32(random.uniform(0.02, 0.6)));
            child.kill().unwrap();
            // One that had ended before is no kill, but must have ended well.
            let status = child.wait().unwrap();
            assert!(status.success() || status.code().is_none(), "{status}");
            hit += u32::from(status.code().is_none());
            let left = fs::read_dir(folder.file("checkpoints")).into_iter().flatten();
            let partial = |entry: &fs::DirEntry| entry.path().extension().is_some_and(|e| e == "tmp");
            while_saving += u32::from(left.filter_map(Result::ok).any(|entry| partial(&entry)));
            done += 1;
        }
        let resumed = folder.train(iterations, &["--resume"]);
        assert!(resumed.status.success(), "after {done} kills: {}", message(&resumed));
        assert!(Checkpoint::load(&newest(&folder).0).unwrap() == expected, "other bits after {done} kills");
        assert!(fs::read(folder.file("policy.onnx")).unwrap() == policy, "another policy");
        let table = fs::read_to_string(folder.file("metrics.csv")).unwrap();
        let numbers: Vec<u32> =
            table.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
        assert_eq!(numbers, (1..=iterations).collect::<Vec<_>>(), "a row lost or doubled");
        let left = fs::read_dir(folder.file("checkpoints")).unwrap().map(|entry| entry.unwrap().path());
        let partial: Vec<_> = left.filter(|path| path.extension().is_some_and(|e| e == "tmp")).collect();
        assert!(partial.is_empty(), "{partial:?}");
    }
    println!(
        "{done} kills, {hit} of running trainings, {while_saving} of them left something half-written behind"
    );
    assert!(hit * 2 > kills, "most kills came too late: {hit} of {kills}");
}

#[test]
fn kills_at_random_moments_lose_nothing() {
    kills_lose_nothing(4);
}

/// `cargo test --test training -- --ignored --nocapture fifty`
#[test]
#[ignore = "takes minutes"]
fn fifty_kills_at_random_moments_lose_nothing() {
    kills_lose_nothing(50);
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_by_name() {
    let folder = Folder::new();
    // A file where the run's folder should be refuses everyone, root included.
    fs::write(folder.0.path().join("runs"), "").unwrap();
    let output = folder.train(1, &[]);
    assert_eq!(output.status.code(), Some(1));
    let said = message(&output);
    assert!(said.contains("cannot create the run folder runs/small"), "{said}");
}

fn rows(folder: &Folder) -> usize {
    fs::read_to_string(folder.file("metrics.csv")).map_or(0, |text| text.lines().count())
}

#[test]
fn a_full_disk_is_an_error_and_the_checkpoint_before_stays() {
    let folder = Folder::new();
    assert!(folder.train(2, &[]).status.success());
    let (path, bytes) = newest(&folder);
    // No file may grow beyond a few kilobytes, as if the disk were full.
    let limited = "trap '' XFSZ; ulimit -f 16; exec \"$0\" \"$@\"";
    let mut command = Command::new("sh");
    command.current_dir(&folder.0).args(["-c", limited, env!("CARGO_BIN_EXE_guidedog")]);
    let output = command.args(small(9)).arg("--resume").output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", message(&output));
    assert!(message(&output).contains("cannot save"), "{}", message(&output));
    assert!((path.clone(), bytes) == newest(&folder), "the checkpoint before is not as it was");
    let left = fs::read_dir(path.parent().unwrap()).unwrap().map(|entry| entry.unwrap().path());
    let partial: Vec<_> = left.filter(|path| path.extension().is_some_and(|e| e == "tmp")).collect();
    assert!(partial.is_empty(), "{partial:?}");
    assert!(folder.train(3, &["--resume"]).status.success());
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

/// A small file system of its own, which goes with the last process in it: `script` runs there, in `/mnt`, with the program as `$0`.
/// `None`, saying why, where this user cannot mount one.
fn in_small_disk(script: &str) -> Option<Output> {
    let unshare = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-c", script, env!("CARGO_BIN_EXE_guidedog")]);
        command.output()
    };
    let mount = "mount -t tmpfs -o size=1m tmpfs /mnt && cd /mnt";
    if !unshare(mount).is_ok_and(|output| output.status.success()) {
        println!("skipped: `unshare --map-root-user --mount` cannot mount a tmpfs here");
        return None;
    }
    Some(unshare(&format!("{mount} || exit 9\n{script}")).unwrap())
}

/// The small training as words of a shell.
fn small_quoted(iterations: u32) -> String {
    small(iterations).iter().map(|word| format!("'{word}' ")).collect()
}

#[test]
fn a_disk_that_runs_full_or_is_only_for_reading_is_named_with_the_last_good_checkpoint() {
    let many = small_quoted(1_000_000);
    let script = format!(
        "said=$(\"$0\" {many} 2>&1); echo \"full: $?\"; echo \"$said\"
         ls runs/small/checkpoints runs/small
         said=$(\"$0\" {many} --resume 2>&1); echo \"still full: $?\"; echo \"$said\"
         mount -o remount,ro /mnt
         \"$0\" {many} --resume; echo \"read-only: $?\"
         mount -o remount,rw,size=8m /mnt
         \"$0\" {} --resume; echo \"again: $?\"",
        small_quoted(4)
    );
    let Some(output) = in_small_disk(&script) else { return };
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let all = format!("{printed}\n{}", message(&output));
    let (_, named) = all.split_once("the last good checkpoint is runs/small/checkpoints/").expect(&all);
    let named = &named[.."00000000.safetensors".len()];
    assert!(printed.lines().any(|line| line == named), "{named} is not there: {all}");
    assert!(all.contains("No space left on device") && all.contains("Read-only file system"), "{all}");
    for outcome in ["\nstill full: 1\n", "\nread-only: 1\n", "\nagain: 0\n"] {
        assert!(printed.contains(outcome), "{outcome:?}: {all}");
    }
    assert!(printed.starts_with("full: 1\n") && !printed.contains(".tmp"), "{all}");
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
fn a_bench_reaches_what_is_easy_reports_what_is_not_and_goes_on_after_a_kill() {
    let folder = Folder::new();
    let bench = |name: &str, more: &[&str]| {
        let mut arguments = vec!["bench", "learning", "--task", "flat", "--name", name];
        for setting in &small(1)[4..] {
            // Pairs of --set and a setting; the number of iterations is one of those, and counts for the first stage only.
            arguments.push(setting);
        }
        folder.command(&arguments).args(more).output().unwrap()
    };
    let easy = bench("easy", &["--seeds", "2", "--target", "0.01", "--interval", "0.2", "--limit", "1"]);
    let printed = String::from_utf8_lossy(&easy.stdout).into_owned();
    assert!(easy.status.success() && printed.contains("2 of 2"), "{printed}\n{}", message(&easy));
    let hard = ["--seeds", "1", "--target", "2", "--interval", "0.2", "--limit", "0.02", "--variant", "a"];
    let hard = [&hard[..], &["--variant", "b=ppo.epochs=2", "--json", "found.json"]].concat();
    // Killed on its way, it goes on: the time before is not forgotten.
    let mut child = folder
        .command(&["bench", "learning", "--task", "flat", "--name", "hard"])
        .args(&small(1)[4..])
        .args(&hard)
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let table = folder.0.path().join("runs/hard/flat-a-1/time_to_quality.csv");
    let rows = || fs::read_to_string(&table).map_or(0, |text| text.lines().count());
    let started = Instant::now();
    while rows() < 3 && started.elapsed() < Duration::from_secs(120) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = fs::read_to_string(&table).unwrap();
    let output = bench("hard", &hard);
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", message(&output));
    assert!(printed.contains("a        0 of 1") && printed.contains("b        0 of 1"), "{printed}");
    assert!(message(&output).contains("2.000 not reached in 0.0 min; best score 0."), "{}", message(&output));
    let kept = before.lines().take(2).collect::<Vec<_>>();
    assert!(fs::read_to_string(&table).unwrap().starts_with(&kept.join("\n")), "the first judgment is lost");
    let found: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.0.path().join("found.json")).unwrap()).unwrap();
    let trainings = found["trainings"].as_array().unwrap();
    assert_eq!(trainings.len(), 2);
    for training in trainings {
        assert_eq!(training["reached"], false);
        assert!(
            training["wall_min"].as_f64().unwrap() >= 0.02 && training["operations"].as_f64().unwrap() > 0.0
        );
    }
    let stages = ["1-level", "2-flat"].map(|stage| {
        let metrics = folder.0.path().join("runs/hard/flat-a-1").join(stage).join("metrics.csv");
        fs::read_to_string(metrics).unwrap().lines().count() - 1
    });
    assert!(stages[0] == 1 && stages[1] > 1, "{stages:?} iterations: the first stage ends, the last goes on");
    for file in ["learning.svg", "results.json", "flat-a-1/1-level/plots.svg", "flat-b-1/2-flat/policy.onnx"]
    {
        assert!(folder.0.path().join("runs/hard").join(file).is_file(), "{file}");
    }
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
