//! The stages in which robots learn to walk: settings of their own each, and the weights of the stage before to begin with.
//!
//! Few robots with many updates find the first steps, many robots with one pass over their samples the rest (docs/findings.md).

use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::config::resolve_text;
use crate::error::BadInput;
use crate::interrupt::Interrupt;
use crate::learner::{Start, Training};
use crate::run_config::LocomotionRun;
use crate::run_folder::RunFolder;
use crate::training::Outcome;

/// The settings of a stage: a file of `configs/locomotion/`, which is in the program.
#[derive(Clone, Copy, Debug)]
pub struct StageFile {
    name: &'static str,
    path: &'static str,
    text: &'static str,
}

macro_rules! stage {
    ($name:literal) => {
        StageFile {
            name: $name,
            path: concat!("configs/locomotion/", $name, ".toml"),
            text: include_str!(concat!("../configs/locomotion/", $name, ".toml")),
        }
    };
}

/// Walking on level ground, from nothing, in minutes.
pub const FLAT: &[StageFile] = &[stage!("level"), stage!("flat")];
/// Walking on rough ground, from nothing, in an hour or two.
pub const ROUGH: &[StageFile] =
    &[stage!("level"), stage!("rough"), stage!("explore"), stage!("precise"), stage!("fine")];

/// Names and settings of stages, all under `settings` (`key=value` each).
///
/// # Errors
/// A setting that is unknown or out of range.
pub fn resolve(stages: &[StageFile], settings: &[String]) -> Result<Vec<(String, LocomotionRun)>, BadInput> {
    let of = |(index, stage): (usize, &StageFile)| {
        let config: LocomotionRun = resolve_text(stage.path, stage.text, settings)?;
        config.validate()?;
        Ok((format!("{}-{}", index + 1, stage.name), config))
    };
    stages.iter().enumerate().map(of).collect()
}

/// Where a training leaves what it makes: a run folder, and if there are several stages one in it for each.
#[derive(Debug)]
pub struct Place {
    run: RunFolder,
    stages: Vec<RunFolder>,
}

impl Place {
    /// Makes (or enters) the folders below `root`; `stages` are the stages' names.
    ///
    /// # Errors
    /// As [`RunFolder::open`].
    pub fn open<'a>(root: &Path, name: &str, stages: impl ExactSizeIterator<Item = &'a str>) -> Result<Self> {
        let run = RunFolder::open(root, name)?;
        let several = stages.len() > 1;
        let stages = stages
            .filter(|_| several)
            .map(|stage| RunFolder::open(run.path(), stage))
            .collect::<Result<_>>()?;
        Ok(Self { run, stages })
    }

    /// The folder of the whole training.
    pub fn run(&self) -> &RunFolder {
        &self.run
    }

    /// The run folder of a stage.
    pub fn stage(&self, index: usize) -> &RunFolder {
        self.stages.get(index).unwrap_or(&self.run)
    }

    /// The last stage that has a checkpoint, with the iteration of its newest: the first stage and 0 if there is none.
    ///
    /// # Errors
    /// A folder cannot be read.
    pub fn newest(&self) -> Result<(usize, u64)> {
        for index in (0..self.stages.len().max(1)).rev() {
            if let Some((iteration, _)) = self.stage(index).checkpoints()?.first() {
                return Ok((index, *iteration));
            }
        }
        Ok((0, 0))
    }

    /// Where a stage begins: at its own newest checkpoint, or else with the weights of the stage before.
    ///
    /// # Errors
    /// A folder cannot be read.
    pub fn start(&self, index: usize) -> Result<Start> {
        let begins_anew = index > 0 && self.stage(index).checkpoints()?.is_empty();
        Ok(if begins_anew { Start::From(self.stage(index - 1).path().to_owned()) } else { Start::Resume })
    }
}

/// Trains one stage after the other in `root/name`, from where they were, all under `settings`; the file of the last one's
/// policy, or `None` if the user interrupts.
///
/// # Errors
/// As [`resolve`], [`Place::open`] and [`Training::learn`].
pub fn learn_all(
    root: &Path,
    name: &str,
    stages: &[StageFile],
    settings: &[String],
    interrupt: &Interrupt,
) -> Result<Option<PathBuf>> {
    let stages = resolve(stages, settings)?;
    let place = Place::open(root, name, stages.iter().map(|(name, _)| name.as_str()))?;
    crate::tell!("learning to walk, in {}", place.run().path().display());
    for (index, (_, config)) in stages.iter().enumerate() {
        let outcome = Training::unseen(config, &place.start(index)?).learn(place.stage(index), interrupt)?;
        if outcome == Outcome::Interrupted {
            return Ok(None);
        }
    }
    Ok(Some(place.stage(stages.len() - 1).file("policy.onnx")))
}
