//! How a robot moved.

use crate::recording::{MEAN_STEPS, STEP_S, Sample, steps};

/// Judged window after the force has become what the case says \[s\]. Ours; the paper gives none.
pub const WINDOW_S: [f64; 2] = [2.0, 8.0];
/// Window of the heading drift, likewise \[s\].
pub const DRIFT_WINDOW_S: [f64; 2] = [2.0, 12.0];

/// What a robot did in the judged windows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Mean v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub velocity: [f64; 3],
    /// Mean of the planar speed's 0.5 s moving means \[m/s\].
    pub planar_speed: f64,
    /// Largest distance from where the window began \[m\].
    pub excursion: f64,
    /// Change of heading over the window \[rad\].
    pub heading_change: f64,
    /// Change of heading over the drift window, less what was asked for, over ten seconds \[rad\].
    pub heading_drift: f64,
}

impl Motion {
    /// Judges the samples from the force's beginning on; `yaw_rate` is the one asked for \[rad/s\].
    ///
    /// # Panics
    /// If there are fewer samples than the drift window takes.
    pub fn of(samples: &[Sample], yaw_rate: f32) -> Self {
        let window = range(WINDOW_S);
        let judged = &samples[window.clone()];
        let count = judged.len() as f64;
        let mean = |axis: usize| judged.iter().map(|s| f64::from(s.velocity[axis])).sum::<f64>() / count;
        let start = judged[0].position;
        let distance =
            |s: &Sample| f64::from(s.position[0] - start[0]).hypot(f64::from(s.position[1] - start[1]));
        let turned = |range: &std::ops::Range<usize>| {
            f64::from(samples[range.end - 1].yaw) - f64::from(samples[range.start].yaw)
        };
        let drift = range(DRIFT_WINDOW_S);
        let drift_s = (drift.len() - 1) as f64 * STEP_S;
        let moving = judged.windows(MEAN_STEPS).map(|recent| {
            let sum = |axis: usize| recent.iter().map(|s| f64::from(s.velocity[axis])).sum::<f64>();
            sum(0).hypot(sum(1)) / MEAN_STEPS as f64
        });
        Self {
            velocity: [mean(0), mean(1), mean(2)],
            planar_speed: moving.sum::<f64>() / (judged.len() + 1 - MEAN_STEPS) as f64,
            excursion: judged.iter().map(distance).fold(0.0, f64::max),
            heading_change: turned(&window),
            heading_drift: (turned(&drift) - f64::from(yaw_rate) * drift_s) * 10.0 / drift_s,
        }
    }
}

/// Samples of a window \[s\]; sample 0 is the first control step under the force.
pub(crate) fn range([from, to]: [f64; 2]) -> std::ops::Range<usize> {
    steps(from)..steps(to)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Twelve seconds at a constant velocity, with a ripple that averages out over half a second.
    pub(crate) fn steady(v_x: f32, v_y: f32, yaw_rate: f32) -> Vec<Sample> {
        let (mut position, mut yaw) = ([0.0, 0.0], 0.0_f32);
        let dt = STEP_S as f32;
        (0..600)
            .map(|step| {
                let ripple = 0.3 * (std::f32::consts::TAU * step as f32 / 12.5).sin();
                position[0] += (v_x * yaw.cos() - v_y * yaw.sin()) * dt;
                position[1] += (v_x * yaw.sin() + v_y * yaw.cos()) * dt;
                yaw += yaw_rate * dt;
                Sample { velocity: [v_x + ripple, v_y, yaw_rate], position, yaw, ..Sample::default() }
            })
            .collect()
    }

    #[test]
    fn measures_of_a_steady_motion() {
        let motion = Motion::of(&steady(0.8, 0.1, 0.5), 0.4);
        assert!((motion.velocity[0] - 0.8).abs() < 1e-3 && (motion.velocity[2] - 0.5).abs() < 1e-6);
        assert!((motion.planar_speed - 0.65_f64.sqrt()).abs() < 2e-3, "{}", motion.planar_speed);
        assert!((motion.heading_change - 0.5 * 5.98).abs() < 1e-3);
        assert!((motion.heading_drift - 1.0).abs() < 1e-3);
        // A circle of diameter 2 · 0.806 / 0.5 m; half of it takes 6.3 s.
        assert!((motion.excursion - 3.22).abs() < 0.02, "{}", motion.excursion);
    }
}
