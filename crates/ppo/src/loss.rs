//! PPO's loss of one sample and its gradient with respect to what the networks gave.
//!
//! Clipped surrogate: Schulman et al., *Proximal policy optimization algorithms*, 2017, equation 7; clipped value loss
//! without the factor ½ and entropy bonus as in rsl_rl v2.0.1.

use crate::config::Config;

/// What the rollout recorded of one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample<'a> {
    pub(crate) action: &'a [f32],
    pub(crate) old_mean: &'a [f32],
    /// Between what it was a step earlier and a step later.
    pub(crate) smooth_mean: &'a [f32],
    pub(crate) old_log_probability: f32,
    pub(crate) old_value: f32,
    pub(crate) advantage: f32,
    pub(crate) value_target: f32,
}

/// Sums over samples.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LossSums {
    pub(crate) surrogate: f64,
    pub(crate) value: f64,
    pub(crate) kl: f64,
    pub(crate) clipped: f64,
    /// Squared distances from the smooth means.
    pub(crate) roughness: f64,
}

impl LossSums {
    /// The five numbers, for another rank.
    pub(crate) fn to_bytes(self) -> [u8; 40] {
        let mut bytes = [0; 40];
        let numbers = [self.surrogate, self.value, self.kl, self.clipped, self.roughness];
        bytes.as_chunks_mut().0.iter_mut().zip(numbers).for_each(|(bytes, x)| *bytes = x.to_le_bytes());
        bytes
    }

    /// What [`LossSums::to_bytes`] gave.
    pub(crate) fn from_bytes(bytes: &[u8; 40]) -> Self {
        let number = |i: usize| f64::from_le_bytes(bytes.as_chunks().0[i]);
        let [surrogate, value, kl, clipped, roughness] = std::array::from_fn(number);
        Self { surrogate, value, kl, clipped, roughness }
    }

    pub(crate) fn add(&mut self, o: &Self) {
        self.surrogate += o.surrogate;
        self.value += o.value;
        self.kl += o.kl;
        self.clipped += o.clipped;
        self.roughness += o.roughness;
    }
}

const HALF_LOG_TWO_PI: f32 = 0.918_938_5;

/// The policy's noise: a diagonal Gaussian around the mean action.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gaussian {
    log_std: Vec<f32>,
    std: Vec<f32>,
    /// 1 / standard deviation.
    precision: Vec<f32>,
}

impl Gaussian {
    pub(crate) fn new(log_std: &[f32]) -> Self {
        let exponentials = |sign: f32| log_std.iter().map(|s| (sign * s).exp()).collect();
        Self { log_std: log_std.to_vec(), std: exponentials(1.0), precision: exponentials(-1.0) }
    }

    /// Standard deviations.
    pub(crate) fn std(&self) -> &[f32] {
        &self.std
    }

    /// Logarithm of the density.
    pub(crate) fn log_probability(&self, action: &[f32], mean: &[f32]) -> f32 {
        let terms = action.iter().zip(mean).zip(self.log_std.iter().zip(&self.precision));
        terms
            .map(|((a, m), (s, precision))| {
                let z = (a - m) * precision;
                -0.5 * z * z - s - HALF_LOG_TWO_PI
            })
            .sum()
    }

    /// Divergence of the Gaussian `other` around `other_mean` from this one around `mean`, KL(this ‖ other).
    pub(crate) fn divergence(&self, mean: &[f32], other: &Self, other_mean: &[f32]) -> f32 {
        (0..mean.len())
            .map(|i| {
                let spread = self.std[i] * self.std[i] + (mean[i] - other_mean[i]).powi(2);
                let precision = other.precision[i];
                other.log_std[i] - self.log_std[i] + 0.5 * spread * precision * precision - 0.5
            })
            .sum()
    }
}

/// Adds the gradient of surrogate and smoothness, times `weight`, to `mean_gradient` (replaced) and `log_std_gradient` (added
/// to).
pub(crate) fn surrogate(
    config: &Config,
    sample: Sample<'_>,
    mean: &[f32],
    policy: &Gaussian,
    weight: f32,
    mean_gradient: &mut [f32],
    log_std_gradient: &mut [f32],
) -> LossSums {
    let log_ratio = policy.log_probability(sample.action, mean) - sample.old_log_probability;
    let ratio = log_ratio.exp();
    let limited = ratio.clamp(1.0 - config.clip_range, 1.0 + config.clip_range);
    let (free, clipped) = (-sample.advantage * ratio, -sample.advantage * limited);
    // Where the clipped branch is the larger it is constant: no gradient.
    let slope = if free >= clipped { free * weight } else { 0.0 };
    let mut squared_roughness = 0.0;
    for i in 0..mean.len() {
        let inverse_variance = policy.precision[i] * policy.precision[i];
        let deviation = sample.action[i] - mean[i];
        let roughness = mean[i] - sample.smooth_mean[i];
        squared_roughness += roughness * roughness;
        mean_gradient[i] =
            slope * deviation * inverse_variance + 2.0 * config.smoothness * weight * roughness;
        log_std_gradient[i] += slope * (deviation * deviation * inverse_variance - 1.0);
    }
    LossSums {
        surrogate: f64::from(free.max(clipped)),
        clipped: f64::from(u8::from(ratio != limited)),
        roughness: f64::from(squared_roughness),
        ..LossSums::default()
    }
}

/// Value loss and its gradient with respect to the value, times `weight`.
pub(crate) fn value_loss(config: &Config, sample: Sample<'_>, value: f32, weight: f32) -> (f64, f32) {
    let weight = weight * config.value_loss_coefficient;
    let error = value - sample.value_target;
    if !config.clip_value_loss {
        return (f64::from(error * error), 2.0 * error * weight);
    }
    let move_ = value - sample.old_value;
    let limited = move_.clamp(-config.clip_range, config.clip_range);
    let clipped_error = sample.old_value + limited - sample.value_target;
    if error * error >= clipped_error * clipped_error {
        (f64::from(error * error), 2.0 * error * weight)
    } else {
        let slope = if move_ == limited { 2.0 * clipped_error * weight } else { 0.0 };
        (f64::from(clipped_error * clipped_error), slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(advantage: f32, old_log_probability: f32) -> Sample<'static> {
        Sample {
            action: &[0.4, -1.0],
            old_mean: &[0.1, -0.5],
            smooth_mean: &[0.3, -0.4],
            old_log_probability,
            old_value: 1.0,
            advantage,
            value_target: 1.5,
        }
    }

    #[test]
    fn gradients_are_differences_of_the_loss_on_both_sides_of_the_clip() {
        let config = Config { smoothness: 0.7, ..Config::default() };
        let (mean, log_std) = ([0.2_f32, -0.7], [-0.3_f32, 0.1]);
        let loss = |mean: &[f32], log_std: &[f32], sample| {
            let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
            let policy = Gaussian::new(log_std);
            let sums = surrogate(&config, sample, mean, &policy, 1.0, &mut a, &mut b);
            (sums.surrogate + 0.7 * sums.roughness, a, b)
        };
        let now = Gaussian::new(&log_std).log_probability(&[0.4, -1.0], &mean);
        // Inside the range, above it, below it; for both signs of the advantage.
        for offset in [0.05, -0.5, 0.5] {
            for advantage in [1.3, -0.8] {
                let sample = sample(advantage, now + offset);
                let (_, mean_gradient, std_gradient) = loss(&mean, &log_std, sample);
                for i in 0..2 {
                    let mut high = mean;
                    high[i] += 1e-2;
                    let mut low = mean;
                    low[i] -= 1e-2;
                    let slope = (loss(&high, &log_std, sample).0 - loss(&low, &log_std, sample).0) / 2e-2;
                    assert!((f64::from(mean_gradient[i]) - slope).abs() < 5e-3, "mean {offset} {advantage}");
                    let mut high = log_std;
                    high[i] += 1e-2;
                    let mut low = log_std;
                    low[i] -= 1e-2;
                    let slope = (loss(&mean, &high, sample).0 - loss(&mean, &low, sample).0) / 2e-2;
                    assert!((f64::from(std_gradient[i]) - slope).abs() < 5e-3, "std {offset} {advantage}");
                }
            }
        }
    }

    #[test]
    fn value_loss_by_hand() {
        let config = Config::default();
        let value = |v| value_loss(&config, sample(1.0, 0.0), v, 1.0);
        // Unclipped: the larger loss is the free one.
        assert_eq!(value(0.9), (f64::from(0.6_f32 * 0.6), -1.2));
        // Moved by more than 0.2 toward the target: the clipped loss (1.2 − 1.5)² rules, without gradient.
        let (loss, slope) = value(1.4);
        assert!((loss - 0.09).abs() < 1e-6 && slope == 0.0);
        // Beyond the target by more: the free loss rules.
        assert!((value(2.0).1 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn divergence_of_a_policy_from_itself_is_zero_and_known_otherwise() {
        let policy = |log_std: f32| Gaussian::new(&[log_std]);
        assert!(policy(0.2).divergence(&[0.3], &policy(0.2), &[0.3]).abs() < 1e-6);
        // Equal spread σ = 1, means 1 apart: ½.
        assert!((policy(0.0).divergence(&[0.0], &policy(0.0), &[1.0]) - 0.5).abs() < 1e-6);
        // Old σ = 1, new σ = 2: ln 2 + ⅛ − ½.
        let expected = 2.0_f32.ln() + 0.125 - 0.5;
        assert!((policy(0.0).divergence(&[0.0], &policy(2.0_f32.ln()), &[0.0]) - expected).abs() < 1e-6);
    }
}
