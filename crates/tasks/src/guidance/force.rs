//! The handler's pulls in training: constant in the heading frame, drawn at the start and every few seconds.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::Philox;

/// Ranges of the pulls, heading frame. Defaults: the paper's setting.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PullConfig {
    /// Along x: below zero pulls back \[N\].
    pub x_n: [f32; 2],
    /// Along y: above zero pulls left \[N\].
    pub y_n: [f32; 2],
    /// Along z: above zero lifts \[N\].
    pub z_n: [f32; 2],
    /// Time between two draws \[s\].
    pub period_s: f32,
    /// Error of the observed force along each axis, uniform, ± \[N\]; drawn at every supervisor step.
    pub noise_n: f32,
}

impl Default for PullConfig {
    fn default() -> Self {
        Self { x_n: [-80.0, 0.0], y_n: [-40.0, 40.0], z_n: [-20.0, 20.0], period_s: 5.0, noise_n: 0.0 }
    }
}

impl PullConfig {
    /// Checks the ranges.
    ///
    /// # Errors
    /// Names the first value that is out of range, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        for (name, [low, high]) in [("x_n", self.x_n), ("y_n", self.y_n), ("z_n", self.z_n)] {
            if !(low >= -500.0 && high >= low && high <= 500.0) {
                return Err(format!(
                    "pull.{name} is [{low}, {high}], must be an ordered range within [-500, 500]"
                ));
            }
        }
        if !(0.1..=1000.0).contains(&self.period_s) {
            return Err(format!("pull.period_s is {}, must be from 0.1 to 1000", self.period_s));
        }
        if !(0.0..=100.0).contains(&self.noise_n) {
            return Err(format!("pull.noise_n is {}, must be from 0 to 100", self.noise_n));
        }
        Ok(())
    }

    /// Draws a force \[N\].
    pub fn draw(&self, random: &mut Philox) -> [f32; 3] {
        [self.x_n, self.y_n, self.z_n].map(|[low, high]| random.uniform(low, high))
    }
}

#[cfg(test)]
mod tests {
    use spatial::Purpose;

    use super::*;
    use crate::guidance::Behavior;

    #[test]
    fn the_papers_ranges_make_every_behavior_a_quarter() {
        let config = PullConfig::default();
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Command);
        let drawn: Vec<_> = (0..40_000).map(|_| config.draw(&mut random)).collect();
        for behavior in Behavior::ALL {
            let count = drawn.iter().filter(|force| Behavior::of_force(**force) == behavior).count();
            assert!((count as f32 / 40_000.0 - 0.25).abs() < 0.01, "{behavior}: {count}");
        }
        assert!(
            drawn.iter().all(|f| f[0] <= 0.0 && f[0] >= -80.0 && f[1].abs() <= 40.0 && f[2].abs() <= 20.0)
        );
    }

    #[test]
    fn a_range_out_of_order_is_named() {
        let config = PullConfig { y_n: [40.0, -40.0], ..PullConfig::default() };
        assert!(config.validate().unwrap_err().contains("pull.y_n is [40, -40]"));
    }
}
