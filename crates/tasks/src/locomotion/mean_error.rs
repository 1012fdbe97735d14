//! How far a robot is from the velocity it is told, over more than a stride.
//!
//! At one instant the gait's swing and the noise that explores are many times the steady error, and the fine tracking terms
//! hardly see it: robots that turned on the spot on stairs did so about a point 0.25 m beside them (docs/findings.md, "Spins on stairs").

use crate::simulation::update_stride_mean;

/// What counts at most of one step's error: a command that has just changed must not pay for swinging back \[m/s, rad/s\].
const LIMIT: f32 = 0.2;

/// Running mean of a robot's velocity less what it is told: v_x, v_y \[m/s\], ω_z \[rad/s\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct MeanError(pub(super) [f32; 3]);

impl MeanError {
    /// Takes in a control step's error; gives the squared length of the mean.
    pub(super) fn update(&mut self, error: [f32; 3]) -> f32 {
        for (mean, error) in self.0.iter_mut().zip(error) {
            update_stride_mean(mean, error.clamp(-LIMIT, LIMIT));
        }
        self.0.iter().map(|mean| mean * mean).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::CONTROL_PERIOD_S;

    #[test]
    fn a_steady_error_counts_and_the_swing_of_a_gait_does_not() {
        let settled = |error: &dyn Fn(f32) -> [f32; 3]| {
            let mut mean = MeanError::default();
            (0..500).fold(0.0, |_, step| mean.update(error(step as f32 * CONTROL_PERIOD_S)))
        };
        assert!((settled(&|_| [0.03, -0.04, 0.0]) - 0.0025).abs() < 1e-6);
        // ±0.15 three times a second: at most 0.15 / √(1 + (2π · 3 · 0.5)²) of it by the filter's response.
        let swing = |time: f32| [0.15 * (std::f32::consts::TAU * 3.0 * time).sin(), 0.0, 0.0];
        assert!(settled(&swing) < 0.016_f32.powi(2) * 1.2);
        assert!((settled(&|_| [0.0, 0.0, -0.8]) - LIMIT * LIMIT).abs() < 1e-6);
    }
}
