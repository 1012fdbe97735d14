//! A training's numbers as one picture: `plots.svg` in the run's folder.

use std::cmp::Reverse;
use std::path::PathBuf;

use anyhow::{Context as _, Result};
use evaluation::report::{Panel, Stroke, panels_svg};
use evaluation::statistics::moving_average;

use crate::metrics::MetricsTable;
use crate::run_folder::{RunFolder, write_atomic};

/// What a reader wants first; a name that ends in `/` stands for all that begin with it. Others come last.
const ORDER: [&str; 20] = [
    "episode_return",
    "step_reward",
    "behavior_reward/",
    "tracking_linear",
    "tracking_yaw",
    "guidance_score",
    "terrain_level",
    "heading_drift",
    "falls_per_1000",
    "episode_length",
    "surrogate_loss",
    "value_loss",
    "kl",
    "clip_fraction",
    "gradient_norm",
    "learning_rate",
    "action_std",
    "reward/",
    "steps_per_s",
    "time/",
];
/// What everything is drawn over.
const AXES: [&str; 2] = ["iteration", "env_steps"];
const SIZE: [f64; 2] = [300.0, 190.0];
/// The bold line is a mean over such a share of the training.
const SMOOTHED: usize = 40;

/// Draws every number of `metrics.csv` that was not always the same, over environment steps; returns the picture's path.
///
/// # Errors
/// The table cannot be read, or the disk refuses.
pub fn write(run: &RunFolder) -> Result<PathBuf> {
    let file = run.file("metrics.csv");
    let table = MetricsTable::read(&file).with_context(|| file.display().to_string())?;
    let steps = table.column("env_steps");
    let place = |name: &str| {
        let is_of = |known: &&str| name == *known || (known.ends_with('/') && name.starts_with(known));
        ORDER.iter().position(is_of).unwrap_or(ORDER.len())
    };
    let drawn = table.columns().iter().filter(|name| !AXES.contains(&name.as_str()));
    let mut named: Vec<(usize, &String)> = drawn.map(|name| (place(name), name)).collect();
    // Parts of a whole by size come later; the total is first.
    named.sort_by_key(|(place, name)| (*place, Reverse(name.ends_with("/total"))));
    let panels: Vec<Panel> =
        named.into_iter().filter_map(|(_, name)| panel(name, &table.column(name), &steps)).collect();
    let title = format!("{}: every iteration (pale) and running mean (bold)", run.path().display());
    let picture = panels_svg(&title, "million environment steps", &panels, SIZE, &[]);
    let path = run.file("plots.svg");
    write_atomic(&path, picture.as_bytes()).with_context(|| format!("cannot write {}", path.display()))?;
    Ok(path)
}

/// `None` for what was always the same: a term without weight, the level of level ground.
fn panel(name: &str, column: &[(u64, f64)], steps: &[(u64, f64)]) -> Option<Panel> {
    column.iter().any(|(_, value)| *value != column[0].1).then_some(())?;
    let at = |iteration: u64| {
        let found = steps.binary_search_by_key(&iteration, |(iteration, _)| *iteration);
        found.map_or(f64::NAN, |index| steps[index].1 / 1e6)
    };
    let values: Vec<f64> = column.iter().map(|(_, value)| *value).collect();
    let smooth = moving_average(&values, values.len() / SMOOTHED);
    let line = |values: Vec<f64>| -> Vec<[f64; 2]> {
        column.iter().zip(values).map(|((iteration, _), value)| [at(*iteration), value]).collect()
    };
    let lines = vec![(Stroke::Raw, line(values)), (Stroke::Smooth, line(smooth))];
    Some(Panel { title: name.to_owned(), lines, reference: None })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_recorded_is_drawn_in_order_and_what_never_changed_is_not() {
        let root = tempfile::tempdir().unwrap();
        let run = RunFolder::open(root.path(), "recorded").unwrap();
        let mut table = MetricsTable::open(&run.file("metrics.csv"), 0).unwrap();
        for i in 1..=100_u64 {
            let row = [
                ("env_steps", i as f64 * 1e4),
                ("roughness", 0.3 * i as f64),
                ("reward/progress", 0.0),
                ("reward/joint_torque", -0.5 * i as f64),
                ("kl", 1.0 / i as f64),
                ("tracking_linear", 0.01 * i as f64),
                ("behavior_reward/stop", 0.1 * i as f64),
                ("behavior_reward/total", 0.2 * i as f64),
            ];
            table.append(i, &row.map(|(name, value)| (name.to_owned(), value))).unwrap();
        }
        let picture = std::fs::read_to_string(write(&run).unwrap()).unwrap();
        let order = [
            "behavior_reward/total",
            "behavior_reward/stop",
            "tracking_linear",
            "kl",
            "reward/joint_torque",
            "roughness",
        ];
        let places: Vec<_> = order.iter().map(|name| picture.find(&format!(">{name}<")).unwrap()).collect();
        assert!(places.is_sorted(), "{places:?}");
        assert!(!picture.contains("progress") && !picture.contains(">env_steps<"));
        assert_eq!(picture.matches("class=\"panel\"").count(), order.len());
    }
}
