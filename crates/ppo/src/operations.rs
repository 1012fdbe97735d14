//! How many operations learning needs: products of the networks, a multiply-add counted as two, and nothing else (activation,
//! loss and optimizer are a few percent).

use crate::config::Config;

impl Config {
    /// Of an update, for each of its samples: in every epoch forward, gradient of weights and of inputs, but not of the first
    /// layer's input, which nobody asks for.
    pub fn update_operations(&self, observations: usize, actions: usize) -> f64 {
        let network = |hidden: &[usize], outputs: usize| {
            6 * weights(observations, hidden, outputs) - 2 * observations * hidden.first().unwrap_or(&outputs)
        };
        ((network(&self.actor_hidden, actions) + network(&self.critic_hidden, 1)) * self.epochs) as f64
    }

    /// Of a rollout, for each of its samples: both networks forward, and the critic once more at the end.
    pub fn inference_operations(&self, observations: usize, actions: usize) -> f64 {
        let critic = weights(observations, &self.critic_hidden, 1) as f64;
        let actor = weights(observations, &self.actor_hidden, actions) as f64;
        2.0 * (actor + critic + critic / self.steps_per_env as f64)
    }
}

/// Weights of a network.
fn weights(inputs: usize, hidden: &[usize], outputs: usize) -> usize {
    let widths = [&[inputs], hidden, &[outputs]].concat();
    widths.windows(2).map(|pair| pair[0] * pair[1]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_of_small_networks_by_hand() {
        let config = Config {
            actor_hidden: vec![4],
            critic_hidden: vec![],
            epochs: 2,
            steps_per_env: 5,
            ..Config::default()
        };
        // Actor 3-4-2: 12 + 8 weights; critic 3-1: 3 weights.
        assert_eq!(config.update_operations(3, 2), 2.0 * ((6 * 20 - 2 * 12) + (6 * 3 - 2 * 3)) as f64);
        assert_eq!(config.inference_operations(3, 2), 2.0 * (20.0 + 3.0 + 0.6));
    }
}
