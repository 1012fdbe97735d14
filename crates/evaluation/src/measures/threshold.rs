//! Where a supervisor has its threshold between two behaviors, found by a scan along a line of forces.

use serde::{Deserialize, Serialize};

/// One force of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScanPoint {
    /// Component along the scan \[N\], its size where the scan runs to a side.
    pub force_n: f64,
    /// Episodes that did not fall.
    pub episodes: usize,
    /// Those that looked like what lies beyond the threshold.
    pub beyond: usize,
}

/// What a scan found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Threshold {
    /// From which behavior to which, along which line: "walk to stop, f_y = 0".
    pub name: String,
    /// Table II's threshold \[N\].
    pub nominal_n: f64,
    /// Force at which half of the episodes are read as beyond, less the nominal one \[N\]; above zero: a stronger pull is
    /// needed than Table II says. `None`: not within the scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bias_n: Option<f64>,
    /// From where a tenth to where nine tenths are read as beyond \[N\]. `None`: not within the scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub width_n: Option<f64>,
    /// The scan.
    pub points: Vec<ScanPoint>,
}

impl Threshold {
    /// Finds bias and width; points go from before the threshold to beyond it.
    pub fn of_scan(name: String, nominal_n: f64, points: Vec<ScanPoint>) -> Self {
        let rates = monotone(&points);
        let [tenth, half, nine] = [0.1, 0.5, 0.9].map(|level| crossing(&points, &rates, level));
        Self {
            name,
            nominal_n,
            bias_n: half.map(|force| force - nominal_n),
            width_n: tenth.zip(nine).map(|(low, high)| high - low),
            points,
        }
    }
}

/// The best rates that never fall along the scan, in the sense of least squares weighted by episodes: neighbors that fall
/// are pooled (the pool-adjacent-violators rule; Ayer et al., Ann. Math. Statist. 26, 1955).
fn monotone(points: &[ScanPoint]) -> Vec<f64> {
    // Pools of (beyond, episodes, points).
    let mut pools: Vec<(f64, f64, usize)> = Vec::new();
    for point in points {
        let mut last = (point.beyond as f64, point.episodes as f64, 1);
        let rate = |pool: &(f64, f64, usize)| if pool.1 > 0.0 { pool.0 / pool.1 } else { 0.0 };
        while let Some(before) = pools.pop_if(|before| before.1 == 0.0 || rate(before) >= rate(&last)) {
            last = (before.0 + last.0, before.1 + last.1, before.2 + last.2);
        }
        pools.push(last);
    }
    let spread = |(beyond, episodes, count): (f64, f64, usize)| {
        std::iter::repeat_n(if episodes > 0.0 { beyond / episodes } else { 0.0 }, count)
    };
    pools.into_iter().flat_map(spread).collect()
}

/// Force at which the rates, joined by straight lines, reach a level for the first time.
fn crossing(points: &[ScanPoint], rates: &[f64], level: f64) -> Option<f64> {
    let after = rates.iter().position(|rate| *rate >= level)?;
    let before = after.checked_sub(1)?;
    let share = (level - rates[before]) / (rates[after] - rates[before]);
    Some(points[before].force_n + share * (points[after].force_n - points[before].force_n))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(beyond: &[usize]) -> Threshold {
        let point = |(i, beyond): (usize, &usize)| ScanPoint {
            force_n: 38.0 + 0.5 * i as f64,
            episodes: 10,
            beyond: *beyond,
        };
        Threshold::of_scan("scan".into(), 40.0, beyond.iter().enumerate().map(point).collect())
    }

    #[test]
    fn a_straight_rise_by_hand() {
        // From 38 N in steps of 0.5: a tenth at 38.75, half at 39.5, nine tenths at 40.25 N.
        let found = scan(&[0, 0, 2, 5, 8, 10, 10]);
        assert!((found.bias_n.unwrap() + 0.5).abs() < 1e-9, "{found:?}");
        assert!((found.width_n.unwrap() - (40.25 - 38.75)).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn neighbors_that_fall_are_pooled() {
        // 8 and 2 of 10 become 5 of 10 each, as if both had been there: half is reached at the first of them.
        let found = scan(&[0, 8, 2, 10]);
        assert!((found.bias_n.unwrap() + 1.5).abs() < 1e-9, "{found:?}");
    }

    #[test]
    fn a_threshold_outside_the_scan_is_none() {
        for beyond in [[0, 0, 1], [10, 10, 10]] {
            let found = scan(&beyond);
            assert_eq!((found.bias_n, found.width_n), (None, None));
        }
    }
}
