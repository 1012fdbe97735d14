//! The contract between a learner and the environments it learns in.

use std::ops::Range;

/// Environments come in whole groups of so many: those that the physics steps together.
const GROUP: usize = 16;

/// Some of a training's environments: those one process steps when several share them. What is random or placed by an
/// environment's number goes by its number among all, so it does not matter who steps it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Share {
    /// Numbers of the environments.
    pub envs: Range<usize>,
    /// Environments of all processes together.
    pub total: usize,
}

impl Share {
    /// All of `total` environments.
    pub fn whole(total: usize) -> Self {
        Self { envs: 0..total, total }
    }

    /// What `rank` of `ranks` processes steps of `total` environments that are only divided between blocks of `unit`: shares
    /// differ by one block at most.
    ///
    /// # Errors
    /// There are fewer blocks than processes.
    pub fn of_rank(rank: usize, ranks: usize, total: usize, unit: usize) -> Result<Self, String> {
        let blocks = total.div_ceil(unit);
        if ranks > blocks {
            // The last block need not be full.
            let least = (ranks - 1) * unit + GROUP.min(unit);
            return Err(format!("num_envs is {total}, must be at least {least} for {ranks} ranks"));
        }
        let start = |rank: usize| (rank * blocks / ranks * unit).min(total);
        Ok(Self { envs: start(rank)..start(rank + 1), total })
    }
}

/// Many environments stepped together.
///
/// All buffers are row-major, one row an environment, and belong to the caller. An environment whose episode ends
/// is reset within the same `step`: `observations` then holds the first observation of the new episode and
/// `last_observations` the true last one of the old.
pub trait VecEnv: Send {
    /// Number of environments.
    fn num_envs(&self) -> usize;
    /// Width of an observation, in raw (SI) values.
    fn observation_dim(&self) -> usize;
    /// Width of an action.
    fn action_dim(&self) -> usize;
    /// Fixed factors that bring raw observations to order one; the learner's first layer sees `scale · raw`.
    fn observation_scale(&self) -> Vec<f32>;
    /// How the left–right mirror image of a state looks, if the task has that symmetry.
    fn mirror(&self) -> Option<Mirror>;
    /// Lower and upper limits of an exported policy's outputs; none by default.
    fn output_limits(&self) -> Option<(Vec<f32>, Vec<f32>)> {
        None
    }
    /// What an exported policy says of itself, by name; nothing by default.
    fn metadata(&self) -> Vec<(String, String)> {
        Vec::new()
    }
    /// Starts new episodes everywhere; fills `observations` (`num_envs × observation_dim`).
    fn reset(&mut self, observations: &mut [f32]);
    /// Applies one action to every environment (`num_envs × action_dim`).
    fn step(&mut self, actions: &[f32], out: &mut StepBuffers);
    /// Sums since the last call of what is reported (reward terms, curriculum level, falls), and forgets them. Those of several
    /// shares, appended to one another in order of environments, are those of all. Nothing
    /// by default.
    fn take_sums(&mut self) -> Vec<f64> {
        Vec::new()
    }
    /// Named means of sums over all environments, whoever stepped them. What grows while learning succeeds may go by them, so
    /// every share must see them.
    fn report(&mut self, _sums: &[f64]) -> Vec<(String, f64)> {
        Vec::new()
    }
    /// Named means of these environments since the last call.
    fn drain_metrics(&mut self) -> Vec<(String, f64)> {
        let sums = self.take_sums();
        self.report(&sums)
    }
    /// Appends everything needed to continue bit for bit to `out`: first [`VecEnv::common_state_len`] bytes about all
    /// environments together, then as many about each, in their order.
    fn save_state(&self, out: &mut Vec<u8>);
    /// Bytes at the beginning of a saved state that are about all environments together; 0 by default.
    fn common_state_len(&self) -> usize {
        0
    }
    /// Takes back what [`VecEnv::save_state`] wrote.
    ///
    /// # Errors
    /// Says what does not fit: a different number of environments, a truncated buffer.
    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String>;
}

/// What a step of all environments gives back.
#[derive(Clone, Debug, Default)]
pub struct StepBuffers {
    /// Next observations, `num_envs × observation_dim`.
    pub observations: Vec<f32>,
    /// Rewards, `num_envs`.
    pub rewards: Vec<f32>,
    /// The episode ended in a state of no return (a fall): its value is zero.
    pub terminated: Vec<bool>,
    /// The episode was cut short by time: its value goes on.
    pub truncated: Vec<bool>,
    /// Last observations of episodes that ended in this step, `num_envs × observation_dim`; other rows keep
    /// whatever they held.
    pub last_observations: Vec<f32>,
}

impl StepBuffers {
    /// Buffers for `num_envs` environments with observations of `observation_dim`.
    pub fn new(num_envs: usize, observation_dim: usize) -> Self {
        Self {
            observations: vec![0.0; num_envs * observation_dim],
            rewards: vec![0.0; num_envs],
            terminated: vec![false; num_envs],
            truncated: vec![false; num_envs],
            last_observations: vec![0.0; num_envs * observation_dim],
        }
    }

    /// The rows of every `envs` environments that follow one another, in order; the last may be fewer. One for each part of the
    /// environments that is stepped by itself.
    pub fn parts(&mut self, envs: usize) -> impl Iterator<Item = StepRows<'_>> {
        let observation_dim = self.observations.len() / self.rewards.len().max(1);
        let row_width = (envs * observation_dim).max(1);
        let observations =
            self.observations.chunks_mut(row_width).zip(self.last_observations.chunks_mut(row_width));
        let ends = self.terminated.chunks_mut(envs).zip(self.truncated.chunks_mut(envs));
        observations.zip(self.rewards.chunks_mut(envs)).zip(ends).map(
            |(((observations, last_observations), rewards), (terminated, truncated))| StepRows {
                observations,
                rewards,
                terminated,
                truncated,
                last_observations,
            },
        )
    }
}

/// The rows of some environments in [`StepBuffers`], of the same meaning.
#[derive(Debug)]
pub struct StepRows<'a> {
    /// Next observations.
    pub observations: &'a mut [f32],
    /// Rewards.
    pub rewards: &'a mut [f32],
    /// Ends without return.
    pub terminated: &'a mut [bool],
    /// Ends by time.
    pub truncated: &'a mut [bool],
    /// Last observations of episodes that ended.
    pub last_observations: &'a mut [f32],
}

/// A left–right mirror map: `mirrored[i] = sign[i] · original[source[i]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mirror {
    /// Map of an observation.
    pub observation: Vec<(usize, f32)>,
    /// Map of an action.
    pub action: Vec<(usize, f32)>,
}

impl Mirror {
    /// Writes the mirror image of `original` to `mirrored`, by one of the maps.
    pub fn apply(map: &[(usize, f32)], original: &[f32], mirrored: &mut [f32]) {
        for (value, &(source, sign)) in mirrored.iter_mut().zip(map) {
            *value = sign * original[source];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_the_buffers_are_rows_that_follow_one_another() {
        let mut buffers = StepBuffers::new(5, 3);
        let sizes: Vec<usize> = buffers
            .parts(2)
            .enumerate()
            .map(|(part, rows)| {
                rows.observations.fill(part as f32);
                rows.last_observations.fill(-(part as f32));
                rows.terminated[0] = true;
                rows.truncated.fill(part == 1);
                rows.rewards.len()
            })
            .collect();
        assert_eq!(sizes, [2, 2, 1]);
        assert_eq!(
            buffers.observations,
            [[0.0; 6], [1.0; 6]].concat().into_iter().chain([2.0; 3]).collect::<Vec<_>>()
        );
        assert_eq!(buffers.last_observations[12..], [-2.0; 3]);
        assert_eq!(buffers.terminated, [true, false, true, false, true]);
        assert_eq!(buffers.truncated, [false, false, true, true, false]);
    }

    #[test]
    fn shares_are_whole_blocks_that_follow_one_another() {
        for (total, unit, ranks) in [(96, 16, 1), (96, 16, 4), (100, 16, 3), (512, 128, 4)] {
            let shares: Vec<Share> =
                (0..ranks).map(|rank| Share::of_rank(rank, ranks, total, unit).unwrap()).collect();
            assert!(shares[0].envs.start == 0 && shares[ranks - 1].envs.end == total);
            assert!(shares.windows(2).all(|pair| pair[0].envs.end == pair[1].envs.start));
            assert!(
                shares.iter().all(|share| share.envs.start.is_multiple_of(unit) && !share.envs.is_empty())
            );
        }
        let message = Share::of_rank(0, 5, 512, 128).unwrap_err();
        assert_eq!(message, "num_envs is 512, must be at least 528 for 5 ranks");
        assert_eq!(Share::of_rank(4, 5, 528, 128).unwrap().envs, 512..528);
    }
}
