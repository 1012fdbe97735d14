//! What each part of the supervisor's training is worth: trainings with one thing changed; how it compares with rules; pairs of other
//! walks and supervisors. All on randomized robots, level ground.

use anyhow::{Context as _, Result};
use evaluation::judge::{Arena, Setting};
use evaluation::results::{BehaviorReward, Group, Results};
use evaluation::statistics::mean;
use evaluation::suite::suite;

use super::Maker;
use crate::config::resolve_text;
use crate::interrupt::Interrupt;
use crate::judging::{Names, judge};
use crate::learner::{Start, Training};
use crate::policies::{self, SHIPPED};
use crate::result_tables::spread;
use crate::run_config::SupervisorRun;
use crate::run_folder::RunFolder;
use crate::stages;
use crate::training::Outcome;

/// Trainings of every ablation.
const SEEDS: u64 = 3;
/// How long supervisors train here: a third of the usual time, for there are many of them.
const SHORT_TRAINING: [&str; 2] = ["training.iterations=200", "ppo.anneal_iterations=200"];
/// Episodes of a case at most: what is compared are trainings, and seeds differ by more than 60 episodes of one do.
const MOST_EPISODES: usize = 60;
/// Error of the force that supervisors see where they are compared with rules \[N\]: with a perfect sensor on level ground there would be
/// nothing to learn.
const SENSOR_ERROR_N: f32 = 2.0;
/// Those that learn nothing.
const RULES: [&str; 3] = ["oracle", "rules", "dominance"];
/// Ablations that are compared with them.
const LEARNED: [&str; 2] = ["paper-task", "ours"];

/// The paper's pulls.
const PAPER_FORCES: &[&str] = &[
    "task.pull.x_n=[-80, 0]",
    "task.pull.y_n=[-40, 40]",
    "task.pull.near_threshold_share=0",
    "task.pull.period_s=5",
];

/// One thing that is other than in `guidedog config supervisor`, of which the training is a third as long here: its name and groups of
/// settings.
const ABLATIONS: [(&str, &[&[&str]]); 8] = [
    ("ours", &[]),
    ("paper-task", &[PAPER_FORCES, &["task.threshold_margin_n=0", "task.heading_drift=0", "task.fall=0"]]),
    ("paper-forces", &[PAPER_FORCES]),
    ("no-symmetry", &[&["ppo.symmetry=false"]]),
    ("no-drift-term", &[&["task.heading_drift=0"]]),
    ("force-noise", &[&["task.pull.noise_n=2"]]),
    ("every-0.02-s", &[&["task.supervisor_period_s=0.02"]]),
    ("every-0.2-s", &[&["task.supervisor_period_s=0.2"]]),
];

impl Maker {
    /// All ablations, three seeds each, and their table; false if the user interrupts.
    pub(super) fn ablations(&self, interrupt: &Interrupt) -> Result<bool> {
        let mut rows = Vec::new();
        let mut oracle = None;
        for (name, _) in ABLATIONS {
            let mut found = Vec::new();
            for seed in 1..=SEEDS {
                let Some(policy) = self.ablation(name, seed, interrupt)? else { return Ok(false) };
                let pair =
                    Pair { name: format!("ablation-{name}-{seed}"), supervisor: policy, ..Pair::default() };
                let results = self.pair(&pair, oracle)?;
                oracle = Some(results.oracle_reward);
                found.push(results);
            }
            rows.push((name.to_owned(), found));
        }
        let head = format!(
            "supervisors trained for 200 iterations with one thing changed, {SEEDS} seeds each, median (lowest to highest); paper17 on level ground, {} episodes a \
             case, randomized robots\n",
            self.pair_episodes()
        );
        self.write("ablations", "txt", (head + &table(&rows)).as_bytes())?;
        Ok(true)
    }

    /// Rules and learned supervisors with an imprecise force sensor, on the pulls of the paper and on thresholds; false if the user
    /// interrupts.
    pub(super) fn baselines(&self, interrupt: &Interrupt) -> Result<bool> {
        let mut supervisors: Vec<(String, Vec<String>)> =
            RULES.map(|name| (name.to_owned(), vec![name.to_owned()])).to_vec();
        for name in LEARNED {
            let mut seeds = Vec::new();
            for seed in 1..=SEEDS {
                let Some(policy) = self.ablation(name, seed, interrupt)? else { return Ok(false) };
                seeds.push(policy);
            }
            supervisors.push((format!("{name}, 200 iterations"), seeds));
        }
        supervisors.push((SHIPPED.to_owned(), vec![SHIPPED.to_owned()]));
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
                        name: format!("baseline-{suite}-{}-{seed}", name.split(',').next().unwrap_or(name)),
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

    /// Every pairing of the shipped policies with others: a walk of level ground and the supervisor trained over it. False if the
    /// user interrupts.
    pub(super) fn swaps(&self, interrupt: &Interrupt) -> Result<bool> {
        let walk = stages::learn_all(&self.folder, "other-walk", stages::FLAT, &[], interrupt)?;
        let Some(walk) = walk else { return Ok(false) };
        let walk = policies::name(&walk)?;
        let over_it = [format!("task.locomotion={walk:?}"), "task.terrain=\"flat\"".into()];
        let Some(other) = self.supervisor("other-supervisor", &over_it, interrupt)? else { return Ok(false) };
        let mut rows = Vec::new();
        for (walk_name, walk) in [("shipped", SHIPPED), ("other", walk)] {
            let mut oracle = None;
            for (name, supervisor) in [("shipped", SHIPPED), ("other", &other)] {
                let pair = Pair {
                    name: format!("swap-{walk_name}-{name}"),
                    walk: walk.to_owned(),
                    supervisor: supervisor.to_owned(),
                    ..Pair::default()
                };
                let found = self.pair(&pair, oracle)?;
                oracle = Some(found.oracle_reward);
                rows.push((format!("{walk_name} walk, {name} supervisor"), vec![found]));
            }
        }
        let head = format!(
            "the shipped policies and others of level ground, paired; paper17 on level ground, {} episodes a case, randomized robots\n",
            self.pair_episodes()
        );
        self.write("swaps", "txt", (head + &table(&rows)).as_bytes())?;
        Ok(true)
    }

    fn pair_episodes(&self) -> usize {
        self.episodes.min(MOST_EPISODES)
    }

    /// The supervisor of an ablation, trained or found; `None` if the user interrupts.
    fn ablation(&self, name: &str, seed: u64, interrupt: &Interrupt) -> Result<Option<String>> {
        let of_name = ABLATIONS.iter().find(|(other, _)| *other == name);
        let (_, settings) = of_name.with_context(|| format!("no ablation is called {name}"))?;
        let settings = [owned(&settings.concat()), vec![format!("training.seed={seed}")]].concat();
        self.supervisor(&format!("ablation-{name}-{seed}"), &settings, interrupt)
    }

    /// Trains a supervisor in a run folder here, or finds it trained; `None` if the user interrupts.
    fn supervisor(&self, name: &str, settings: &[String], interrupt: &Interrupt) -> Result<Option<String>> {
        let settings = [owned(&SHORT_TRAINING).as_slice(), settings].concat();
        let config: SupervisorRun = resolve_text("defaults", "", &settings)?;
        config.validate()?;
        eprintln!("{name}");
        let run = RunFolder::open(&self.folder, name)?;
        let outcome = Training::unseen(&config, &Start::Resume).learn(&run, interrupt)?;
        Ok(if outcome == Outcome::Finished {
            Some(policies::name(&run.file("policy.onnx"))?.to_owned())
        } else {
            None
        })
    }

    /// Judges a pair of policies, or finds it judged; `oracle` is the oracle's reward over its walk, if known.
    fn pair(&self, pair: &Pair, oracle: Option<BehaviorReward>) -> Result<Results> {
        let Pair { name, walk, supervisor, suite: suite_name, force_noise_n } = pair;
        if let Some(results) = self.finished(name, self.pair_episodes()) {
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
        let names =
            Names { suite: (*suite_name).into(), locomotion: walk.clone(), supervisor: supervisor.clone() };
        let (results, _) = judge(&arena, &policies::supervisor(supervisor)?, &cases, &names, oracle)?;
        self.keep(name, &results)?;
        Ok(results)
    }
}

/// Two policies and how they are judged, under a name of their own.
struct Pair {
    name: String,
    walk: String,
    supervisor: String,
    suite: &'static str,
    force_noise_n: f32,
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

fn owned(settings: &[&str]) -> Vec<String> {
    settings.iter().map(|&setting| setting.to_owned()).collect()
}

/// A line a name: behavior reward, episodes obeyed by group, falls, changes of the reading.
fn table(rows: &[(String, Vec<Results>)]) -> String {
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let mut text = format!(
        "\n{:width$} {:>22} {:>22} {:>22} {:>22} {:>22} {:>22}\n",
        "", "behavior reward", "trained", "edge", "outside", "falls per 1000", "switches in 10 s"
    );
    for (name, results) in rows {
        let column = |of: &dyn Fn(&Results) -> Option<f64>, decimals| {
            spread(results.iter().map(of).collect(), decimals)
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
    fn every_ablation_changes_something_that_can_be_trained() {
        let plain: SupervisorRun = resolve_text("defaults", "", &[]).unwrap();
        for (name, settings) in ABLATIONS {
            let config: SupervisorRun = resolve_text("defaults", "", &owned(&settings.concat())).unwrap();
            config.validate().unwrap();
            assert_eq!(config == plain, name == "ours", "{name}");
        }
        for name in LEARNED {
            assert!(ABLATIONS.iter().any(|(other, _)| *other == name), "{name}");
        }
    }

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
        assert!(line.contains(" 2.0 ") && line.ends_with("not"), "{line}");
    }
}
