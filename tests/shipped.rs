//! The shipped policies, through the program: judged as a user would, and read by a program.

use std::process::Command;

fn results(arguments: &[&str]) -> serde_json::Value {
    let file = std::env::temp_dir().join(format!(
        "guidedog-shipped-{}-{}.json",
        arguments.len(),
        std::process::id()
    ));
    let output = Command::new(env!("CARGO_BIN_EXE_guidedog"))
        .args(["evaluate", "--episodes", "16", "--json", file.to_str().unwrap()])
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::remove_file(file).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// What is promised of the shipped pair (`docs/results.md`), with room for sixteen episodes' chance.
#[test]
fn the_shipped_pair_understands_pulls_of_every_kind() {
    let results = results(&[]);
    assert!(results["reward"]["total"].as_f64().unwrap() >= 0.92, "{}", results["reward"]);
    let cases = results["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 17);
    for (group, least) in [("trained", 0.98), ("edge", 0.98), ("outside", 0.95)] {
        let rates = cases.iter().filter(|case| case["group"] == group);
        let rates: Vec<f64> = rates.map(|case| case["success_rate"].as_f64().unwrap()).collect();
        let mean = rates.iter().sum::<f64>() / rates.len() as f64;
        assert!(mean >= least, "{group}: {rates:?}");
    }
}

#[test]
fn sensors_that_err_as_in_training_make_another_walk_that_still_obeys() {
    let walk = |noise: &[&str]| results(&[&["--case", "-20/10"], noise].concat())["cases"][0].clone();
    let (perfect, noisy) = (walk(&[]), walk(&["--sensor-noise", "1"]));
    assert_ne!(perfect["mean_vx"], noisy["mean_vx"]);
    assert!(noisy["success_rate"].as_f64().unwrap() > 0.9, "{noisy}");
}

#[test]
fn the_keys_of_the_contract_are_there() {
    let results = results(&["--supervisor", "dominance", "--suite", "mirror17", "--randomize"]);
    for key in [
        "suite",
        "ground",
        "level",
        "randomize",
        "episodes",
        "seed",
        "locomotion",
        "supervisor",
        "oracle_reward",
    ] {
        assert!(!results[key].is_null(), "{key}");
    }
    let case = &results["cases"][0];
    for key in [
        "name",
        "fx",
        "fy",
        "group",
        "behavior",
        "episodes",
        "successes",
        "falls",
        "success_rate",
        "wilson_low",
        "wilson_high",
        "mean_vx",
        "mean_vy",
        "mean_wz",
        "heading_drift_deg_per_10s",
    ] {
        assert!(!case[key].is_null(), "{key}");
    }
    assert_eq!(results["supervisor"], "dominance");
}
