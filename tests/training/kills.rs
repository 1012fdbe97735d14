//! Runs that are stopped, killed and resumed.

use super::*;

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
fn a_run_that_begins_with_a_policy_does_so_too_if_it_is_killed_before_its_first_checkpoint() {
    let folder = Folder::new();
    assert!(folder.train(1, &[]).status.success());
    fs::rename(folder.file(""), folder.0.path().join("policy")).unwrap();
    assert!(folder.train(1, &["--init-from", "policy/policy.onnx"]).status.success());
    let (path, _) = newest(&folder);
    let expected = Checkpoint::load(&path).unwrap();
    fs::remove_file(&path).unwrap();
    assert!(folder.train(1, &["--resume"]).status.success());
    assert!(Checkpoint::load(&path).unwrap() == expected, "other bits");
    // Killed even before it kept what it began with, it says with what to begin again.
    fs::remove_dir_all(folder.file("checkpoints")).unwrap();
    let lost = folder.train(1, &["--resume"]);
    assert_eq!(lost.status.code(), Some(2));
    assert!(message(&lost).contains("--init-from policy/policy.onnx"), "{}", message(&lost));
}

fn rows(folder: &Folder) -> usize {
    fs::read_to_string(folder.file("metrics.csv")).map_or(0, |text| text.lines().count())
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
            while_saving += u32::from(!half_written(&folder).is_empty());
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
        assert_eq!(half_written(&folder), Vec::<PathBuf>::new());
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
