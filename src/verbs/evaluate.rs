//! `guidedog evaluate`: judges a pair of policies on a suite of pulls.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::evaluation::judge::Setting;
use guidedog::evaluation::locomotion::judge_locomotion;
use guidedog::evaluation::report::{self, PathTrace, ReportData};
use guidedog::evaluation::results::Results;
use guidedog::evaluation::suite::{episodes, tiles};
use guidedog::judging::{Names, check_version, judge, judge_cases, judge_record, with_progress, write_plan};
use guidedog::policies::{self, SHIPPED};
use guidedog::result_tables::{side_by_side, table};
use guidedog::run_folder::write_atomic;
use guidedog::say;

use super::pulls::{case, cases};
use super::situation::Situation;

/// Judges a supervisor and a locomotion policy on a suite of pulls
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// paper17, mirror17, edges (thresholds under a restless hand), dynamic (pulls that change), plane (a grid over all
    /// forces, and scans across the thresholds): pulls; locomotion: the walking by itself, on all grounds
    #[arg(long, default_value = "paper17")]
    suite: String,
    /// Only this pull of the suite, or any steady one as f_x/f_y in newtons; several by repeating it. Without the behavior reward
    #[arg(long = "case", value_name = "CASE", allow_hyphen_values = true, conflicts_with_all = ["plan", "recorded", "report"])]
    cases: Vec<String>,
    /// Episodes of every case [default: 200; 16 on the plane]
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: Option<u64>,
    /// Write results.json here
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a page with figures here
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the success bars here, an SVG figure; for the plane the map of intent
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// Write the episodes for another engine to play here, and run nothing
    #[arg(long, value_name = "FILE", conflicts_with_all = ["json", "report", "figure", "beside"])]
    plan: Option<PathBuf>,
    /// Judge what another engine recorded after such a plan; only --json, --figure, --report and --beside count with it
    #[arg(long, value_name = "FILE", conflicts_with = "plan")]
    recorded: Option<PathBuf>,
    /// Print the cases beside those of this results.json, too
    #[arg(long, value_name = "FILE")]
    beside: Option<PathBuf>,
    #[command(flatten)]
    situation: Situation,
    /// Draw robot, friction, harness and first state anew for each episode
    #[arg(long)]
    randomize: bool,
    /// Error of the force that the supervisor sees, uniform within ± this many newtons; the oracle sees the force itself
    #[arg(long, value_name = "NEWTONS", default_value_t = 0.0, value_parser = newtons, conflicts_with_all = ["plan", "recorded"])]
    force_noise: f64,
    /// Scale of the errors of all other sensors (joints, velocities, attitude, heights), 0 to 10; 1 is that of training
    #[arg(long, value_name = "SCALE", default_value_t = 0.0, value_parser = scale, conflicts_with_all = ["plan", "recorded"])]
    sensor_noise: f64,
    /// Coulomb friction of every contact, 0 to 10 [default: 0.8; 0.4 to 1.25 with --randomize]
    #[arg(long, value_name = "NUMBER", value_parser = friction, conflicts_with_all = ["plan", "recorded"])]
    friction: Option<f64>,
    /// Pulls are seen but do not act on the robot: with the oracle, what the walk itself lacks
    #[arg(long, conflicts_with_all = ["plan", "recorded"])]
    unloaded: bool,
}

fn newtons(text: &str) -> Result<f64, String> {
    number_to(text, 100.0).ok_or_else(|| "must be from 0 to 100 newtons".into())
}

fn scale(text: &str) -> Result<f64, String> {
    number_to(text, 10.0).ok_or_else(|| "must be from 0 to 10 times the errors of training".into())
}

fn friction(text: &str) -> Result<f64, String> {
    number_to(text, 10.0).ok_or_else(|| "must be from 0 to 10".into())
}

fn number_to(text: &str, most: f64) -> Option<f64> {
    text.parse().ok().filter(|value| (0.0..=most).contains(value))
}

const EXAMPLES: &str = "\
Examples:
  guidedog evaluate                                        the shipped policies on the 17 pulls
  guidedog evaluate --supervisor rules --ground rough      Table II as a rule, on rough ground of level 5
  guidedog evaluate --supervisor rules --suite edges --force-noise 2
                                                           thresholds with an imprecise force sensor
  guidedog evaluate --randomize --sensor-noise 1           robots and sensors as in training
  guidedog evaluate --supervisor oracle --unloaded         what the walk itself makes of the commands
  guidedog evaluate --case -100/50 --case 30/25            two pulls alone
  guidedog evaluate --friction 0.3                         on a slippery floor
  guidedog evaluate --suite locomotion                     commands under pulls; every kind of ground by level
  guidedog evaluate --supervisor runs/guide/policy.onnx --json guide.json --report guide.html
  guidedog evaluate --suite plane                          where each threshold lies, and how sharp it is
  guidedog evaluate --plan pulls.plan                      for scripts/reference/play_in_mujoco.py
  guidedog evaluate --recorded pulls.record                what that made of it

Success is judged over [2, 8] s after the pull has become what the case says; falls count over the whole
episode. An episode is 2 to 2.5 s without force and at least 12 s of pull. Intervals are Wilson's, 95 %.";

/// The suite that judges the walking by itself.
const LOCOMOTION: &str = "locomotion";

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    if arguments.suite == LOCOMOTION {
        return run_locomotion(arguments);
    }
    // Before anything is judged, so that a mistake is found now and not after it.
    let beside =
        arguments.beside.as_deref().map(results_beside).transpose().or_bad_input(|| "--beside".into())?;
    if let Some(path) = &arguments.recorded {
        let (results, traces) = judge_record(path).or_bad_input(|| path.display().to_string())?;
        return show(arguments, results, traces, beside.as_ref());
    }
    let of_suite = cases(&arguments.suite, &[LOCOMOTION])?;
    let chosen = arguments.cases.iter().map(|name| case(&of_suite, name)).collect::<Result<Vec<_>, _>>()?;
    let situation = &arguments.situation;
    let supervisor = policies::supervisor(&situation.supervisor)?;
    let setting = Setting {
        randomize: arguments.randomize,
        friction: arguments.friction,
        force_noise_n: arguments.force_noise,
        sensor_noise: arguments.sensor_noise,
        unloaded: arguments.unloaded,
        episodes: arguments.episodes(),
        tiles: tiles(&arguments.suite),
        ..Setting::default()
    };
    let arena = situation.arena_with(setting)?;
    if let Some(path) = &arguments.plan {
        write_plan(&arena, &of_suite, &arguments.suite, path).or_bad_input(|| "--plan".into())?;
        return Ok(ExitCode::SUCCESS);
    }
    let suite = if chosen.is_empty() { &arguments.suite } else { "chosen pulls" };
    let names = Names::new(suite, &situation.locomotion, &situation.supervisor)?;
    let (results, traces) = if chosen.is_empty() {
        judge(&arena, &supervisor, &of_suite, &names, None)?
    } else {
        judge_cases(&arena, &supervisor, &chosen, &names)?
    };
    show(arguments, results, traces, beside.as_ref())
}

fn results_beside(path: &Path) -> Result<Results> {
    let results = Results::read(path)?;
    check_version(results.version)?;
    Ok(results)
}

impl Arguments {
    fn episodes(&self) -> usize {
        self.episodes.map_or_else(|| episodes(&self.suite, 200), |episodes| episodes as usize)
    }
}

/// Prints the tables and writes what was asked for.
fn show(
    arguments: &Arguments,
    results: Results,
    traces: Vec<PathTrace>,
    beside: Option<&Results>,
) -> Result<ExitCode> {
    say!("{}", table(&results).trim_end());
    if let Some(other) = beside {
        say!("\n{}", side_by_side(other, &results).trim_end());
    }
    let named = |path: &Path| path.display().to_string();
    if let Some(path) = &arguments.json {
        results.write(path).or_bad_input(|| "--json".into())?;
    }
    if let Some(path) = &arguments.figure {
        let map = report::intent_map_svg(&results);
        let figure = map.unwrap_or_else(|| report::success_bars_svg(&results, &[]));
        write_atomic(path, figure.as_bytes()).or_bad_input(|| format!("--figure {}", named(path)))?;
    }
    if let Some(path) = &arguments.report {
        let title = format!("guidedog: {} under {}", results.supervisor, results.suite);
        let data = ReportData { title, judged: results, traces, ..ReportData::default() };
        report::write(&data, path).or_bad_input(|| format!("--report {}", named(path)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The locomotion policy alone, on grounds of its own choice.
fn run_locomotion(arguments: &Arguments) -> Result<ExitCode> {
    let others = [
        ("--case", !arguments.cases.is_empty()),
        ("--supervisor", arguments.situation.supervisor != SHIPPED),
        ("--ground", arguments.situation.ground.is_some()),
        ("--randomize", arguments.randomize),
        ("--friction", arguments.friction.is_some()),
        ("--force-noise", arguments.force_noise > 0.0),
        ("--sensor-noise", arguments.sensor_noise > 0.0),
        ("--unloaded", arguments.unloaded),
        ("--plan", arguments.plan.is_some()),
        ("--recorded", arguments.recorded.is_some()),
        ("--beside", arguments.beside.is_some()),
        ("--report", arguments.report.is_some()),
        ("--figure", arguments.figure.is_some()),
    ];
    if let Some((name, _)) = others.into_iter().find(|(_, given)| *given) {
        let message = "does not go with --suite locomotion, which chooses robots, grounds, commands and forces itself and prints tables";
        return Err(BadInput::new(format!("{name} {message}")).into());
    }
    let Situation { locomotion, seed, .. } = &arguments.situation;
    let policy = policies::locomotion(locomotion)?;
    let results = with_progress("judging locomotion: row", |progress| {
        judge_locomotion(&policy, locomotion, arguments.episodes(), *seed, progress)
    })
    .map_err(BadInput::new)?;
    say!("{}", results.tables().trim_end());
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&results)? + "\n";
        let what = || format!("--json {}", path.display());
        write_atomic(path, text.as_bytes()).or_bad_input(what)?;
    }
    Ok(ExitCode::SUCCESS)
}
