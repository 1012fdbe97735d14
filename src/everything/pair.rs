//! Two policies, judged together on randomized robots on level ground, and a table of many such pairs.

use anyhow::{Context as _, Result};
use evaluation::judge::{Arena, Setting};
use evaluation::results::{BehaviorReward, Group, Results};
use evaluation::statistics::mean;
use evaluation::suite::suite;

use super::Maker;
use crate::judging::{Names, judge};
use crate::policies::{self, SHIPPED};
use crate::result_tables::spread;

/// Episodes of a case at most: what is compared are trainings, and seeds differ by more than 60 episodes of one do.
const MOST_EPISODES: usize = 60;

/// Two policies and how they are judged, under a name of their own.
pub(super) struct Pair {
    pub(super) name: String,
    pub(super) walk: String,
    pub(super) supervisor: String,
    pub(super) suite: &'static str,
    /// Error of the force that the supervisor sees, ± \[N\].
    pub(super) force_noise_n: f64,
}

impl Default for Pair {
    fn default() -> Self {
        let shipped = || SHIPPED.to_owned();
        Self {
            name: String::new(),
            walk: shipped(),
            supervisor: shipped(),
            suite: "paper17",
            force_noise_n: 0.0,
        }
    }
}

impl Maker {
    pub(super) fn pair_episodes(&self) -> usize {
        self.episodes.min(MOST_EPISODES)
    }

    /// Judges a pair of policies, or finds it judged; `oracle` is the oracle's reward over its walk, if known.
    pub(super) fn pair(&self, pair: &Pair, oracle: Option<BehaviorReward>) -> Result<Results> {
        let Pair { name, walk, supervisor, suite: suite_name, force_noise_n } = pair;
        let names = Names::new(suite_name, walk, supervisor)?;
        let finished = self.finished(name, self.pair_episodes());
        if let Some(results) = finished.filter(|results| results.policies == names.policies) {
            return Ok(results);
        }
        let setting = Setting {
            randomize: true,
            force_noise_n: *force_noise_n,
            episodes: self.pair_episodes(),
            seed: self.seed,
            ..Setting::default()
        };
        let arena = Arena::new(policies::locomotion(walk)?, setting).map_err(anyhow::Error::msg)?;
        let cases = suite(suite_name).with_context(|| format!("no suite is called {suite_name}"))?;
        let (results, _) = judge(&arena, &policies::supervisor(supervisor)?, &cases, &names, oracle)?;
        self.keep(name, &results)?;
        Ok(results)
    }
}

/// A line a name: behavior reward, episodes obeyed by group, falls, changes of the reading.
pub(super) fn table(rows: &[(String, Vec<Results>)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let mut text = format!(
        "\n{:width$} {:>22} {:>22} {:>22} {:>22} {:>22} {:>22}\n",
        "", "behavior reward", "trained", "edge", "outside", "falls per 1000", "switches in 10 s"
    );
    for (name, results) in rows {
        let column = |of: &dyn Fn(&Results) -> Option<f64>, decimals| {
            let values: Vec<_> = results.iter().map(of).collect();
            // No such group in the suite.
            if values.iter().all(Option::is_none) { "–".into() } else { spread(values, decimals) }
        };
        let [trained, edge, outside] =
            [Group::Trained, Group::Edge, Group::Outside].map(|group| column(&|r| r.group_success(group), 3));
        let (reward, falls) = (column(&|r| Some(r.reward.total), 3), column(&|r| r.falls_per_1000, 1));
        let switches = column(&mean_switches, 2);
        text += &format!(
            "{name:width$} {reward:>22} {trained:>22} {edge:>22} {outside:>22} {falls:>22} {switches:>22}\n"
        );
    }
    text
}

/// Over the cases of a suite.
fn mean_switches(results: &Results) -> Option<f64> {
    let switches: Vec<f64> = results.cases.iter().filter_map(|case| case.switches_per_10s).collect();
    mean(&switches)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_has_a_line_a_name_with_its_spread() {
        let results = |reward: f64| {
            let mut results = Results { falls_per_1000: Some(2.0), ..Results::default() };
            results.reward.total = reward;
            results
        };
        let table = table(&[("ours".into(), vec![results(0.7), results(0.9), results(0.8)])]);
        let line = table.lines().last().unwrap();
        assert!(line.starts_with("ours") && line.contains("0.800 (0.700 to 0.900)"), "{line}");
        assert!(line.contains(" 2.0 ") && line.ends_with("–"), "{line}");
    }
}
