//! What trials have found: as a table, as a picture, for programs.

use std::fmt::Write as _;

use evaluation::report::{Panel, Stroke, panels_svg};
use serde::{Deserialize, Serialize};

use super::Task;
use crate::result_tables::spread;

/// What one training came to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// What was trained.
    pub task: String,
    /// Which settings.
    pub variant: String,
    /// What is other than the task's defaults.
    pub settings: Vec<String>,
    /// Seed of the training.
    pub seed: u64,
    /// Score wanted.
    pub target: f64,
    /// Longest training \[min\].
    pub limit_min: f64,
    /// Whether it got there.
    pub reached: bool,
    /// Why it could not go on, if it could not.
    pub broken: Option<String>,
    /// Best score of all.
    pub best_score: f64,
    /// Training by the clock until the score was reached, or in all \[min\]; judging and saving are not in it.
    pub wall_min: f64,
    /// The same in processor time of all threads.
    pub processor_min: f64,
    /// Iterations until then.
    pub iterations: u64,
    /// Environment steps until then.
    pub env_steps: f64,
    /// Needed operations until then: inference, update and simulation.
    pub operations: f64,
    /// Minutes of training and score, at every judgment.
    pub curve: Vec<[f64; 2]>,
}

/// Medians and ranges over seeds; a training that did not get there counts as longer than any that did.
pub fn table(findings: &[Finding]) -> String {
    let mut text = String::new();
    let width = findings.iter().map(|finding| finding.variant.chars().count()).max().unwrap_or(0).max(7);
    for task in Task::ALL {
        let of_task: Vec<&Finding> = findings.iter().filter(|f| f.task == task.name()).collect();
        let Some(first) = of_task.first() else { continue };
        let _ = writeln!(
            text,
            "\n{}: {}, {} wanted within {} min\n{:width$} reached  {:>20} {:>20} {:>20} {:>20}  best score",
            task.name(),
            task.score_name(),
            first.target,
            first.limit_min,
            "",
            "minutes",
            "processor minutes",
            "million steps",
            "PFLOP"
        );
        let mut variants: Vec<&str> = of_task.iter().map(|finding| finding.variant.as_str()).collect();
        variants.dedup();
        for variant in variants {
            let seeds: Vec<&&Finding> = of_task.iter().filter(|f| f.variant == variant).collect();
            let column = |of: &dyn Fn(&Finding) -> f64, decimals: usize| {
                let values = seeds.iter().map(|f| f.reached.then(|| of(f)));
                spread(values.collect(), decimals)
            };
            let best = seeds.iter().map(|f| Some(f.best_score)).collect();
            let _ = writeln!(
                text,
                "{variant:width$} {:>2} of {:<2} {:>20} {:>20} {:>20} {:>20}  {}",
                seeds.iter().filter(|f| f.reached).count(),
                seeds.len(),
                column(&|f| f.wall_min, 1),
                column(&|f| f.processor_min, 1),
                column(&|f| f.env_steps / 1e6, 2),
                column(&|f| f.operations / 1e15, 3),
                spread(best, 3)
            );
            for finding in seeds {
                if let Some(reason) = &finding.broken {
                    let _ = writeln!(text, "  seed {}: stopped, {reason}", finding.seed);
                }
            }
        }
    }
    text
}

/// Score over minutes of training: a panel a task, a color a variant, a line a seed.
pub fn picture(findings: &[Finding]) -> String {
    let mut variants: Vec<String> = Vec::new();
    for finding in findings {
        if !variants.contains(&finding.variant) {
            variants.push(finding.variant.clone());
        }
    }
    let panel = |task: Task| {
        let of_task = findings.iter().filter(|finding| finding.task == task.name());
        let line = |finding: &Finding| {
            let group = variants.iter().position(|variant| *variant == finding.variant).unwrap_or_default();
            (Stroke::Group(group), finding.curve.clone())
        };
        let reference = of_task.clone().next().map(|finding| finding.target);
        let title = format!("{}: {}", task.name(), task.score_name());
        Panel { title, lines: of_task.map(line).collect(), reference }
    };
    let panels: Vec<Panel> =
        Task::ALL.into_iter().map(panel).filter(|panel| !panel.lines.is_empty()).collect();
    panels_svg(
        "Score over training, without noise",
        "minutes of training",
        &panels,
        [460.0, 300.0],
        &variants,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(variant: &str, reached: bool, wall_min: f64) -> Finding {
        Finding {
            task: "flat".into(),
            variant: variant.into(),
            target: 0.9,
            limit_min: 30.0,
            reached,
            wall_min,
            best_score: 0.8,
            curve: vec![[1.0, 0.5], [wall_min, 0.8]],
            ..Finding::default()
        }
    }

    #[test]
    fn a_median_counts_those_that_did_not_get_there_as_the_slowest() {
        let all = [
            finding("plain", true, 9.0),
            finding("plain", false, 30.0),
            finding("plain", true, 7.0),
            finding("other", false, 30.0),
        ];
        let text = table(&all);
        assert!(text.contains("flat: tracking, share of its ceiling, 0.9 wanted within 30 min"), "{text}");
        assert!(text.contains("plain    2 of 3      9.0 (7.0 to not)     0.0 (0.0 to not)"), "{text}");
        assert!(text.contains("other    0 of 1                   not"), "{text}");
        let figure = picture(&all);
        assert_eq!(figure.matches("<path class=\"trace").count(), 4);
        assert_eq!(figure.matches("class=\"reference\"").count(), 1);
    }
}
