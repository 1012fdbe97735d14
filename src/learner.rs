//! PPO on any task, as the training loop sees it, in a run's folder.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context as _, Result};
use policy::{Checkpoint, Share, VecEnv, layout, read_onnx, save_onnx};
use ppo::exchange::Alone;
use ppo::{Exchange, Iteration, Trainer};
use serde::Serialize;
use tasks::View;
use tasks::guidance::{GuidanceConfig, GuidanceEnv, SQUAD};
use tasks::locomotion::{LocomotionConfig, LocomotionEnv};
use tasks::simulation::GROUP;

use crate::config::resolve_text;
use crate::error::{BadInput, OrBadInput as _};
use crate::interrupt::Interrupt;
use crate::policies;
use crate::ranks;
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
    /// Environments that stay together when several ranks share them.
    const TOGETHER: usize;
    /// Some of a training's environments.
    ///
    /// # Errors
    /// Something they need is missing or does not fit.
    fn shared_environments(&self, share: Share, seed: u64) -> Result<Self::Env>;
    /// `num_envs` environments.
    ///
    /// # Errors
    /// Something they need is missing or does not fit.
    fn environments(&self, num_envs: usize, seed: u64) -> Result<Self::Env> {
        self.shared_environments(Share::whole(num_envs), seed)
    }
}

impl Trainable for LocomotionConfig {
    type Env = LocomotionEnv;
    const SHAPE: [usize; 2] = [layout::LOCOMOTION_OBSERVATION, layout::JOINTS];
    const SHOWN: &'static [&'static str] =
        &["tracking_linear", "tracking_yaw", "guidance_score", "falls_per_1000", "terrain_level"];
    const TOGETHER: usize = GROUP;

    fn shared_environments(&self, share: Share, seed: u64) -> Result<Self::Env> {
        Ok(LocomotionEnv::with_share(self.clone(), share, seed).map_err(in_task)?)
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
    const TOGETHER: usize = SQUAD;

    fn shared_environments(&self, share: Share, seed: u64) -> Result<Self::Env> {
        let locomotion = policies::locomotion(&self.locomotion)?;
        Ok(GuidanceEnv::with_share(self.clone(), locomotion, share, seed).map_err(in_task)?)
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

/// A training: of what, from where, and who sees it.
#[derive(Debug)]
pub struct Training<'a, T> {
    /// All settings.
    pub config: &'a Run<T>,
    /// Where it begins.
    pub start: &'a Start,
    /// Shows its environments and curves, if there is one.
    pub window: Option<&'a Arc<Window>>,
}

impl<'a, T: Trainable> Training<'a, T>
where
    Run<T>: Serialize,
{
    /// One that nobody watches.
    pub fn unseen(config: &'a Run<T>, start: &'a Start) -> Self {
        Self { config, start, window: None }
    }

    /// Trains in the run's folder until its iterations are made or the user interrupts.
    ///
    /// # Errors
    /// A setting, a checkpoint or the disk that cannot be used; a learner that broke down.
    pub fn learn(&self, run: &RunFolder, interrupt: &Interrupt) -> Result<Outcome> {
        self.learn_together(Box::new(Alone), Some(run), interrupt)
    }

    /// As [`Self::learn`], one of several ranks. Rank 0 alone has the run's folder and a window, and its interrupt alone counts.
    ///
    /// # Errors
    /// As [`Self::learn`], on whichever rank: all of them end.
    pub fn learn_together(
        &self,
        exchange: Box<dyn Exchange>,
        run: Option<&RunFolder>,
        interrupt: &Interrupt,
    ) -> Result<Outcome> {
        let mut trainer = self.begin_together(exchange, run)?;
        let Some(run) = run else { return ranks::follow(&mut trainer) };
        let mut leader = ranks::Leader(&mut trainer);
        let window = self.window.map(Arc::as_ref);
        let result = self
            .keep_beginning(&leader, run)
            .and_then(|()| train(&mut leader, run, &self.config.training, T::SHOWN, interrupt, window));
        leader.end(result)
    }

    /// Killed before its first checkpoint, a run that begins from another would be resumed from nothing.
    fn keep_beginning(&self, learner: &dyn Learner, run: &RunFolder) -> Result<()> {
        let Start::From(_) = self.start else { return Ok(()) };
        let path = run.checkpoint(learner.iteration());
        learner.save(&path).with_context(|| format!("cannot save {}", path.display()))
    }

    /// The learner, where it is to begin, its settings written to the run's folder.
    ///
    /// # Errors
    /// A setting, a checkpoint or the disk that cannot be used.
    pub fn begin(&self, run: &RunFolder) -> Result<Trainer<Watched<T::Env>>> {
        self.begin_together(Box::new(Alone), Some(run))
    }

    /// As [`Self::begin`], one of several ranks.
    fn begin_together(
        &self,
        exchange: Box<dyn Exchange>,
        run: Option<&RunFolder>,
    ) -> Result<Trainer<Watched<T::Env>>> {
        let config = self.config;
        if run.is_some() && !config.ppo.precision.is_accelerated() {
            crate::tell!(
                "ppo.precision is bf16, which is slower than f32 here: this processor has no AVX-512 BF16"
            );
        }
        let text = toml::to_string(config).context("cannot write the configuration")?;
        same_on_all(&*exchange, &text)?;
        let env = exchange.agree(environments(&*exchange, config))?;
        let env = Watched::new(env, self.window.cloned());
        let mut trainer = Trainer::with_ranks(config.ppo.clone(), config.training.seed, env, exchange)
            .or_bad_input(|| "ppo".into())?;
        let found: Result<Vec<u8>> = run.map_or(Ok(Vec::new()), |run| {
            let found = find_beginning::<T>(&mut trainer, run, config, self.start)?;
            let path = run.file("config.toml");
            write_atomic(&path, text.as_bytes())
                .with_context(|| format!("cannot write {}", path.display()))?;
            Ok(found)
        });
        let found = trainer.exchange().lead(|| found)?;
        let begun = if run.is_some() { Ok(()) } else { begin_at(&mut trainer, &found) };
        trainer.exchange().agree(begun)?;
        Ok(trainer)
    }
}

/// This rank's share of the environments.
fn environments<T: Trainable>(exchange: &dyn Exchange, config: &Run<T>) -> Result<T::Env> {
    let total = config.training.num_envs;
    let share = Share::of_rank(exchange.rank(), exchange.ranks(), total, T::TOGETHER);
    let share = share.map_err(|message| BadInput::new(format!("training.{message}")))?;
    config.task.shared_environments(share, config.training.seed)
}

/// Refuses ranks that were started with other settings than rank 0.
fn same_on_all(exchange: &dyn Exchange, text: &str) -> Result<()> {
    let leads = exchange.lead(|| anyhow::Ok(text.as_bytes().to_vec()))?;
    let same = if leads == text.as_bytes() {
        Ok(())
    } else {
        Err(BadInput::new("other settings than rank 0, must be the same (is the --config file?)").into())
    };
    exchange.agree(same)
}

/// What a learner begins with: the first byte of what rank 0 found, before the bytes of the file.
const CHECKPOINT: u8 = 1;
const WEIGHTS: u8 = 2;
const POLICY: u8 = 3;

/// Begins with what [`find_beginning`] found; with nothing if that is nothing.
fn begin_at<E: VecEnv>(trainer: &mut Trainer<E>, found: &[u8]) -> Result<()> {
    match found.split_first() {
        Some((&CHECKPOINT, file)) => Ok(trainer.restore(&Checkpoint::from_bytes(file)?)?),
        Some((&WEIGHTS, file)) => Ok(trainer.warm_start(&Checkpoint::from_bytes(file)?)?),
        Some((&POLICY, file)) => Ok(trainer.warm_start_policy(&read_onnx(file)?.mlp)?),
        _ => Ok(()),
    }
}

/// Begins where `start` says, and returns what the other ranks need to do so, too.
fn find_beginning<T: Trainable>(
    trainer: &mut Trainer<Watched<T::Env>>,
    run: &RunFolder,
    config: &Run<T>,
    start: &Start,
) -> Result<Vec<u8>>
where
    Run<T>: Serialize,
{
    let mut begin_with = |kind: u8, path: &Path| -> Result<Vec<u8>> {
        let file = std::fs::read(path).with_context(|| path.display().to_string())?;
        let found = [&[kind][..], &file].concat();
        begin_at(trainer, &found)?;
        Ok(found)
    };
    if *start == Start::Resume {
        refuse_other_settings(run, config)?;
        let found = run.load_newest(|path| begin_with(CHECKPOINT, path), |line| crate::tell!("{line}"))?;
        if found.is_none() {
            refuse_lost_beginning(run)?;
            crate::tell!("{} has no checkpoint yet: beginning", run.path().display());
        }
        return Ok(found.unwrap_or_default());
    }
    if !run.checkpoints()?.is_empty() {
        let message = format!(
            "{} already has checkpoints: go on with --resume, or choose another --name",
            run.path().display()
        );
        return Err(BadInput::new(message).into());
    }
    let begun_from = run.file(BEGUN_FROM);
    let Start::From(source) = start else {
        // Of a beginning that came to nothing.
        if begun_from.exists() {
            std::fs::remove_file(&begun_from).with_context(|| format!("cannot remove {BEGUN_FROM}"))?;
        }
        return Ok(Vec::new());
    };
    let is_policy = source.extension().is_some_and(|extension| extension == "onnx");
    let (kind, file) = if is_policy { (POLICY, Ok(source.clone())) } else { (WEIGHTS, newest_of(source)) };
    let found = file.and_then(|file| Ok((begin_with(kind, &file)?, file)));
    let (found, file) = found.or_bad_input(|| format!("--init-from {}", source.display()))?;
    let said = format!("{} crc32c {:08x}\n", file.display(), crc32c::crc32c(&found[1..]));
    write_atomic(&begun_from, said.as_bytes()).with_context(|| format!("cannot write {BEGUN_FROM}"))?;
    Ok(found)
}

/// What says from which file a run began, and the file's checksum.
const BEGUN_FROM: &str = "begun_from.txt";

/// A run that began from another and was killed before its first checkpoint is not begun from nothing.
fn refuse_lost_beginning(run: &RunFolder) -> Result<(), BadInput> {
    let Ok(said) = std::fs::read_to_string(run.file(BEGUN_FROM)) else { return Ok(()) };
    let from = said.split_once(" crc32c").map_or(said.as_str(), |(from, _)| from);
    let run = run.path().display();
    Err(BadInput::new(format!("{run} has no checkpoint yet: begin it again with --init-from {from}")))
}

/// A run with checkpoints goes on with its own settings: others would make of it what no run from the start gives.
///
/// # Errors
/// The first setting that differs, with both values.
pub(crate) fn refuse_other_settings<T: Trainable>(run: &RunFolder, now: &Run<T>) -> Result<()>
where
    Run<T>: Serialize,
{
    if run.checkpoints()?.is_empty() {
        return Ok(());
    }
    let path = run.file("config.toml");
    let begun = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    // A setting that a run of before does not name yet is what it is by default.
    let begun: Run<T> = resolve_text(&path.display().to_string(), &begun, &[])?;
    let table = |config: &Run<T>| -> Result<toml::Table> { Ok(toml::to_string(config)?.parse()?) };
    let [begun, now] = [&begun, now].map(table);
    same_as_begun(&begun?, &now?).map_err(|difference| {
        BadInput::new(format!(
            "{}: {difference}; go on with the settings it was begun with, or choose another --name",
            run.path().display()
        ))
    })?;
    Ok(())
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
        ("roughness", iteration.roughness),
        ("gradient_norm", iteration.gradient_norm),
        ("action_std", iteration.action_std),
        ("learning_rate", iteration.learning_rate),
        ("time/simulation_s", simulation_s),
        ("time/inference_s", inference_s),
        ("time/update_s", update_s),
    ];
    let together =
        [("time/exchange_s", iteration.exchange_s), ("exchange_mb", iteration.exchange_bytes as f64 / 1e6)];
    let together = if iteration.exchange_bytes > 0 { &together[..] } else { &[] };
    let own = own.iter().chain(together).map(|&(name, value)| (name.to_owned(), value));
    own.chain(iteration.environment.iter().cloned()).collect()
}
