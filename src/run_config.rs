//! What a training run is configured with: how long, how to learn, what task.

use serde::{Deserialize, Serialize};
use tasks::locomotion::LocomotionConfig;

use crate::error::{BadInput, OrBadInput as _};
use crate::training::TrainingSettings;

/// A locomotion training.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocomotionRun {
    /// How long, how many robots, what is kept.
    pub training: TrainingSettings,
    /// The learner.
    pub ppo: ppo::Config,
    /// The task.
    pub task: LocomotionConfig,
}

impl LocomotionRun {
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
