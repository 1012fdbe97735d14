//! `guidedog bench`: how long learning takes here.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Args, Subcommand, ValueEnum};
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::interrupt::Interrupt;
use guidedog::machine::{processor_name, resident_mb, threads, use_threads};
use guidedog::plots;
use guidedog::run_folder::{RunFolder, write_atomic};
use guidedog::say;
use guidedog::stages::Place;
use guidedog::time_to_quality::{Bounds, Finding, Stage, Task, Trial, Variant, picture, table, take_turns};

/// Measures how long learning takes on this machine
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Learning(Learning),
}

/// Trains from nothing to stated scores, and reports time, processor time, environment steps and operations
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
struct Learning {
    /// What to train [default: all three]
    #[arg(long, value_enum, value_delimiter = ',', num_args = 1..)]
    task: Vec<TaskName>,
    /// Trainings of every setting, with the seeds 1, 2, 3, …
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Longest training in minutes, judging not counted [default: 30 flat, 90 rough, 15 supervisor]
    #[arg(long, value_name = "MINUTES")]
    limit: Option<f64>,
    /// Score to reach [default: 0.9 flat, 5 rough, 0.95 supervisor]
    #[arg(long, value_name = "SCORE")]
    target: Option<f64>,
    /// Seconds of training between two judgments [default: 20; 60 on rough ground]
    #[arg(long, value_name = "SECONDS")]
    interval: Option<f64>,
    /// Go on to the limit after the score is reached, to compare scores at equal times
    #[arg(long)]
    to_the_limit: bool,
    /// A setting of every training, e.g. ppo.epochs=3; may be given many times
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Settings to compare, e.g. short=ppo.epochs=2,ppo.desired_kl=0.03; may be given many times; a name alone changes
    /// nothing. Variants take turns on the machine [default: one, called plain]
    #[arg(long = "variant", value_name = "NAME=KEY=VALUE,…")]
    variants: Vec<String>,
    /// Name of the bench: a folder in runs/, with a run folder a training in it
    #[arg(long, default_value = "bench-learning")]
    name: String,
    /// Threads [default: one a core]
    #[arg(long)]
    threads: Option<usize>,
    /// Write what was found here, too
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Scores, each of the mean action without noise on draws that are always the same:
  flat        tracking (exp(-|e_xy|²/0.25) + exp(-e_ω²/0.25)/2) / 1.5, a share of its ceiling; 128 robots of 20 s, 2 s
              to get going, a command each as a guide dog gets them
  rough       the mean level on which the terrain curriculum would come to rest with this policy (6 if all go up), or
              5 · survival / 0.9 if that is less; 400 robots of 20 s, two on every tile of a ground of its own
  supervisor  behavior reward over the paper's pulls, a share of the oracle's over the same walk; 128 robots of 20 s

Examples:
  guidedog bench learning --task flat                                  three seeds, up to 30 minutes each
  guidedog bench learning --task supervisor --seeds 1 --limit 5
  guidedog bench learning --task flat --variant plain --variant short=ppo.epochs=2 --name epochs

Stop it with Ctrl-C (or kill it) and start it again with the same words: it goes on where it was. It leaves
runs/NAME/results.json, runs/NAME/learning.svg (score over time) and, for every training, a run folder with metrics.csv,
checkpoints, policy.onnx, plots.svg and time_to_quality.csv. A training begins from nothing; walking is learned in stages
(level, flat or level, rough, explore, precise, fine: configs/locomotion), each in a run folder of its own, of which the last ignores
training.iterations. Operations are those needed: inference, update and simulation.";

/// Names of the tasks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TaskName {
    /// Walking on level ground
    Flat,
    /// Walking on rough ground
    Rough,
    /// Understanding pulls, over the shipped walk
    Supervisor,
}

impl TaskName {
    fn task(self) -> Task {
        match self {
            Self::Flat => Task::Flat,
            Self::Rough => Task::Rough,
            Self::Supervisor => Task::Supervisor,
        }
    }
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Learning(learning) => learning.run(),
    }
}

impl Learning {
    fn run(&self) -> Result<ExitCode> {
        let variants = self.variants()?;
        self.check_numbers()?;
        let mut tasks: Vec<Task> = self.task.iter().map(|name| name.task()).collect();
        if tasks.is_empty() {
            tasks = Task::ALL.to_vec();
        }
        // What cannot be trained is refused before anything is.
        for task in &tasks {
            self.stages(*task, 1, &variants)?;
        }
        use_threads(self.threads)?;
        let interrupt = Interrupt::watch()?;
        // Held for as long as the bench lasts, so that no other writes there.
        let bench = RunFolder::open(Path::new("runs"), &self.name)?;
        let mut findings = Vec::new();
        for task in tasks {
            let mut of_task = Vec::new();
            for seed in 1..=self.seeds {
                let Some(found) = self.trials(&bench, task, seed, &variants, &interrupt)? else {
                    say!("stopped; go on with the same command");
                    return Ok(ExitCode::SUCCESS);
                };
                of_task.extend(found);
            }
            let place = |finding: &Finding| variants.iter().position(|v| v.name == finding.variant);
            of_task.sort_by_key(place);
            findings.extend(of_task);
            // After every task, for those who look on.
            self.write(&bench, &findings)?;
        }
        say!("{}", table(&findings));
        say!(
            "{} threads of {}; most memory of this process: {:.0} MB",
            threads(),
            processor_name(),
            resident_mb()
        );
        say!("score over time: {}", bench.file("learning.svg").display());
        Ok(ExitCode::SUCCESS)
    }

    fn check_numbers(&self) -> Result<(), BadInput> {
        let given = [("limit", self.limit), ("interval", self.interval), ("target", self.target)];
        for (name, value) in given {
            if value.is_some_and(|value| !(value > 0.0 && value <= 1e5)) {
                let value = value.unwrap_or_default();
                return Err(BadInput::new(format!("--{name} {value}: must be above 0, at most 100000")));
            }
        }
        Ok(())
    }

    fn variants(&self) -> Result<Vec<Variant>, BadInput> {
        let mut variants = Vec::new();
        for text in &self.variants {
            let variant = Variant::parse(text)?;
            if variants.iter().any(|known: &Variant| known.name == variant.name) {
                return Err(BadInput::new(format!("--variant {text}: there are two of that name")));
            }
            variants.push(variant);
        }
        if variants.is_empty() {
            variants.push(Variant { name: "plain".into(), settings: Vec::new() });
        }
        Ok(variants)
    }

    fn settings(&self, variant: &Variant) -> Vec<String> {
        [&self.set[..], &variant.settings].concat()
    }

    /// The stages of every variant.
    fn stages(&self, task: Task, seed: u64, variants: &[Variant]) -> Result<Vec<Vec<Stage>>> {
        let stages = |variant: &Variant| {
            let name = || format!("{} {}", task.name(), variant.name);
            task.stages(&self.settings(variant), seed).with_context(name)
        };
        variants.iter().map(stages).collect()
    }

    /// One training a variant, in turns; `None` if the user stops it.
    fn trials(
        &self,
        bench: &RunFolder,
        task: Task,
        seed: u64,
        variants: &[Variant],
        interrupt: &Interrupt,
    ) -> Result<Option<Vec<Finding>>> {
        let bounds = Bounds {
            target: self.target.unwrap_or(task.target()),
            limit_s: 60.0 * self.limit.unwrap_or(task.limit_min()),
            interval_s: self.interval.unwrap_or(task.interval_s()),
            to_the_limit: self.to_the_limit,
        };
        let stages = self.stages(task, seed, variants)?;
        let names: Vec<String> =
            variants.iter().map(|variant| format!("{}-{}-{seed}", task.name(), variant.name)).collect();
        let places: Vec<Place> = names
            .iter()
            .zip(&stages)
            .map(|(name, stages)| Place::open(bench.path(), name, stages.iter().map(|stage| &*stage.name)))
            .collect::<Result<_>>()?;
        let mut trials: Vec<Trial<'_>> = (0..variants.len())
            .map(|i| Trial::open(&names[i], &places[i], &stages[i], bounds))
            .collect::<Result<_>>()?;
        if !take_turns(&format!("{} {seed}/{}", task.name(), self.seeds), &mut trials, interrupt)? {
            return Ok(None);
        }
        let mut findings = Vec::new();
        for ((trial, variant), place) in trials.iter().zip(variants).zip(&places) {
            for stage in 0..=place.newest()?.0 {
                plots::write(place.stage(stage))?;
            }
            findings.push(Finding {
                task: task.name().into(),
                variant: variant.name.clone(),
                settings: self.settings(variant),
                ..trial.finding()
            });
        }
        Ok(Some(findings))
    }

    fn write(&self, bench: &RunFolder, findings: &[Finding]) -> Result<()> {
        let json = serde_json::json!({
            "guidedog_version": env!("CARGO_PKG_VERSION"),
            "processor": processor_name(),
            "threads": threads(),
            "resident_mb": resident_mb(),
            "trainings": findings,
        });
        let text = serde_json::to_string_pretty(&json)? + "\n";
        let written = |path: &Path, text: &str| {
            write_atomic(path, text.as_bytes()).with_context(|| format!("cannot write {}", path.display()))
        };
        written(&bench.file("results.json"), &text)?;
        written(&bench.file("learning.svg"), &picture(findings))?;
        if let Some(path) = &self.json {
            write_atomic(path, text.as_bytes()).or_bad_input(|| format!("--json {}", path.display()))?;
        }
        Ok(())
    }
}
