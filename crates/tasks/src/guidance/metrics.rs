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
        let [walk, stop, turn, spin] = self.rewards;
        [self.steps, self.falls, self.broken, self.drift, walk, stop, turn, spin]
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

    /// Means over all steps, by name: the total, and each behavior's share of it, at most the share of the steps that ask for it.
    /// Under the paper's pulls that is a quarter each, and the paper's averages go `beside_the_paper`; under others they are of
    /// something else.
    pub(super) fn named(&self, beside_the_paper: bool) -> Vec<(String, f64)> {
        let steps = self.steps.max(1.0);
        let mut named = vec![("behavior_reward/total".to_owned(), self.rewards.iter().sum::<f64>() / steps)];
        for behavior in Behavior::ALL {
            named.push((format!("behavior_reward/{behavior}"), self.rewards[behavior as usize] / steps));
        }
        if beside_the_paper {
            // So that one chart shows both.
            named.push(("paper/total".to_owned(), PAPER_TOTAL));
            named.extend(Behavior::ALL.map(|behavior| (format!("paper/{behavior}"), behavior.paper_share())));
        }
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
        metrics.add_drift(0.2);
        (metrics.falls, metrics.broken) = (3.0, 2.0);
        let mut both = Metrics::default();
        both.merge(&Metrics::from_sums(&metrics.to_sums()));
        let named = both.named(true);
        let expected = [
            ("behavior_reward/total", 0.45),
            ("behavior_reward/walk", 0.125),
            ("behavior_reward/stop", 0.075),
            ("behavior_reward/turn", 0.0),
            ("behavior_reward/spin", 0.25),
            ("paper/total", 0.61),
            ("paper/walk", 0.13),
            ("paper/stop", 0.22),
            ("paper/turn", 0.08),
            ("paper/spin", 0.16),
            ("falls_per_1000", 750.0),
            ("heading_drift", 0.05),
            ("broken_states", 2.0),
        ];
        for ((name, value), (found_name, found)) in expected.into_iter().zip(&named) {
            assert!(
                name == found_name && (value - found).abs() < 1e-6,
                "{name}: {value}, {found_name}: {found}"
            );
        }
        assert_eq!(named.len(), expected.len());
        assert!(both.named(false).iter().all(|(name, _)| !name.starts_with("paper/")));
    }
}
