//! What a robot did, step by step: the same whoever simulated it.

use serde::{Deserialize, Serialize};

/// Control period \[s\].
pub const STEP_S: f64 = 0.02;

/// One control step of one robot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sample {
    /// v_x, v_y \[m/s\], ω_z \[rad/s\], base frame, at the end of the step.
    pub velocity: [f32; 3],
    /// Position in the world \[m\].
    pub position: [f32; 2],
    /// Heading, continuous over ±π \[rad\].
    pub yaw: f32,
    /// Velocity command during the step: v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub command: [f32; 3],
    /// Force of the hand during the step, heading frame \[N\].
    pub force: [f32; 3],
}

/// One robot's episode.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    /// From the beginning on. A fallen robot stands still where it fell.
    pub samples: Vec<Sample>,
    /// The first sample under the pull.
    pub onset: usize,
    /// The first sample in which it had fallen.
    pub fell_at: Option<usize>,
}

impl Recording {
    /// The samples under the pull.
    pub fn pulled(&self) -> &[Sample] {
        &self.samples[self.onset..]
    }

    /// Those of them in which it had not fallen.
    pub fn upright(&self) -> &[Sample] {
        &self.samples[self.onset..self.fell_at.unwrap_or(self.samples.len()).max(self.onset)]
    }

    /// Whether it fell.
    pub fn fell(&self) -> bool {
        self.fell_at.is_some()
    }
}

/// Control steps in a time \[s\].
pub fn steps(time_s: f64) -> usize {
    (time_s / STEP_S).round() as usize
}

/// Steps of the moving mean that velocities are judged by: 0.5 s, about a stride.
pub(crate) const MEAN_STEPS: usize = 25;

/// Mean velocities over the half seconds that follow one another; what is left over at the end is left out.
pub(crate) fn half_seconds(samples: &[Sample]) -> impl Iterator<Item = [f64; 3]> {
    samples.chunks_exact(MEAN_STEPS).map(mean_velocity)
}

/// Mean v_x, v_y, ω_z of some samples, base frame.
pub(crate) fn mean_velocity(samples: &[Sample]) -> [f64; 3] {
    let sum = |axis: usize| samples.iter().map(|s| f64::from(s.velocity[axis])).sum::<f64>();
    [0, 1, 2].map(|axis| sum(axis) / samples.len() as f64)
}

/// Hand-made trajectories for the measures' tests.
#[cfg(test)]
pub(crate) mod by_hand {
    use super::*;

    /// `count` samples, the velocity a function of the time at the step's end, integrated to positions; the command is
    /// that same velocity.
    pub(crate) fn drive(count: usize, velocity: impl Fn(f64) -> [f64; 3]) -> Vec<Sample> {
        let (mut position, mut yaw) = ([0.0, 0.0], 0.0_f64);
        (0..count)
            .map(|step| {
                let [v_x, v_y, w] = velocity((step + 1) as f64 * STEP_S);
                position[0] += (v_x * yaw.cos() - v_y * yaw.sin()) * STEP_S;
                position[1] += (v_x * yaw.sin() + v_y * yaw.cos()) * STEP_S;
                yaw += w * STEP_S;
                let velocity = [v_x, v_y, w].map(|v| v as f32);
                let position = position.map(|p| p as f32);
                Sample { velocity, position, yaw: yaw as f32, command: velocity, ..Sample::default() }
            })
            .collect()
    }
}
