//! `guidedog reproduce`: the main job, from the shipped locomotion policy (or from nothing) to a report.

use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context as _, Result};
use clap::{Args, ValueEnum};
use guidedog::config::resolve_text;
use guidedog::error::BadInput;
use guidedog::evaluation::judge::{Arena, Ground, Setting};
use guidedog::evaluation::report::{self, Curve, PathTrace, ReportData, TrainingCurves};
use guidedog::evaluation::results::{Behavior, Results};
use guidedog::evaluation::suite::suite;
use guidedog::everything::{self, Section};
use guidedog::interrupt::Interrupt;
use guidedog::judging::{LEVEL, Names, judge};
use guidedog::learner::{Start, Training};
use guidedog::metrics::MetricsTable;
use guidedog::policies;
use guidedog::result_tables::table;
use guidedog::run_config::{SHORT_SUPERVISOR_TRAINING, SupervisorRun};
use guidedog::run_folder::RunFolder;
use guidedog::stages::{self, StageFile};
use guidedog::tasks::locomotion::Terrain;
use guidedog::training::Outcome;
use guidedog::{say, tell};

/// Trains the supervisor over the shipped locomotion policy, judges it and writes the report
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Name of the run: a folder in runs/ [default: reproduce, from-scratch or from-scratch-rough]
    #[arg(long)]
    name: Option<String>,
    /// Train locomotion too, from nothing
    #[arg(long)]
    from_scratch: bool,
    /// With --from-scratch, the ground to learn on: flat takes minutes, rough an hour or two
    #[arg(long, value_enum, default_value = "flat", requires = "from_scratch")]
    ground: TrainingGround,
    /// Then judge the shipped policies on every suite and ground, draw every picture, and play them in MuJoCo where a Python
    /// (PYTHON) has it; finished parts are kept
    #[arg(long)]
    everything: bool,
    /// Of everything only this, and no training before it
    #[arg(long, value_name = "SECTION", requires = "everything", conflicts_with_all = ["from_scratch", "set"])]
    only: Option<Section>,
    /// One setting of the supervisor's training, e.g. training.iterations=50
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Seed of the training before everything, and of all judgments
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Episodes of every case
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
}

/// Where `--from-scratch` learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TrainingGround {
    /// Level ground alone: two stages, and half of a supervisor's training
    Flat,
    /// Level, then rough ground: five stages, and all of a supervisor's training
    Rough,
}

impl TrainingGround {
    /// Name of the run unless the user gives one.
    fn run_name(self) -> &'static str {
        match self {
            Self::Flat => "from-scratch",
            Self::Rough => "from-scratch-rough",
        }
    }

    /// How walking is learned there.
    fn stages(self) -> &'static [StageFile] {
        match self {
            Self::Flat => stages::FLAT,
            Self::Rough => stages::ROUGH,
        }
    }
}

/// What is judged of the run itself; no baseline has this name.
const LEARNED: &str = "learned";

const EXAMPLES: &str = "\
Examples:
  guidedog reproduce                    a quarter of an hour on two cores
  guidedog reproduce --from-scratch     begins with a robot that cannot walk
  guidedog reproduce --from-scratch --ground rough
  guidedog reproduce --seed 2 --name second
  guidedog reproduce --everything       the numbers and pictures of the shipped policies in docs/results.md: hours;
                                        its tables of 1000 episodes want --episodes 1000
  guidedog reproduce --everything --only mujoco

Stop it with Ctrl-C and start it again with the same words: it goes on where it was. It leaves
runs/NAME/report.html and runs/NAME/results.json; after a training on rough ground results-rough.json, too.";

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let began = Instant::now();
    let interrupt = Interrupt::watch()?;
    let root = Path::new("runs");
    let usual = if arguments.from_scratch { arguments.ground.run_name() } else { "reproduce" };
    let name = arguments.name.as_deref().unwrap_or(usual);
    if arguments.only.is_some() {
        let run = RunFolder::open(root, name)?;
        return everything(arguments, run.path(), &interrupt);
    }
    let seed = format!("training.seed={}", arguments.seed);
    let mut settings = [std::slice::from_ref(&seed), &arguments.set[..]].concat();
    if arguments.from_scratch && arguments.ground == TrainingGround::Flat {
        let over_walk = std::iter::once("task.terrain=\"flat\"").chain(SHORT_SUPERVISOR_TRAINING);
        settings.splice(0..0, over_walk.map(str::to_owned));
    }
    // Before the walk is trained, so that a mistake is found now and not after it.
    let mut config = supervisor(&settings)?;
    if arguments.from_scratch {
        let run = format!("{name}-locomotion");
        let walk = stages::learn_all(root, &run, arguments.ground.stages(), &[seed], &interrupt)?;
        let Some(walk) = walk else { return Ok(stopped()) };
        settings.insert(0, format!("task.locomotion={:?}", policies::name(&walk)?));
        config = supervisor(&settings)?;
    }
    let run = RunFolder::open(root, name)?;
    tell!("training the supervisor, in {}", run.path().display());
    if Training::unseen(&config, &Start::Resume).learn(&run, &interrupt)? == Outcome::Interrupted {
        return Ok(stopped());
    }
    tell!("judging it beside its baselines");
    if !judge_and_report(&run, &config, arguments.episodes as usize, began, &interrupt)? {
        return Ok(stopped());
    }
    if arguments.everything { everything(arguments, run.path(), &interrupt) } else { Ok(ExitCode::SUCCESS) }
}

fn supervisor(settings: &[String]) -> Result<SupervisorRun, BadInput> {
    let config: SupervisorRun = resolve_text("defaults", "", settings)?;
    config.validate()?;
    Ok(config)
}

/// All that is known of the shipped policies, in the folder of a run.
fn everything(arguments: &Arguments, run: &Path, interrupt: &Interrupt) -> Result<ExitCode> {
    let done = everything::make(run, arguments.only, arguments.episodes as usize, arguments.seed, interrupt)?;
    Ok(if done { ExitCode::SUCCESS } else { stopped() })
}

fn stopped() -> ExitCode {
    say!("stopped; go on with the same command");
    ExitCode::SUCCESS
}

/// Judges supervisors over the run's walk, on the same episodes, `learned` being the run's own; theirs are the paths that come with
/// the results. `None` if the user stops it.
fn judge_all(
    run: &RunFolder,
    config: &SupervisorRun,
    setting: Setting,
    supervisors: &[&str],
    interrupt: &Interrupt,
) -> Result<Option<(Vec<Results>, Vec<PathTrace>)>> {
    let locomotion = &config.task.locomotion;
    let setting = Setting { seed: config.training.seed, ..setting };
    let arena = Arena::new(policies::locomotion(locomotion)?, setting).map_err(anyhow::Error::msg)?;
    let cases = suite("paper17").context("the suite paper17")?;
    let (mut all, mut paths): (Vec<Results>, _) = (Vec::new(), Vec::new());
    for &name in supervisors {
        if interrupt.requested() {
            return Ok(None);
        }
        let own = name == LEARNED;
        let source = if own { run.file("policy.onnx").display().to_string() } else { name.to_owned() };
        let names = Names { supervisor: name.into(), ..Names::new("paper17", locomotion, &source)? };
        let oracle = all.first().map(|results| results.oracle_reward);
        let (results, traces) = judge(&arena, &policies::supervisor(&source)?, &cases, &names, oracle)?;
        if own {
            paths = traces;
        }
        all.push(results);
    }
    Ok(Some((all, paths)))
}

/// Judges on level ground, beside the baselines, and writes the report; with a training on rough ground there, too. False if the user
/// stops it.
fn judge_and_report(
    run: &RunFolder,
    config: &SupervisorRun,
    episodes: usize,
    began: Instant,
    interrupt: &Interrupt,
) -> Result<bool> {
    let level = Setting { episodes, ..Setting::default() };
    let supervisors = [LEARNED, "rules", "dominance", "oracle"];
    let Some((mut all, traces)) = judge_all(run, config, level, &supervisors, interrupt)? else {
        return Ok(false);
    };
    let metrics = MetricsTable::read(&run.file("metrics.csv")).context("metrics.csv")?;
    let data = ReportData {
        title: "guidedog: every pull understood?".into(),
        judged: all.remove(0),
        baselines: all,
        traces,
        training: training_curves(&metrics),
        notes: notes(config, &metrics, began),
    };
    data.judged.write(&run.file("results.json")).context("results.json")?;
    let path = run.file("report.html");
    report::write(&data, &path).with_context(|| path.display().to_string())?;
    say!("{}", table(&data.judged));
    if config.task.terrain == Terrain::Rough {
        tell!("judging it on rough ground");
        let rough = Setting { ground: Ground::Rough, level: LEVEL, episodes, ..Setting::default() };
        let Some((all, _)) = judge_all(run, config, rough, &[LEARNED], interrupt)? else {
            return Ok(false);
        };
        all[0].write(&run.file("results-rough.json")).context("results-rough.json")?;
        say!("\n{}", table(&all[0]));
    }
    say!("report: {}", path.display());
    Ok(true)
}

/// What the report says of the training.
fn notes(config: &SupervisorRun, metrics: &MetricsTable, began: Instant) -> Vec<(String, String)> {
    // Those made: a finished run is not made shorter by a setting.
    let iterations = metrics.rows().last().map_or(0, |(iteration, _)| iteration);

    vec![
        ("locomotion policy".into(), config.task.locomotion.clone()),
        ("seed".into(), config.training.seed.to_string()),
        ("robots trained on".into(), config.training.num_envs.to_string()),
        ("iterations".into(), iterations.to_string()),
        ("ground trained on".into(), format!("{:?}", config.task.terrain).to_lowercase()),
        ("version".into(), env!("CARGO_PKG_VERSION").into()),
        ("wall time of this start".into(), format!("{} s", began.elapsed().as_secs())),
    ]
}

/// `None` if nothing was learned.
fn training_curves(metrics: &MetricsTable) -> Option<TrainingCurves> {
    let curve = |name: &str| Curve {
        name: name.to_owned(),
        points: metrics.column(&format!("behavior_reward/{name}")),
    };
    let total = curve("total");
    if total.points.is_empty() {
        return None;
    }
    let behaviors = Behavior::ALL.map(|behavior| (behavior, curve(behavior.name())));
    Some(TrainingCurves { total, behaviors: behaviors.to_vec() })
}
