//! What the iterations of a training leave in its run's folder: two records of numbers, and checkpoints.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};

use crate::error::BadInput;
use crate::metrics::MetricsTable;
use crate::run_folder::{RunFolder, write_atomic};
use crate::tensorboard::EventWriter;
use crate::training::{Learner, TrainingSettings};

/// A training of this process: what its iterations leave in the run's folder.
pub struct Session<'a> {
    run: &'a RunFolder,
    log: Log,
    checkpoints: Checkpoints<'a>,
}

impl<'a> Session<'a> {
    /// Goes on after iteration `first`.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn open(run: &'a RunFolder, settings: &'a TrainingSettings, first: u64) -> Result<Self> {
        let log = Log::open(run, first)?;
        Ok(Self { run, log, checkpoints: Checkpoints::new(run, settings)? })
    }

    /// Numbers of the iterations so far.
    pub fn rows(&self) -> impl Iterator<Item = (u64, Vec<(String, f64)>)> {
        self.log.table.rows()
    }

    /// Makes an iteration and records it; returns its numbers.
    ///
    /// # Errors
    /// The learner breaks down or the disk refuses: the last good checkpoint is named. No number is the one that decides
    /// which checkpoint is the best.
    pub fn iterate(&mut self, learner: &mut dyn Learner) -> Result<Vec<(String, f64)>> {
        let began = Instant::now();
        let mut row = learner.iterate().with_context(|| last_good(self.run))?;
        let rate = learner.steps_per_iteration() as f64 / began.elapsed().as_secs_f64();
        row.push(("steps_per_s".into(), rate));
        self.log.append(learner.iteration(), &row).with_context(|| last_good(self.run))?;
        self.checkpoints.note(&row)?;
        Ok(row)
    }

    /// Whether it is time to save.
    pub fn is_due(&self) -> bool {
        self.checkpoints.is_due()
    }

    /// Saves the learner as it is now, after its rows: no checkpoint may be newer than what is known of it.
    ///
    /// # Errors
    /// The disk refuses; the last good checkpoint is named.
    pub fn save(&mut self, learner: &dyn Learner) -> Result<()> {
        let rows = self.log.to_disk();
        let saved =
            rows.and_then(|()| self.checkpoints.save(learner)).and_then(|()| self.log.distributions(learner));
        saved.with_context(|| last_good(self.run))
    }
}

fn last_good(run: &RunFolder) -> String {
    match run.checkpoints().ok().and_then(|found| found.into_iter().next()) {
        Some((_, path)) => format!("training stopped; the last good checkpoint is {}", path.display()),
        None => "training stopped before its first checkpoint".into(),
    }
}

/// The two records of a run's numbers: one for programs, one for TensorBoard.
struct Log {
    folder: PathBuf,
    /// The iteration after which this session goes on.
    first: u64,
    table: MetricsTable,
    events: EventWriter,
}

impl Log {
    fn open(run: &RunFolder, first: u64) -> Result<Self> {
        let path = run.file("metrics.csv");
        let table =
            MetricsTable::open(&path, first).with_context(|| format!("cannot use {}", path.display()))?;
        let begin = || format!("cannot begin an event file in {}", run.path().display());
        let events = EventWriter::create(run.path(), first + 1).with_context(begin)?;
        Ok(Self { folder: run.path().to_owned(), first, table, events })
    }

    /// Rows outlive a power cut from here on.
    fn to_disk(&self) -> Result<()> {
        self.table.to_disk().with_context(|| cannot_write_rows(&self.folder))
    }

    fn append(&mut self, iteration: u64, row: &[(String, f64)]) -> Result<()> {
        self.table.append(iteration, row).with_context(|| cannot_write_rows(&self.folder))?;
        let scalars = row.iter().map(|(name, value)| (name.as_str(), *value));
        self.events.scalars(iteration, scalars).with_context(|| cannot_write_events(&self.folder))
    }

    fn distributions(&mut self, learner: &dyn Learner) -> Result<()> {
        if learner.iteration() == self.first {
            // No iteration was made here, so there is none to tell of.
            return Ok(());
        }
        let values = learner.distributions();
        let written = self.events.histograms(learner.iteration(), &values);
        written.with_context(|| cannot_write_events(&self.folder))
    }
}

fn cannot_write_rows(folder: &Path) -> String {
    format!("cannot write {}", folder.join("metrics.csv").display())
}

fn cannot_write_events(folder: &Path) -> String {
    format!("cannot write the event file in {}", folder.display())
}

/// When to save, what to keep, and which was the best.
struct Checkpoints<'a> {
    run: &'a RunFolder,
    settings: &'a TrainingSettings,
    saved_at: Instant,
    /// Sum and number of the score since the last checkpoint.
    score: (f64, u32),
    best: f64,
}

impl<'a> Checkpoints<'a> {
    fn new(run: &'a RunFolder, settings: &'a TrainingSettings) -> Result<Self> {
        let best = best_score(run, &settings.score).unwrap_or(f64::NEG_INFINITY);
        Ok(Self { run, settings, saved_at: Instant::now(), score: (0.0, 0), best })
    }

    /// Takes an iteration's score into account.
    fn note(&mut self, row: &[(String, f64)]) -> Result<(), BadInput> {
        let score = &self.settings.score;
        let Some((_, value)) = row.iter().find(|(name, _)| name == score) else {
            let names: Vec<&str> = row.iter().map(|(name, _)| name.as_str()).collect();
            let allowed = names.join(", ");
            return Err(BadInput::new(format!("training.score is {score:?}, must be one of {allowed}")));
        };
        self.score = (self.score.0 + value, self.score.1 + 1);
        Ok(())
    }

    fn is_due(&self) -> bool {
        self.saved_at.elapsed() >= Duration::from_secs_f64(self.settings.checkpoint_period_s)
    }

    fn save(&mut self, learner: &dyn Learner) -> Result<()> {
        let path = self.run.checkpoint(learner.iteration());
        learner.save(&path).with_context(|| format!("cannot save {}", path.display()))?;
        let policy = self.run.file("policy.onnx");
        learner.export(&policy).with_context(|| format!("cannot save {}", policy.display()))?;
        self.keep_best(&path)?;
        self.run
            .prune_checkpoints(self.settings.checkpoints_kept)
            .context("cannot remove old checkpoints")?;
        self.saved_at = Instant::now();
        Ok(())
    }

    fn keep_best(&mut self, newest: &Path) -> Result<()> {
        let (sum, count) = std::mem::take(&mut self.score);
        let mean = sum / f64::from(count);
        if count == 0 || mean.partial_cmp(&self.best) != Some(std::cmp::Ordering::Greater) {
            return Ok(());
        }
        self.best = mean;
        let score = format!("{} {mean}\n", self.settings.score);
        write_atomic(&self.run.best_checkpoint(), &std::fs::read(newest)?)
            .and_then(|()| write_atomic(&best_score_path(self.run), score.as_bytes()))
            .with_context(|| format!("cannot keep {}", self.run.best_checkpoint().display()))
    }
}

/// The best `score` of the sessions before, which wrote `NAME VALUE`, or once the value alone.
fn best_score(run: &RunFolder, score: &str) -> Option<f64> {
    let text = std::fs::read_to_string(best_score_path(run)).ok()?;
    let (name, value) = text.trim().split_once(' ').unwrap_or((score, text.trim()));
    value.parse().ok().filter(|_| name == score)
}

fn best_score_path(run: &RunFolder) -> PathBuf {
    run.best_checkpoint().with_extension("score")
}
