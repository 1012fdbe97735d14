//! The handler's pulls in training: constant in the heading frame, drawn at the start and every few seconds.
//!
//! Defaults go beyond the paper's: pushes, stronger pulls, and many on both sides of the thresholds of Table II, which are steps
//! that a network learns only where it sees them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::Philox;

use super::behavior::{PULL_THRESHOLD_X_N, PULL_THRESHOLD_Y_N};
use crate::bounds::{ordered_within, within};

/// Ranges of the pulls, heading frame.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PullConfig {
    /// Along x, from and to: below zero pulls back \[N; -500 to 500\]. Source: docs/findings.md, "Thresholds"; the paper: −80
    /// to 0.
    pub x_n: [f32; 2],
    /// Along y, from and to: above zero pulls left \[N; -500 to 500\]. Source: docs/findings.md, "Thresholds"; the paper: ±40.
    pub y_n: [f32; 2],
    /// Along z, from and to: above zero lifts \[N; -500 to 500\]. Source: the paper, ±20.
    pub z_n: [f32; 2],
    /// Share of pulls that are near a threshold along x or along y \[1; 0 to 1\]. Source: docs/findings.md, "Thresholds"; the
    /// paper: 0.
    pub near_threshold_share: f32,
    /// How near a threshold the pulls of `near_threshold_share` are, ± \[N; 0 to 20\]. Source: docs/findings.md, "Thresholds".
    pub near_threshold_n: f32,
    /// Time between two draws; where pulls change more often, what the robot does already says less of what it is to do \[s; 0.1 to
    /// 1000\]. Source: docs/findings.md, "Thresholds"; the paper: 5.
    pub period_s: f32,
    /// Error of the observed force along x, y and z, uniform, ±; drawn at every supervisor step \[N; 0 to 100\]. Source:
    /// docs/findings.md, "Thresholds"; the paper: 0.
    pub noise_n: [f32; 3],
}

impl Default for PullConfig {
    fn default() -> Self {
        Self {
            x_n: [-120.0, 60.0],
            y_n: [-60.0, 60.0],
            z_n: [-20.0, 20.0],
            near_threshold_share: 0.8,
            near_threshold_n: 4.0,
            period_s: 2.5,
            noise_n: [0.0, 2.0, 0.0],
        }
    }
}

impl PullConfig {
    /// The paper's pulls.
    pub fn paper() -> Self {
        Self {
            x_n: [-80.0, 0.0],
            y_n: [-40.0, 40.0],
            near_threshold_share: 0.0,
            period_s: 5.0,
            noise_n: [0.0; 3],
            ..Self::default()
        }
    }

    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first value that is out of range, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        ordered_within("pull.x_n", self.x_n, -500.0, 500.0)?;
        ordered_within("pull.y_n", self.y_n, -500.0, 500.0)?;
        ordered_within("pull.z_n", self.z_n, -500.0, 500.0)?;
        within("pull.near_threshold_share", self.near_threshold_share, 0.0, 1.0)?;
        within("pull.near_threshold_n", self.near_threshold_n, 0.0, 20.0)?;
        within("pull.period_s", self.period_s, 0.1, 1000.0)?;
        self.noise_n.iter().try_for_each(|&noise| within("pull.noise_n", noise, 0.0, 100.0))
    }

    /// Draws a force \[N\].
    pub fn draw(&self, random: &mut Philox) -> [f32; 3] {
        let [mut x, mut y, z] = [self.x_n, self.y_n, self.z_n].map(|[low, high]| random.uniform(low, high));
        if random.uniform01() < self.near_threshold_share {
            let near = random.uniform(-self.near_threshold_n, self.near_threshold_n);
            if random.below(2) == 0 {
                x = near - PULL_THRESHOLD_X_N;
            } else {
                y = (PULL_THRESHOLD_Y_N + near).copysign(y);
            }
        }
        [x, y, z]
    }
}

/// What a sensor that errs by up to ±`noise_n` along each axis makes of a force \[N\].
pub fn sensed_force(force: [f32; 3], noise_n: [f32; 3], random: &mut Philox) -> [f32; 3] {
    let mut sensed = force;
    for (sensed, noise) in sensed.iter_mut().zip(noise_n) {
        if noise > 0.0 {
            *sensed += random.uniform(-noise, noise);
        }
    }
    sensed
}

#[cfg(test)]
mod tests {
    use spatial::Purpose;

    use super::*;
    use crate::guidance::Behavior;

    fn draw_many(config: &PullConfig) -> Vec<[f32; 3]> {
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Command);
        (0..40_000).map(|_| config.draw(&mut random)).collect()
    }

    #[test]
    fn as_many_as_asked_for_are_near_a_threshold_and_on_both_sides_of_it() {
        let config = PullConfig { near_threshold_share: 0.5, near_threshold_n: 1.0, ..PullConfig::default() };
        let share = |test: &dyn Fn(&[f32; 3]) -> bool| {
            draw_many(&config).iter().filter(|force| test(force)).count() as f32 / 40_000.0
        };
        // And those that come near by themselves: 2 N of 180 along x, 4 of 120 along y.
        assert!((share(&|f| (f[0] + 40.0).abs() <= 1.0) - (0.25 + 0.75 / 90.0)).abs() < 0.01);
        assert!((share(&|f| (f[1].abs() - 20.0).abs() <= 1.0) - (0.25 + 0.75 / 30.0)).abs() < 0.01);
        for side in [-1.0, 1.0] {
            assert!(share(&|f| f[1] * side > 20.0 && f[1] * side < 21.0) > 0.05);
            assert!(share(&|f| f[1] * side < 20.0 && f[1] * side > 19.0) > 0.05);
        }
    }

    #[test]
    fn the_papers_ranges_make_every_behavior_a_quarter() {
        let drawn = draw_many(&PullConfig::paper());
        for behavior in Behavior::ALL {
            let count = drawn.iter().filter(|force| Behavior::of_force(**force) == behavior).count();
            assert!((count as f32 / 40_000.0 - 0.25).abs() < 0.01, "{behavior}: {count}");
        }
        assert!(
            drawn.iter().all(|f| f[0] <= 0.0 && f[0] >= -80.0 && f[1].abs() <= 40.0 && f[2].abs() <= 20.0)
        );
    }

    #[test]
    fn the_sensor_errs_along_each_axis_as_told() {
        let mut random = Philox::new(1, 0, 0, 0, Purpose::SupervisorObservation);
        let mut most = [0.0_f32; 3];
        for _ in 0..1000 {
            let seen = sensed_force([-40.0, 20.0, 5.0], [0.5, 2.0, 0.0], &mut random);
            for (most, (seen, real)) in most.iter_mut().zip(seen.iter().zip([-40.0, 20.0, 5.0])) {
                *most = most.max((seen - real).abs());
            }
        }
        assert!(
            (0.45..=0.5).contains(&most[0]) && (1.9..=2.0).contains(&most[1]) && most[2] == 0.0,
            "{most:?}"
        );
    }

    #[test]
    fn a_range_out_of_order_is_named() {
        let config = PullConfig { y_n: [40.0, -40.0], ..PullConfig::default() };
        assert!(config.validate().unwrap_err().contains("pull.y_n is [40, -40]"));
    }
}
