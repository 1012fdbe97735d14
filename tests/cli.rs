//! The program from outside: what it prints, and how it refuses what it cannot use.

use std::io::Write as _;
use std::process::{Command, Output};

use guidedog::policy::{Activation, Linear, Mlp, write_onnx};
use tempfile::NamedTempFile;

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
    let verbs = [
        &["--help"][..],
        &["reproduce", "--help"],
        &["evaluate", "--help"],
        &["play", "--help"],
        &["picture", "--help"],
        &["picture", "film", "--help"],
        &["picture", "series", "--help"],
        &["picture", "paths", "--help"],
        &["picture", "curves", "--help"],
        &["inspect", "--help"],
        &["inspect", "robot", "--help"],
        &["inspect", "policy", "--help"],
        &["inspect", "dynamics", "--help"],
        &["bench", "--help"],
        &["bench", "learning", "--help"],
        &["config", "--help"],
        &["config", "locomotion", "--help"],
        &["config", "supervisor", "--help"],
    ];
    for verb in verbs {
        let output = guidedog(verb);
        assert!(output.status.success() && stdout(&output).contains("Usage:"), "{verb:?}");
    }
    assert!(stdout(&guidedog(&["--version"])).starts_with("guidedog "));
}

#[test]
fn a_reader_that_has_gone_is_no_error() {
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
    let output = command.args(["inspect", "robot"]).stdout(writer).output().expect("the program starts");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && message.is_empty(), "{message}");
    let (reader, writer) = std::io::pipe().expect("a pipe");
    drop(reader);
    let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
    let status =
        command.args(["inspect", "policy", "none.onnx"]).stderr(writer).status().expect("the program starts");
    assert_eq!(status.code(), Some(2), "what cannot be told is no panic");
}

#[test]
fn the_help_of_training_teaches() {
    for verb in
        [&["train", "--help"][..], &["train", "locomotion", "--help"], &["train", "supervisor", "--help"]]
    {
        let text = stdout(&guidedog(verb));
        for word in
            ["tracking_linear", "falls_per_1000", "kl", "--resume", "tensorboard", "--explain", "plots.svg"]
        {
            assert!(text.contains(word), "{verb:?}: {word}");
        }
    }
}

#[test]
fn a_bench_refuses_what_it_cannot_use_by_name() {
    refuses(&["bench", "learning", "--task", "dance"], &["dance", "flat", "rough", "supervisor"]);
    refuses(&["bench", "learning", "--task", "flat", "--variant", "a=ppo.gama=1"], &["flat a", "ppo.gamma"]);
    refuses(&["bench", "learning", "--limit=0"], &["--limit 0", "above 0"]);
    refuses(&["bench", "learning", "--target=nan"], &["--target NaN", "above 0"]);
    refuses(&["bench", "learning", "--variant", "=x"], &["--variant =x", "NAME=key=value"]);
    refuses(&["bench", "learning", "--variant", "a", "--variant", "a=x=1"], &["--variant a=x=1", "two"]);
}

#[test]
fn a_reproduction_refuses_what_it_cannot_use_before_it_trains() {
    let folder = tempfile::tempdir().unwrap();
    let reproduce = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
        command.current_dir(&folder).arg("reproduce").args(arguments).output().unwrap()
    };
    let wrong = reproduce(&["--from-scratch", "--set", "ppo.gama=0.9"]);
    let message = String::from_utf8_lossy(&wrong.stderr);
    assert!(wrong.status.code() == Some(2) && message.contains("ppo.gamma"), "{message}");
    assert!(!folder.path().join("runs").exists(), "something was begun");
    // Nothing is trained there that a setting could be for.
    let idle = ["reproduce", "--everything", "--only", "pictures", "--set", "ppo.gamma=0.9"];
    refuses(&idle, &["--only", "--set"]);
    refuses(&["reproduce", "--ground", "rough"], &["--from-scratch"]);
    refuses(
        &["reproduce", "--everything", "--only", "pictures", "--name", "../elsewhere"],
        &["../elsewhere"],
    );
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

/// A file that goes with the test.
struct TestFile(NamedTempFile);

impl TestFile {
    fn new(bytes: &[u8]) -> Self {
        let mut file = NamedTempFile::new().unwrap();
        file.write_all(bytes).unwrap();
        Self(file)
    }

    fn path(&self) -> &str {
        self.0.path().to_str().unwrap()
    }
}

/// A supervisor of 226 · 8 + 8 + 8 · 3 + 3 = 1843 parameters, the last command limited on one side only.
fn supervisor() -> Vec<u8> {
    let layer = |inputs: usize, outputs: usize| Linear {
        inputs,
        outputs,
        weight: vec![0.1; inputs * outputs],
        bias: vec![0.0; outputs],
    };
    let mlp = Mlp {
        layers: vec![layer(226, 8), layer(8, 3)],
        activation: Activation::Tanh,
        output_limits: Some((vec![-0.3, -0.4, f32::NEG_INFINITY], vec![1.2, 0.4, 1.5])),
    };
    let entries = [("command_high", "1.2,0.4,1.5"), ("remark", "two\nlines, \u{1b}[31mω")];
    write_onnx(&mlp, &entries.map(|(key, value)| (key.to_owned(), value.to_owned())))
}

#[test]
fn a_policy_is_shown_with_its_limits_and_metadata() {
    let file = TestFile::new(&supervisor());
    let text = stdout(&guidedog(&["inspect", "policy", file.path()]));
    let lines = [
        &format!("{}: 1843 parameters", file.path()),
        "inputs: 226 (as many as a supervisor observation has)",
        "layer 0: 226 to 8, then tanh",
        "layer 1: 8 to 3",
        "outputs: 3",
        "  0: -0.3 to 1.2",
        "  1: -0.4 to 0.4",
        "  2: -inf to 1.5",
        "metadata:",
        "  command_high: 1.2,0.4,1.5",
        "  remark: two\\nlines, \\u{1b}[31mω",
    ];
    assert_eq!(text.lines().collect::<Vec<_>>(), lines);
}

#[test]
fn a_policy_is_shown_to_programs() {
    let file = TestFile::new(&supervisor());
    let output = guidedog(&["inspect", "policy", file.path(), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let expected = serde_json::json!({
        "inputs": 226,
        "outputs": 3,
        "layers": [{"inputs": 226, "outputs": 8}, {"inputs": 8, "outputs": 3}],
        "activation": "tanh",
        "output_low": [-0.3, -0.4, null],
        "output_high": [1.2, 0.4, 1.5],
        "parameters": 1843,
        "metadata": {"command_high": "1.2,0.4,1.5", "remark": "two\nlines, \u{1b}[31mω"},
    });
    assert_eq!(found, expected);
}

#[test]
fn a_policy_file_that_cannot_be_used_is_refused_with_its_name_and_the_reason() {
    refuses(&["inspect", "policy", "no/such.onnx"], &["no/such.onnx", "No such file"]);
    refuses(&["inspect", "policy"], &["FILE"]);
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    refuses(&["inspect", "policy", manifest], &["Cargo.toml", "not a whole ONNX file"]);
    let whole = supervisor();
    let cut = TestFile::new(&whole[..whole.len() / 2]);
    refuses(&["inspect", "policy", cut.path()], &[cut.path(), "not a whole ONNX file"]);
    let mut other = whole;
    let at = other.windows(4).position(|word| word == b"Tanh").unwrap();
    other[at..at + 4].copy_from_slice(b"Sinh");
    let other = TestFile::new(&other);
    refuses(&["inspect", "policy", other.path(), "--json"], &[other.path(), "operator Sinh"]);
}

#[test]
fn dynamics_obey_newton_and_show_what_touches_the_ground() {
    let state =
        r#"{"base_position": [0, 0, 0.1], "hand_force": [-60, 10, 5], "joint_torque": {"LF_HAA": 3.5}}"#;
    let file = TestFile::new(state.as_bytes());
    let output = guidedog(&["inspect", "dynamics", "--state", file.path(), "--json"]);
    let found: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let numbers = |value: &serde_json::Value| -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    };
    let (bias, acceleration) = (numbers(&found["bias_force"]), numbers(&found["acceleration"]));
    // M a + bias is what is applied: for the base's linear part the force of the hand, for the first joint its torque.
    let applied = |i: usize| -> f64 {
        let row = numbers(&found["mass_matrix"][i]);
        row.iter().zip(&acceleration).map(|(m, a)| m * a).sum::<f64>() + bias[i]
    };
    for (i, expected) in [(3, -60.0), (4, 10.0), (5, 5.0), (6, 3.5), (7, 0.0)] {
        assert!((applied(i) - expected).abs() < 1e-9, "{i}: {}", applied(i));
    }
    assert_eq!(found["degrees_of_freedom"][6], "LF_HAA");
    let contacts = found["contacts"].as_array().unwrap();
    assert!(contacts.iter().any(|c| c["name"].as_str().unwrap().contains("FOOT")), "{contacts:?}");
    let text = stdout(&guidedog(&["inspect", "dynamics"]));
    assert!(text.contains("18 degrees of freedom") && text.contains("LF_HAA"), "{text}");
}

#[test]
fn a_state_that_cannot_be_is_refused_with_what_is_allowed() {
    let refuses_state = |text: &str, parts: &[&str]| {
        let file = TestFile::new(text.as_bytes());
        refuses(&["inspect", "dynamics", "--state", file.path()], parts);
    };
    refuses(&["inspect", "dynamics", "--state", "no/such.json"], &["no/such.json", "No such file"]);
    refuses_state("{", &["state", "EOF"]);
    refuses_state(r#"{"joint_position": {"LF_TAIL": 0}}"#, &["joint_position", "LF_TAIL", "LF_HAA"]);
    refuses_state(
        r#"{"base_orientation": [1, 1, 0, 0]}"#,
        &["base_orientation", "1.4142", "unit quaternion"],
    );
    refuses_state(r#"{"speed": 1}"#, &["speed", "base_linear_velocity"]);
    refuses_state(r#"{"joint_velocity": {"LF_HAA": 1e999}}"#, &["state", "number out of range"]);
}

#[test]
fn evaluate_refuses_what_it_cannot_judge_by_name() {
    refuses(&["evaluate", "--suite", "paper18"], &["paper18", "paper17", "mirror17", "locomotion"]);
    refuses(
        &["evaluate", "--supervisor", "no/such.onnx"],
        &["no/such.onnx", "oracle", "rules-margin", "shipped"],
    );
    refuses(&["evaluate", "--locomotion", "no/such.onnx"], &["no/such.onnx", "No such file"]);
    refuses(&["evaluate", "--level", "10", "--ground", "rough"], &["10", "0..=9"]);
    refuses(&["evaluate", "--episodes", "0"], &["--episodes", "0"]);
    refuses(&["evaluate", "--ground", "moon"], &["moon", "flat", "rough", "stairs"]);
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml");
    refuses(&["evaluate", "--locomotion", manifest], &["Cargo.toml", "ONNX"]);
    refuses(&["evaluate", "--case", "hard"], &["--case hard", "f_x/f_y", "500 N"]);
    refuses(&["evaluate", "--suite", "locomotion", "--randomize"], &["--randomize", "--suite locomotion"]);
    refuses(&["evaluate", "--suite", "locomotion", "--ground", "rough"], &["--ground", "--suite locomotion"]);
    refuses(&["evaluate", "--suite", "locomotion", "--supervisor", "rules"], &["--supervisor"]);
    // Before anything is judged.
    refuses(&["evaluate", "--suite", "plane", "--beside", "no/such.json"], &["--beside", "no/such.json"]);
    refuses(&["evaluate", "--friction=-1"], &["-1", "from 0 to 10"]);
    refuses(&["evaluate", "--sensor-noise", "11"], &["11", "from 0 to 10"]);
    refuses(&["evaluate", "--friction", "1", "--plan", "pulls.plan"], &["--friction", "--plan"]);
    refuses(&["evaluate", "--json", "a.json", "--plan", "pulls.plan"], &["--json", "--plan"]);
}

#[test]
fn some_pulls_are_judged_alone_and_the_setting_is_said() {
    let cases = ["--case", "-60/0", "--case", "30/25"];
    let setting = "--supervisor oracle --episodes 2 --friction 0.7 --sensor-noise 0.5 --unloaded";
    let setting: Vec<&str> = setting.split(' ').collect();
    let text = stdout(&guidedog(&[&["evaluate"], &cases[..], &setting].concat()));
    let said = "unloaded, friction 0.7, other sensors' errors 0.5 of training's;";
    assert!(text.starts_with("chosen pulls on flat ground") && text.contains(said), "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("-60/0 ")).count(), 2, "{text}");
    assert_eq!(text.lines().filter(|line| line.starts_with("30/25 ")).count(), 2, "{text}");
    assert!(!text.contains("behavior reward") && !text.contains("\n0/0 "), "{text}");
}

#[test]
fn results_of_other_measures_do_not_stand_beside_those_of_today() {
    let file = NamedTempFile::new().unwrap();
    let path = file.path().to_str().unwrap();
    let judged = ["evaluate", "--case", "0/0", "--episodes", "1", "--supervisor", "oracle"];
    assert!(guidedog(&[&judged[..], &["--json", path]].concat()).status.success());
    let beside = [&judged[..], &["--beside", path]].concat();
    assert!(guidedog(&beside).status.success());
    let mut results: serde_json::Value = serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap();
    results["version"] = 1.into();
    std::fs::write(path, results.to_string()).unwrap();
    refuses(&beside, &["--beside", "version is 1"]);
}

#[test]
fn settings_are_shown_and_explained() {
    let text = stdout(&guidedog(&["config", "supervisor", "--set", "ppo.gamma=0.9"]));
    assert!(text.contains("gamma = 0.9\n") && text.contains("[task.pull]"), "{text}");
    let text = stdout(&guidedog(&["config", "locomotion", "--explain"]));
    assert!(
        text.contains("# Length of an episode [s; 0.1 to 1000]. Source: Isaac Lab, 20.\nepisode_s = 20.0"),
        "{text}"
    );
    let schema: serde_json::Value =
        serde_json::from_slice(&guidedog(&["config", "locomotion", "--schema"]).stdout).unwrap();
    assert!(schema["properties"]["ppo"]["properties"]["gamma"]["description"].is_string());
    refuses(&["config", "locomotion", "--set", "ppo.epochs=0"], &["epochs is 0", "at least 1"]);
}
