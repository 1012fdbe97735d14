//! The whole plane of forces: a grid of points, and line scans across the thresholds of Table II.

use tasks::guidance::{Behavior, PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N};

use crate::{
    measures::threshold::{ScanPoint, Threshold},
    results::CaseResult,
    suite::Case,
};

/// Points along each axis.
const POINTS: usize = 41;
/// First and last f_x \[N\].
const ALONG_N: [f32; 2] = [-120.0, 60.0];
/// First and last f_y \[N\].
const ACROSS_N: [f32; 2] = [-60.0, 60.0];
/// Distance of two points of a scan \[N\], and how far it goes on either side of the threshold.
const SCAN_STEP_N: f32 = 0.5;
const SCAN_REACH_N: f32 = 12.0;
/// Episodes of a point of the grid, unless told otherwise.
pub const EPISODES: usize = 16;
/// Tiles of rough ground on which they start.
pub const TILES: usize = 400;

/// The points of the grid.
pub fn grid() -> Vec<Case> {
    let at = |[low, high]: [f32; 2], i: usize| low + (high - low) * i as f32 / (POINTS - 1) as f32;
    let point = |i: usize, k: usize| {
        let [x, y] = [at(ALONG_N, i), at(ACROSS_N, k)];
        Case::steady(x, y)
    };
    (0..POINTS).flat_map(|i| (0..POINTS).map(move |k| point(i, k))).collect()
}

/// A line of forces across a threshold.
#[derive(Clone, Debug)]
pub struct Line {
    /// From which behavior to which, along which line.
    pub name: String,
    /// Table II's threshold \[N\].
    pub nominal_n: f32,
    /// From before the threshold to beyond it.
    pub cases: Vec<Case>,
}

/// Lines across every threshold, to both sides.
pub fn lines() -> Vec<Line> {
    let back =
        [0.0, 30.0, -30.0].map(|y| line(PULL_THRESHOLD_X_N, &format!("f_y = {y}"), move |size| [-size, y]));
    let aside = [0.0, -60.0].into_iter().flat_map(|x| {
        [(1.0, "left"), (-1.0, "right")].map(|(side, word)| {
            line(PULL_THRESHOLD_Y_N, &format!("to the {word}, f_x = {x}"), move |size| [x, side * size])
        })
    });
    back.into_iter().chain(aside).collect()
}

fn line(nominal_n: f32, along: &str, force: impl Fn(f32) -> [f32; 2]) -> Line {
    let steps = (SCAN_REACH_N / SCAN_STEP_N) as i32;
    let case = |step: i32| {
        let [x, y] = force(nominal_n + SCAN_STEP_N * step as f32);
        Case::steady(x, y)
    };
    let cases: Vec<Case> = (-steps..=steps).map(case).collect();
    let [before, beyond] = [&cases[0], &cases[cases.len() - 1]].map(Case::behavior);
    Line { name: format!("{before} to {beyond}, {along}"), nominal_n, cases }
}

impl Line {
    /// Where the threshold is, from the results of the line's cases.
    pub fn threshold(&self, results: &[CaseResult]) -> Threshold {
        let point = |(case, result): (&Case, &CaseResult)| {
            let [x, y, _] = case.force;
            // Only one of the two components changes along a line.
            let size = if self.nominal_n == PULL_THRESHOLD_X_N { -x } else { y.abs() };
            let readings = result.read_as.unwrap_or_default();
            let side = |behavior: &Behavior| is_beyond(*behavior, self.nominal_n);
            let beyond = Behavior::ALL.iter().filter(|b| side(b)).map(|b| readings.of(*b)).sum();
            ScanPoint { force_n: f64::from(size), episodes: readings.total(), beyond }
        };
        let points = self.cases.iter().zip(results).map(point).collect();
        Threshold::of_scan(self.name.clone(), f64::from(self.nominal_n), points)
    }
}

/// Whether a behavior lies beyond the threshold: not forward, or around.
fn is_beyond(behavior: Behavior, nominal_n: f32) -> bool {
    if nominal_n == PULL_THRESHOLD_X_N {
        matches!(behavior, Behavior::Stop | Behavior::Spin)
    } else {
        matches!(behavior, Behavior::Turn | Behavior::Spin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::reading::Readings;

    #[test]
    fn the_grid_reaches_from_corner_to_corner_and_holds_a_pull_straight_back() {
        let cases = grid();
        assert_eq!(cases.len(), 1681);
        assert_eq!((cases[0].force, cases[1680].force), ([-120.0, -60.0, 0.0], [60.0, 60.0, 0.0]));
        assert!(cases.iter().any(|case| case.force == [-120.0, 0.0, 0.0]));
    }

    #[test]
    fn lines_cross_their_thresholds_in_the_middle() {
        let lines = lines();
        let names: Vec<&str> = lines.iter().map(|line| line.name.as_str()).collect();
        assert_eq!(
            names,
            [
                "walk to stop, f_y = 0",
                "turn to spin, f_y = 30",
                "turn to spin, f_y = -30",
                "walk to turn, to the left, f_x = 0",
                "walk to turn, to the right, f_x = 0",
                "stop to spin, to the left, f_x = -60",
                "stop to spin, to the right, f_x = -60",
            ]
        );
        for line in &lines {
            // A supervisor that is Table II: its threshold is a quarter of a newton late, between two points of the scan.
            let result = |case: &Case| {
                let mut readings = Readings::default();
                (0..10).for_each(|_| readings.count(case.behavior()));
                CaseResult { read_as: Some(readings), ..CaseResult::default() }
            };
            let found = line.threshold(&line.cases.iter().map(result).collect::<Vec<_>>());
            assert!((found.bias_n.unwrap() - 0.25).abs() < 1e-9, "{found:?}");
            assert!((found.width_n.unwrap() - 0.4).abs() < 1e-9);
        }
    }
}
