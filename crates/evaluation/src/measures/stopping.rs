//! How a robot comes to a standstill.

use crate::recording::{MEAN_STEPS, STEP_S, Sample};

/// Slower than this is standing \[m/s\]: the limit of the criterion for Stop.
const STANDING_MPS: f64 = 0.10;
/// Steps over which the speed is taken: 0.1 s.
const SPEED_STEPS: usize = 5;

/// Time and way from the pull to the standstill.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stopping {
    /// Until it stands \[s\].
    pub time_s: f64,
    /// From where the pull began \[m\].
    pub distance_m: f64,
}

/// The first moment from which the robot stands: in the half second that follows its speed, its mean over any 0.1 s, stays below
/// 0.1 m/s. Who brakes and swings back does not stand where it turns around: the way it makes in 0.1 s would say so. `None` if it never
/// stands.
pub fn stopping(samples: &[Sample]) -> Option<Stopping> {
    let speed = |s: &Sample| f64::from(s.velocity[0]).hypot(f64::from(s.velocity[1]));
    let slow = |w: &[Sample]| w.iter().map(speed).sum::<f64>() < STANDING_MPS * SPEED_STEPS as f64;
    let stands = |half_second: &[Sample]| half_second.windows(SPEED_STEPS).all(slow);
    let step = samples.windows(MEAN_STEPS).position(stands)?;
    let [start, end] = [0, step].map(|step| samples[step].position.map(f64::from));
    let way = (end[0] - start[0]).hypot(end[1] - start[1]);
    // The first sample is already one step on.
    let distance_m = speed(&samples[0]) * STEP_S + way;
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
        // At once: it stands at the end of the next step.
        let found = stopping(&drive(200, |t| [if t < 0.03 { 0.8 } else { 0.0 }, 0.0, 0.0])).unwrap();
        assert!((found.time_s, (found.distance_m * 1000.0).round()) == (0.04, 16.0), "{found:?}");
    }

    #[test]
    fn who_swings_back_stands_only_when_that_is_over() {
        // From 0.8 m/s through zero at 0.1 s to −0.8 m/s at 0.2 s, then evenly to rest at 0.9 s.
        let swing = |t: f64| if t < 0.2 { 0.8 - 8.0 * t } else { ((t - 0.9) * 8.0 / 7.0).clamp(-0.8, 0.0) };
        let found = stopping(&drive(200, |t| [swing(t), 0.0, 0.0])).unwrap();
        // It goes at 0.1 m/s 0.0875 s before the end; the 0.1 s with that mean began 0.05 s earlier.
        assert!((found.time_s - 0.76).abs() < 0.03, "{found:?}");
    }

    #[test]
    fn a_robot_that_creeps_does_not_stand() {
        assert_eq!(stopping(&drive(200, |_| [0.11, 0.0, 0.0])), None);
        assert!(stopping(&drive(200, |_| [0.09, 0.0, 0.5])).unwrap().time_s < 0.03);
    }
}
