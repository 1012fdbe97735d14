//! Environments that cost nothing, so that only learning is timed.

use guidedog::policy::{Mirror, StepBuffers, VecEnv};

/// So many robots with the shapes of the locomotion task.
pub(crate) struct Nothing(pub(crate) usize);

impl VecEnv for Nothing {
    fn num_envs(&self) -> usize {
        self.0
    }
    fn observation_dim(&self) -> usize {
        235
    }
    fn action_dim(&self) -> usize {
        12
    }
    fn observation_scale(&self) -> Vec<f32> {
        vec![1.0; 235]
    }
    fn mirror(&self) -> Option<Mirror> {
        None
    }
    fn reset(&mut self, observations: &mut [f32]) {
        for (i, value) in observations.iter_mut().enumerate() {
            *value = (i as f32 * 0.37).sin();
        }
    }
    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        self.reset(&mut out.observations);
        for (reward, action) in out.rewards.iter_mut().zip(actions.chunks(12)) {
            *reward = -action[0].abs();
        }
    }
    fn save_state(&self, _out: &mut Vec<u8>) {}
    fn load_state(&mut self, _bytes: &[u8]) -> Result<(), String> {
        Ok(())
    }
}
