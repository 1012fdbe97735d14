//! The gradient of PPO's loss over a minibatch, by threads, with the same bits for any number of them.
//!
//! Rows go in tiles of fixed size through forward, loss and backward. A fixed number of slots each take every n-th
//! tile in order and add up a gradient of their own; the slots are then added in order. Threads only decide who works on a
//! slot, never what is added to what.

use rayon::prelude::*;

use policy::Mirror;

use crate::{
    config::Config,
    loss::{LossSums, Sample, Spread, kl_divergence, surrogate, value_loss},
    network::{Activations, Architecture},
    rollout::Rollout,
};

/// Rows that go through the networks together.
const TILE: usize = 256;
/// Partial gradients; more than threads of a desktop, few enough to add up quickly.
const SLOTS: usize = 8;
/// Parameters a thread adds up at a time.
const CHUNK: usize = 16_384;
/// Marks a row that is to be learned from in its mirror image.
const MIRRORED: u32 = 1 << 31;

/// Actor and critic, and where their parameters are: actor, critic, log standard deviations.
#[derive(Clone, Debug)]
pub(crate) struct Networks {
    pub(crate) actor: Architecture,
    pub(crate) critic: Architecture,
    pub(crate) actions: usize,
}

impl Networks {
    pub(crate) fn num_parameters(&self) -> usize {
        self.actor.num_parameters() + self.critic.num_parameters() + self.actions
    }
    /// The three parts of a parameter or gradient vector.
    pub(crate) fn split<'a>(&self, all: &'a [f32]) -> (&'a [f32], &'a [f32], &'a [f32]) {
        let (actor, rest) = all.split_at(self.actor.num_parameters());
        let (critic, log_std) = rest.split_at(self.critic.num_parameters());
        (actor, critic, log_std)
    }
    fn split_mut<'a>(&self, all: &'a mut [f32]) -> (&'a mut [f32], &'a mut [f32], &'a mut [f32]) {
        let (actor, rest) = all.split_at_mut(self.actor.num_parameters());
        let (critic, log_std) = rest.split_at_mut(self.critic.num_parameters());
        (actor, critic, log_std)
    }
}

/// One accumulator and its scratch memory.
#[derive(Clone, Debug)]
struct Slot {
    actor: Activations,
    critic: Activations,
    gradient: Vec<f32>,
    sums: LossSums,
    mirrored_action: Vec<f32>,
    mirrored_mean: Vec<f32>,
}

/// Scratch memory and result of gradient computations.
#[derive(Clone, Debug)]
pub(crate) struct GradientWorkspace {
    slots: Vec<Slot>,
    /// The gradient of the mean loss.
    pub(crate) gradient: Vec<f32>,
}

/// What a minibatch showed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MinibatchLoss {
    /// Mean clipped surrogate.
    pub(crate) surrogate: f64,
    /// Mean value loss.
    pub(crate) value: f64,
    /// Mean divergence of the policy from the rollout's.
    pub(crate) kl: f64,
    /// Share of samples beyond the clip range.
    pub(crate) clipped: f64,
    /// Euclidean length of the gradient.
    pub(crate) gradient_norm: f64,
}

/// What the gradient is taken of.
#[derive(Clone, Copy)]
pub(crate) struct Objective<'a> {
    pub(crate) config: &'a Config,
    pub(crate) networks: &'a Networks,
    pub(crate) parameters: &'a [f32],
    pub(crate) old_log_std: &'a [f32],
    pub(crate) mirror: Option<&'a Mirror>,
}

impl GradientWorkspace {
    pub(crate) fn new(networks: &Networks) -> Self {
        let slot = Slot {
            actor: networks.actor.activations(TILE),
            critic: networks.critic.activations(TILE),
            gradient: vec![0.0; networks.num_parameters()],
            sums: LossSums::default(),
            mirrored_action: vec![0.0; networks.actions],
            mirrored_mean: vec![0.0; networks.actions],
        };
        Self { slots: vec![slot; SLOTS], gradient: vec![0.0; networks.num_parameters()] }
    }

    /// Fills `gradient` with that of the mean loss over the samples `rows`.
    pub(crate) fn compute(
        &mut self,
        objective: Objective<'_>,
        rollout: &Rollout,
        rows: &[u32],
    ) -> MinibatchLoss {
        let mut all = rows.to_vec();
        if objective.mirror.is_some() {
            // The rows come in random order: every other one is a random half, another in each epoch.
            all.iter_mut().skip(1).step_by(2).for_each(|row| *row |= MIRRORED);
        }
        let originals = all.iter().filter(|&row| row & MIRRORED == 0).count() as f64;
        let weight = 1.0 / all.len() as f32;
        self.slots.par_iter_mut().enumerate().for_each(|(i, slot)| {
            slot.gradient.fill(0.0);
            slot.sums = LossSums::default();
            for tile in all.chunks(TILE).skip(i).step_by(SLOTS) {
                slot.tile(objective, rollout, tile, weight);
            }
        });
        let sums = self.slots.iter().fold(LossSums::default(), |mut sum, slot| {
            sum.add(&slot.sums);
            sum
        });
        let gradient_norm = self.add_slots(objective);
        let count = all.len() as f64;
        MinibatchLoss {
            surrogate: sums.surrogate / count,
            value: sums.value / count,
            kl: sums.kl / originals,
            clipped: sums.clipped / count,
            gradient_norm,
        }
    }

    /// Adds the slots in order and the entropy bonus; returns the length of the sum.
    fn add_slots(&mut self, objective: Objective<'_>) -> f64 {
        let slots = &self.slots;
        self.gradient.par_chunks_mut(CHUNK).enumerate().for_each(|(i, chunk)| {
            let start = i * CHUNK;
            chunk.copy_from_slice(&slots[0].gradient[start..start + chunk.len()]);
            for slot in &slots[1..] {
                for (sum, value) in chunk.iter_mut().zip(&slot.gradient[start..]) {
                    *sum += value;
                }
            }
        });
        // The entropy of a Gaussian is the sum of its log standard deviations and a constant.
        let (_, _, log_std) = objective.networks.split_mut(&mut self.gradient);
        for gradient in log_std {
            *gradient -= objective.config.entropy_coefficient;
        }
        let squares: Vec<f64> = self
            .gradient
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().map(|&value| f64::from(value) * f64::from(value)).sum())
            .collect();
        squares.iter().sum::<f64>().sqrt()
    }
}

impl Slot {
    /// Takes one tile of rows through forward, loss and backward.
    fn tile(&mut self, objective: Objective<'_>, rollout: &Rollout, rows: &[u32], weight: f32) {
        let Objective { networks, parameters, .. } = objective;
        self.load(objective, rollout, rows);
        let (actor, critic, log_std) = networks.split(parameters);
        networks.actor.forward(actor, rows.len(), &mut self.actor);
        networks.critic.forward(critic, rows.len(), &mut self.critic);
        let spread = Spread { log_std, old_log_std: objective.old_log_std };
        self.differentiate(objective, rollout, rows, spread, weight);
        let (actor_gradient, critic_gradient, _) = networks.split_mut(&mut self.gradient);
        networks.actor.backward(actor, rows.len(), &mut self.actor, actor_gradient);
        networks.critic.backward(critic, rows.len(), &mut self.critic, critic_gradient);
    }

    /// Gathers the observations of the rows.
    fn load(&mut self, objective: Objective<'_>, rollout: &Rollout, rows: &[u32]) {
        let width = rollout.observation_dim;
        let input =
            self.actor.values[0].chunks_exact_mut(width).zip(self.critic.values[0].chunks_exact_mut(width));
        for (&row, (actor, critic)) in rows.iter().zip(input) {
            let sample = (row & !MIRRORED) as usize;
            let observation = &rollout.observations[sample * width..][..width];
            match objective.mirror.filter(|_| row & MIRRORED != 0) {
                Some(mirror) => Mirror::apply(&mirror.observation, observation, actor),
                None => actor.copy_from_slice(observation),
            }
            critic.copy_from_slice(actor);
        }
    }

    /// Fills the gradients of the networks' outputs.
    fn differentiate(
        &mut self,
        objective: Objective<'_>,
        rollout: &Rollout,
        rows: &[u32],
        spread: Spread<'_>,
        weight: f32,
    ) {
        let Objective { config, networks, .. } = objective;
        let actions = networks.actions;
        let (_, _, log_std_gradient) = networks.split_mut(&mut self.gradient);
        let means = last(&self.actor.values).chunks_exact(actions);
        let mean_gradients = last_mut(&mut self.actor.gradients).chunks_exact_mut(actions);
        let values = last(&self.critic.values).iter();
        let value_gradients = last_mut(&mut self.critic.gradients).iter_mut();
        let outputs = means.zip(mean_gradients).zip(values.zip(value_gradients));
        for (&row, ((mean, mean_gradient), (&value, value_gradient))) in rows.iter().zip(outputs) {
            let i = (row & !MIRRORED) as usize;
            let mut sample = Sample {
                action: &rollout.actions[i * actions..][..actions],
                old_mean: &rollout.means[i * actions..][..actions],
                old_log_probability: rollout.log_probabilities[i],
                old_value: rollout.values[i],
                advantage: rollout.advantages[i],
                value_target: rollout.value_targets[i],
            };
            if let Some(mirror) = objective.mirror.filter(|_| row & MIRRORED != 0) {
                Mirror::apply(&mirror.action, sample.action, &mut self.mirrored_action);
                Mirror::apply(&mirror.action, sample.old_mean, &mut self.mirrored_mean);
                sample.action = &self.mirrored_action;
                sample.old_mean = &self.mirrored_mean;
            } else {
                self.sums.kl += f64::from(kl_divergence(sample.old_mean, mean, spread));
            }
            let sums = surrogate(config, sample, mean, spread, weight, mean_gradient, log_std_gradient);
            self.sums.add(&sums);
            let (loss, gradient) = value_loss(config, sample, value, weight);
            self.sums.value += loss;
            *value_gradient = gradient;
        }
    }
}

fn last(buffers: &[Vec<f32>]) -> &[f32] {
    buffers.last().expect("a network has an output")
}

fn last_mut(buffers: &mut [Vec<f32>]) -> &mut [f32] {
    buffers.last_mut().expect("a network has an output")
}

#[cfg(test)]
mod tests {
    use spatial::{Philox, Purpose};

    use super::*;
    use crate::loss::log_probability;

    fn problem() -> (Config, Networks, Vec<f32>, Rollout) {
        let networks = Networks {
            actor: Architecture::new(4, &[6], 2),
            critic: Architecture::new(4, &[5], 1),
            actions: 2,
        };
        let mut parameters = vec![-0.2; networks.num_parameters()];
        let actor = networks.actor.num_parameters();
        networks.actor.initialize(1, 0, &mut parameters[..actor]);
        networks.critic.initialize(1, 1, &mut parameters[actor..][..networks.critic.num_parameters()]);
        let mut rollout = Rollout::new(700, 1, 4, 2);
        let mut random = Philox::new(2, 0, 0, 0, Purpose::Evaluation);
        for value in rollout.observations.iter_mut().chain(&mut rollout.actions).chain(&mut rollout.means) {
            *value = random.uniform(-1.0, 1.0);
        }
        for i in 0..700 {
            let (action, mean) = (&rollout.actions[2 * i..2 * i + 2], &rollout.means[2 * i..2 * i + 2]);
            rollout.log_probabilities[i] = log_probability(action, mean, &[-0.1; 2]);
            rollout.values[i] = random.uniform(-0.1, 0.1);
            rollout.advantages[i] = random.normal();
            rollout.value_targets[i] = random.uniform(-1.0, 1.0);
        }
        (Config::default(), networks, parameters, rollout)
    }

    fn mirror() -> Mirror {
        Mirror {
            observation: vec![(1, 1.0), (0, 1.0), (2, -1.0), (3, 1.0)],
            action: vec![(1, -1.0), (0, -1.0)],
        }
    }

    fn compute(mirror: Option<&Mirror>, parameters: &[f32]) -> (MinibatchLoss, Vec<f32>, f64) {
        let (config, networks, _, rollout) = problem();
        let objective =
            Objective { config: &config, networks: &networks, parameters, old_log_std: &[-0.1; 2], mirror };
        let mut workspace = GradientWorkspace::new(&networks);
        let rows: Vec<u32> = (0..700).collect();
        let loss = workspace.compute(objective, &rollout, &rows);
        let (_, _, log_std) = networks.split(parameters);
        let entropy: f32 = log_std.iter().sum();
        let total = loss.surrogate + loss.value - f64::from(config.entropy_coefficient * entropy);
        (loss, workspace.gradient, total)
    }

    #[test]
    fn the_gradient_is_the_difference_of_the_loss_for_every_parameter() {
        let (_, _, parameters, _) = problem();
        for mirror in [None, Some(mirror())] {
            let (_, gradient, _) = compute(mirror.as_ref(), &parameters);
            for i in 0..parameters.len() {
                let mut moved = parameters.clone();
                moved[i] += 2e-3;
                let above = compute(mirror.as_ref(), &moved).2;
                moved[i] -= 4e-3;
                let slope = (above - compute(mirror.as_ref(), &moved).2) / 4e-3;
                let error = (f64::from(gradient[i]) - slope).abs();
                assert!(error < 1e-3 + 0.02 * slope.abs(), "parameter {i}: {} and {slope}", gradient[i]);
            }
        }
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let (_, _, parameters, _) = problem();
        let gradients = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| compute(None, &parameters).1)
        });
        assert_eq!(gradients[0], gradients[1]);
        assert_eq!(gradients[0], gradients[2]);
    }
}
