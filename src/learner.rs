//! PPO on any environment, as the training loop sees it.

use std::path::Path;

use anyhow::Result;
use policy::VecEnv;
use ppo::{Iteration, Trainer};

use crate::training::Learner;

impl<E: VecEnv> Learner for Trainer<E> {
    fn iteration(&self) -> u64 {
        Trainer::iteration(self)
    }

    fn iterate(&mut self) -> Result<Vec<(String, f64)>> {
        Ok(named(&Trainer::iterate(self)?))
    }

    fn steps_per_iteration(&self) -> u64 {
        Trainer::steps_per_iteration(self)
    }

    fn save(&self, path: &Path) -> Result<()> {
        Ok(self.checkpoint().save(path)?)
    }
}

/// The numbers of an iteration by name.
fn named(iteration: &Iteration) -> Vec<(String, f64)> {
    let [simulation_s, inference_s, update_s] = iteration.times_s;
    let own = [
        ("env_steps", iteration.env_steps as f64),
        ("step_reward", iteration.step_reward),
        ("episode_return", iteration.episode_return),
        ("episode_length", iteration.episode_length),
        ("surrogate_loss", iteration.surrogate_loss),
        ("value_loss", iteration.value_loss),
        ("kl", iteration.kl),
        ("clip_fraction", iteration.clip_fraction),
        ("gradient_norm", iteration.gradient_norm),
        ("action_std", iteration.action_std),
        ("learning_rate", iteration.learning_rate),
        ("time/simulation_s", simulation_s),
        ("time/inference_s", inference_s),
        ("time/update_s", update_s),
    ];
    let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
    own.chain(iteration.environment.iter().cloned()).collect()
}
