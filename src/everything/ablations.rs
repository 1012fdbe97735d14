//! What each part of the supervisor's training is worth: trainings with one thing changed.

use anyhow::{Context as _, Result};

use super::Maker;
use super::pair::{Pair, table};
use crate::config::resolve_text;
use crate::interrupt::Interrupt;
use crate::learner::{Start, Training};
use crate::policies;
use crate::run_config::SupervisorRun;
use crate::run_folder::RunFolder;
use crate::training::Outcome;

/// Trainings of every ablation.
pub(super) const SEEDS: u64 = 3;

/// The paper's pulls.
const PAPER_FORCES: &[&str] = &[
    "task.pull.x_n=[-80, 0]",
    "task.pull.y_n=[-40, 40]",
    "task.pull.near_threshold_share=0",
    "task.pull.period_s=5",
];

/// The paper's price on changes of the command.
const PAPER_COMMAND_RATE: &str = "task.command_rate=-1e-4";

/// One thing that is other than in `guidedog config supervisor`: its name and groups of settings.
pub(super) const ABLATIONS: [(&str, &[&[&str]]); 11] = [
    ("ours", &[]),
    (
        "paper-task",
        &[
            PAPER_FORCES,
            &[
                "task.threshold_margin_n=[0,0]",
                "task.pull.noise_n=[0,0,0]",
                "task.heading_drift=0",
                "task.place_drift=0",
                "task.fall=0",
                PAPER_COMMAND_RATE,
            ],
        ],
    ),
    ("paper-forces", &[PAPER_FORCES]),
    ("no-symmetry", &[&["ppo.symmetry=none"]]),
    ("mirrored-samples", &[&["ppo.symmetry=samples"]]),
    ("no-heading-drift", &[&["task.heading_drift=0"]]),
    ("no-place-drift", &[&["task.place_drift=0"]]),
    ("no-force-noise", &[&["task.pull.noise_n=[0,0,0]"]]),
    ("paper-command-rate", &[&[PAPER_COMMAND_RATE]]),
    // The discount is one of decisions: for the same horizon in seconds it is the fifth root and the square of 0.9.
    ("every-0.02-s", &[&["task.supervisor_period_s=0.02", "ppo.gamma=0.979", "ppo.lambda=0.979"]]),
    ("every-0.2-s", &[&["task.supervisor_period_s=0.2", "ppo.gamma=0.81", "ppo.lambda=0.81"]]),
];

impl Maker {
    /// All ablations, three seeds each, and their table; false if the user interrupts.
    pub(super) fn ablations(&self, interrupt: &Interrupt) -> Result<bool> {
        let mut rows = Vec::new();
        let mut oracle = None;
        for (name, _) in ABLATIONS {
            let Some(policies) = self.ablation(name, interrupt)? else { return Ok(false) };
            let mut found = Vec::new();
            for (seed, supervisor) in (1..).zip(policies) {
                let pair = Pair { name: format!("ablation-{name}-{seed}"), supervisor, ..Pair::default() };
                let results = self.pair(&pair, oracle)?;
                oracle = Some(results.oracle_reward);
                found.push(results);
            }
            rows.push((name.to_owned(), found));
        }
        let head = format!(
            "supervisors trained with one thing changed, {SEEDS} seeds each, median (lowest to highest); paper17 on level ground, {} episodes a case, randomized robots\n",
            self.pair_episodes()
        );
        self.write("ablations", "txt", (head + &table(&rows)).as_bytes())?;
        Ok(true)
    }

    /// The supervisors of an ablation, one a seed, trained or found; `None` if the user interrupts.
    pub(super) fn ablation(&self, name: &str, interrupt: &Interrupt) -> Result<Option<Vec<String>>> {
        let of_name = ABLATIONS.iter().find(|(other, _)| *other == name);
        let (_, settings) = of_name.with_context(|| format!("no ablation is called {name}"))?;
        let mut policies = Vec::new();
        for seed in 1..=SEEDS {
            let settings = [owned(&settings.concat()), vec![format!("training.seed={seed}")]].concat();
            let Some(policy) = self.supervisor(&format!("ablation-{name}-{seed}"), &settings, interrupt)?
            else {
                return Ok(None);
            };
            policies.push(policy);
        }
        Ok(Some(policies))
    }

    /// Trains a supervisor in a run folder here, or finds it trained; `None` if the user interrupts.
    pub(super) fn supervisor(
        &self,
        name: &str,
        settings: &[String],
        interrupt: &Interrupt,
    ) -> Result<Option<String>> {
        let config: SupervisorRun = resolve_text("defaults", "", settings)?;
        config.validate()?;
        crate::tell!("{name}");
        let run = RunFolder::open(&self.folder, name)?;
        let outcome = Training::unseen(&config, &Start::Resume).learn(&run, interrupt)?;
        Ok(if outcome == Outcome::Finished {
            Some(policies::name(&run.file("policy.onnx"))?.to_owned())
        } else {
            None
        })
    }
}

fn owned(settings: &[&str]) -> Vec<String> {
    settings.iter().map(|&setting| setting.to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use tasks::guidance::PullConfig;

    use super::*;

    #[test]
    fn every_ablation_changes_something_that_can_be_trained() {
        let plain: SupervisorRun = resolve_text("defaults", "", &[]).unwrap();
        for (name, settings) in ABLATIONS {
            let config: SupervisorRun = resolve_text("defaults", "", &owned(&settings.concat())).unwrap();
            config.validate().unwrap();
            assert_eq!(config == plain, name == "ours", "{name}");
            let pull = match name {
                "paper-task" => PullConfig::paper(),
                "paper-forces" => PullConfig { noise_n: plain.task.pull.noise_n, ..PullConfig::paper() },
                _ => continue,
            };
            assert_eq!(config.task.pull, pull, "{name}");
            if name == "paper-task" {
                let paper = include_str!("../../configs/supervisor/paper.toml");
                let paper: SupervisorRun = resolve_text("paper.toml", paper, &[]).unwrap();
                assert_eq!(config.task, paper.task);
            }
        }
    }
}
