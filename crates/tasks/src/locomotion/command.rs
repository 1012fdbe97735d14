//! The velocities a robot is asked for.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::Philox;

/// How velocity commands are drawn.
///
/// Drawn directly, without Isaac Lab's heading mode: the supervisor commands yaw rates, and needs standing and turning on
/// the spot far more often than uniform draws give.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommandConfig {
    /// Forward velocity, ± \[m/s\]. Source: design.
    pub forward_mps: f32,
    /// Sideways velocity, ± \[m/s\]. Source: design.
    pub sideways_mps: f32,
    /// Yaw rate, ± \[rad/s\]. Source: design.
    pub yaw_rate_radps: f32,
    /// Share of commands to stand still.
    pub standing_share: f32,
    /// A command below this along all axes means to stand still \[m/s and rad/s\], and commands to stand are drawn within it: a
    /// supervisor's zero is never exact, and a robot that follows it to the letter creeps.
    pub standing_below: f32,
    /// Share of commands to turn on the spot.
    pub spinning_share: f32,
    /// Share of commands as a supervisor gives them while walking: forward 0 to the limit, turning, not sideways.
    pub guiding_share: f32,
    /// Time between commands \[s\]. Isaac Lab: 10.
    pub period_s: [f32; 2],
}

impl Default for CommandConfig {
    fn default() -> Self {
        Self {
            forward_mps: 1.2,
            sideways_mps: 1.2,
            yaw_rate_radps: 1.75,
            standing_share: 0.15,
            standing_below: 0.08,
            spinning_share: 0.15,
            guiding_share: 0.25,
            period_s: [4.0, 10.0],
        }
    }
}

impl CommandConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first one out of range.
    pub fn validate(&self) -> Result<(), String> {
        let not_negative = [
            ("forward_mps", self.forward_mps),
            ("sideways_mps", self.sideways_mps),
            ("yaw_rate_radps", self.yaw_rate_radps),
            ("standing_share", self.standing_share),
            ("standing_below", self.standing_below),
            ("spinning_share", self.spinning_share),
            ("guiding_share", self.guiding_share),
        ];
        for (name, value) in not_negative {
            if !(value.is_finite() && value >= 0.0) {
                return Err(format!("command.{name} is {value}, must be 0 or above"));
            }
        }
        let shares = self.standing_share + self.spinning_share + self.guiding_share;
        if shares > 1.0 {
            return Err(format!("the shares of commands add up to {shares}, must be at most 1"));
        }
        let [short, long] = self.period_s;
        if !(short >= 0.02 && long >= short && long.is_finite()) {
            let allowed = "an ordered range from 0.02 on";
            return Err(format!("command.period_s is [{short}, {long}], must be {allowed}"));
        }
        Ok(())
    }

    /// Draws v_x, v_y \[m/s\], ω_z \[rad/s\].
    pub fn draw(&self, random: &mut Philox) -> [f32; 3] {
        let kind = random.uniform01();
        let mut around = |width: f32| random.uniform(-width, width);
        let command = [around(self.forward_mps), around(self.sideways_mps), around(self.yaw_rate_radps)];
        let spinning = self.standing_share + self.spinning_share;
        if kind < self.standing_share {
            [0; 3].map(|_| around(self.standing_below))
        } else if kind < spinning {
            [0.0, 0.0, command[2]]
        } else if kind < spinning + self.guiding_share {
            [command[0].abs(), 0.0, command[2]]
        } else {
            command
        }
    }

    /// What a command means: zero if it is within `standing_below`.
    pub fn meant(&self, command: [f32; 3]) -> [f32; 3] {
        if command.iter().all(|c| c.abs() < self.standing_below) { [0.0; 3] } else { command }
    }
}

#[cfg(test)]
mod tests {
    use spatial::Purpose;

    use super::*;

    #[test]
    fn shares_and_ranges_are_kept() {
        let config = CommandConfig::default();
        let mut random = Philox::new(1, 0, 0, 0, Purpose::Command);
        let commands: Vec<_> = (0..20_000).map(|_| config.draw(&mut random)).collect();
        let share = |test: &dyn Fn(&[f32; 3]) -> bool| {
            commands.iter().filter(|command| test(command)).count() as f32 / commands.len() as f32
        };
        assert!((share(&|c| config.meant(*c) == [0.0; 3]) - 0.15).abs() < 0.01);
        assert!(commands.iter().all(|c| *c != [0.0; 3]));
        assert!((share(&|c| c[0] == 0.0 && c[1] == 0.0 && c[2] != 0.0) - 0.15).abs() < 0.01);
        assert!((share(&|c| c[0] > 0.0 && c[1] == 0.0) - 0.25).abs() < 0.01);
        assert!(commands.iter().all(|c| c[0].abs() <= 1.2 && c[1].abs() <= 1.2 && c[2].abs() <= 1.75));
        assert!(share(&|c| c[2] > 1.5) > 0.04);
    }

    #[test]
    fn shares_beyond_one_are_refused() {
        let config = CommandConfig { standing_share: 0.7, guiding_share: 0.6, ..CommandConfig::default() };
        assert!(config.validate().unwrap_err().contains("must be at most 1"));
    }
}
