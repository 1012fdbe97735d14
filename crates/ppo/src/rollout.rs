//! What the policy did and what came of it, for all environments over the steps of one iteration.

use rayon::prelude::*;

use crate::advantage::{Trajectory, generalized_advantage};

/// Buffers of one iteration. Step-major: sample `step * num_envs + env`.
#[derive(Clone, Debug)]
pub(crate) struct Rollout {
    pub(crate) num_envs: usize,
    pub(crate) steps: usize,
    pub(crate) observation_dim: usize,
    pub(crate) action_dim: usize,
    /// Scaled observations, one step more than there are: the last is where the next iteration begins.
    pub(crate) observations: Vec<f32>,
    pub(crate) actions: Vec<f32>,
    pub(crate) means: Vec<f32>,
    /// Between the means of the step before and the step after, in the same episode; the mean itself where there is neither.
    pub(crate) smooth_means: Vec<f32>,
    pub(crate) log_probabilities: Vec<f32>,
    pub(crate) values: Vec<f32>,
    pub(crate) rewards: Vec<f32>,
    pub(crate) terminated: Vec<bool>,
    pub(crate) truncated: Vec<bool>,
    /// Values of the true last states of truncated episodes.
    pub(crate) last_values: Vec<f32>,
    /// Values of the states after the last step, one an environment.
    pub(crate) next_values: Vec<f32>,
    /// Environments that act without noise in this iteration.
    pub(crate) quiet: Vec<bool>,
    pub(crate) advantages: Vec<f32>,
    pub(crate) value_targets: Vec<f32>,
}

impl Rollout {
    pub(crate) fn new(num_envs: usize, steps: usize, observation_dim: usize, action_dim: usize) -> Self {
        let samples = num_envs * steps;
        Self {
            num_envs,
            steps,
            observation_dim,
            action_dim,
            observations: vec![0.0; (samples + num_envs) * observation_dim],
            actions: vec![0.0; samples * action_dim],
            means: vec![0.0; samples * action_dim],
            smooth_means: vec![0.0; samples * action_dim],
            log_probabilities: vec![0.0; samples],
            values: vec![0.0; samples],
            rewards: vec![0.0; samples],
            terminated: vec![false; samples],
            truncated: vec![false; samples],
            last_values: vec![0.0; samples],
            next_values: vec![0.0; num_envs],
            quiet: vec![false; num_envs],
            advantages: vec![0.0; samples],
            value_targets: vec![0.0; samples],
        }
    }

    pub(crate) fn samples(&self) -> usize {
        self.num_envs * self.steps
    }

    /// Range of the samples of one step.
    pub(crate) fn step(&self, step: usize) -> std::ops::Range<usize> {
        step * self.num_envs..(step + 1) * self.num_envs
    }

    /// Scaled observations before `step`; `steps` gives those after the last.
    pub(crate) fn observations_at(&mut self, step: usize) -> &mut [f32] {
        let row = self.num_envs * self.observation_dim;
        &mut self.observations[step * row..(step + 1) * row]
    }

    /// Numbers of a row: what is learned from in one sample.
    pub(crate) fn row_width(&self) -> usize {
        self.observation_dim + 3 * self.action_dim + 4
    }

    /// Appends a sample's row to `out`.
    pub(crate) fn append_row(&self, sample: usize, out: &mut Vec<f32>) {
        let (width, actions) = (self.observation_dim, self.action_dim);
        out.extend_from_slice(&self.observations[sample * width..][..width]);
        out.extend_from_slice(&self.actions[sample * actions..][..actions]);
        out.extend_from_slice(&self.means[sample * actions..][..actions]);
        out.extend_from_slice(&self.smooth_means[sample * actions..][..actions]);
        out.extend([
            self.log_probabilities[sample],
            self.values[sample],
            self.advantages[sample],
            self.value_targets[sample],
        ]);
    }

    /// Adds what [`Rollout::append_row`] wrote as another sample, to be learned from only; returns its number.
    pub(crate) fn push_row(&mut self, row: &[f32]) -> usize {
        let (observation, row) = row.split_at(self.observation_dim);
        let (action, row) = row.split_at(self.action_dim);
        let (mean, row) = row.split_at(self.action_dim);
        let (smooth_mean, row) = row.split_at(self.action_dim);
        self.observations.extend_from_slice(observation);
        self.actions.extend_from_slice(action);
        self.means.extend_from_slice(mean);
        self.smooth_means.extend_from_slice(smooth_mean);
        self.log_probabilities.push(row[0]);
        self.values.push(row[1]);
        self.advantages.push(row[2]);
        self.value_targets.push(row[3]);
        self.values.len() - 1
    }

    /// Forgets all rows and keeps the memory.
    pub(crate) fn clear_rows(&mut self) {
        for numbers in [
            &mut self.observations,
            &mut self.actions,
            &mut self.means,
            &mut self.smooth_means,
            &mut self.log_probabilities,
            &mut self.values,
            &mut self.advantages,
            &mut self.value_targets,
        ] {
            numbers.clear();
        }
    }

    /// Makes the state after the last step the one before the first.
    pub(crate) fn start_over(&mut self) {
        let row = self.num_envs * self.observation_dim;
        self.observations.copy_within(self.steps * row.., 0);
    }

    /// Sets the advantages of quiet environments to nothing: their samples do not say which actions pay.
    pub(crate) fn disregard_quiet(&mut self) {
        for of_step in self.advantages.chunks_exact_mut(self.num_envs) {
            let of_quiet = of_step.iter_mut().zip(&self.quiet).filter(|(_, quiet)| **quiet);
            of_quiet.for_each(|(advantage, _)| *advantage = 0.0);
        }
    }

    /// Fills the smooth means.
    pub(crate) fn smooth_means(&mut self) {
        let (num_envs, steps, actions) = (self.num_envs, self.steps, self.action_dim);
        let (means, terminated, truncated) = (&self.means, &self.terminated, &self.truncated);
        let ends = |sample: usize| terminated[sample] || truncated[sample];
        self.smooth_means.par_chunks_mut(num_envs * actions).enumerate().for_each(|(step, row)| {
            for (env, smooth) in row.chunks_exact_mut(actions).enumerate() {
                let sample = step * num_envs + env;
                let of = |sample: usize| &means[sample * actions..][..actions];
                // One neighbor alone would price all change, a stride's as much as a twitch.
                let between = step > 0 && !ends(sample - num_envs) && step + 1 < steps && !ends(sample);
                let [before, after] =
                    if between { [sample - num_envs, sample + num_envs] } else { [sample; 2] }.map(of);
                for ((smooth, before), after) in smooth.iter_mut().zip(before).zip(after) {
                    *smooth = 0.5 * (before + after);
                }
            }
        });
    }

    /// Fills advantages and value targets.
    pub(crate) fn estimate_advantages(&mut self, gamma: f32, lambda: f32) {
        let (num_envs, steps) = (self.num_envs, self.steps);
        let column = |values: &[f32], env: usize| -> Vec<f32> {
            (0..steps).map(|step| values[step * num_envs + env]).collect()
        };
        let flags = |values: &[bool], env: usize| -> Vec<bool> {
            (0..steps).map(|step| values[step * num_envs + env]).collect()
        };
        let columns: Vec<Vec<f32>> = (0..num_envs)
            .into_par_iter()
            .map(|env| {
                let mut advantages = vec![0.0; steps];
                let trajectory = Trajectory {
                    rewards: &column(&self.rewards, env),
                    values: &column(&self.values, env),
                    terminated: &flags(&self.terminated, env),
                    truncated: &flags(&self.truncated, env),
                    last_values: &column(&self.last_values, env),
                    next_value: self.next_values[env],
                };
                generalized_advantage(trajectory, gamma, lambda, &mut advantages);
                advantages
            })
            .collect();
        for (env, column) in columns.iter().enumerate() {
            for (step, advantage) in column.iter().enumerate() {
                self.advantages[step * num_envs + env] = *advantage;
            }
        }
        for ((target, advantage), value) in
            self.value_targets.iter_mut().zip(&self.advantages).zip(&self.values)
        {
            *target = advantage + value;
        }
    }
}

/// Shifts and scales `values` as brings `all` to mean 0 and standard deviation 1.
pub(crate) fn normalize(values: &mut [f32], all: &[f32]) {
    let (mean, scale) = mean_and_scale(all);
    for value in values {
        *value = (*value - mean) * scale;
    }
}

/// Mean and 1 / standard deviation.
fn mean_and_scale(values: &[f32]) -> (f32, f32) {
    let count = values.len() as f64;
    let mean = values.iter().map(|&value| f64::from(value)).sum::<f64>() / count;
    let square = values.iter().map(|&value| (f64::from(value) - mean).powi(2)).sum::<f64>();
    let deviation = (square / (count - 1.0).max(1.0)).sqrt();
    (mean as f32, (1.0 / (deviation + 1e-8)) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_means_look_both_ways_within_an_episode() {
        let mut rollout = Rollout::new(2, 4, 1, 1);
        // Of environment 0: 0, 1, 4, 9. Its episode ends after the second step; environment 1 does nothing.
        for (step, mean) in [0.0, 1.0, 4.0, 9.0].into_iter().enumerate() {
            rollout.means[2 * step] = mean;
        }
        let smooth = |rollout: &mut Rollout| {
            rollout.smooth_means();
            rollout.smooth_means.chunks_exact(2).map(|row| row[0]).collect::<Vec<_>>()
        };
        assert_eq!(smooth(&mut rollout), [0.0, 2.0, 5.0, 9.0], "at the ends: itself");
        rollout.truncated[2] = true;
        assert_eq!(smooth(&mut rollout), [0.0, 1.0, 4.0, 9.0], "nor across an episode's end");
        rollout.truncated[2] = false;
        rollout.terminated[4] = true;
        assert_eq!(smooth(&mut rollout), [0.0, 2.0, 4.0, 9.0]);
        assert!(rollout.smooth_means.chunks_exact(2).all(|row| row[1] == 0.0));
    }

    #[test]
    fn what_quiet_environments_did_is_neither_good_nor_bad() {
        let mut rollout = Rollout::new(2, 2, 1, 1);
        rollout.advantages.copy_from_slice(&[1.0, 2.0, 3.0, 4.0]);
        rollout.quiet[1] = true;
        rollout.disregard_quiet();
        assert_eq!(rollout.advantages, [1.0, 0.0, 3.0, 0.0]);
    }

    #[test]
    fn normalized_numbers_have_mean_zero_and_deviation_one() {
        let mut values = [1.0, 2.0, 3.0, 4.0];
        normalize(&mut values, &[1.0, 2.0, 3.0, 4.0]);
        assert!(values.iter().sum::<f32>().abs() < 1e-6);
        let square: f32 = values.iter().map(|x| x * x).sum();
        assert!((square / 3.0 - 1.0).abs() < 1e-5);
        let mut constant = [5.0; 3];
        normalize(&mut constant, &[5.0; 3]);
        assert_eq!(constant, [0.0; 3]);
    }
}
