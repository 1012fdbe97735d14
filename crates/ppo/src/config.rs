//! Settings of the learner.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What numbers the networks are computed with in training. Weights, sums and the optimizer are always single precision.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    #[default]
    F32,
    /// Products of bf16 numbers (8 bits of precision). About twice as fast on a processor with AVX-512 BF16; on any other
    /// computed in single precision, and a little slower than `F32`.
    Bf16,
}

impl Precision {
    /// Whether this processor has instructions for its products.
    pub fn is_accelerated(self) -> bool {
        match self {
            Self::F32 => true,
            #[cfg(target_arch = "x86_64")]
            Self::Bf16 => crate::brain::Brain::available(),
            #[cfg(not(target_arch = "x86_64"))]
            Self::Bf16 => false,
        }
    }
}

/// What a task's left–right symmetry is used for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, JsonSchema, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SymmetryBy {
    /// Nothing.
    #[default]
    None,
    /// Half of the samples are learned from in their mirror image, with the probability of the original in the ratio.
    Samples,
    /// Shown the mirror image of a state, networks give the mirror image of what they give for the state, so that every sample
    /// teaches its mirror image, too.
    Networks,
}

/// Settings of PPO. Defaults: Isaac Lab's ANYmal D rough task (`rsl_rl_ppo_cfg.py`) unless a field says otherwise.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Widths of the actor's hidden layers \[units; 1 to 8192\]. Source: Isaac Lab, 512, 256, 128 (rough locomotion); the
    /// paper, 128, 128, 128 (supervisor).
    pub actor_hidden: Vec<usize>,
    /// Widths of the critic's hidden layers \[units; 1 to 8192\]. Source: Isaac Lab, as the actor's; 256, 128, 64 in
    /// locomotion is ours.
    pub critic_hidden: Vec<usize>,
    /// Control steps of every environment in one iteration \[steps; 1 to 10000\]. Source: Isaac Lab, 24.
    pub steps_per_env: usize,
    /// Passes over an iteration's samples \[passes; 1 to 100\]. Source: Isaac Lab, 5; two were no faster (docs/findings.md).
    pub epochs: usize,
    /// Parts the samples are divided into; each gives one gradient step an epoch \[parts; 1 to 100000\]. Source: Isaac Lab,
    /// 4.
    pub minibatches: usize,
    /// Discount of a step \[1; above 0 to 1\]. Source: Isaac Lab, 0.99; the supervisor learns faster with 0.9
    /// (docs/findings.md).
    pub gamma: f32,
    /// Decay of advantage estimation \[1; 0 to 1\]. Source: Isaac Lab, 0.95; Schulman et al., High-dimensional continuous
    /// control using generalized advantage estimation, 2016.
    pub lambda: f32,
    /// How far the probability ratio may move from 1 before its gradient stops \[1; above 0 to 10\]. Source: Isaac Lab, 0.2;
    /// Schulman et al., Proximal policy optimization algorithms, 2017, section 3.
    pub clip_range: f32,
    /// Weight of the value loss \[1; 0 to 1000\]. Source: Isaac Lab, 1.
    pub value_loss_coefficient: f32,
    /// Whether the value may only move by `clip_range` an iteration. Source: Isaac Lab, true.
    pub clip_value_loss: bool,
    /// Weight of the entropy bonus \[1; 0 to 10\]. Source: Isaac Lab, 0.005.
    pub entropy_coefficient: f32,
    /// Learning rate at the start, within `learning_rate_range`; a run that begins from another run's checkpoint begins with that
    /// run's rate instead, even one outside the range \[1; above 0 to 1\]. Source: Isaac Lab, 1e-3.
    pub learning_rate: f32,
    /// Divergence between the old and the new policy that the learning rate is steered to; 0 keeps the rate \[1; 0 to 10\].
    /// Source: Isaac Lab, 0.01; 0.02 in locomotion is ours.
    pub desired_kl: f32,
    /// Weight of the squared distance between the mean action and halfway from the one before to the one after, as the policy that
    /// acted had them. Unlike a reward's price on changes it does not see the noise that explores \[1; 0 to 1000\]. Source: Mysore et
    /// al., Regularizing action policies for smooth control, 2021, equation 1 (there against the next mean alone); Isaac Lab, 0.
    pub smoothness: f32,
    /// Iterations over which `desired_kl` and `entropy_coefficient` fall in a straight line to `anneal_to`, so that the policy
    /// settles on the mean of what noisy gradients say; 0 keeps them \[iterations; 0 to 100000000\]. Source: docs/findings.md,
    /// "Annealing".
    pub anneal_iterations: u64,
    /// What is left of them in the end, as a share \[1; 0 to 1\]. Source: docs/findings.md, "Annealing".
    pub anneal_to: f32,
    /// Bounds of the learning rate, in order \[1; above 0 to 1\]. Source: rsl_rl, 1e-5 and 1e-2; large networks blew up above
    /// 1e-3 (docs/findings.md).
    pub learning_rate_range: [f32; 2],
    /// Longest gradient; a longer one is scaled down \[1; above 0 to 1000000\]. Source: Isaac Lab, 1.
    pub max_gradient_norm: f32,
    /// Standard deviation of every action at the start \[1; above 0 to 100\]. Source: Isaac Lab, 1.
    pub initial_std: f32,
    /// What the first weights and biases of the actor's last layer are multiplied by: with little, every mean action begins near 0 and
    /// chance decides less of what is tried first \[1; 0 to 1\]. Source: Andrychowicz et al., What matters in on-policy reinforcement
    /// learning, 2021, section 3.2, 0.01; rsl_rl, 1.
    pub initial_output_scale: f32,
    /// What the standard deviation of any action is cut off at before each iteration: a policy that has learned its task and a critic
    /// that knows it learn precision with little noise \[1; above 0 to 100\]. Source: docs/findings.md, "Less noise at the end";
    /// Isaac Lab: no limit.
    pub max_std: f32,
    /// Share of the environments that act without noise, for four iterations at a time, and teach the critic, not which actions pay:
    /// what only a policy without noise runs into is met in training, too. Their samples do count in the mean and the scale by which
    /// advantages are normalized, in the divergence that steers the learning rate, and in `smoothness` \[1; 0 to 0.9\]. Source:
    /// docs/findings.md, "Quiet robots"; Isaac Lab, 0.
    pub quiet_share: f32,
    /// Iterations at the start in which only the critic learns, at the highest learning rate: with a policy from a file and a
    /// critic that knows nothing, what the policy learns at first is noise \[iterations; 0 to 100000000\]. Source:
    /// docs/findings.md, "Little noise needs a taught critic"; rsl_rl, 0.
    pub critic_iterations: u64,
    /// Whether the activation of every unit of the first layers begins with its kink at an observation, and not all near zero: steps
    /// that lie far from zero are found sooner. Source: docs/findings.md, "Kinks where the data is"; rsl_rl, false.
    pub kinks_at_observations: bool,
    /// How left–right symmetry is used: "networks", both are symmetric; "samples", half of the samples, drawn anew in each epoch, are
    /// learned from in their mirror image; or "none". Source: docs/findings.md, "Symmetric networks"; rsl_rl, none.
    pub symmetry: SymmetryBy,
    /// Blocks of eight partial gradients in which a minibatch is added up. A partial is the work of one thread, so this times
    /// eight is how many threads of all ranks can work at once; one block a rank is the least to exchange. Another number is
    /// another order of addition: other bits, the same learning \[blocks; 1 to 4096\]. Source: docs/cluster.md.
    pub gradient_blocks: usize,
    /// What numbers the networks are computed with in training: "f32", or "bf16", faster where the processor has AVX-512
    /// BF16 and nowhere else. Source: docs/performance.md.
    pub precision: Precision,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            actor_hidden: vec![512, 256, 128],
            critic_hidden: vec![512, 256, 128],
            steps_per_env: 24,
            epochs: 5,
            minibatches: 4,
            gamma: 0.99,
            lambda: 0.95,
            clip_range: 0.2,
            value_loss_coefficient: 1.0,
            clip_value_loss: true,
            entropy_coefficient: 0.005,
            learning_rate: 1e-3,
            desired_kl: 0.01,
            smoothness: 0.0,
            anneal_iterations: 0,
            anneal_to: 0.1,
            learning_rate_range: [1e-5, 1e-2],
            max_gradient_norm: 1.0,
            initial_std: 1.0,
            initial_output_scale: 1.0,
            max_std: 100.0,
            quiet_share: 0.0,
            critic_iterations: 0,
            kinks_at_observations: false,
            symmetry: SymmetryBy::None,
            gradient_blocks: 1,
            precision: Precision::F32,
        }
    }
}

/// A setting that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{field} is {found}, must be {allowed}")]
pub struct ConfigError {
    /// The field.
    pub field: &'static str,
    /// Its value.
    pub found: String,
    /// What would do.
    pub allowed: &'static str,
}

impl Config {
    /// The settings of an iteration: the annealed ones as they are by then.
    pub fn at(&self, iteration: u64) -> Self {
        let progress = match self.anneal_iterations {
            0 => 0.0,
            iterations => (iteration as f32 / iterations as f32).min(1.0),
        };
        let scale = 1.0 - (1.0 - self.anneal_to) * progress;
        Self {
            desired_kl: scale * self.desired_kl,
            entropy_coefficient: scale * self.entropy_coefficient,
            ..self.clone()
        }
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first one out of range.
    pub fn validate(&self) -> Result<(), ConfigError> {
        let check = |fits: bool, field, found: &dyn std::fmt::Debug, allowed| {
            if fits { Ok(()) } else { Err(ConfigError { field, found: format!("{found:?}"), allowed }) }
        };
        let widths = |widths: &[usize]| widths.iter().all(|width| (1..=8192).contains(width));
        let positive = |x: f32, most: f32| x > 0.0 && x <= most;
        let not_negative = |x: f32, most: f32| x >= 0.0 && x <= most;
        check(widths(&self.actor_hidden), "actor_hidden", &self.actor_hidden, "widths from 1 to 8192")?;
        check(widths(&self.critic_hidden), "critic_hidden", &self.critic_hidden, "widths from 1 to 8192")?;
        let count = |count: usize, most: usize| (1..=most).contains(&count);
        let steps = self.steps_per_env;
        check(count(steps, 10_000), "steps_per_env", &steps, "at least 1, at most 10000")?;
        check(count(self.epochs, 100), "epochs", &self.epochs, "at least 1, at most 100")?;
        let parts = self.minibatches;
        check(count(parts, 100_000), "minibatches", &parts, "at least 1, at most 100000")?;
        check(self.gamma > 0.0 && self.gamma <= 1.0, "gamma", &self.gamma, "in (0, 1]")?;
        check((0.0..=1.0).contains(&self.lambda), "lambda", &self.lambda, "in [0, 1]")?;
        check(positive(self.clip_range, 10.0), "clip_range", &self.clip_range, "above 0, at most 10")?;
        let weight = self.value_loss_coefficient;
        check(not_negative(weight, 1e3), "value_loss_coefficient", &weight, "from 0 to 1000")?;
        let weight = self.entropy_coefficient;
        check(not_negative(weight, 10.0), "entropy_coefficient", &weight, "from 0 to 10")?;
        let [low, high] = self.learning_rate_range;
        let range = &self.learning_rate_range;
        let in_order = positive(low, 1.0) && (low..=1.0).contains(&high);
        check(in_order, "learning_rate_range", range, "two rates in order, above 0, at most 1")?;
        let rate = self.learning_rate;
        check((low..=high).contains(&rate), "learning_rate", &rate, "within learning_rate_range")?;
        check(not_negative(self.smoothness, 1000.0), "smoothness", &self.smoothness, "from 0 to 1000")?;
        check(not_negative(self.desired_kl, 10.0), "desired_kl", &self.desired_kl, "from 0 to 10")?;
        let iterations = self.anneal_iterations;
        let fits = iterations <= 100_000_000;
        check(fits, "anneal_iterations", &iterations, "from 0 to 100000000")?;
        let to = self.anneal_to;
        check((0.0..=1.0).contains(&to), "anneal_to", &to, "from 0 to 1")?;
        let iterations = self.critic_iterations;
        let fits = iterations <= 100_000_000;
        check(fits, "critic_iterations", &iterations, "from 0 to 100000000")?;
        let norm = self.max_gradient_norm;
        check(positive(norm, 1e6), "max_gradient_norm", &norm, "above 0, at most 1000000")?;
        check(positive(self.initial_std, 100.0), "initial_std", &self.initial_std, "above 0, at most 100")?;
        let scale = self.initial_output_scale;
        check((0.0..=1.0).contains(&scale), "initial_output_scale", &scale, "from 0 to 1")?;
        check(positive(self.max_std, 100.0), "max_std", &self.max_std, "above 0, at most 100")?;
        let share = self.quiet_share;
        check((0.0..=0.9).contains(&share), "quiet_share", &share, "from 0 to 0.9")?;
        let blocks = self.gradient_blocks;
        check((1..=4096).contains(&blocks), "gradient_blocks", &blocks, "from 1 to 4096")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_out_of_range_is_named_with_its_range() {
        Config::default().validate().unwrap();
        let message = Config { gamma: 1.5, ..Config::default() }.validate().unwrap_err().to_string();
        assert_eq!(message, "gamma is 1.5, must be in (0, 1]");
        assert!(Config { initial_std: f32::NAN, ..Config::default() }.validate().is_err());
        assert!(Config { minibatches: 0, ..Config::default() }.validate().is_err());
    }

    #[test]
    fn annealed_settings_fall_to_their_share_and_stay_there() {
        let config = Config { anneal_iterations: 100, anneal_to: 0.2, desired_kl: 0.02, ..Config::default() };
        for (iteration, desired) in [(0, 0.02), (50, 0.012), (100, 0.004), (1000, 0.004)] {
            assert!((config.at(iteration).desired_kl - desired).abs() < 1e-7, "{iteration}");
        }
        let kept = Config { anneal_iterations: 0, ..config };
        assert_eq!(kept.at(1000), kept);
    }
}
