//! A partial gradient: tiles of rows through forward, loss and backward.

use policy::Mirror;

use crate::{
    gradient::{MIRRORED, Networks, Objective, TILE},
    loss::{LossSums, Sample, surrogate, value_loss},
    network::{Activations, PackedNetwork, store_rows},
    panels::Precision,
    rollout::Rollout,
};

/// One partial gradient and its scratch memory.
#[derive(Clone, Debug)]
pub(crate) struct Slot<P: Precision> {
    observations: Vec<f32>,
    pub(crate) input: P::Panels,
    pub(crate) actor: Activations<P>,
    pub(crate) critic: Activations<P>,
    pub(crate) gradient: Vec<f32>,
    pub(crate) sums: LossSums,
    mirrored_action: Vec<f32>,
    mirrored_mean: Vec<f32>,
    mirrored_smooth_mean: Vec<f32>,
}

impl<P: Precision> Slot<P> {
    pub(crate) fn new(networks: &Networks) -> Self {
        let inputs = networks.actor.inputs();
        Self {
            observations: vec![0.0; TILE * inputs],
            input: P::panels(TILE, inputs),
            actor: networks.actor.activations(TILE),
            critic: networks.critic.activations(TILE),
            gradient: vec![0.0; networks.num_parameters()],
            sums: LossSums::default(),
            mirrored_action: vec![0.0; networks.actions],
            mirrored_mean: vec![0.0; networks.actions],
            mirrored_smooth_mean: vec![0.0; networks.actions],
        }
    }

    /// Takes one tile of rows through forward, loss and backward.
    pub(crate) fn tile(
        &mut self,
        (actor, critic): (&PackedNetwork<P>, &PackedNetwork<P>),
        objective: Objective<'_>,
        rollout: &Rollout,
        rows: &[u32],
        weight: f32,
    ) {
        let Objective { networks, .. } = objective;
        self.load(objective, rollout, rows);
        networks.actor.forward(actor, rows.len(), &self.input, &mut self.actor);
        networks.critic.forward(critic, rows.len(), &self.input, &mut self.critic);
        self.differentiate(objective, rollout, rows, weight);
        let (actor_gradient, critic_gradient, _) = networks.split_mut(&mut self.gradient);
        networks.actor.backward(actor, rows.len(), &self.input, &mut self.actor, actor_gradient);
        networks.critic.backward(critic, rows.len(), &self.input, &mut self.critic, critic_gradient);
    }

    /// Gathers the observations of the rows.
    fn load(&mut self, objective: Objective<'_>, rollout: &Rollout, rows: &[u32]) {
        let width = rollout.observation_dim;
        for (&row, gathered) in rows.iter().zip(self.observations.chunks_exact_mut(width)) {
            let sample = (row & !MIRRORED) as usize;
            let observation = &rollout.observations[sample * width..][..width];
            match objective.symmetry.of_samples().filter(|_| row & MIRRORED != 0) {
                Some(mirror) => Mirror::apply(&mirror.observation, observation, gathered),
                None => gathered.copy_from_slice(observation),
            }
        }
        store_rows::<P>(&self.observations, width, rows.len(), &mut self.input);
    }

    /// Fills the gradients of the networks' outputs.
    fn differentiate(&mut self, objective: Objective<'_>, rollout: &Rollout, rows: &[u32], weight: f32) {
        let Objective { config, networks, noise, old_noise, .. } = objective;
        let actions = networks.actions;
        let (_, _, log_std_gradient) = networks.split_mut(&mut self.gradient);
        let means = self.actor.output.chunks_exact(actions);
        let mean_gradients = self.actor.output_gradient.chunks_exact_mut(actions);
        let values = self.critic.output.iter();
        let value_gradients = self.critic.output_gradient.iter_mut();
        let outputs = means.zip(mean_gradients).zip(values.zip(value_gradients));
        for (&row, ((mean, mean_gradient), (&value, value_gradient))) in rows.iter().zip(outputs) {
            let i = (row & !MIRRORED) as usize;
            let mut sample = Sample {
                action: &rollout.actions[i * actions..][..actions],
                old_mean: &rollout.means[i * actions..][..actions],
                smooth_mean: &rollout.smooth_means[i * actions..][..actions],
                old_log_probability: rollout.log_probabilities[i],
                old_value: rollout.values[i],
                advantage: rollout.advantages[i],
                value_target: rollout.value_targets[i],
            };
            if let Some(mirror) = objective.symmetry.of_samples().filter(|_| row & MIRRORED != 0) {
                Mirror::apply(&mirror.action, sample.action, &mut self.mirrored_action);
                Mirror::apply(&mirror.action, sample.old_mean, &mut self.mirrored_mean);
                sample.action = &self.mirrored_action;
                sample.old_mean = &self.mirrored_mean;
                Mirror::apply(&mirror.action, sample.smooth_mean, &mut self.mirrored_smooth_mean);
                sample.smooth_mean = &self.mirrored_smooth_mean;
            } else {
                self.sums.kl += f64::from(old_noise.divergence(sample.old_mean, noise, mean));
            }
            let sums = surrogate(config, sample, mean, noise, weight, mean_gradient, log_std_gradient);
            self.sums.add(&sums);
            let (loss, gradient) = value_loss(config, sample, value, weight);
            self.sums.value += loss;
            *value_gradient = gradient;
        }
    }
}
