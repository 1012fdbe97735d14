//! The training loop around a learner: metrics, checkpoints, progress, interruption.
//!
//! The loop sees a [`Learner`], not an algorithm, so what happens on a full disk, on Ctrl-C or on a loss that is not
//! finite is tested without training anything.

use std::path::Path;

use anyhow::Result;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tasks::bounds::within;
use tasks::simulation::GROUP;

use crate::error::BadInput;
use crate::interrupt::Interrupt;
use crate::progress::{GAP, Progress, short_count};
use crate::run_folder::RunFolder;
use crate::session::Session;
use crate::watch::Window;

/// What the loop needs from something that learns by iterations.
pub trait Learner {
    /// Iterations made so far, over all processes.
    fn iteration(&self) -> u64;
    /// Makes one iteration; returns its named numbers, in a fixed order.
    ///
    /// # Errors
    /// The learner broke down (a loss that is not finite); its state is not to be saved.
    fn iterate(&mut self) -> Result<Vec<(String, f64)>>;
    /// Environment steps of one iteration.
    fn steps_per_iteration(&self) -> u64;
    /// Named numbers whose distribution is worth watching, as they are now.
    fn distributions(&self) -> Vec<(String, Vec<f32>)> {
        Vec::new()
    }
    /// Writes everything needed to continue bit for bit.
    ///
    /// # Errors
    /// The disk refuses.
    fn save(&self, path: &Path) -> Result<()>;
    /// Writes the policy as it is now, for others to use.
    ///
    /// # Errors
    /// The disk refuses.
    fn export(&self, path: &Path) -> Result<()>;
}

/// How long a run trains and what it keeps.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TrainingSettings {
    /// Seed of every random draw \[1; 0 to 9007199254740992\]. Source: ours, 1; judge a setting by several.
    pub seed: u64,
    /// Environments stepped together, a multiple of 16 \[robots; 16 to 1048576\]. Source: docs/findings.md, few robots and
    /// many updates learn fastest on two cores; the paper: 4096.
    pub num_envs: usize,
    /// Iterations in all \[iterations; 1 to 100000000\]. Source: docs/findings.md; the paper: 3000 for the supervisor.
    pub iterations: u64,
    /// Time between checkpoints \[s; above 0 to 1000000\]. Source: ours; so much is lost at most.
    pub checkpoint_period_s: f64,
    /// Numbered checkpoints kept, beside the best \[files; 1 to 10000\]. Source: ours.
    pub checkpoints_kept: usize,
    /// The metric (a column of metrics.csv) whose mean between two checkpoints decides which is the best; checkpoints come by the clock,
    /// so which one that is may differ from run to run. Source: ours.
    pub score: String,
}

/// 2⁵³: integers up to here keep their value in every reader of TOML and JSON.
const LARGEST_SEED: f64 = 9_007_199_254_740_992.0;

impl Default for TrainingSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            num_envs: 1024,
            iterations: 1500,
            checkpoint_period_s: 60.0,
            checkpoints_kept: 3,
            score: "episode_return".into(),
        }
    }
}

impl TrainingSettings {
    /// Refuses what cannot be trained.
    ///
    /// # Errors
    /// The first key out of range, with its value and what is allowed.
    pub fn validate(&self) -> Result<(), BadInput> {
        let check = |key: &str, value: f64, low: f64, high: f64| {
            within(&format!("training.{key}"), value, low, high).map_err(BadInput::new)
        };
        check("seed", self.seed as f64, 0.0, LARGEST_SEED)?;
        check("num_envs", self.num_envs as f64, 16.0, 1_048_576.0)?;
        if !self.num_envs.is_multiple_of(GROUP) {
            let (found, allowed) = (self.num_envs, format!("a multiple of {GROUP}"));
            return Err(BadInput::new(format!("training.num_envs is {found}, must be {allowed}")));
        }
        check("iterations", self.iterations as f64, 1.0, 1e8)?;
        check("checkpoint_period_s", self.checkpoint_period_s, f64::MIN_POSITIVE, 1e6)?;
        check("checkpoints_kept", self.checkpoints_kept as f64, 1.0, 1e4)
    }
}

/// How a training ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All iterations are made.
    Finished,
    /// The user stopped it; a checkpoint is saved.
    Interrupted,
}

/// Trains until `settings.iterations` are made or the user interrupts; always leaves a checkpoint of its last
/// state. `shown` are the metrics on the progress line; `window` shows all of them to those who watch.
///
/// # Errors
/// The learner breaks down (the last good checkpoint is named) or the disk refuses.
pub fn train(
    learner: &mut dyn Learner,
    run: &RunFolder,
    settings: &TrainingSettings,
    shown: &[&str],
    interrupt: &Interrupt,
    window: Option<&Window>,
) -> Result<Outcome> {
    let first = learner.iteration();
    let mut session = Session::open(run, settings, first)?;
    if let Some(window) = window {
        session.rows().for_each(|(iteration, row)| window.show_row(iteration, &row));
    }
    let mut progress = Progress::new("iteration", first, settings.iterations);
    let mut message = String::new();
    while learner.iteration() < settings.iterations && !interrupt.requested() {
        let row = session.iterate(learner)?;
        if let Some(window) = window {
            window.show_row(learner.iteration(), &row);
        }
        message = headline(&row, shown);
        progress.update(learner.iteration(), &message);
        if session.is_due() {
            session.save(learner)?;
        }
    }
    session.save(learner)?;
    progress.finish(&message);
    let finished = learner.iteration() >= settings.iterations;
    Ok(if finished { Outcome::Finished } else { Outcome::Interrupted })
}

fn headline(row: &[(String, f64)], shown: &[&str]) -> String {
    let value = |name: &str| row.iter().find(|(n, _)| n == name).map(|(_, value)| *value);
    let rate = value("steps_per_s").map(|rate| format!("{} steps/s", short_count(rate)));
    let scores = shown.iter().filter_map(|name| Some(format!("{name} {:.3}", value(name)?)));
    rate.into_iter().chain(scores).collect::<Vec<_>>().join(GAP)
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;
    use crate::metrics::MetricsTable;
    use crate::run_folder::write_atomic;
    use std::fs;

    /// Counts iterations, and breaks down or asks for an interrupt at a stated one.
    struct Counter {
        iteration: u64,
        broken_at: u64,
        interrupt_at: u64,
        interrupt: Interrupt,
    }

    impl Counter {
        fn new(iteration: u64) -> Self {
            Self { iteration, broken_at: u64::MAX, interrupt_at: u64::MAX, interrupt: Interrupt::default() }
        }
    }

    impl Learner for Counter {
        fn iteration(&self) -> u64 {
            self.iteration
        }
        fn iterate(&mut self) -> Result<Vec<(String, f64)>> {
            self.iteration += 1;
            anyhow::ensure!(self.iteration < self.broken_at, "the loss is NaN, must be finite");
            if self.iteration == self.interrupt_at {
                self.interrupt.request();
            }
            // Rises to iteration 5, then falls: the best is in the middle.
            Ok(vec![("score".into(), 5.0 - (self.iteration as f64 - 5.0).abs())])
        }
        fn steps_per_iteration(&self) -> u64 {
            24
        }
        fn save(&self, path: &Path) -> Result<()> {
            Ok(write_atomic(path, self.iteration.to_string().as_bytes())?)
        }
        fn export(&self, path: &Path) -> Result<()> {
            self.save(path)
        }
    }

    fn settings() -> TrainingSettings {
        let settings = TrainingSettings::default();
        TrainingSettings { iterations: 10, checkpoint_period_s: 1e-9, score: "score".into(), ..settings }
    }

    /// A run folder that goes with the test.
    struct Scratch(RunFolder, #[expect(dead_code, reason = "holds the folder")] TempDir);

    impl std::ops::Deref for Scratch {
        type Target = RunFolder;
        fn deref(&self) -> &RunFolder {
            &self.0
        }
    }

    fn run() -> Scratch {
        let root = tempfile::tempdir().unwrap();
        Scratch(RunFolder::open(root.path(), "counted").unwrap(), root)
    }

    fn column(run: &RunFolder) -> Vec<u64> {
        let table = MetricsTable::read(&run.file("metrics.csv")).unwrap();
        table.column("score").into_iter().map(|(iteration, _)| iteration).collect()
    }

    #[test]
    fn a_finished_run_keeps_the_newest_and_the_best() {
        let run = run();
        let outcome =
            train(&mut Counter::new(0), &run, &settings(), &[], &Interrupt::default(), None).unwrap();
        assert_eq!(outcome, Outcome::Finished);
        let kept: Vec<u64> = run.checkpoints().unwrap().into_iter().map(|(iteration, _)| iteration).collect();
        assert_eq!(kept, [10, 9, 8]);
        assert_eq!(fs::read_to_string(run.best_checkpoint()).unwrap(), "5");
        assert_eq!(column(&run), (1..=10).collect::<Vec<_>>());
    }

    #[test]
    fn a_finished_run_that_lost_its_policy_gets_it_again() {
        let run = run();
        train(&mut Counter::new(0), &run, &settings(), &[], &Interrupt::default(), None).unwrap();
        fs::remove_file(run.file("policy.onnx")).unwrap();
        let outcome =
            train(&mut Counter::new(10), &run, &settings(), &[], &Interrupt::default(), None).unwrap();
        assert_eq!(outcome, Outcome::Finished);
        assert!(run.file("policy.onnx").exists());
    }

    #[test]
    fn the_best_by_another_score_is_not_the_one_to_beat() {
        for (before, best) in [("other 1000\n", Some("5")), ("score 1000\n", None), ("1000\n", None)] {
            let run = run();
            let kept = run.best_checkpoint().with_extension("score");
            fs::write(&kept, before).unwrap();
            train(&mut Counter::new(0), &run, &settings(), &[], &Interrupt::default(), None).unwrap();
            assert_eq!(fs::read_to_string(run.best_checkpoint()).ok().as_deref(), best, "{before}");
            assert_eq!(fs::read_to_string(kept).unwrap(), if best.is_some() { "score 5\n" } else { before });
        }
    }

    #[test]
    fn a_score_that_is_no_number_of_the_learner_is_refused_with_those_that_are() {
        let run = run();
        let wrong = TrainingSettings { score: "scor".into(), ..settings() };
        let error = train(&mut Counter::new(0), &run, &wrong, &[], &Interrupt::default(), None).unwrap_err();
        assert!(error.is::<BadInput>());
        assert_eq!(error.to_string(), "training.score is \"scor\", must be one of score, steps_per_s");
    }

    #[test]
    fn an_interrupted_run_saves_and_goes_on_where_it_was() {
        let run = run();
        let mut counter = Counter { interrupt_at: 4, ..Counter::new(0) };
        let interrupt = counter.interrupt.clone();
        let lazy = TrainingSettings { checkpoint_period_s: 1e9, ..settings() };
        assert_eq!(train(&mut counter, &run, &lazy, &[], &interrupt, None).unwrap(), Outcome::Interrupted);
        assert_eq!(run.checkpoints().unwrap()[0].0, 4);
        let outcome = train(&mut Counter::new(4), &run, &lazy, &[], &Interrupt::default(), None).unwrap();
        assert_eq!(outcome, Outcome::Finished);
        assert_eq!(column(&run), (1..=10).collect::<Vec<_>>());
    }

    #[test]
    fn a_broken_learner_is_not_saved_and_the_last_good_checkpoint_is_named() {
        let run = run();
        let mut counter = Counter { broken_at: 7, ..Counter::new(0) };
        let error = train(&mut counter, &run, &settings(), &[], &Interrupt::default(), None).unwrap_err();
        let message = format!("{error:#}");
        assert!(message.contains("00000006.safetensors") && message.contains("the loss is NaN"), "{message}");
        assert_eq!(run.checkpoints().unwrap()[0].0, 6);
    }

    #[test]
    fn a_setting_out_of_range_is_named() {
        let error = TrainingSettings { num_envs: 0, ..settings() }.validate().unwrap_err();
        assert_eq!(error.to_string(), "training.num_envs is 0, must be from 16 to 1048576");
        settings().validate().unwrap();
    }
}
