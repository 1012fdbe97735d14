//! `guidedog evaluate`: judges a pair of policies on a suite of pulls.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, ValueEnum};
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::evaluation::judge::{Arena, Ground, Setting};
use guidedog::evaluation::locomotion::judge_locomotion;
use guidedog::evaluation::report::{self, ReportData};
use guidedog::evaluation::suite::{SUITES, suite};
use guidedog::judging::{Names, judge, table, with_progress};
use guidedog::policies::{self, SHIPPED};
use guidedog::run_folder::write_atomic;

/// Judges a supervisor and a locomotion policy on a suite of pulls
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// paper17 or mirror17: pulls; locomotion: the walking by itself, on all grounds
    #[arg(long, default_value = "paper17")]
    suite: String,
    /// Episodes of every case
    #[arg(long, default_value_t = 200, value_parser = clap::value_parser!(u64).range(1..=100_000))]
    episodes: u64,
    /// Write results.json here
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Write a page with figures here
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Write the success bars here, an SVG figure
    #[arg(long, value_name = "FILE")]
    figure: Option<PathBuf>,
    /// The locomotion policy, an ONNX file
    #[arg(long, default_value = SHIPPED)]
    locomotion: String,
    /// The supervisor: an ONNX file, rules, dominance or oracle
    #[arg(long, default_value = SHIPPED)]
    supervisor: String,
    /// The ground
    #[arg(long, value_enum, default_value_t = GroundName::Flat)]
    ground: GroundName,
    /// Level of every tile of rough ground or stairs, 0 to 9
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(0..=9))]
    level: u64,
    /// Draw robot, friction, harness and first state anew for each episode
    #[arg(long)]
    randomize: bool,
    /// Seed of all draws
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

const EXAMPLES: &str = "\
Examples:
  guidedog evaluate                                        the shipped policies on the 17 pulls
  guidedog evaluate --supervisor rules --ground rough      Table II as a rule, on rough ground of level 5
  guidedog evaluate --suite locomotion                     commands under pulls; every kind of ground by level
  guidedog evaluate --supervisor runs/guide/policy.onnx --json guide.json --report guide.html

Success is judged over [2, 8] s after the pull sets in; falls count over the whole episode. An episode is
2 s without force and 12 s of pull. Intervals are Wilson's, 95 %.";

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum GroundName {
    Flat,
    Rough,
    Stairs,
}

/// The suite that judges the walking by itself.
const LOCOMOTION: &str = "locomotion";

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    if arguments.suite == LOCOMOTION {
        return run_locomotion(arguments);
    }
    let cases = suite(&arguments.suite).ok_or_else(|| {
        let known = SUITES.join(", ");
        BadInput::new(format!("--suite {}: must be one of {known}, {LOCOMOTION}", arguments.suite))
    })?;
    let locomotion = policies::locomotion(&arguments.locomotion)?;
    let supervisor = policies::supervisor(&arguments.supervisor)?;
    let ground = match arguments.ground {
        GroundName::Flat => Ground::Flat,
        GroundName::Rough => Ground::Rough,
        GroundName::Stairs => Ground::Stairs,
    };
    let setting = Setting {
        ground,
        level: if ground == Ground::Flat { 0 } else { arguments.level as usize },
        randomize: arguments.randomize,
        episodes: arguments.episodes as usize,
        seed: arguments.seed,
    };
    let arena = Arena::new(locomotion, setting).map_err(BadInput::new)?;
    let names = Names {
        suite: arguments.suite.clone(),
        locomotion: arguments.locomotion.clone(),
        supervisor: arguments.supervisor.clone(),
    };
    let (results, traces) = judge(&arena, &supervisor, &cases, &names, None)?;
    print!("{}", table(&results));
    let named = |path: &Path| path.display().to_string();
    if let Some(path) = &arguments.json {
        results.write(path).or_bad_input(|| "--json".into())?;
    }
    if let Some(path) = &arguments.figure {
        let bars = report::success_bars_svg(&results, &[]);
        write_atomic(path, bars.as_bytes()).or_bad_input(|| format!("--figure {}", named(path)))?;
    }
    if let Some(path) = &arguments.report {
        let title = format!("guidedog: {} under {}", arguments.supervisor, arguments.suite);
        let data = ReportData { title, judged: results, traces, ..ReportData::default() };
        report::write(&data, path).or_bad_input(|| format!("--report {}", named(path)))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The locomotion policy alone, on grounds of its own choice.
fn run_locomotion(arguments: &Arguments) -> Result<ExitCode> {
    let policy = policies::locomotion(&arguments.locomotion)?;
    let results = with_progress("judging locomotion: row", |progress| {
        let episodes = arguments.episodes as usize;
        judge_locomotion(&policy, &arguments.locomotion, episodes, arguments.seed, progress)
    })
    .map_err(BadInput::new)?;
    print!("{}", results.tables());
    if let Some(path) = &arguments.json {
        let text = serde_json::to_string_pretty(&results)? + "\n";
        let what = || format!("--json {}", path.display());
        write_atomic(path, text.as_bytes()).or_bad_input(what)?;
    }
    Ok(ExitCode::SUCCESS)
}
