//! What a training run is configured with: how long, how to learn, what task.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use tasks::{guidance::GuidanceConfig, locomotion::LocomotionConfig};

use crate::error::{BadInput, OrBadInput as _};
use crate::training::TrainingSettings;

/// A training of some task.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Run<T> {
    /// How long, how many robots, what is kept.
    pub training: TrainingSettings,
    /// The learner.
    pub ppo: ppo::Config,
    /// The task.
    pub task: T,
}

/// A locomotion training.
pub type LocomotionRun = Run<LocomotionConfig>;
/// A supervisor training.
pub type SupervisorRun = Run<GuidanceConfig>;

/// The settings of a task, with the learner's settings it learns fastest with.
pub trait TaskConfig: Default + Clone + JsonSchema + Serialize + DeserializeOwned {
    /// Refuses what cannot be run, with the key, its value and what is allowed.
    ///
    /// # Errors
    /// The first key out of range.
    fn validate(&self) -> Result<(), String>;
    /// How long and how to learn, unless said otherwise.
    fn learning() -> (TrainingSettings, ppo::Config);
}

impl TaskConfig for LocomotionConfig {
    fn validate(&self) -> Result<(), String> {
        Self::validate(self)
    }

    fn learning() -> (TrainingSettings, ppo::Config) {
        let ppo = ppo::Config {
            critic_hidden: vec![256, 128, 64],
            desired_kl: 0.02,
            learning_rate: 5e-4,
            learning_rate_range: [1e-5, 1e-3],
            entropy_coefficient: 0.004,
            symmetry: ppo::SymmetryBy::Networks,
            ..ppo::Config::default()
        };
        (TrainingSettings { iterations: 2000, ..TrainingSettings::default() }, ppo)
    }
}

impl TaskConfig for GuidanceConfig {
    fn validate(&self) -> Result<(), String> {
        Self::validate(self)
    }

    fn learning() -> (TrainingSettings, ppo::Config) {
        let training = TrainingSettings {
            num_envs: 512,
            iterations: 600,
            checkpoint_period_s: 20.0,
            score: "behavior_reward/total".into(),
            ..TrainingSettings::default()
        };
        let ppo = ppo::Config {
            actor_hidden: vec![128, 128, 128],
            critic_hidden: vec![128, 128, 128],
            // A command shows its worth within half a second, five decisions; what comes later is the next pull's.
            gamma: 0.9,
            lambda: 0.9,
            desired_kl: 0.04,
            anneal_iterations: 600,
            anneal_to: 0.01,
            learning_rate_range: [1e-5, 2e-3],
            initial_std: 0.5,
            initial_output_scale: 0.01,
            entropy_coefficient: 0.003,
            kinks_at_observations: true,
            symmetry: ppo::SymmetryBy::Networks,
            ..ppo::Config::default()
        };
        (training, ppo)
    }
}

/// Half of a supervisor's usual training, for a walk of level ground that was learned just before, and as supervisors learned until
/// commit 7b040fc: over such a walk today's way reads fewer pulls on thresholds (docs/findings.md, "Drift of the place").
pub const SHORT_SUPERVISOR_TRAINING: [&str; 8] = [
    "training.iterations=300",
    "ppo.anneal_iterations=300",
    "ppo.anneal_to=0.1",
    "ppo.symmetry=none",
    "ppo.learning_rate_range=[1e-5,5e-3]",
    "ppo.initial_output_scale=1",
    "task.place_drift=0",
    "task.command_rate=-1e-4",
];

impl<T: TaskConfig> Default for Run<T> {
    fn default() -> Self {
        let (training, ppo) = T::learning();
        Self { training, ppo, task: T::default() }
    }
}

impl<T: TaskConfig> Run<T> {
    /// Refuses what cannot be trained.
    ///
    /// # Errors
    /// The first key out of range, with its value and what is allowed.
    pub fn validate(&self) -> Result<(), BadInput> {
        self.training.validate()?;
        self.ppo.validate().or_bad_input(|| "ppo".into())?;
        self.task.validate().map_err(|message| BadInput::new(format!("task.{message}")))
    }
}

/// Of the settings of training, which else say only how long a run goes on and what is kept of it, those without which it
/// does not go on as it was.
const FIXED_IN_TRAINING: [&str; 2] = ["training.num_envs", "training.seed"];

/// Refuses to go on with other settings than a run was begun with.
///
/// # Errors
/// The first key that differs, with both values.
pub fn same_as_begun(begun: &toml::Table, now: &toml::Table) -> Result<(), String> {
    let (begun, now) = (flattened(begun), flattened(now));
    let free = |key: &str| key.starts_with("training.") && !FIXED_IN_TRAINING.contains(&key);
    let keys: BTreeSet<&String> = begun.keys().chain(now.keys()).collect();
    for key in keys.into_iter().filter(|key| !free(key)) {
        let text =
            |settings: &BTreeMap<String, String>| settings.get(key).cloned().unwrap_or("nothing".into());
        let (was, is) = (text(&begun), text(&now));
        if was != is {
            return Err(format!("it was begun with {key} = {was}, and now that is {is}"));
        }
    }
    Ok(())
}

/// Every value with its dotted key.
fn flattened(table: &toml::Table) -> BTreeMap<String, String> {
    let mut flat = BTreeMap::new();
    for (key, value) in table {
        match value {
            toml::Value::Table(inner) => {
                flat.extend(
                    flattened(inner).into_iter().map(|(rest, value)| (format!("{key}.{rest}"), value)),
                );
            }
            value => drop(flat.insert(key.clone(), value.to_string())),
        }
    }
    flat
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_goes_on_only_with_the_settings_it_was_begun_with() {
        let table = |change: &dyn Fn(&mut SupervisorRun)| {
            let mut run = SupervisorRun::default();
            change(&mut run);
            toml::Table::try_from(run).unwrap()
        };
        let begun = table(&|_| ());
        assert_eq!(same_as_begun(&begun, &table(&|run| run.training.iterations = 7)), Ok(()));
        let refusal =
            |change: &dyn Fn(&mut SupervisorRun)| same_as_begun(&begun, &table(change)).unwrap_err();
        let message = refusal(&|run| run.task.locomotion = "mine.onnx".into());
        assert_eq!(message, "it was begun with task.locomotion = \"shipped\", and now that is \"mine.onnx\"");
        assert!(refusal(&|run| run.training.seed = 9).contains("training.seed"));
        assert!(refusal(&|run| run.ppo.gamma = 0.5).contains("ppo.gamma"));
        assert!(same_as_begun(&toml::Table::new(), &begun).unwrap_err().contains("= nothing"));
    }
}
