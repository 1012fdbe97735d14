//! Where an episode begins.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spatial::{Philox, Quat};
use terrain::HeightField;

use super::{Group, Simulation};
use crate::bounds::{ordered_within, within};

/// How far the first state of an episode may be from standing still at the spawn point.
///
/// Defaults: Isaac Lab's velocity task (`velocity_env_cfg.py`, events).
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ResetSpread {
    /// Position along x and y, ± \[m; 0 to 100\]. Source: Isaac Lab, 0.5.
    pub position_m: f32,
    /// Heading, ± \[rad; 0 to 3.1415927\]. Source: Isaac Lab, π.
    pub yaw_rad: f32,
    /// Linear velocity along every axis, ± \[m/s; 0 to 10\]. Source: Isaac Lab, 0.5.
    pub linear_velocity_mps: f32,
    /// Angular velocity about every axis, ± \[rad/s; 0 to 10\]. Source: Isaac Lab, 0.5.
    pub angular_velocity_radps: f32,
    /// Joint positions are the default ones times a factor from this range \[1; 0 to 10\]. Source: Isaac Lab, 0.5 to 1.5.
    pub joint_scale: [f32; 2],
}

impl Default for ResetSpread {
    fn default() -> Self {
        Self {
            position_m: 0.5,
            yaw_rad: std::f32::consts::PI,
            linear_velocity_mps: 0.5,
            angular_velocity_radps: 0.5,
            joint_scale: [0.5, 1.5],
        }
    }
}

impl ResetSpread {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first one out of range.
    pub fn validate(&self) -> Result<(), String> {
        within("reset.position_m", self.position_m, 0.0, 100.0)?;
        within("reset.yaw_rad", self.yaw_rad, 0.0, std::f32::consts::PI)?;
        within("reset.linear_velocity_mps", self.linear_velocity_mps, 0.0, 10.0)?;
        within("reset.angular_velocity_radps", self.angular_velocity_radps, 0.0, 10.0)?;
        ordered_within("reset.joint_scale", self.joint_scale, 0.0, 10.0)
    }

    /// Standing still in the default pose, any heading.
    pub fn standing() -> Self {
        Self {
            position_m: 0.5,
            linear_velocity_mps: 0.0,
            angular_velocity_radps: 0.0,
            joint_scale: [1.0, 1.0],
            ..Self::default()
        }
    }
}

/// Height of the base above the ground at the start \[m\]. Source: Isaac Lab, ANYmal D's initial state.
const SPAWN_HEIGHT: f32 = 0.6;

impl Simulation {
    /// Puts a robot at a spawn point \[m\], the rest drawn from `random`; forces end, memory is lost.
    pub fn reset(
        &self,
        group: &mut Group,
        lane: usize,
        spawn: [f32; 3],
        spread: &ResetSpread,
        random: &mut Philox,
    ) {
        let mut around = |width: f32| random.uniform(-width, width);
        let (x, y) = (spawn[0] + around(spread.position_m), spawn[1] + around(spread.position_m));
        let yaw = around(spread.yaw_rad);
        let mut velocity = || std::array::from_fn(|_| f64::from(around(spread.linear_velocity_mps)));
        let linear = velocity();
        let angular = std::array::from_fn(|_| f64::from(around(spread.angular_velocity_radps)));
        let state = &mut group.block.state;
        let z = highest_ground(self.engine.terrain(), x, y) + SPAWN_HEIGHT;
        state.base_position.set(lane, [f64::from(x), f64::from(y), f64::from(z)]);
        let attitude = Quat::from_roll_pitch_yaw(0.0, 0.0, f64::from(yaw));
        state.base_orientation.set(lane, [attitude.w, attitude.x, attitude.y, attitude.z]);
        state.base_linear_velocity.set(lane, linear);
        state.base_angular_velocity.set(lane, angular);
        for (j, joint) in self.engine.robot.joints.iter().enumerate() {
            let [low, high] = spread.joint_scale;
            let (lower, upper) = joint.position_limits;
            let position = self.default_joint_position[j] * random.uniform(low, high);
            state.joint_position[j].as_mut_array()[lane] = position.clamp(lower as f32, upper as f32);
            state.joint_velocity[j].as_mut_array()[lane] = 0.0;
            group.block.output.joint_torque[j].as_mut_array()[lane] = 0.0;
        }
        group.block.input.hand_force.set(lane, [0.0; 3]);
        group.block.input.base_force.set(lane, [0.0; 3]);
        group.block.forget_contacts(lane);
        group.contacts.forget(lane);
    }
}

/// Highest ground under the robot's footprint \[m\]: no foot begins inside a step.
fn highest_ground(ground: &HeightField, x: f32, y: f32) -> f32 {
    let mut highest = f32::MIN;
    for i in -3..=3 {
        for j in -2..=2 {
            let reach = 0.2;
            highest = highest.max(ground.height(x + reach * i as f32, y + reach * j as f32));
        }
    }
    highest
}
