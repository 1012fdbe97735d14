//! Where a learner begins other than at nothing: its own checkpoint, another run's, or a policy alone.

use policy::{Checkpoint, Mlp, VecEnv};

use super::{TrainError, Trainer};

impl<E: VecEnv> Trainer<E> {
    /// Everything a resumed run needs to give the same bits as one never stopped, on any number of ranks. Waits for all of them;
    /// whole on rank 0 only.
    pub fn checkpoint(&self) -> Checkpoint {
        let mut checkpoint = Checkpoint::default();
        checkpoint.insert("parameters", &self.parameters);
        checkpoint.insert("observation_scale", &self.observation_scale);
        checkpoint.insert("adam/first_moment", &self.adam.first_moment);
        checkpoint.insert("adam/second_moment", &self.adam.second_moment);
        let row = self.rollout.num_envs * self.rollout.observation_dim;
        let gather = |own: &[f32]| self.team.gather_to_lead(own);
        checkpoint.insert("observations", &gather(&self.rollout.observations[..row]));
        checkpoint.insert("episode_returns", &gather(&self.episode_returns));
        checkpoint.insert("episode_lengths", &gather(&self.episode_lengths));
        checkpoint.insert("finished", &self.finished);
        checkpoint.insert("learning_rate", &[self.learning_rate]);
        checkpoint.bytes.insert("environment".into(), self.env_states());
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
        let (envs, total, width) =
            (self.team.own_envs(), self.team.total_envs(), self.rollout.observation_dim);
        let read = |name: &str, width: usize, own: &mut [f32]| -> Result<(), TrainError> {
            let mut all = vec![0.0; total * width];
            checkpoint.read_into(name, &mut all)?;
            own.copy_from_slice(&all[envs.start * width..envs.end * width]);
            Ok(())
        };
        read("observations", width, &mut self.rollout.observations[..envs.len() * width])?;
        read("episode_returns", 1, &mut self.episode_returns)?;
        read("episode_lengths", 1, &mut self.episode_lengths)?;
        checkpoint.read_into("finished", &mut self.finished)?;
        self.iteration = checkpoint.number("iteration")?;
        let state = self.own_state(checkpoint.state("environment")?);
        self.env.load_state(&state).map_err(TrainError::Environment)
    }

    /// The state of the environments of all ranks, on rank 0.
    fn env_states(&self) -> Vec<u8> {
        let mut own = Vec::new();
        self.env.save_state(&mut own);
        let mut states = self.team.exchange().gather(&own).into_iter();
        let mut all = states.next().unwrap_or_default();
        states.for_each(|state| all.extend_from_slice(&state[self.env.common_state_len()..]));
        all
    }

    /// What is common to all environments, and this rank's part of the rest.
    fn own_state(&self, all: &[u8]) -> Vec<u8> {
        let (common, each) = all.split_at(self.env.common_state_len().min(all.len()));
        let (envs, total) = (self.team.own_envs(), self.team.total_envs());
        let own = &each[each.len() * envs.start / total..each.len() * envs.end / total];
        [common, own].concat()
    }

    /// Takes weights, optimizer and learning rate from another run of the same networks; the environments stay.
    ///
    /// # Errors
    /// The checkpoint is of other networks or of observations scaled otherwise, its weights are no finite numbers, or they are to be
    /// symmetric and are not.
    pub fn warm_start(&mut self, checkpoint: &Checkpoint) -> Result<(), TrainError> {
        self.check_scale(checkpoint)?;
        checkpoint.read_into("parameters", &mut self.parameters)?;
        checkpoint.read_into("adam/first_moment", &mut self.adam.first_moment)?;
        checkpoint.read_into("adam/second_moment", &mut self.adam.second_moment)?;
        let mut rate = [0.0];
        checkpoint.read_into("learning_rate", &mut rate)?;
        self.learning_rate = rate[0];
        self.adam.steps = checkpoint.number("adam_steps")?;
        self.check_parameters()
    }

    /// Takes the mean policy from a network that takes raw observations; values, optimizer and noise begin anew.
    ///
    /// # Errors
    /// The network is of another shape, its weights are no finite numbers, or it is to be symmetric and is not.
    pub fn warm_start_policy(&mut self, policy: &Mlp) -> Result<(), TrainError> {
        let actor = self.networks.actor.num_parameters();
        let read =
            self.networks.actor.read_mlp(policy, &self.observation_scale, &mut self.parameters[..actor]);
        read.map_err(TrainError::Shape)?;
        self.check_parameters()
    }

    /// Weights are those of scaled observations. Checkpoints of before do not say the scale.
    fn check_scale(&self, checkpoint: &Checkpoint) -> Result<(), TrainError> {
        if !checkpoint.tensors.contains_key("observation_scale") {
            return Ok(());
        }
        let mut scale = vec![0.0; self.observation_scale.len()];
        checkpoint.read_into("observation_scale", &mut scale)?;
        let differs = scale.iter().zip(&self.observation_scale).position(|(found, own)| found != own);
        differs.map_or(Ok(()), |i| {
            let (found, own) = (scale[i], self.observation_scale[i]);
            let message = format!(
                "observation {i} was scaled by {found}, must be by {own}; begin with the policy.onnx of that run, which takes raw ones"
            );
            Err(TrainError::Shape(message))
        })
    }

    fn check_parameters(&self) -> Result<(), TrainError> {
        if let Some((i, value)) = self.parameters.iter().enumerate().find(|(_, value)| !value.is_finite()) {
            return Err(TrainError::Shape(format!("parameter {i} is {value}, must be finite")));
        }
        if self.symmetry.of_networks().is_some_and(|images| !images.holds(&self.parameters)) {
            let message = "these weights are not left–right symmetric, so symmetry must be \"samples\" or \"none\" (--set ppo.symmetry=none)";
            return Err(TrainError::Shape(message.into()));
        }
        Ok(())
    }
}
