//! What was learned beside rules that learn nothing, where the force is not known exactly.

use anyhow::Result;

use super::Maker;
use super::ablations::SEEDS;
use super::pair::{Pair, table};
use crate::interrupt::Interrupt;
use crate::policies::{RULES, SHIPPED};

/// Error of the force that supervisors see where they are compared with rules \[N\]: with a perfect sensor on level ground there would be
/// nothing to learn.
const SENSOR_ERROR_N: f64 = 2.0;
/// Ablations that are compared with them.
const LEARNED: [&str; 2] = ["paper-task", "ours"];

impl Maker {
    /// Rules and learned supervisors with an imprecise force sensor, on the pulls of the paper and on thresholds; false if the user
    /// interrupts.
    pub(super) fn baselines(&self, interrupt: &Interrupt) -> Result<bool> {
        let one = |name: &str| (name.to_owned(), vec![name.to_owned()]);
        let mut supervisors = RULES.map(|(name, _)| one(name)).to_vec();
        for name in LEARNED {
            let Some(seeds) = self.ablation(name, interrupt)? else { return Ok(false) };
            supervisors.push((name.to_owned(), seeds));
        }
        supervisors.push(one(SHIPPED));
        let mut text = String::new();
        let mut oracle = None;
        for suite in ["paper17", "edges"] {
            let mut rows = Vec::new();
            for (name, seeds) in &supervisors {
                let mut found = Vec::new();
                for (seed, supervisor) in (1..).zip(seeds) {
                    if interrupt.requested() {
                        return Ok(false);
                    }
                    let pair = Pair {
                        name: format!("baseline-{suite}-{name}-{seed}"),
                        supervisor: supervisor.clone(),
                        suite,
                        force_noise_n: SENSOR_ERROR_N,
                        ..Pair::default()
                    };
                    let results = self.pair(&pair, oracle)?;
                    oracle = Some(results.oracle_reward);
                    found.push(results);
                }
                rows.push((name.clone(), found));
            }
            text += &format!(
                "{suite} on level ground, {} episodes a case, randomized robots, force seen with ±{SENSOR_ERROR_N} N; learned: {SEEDS} seeds, median (lowest to \
                 highest)\n{}\n",
                self.pair_episodes(),
                table(&rows)
            );
        }
        self.write("baselines", "txt", text.as_bytes())?;
        Ok(true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::everything::ablations::ABLATIONS;

    #[test]
    fn what_is_compared_exists() {
        for name in LEARNED {
            assert!(ABLATIONS.iter().any(|(other, _)| *other == name), "{name}");
        }
        for (name, _) in RULES {
            assert!(crate::policies::supervisor(name).is_ok(), "{name}");
        }
    }
}
