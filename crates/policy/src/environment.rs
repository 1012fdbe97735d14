//! The contract between a learner and the environments it learns in.

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
    /// Named means since the last call (reward terms, curriculum level, falls), and forgets them.
    fn drain_metrics(&mut self) -> Vec<(String, f64)>;
    /// Appends everything needed to continue bit for bit to `out`.
    fn save_state(&self, out: &mut Vec<u8>);
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
