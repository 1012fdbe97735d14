//! The gradient of PPO's loss over a minibatch, by threads, with the same bits for any number of them.
//!
//! Rows go in tiles of fixed size through forward, loss and backward. A fixed number of slots each take every n-th
//! tile in order and add up a gradient of their own; the slots are then added in order (`partials.rs`). Threads, and ranks, only
//! decide who works on a slot, never what is added to what.

use rayon::prelude::*;

use crate::{
    config::Config,
    exchange::Exchange,
    loss::{Gaussian, LossSums},
    network::{Architecture, PackedNetwork, store_rows},
    panels::{LANES, Precision},
    partials::Partials,
    rollout::Rollout,
    slot::Slot,
    symmetry::Symmetry,
};

/// Rows that go through the networks together.
pub(crate) const TILE: usize = 256;
/// Parameters a thread squares at a time.
const CHUNK: usize = 16_384;
/// Marks a row that is to be learned from in its mirror image.
pub(crate) const MIRRORED: u32 = 1 << 31;

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

    /// Random weights and biases, the same deviation of all actions.
    pub(crate) fn initial_parameters(&self, seed: u64, config: &Config) -> Vec<f32> {
        let mut parameters = vec![config.initial_std.ln(); self.num_parameters()];
        let (actor, critic, _) = self.split_mut(&mut parameters);
        self.actor.initialize(seed, 0, config.initial_output_scale, actor);
        self.critic.initialize(seed, 1, 1.0, critic);
        parameters
    }

    /// The three parts of a parameter or gradient vector.
    pub(crate) fn split<'a>(&self, all: &'a [f32]) -> (&'a [f32], &'a [f32], &'a [f32]) {
        let (actor, rest) = all.split_at(self.actor.num_parameters());
        let (critic, log_std) = rest.split_at(self.critic.num_parameters());
        (actor, critic, log_std)
    }
    pub(crate) fn split_mut<'a>(&self, all: &'a mut [f32]) -> (&'a mut [f32], &'a mut [f32], &'a mut [f32]) {
        let (actor, rest) = all.split_at_mut(self.actor.num_parameters());
        let (critic, log_std) = rest.split_at_mut(self.critic.num_parameters());
        (actor, critic, log_std)
    }
}

/// The arithmetic of training, in one precision: the gradient, and evaluation for the rollout.
pub(crate) trait Engine: Send {
    /// Takes new parameters.
    fn load(&mut self, networks: &Networks, parameters: &[f32]);
    /// Fills `gradient` with that of the mean loss over the samples `rows`, for the parameters loaded. Of `rows`, which are as
    /// many on all ranks, each reads those of its own slots.
    fn differentiate(
        &mut self,
        objective: Objective<'_>,
        rollout: &Rollout,
        rows: &[u32],
        exchange: &dyn Exchange,
        gradient: &mut [f32],
    ) -> MinibatchLoss;
    /// Whose slots are whose.
    fn partials(&self) -> &Partials;
    /// Mean actions (if asked for) and values of scaled observations, for the parameters loaded.
    fn evaluate(
        &mut self,
        networks: &Networks,
        observations: &[f32],
        means: Option<&mut [f32]>,
        values: &mut [f32],
    );
}

/// Networks and scratch memory in one precision; all of it made once.
#[derive(Clone, Debug)]
pub(crate) struct Workspace<P: Precision> {
    actor: PackedNetwork<P>,
    critic: PackedNetwork<P>,
    /// This rank's.
    slots: Vec<Slot<P>>,
    partials: Partials,
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
    /// Mean squared distance from the smooth means.
    pub(crate) roughness: f64,
    /// Euclidean length of the gradient.
    pub(crate) gradient_norm: f64,
}

/// What the gradient is taken of.
#[derive(Clone, Copy)]
pub(crate) struct Objective<'a> {
    pub(crate) config: &'a Config,
    pub(crate) networks: &'a Networks,
    /// The policy's noise now, and when the rollout was made.
    pub(crate) noise: &'a Gaussian,
    pub(crate) old_noise: &'a Gaussian,
    pub(crate) symmetry: &'a Symmetry,
}

impl<P: Precision> Workspace<P> {
    pub(crate) fn new(networks: &Networks, partials: Partials) -> Self {
        let slot = Slot::new(networks);
        let (actor, critic) = (networks.actor.packed(), networks.critic.packed());
        Self { actor, critic, slots: vec![slot; partials.own().count()], partials }
    }

    /// Adds the slots of all ranks in order, and the entropy bonus; returns the length of the sum.
    fn add_slots(&mut self, objective: Objective<'_>, exchange: &dyn Exchange, gradient: &mut [f32]) -> f64 {
        let own: Vec<&[f32]> = self.slots.iter().map(|slot| &slot.gradient[..]).collect();
        self.partials.add(&own, exchange, gradient);
        // The entropy of a Gaussian is the sum of its log standard deviations and a constant.
        let (_, _, log_std) = objective.networks.split_mut(gradient);
        for gradient in log_std {
            *gradient -= objective.config.entropy_coefficient;
        }
        if let Some(images) = objective.symmetry.of_networks() {
            images.average(gradient);
        }
        let squares: Vec<f64> = gradient
            .par_chunks(CHUNK)
            .map(|chunk| chunk.iter().map(|&value| f64::from(value) * f64::from(value)).sum())
            .collect();
        squares.iter().sum::<f64>().sqrt()
    }

    /// Adds the sums of all ranks' slots in order.
    fn add_sums(&self, exchange: &dyn Exchange) -> LossSums {
        let own: Vec<LossSums> = self.slots.iter().map(|slot| slot.sums).collect();
        let in_order = if exchange.ranks() == 1 {
            own
        } else {
            let own: Vec<u8> = own.into_iter().flat_map(LossSums::to_bytes).collect();
            let all = exchange.all_gather(&own);
            let sums = |bytes: &Vec<u8>| bytes.as_chunks().0.iter().map(LossSums::from_bytes).collect();
            self.partials.in_order(&all.iter().map(sums).collect::<Vec<Vec<LossSums>>>())
        };
        in_order.iter().fold(LossSums::default(), |mut sum, slot| {
            sum.add(slot);
            sum
        })
    }
}

impl<P: Precision> Engine for Workspace<P> {
    fn partials(&self) -> &Partials {
        &self.partials
    }

    fn load(&mut self, networks: &Networks, parameters: &[f32]) {
        let (actor, critic, _) = networks.split(parameters);
        networks.actor.pack(actor, &mut self.actor);
        networks.critic.pack(critic, &mut self.critic);
    }

    fn differentiate(
        &mut self,
        objective: Objective<'_>,
        rollout: &Rollout,
        rows: &[u32],
        exchange: &dyn Exchange,
        gradient: &mut [f32],
    ) -> MinibatchLoss {
        let mut all = rows.to_vec();
        if objective.symmetry.of_samples().is_some() {
            // The rows come in random order: every other one is a random half, another in each epoch.
            all.iter_mut().skip(1).step_by(2).for_each(|row| *row |= MIRRORED);
        }
        let originals = all.iter().filter(|&row| row & MIRRORED == 0).count() as f64;
        let weight = 1.0 / all.len() as f32;
        let Self { actor, critic, slots, partials } = self;
        let (numbers, count) = (partials.own().collect::<Vec<_>>(), partials.count());
        slots.par_iter_mut().zip(numbers).for_each(|(slot, number)| {
            slot.gradient.fill(0.0);
            slot.sums = LossSums::default();
            for tile in all.chunks(TILE).skip(number).step_by(count) {
                slot.tile((actor, critic), objective, rollout, tile, weight);
            }
        });
        let sums = self.add_sums(exchange);
        let gradient_norm = self.add_slots(objective, exchange, gradient);
        let count = all.len() as f64;
        MinibatchLoss {
            surrogate: sums.surrogate / count,
            value: sums.value / count,
            kl: sums.kl / originals,
            clipped: sums.clipped / count,
            roughness: sums.roughness / count,
            gradient_norm,
        }
    }

    fn evaluate(
        &mut self,
        networks: &Networks,
        observations: &[f32],
        means: Option<&mut [f32]>,
        values: &mut [f32],
    ) {
        let Self { actor, critic, slots, .. } = self;
        let (width, actions) = (networks.actor.inputs(), networks.actions);
        let span = values.len().div_ceil(slots.len()).next_multiple_of(LANES);
        let mut means: Vec<Option<&mut [f32]>> = match means {
            Some(means) => means.chunks_mut(span * actions).map(Some).collect(),
            None => values.chunks(span).map(|_| None).collect(),
        };
        slots
            .par_iter_mut()
            .zip(observations.par_chunks(span * width))
            .zip(means.par_iter_mut())
            .zip(values.par_chunks_mut(span))
            .for_each(|(((slot, observations), means), values)| {
                for (tile, input) in observations.chunks(TILE * width).enumerate() {
                    let (start, rows) = (tile * TILE, input.len() / width);
                    store_rows::<P>(input, width, rows, &mut slot.input);
                    networks.critic.forward(critic, rows, &slot.input, &mut slot.critic);
                    values[start..start + rows].copy_from_slice(&slot.critic.output[..rows]);
                    if let Some(means) = means {
                        networks.actor.forward(actor, rows, &slot.input, &mut slot.actor);
                        let output = &slot.actor.output[..rows * actions];
                        means[start * actions..][..output.len()].copy_from_slice(output);
                    }
                }
            });
    }
}

#[cfg(test)]
mod tests {
    use policy::Mirror;
    use spatial::{Philox, Purpose};

    use super::*;
    use crate::{exchange::Alone, panels::Single, symmetry::Images};

    fn problem() -> (Config, Networks, Vec<f32>, Rollout) {
        let networks = Networks {
            actor: Architecture::new(4, &[6], 2),
            critic: Architecture::new(4, &[5], 1),
            actions: 2,
        };
        let config = Config { initial_std: (-0.2_f32).exp(), smoothness: 0.3, ..Config::default() };
        let parameters = networks.initial_parameters(1, &config);
        let mut rollout = Rollout::new(700, 1, 4, 2);
        let mut random = Philox::new(2, 0, 0, 0, Purpose::Evaluation);
        let Rollout { observations, actions, means, smooth_means, .. } = &mut rollout;
        for value in [observations, actions, means, smooth_means].into_iter().flatten() {
            *value = random.uniform(-1.0, 1.0);
        }
        for i in 0..700 {
            let (action, mean) = (&rollout.actions[2 * i..2 * i + 2], &rollout.means[2 * i..2 * i + 2]);
            rollout.log_probabilities[i] = Gaussian::new(&[-0.1; 2]).log_probability(action, mean);
            rollout.values[i] = random.uniform(-0.1, 0.1);
            rollout.advantages[i] = random.normal();
            rollout.value_targets[i] = random.uniform(-1.0, 1.0);
        }
        (config, networks, parameters, rollout)
    }

    fn mirror() -> Mirror {
        Mirror {
            observation: vec![(1, 1.0), (0, 1.0), (2, -1.0), (3, 1.0)],
            action: vec![(1, -1.0), (0, -1.0)],
        }
    }

    fn compute(symmetry: &Symmetry, parameters: &[f32]) -> (MinibatchLoss, Vec<f32>, f64) {
        let (config, networks, _, rollout) = problem();
        let (_, _, log_std) = networks.split(parameters);
        let (noise, old_noise) = (&Gaussian::new(log_std), &Gaussian::new(&[-0.1; 2]));
        let networks = &networks;
        let objective = Objective { config: &config, networks, noise, old_noise, symmetry };
        let mut workspace = Workspace::<Single>::new(networks, Partials::new(1, &Alone));
        workspace.load(networks, parameters);
        let mut gradient = vec![0.0; parameters.len()];
        let rows: Vec<u32> = (0..700).collect();
        let loss = workspace.differentiate(objective, &rollout, &rows, &Alone, &mut gradient);
        let entropy: f32 = log_std.iter().sum();
        let total = loss.surrogate + loss.value + f64::from(config.smoothness) * loss.roughness
            - f64::from(config.entropy_coefficient * entropy);
        (loss, gradient, total)
    }

    #[test]
    fn the_gradient_is_the_difference_of_the_loss_for_every_parameter() {
        let (_, _, parameters, _) = problem();
        for symmetry in [Symmetry::None, Symmetry::Samples(mirror())] {
            let (_, gradient, _) = compute(&symmetry, &parameters);
            for i in 0..parameters.len() {
                let mut moved = parameters.clone();
                moved[i] += 2e-3;
                let above = compute(&symmetry, &moved).2;
                moved[i] -= 4e-3;
                let slope = (above - compute(&symmetry, &moved).2) / 4e-3;
                let error = (f64::from(gradient[i]) - slope).abs();
                assert!(error < 1e-3 + 0.02 * slope.abs(), "parameter {i}: {} and {slope}", gradient[i]);
            }
        }
    }

    #[test]
    fn the_gradient_of_symmetric_networks_is_averaged_and_so_is_its_length() {
        let (_, networks, parameters, _) = problem();
        let images = Images::new(&networks, &mirror());
        let (_, mut expected, _) = compute(&Symmetry::None, &parameters);
        images.average(&mut expected);
        let (loss, gradient, _) = compute(&Symmetry::Networks(images), &parameters);
        assert_eq!(gradient, expected);
        let length = expected.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>().sqrt();
        assert!((loss.gradient_norm - length).abs() < 1e-9 * length);
    }

    #[test]
    fn threads_do_not_change_a_bit() {
        let (_, _, parameters, _) = problem();
        let gradients = [1, 2, 7].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| compute(&Symmetry::None, &parameters).1)
        });
        assert_eq!(gradients[0], gradients[1]);
        assert_eq!(gradients[0], gradients[2]);
    }
}
