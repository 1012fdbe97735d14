//! The gradient steps of an iteration.

use policy::VecEnv;
use spatial::{Philox, Purpose};

use super::{TrainError, Trainer};
use crate::{
    config::Config,
    gradient::{MinibatchLoss, Networks, Objective},
    loss::Gaussian,
};

impl<E: VecEnv> Trainer<E> {
    /// Takes the gradient steps of an iteration.
    pub(super) fn update(&mut self) -> Result<Vec<MinibatchLoss>, TrainError> {
        let samples = self.steps_per_iteration() as usize;
        let config = self.config.at(self.iteration);
        let size = samples / config.minibatches;
        // While only the critic learns the optimizer sees all gradients, so that its moments are those of the policy's, too.
        let untouched = (self.iteration < config.critic_iterations).then(|| self.parameters.clone());
        let old_noise = Gaussian::new(self.networks.split(&self.parameters).2);
        let mut losses = Vec::with_capacity(config.epochs * config.minibatches);
        for epoch in 0..config.epochs {
            let mut order = self.shuffled(samples, epoch);
            // Whole minibatches; what is left over is another sample each time.
            order.truncate(size * config.minibatches);
            let rollout = if self.team.is_alone() {
                &self.rollout
            } else {
                let (envs, exchange) = (self.team.envs(), self.team.exchange());
                self.deal.deal(&self.rollout, envs, self.engine.partials(), (&mut order, size), exchange);
                self.deal.rows()
            };
            for rows in order.chunks_exact(size) {
                let objective = Objective {
                    config: &config,
                    networks: &self.networks,
                    noise: &Gaussian::new(self.networks.split(&self.parameters).2),
                    old_noise: &old_noise,
                    symmetry: &self.symmetry,
                };
                self.engine.load(&self.networks, &self.parameters);
                let exchange = self.team.exchange();
                let loss = self.engine.differentiate(objective, rollout, rows, exchange, &mut self.gradient);
                if !(loss.surrogate + loss.value).is_finite() {
                    return Err(self.non_finite("the loss"));
                }
                if !loss.gradient_norm.is_finite() {
                    return Err(self.non_finite("the gradient"));
                }
                let scale = (f64::from(config.max_gradient_norm) / loss.gradient_norm).min(1.0) as f32;
                if let Some(untouched) = &untouched {
                    let [_, highest] = config.learning_rate_range;
                    self.adam.step(&mut self.parameters, &self.gradient, scale, highest);
                    keep_policy(&self.networks, untouched, &mut self.parameters);
                } else {
                    adapt(&mut self.learning_rate, loss.kl, &config);
                    self.adam.step(&mut self.parameters, &self.gradient, scale, self.learning_rate);
                }
                losses.push(loss);
            }
        }
        Ok(losses)
    }

    /// A random order of the samples (Fisher and Yates).
    fn shuffled(&self, samples: usize, epoch: usize) -> Vec<u32> {
        let mut random = Philox::new(self.seed, epoch, self.iteration as u32, 0, Purpose::Shuffle);
        let mut order: Vec<u32> = (0..samples as u32).collect();
        for i in (1..samples).rev() {
            order.swap(i, random.below(i as u32 + 1) as usize);
        }
        order
    }
}

/// Takes back what gradient steps since `before` did to the policy.
fn keep_policy(networks: &Networks, before: &[f32], parameters: &mut [f32]) {
    let (actor, _, log_std) = networks.split_mut(parameters);
    let (actor_before, _, log_std_before) = networks.split(before);
    actor.copy_from_slice(actor_before);
    log_std.copy_from_slice(log_std_before);
}

/// Slower when the policy moves too far from the rollout's, faster when it hardly moves (rsl_rl's rule).
fn adapt(learning_rate: &mut f32, kl: f64, config: &Config) {
    let desired = f64::from(config.desired_kl);
    let [low, high] = config.learning_rate_range;
    if kl > 2.0 * desired && desired > 0.0 {
        *learning_rate = (*learning_rate / 1.5).max(low);
    } else if kl > 0.0 && kl < 0.5 * desired {
        *learning_rate = (*learning_rate * 1.5).min(high);
    }
}
