//! The report: one HTML file with its figures inside, that needs no network and no script.
//!
//! It is made from data alone and knows nothing of where they came from. What is empty is left out; what is not a
//! number is drawn nowhere and printed as a dash.

use std::io;
use std::path::Path;

use policy::write_atomic;

use crate::results::{Behavior, Results};

mod bands;
mod bars;
mod chart;
mod intent_map;
mod legend;
mod markup;
mod measures;
mod number;
mod page;
mod panels;
mod paths;
mod prose;
mod series;
mod tables;
mod training;

pub use bands::{Seeds, bands_svg};
pub use bars::success_bars_svg;
pub use intent_map::intent_map_svg;
pub use panels::{Panel, Stroke, panels_svg};
pub use paths::paths_svg;
pub use series::series_svg;

/// A learning curve: one value per iteration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// What the curve shows, for its description; may be empty.
    pub name: String,
    /// Iteration and value (without unit), in the order of the iterations; values that are not finite leave a gap.
    pub points: Vec<(u64, f64)>,
}

/// Behavior reward during the supervisor's training, with exploration noise.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrainingCurves {
    /// Mean over all steps, in [0, 1].
    pub total: Curve,
    /// Each behavior's share of the total; at most the share of the time in which it is meant.
    pub behaviors: Vec<(Behavior, Curve)>,
}

/// The path of one robot, seen from above.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathTrace {
    /// What Table II makes of the force: the panel the path is drawn in.
    pub behavior: Behavior,
    /// Name of the case, as in [`CaseResult::name`](crate::results::CaseResult::name).
    pub case: String,
    /// x, y \[m\] and yaw \[rad\] every [`period_s`](Self::period_s), from the moment the force sets in and in the
    /// heading frame of that moment.
    pub points: Vec<[f64; 3]>,
    /// Time between two points \[s\].
    pub period_s: f64,
}

/// All that a report shows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReportData {
    /// Heading of the page.
    pub title: String,
    /// The supervisor the report is about.
    pub judged: Results,
    /// Other supervisors on the same suite ("oracle", "rules", "dominance"), shown beside the judged one.
    pub baselines: Vec<Results>,
    /// Reward over the iterations of training; without it that section is left out.
    pub training: Option<TrainingCurves>,
    /// Paths, drawn in one panel a behavior; without any that section is left out.
    pub traces: Vec<PathTrace>,
    /// How this was made, as key and value: seed, wall time, commit, ...
    pub notes: Vec<(String, String)>,
}

/// The page as text: HTML that is well-formed XML too.
pub fn render(data: &ReportData) -> String {
    page::page(data)
}

/// Writes the page; an interrupted write leaves the old file as it was.
///
/// # Errors
/// The disk refuses.
pub fn write(data: &ReportData, path: &Path) -> io::Result<()> {
    write_atomic(path, render(data).as_bytes())
}
