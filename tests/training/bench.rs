//! Runs of `bench learning`.

use super::*;

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
    // What has ended is not taken for what other settings would find.
    let other = bench("easy", &["--seeds", "2", "--target", "0.01", "--set", "ppo.epochs=2"]);
    assert_eq!(other.status.code(), Some(2), "{}", message(&other));
    assert!(message(&other).contains("it was begun with ppo.epochs = "), "{}", message(&other));
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
