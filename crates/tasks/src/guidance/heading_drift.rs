//! How far a robot turns away from where its handler wants to go.
//!
//! The behavior reward sees the yaw rate of one instant, in which the gait's swing is many times the steady drift that
//! takes a handler off the path: 0.04 rad/s cost it 1.6 %, and turn the handler by 23° in ten seconds. The authors of the
//! paper name such a term as what theirs lacked.

use crate::simulation::update_stride_mean;

/// What is counted at most \[rad/s\]: a turn that has just been asked for is no drift.
const MAX_DRIFT_RADPS: f32 = 0.15;

/// Running mean of a robot's yaw rate, less what is wanted \[rad/s\].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HeadingDrift {
    pub(super) mean: f32,
}

impl HeadingDrift {
    /// Takes in a control step's error of the yaw rate \[rad/s\]; gives the drift's size, at most the limit.
    pub(super) fn update(&mut self, error: f32) -> f32 {
        update_stride_mean(&mut self.mean, error);
        self.mean.abs().min(MAX_DRIFT_RADPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::CONTROL_PERIOD_S;

    #[test]
    fn a_steady_drift_counts_and_the_swing_of_a_gait_does_not() {
        let settled = |error: &dyn Fn(f32) -> f32| {
            let mut drift = HeadingDrift::default();
            (0..500).fold(0.0_f32, |worst, step| {
                let now = drift.update(error(step as f32 * CONTROL_PERIOD_S));
                if step < 250 { worst } else { worst.max(now) }
            })
        };
        assert!((settled(&|_| 0.04) - 0.04).abs() < 1e-4);
        // ±0.2 rad/s three times a second: 0.2 / √(1 + (2π · 3 · 0.5)²) by the filter's response.
        let swing = |time: f32| 0.2 * (std::f32::consts::TAU * 3.0 * time).sin();
        assert!(settled(&swing) < 0.023);
        assert_eq!(settled(&|_| -0.6), MAX_DRIFT_RADPS);
    }
}
