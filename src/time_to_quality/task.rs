//! What is trained, with what settings, and to what score.

use std::path::Path;

use anyhow::{Context as _, Result, anyhow};
use evaluation::milestones::{self, Score, Understanding};
use serde::Serialize;
use tasks::guidance::{GuidanceConfig, LocomotionPolicy};
use tasks::locomotion::LocomotionConfig;
use tasks::simulation::DECIMATION;

use crate::config::resolve_text;
use crate::error::BadInput;
use crate::learner::{Start, Trainable, Training, refuse_other_settings};
use crate::policies;
use crate::run_config::{LocomotionRun, Run, SupervisorRun};
use crate::run_folder::RunFolder;
use crate::stages;
use crate::training::{Learner, TrainingSettings};

/// Operations of one physics step of a robot, of which flat ground needs a little less and rough ground a little more:
/// `cargo bench --bench physics -- --count`. Of learning to walk they are less than a percent.
const PHYSICS_STEP_OPERATIONS: f64 = 16e3;

/// What is learned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// Walking on level ground.
    Flat,
    /// Walking on rough ground.
    Rough,
    /// Understanding pulls.
    Supervisor,
}

impl Task {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Flat, Self::Rough, Self::Supervisor];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Rough => "rough",
            Self::Supervisor => "supervisor",
        }
    }

    /// The score wanted; [`milestones`] says what it is.
    pub fn target(self) -> f64 {
        match self {
            Self::Flat => 0.9,
            Self::Rough => 5.0,
            Self::Supervisor => 0.95,
        }
    }

    /// What the score is, in a few words.
    pub fn score_name(self) -> &'static str {
        match self {
            Self::Flat => "tracking, share of its ceiling",
            Self::Rough => "curriculum level with nine in ten surviving",
            Self::Supervisor => "behavior reward, share of the oracle's",
        }
    }

    /// Longest training, unless said otherwise \[min\].
    pub fn limit_min(self) -> f64 {
        match self {
            Self::Flat => 30.0,
            Self::Rough => 90.0,
            Self::Supervisor => 15.0,
        }
    }

    /// Training between two judgments, unless said otherwise \[s\].
    pub fn interval_s(self) -> f64 {
        if self == Self::Rough { 60.0 } else { 20.0 }
    }

    /// The stages of a training of this task, one or several: [`crate::stages`] or else its defaults, under `settings`.
    ///
    /// # Errors
    /// A setting that is unknown or out of range, or a policy that cannot be used.
    pub fn stages(self, settings: &[String], seed: u64) -> Result<Vec<Stage>> {
        let settings = [settings, &[format!("training.seed={seed}")]].concat();
        let walk = |files, judge: JudgeWalk| {
            let stages = stages::resolve(files, &settings)?.into_iter();
            stages.map(|(name, config)| walking(name, config, judge)).collect()
        };
        match self {
            Self::Flat => walk(stages::FLAT, milestones::flat),
            Self::Rough => walk(stages::ROUGH, milestones::rough),
            Self::Supervisor => Ok(vec![understanding(resolve_text("defaults", "", &settings)?)?]),
        }
    }
}

/// Settings that are compared with others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// `key=value` each.
    pub settings: Vec<String>,
}

impl Variant {
    /// Reads `name=key=value,key=value`, or a name alone: nothing different.
    ///
    /// # Errors
    /// There is no name.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let (name, rest) = text.split_once('=').unwrap_or((text, ""));
        if name.is_empty() {
            return Err(BadInput::new(format!("--variant {text}: must be NAME=key=value,key=value")));
        }
        let mut settings = vec![String::new()];
        let mut depth = 0;
        for c in rest.chars() {
            depth += i32::from(c == '[') - i32::from(c == ']');
            match settings.last_mut() {
                Some(last) if c != ',' || depth > 0 => last.push(c),
                _ => settings.push(String::new()),
            }
        }
        settings.retain(|setting| !setting.trim().is_empty());
        Ok(Self { name: name.to_owned(), settings })
    }
}

type Begin = dyn Fn(&RunFolder, &Start) -> Result<Box<dyn Learner>>;
type Check = dyn Fn(&RunFolder) -> Result<()>;
type Judge = dyn Fn(&Path) -> Result<Score>;
type JudgeWalk = fn(&LocomotionPolicy) -> Result<Score, String>;

/// A training, or a part of it, that can be begun and judged, whatever it is of.
pub struct Stage {
    /// Its name, a plain folder name.
    pub name: String,
    /// How it trains; the number of iterations of a last stage does not count.
    pub settings: TrainingSettings,
    /// Needed operations of an environment step: inference, update and simulation.
    pub operations_per_step: f64,
    pub(super) begin: Box<Begin>,
    /// Refuses a folder that was begun with other settings.
    pub(super) check: Box<Check>,
    /// Judges a policy file.
    pub(super) judge: Box<Judge>,
}

fn of_run<T: Trainable + 'static>(
    name: String,
    config: Run<T>,
    simulation_operations: f64,
    judge: impl Fn(&Path) -> Result<Score> + 'static,
) -> Result<Stage>
where
    Run<T>: Serialize,
{
    config.validate()?;
    let [observations, actions] = T::SHAPE;
    let operations_per_step = config.ppo.inference_operations(observations, actions)
        + config.ppo.update_operations(observations, actions)
        + simulation_operations;
    let settings = config.training.clone();
    let wanted = config.clone();
    let check = move |run: &RunFolder| refuse_other_settings(run, &wanted);
    let begin = move |run: &RunFolder, start: &Start| -> Result<Box<dyn Learner>> {
        Ok(Box::new(Training::unseen(&config, start).begin(run)?))
    };
    let (begin, check, judge) = (Box::new(begin), Box::new(check), Box::new(judge));
    Ok(Stage { name, settings, operations_per_step, begin, check, judge })
}

fn walking(name: String, config: LocomotionRun, judge: JudgeWalk) -> Result<Stage> {
    let simulation = DECIMATION as f64 * PHYSICS_STEP_OPERATIONS;
    of_run::<LocomotionConfig>(name, config, simulation, move |path| {
        judge(&policies::locomotion(policies::name(path)?)?).map_err(|message| anyhow!(message))
    })
}

fn understanding(config: SupervisorRun) -> Result<Stage> {
    let walk = policies::locomotion(&config.task.locomotion)?;
    let control_steps = f64::from(config.task.supervisor_period_s / tasks::simulation::CONTROL_PERIOD_S);
    let control_step = DECIMATION as f64 * PHYSICS_STEP_OPERATIONS + 2.0 * walk.num_parameters() as f64;
    // The oracle plays once, when the first score is asked for.
    let judge = std::cell::OnceCell::new();
    of_run::<GuidanceConfig>("supervisor".into(), config, control_steps * control_step, move |path| {
        if judge.get().is_none() {
            let understanding = Understanding::new(walk.clone()).map_err(|message| anyhow!(message))?;
            judge.get_or_init(|| understanding);
        }
        let judge = judge.get().context("the oracle has played")?;
        judge.score(&policies::supervisor(policies::name(path)?)?).map_err(|message| anyhow!(message))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_variant_is_read_with_lists_in_it() {
        let variant = Variant::parse("small=ppo.actor_hidden=[64, 32],ppo.epochs=3").unwrap();
        assert_eq!(variant.name, "small");
        assert_eq!(variant.settings, ["ppo.actor_hidden=[64, 32]", "ppo.epochs=3"]);
        assert_eq!(Variant::parse("plain").unwrap().settings, [""; 0]);
        assert!(Variant::parse("=x=1").unwrap_err().to_string().contains("--variant =x=1"));
    }

    #[test]
    fn every_task_has_a_training_whose_operations_are_mostly_those_of_the_update() {
        for task in Task::ALL {
            for stage in task.stages(&[], 3).unwrap() {
                assert_eq!(stage.settings.seed, 3);
                assert!((2e6..3e7).contains(&stage.operations_per_step), "{}", stage.operations_per_step);
            }
        }
        let refusal = Task::Flat.stages(&["ppo.epochs=0".to_owned()], 1).err().unwrap();
        assert!(refusal.to_string().contains("epochs is 0"), "{refusal}");
    }
}
