//! How a robot comes to a standstill.

use crate::recording::{MEAN_STEPS, STEP_S, Sample};

/// Slower than this is standing \[m/s\]: the limit of the criterion for Stop.
const STANDING_MPS: f64 = 0.10;
/// Steps over which the speed is taken: 0.1 s; and for which it must stay low, on the mean: 0.5 s.
const SPANS: [usize; 2] = [5, MEAN_STEPS];

/// Time and way from the pull to the standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Until it stands \[s\].
    pub time_s: f64,
    /// From where the pull began \[m\].
    pub distance_m: f64,
}

/// The first moment at which the robot stands: it goes slower than 0.1 m/s over the next 0.1 s, and over the next half second,
/// too; `None` if it never does.
pub fn stopping(samples: &[Sample]) -> Option<Stopping> {
    let way = |a: &Sample, b: &Sample| {
        f64::from(b.position[0] - a.position[0]).hypot(f64::from(b.position[1] - a.position[1]))
    };
    let stands = |step: &usize| {
        let slow =
            |span: usize| way(&samples[*step], &samples[step + span]) < STANDING_MPS * span as f64 * STEP_S;
        SPANS.into_iter().all(slow)
    };
    let step = (0..samples.len().saturating_sub(MEAN_STEPS)).find(stands)?;
    // The first sample is already one step on.
    let [v_x, v_y, _] = samples[0].velocity.map(f64::from);
    let distance_m = v_x.hypot(v_y) * STEP_S + way(&samples[0], &samples[step]);
    Some(Stopping { time_s: (step + 1) as f64 * STEP_S, distance_m })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::by_hand::drive;

    #[test]
    fn an_even_braking_by_hand() {
        // 0.8 m/s, braked by 1 m/s² from 0.2 s on: stands still at 1 s. From 0.85 s on it goes by 0.01 m in 0.1 s; before, by
        // 0.16 + (0.64 − 0.0225) / 2 = 0.469 m.
        let samples = drive(200, |t| [(1.0 - t).clamp(0.0, 0.8), 0.0, 0.0]);
        let found = stopping(&samples).unwrap();
        assert!((found.time_s - 0.85).abs() < 0.025, "{found:?}");
        assert!((found.distance_m - 0.469).abs() < 0.02, "{found:?}");
        // At once: it stands in the next step.
        let found = stopping(&drive(200, |t| [if t < 0.03 { 0.8 } else { 0.0 }, 0.0, 0.0])).unwrap();
        assert!((found.time_s, (found.distance_m * 1000.0).round()) == (0.02, 16.0), "{found:?}");
    }

    #[test]
    fn a_robot_that_creeps_does_not_stand() {
        assert_eq!(stopping(&drive(200, |_| [0.11, 0.0, 0.0])), None);
        assert!(stopping(&drive(200, |_| [0.09, 0.0, 0.5])).unwrap().time_s < 0.03);
    }
}
