//! The state of one robot as a JSON file.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::Result;
use guidedog::error::{BadInput, OrBadInput as _};
use guidedog::physics::{Block, Engine};
use guidedog::robot::RobotModel;
use guidedog::spatial::Vec3;
use serde::Deserialize;

/// What a robot is doing and what is done to it; what is missing is zero.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct StateFile {
    /// World frame \[m\].
    base_position: [f64; 3],
    /// w, x, y, z.
    base_orientation: [f64; 4],
    /// Base frame \[m/s\].
    base_linear_velocity: [f64; 3],
    /// Base frame \[rad/s\].
    base_angular_velocity: [f64; 3],
    /// By joint \[rad or m\].
    joint_position: BTreeMap<String, f64>,
    /// By joint \[rad/s or m/s\].
    joint_velocity: BTreeMap<String, f64>,
    /// By joint \[N m or N\].
    joint_torque: BTreeMap<String, f64>,
    /// On the robot at the hand, heading frame \[N\].
    hand_force: [f64; 3],
    /// At the base origin, heading frame \[N\].
    base_force: [f64; 3],
}

impl Default for StateFile {
    fn default() -> Self {
        Self {
            base_position: [0.0; 3],
            base_orientation: [1.0, 0.0, 0.0, 0.0],
            base_linear_velocity: [0.0; 3],
            base_angular_velocity: [0.0; 3],
            joint_position: BTreeMap::new(),
            joint_velocity: BTreeMap::new(),
            joint_torque: BTreeMap::new(),
            hand_force: [0.0; 3],
            base_force: [0.0; 3],
        }
    }
}

impl StateFile {
    /// Reads a file; everything zero where there is none.
    pub(super) fn load(file: Option<&Path>) -> Result<Self, BadInput> {
        let Some(path) = file else { return Ok(Self::default()) };
        let what = || format!("state {}", path.display());
        let text = std::fs::read_to_string(path).or_bad_input(what)?;
        serde_json::from_str(&text).or_bad_input(what)
    }

    /// Puts the state into a block; returns the torques, one a joint \[N m or N\].
    ///
    /// # Errors
    /// A joint the robot does not have, or a number that cannot be: names it, and what is allowed.
    pub(super) fn apply(&self, engine: &Engine<f64>, block: &mut Block<f64>) -> Result<Vec<f64>, BadInput> {
        self.check()?;
        let length = self.base_orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        block.state.base_position = Vec3::splat(self.base_position);
        block.state.base_orientation.set(0, self.base_orientation.map(|x| x / length));
        block.state.base_linear_velocity = Vec3::splat(self.base_linear_velocity);
        block.state.base_angular_velocity = Vec3::splat(self.base_angular_velocity);
        block.input.hand_force = Vec3::splat(self.hand_force);
        block.input.base_force = Vec3::splat(self.base_force);
        let robot = &engine.robot;
        fill("joint_position", &self.joint_position, robot, &mut block.state.joint_position)?;
        fill("joint_velocity", &self.joint_velocity, robot, &mut block.state.joint_velocity)?;
        let mut torque = vec![0.0; robot.joints.len()];
        fill("joint_torque", &self.joint_torque, robot, &mut torque)?;
        Ok(torque)
    }

    fn check(&self) -> Result<(), BadInput> {
        let length = self.base_orientation.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > 1e-3 {
            let found = format!("state: base_orientation {:?} has length {length:.4}", self.base_orientation);
            return Err(BadInput::new(format!("{found}, must be a unit quaternion w, x, y, z")));
        }
        Ok(())
    }
}

fn fill(
    name: &str,
    values: &BTreeMap<String, f64>,
    robot: &RobotModel,
    out: &mut [f64],
) -> Result<(), BadInput> {
    for (joint, &value) in values {
        out[robot.joint_index(joint).or_bad_input(|| format!("state: {name}"))?] = value;
    }
    Ok(())
}
