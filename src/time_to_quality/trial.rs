//! One training on its way to a score.

use std::time::Instant;

use anyhow::{Context as _, Result};

use super::{Finding, Subject};
use crate::error::BadInput;
use crate::interrupt::Interrupt;
use crate::machine::processor_s;
use crate::metrics::MetricsTable;
use crate::progress::short_count;
use crate::run_folder::RunFolder;
use crate::training::{Learner, Session};

/// When a trial has ended, and how often it is judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Score to reach.
    pub target: f64,
    /// Longest training \[s\].
    pub limit_s: f64,
    /// Training between two judgments \[s\].
    pub interval_s: f64,
    /// Whether it goes on to the limit after the target is reached.
    pub to_the_limit: bool,
}

/// What had been spent when a policy was judged, and its score.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Point {
    pub(super) iteration: u64,
    pub(super) wall_s: f64,
    pub(super) processor_s: f64,
    pub(super) env_steps: f64,
    pub(super) score: f64,
}

/// One training with one seed.
pub struct Trial<'a> {
    name: String,
    run: &'a RunFolder,
    subject: &'a Subject,
    bounds: Bounds,
    table: MetricsTable,
    /// Spent so far; ahead of the last point while a turn lasts.
    now: Point,
    running: Option<(Box<dyn Learner>, Session<'a>)>,
    /// Why it cannot go on.
    broken: Option<String>,
}

/// The scores of a trial, in its run's folder.
const TABLE: &str = "time_to_quality.csv";

impl<'a> Trial<'a> {
    /// A trial that goes on where its folder says; nothing is built before its first turn.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn open(name: &str, run: &'a RunFolder, subject: &'a Subject, bounds: Bounds) -> Result<Self> {
        let newest = run.checkpoints()?.first().map_or(0, |(iteration, _)| *iteration);
        let table = open_table(run, newest)?;
        let now = points(&table).last().copied().unwrap_or_default();
        let name = name.to_owned();
        Ok(Self { name, run, subject, bounds, table, now, running: None, broken: None })
    }

    /// Longest training \[s\].
    pub fn limit_s(&self) -> f64 {
        self.bounds.limit_s
    }

    /// Training so far \[s\]; all of the limit once it has ended.
    pub fn bounded_s(&self) -> f64 {
        if self.has_ended() { self.bounds.limit_s } else { self.now.wall_s.min(self.bounds.limit_s) }
    }

    /// Whether the score is reached, the time is up or the learner broke down.
    pub fn has_ended(&self) -> bool {
        let last = points(&self.table).last().copied().unwrap_or_default();
        let up = last.wall_s >= self.bounds.limit_s;
        self.broken.is_some() || up || (!self.bounds.to_the_limit && self.reached().is_some())
    }

    fn reached(&self) -> Option<Point> {
        points(&self.table).into_iter().find(|point| point.score >= self.bounds.target)
    }

    /// Trains for an interval (less if the user interrupts), judges, records, saves. `watch` sees every iteration's numbers.
    ///
    /// # Errors
    /// The trial cannot begin or go on, or the disk refuses.
    pub fn take_turn(
        &mut self,
        interrupt: &Interrupt,
        mut watch: impl FnMut(&Self, &[(String, f64)]),
    ) -> Result<()> {
        let (mut learner, mut session) = match self.running.take() {
            Some(running) => running,
            None => self.begin()?,
        };
        let end = (self.now.wall_s + self.bounds.interval_s).min(self.bounds.limit_s);
        while self.now.wall_s < end && !interrupt.requested() {
            let (began, processor) = (Instant::now(), processor_s());
            match session.iterate(learner.as_mut()) {
                Ok(row) => {
                    self.now.wall_s += began.elapsed().as_secs_f64();
                    self.now.processor_s += processor_s() - processor;
                    self.now.iteration = learner.iteration();
                    self.now.env_steps = (learner.iteration() * learner.steps_per_iteration()) as f64;
                    watch(self, &row);
                }
                Err(error) if is_breakdown(&error) => {
                    self.broken = Some(format!("{:#}", error.root_cause()));
                    return Ok(());
                }
                Err(error) => return Err(error),
            }
        }
        if points(&self.table).last().copied().unwrap_or_default().iteration == self.now.iteration {
            // Interrupted before the first iteration of this turn.
            return Ok(());
        }
        let policy = self.run.file("policy.onnx");
        learner.export(&policy).with_context(|| format!("cannot save {}", policy.display()))?;
        let score = (self.subject.judge)(&policy)?;
        self.now.score = score.value;
        let mut row: Vec<(String, f64)> = vec![
            ("wall_s".into(), self.now.wall_s),
            ("processor_s".into(), self.now.processor_s),
            ("env_steps".into(), self.now.env_steps),
            ("score".into(), score.value),
        ];
        row.extend(score.parts.into_iter().map(|(name, value)| (name.to_owned(), value)));
        self.table
            .append(self.now.iteration, &row)
            .with_context(|| format!("cannot write {}", self.run.file(TABLE).display()))?;
        session.save(learner.as_ref())?;
        self.running = (!self.has_ended()).then_some((learner, session));
        Ok(())
    }

    fn begin(&mut self) -> Result<(Box<dyn Learner>, Session<'a>)> {
        let learner = (self.subject.begin)(self.run)?;
        // A damaged checkpoint may have been passed over for an earlier one.
        self.table = open_table(self.run, learner.iteration())?;
        self.now = points(&self.table).last().copied().unwrap_or_default();
        if self.now.iteration != learner.iteration() {
            return Err(BadInput::new(format!(
                "{}: iteration {} was never judged, so how long it took is not known; choose another --name",
                self.run.path().display(),
                learner.iteration()
            ))
            .into());
        }
        let session = Session::open(self.run, &self.subject.settings, learner.iteration())?;
        Ok((learner, session))
    }

    /// What a progress line says of it.
    pub fn headline(&self, row: &[(String, f64)]) -> String {
        let score = match points(&self.table).last() {
            Some(last) => format!("last score {:.3}", last.score),
            None => "not judged yet".into(),
        };
        let rate = row.iter().find(|(name, _)| name == "steps_per_s").map_or(0.0, |(_, rate)| *rate);
        format!(
            "{}: {:.1} min  {} steps  {} steps/s  {score}, {:.3} wanted",
            self.name,
            self.now.wall_s / 60.0,
            short_count(self.now.env_steps),
            short_count(rate),
            self.bounds.target
        )
    }

    /// What is said when it has ended.
    pub fn farewell(&self) -> String {
        let best = self.finding().best_score;
        let target = self.bounds.target;
        match (self.reached(), &self.broken) {
            (Some(at), _) => format!("{}: {target:.3} reached after {:.1} min", self.name, at.wall_s / 60.0),
            (None, Some(reason)) => format!("{}: stopped, {reason}; best score {best:.3}", self.name),
            (None, None) => format!(
                "{}: {target:.3} not reached in {:.1} min; best score {best:.3}",
                self.name,
                self.bounds.limit_s / 60.0
            ),
        }
    }

    /// What it has found so far.
    pub fn finding(&self) -> Finding {
        let points = points(&self.table);
        let reached = self.reached();
        let at = reached.or(points.last().copied()).unwrap_or_default();
        Finding {
            seed: self.subject.settings.seed,
            target: self.bounds.target,
            limit_min: self.bounds.limit_s / 60.0,
            reached: reached.is_some(),
            broken: self.broken.clone(),
            best_score: points.iter().map(|point| point.score).reduce(f64::max).unwrap_or(0.0),
            wall_min: at.wall_s / 60.0,
            processor_min: at.processor_s / 60.0,
            iterations: at.iteration,
            env_steps: at.env_steps,
            operations: at.env_steps * self.subject.operations_per_step,
            curve: points.iter().map(|point| [point.wall_s / 60.0, point.score]).collect(),
            ..Finding::default()
        }
    }
}

fn open_table(run: &RunFolder, last: u64) -> Result<MetricsTable> {
    let path = run.file(TABLE);
    MetricsTable::open(&path, last).with_context(|| path.display().to_string())
}

fn points(table: &MetricsTable) -> Vec<Point> {
    let [wall, processor, steps, score] =
        ["wall_s", "processor_s", "env_steps", "score"].map(|name| table.column(name));
    wall.iter()
        .zip(processor)
        .zip(steps)
        .zip(score)
        .map(|(((wall, processor), steps), score)| Point {
            iteration: wall.0,
            wall_s: wall.1,
            processor_s: processor.1,
            env_steps: steps.1,
            score: score.1,
        })
        .collect()
}

/// Whether the learner broke down, and not the disk.
fn is_breakdown(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| matches!(cause.downcast_ref(), Some(ppo::TrainError::NonFinite { .. })))
}
