//! Where a learner begins other than at nothing: its own checkpoint, another run's, or a policy alone.

use policy::{Checkpoint, Mlp, VecEnv};

use super::{TrainError, Trainer};

impl<E: VecEnv> Trainer<E> {
    /// Everything a resumed run needs to give the same bits as one never stopped.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert("parameters", &self.parameters);
        checkpoint.insert("adam/first_moment", &self.adam.first_moment);
        checkpoint.insert("adam/second_moment", &self.adam.second_moment);
        let row = self.rollout.num_envs * self.rollout.observation_dim;
        checkpoint.insert("observations", &self.rollout.observations[..row]);
        checkpoint.insert("episode_returns", &self.episode_returns);
        checkpoint.insert("episode_lengths", &self.episode_lengths);
        checkpoint.insert("finished", &self.finished);
        checkpoint.insert("learning_rate", &[self.learning_rate]);
        let mut state = Vec::new();
        self.env.save_state(&mut state);
        checkpoint.bytes.insert("environment".into(), state);
        checkpoint.header.insert("iteration".into(), self.iteration.to_string());
        checkpoint.header.insert("adam_steps".into(), self.adam.steps.to_string());
        checkpoint.header.insert("seed".into(), self.seed.to_string());
        checkpoint
    }

    /// Goes on where [`Trainer::checkpoint`] was taken.
    ///
    /// # Errors
    /// The checkpoint is of other networks, environments or another seed; then nothing of this learner is of use.
    pub fn restore(&mut self, checkpoint: &Checkpoint) -> Result<(), TrainError> {
        let seed: u64 = checkpoint.number("seed")?;
        if seed != self.seed {
            return Err(TrainError::Shape(format!("the checkpoint's seed is {seed}, must be {}", self.seed)));
        }
        self.warm_start(checkpoint)?;
        let row = self.rollout.num_envs * self.rollout.observation_dim;
        checkpoint.read_into("observations", &mut self.rollout.observations[..row])?;
        checkpoint.read_into("episode_returns", &mut self.episode_returns)?;
        checkpoint.read_into("episode_lengths", &mut self.episode_lengths)?;
        checkpoint.read_into("finished", &mut self.finished)?;
        self.iteration = checkpoint.number("iteration")?;
        self.env.load_state(checkpoint.state("environment")?).map_err(TrainError::Environment)
    }

    /// Takes weights, optimizer and learning rate from another run of the same networks; the environments stay.
    ///
    /// # Errors
    /// The checkpoint is of other networks.
    pub fn warm_start(&mut self, checkpoint: &Checkpoint) -> Result<(), TrainError> {
        checkpoint.read_into("parameters", &mut self.parameters)?;
        checkpoint.read_into("adam/first_moment", &mut self.adam.first_moment)?;
        checkpoint.read_into("adam/second_moment", &mut self.adam.second_moment)?;
        let mut rate = [0.0];
        checkpoint.read_into("learning_rate", &mut rate)?;
        self.learning_rate = rate[0];
        self.adam.steps = checkpoint.number("adam_steps")?;
        Ok(())
    }

    /// Takes the mean policy from a network that takes raw observations; values, optimizer and noise begin anew.
    ///
    /// # Errors
    /// The network is of another shape.
    pub fn warm_start_policy(&mut self, policy: &Mlp) -> Result<(), TrainError> {
        let actor = self.networks.actor.num_parameters();
        let read =
            self.networks.actor.read_mlp(policy, &self.observation_scale, &mut self.parameters[..actor]);
        read.map_err(TrainError::Shape)
    }
}
