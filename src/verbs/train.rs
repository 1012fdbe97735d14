//! `guidedog train`: learns a policy into a run folder.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::Result;
use clap::{Args, Subcommand};
use guidedog::config::resolve;
use guidedog::error::BadInput;
use guidedog::interrupt::Interrupt;
use guidedog::learner::{Start, Trainable, Training};
use guidedog::machine::use_threads;
use guidedog::run_config::{LocomotionRun, Run, SupervisorRun};
use guidedog::run_folder::RunFolder;
use guidedog::say;
use guidedog::training::Outcome;
use guidedog::watch::{About, Window};
use guidedog::{plots, ranks};

use super::serving::Serving;

/// How long the end of a training waits for pages to hear of it.
const GOODBYE: Duration = Duration::from_millis(500);

/// Learns a policy into runs/NAME; stop it at any moment and go on with --resume
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
An iteration: all robots take ppo.steps_per_env steps with noise in their actions, then both networks learn from what came of
it. training.iterations of them make a run. A terminal shows progress, rate, time left and scores in place; for all the rest,
while it runs: tensorboard --logdir runs

What to look at:
  tracking_linear, tracking_yaw   how well robots do as told, with noise: 0.45 and 0.37 is standing still under the default
                                  commands, 0.7 walks, 1 is perfect
  falls_per_1000                  falls in 1000 steps; 1 is one in 20 s
  terrain_level                   mean level of the ground, 0 to 9; robots that manage go up
  behavior_reward/total           how well the supervisor understands: 0.2 is standing still under the default pulls; the paper
                                  reports 0.61, under its own
  kl, learning_rate               the rate follows the divergence (ppo.desired_kl); at its lower bound for long, something
                                  is wrong, but near the end where the divergence is annealed (ppo.anneal_iterations)
  reward/...                      what each term of the reward pays per step; policy/std, weights/... as histograms
What is shown is of noisy robots that learn; judge a policy by its mean action: guidedog evaluate, guidedog bench learning.

Settings, later ones over earlier ones: defaults, --config FILE, --set key=value. Every one with its meaning, unit, range
and source: guidedog config locomotion --explain

Examples:
  guidedog train locomotion --name walk
  guidedog train locomotion --name walk --resume
  guidedog train locomotion --name flat --set task.terrain=flat --set training.iterations=500
  guidedog train locomotion --name finer --init-from runs/walk --set ppo.desired_kl=0.01
  guidedog train supervisor --name guide --set task.locomotion=runs/walk/policy.onnx
  guidedog train supervisor --name seen --watch
  guidedog train supervisor --name paper --config configs/supervisor/paper.toml
  mpirun -n 2 guidedog train supervisor --name guide      (docs/cluster.md)

Everything a run leaves is in its folder: config.toml (all settings as used), metrics.csv and TensorBoard events,
checkpoints/ (the newest few and the best), policy.onnx, and at the end plots.svg. Ctrl-C saves and stops; killed or
stopped, --resume goes on to the same bits. A loss that is no number, a full disk: it stops and names the last good checkpoint.

--watch shows robots and curves in a browser while they learn. It only shows: the result is the same to
the bit, and the page can be closed and opened as often as one likes.";

#[derive(Debug, Subcommand)]
enum What {
    /// The policy that walks as told: 235 inputs, 12 joint targets
    Locomotion(Options),
    /// The policy that reads the handler's pulls: 226 inputs, a velocity command for a frozen locomotion policy
    Supervisor(Options),
}

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
struct Options {
    /// Name of the run: a folder in runs/ [default: what is trained]
    #[arg(long)]
    name: Option<String>,
    /// Settings that differ from the defaults, a TOML file
    #[arg(long)]
    config: Option<PathBuf>,
    /// One setting, e.g. ppo.epochs=3; may be given many times, the last one counts
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Go on from the run's newest checkpoint, to the same bits as if it had never stopped
    #[arg(long)]
    resume: bool,
    /// Begin with the weights of another run (its folder or a checkpoint file), or of a policy (an ONNX file:
    /// no values, no optimizer)
    #[arg(long, value_name = "RUN", conflicts_with = "resume")]
    init_from: Option<PathBuf>,
    /// Threads [default: one a core]
    #[arg(long)]
    threads: Option<usize>,
    /// Show the robots and the curves in a browser while they learn
    #[arg(long)]
    watch: bool,
    #[command(flatten)]
    serving: Serving,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Locomotion(options) => train(options, "locomotion", resolve::<LocomotionRun>),
        What::Supervisor(options) => train(options, "supervisor", resolve::<SupervisorRun>),
    }
}

fn train<T: Trainable>(
    options: &Options,
    what: &str,
    resolve: impl Fn(Option<&Path>, &[String]) -> Result<Run<T>, BadInput>,
) -> Result<ExitCode> {
    let config = resolve(options.config.as_deref(), &options.set)?;
    config.validate()?;
    use_threads(options.threads)?;
    let start = match &options.init_from {
        Some(source) => Start::From(source.clone()),
        None if options.resume => Start::Resume,
        None => Start::New,
    };
    let (root, name) = (Path::new("runs"), options.name.as_deref().unwrap_or(what));
    let (exchange, interrupt) = (ranks::join()?, Interrupt::watch()?);
    let leads = exchange.rank() == 0;
    let run = leads.then(|| RunFolder::open(root, name)).transpose();
    ranks::tell_when_ended(&interrupt, root.join(name), exchange.rank(), exchange.ranks());
    let about = About {
        run: name.into(),
        task: what.into(),
        robots: config.training.num_envs,
        iterations: config.training.iterations,
        shown: T::SHOWN.iter().map(|&metric| metric.to_owned()).collect(),
    };
    let seen = run.and_then(|run| Ok((run, if leads { open_window(options, about)? } else { None })));
    let outcome = exchange.agree(seen).and_then(|(run, window)| {
        let training = Training { config: &config, start: &start, window: window.as_ref() };
        let outcome = training.learn_together(exchange, run.as_ref(), &interrupt);
        if let Some(window) = window {
            let how = match &outcome {
                Ok(Outcome::Finished) => "finished",
                Ok(Outcome::Interrupted) => "stopped",
                Err(_) => "failed",
            };
            window.end(how, GOODBYE);
        }
        Ok((outcome?, run))
    });
    let (outcome, run) = match outcome {
        // Rank 0 speaks, and answers, for all.
        _ if !leads => return Ok(ExitCode::SUCCESS),
        Err(error) => return Err(error),
        Ok((outcome, run)) => (outcome, run.expect("rank 0 has the run's folder")),
    };
    let plots = plots::write(&run)?;
    match outcome {
        Outcome::Finished => say!("finished: {}; plots: {}", run.path().display(), plots.display()),
        Outcome::Interrupted => {
            let command = ranks::resumed(std::env::args());
            say!("stopped; go on with: {command}\nplots: {}", plots.display());
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The window of a training that is to be watched, with a server before it.
fn open_window(options: &Options, about: About) -> Result<Option<Arc<Window>>> {
    if !options.watch {
        if options.serving != Serving::usual() {
            return Err(BadInput::new("--port, --host and --no-open are for --watch").into());
        }
        return Ok(None);
    }
    let window = Arc::new(Window::new(about));
    let server = options.serving.bind()?.with_window(window.clone());
    options.serving.announce(&server, "?watch")?;
    std::thread::spawn(move || server.serve());
    Ok(Some(window))
}
