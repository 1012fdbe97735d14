//! What the handler's hand has to follow and to hold.

use crate::recording::{MEAN_STEPS, STEP_S, Sample};

/// Steps over which a change of force is a rate: 0.1 s.
const RATE_STEPS: usize = 5;
/// The hand's place on a heading robot: so far behind the base \[m\], with the nominal harness.
pub const HAND_BEHIND_M: f64 = 1.2206;

/// Comfort at the hand over an episode. A scripted hand decides on its force itself, so force figures are the
/// script's; accelerations are the robot's answer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comfort {
    /// Largest horizontal force \[N\].
    pub force_peak_n: f64,
    /// Largest change of the horizontal force in 0.1 s \[N/s\].
    pub force_rate_nps: f64,
    /// The hand's largest horizontal acceleration \[m/s²\]: change of its mean velocity from half a second to the next.
    pub acceleration_mps2: f64,
    /// Largest change of those accelerations, likewise \[m/s³\].
    pub jerk_mps3: f64,
}

/// Measures comfort; the hand is taken to be [`HAND_BEHIND_M`] behind the base on its heading.
pub fn comfort(samples: &[Sample]) -> Comfort {
    let force: Vec<[f64; 2]> =
        samples.iter().map(|s| [f64::from(s.force[0]), f64::from(s.force[1])]).collect();
    // Before the pull there was none; the first sample's force came within the first step.
    let before = std::iter::repeat_n([0.0; 2], RATE_STEPS);
    let padded: Vec<[f64; 2]> = before.chain(force.iter().copied()).collect();
    let rate_s = RATE_STEPS as f64 * STEP_S;
    let hand: Vec<[f64; 2]> = samples.iter().map(hand).collect();
    let velocity = differences(&hand);
    let acceleration = differences(&velocity);
    let jerk = differences(&acceleration);
    let greatest = |vectors: &[[f64; 2]]| vectors.iter().map(norm).fold(0.0, f64::max);
    let changes: Vec<[f64; 2]> =
        padded.windows(RATE_STEPS + 1).map(|w| difference(&w[0], &w[RATE_STEPS])).collect();
    Comfort {
        force_peak_n: greatest(&force),
        force_rate_nps: greatest(&changes) / rate_s,
        acceleration_mps2: greatest(&acceleration),
        jerk_mps3: greatest(&jerk),
    }
}

fn hand(sample: &Sample) -> [f64; 2] {
    let (sin, cos) = f64::from(sample.yaw).sin_cos();
    [f64::from(sample.position[0]) - HAND_BEHIND_M * cos, f64::from(sample.position[1]) - HAND_BEHIND_M * sin]
}

/// Change from each value to the one half a second later, per second: of places the mean velocities in between.
fn differences(values: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let half_second = MEAN_STEPS as f64 * STEP_S;
    let change = |w: &[[f64; 2]]| difference(&w[0], &w[MEAN_STEPS]).map(|d| d / half_second);
    values.windows(MEAN_STEPS + 1).map(change).collect()
}

fn difference(a: &[f64; 2], b: &[f64; 2]) -> [f64; 2] {
    [b[0] - a[0], b[1] - a[1]]
}

fn norm(v: &[f64; 2]) -> f64 {
    v[0].hypot(v[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::by_hand::drive;

    #[test]
    fn an_even_acceleration_has_no_jerk() {
        let found = comfort(&drive(300, |t| [0.3 * t, 0.0, 0.0]));
        assert!((found.acceleration_mps2 - 0.3).abs() < 1e-3 && found.jerk_mps3 < 1e-3, "{found:?}");
    }

    #[test]
    fn a_sudden_stop_is_as_hard_as_its_means() {
        // 0.8 m/s until 2 s: half a second at full speed, then half a second standing.
        let found = comfort(&drive(300, |t| [if t < 2.01 { 0.8 } else { 0.0 }, 0.0, 0.0]));
        assert!(
            (found.acceleration_mps2 - 1.6).abs() < 1e-3 && (found.jerk_mps3 - 3.2).abs() < 0.1,
            "{found:?}"
        );
    }

    #[test]
    fn spinning_swings_the_hand_around() {
        // Half-second chords of a circle: the true ω² r times (sin(ω h / 2) / (ω h / 2))² = 0.99 at h = 0.5 s.
        let found = comfort(&drive(500, |_| [0.0, 0.0, 0.8]));
        let chord = (0.2_f64.sin() / 0.2).powi(2);
        assert!((found.acceleration_mps2 - 0.64 * HAND_BEHIND_M * chord).abs() < 2e-3, "{found:?}");
        assert!((found.jerk_mps3 - 0.512 * HAND_BEHIND_M * chord.powf(1.5)).abs() < 5e-3, "{found:?}");
    }

    #[test]
    fn forces_by_hand() {
        let mut samples = drive(300, |_| [0.0; 3]);
        // 100 N/s up to 30 N along x, while 40 N along y come at once at 2 s.
        for (step, sample) in samples.iter_mut().enumerate() {
            let side = if step >= 100 { 40.0 } else { 0.0 };
            sample.force = [-(2.0 * (step + 1) as f32).min(30.0), side, 9.0];
        }
        let found = comfort(&samples);
        assert_eq!((found.force_peak_n, found.force_rate_nps), (50.0, 400.0));
        samples.iter_mut().for_each(|sample| sample.force[1] = 0.0);
        assert!((comfort(&samples).force_rate_nps - 100.0).abs() < 1e-9);
    }
}
