//! How far a robot drifts from where its handler wants to be: turns away, or creeps where it is to stay.
//!
//! The behavior reward sees the velocity of one instant, in which the gait's swing is many times the steady drift that
//! takes a handler off the path: 0.04 rad/s cost it 1.6 %, and turn the handler by 23° in ten seconds; 0.05 m/s cost it 1 %, and
//! who waits at a curb is half a metre farther after as long. The authors of the paper name such a term on the heading as what
//! theirs lacked.

use crate::simulation::update_stride_mean;

/// What is counted at most, of turning \[rad/s\]: a turn that has just been asked for is no drift.
const MAX_HEADING_DRIFT_RADPS: f32 = 0.15;
/// What is counted at most, of creeping \[m/s\].
const MAX_PLACE_DRIFT_MPS: f32 = 0.15;

/// Running mean of a robot's velocity, less what is wanted: v_x, v_y \[m/s\], ω_z \[rad/s\].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Drift {
    pub(super) mean: [f32; 3],
}

impl Drift {
    /// Takes in a control step's error of v_x, v_y \[m/s\] and ω_z \[rad/s\].
    pub(super) fn update(&mut self, error: [f32; 3]) {
        self.mean.iter_mut().zip(error).for_each(|(mean, error)| update_stride_mean(mean, error));
    }

    /// Size of the heading's drift, at most the limit \[rad/s\].
    pub(super) fn of_heading(&self) -> f32 {
        self.mean[2].abs().min(MAX_HEADING_DRIFT_RADPS)
    }

    /// Size of the place's drift, at most the limit \[m/s\].
    pub(super) fn of_place(&self) -> f32 {
        self.mean[0].hypot(self.mean[1]).min(MAX_PLACE_DRIFT_MPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulation::CONTROL_PERIOD_S;

    /// The largest drift of heading and place in the last five of ten seconds.
    fn settled(error: impl Fn(f32) -> [f32; 3]) -> [f32; 2] {
        let mut drift = Drift::default();
        (0..500).fold([0.0_f32; 2], |[heading, place], step| {
            drift.update(error(step as f32 * CONTROL_PERIOD_S));
            if step < 250 {
                [heading, place]
            } else {
                [heading.max(drift.of_heading()), place.max(drift.of_place())]
            }
        })
    }

    #[test]
    fn a_steady_drift_counts_and_the_swing_of_a_gait_does_not() {
        let [heading, place] = settled(|_| [0.03, -0.04, -0.04]);
        assert!((heading - 0.04).abs() < 1e-4 && (place - 0.05).abs() < 1e-4, "{heading} {place}");
        // ±0.2 three times a second: 0.2 / √(1 + (2π · 3 · 0.5)²) by the filter's response.
        let [heading, place] = settled(|time| {
            let swing = 0.2 * (std::f32::consts::TAU * 3.0 * time).sin();
            [swing, 0.0, swing]
        });
        assert!((0.02..0.023).contains(&heading) && (0.02..0.023).contains(&place), "{heading} {place}");
        assert_eq!(settled(|_| [0.0, 0.8, 0.6]), [MAX_HEADING_DRIFT_RADPS, MAX_PLACE_DRIFT_MPS]);
    }
}
