//! PPO on any task, as the training loop sees it, in a run's folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, Result};
use policy::{Checkpoint, VecEnv, layout, load_onnx, save_onnx};
use ppo::{Iteration, Trainer};
use serde::Serialize;
use tasks::View;
use tasks::guidance::{GuidanceConfig, GuidanceEnv};
use tasks::locomotion::{LocomotionConfig, LocomotionEnv};

use crate::error::{BadInput, OrBadInput as _};
use crate::interrupt::Interrupt;
use crate::policies;
use crate::run_config::{Run, TaskConfig, same_as_begun};
use crate::run_folder::{RunFolder, numbered_checkpoints, write_atomic};
use crate::training::{Learner, Outcome, train};
use crate::watch::{Watched, Window};

/// A task that can be trained from its settings.
pub trait Trainable: TaskConfig {
    /// Its environments.
    type Env: VecEnv + View;
    /// Widths of an observation and of an action.
    const SHAPE: [usize; 2];
    /// Metrics on the progress line.
    const SHOWN: &'static [&'static str];
    /// `num_envs` environments.
    ///
    /// # Errors
    /// Something they need is missing or does not fit.
    fn environments(&self, num_envs: usize, seed: u64) -> Result<Self::Env>;
}

impl Trainable for LocomotionConfig {
    type Env = LocomotionEnv;
    const SHAPE: [usize; 2] = [layout::LOCOMOTION_OBSERVATION, layout::JOINTS];
    const SHOWN: &'static [&'static str] =
        &["tracking_linear", "tracking_yaw", "guidance_score", "falls_per_1000", "terrain_level"];

    fn environments(&self, num_envs: usize, seed: u64) -> Result<Self::Env> {
        Ok(LocomotionEnv::new(self.clone(), num_envs, seed).map_err(in_task)?)
    }
}

impl Trainable for GuidanceConfig {
    type Env = GuidanceEnv;
    const SHAPE: [usize; 2] = [layout::SUPERVISOR_OBSERVATION, layout::COMMAND];
    const SHOWN: &'static [&'static str] = &[
        "behavior_reward/total",
        "behavior_reward/stop",
        "behavior_reward/walk",
        "behavior_reward/turn",
        "behavior_reward/spin",
        "falls_per_1000",
    ];

    fn environments(&self, num_envs: usize, seed: u64) -> Result<Self::Env> {
        let locomotion = policies::locomotion(&self.locomotion)?;
        Ok(GuidanceEnv::new(self.clone(), locomotion, num_envs, seed).map_err(in_task)?)
    }
}

fn in_task(message: String) -> BadInput {
    BadInput::new(format!("task: {message}"))
}

/// Where a training begins.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Start {
    /// At nothing; refused where there is a checkpoint.
    New,
    /// At the newest checkpoint, or at nothing.
    Resume,
    /// With the weights of another run (its folder or a checkpoint), or of the policy in an ONNX file.
    From(PathBuf),
}

/// Trains in the run's folder until its iterations are made or the user interrupts; shown through `window`, if there is one.
///
/// # Errors
/// A setting, a checkpoint or the disk that cannot be used; a learner that broke down.
pub fn learn<T: Trainable>(
    run: &RunFolder,
    config: &Run<T>,
    start: &Start,
    interrupt: &Interrupt,
    window: Option<&Arc<Window>>,
) -> Result<Outcome>
where
    Run<T>: Serialize,
{
    let mut trainer = begin(run, config, start, window)?;
    train(&mut trainer, run, &config.training, T::SHOWN, interrupt, window.map(Arc::as_ref))
}

/// The learner of a run, where it is to begin, its settings written to the run's folder; `window` shows its environments.
///
/// # Errors
/// A setting, a checkpoint or the disk that cannot be used.
pub fn begin<T: Trainable>(
    run: &RunFolder,
    config: &Run<T>,
    start: &Start,
    window: Option<&Arc<Window>>,
) -> Result<Trainer<Watched<T::Env>>>
where
    Run<T>: Serialize,
{
    let settings = &config.training;
    let env = Watched::new(config.task.environments(settings.num_envs, settings.seed)?, window.cloned());
    let mut trainer = Trainer::new(config.ppo.clone(), settings.seed, env).or_bad_input(|| "ppo".into())?;
    let text = toml::to_string(config).context("cannot write the configuration")?;
    if *start == Start::Resume {
        refuse_other_settings(run, &text)?;
        let load = |path: &Path| Ok(trainer.restore(&Checkpoint::load(path)?)?);
        if run.load_newest(load, |line| eprintln!("{line}"))?.is_none() {
            eprintln!("{} has no checkpoint yet: beginning", run.path().display());
        }
    } else if !run.checkpoints()?.is_empty() {
        let message = format!(
            "{} already has checkpoints: go on with --resume, or choose another --name",
            run.path().display()
        );
        return Err(BadInput::new(message).into());
    }
    if let Start::From(source) = start {
        warm_start(&mut trainer, source).or_bad_input(|| format!("--init-from {}", source.display()))?;
    }
    let path = run.file("config.toml");
    write_atomic(&path, text.as_bytes()).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(trainer)
}

/// A run with checkpoints goes on with its own settings: others would make of it what no run from the start gives.
fn refuse_other_settings(run: &RunFolder, now: &str) -> Result<()> {
    if run.checkpoints()?.is_empty() {
        return Ok(());
    }
    let path = run.file("config.toml");
    let begun = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    let begun = begun.parse().or_bad_input(|| path.display().to_string())?;
    let now = now.parse().context("the configuration just written")?;
    same_as_begun(&begun, &now).map_err(|difference| {
        BadInput::new(format!(
            "{}: {difference}; go on with the settings it was begun with, or choose another --name",
            run.path().display()
        ))
    })?;
    Ok(())
}

/// Begins where another run, or the policy in an ONNX file, ended.
fn warm_start<E: VecEnv>(trainer: &mut Trainer<E>, source: &Path) -> Result<()> {
    if source.extension().is_some_and(|extension| extension == "onnx") {
        return Ok(trainer.warm_start_policy(&load_onnx(source)?.mlp)?);
    }
    Ok(trainer.warm_start(&Checkpoint::load(&newest_of(source)?)?)?)
}

/// A checkpoint file, or the newest one of a run's folder.
fn newest_of(source: &Path) -> Result<PathBuf> {
    if source.is_file() {
        return Ok(source.to_owned());
    }
    let newest = numbered_checkpoints(source)?.into_iter().next();
    Ok(newest.context("there is no checkpoint in it")?.1)
}

impl<E: VecEnv> Learner for Trainer<E> {
    fn iteration(&self) -> u64 {
        Trainer::iteration(self)
    }

    fn iterate(&mut self) -> Result<Vec<(String, f64)>> {
        Ok(named(&Trainer::iterate(self)?))
    }

    fn steps_per_iteration(&self) -> u64 {
        Trainer::steps_per_iteration(self)
    }

    fn distributions(&self) -> Vec<(String, Vec<f32>)> {
        Trainer::distributions(self)
    }

    fn save(&self, path: &Path) -> Result<()> {
        Ok(self.checkpoint().save(path)?)
    }

    fn export(&self, path: &Path) -> Result<()> {
        let mut metadata = self.env().metadata();
        metadata.push(("guidedog_version".into(), env!("CARGO_PKG_VERSION").into()));
        Ok(save_onnx(path, &self.policy(), &metadata)?)
    }
}

/// The numbers of an iteration by name.
fn named(iteration: &Iteration) -> Vec<(String, f64)> {
    let [simulation_s, inference_s, update_s] = iteration.times_s;
    let own = [
        ("env_steps", iteration.env_steps as f64),
        ("step_reward", iteration.step_reward),
        ("episode_return", iteration.episode_return),
        ("episode_length", iteration.episode_length),
        ("surrogate_loss", iteration.surrogate_loss),
        ("value_loss", iteration.value_loss),
        ("kl", iteration.kl),
        ("clip_fraction", iteration.clip_fraction),
        ("gradient_norm", iteration.gradient_norm),
        ("action_std", iteration.action_std),
        ("learning_rate", iteration.learning_rate),
        ("time/simulation_s", simulation_s),
        ("time/inference_s", inference_s),
        ("time/update_s", update_s),
    ];
    let own = own.into_iter().map(|(name, value)| (name.to_owned(), value));
    own.chain(iteration.environment.iter().cloned()).collect()
}
