//! `guidedog train`: learns a policy into a run folder.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Args, Subcommand};
use guidedog::config::resolve;
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::interrupt::Interrupt;
use guidedog::policy::{Checkpoint, VecEnv};
use guidedog::ppo::{self, Trainer};
use guidedog::run_config::LocomotionRun;
use guidedog::run_folder::{RunFolder, numbered_checkpoints, write_atomic};
use guidedog::tasks::locomotion::LocomotionEnv;
use guidedog::training::{Outcome, TrainingSettings, train};

/// Learns a policy into runs/NAME; stop it at any moment and go on with --resume
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
Examples:
  guidedog train locomotion --name walk
  guidedog train locomotion --name walk --resume
  guidedog train locomotion --name flat --set task.terrain=flat --set training.iterations=500
  guidedog train locomotion --name finer --init-from runs/walk --set ppo.desired_kl=0.01

Everything a run leaves is in its folder: config.toml (all settings as used), metrics.csv and
TensorBoard events, checkpoints/.";

#[derive(Debug, Subcommand)]
enum What {
    /// The policy that walks as told: 235 inputs, 12 joint targets
    Locomotion(Options),
}

#[derive(Debug, Args)]
struct Options {
    /// Name of the run: a folder in runs/
    #[arg(long, default_value = "locomotion")]
    name: String,
    /// Settings that differ from the defaults, a TOML file
    #[arg(long)]
    config: Option<PathBuf>,
    /// One setting, e.g. ppo.epochs=3; may be given many times, the last one counts
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on from the run's newest checkpoint, to the same bits as if it had never stopped
    #[arg(long)]
    resume: bool,
    /// Begin with the weights of another run (its folder or a checkpoint file)
    #[arg(long, value_name = "RUN", conflicts_with = "resume")]
    init_from: Option<PathBuf>,
    /// Threads [default: one a core]
    #[arg(long)]
    threads: Option<usize>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Locomotion(options) => locomotion(options),
    }
}

fn locomotion(options: &Options) -> Result<ExitCode> {
    let config: LocomotionRun = resolve(options.config.as_deref(), &options.set)?;
    config.validate()?;
    let settings = &config.training;
    let env = LocomotionEnv::new(config.task.clone(), settings.num_envs, settings.seed)
        .map_err(|message| BadInput::new(format!("task: {message}")))?;
    let text = toml::to_string(&config).context("cannot write the configuration")?;
    let shown = ["episode_return", "tracking_linear", "tracking_yaw", "falls_per_1000", "terrain_level"];
    learn(options, settings, &config.ppo, env, &text, &shown)
}

/// Trains any task by PPO in the run's folder.
fn learn<E: VecEnv>(
    options: &Options,
    settings: &TrainingSettings,
    ppo: &ppo::Config,
    env: E,
    config: &str,
    shown: &[&str],
) -> Result<ExitCode> {
    if let Some(threads) = options.threads {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build_global()
            .or_bad_input(|| format!("--threads {threads}"))?;
    }
    let run = RunFolder::open(Path::new("runs"), &options.name)?;
    let mut trainer = Trainer::new(ppo.clone(), settings.seed, env).or_bad_input(|| "ppo".into())?;
    if options.resume {
        let newest = run.load_newest(
            |path| {
                let checkpoint = Checkpoint::load(path)?;
                Ok(trainer.restore(&checkpoint)?)
            },
            |line| eprintln!("{line}"),
        )?;
        if newest.is_none() {
            eprintln!("{} has no checkpoint yet: beginning", run.path().display());
        }
    } else if !run.checkpoints()?.is_empty() {
        let message = format!(
            "run `{}` already has checkpoints: go on with --resume, or choose another --name",
            options.name
        );
        return Err(BadInput::new(message).into());
    }
    if let Some(source) = &options.init_from {
        let what = || format!("--init-from {}", source.display());
        let checkpoint = Checkpoint::load(&newest_of(source).or_bad_input(what)?).or_bad_input(what)?;
        trainer.warm_start(&checkpoint).or_bad_input(what)?;
    }
    write_atomic(&run.file("config.toml"), config.as_bytes()).context("cannot write config.toml")?;
    let outcome = train(&mut trainer, &run, settings, shown, &Interrupt::watch()?)?;
    match outcome {
        Outcome::Finished => println!("finished: {}", run.path().display()),
        Outcome::Interrupted => println!("stopped; go on with the same command and --resume"),
    }
    Ok(ExitCode::SUCCESS)
}

/// A checkpoint file, or the newest one of a run's folder.
fn newest_of(source: &Path) -> Result<PathBuf> {
    if source.is_file() {
        return Ok(source.to_owned());
    }
    let newest = numbered_checkpoints(source)?.into_iter().next();
    Ok(newest.context("there is no checkpoint in it")?.1)
}
