//! The steps of an iteration in the environments.

use std::time::Instant;

use policy::VecEnv;
use rayon::prelude::*;
use spatial::{Philox, Purpose};

use super::{TrainError, Trainer};
use crate::{loss::Gaussian, quiet::keeps_quiet};

impl<E: VecEnv> Trainer<E> {
    /// Steps this rank's environments; returns the time spent in the networks \[s\], and sums: of rewards; of returns, lengths
    /// and number of the episodes that ended.
    pub(super) fn collect(&mut self) -> Result<(f64, [f64; 4]), TrainError> {
        self.engine.load(&self.networks, &self.parameters);
        let (share, first_env) = (self.config.quiet_share, self.team.own_envs().start);
        for (env, quiet) in self.rollout.quiet.iter_mut().enumerate() {
            *quiet = keeps_quiet(share, self.seed, first_env + env, self.iteration);
        }
        let mut inference_s = 0.0;
        let mut ended = [0.0_f64; 3];
        for step in 0..self.config.steps_per_env {
            let start = Instant::now();
            self.act(step);
            inference_s += start.elapsed().as_secs_f64();
            let range = self.rollout.step(step);
            let width = self.rollout.action_dim;
            let actions = &self.rollout.actions[range.start * width..range.end * width];
            self.env.step(actions, &mut self.buffers);
            if !self.buffers.rewards.iter().all(|reward| reward.is_finite()) {
                return Err(self.non_finite("a reward"));
            }
            if !self.buffers.observations.iter().all(|value| value.is_finite()) {
                return Err(self.non_finite("an observation"));
            }
            self.rollout.rewards[range.clone()].copy_from_slice(&self.buffers.rewards);
            self.rollout.terminated[range.clone()].copy_from_slice(&self.buffers.terminated);
            self.rollout.truncated[range].copy_from_slice(&self.buffers.truncated);
            self.count_episodes(&mut ended);
            self.value_truncated(step);
            self.store_observations(step + 1);
        }
        let width = self.rollout.observation_dim;
        let last = &self.rollout.observations[self.rollout.samples() * width..];
        self.engine.evaluate(&self.networks, last, None, &mut self.rollout.next_values);
        let rewards = self.rollout.rewards.iter().map(|&reward| f64::from(reward)).sum();
        let [returns, lengths, number] = ended;
        Ok((inference_s, [rewards, returns, lengths, number]))
    }

    /// Scales the environments' observations into the rollout.
    pub(super) fn store_observations(&mut self, step: usize) {
        let scale = &self.observation_scale;
        let raw = &self.buffers.observations;
        let width = scale.len();
        let stored = self.rollout.observations_at(step);
        stored.par_chunks_mut(width).zip(raw.par_chunks(width)).for_each(|(stored, raw)| {
            for ((stored, raw), scale) in stored.iter_mut().zip(raw).zip(scale) {
                *stored = raw * scale;
            }
        });
    }

    /// Evaluates both networks on the observations of a step and draws actions.
    fn act(&mut self, step: usize) {
        let noise = Gaussian::new(self.networks.split(&self.parameters).2);
        let range = self.rollout.step(step);
        let rollout = &mut self.rollout;
        let (width, actions) = (rollout.observation_dim, rollout.action_dim);
        let observations = &rollout.observations[range.start * width..range.end * width];
        let span = range.start * actions..range.end * actions;
        let (means, drawn) = (&mut rollout.means[span.clone()], &mut rollout.actions[span]);
        let (values, quiet) = (&mut rollout.values[range.clone()], &rollout.quiet);
        self.engine.evaluate(&self.networks, observations, Some(&mut *means), values);
        let (seed, iteration, first_env) = (self.seed, self.iteration as u32, self.team.own_envs().start);
        drawn
            .par_chunks_mut(actions)
            .zip(means.par_chunks(actions))
            .zip(&mut rollout.log_probabilities[range])
            .enumerate()
            .for_each(|(env, ((action, mean), log_probability))| {
                let mut random = Philox::new(seed, first_env + env, iteration, step as u32, Purpose::Action);
                let scale = if quiet[env] { 0.0 } else { 1.0 };
                for ((action, mean), std) in action.iter_mut().zip(mean).zip(noise.std()) {
                    *action = mean + scale * std * random.normal();
                }
                *log_probability = noise.log_probability(action, mean);
            });
    }

    /// Values the true last states of episodes that were cut short.
    fn value_truncated(&mut self, step: usize) {
        let width = self.rollout.observation_dim;
        let cut: Vec<usize> = (0..self.rollout.num_envs).filter(|&env| self.buffers.truncated[env]).collect();
        if cut.is_empty() {
            return;
        }
        let mut observations = Vec::with_capacity(cut.len() * width);
        for &env in &cut {
            let row = &self.buffers.last_observations[env * width..][..width];
            observations.extend(row.iter().zip(&self.observation_scale).map(|(raw, scale)| raw * scale));
        }
        let start = self.rollout.step(step).start;
        let mut values = vec![0.0; cut.len()];
        self.engine.evaluate(&self.networks, &observations, None, &mut values);
        for (env, value) in cut.into_iter().zip(values) {
            self.rollout.last_values[start + env] = value;
        }
    }

    /// Adds returns, lengths and number of the episodes that ended in this step to `ended`.
    fn count_episodes(&mut self, ended: &mut [f64; 3]) {
        for env in 0..self.rollout.num_envs {
            self.episode_returns[env] += self.buffers.rewards[env];
            self.episode_lengths[env] += 1.0;
            if self.buffers.terminated[env] || self.buffers.truncated[env] {
                ended[0] += f64::from(std::mem::take(&mut self.episode_returns[env]));
                ended[1] += f64::from(std::mem::take(&mut self.episode_lengths[env]));
                ended[2] += 1.0;
            }
        }
    }
}
