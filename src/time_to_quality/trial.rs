//! One training on its way to a score.

use std::time::Instant;

use anyhow::{Context as _, Result};

use super::{Finding, Stage};
use crate::error::BadInput;
use crate::interrupt::Interrupt;
use crate::machine::processor_s;
use crate::metrics::MetricsTable;
use crate::progress::short_count;
use crate::run_folder::RunFolder;
use crate::session::Session;
use crate::stages::Place;
use crate::training::Learner;

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
    pub(super) operations: f64,
    pub(super) score: f64,
}

/// One training with one seed, in one stage or several.
pub struct Trial<'a> {
    name: String,
    place: &'a Place,
    stages: &'a [Stage],
    bounds: Bounds,
    table: MetricsTable,
    /// Spent so far; ahead of the last point while a turn lasts.
    now: Point,
    running: Option<Running<'a>>,
    /// Why it cannot go on.
    broken: Option<String>,
}

/// The stage that learns.
struct Running<'a> {
    index: usize,
    learner: Box<dyn Learner>,
    session: Session<'a>,
}

/// The scores of a trial, in its run's folder.
const TABLE: &str = "time_to_quality.csv";

impl<'a> Trial<'a> {
    /// A trial of at least one stage that goes on where its folders say; nothing is built before its first turn.
    ///
    /// # Errors
    /// A folder cannot be read, or was begun with other settings.
    pub fn open(name: &str, place: &'a Place, stages: &'a [Stage], bounds: Bounds) -> Result<Self> {
        // Here already: a trial that has ended takes no turn in which its learner would refuse them.
        stages.iter().enumerate().try_for_each(|(index, stage)| (stage.check)(place.stage(index)))?;
        let (index, newest) = place.newest()?;
        let table = open_table(place.run(), before(stages, index) + newest)?;
        let now = points(&table).last().copied().unwrap_or_default();
        let name = name.to_owned();
        Ok(Self { name, place, stages, bounds, table, now, running: None, broken: None })
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

    /// Trains for an interval (less if the user interrupts or a stage ends), judges, records, saves. `watch` sees every
    /// iteration's numbers.
    ///
    /// # Errors
    /// The trial cannot begin or go on, or the disk refuses.
    pub fn take_turn(
        &mut self,
        interrupt: &Interrupt,
        mut watch: impl FnMut(&Self, &[(String, f64)]),
    ) -> Result<()> {
        let Running { index, mut learner, mut session } = match self.running.take() {
            Some(running) => running,
            None => self.begin()?,
        };
        let stage = &self.stages[index];
        let end = (self.now.wall_s + self.bounds.interval_s).min(self.bounds.limit_s);
        while self.now.wall_s < end && !self.moves_on(index, learner.iteration()) && !interrupt.requested() {
            let (began, processor) = (Instant::now(), processor_s());
            match session.iterate(learner.as_mut()) {
                Ok(row) => {
                    let steps = learner.steps_per_iteration() as f64;
                    self.now.wall_s += began.elapsed().as_secs_f64();
                    self.now.processor_s += processor_s() - processor;
                    self.now.iteration = before(self.stages, index) + learner.iteration();
                    self.now.env_steps += steps;
                    self.now.operations += steps * stage.operations_per_step;
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
        let policy = self.place.stage(index).file("policy.onnx");
        learner.export(&policy).with_context(|| format!("cannot save {}", policy.display()))?;
        let score = (stage.judge)(&policy)?;
        self.now.score = score.value;
        let mut row: Vec<(String, f64)> = vec![
            ("wall_s".into(), self.now.wall_s),
            ("processor_s".into(), self.now.processor_s),
            ("env_steps".into(), self.now.env_steps),
            ("operations".into(), self.now.operations),
            ("score".into(), score.value),
        ];
        row.extend(score.parts.into_iter().map(|(name, value)| (name.to_owned(), value)));
        self.table
            .append(self.now.iteration, &row)
            .and_then(|()| self.table.to_disk())
            .with_context(|| format!("cannot write {}", self.place.run().file(TABLE).display()))?;
        // After the row: what no row tells of cannot go on.
        session.save(learner.as_ref())?;
        if !self.has_ended() && !self.moves_on(index, learner.iteration()) {
            self.running = Some(Running { index, learner, session });
        }
        Ok(())
    }

    /// Whether a stage that has made `iteration` iterations makes room for the next.
    fn moves_on(&self, index: usize, iteration: u64) -> bool {
        index + 1 < self.stages.len() && iteration >= self.stages[index].settings.iterations
    }

    /// The stage that is to learn: the last that has begun, or the one after it, with its weights.
    fn begin(&mut self) -> Result<Running<'a>> {
        let (mut index, newest) = self.place.newest()?;
        if self.moves_on(index, newest) {
            index += 1;
        }
        let (stage, run) = (&self.stages[index], self.place.stage(index));
        let learner = (stage.begin)(run, &self.place.start(index)?)?;
        let iteration = before(self.stages, index) + learner.iteration();
        // A damaged checkpoint may have been passed over for an earlier one.
        self.table = open_table(self.place.run(), iteration)?;
        self.now = points(&self.table).last().copied().unwrap_or_default();
        if self.now.iteration != iteration {
            return Err(BadInput::new(format!(
                "{}: iteration {iteration} was never judged, so how long it took is not known; choose another --name",
                run.path().display(),
            ))
            .into());
        }
        let session = Session::open(run, &stage.settings, learner.iteration())?;
        Ok(Running { index, learner, session })
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
            seed: self.stages[0].settings.seed,
            target: self.bounds.target,
            limit_min: self.bounds.limit_s / 60.0,
            reached: reached.is_some(),
            broken: self.broken.clone(),
            best_score: points.iter().map(|point| point.score).reduce(f64::max).unwrap_or(0.0),
            wall_min: at.wall_s / 60.0,
            processor_min: at.processor_s / 60.0,
            iterations: at.iteration,
            env_steps: at.env_steps,
            operations: at.operations,
            curve: points.iter().map(|point| [point.wall_s / 60.0, point.score]).collect(),
            ..Finding::default()
        }
    }
}

/// Iterations of the stages before one.
fn before(stages: &[Stage], index: usize) -> u64 {
    stages[..index].iter().map(|stage| stage.settings.iterations).sum()
}

fn open_table(run: &RunFolder, last: u64) -> Result<MetricsTable> {
    let path = run.file(TABLE);
    MetricsTable::open(&path, last).with_context(|| path.display().to_string())
}

fn points(table: &MetricsTable) -> Vec<Point> {
    let column = |name| table.column(name);
    let [wall, processor, steps, operations, score] =
        ["wall_s", "processor_s", "env_steps", "operations", "score"].map(column);
    let point = |(row, &(iteration, wall_s)): (usize, &(u64, f64))| {
        let of = |column: &[(u64, f64)]| column.get(row).map(|(_, value)| *value);
        Some(Point {
            iteration,
            wall_s,
            processor_s: of(&processor)?,
            env_steps: of(&steps)?,
            operations: of(&operations)?,
            score: of(&score)?,
        })
    };
    wall.iter().enumerate().filter_map(point).collect()
}

/// Whether the learner broke down, and not the disk.
fn is_breakdown(error: &anyhow::Error) -> bool {
    error.chain().any(|cause| matches!(cause.downcast_ref(), Some(ppo::TrainError::NonFinite { .. })))
}
