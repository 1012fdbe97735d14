//! Event files are read back by TensorBoard's own loader. Skips, saying so, where Python has no `tensorboard`.

mod python;

use guidedog::tensorboard::EventWriter;
use python::{has_packages, python};

const READER: &str = r#"
import sys
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
events = EventAccumulator(sys.argv[1]).Reload()
for tag in sorted(events.Tags()["scalars"]):
    print(tag, *(f"{e.step}:{e.value:g}" for e in events.Scalars(tag)))
for tag in sorted(events.Tags()["histograms"]):
    for e in events.Histograms(tag):
        h = e.histogram_value
        print(tag, e.step, f"{h.num:g} {h.min:g} {h.max:g} {h.sum:g}", sum(h.bucket), len(h.bucket) == len(h.bucket_limit))
"#;

#[test]
fn tensorboard_reads_a_trainings_reward_terms_and_histograms_by_name() {
    if !has_packages("tensorboard") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let small = ["iterations=2", "num_envs=16"].map(|setting| format!("training.{setting}"));
    let nets = ["actor_hidden=[8]", "critic_hidden=[8]"].map(|setting| format!("ppo.{setting}"));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_guidedog"));
    command.current_dir(&folder).args(["train", "locomotion", "--set", "task.terrain=flat"]);
    command.args(small.iter().chain(&nets).flat_map(|setting| ["--set", setting]));
    assert!(command.output().unwrap().status.success());
    let output = python().args(["-c", READER]).arg(folder.path().join("runs/locomotion")).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    let terms = guidedog::tasks::locomotion::reward::term_names().map(|name| format!("reward/{name}"));
    let others = ["tracking_linear", "terrain_level", "kl", "learning_rate", "surrogate_loss", "value_loss"];
    for tag in terms.iter().map(String::as_str).chain(others) {
        let line = text.lines().find(|line| line.split(' ').next() == Some(tag));
        let line = line.unwrap_or_else(|| panic!("no {tag} in {text}"));
        assert!(line.contains(" 1:") && line.contains(" 2:"), "{line}");
    }
    for tag in ["weights/actor", "weights/critic", "policy/std", "rollout/rewards", "rollout/values"] {
        assert!(
            text.lines().any(|line| line.starts_with(&format!("{tag} 2 ")) && line.ends_with("True")),
            "{tag}"
        );
    }
}

#[test]
fn tensorboard_reads_every_point_and_forgets_those_a_resumed_run_repeats() {
    if !has_packages("tensorboard") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut first = EventWriter::create(folder.path(), 1).unwrap();
    for step in 1..=4 {
        first.scalars(step, [("reward", (step - 1) as f64), ("kl", 0.25)]).unwrap();
    }
    let mut resumed = EventWriter::create(folder.path(), 3).unwrap();
    resumed.scalars(3, [("reward", 7.0), ("kl", 0.0)]).unwrap();
    resumed.histograms(3, &[("weights".into(), vec![-1.0, 0.5, 2.0])]).unwrap();

    let output = python().args(["-c", READER]).arg(folder.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout);
    assert_eq!(text, "kl 1:0.25 2:0.25 3:0\nreward 1:0 2:1 3:7\nweights 3 3 -1 2 1.5 3.0 True\n");
}
