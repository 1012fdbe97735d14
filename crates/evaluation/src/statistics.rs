//! The statistics a table needs: success rates with their uncertainty, means, and smoothed curves.
//!
//! Everything is plain `f64` on slices. An empty sample has no mean, so the answers are `Option` or empty, never a
//! silent zero.

/// The two-sided 95 % quantile of the standard normal distribution.
const Z_95: f64 = 1.959_963_984_540_054;

/// A confidence interval, both ends included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// The Wilson score interval at 95 % for `successes` out of `trials`, within [0, 1].
///
/// It stays honest at 0 % and 100 %, where the usual normal interval shrinks to nothing. No trials: [0, 1].
/// Source: E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22 (1927).
pub fn wilson_interval(successes: usize, trials: usize) -> Interval {
    if trials == 0 {
        return Interval { low: 0.0, high: 1.0 };
    }
    let n = trials as f64;
    let rate = successes.min(trials) as f64 / n;
    let z2 = Z_95 * Z_95;
    let center = (rate + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = Z_95 / (1.0 + z2 / n) * (rate * (1.0 - rate) / n + z2 / (4.0 * n * n)).sqrt();
    // At the ends the formula gives 0 or 1 but for rounding; say it exactly.
    let low = if successes == 0 { 0.0 } else { (center - half).max(0.0) };
    let high = if successes >= trials { 1.0 } else { (center + half).min(1.0) };
    Interval { low, high }
}

/// Arithmetic mean, `None` for an empty sample.
pub fn mean(sample: &[f64]) -> Option<f64> {
    (!sample.is_empty()).then(|| sample.iter().sum::<f64>() / sample.len() as f64)
}

/// Middle value (mean of the two middle ones for an even count), `None` for an empty sample.
pub fn median(sample: &[f64]) -> Option<f64> {
    let mut sorted = sample.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    let lower = sorted[(sorted.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

/// The trailing mean over the last `window` values, of the same length as the series.
///
/// The first `window − 1` points average what there is so far, and no point looks ahead, so that a curve of a running
/// training never changes its past. Values that are not finite are left out; a window without any gives NaN.
pub fn moving_average(series: &[f64], window: usize) -> Vec<f64> {
    let window = window.max(1);
    (0..series.len())
        .map(|last| {
            let recent = &series[(last + 1).saturating_sub(window)..=last];
            let finite: Vec<f64> = recent.iter().copied().filter(|x| x.is_finite()).collect();
            mean(&finite).unwrap_or(f64::NAN)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 5e-5, "found {found}, expected {expected}");
    }

    /// Four digits each, worked out by hand from the formula; 0/10 and 10/10 are the textbook 27.75 %.
    #[test]
    fn wilson_agrees_with_hand_values() {
        for (successes, trials, low, high) in [
            (0, 10, 0.0, 0.2775),
            (10, 10, 0.7225, 1.0),
            (50, 100, 0.4038, 0.5962),
            (1, 10, 0.0179, 0.4042),
            (200, 200, 0.9812, 1.0),
        ] {
            let found = wilson_interval(successes, trials);
            assert_near(found.low, low);
            assert_near(found.high, high);
        }
        assert_eq!(wilson_interval(0, 0), Interval { low: 0.0, high: 1.0 });
    }

    #[test]
    fn wilson_mirrors_success_and_failure() {
        for successes in 0..=37 {
            let (yes, no) = (wilson_interval(successes, 37), wilson_interval(37 - successes, 37));
            assert!((yes.low - (1.0 - no.high)).abs() < 1e-12);
            assert!(yes.low <= successes as f64 / 37.0 && successes as f64 / 37.0 <= yes.high);
        }
    }

    #[test]
    fn middles_of_a_known_sample() {
        let sample = [2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0];
        assert_eq!(mean(&sample), Some(5.0));
        assert_eq!(median(&sample), Some(4.5));
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!((mean(&[]), median(&[])), (None, None));
    }

    #[test]
    fn moving_average_trails_and_skips_what_is_not_finite() {
        assert_eq!(moving_average(&[1.0, 2.0, 3.0, 4.0], 2), [1.0, 1.5, 2.5, 3.5]);
        assert_eq!(moving_average(&[1.0, f64::NAN, 3.0], 2), [1.0, 1.0, 3.0]);
        assert_eq!(moving_average(&[1.0, 2.0], 0), [1.0, 2.0]);
    }
}
