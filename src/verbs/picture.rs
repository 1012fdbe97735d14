//! `guidedog picture`: draws one episode, or trainings side by side, without a window.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context as _, Result};
use clap::{Args, Subcommand};
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::evaluation::film::film;
use guidedog::evaluation::judge::Arena;
use guidedog::evaluation::report::{Curve, Seeds, bands_svg, paths_svg, series_svg};
use guidedog::evaluation::results::BehaviorReward;
use guidedog::evaluation::suite::Case;
use guidedog::metrics::MetricsTable;
use guidedog::policies;
use guidedog::run_folder::write_atomic;

use super::pulls::{case, cases};
use super::situation::Situation;

/// Draws an episode as a film or over time, or the curves of trainings, without a window
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
Examples:
  guidedog picture film --case -60/30 --out spin.gif
  guidedog picture series --suite dynamic --case \"tug 0/60, 0.5 s\" --out tug.svg
  guidedog picture paths --ground rough --out paths.svg
  guidedog picture curves runs/guide-1 runs/guide-2 runs/guide-3 --out reward.svg

The maps and bars of whole suites are made by `guidedog evaluate --figure`.";

#[derive(Debug, Subcommand)]
enum What {
    /// A robot under a pull, as a GIF
    Film(Episode),
    /// Force, command and velocity of one episode over time, as an SVG
    Series(Episode),
    /// Where a robot goes under each pull of a suite, from above, as an SVG
    Paths(Paths),
    /// A column of metrics.csv of several runs, as an SVG: mean, lowest and highest of runs whose names differ in a number at
    /// the end only
    Curves(Curves),
}

#[derive(Debug, Args)]
struct Episode {
    /// Suite of the pull
    #[arg(long, default_value = "paper17")]
    suite: String,
    /// Its name in the suite, or any steady pull f_x/f_y in newtons
    #[arg(long, allow_hyphen_values = true)]
    case: String,
    /// Write the picture here
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    situation: Situation,
    /// Seconds of the film or the figure, up to 60
    #[arg(long, default_value_t = 8.0, value_parser = seconds)]
    seconds: f64,
}

#[derive(Debug, Args)]
struct Paths {
    /// Suite of the pulls
    #[arg(long, default_value = "paper17")]
    suite: String,
    /// Write the picture here
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    #[command(flatten)]
    situation: Situation,
}

#[derive(Debug, Args)]
struct Curves {
    /// Folders of runs
    #[arg(required = true)]
    runs: Vec<PathBuf>,
    /// Column of metrics.csv
    #[arg(long, default_value = "behavior_reward/total")]
    column: String,
    /// Write the figure here
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Film(episode) => draw_film(episode),
        What::Series(episode) => draw_series(episode),
        What::Paths(paths) => draw_paths(paths),
        What::Curves(curves) => draw_curves(curves),
    }?;
    Ok(ExitCode::SUCCESS)
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|seconds| *seconds > 0.0 && *seconds <= 60.0);
    seconds.ok_or_else(|| "must be above 0, at most 60 seconds".into())
}

fn write(out: &Path, bytes: &[u8]) -> Result<()> {
    Ok(write_atomic(out, bytes).or_bad_input(|| format!("--out {}", out.display()))?)
}

impl Episode {
    fn case(&self) -> Result<Case> {
        Ok(case(&cases(&self.suite, &[])?, &self.case)?)
    }

    fn arena(&self) -> Result<Arena> {
        self.situation.arena(1)
    }

    /// How many of the pieces of `period_s` are within the time asked for.
    fn count(&self, period_s: f64) -> usize {
        (self.seconds / period_s) as usize
    }
}

fn draw_film(episode: &Episode) -> Result<()> {
    let arena = episode.arena()?;
    let supervisor = policies::supervisor(&episode.situation.supervisor)?;
    let mut poses = arena.poses(&supervisor, &episode.case()?).map_err(anyhow::Error::msg)?;
    poses.truncate(episode.count(0.08).max(1));
    write(&episode.out, &film(&poses, arena.ground()).map_err(anyhow::Error::msg)?)
}

fn draw_series(episode: &Episode) -> Result<()> {
    let case = episode.case()?;
    let supervisor = policies::supervisor(&episode.situation.supervisor)?;
    let mut recording = episode.arena()?.record(&supervisor, &case).map_err(anyhow::Error::msg)?;
    recording.samples.truncate(episode.count(0.02).max(recording.onset + 1));
    write(&episode.out, series_svg(&case.name, &recording).as_bytes())
}

fn draw_paths(arguments: &Paths) -> Result<()> {
    let Paths { suite, out, situation } = arguments;
    let supervisor = policies::supervisor(&situation.supervisor)?;
    let arena = situation.arena(1)?;
    let (cases, traces) =
        arena.judge(&supervisor, &cases(suite, &[])?, &|_| {}).map_err(anyhow::Error::msg)?;
    write(out, paths_svg(&cases, &traces).context("no path can be drawn")?.as_bytes())
}

fn draw_curves(arguments: &Curves) -> Result<()> {
    let mut groups: Vec<Seeds> = Vec::new();
    for run in &arguments.runs {
        let name = run.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let points = column(run, &arguments.column)?;
        let common = name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches(['-', '_']);
        let common = if common.is_empty() { &name } else { common }.to_owned();
        let curve = Curve { name, points };
        match groups.iter_mut().find(|seeds| seeds.name == common) {
            Some(seeds) => seeds.curves.push(curve),
            None => groups.push(Seeds { name: common, curves: vec![curve] }),
        }
    }
    let is_reward = arguments.column == "behavior_reward/total";
    let reference = is_reward.then_some(("the paper", BehaviorReward::PAPER.total));
    let figure = bands_svg(&arguments.column, &groups, reference);
    write(&arguments.out, figure.as_bytes())
}

fn column(run: &Path, name: &str) -> Result<Vec<(u64, f64)>> {
    let file = run.join("metrics.csv");
    if !file.is_file() {
        return Err(BadInput::new(format!("{}: is no run, it has no metrics.csv", run.display())).into());
    }
    let table = MetricsTable::read(&file).or_bad_input(|| file.display().to_string())?;
    let points = table.column(name);
    if points.is_empty() {
        return Err(BadInput::new(format!("{}: has no column {name}", file.display())).into());
    }
    Ok(points)
}
