//! What is reported of the handlers' and robots' understanding.

use super::{Behavior, behavior::PAPER_TOTAL};

/// Numbers in [`Metrics`].
const SUMS: usize = 8;

/// Sums over control steps of all robots.
#[derive(Clone, Debug, Default)]
pub(super) struct Metrics {
    steps: f64,
    /// Falls.
    pub(super) falls: f64,
    /// States that were no longer numbers.
    pub(super) broken: f64,
    /// Behavior reward by what was meant, in the order of [`Behavior::ALL`].
    rewards: [f64; 4],
    /// Drift of the heading \[rad/s\].
    drift: f64,
}

impl Metrics {
    /// Takes in one control step.
    pub(super) fn add(&mut self, behavior: Behavior, reward: f32) {
        self.steps += 1.0;
        self.rewards[behavior as usize] += f64::from(reward);
    }

    /// Takes in a control step's drift \[rad/s\].
    pub(super) fn add_drift(&mut self, drift: f32) {
        self.drift += f64::from(drift);
    }

    /// The sums, in a fixed order.
    pub(super) fn to_sums(&self) -> [f64; SUMS] {
        let [stop, walk, turn, spin] = self.rewards;
        [self.steps, self.falls, self.broken, self.drift, stop, walk, turn, spin]
    }

    /// What [`Metrics::to_sums`] gave.
    pub(super) fn from_sums(sums: &[f64; SUMS]) -> Self {
        let &[steps, falls, broken, drift, ref rewards @ ..] = sums;
        Self { steps, falls, broken, drift, rewards: *rewards }
    }

    /// Adds another sum.
    pub(super) fn merge(&mut self, o: &Self) {
        self.steps += o.steps;
        self.falls += o.falls;
        self.broken += o.broken;
        self.drift += o.drift;
        for (sum, other) in self.rewards.iter_mut().zip(o.rewards) {
            *sum += other;
        }
    }

    /// Means over all steps, by name: the total, and each behavior's share of it (at most its share of the steps: a
    /// quarter under the paper's pulls), the averages the paper plots.
    pub(super) fn named(&self) -> Vec<(String, f64)> {
        let steps = self.steps.max(1.0);
        let mut named = vec![("behavior_reward/total".to_owned(), self.rewards.iter().sum::<f64>() / steps)];
        for behavior in Behavior::ALL {
            named.push((format!("behavior_reward/{behavior}"), self.rewards[behavior as usize] / steps));
        }
        // The paper's averages beside ours, so that one chart shows both.
        named.push(("paper/total".to_owned(), PAPER_TOTAL));
        named.extend(Behavior::ALL.map(|behavior| (format!("paper/{behavior}"), behavior.paper_share())));
        named.push(("falls_per_1000".to_owned(), 1000.0 * self.falls / steps));
        named.push(("heading_drift".to_owned(), self.drift / steps));
        named.push(("broken_states".to_owned(), self.broken));
        named
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_the_total() {
        let mut metrics = Metrics::default();
        metrics.add(Behavior::Walk, 0.5);
        metrics.add(Behavior::Spin, 1.0);
        metrics.add(Behavior::Spin, 0.0);
        metrics.add(Behavior::Stop, 0.3);
        let mut both = Metrics::default();
        both.merge(&metrics);
        let named = both.named();
        let value = |name: &str| named.iter().find(|(n, _)| n == name).unwrap().1;
        assert!((value("behavior_reward/total") - 0.45).abs() < 1e-6);
        assert!((value("behavior_reward/spin") - 0.25).abs() < 1e-6);
        assert_eq!(value("behavior_reward/turn"), 0.0);
    }
}
