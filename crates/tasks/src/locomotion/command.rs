//! The velocities a robot is asked for.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::Philox;

use crate::bounds::{ordered_within, within};

/// How velocity commands are drawn.
///
/// Drawn directly, without Isaac Lab's heading mode: the supervisor commands yaw rates, and needs standing and turning on
/// the spot far more often than uniform draws give.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CommandConfig {
    /// Forward velocity, ± \[m/s; 0 to 10\]. Source: ours, 1.2, what a supervisor may command; the paper and Isaac Lab: 1.
    pub forward_mps: f32,
    /// Sideways velocity, ± \[m/s; 0 to 10\]. Source: ours, as forward; Isaac Lab: 1.
    pub sideways_mps: f32,
    /// Yaw rate, ± \[rad/s; 0 to 10\]. Source: ours, 1.75, a little more than a supervisor may command; Isaac Lab: 1.
    pub yaw_rate_radps: f32,
    /// Share of commands to stand still; the shares add up to at most 1 \[1; 0 to 1\]. Source: ours, a guide dog often
    /// stands; Isaac Lab: 0.02.
    pub standing_share: f32,
    /// A command below this along all axes means to stand still, and commands to stand are drawn within it: a supervisor's
    /// zero is never exact, and a robot that follows it to the letter creeps \[m/s and rad/s; 0 to 10\]. Source:
    /// docs/findings.md, "A dead zone".
    pub standing_below: f32,
    /// Share of commands to turn on the spot \[1; 0 to 1\]. Source: ours, Table II of the paper asks for it and it is learned
    /// last.
    pub spinning_share: f32,
    /// Share of commands as a supervisor gives them while walking: forward 0 to the limit, turning, not sideways \[1; 0 to
    /// 1\]. Source: ours.
    pub guiding_share: f32,
    /// Time between commands, from and to \[s; 0.02 to 1000\]. Source: ours; Isaac Lab: 10.
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
        within("command.forward_mps", self.forward_mps, 0.0, 10.0)?;
        within("command.sideways_mps", self.sideways_mps, 0.0, 10.0)?;
        within("command.yaw_rate_radps", self.yaw_rate_radps, 0.0, 10.0)?;
        within("command.standing_share", self.standing_share, 0.0, 1.0)?;
        within("command.standing_below", self.standing_below, 0.0, 10.0)?;
        within("command.spinning_share", self.spinning_share, 0.0, 1.0)?;
        within("command.guiding_share", self.guiding_share, 0.0, 1.0)?;
        let shares = self.standing_share + self.spinning_share + self.guiding_share;
        if shares > 1.0 {
            return Err(format!("the shares of commands add up to {shares}, must be at most 1"));
        }
        ordered_within("command.period_s", self.period_s, 0.02, 1000.0)
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
