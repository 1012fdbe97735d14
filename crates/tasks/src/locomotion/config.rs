//! Settings of the locomotion task.

use physics::Config as PhysicsConfig;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CommandConfig, DisturbanceConfig, RewardConfig, Terrain, TerrainShares};
use crate::{
    bounds::within,
    simulation::{Randomization, ResetSpread},
};

/// Settings of the locomotion task.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LocomotionConfig {
    /// The ground. Source: Isaac Lab, "rough".
    pub terrain: Terrain,
    /// Highest level robots begin on \[levels; 0 to 9\]. Source: Isaac Lab, 5; lower while robots cannot walk yet.
    pub max_initial_level: usize,
    /// Length of an episode \[s; 0.1 to 1000\]. Source: Isaac Lab, 20.
    pub episode_s: f32,
    /// Scale of the sensors' errors \[1; 0 to 10\]. Source: Isaac Lab, whose errors are 1.
    pub observation_noise: f32,
    /// What the height scan is multiplied with before the first layer \[1/m; 0.1 to 20\]. Source: docs/findings.md, "Scale of the
    /// height scan"; legged_gym: 5, Isaac Lab: 1.
    pub scan_scale: f32,
    /// Penalties and disturbances grow only while the mean of exp(−|e_xy|² / 0.25) over all robots is above this: a robot
    /// that cannot walk yet is not made to stand still by them \[1; 0 to 1\]. Source: docs/findings.md, "Standing trap".
    pub ramp_tracking: f32,
    /// Proportional gain of the joint servos \[N m/rad; 1 to 1000\]. Source: legged_gym, 80; with 40, as in Isaac Lab, no
    /// policy found its first step.
    pub stiffness: f64,
    /// Derivative gain of the joint servos \[N m s/rad; 0 to 100\]. Source: legged_gym, 2; Isaac Lab: 5.
    pub damping: f64,
    /// Velocity commands.
    pub command: CommandConfig,
    /// Disturbances.
    pub disturbance: DisturbanceConfig,
    /// Rewards.
    pub reward: RewardConfig,
    /// Differences between robots.
    pub randomization: Randomization,
    /// First states of episodes.
    pub reset: ResetSpread,
    /// Kinds of rough ground.
    pub terrain_shares: TerrainShares,
}

impl Default for LocomotionConfig {
    fn default() -> Self {
        let actuator = PhysicsConfig::default().actuator;
        Self {
            terrain: Terrain::Rough,
            max_initial_level: 2,
            episode_s: 20.0,
            observation_noise: 1.0,
            scan_scale: 2.0,
            ramp_tracking: 0.6,
            stiffness: actuator.stiffness,
            damping: actuator.damping,
            command: CommandConfig::default(),
            disturbance: DisturbanceConfig::default(),
            reward: RewardConfig::default(),
            randomization: Randomization::default(),
            reset: ResetSpread::default(),
            terrain_shares: TerrainShares::default(),
        }
    }
}

impl LocomotionConfig {
    /// Checks every value.
    ///
    /// # Errors
    /// Names the first one out of range, with what is allowed.
    pub fn validate(&self) -> Result<(), String> {
        within("max_initial_level", self.max_initial_level as f64, 0.0, 9.0)?;
        within("episode_s", f64::from(self.episode_s), 0.1, 1000.0)?;
        within("observation_noise", f64::from(self.observation_noise), 0.0, 10.0)?;
        within("scan_scale", f64::from(self.scan_scale), 0.1, 20.0)?;
        within("ramp_tracking", f64::from(self.ramp_tracking), 0.0, 1.0)?;
        within("stiffness", self.stiffness, 1.0, 1000.0)?;
        within("damping", self.damping, 0.0, 100.0)?;
        self.command.validate()?;
        self.disturbance.validate()?;
        self.reward.validate()?;
        self.randomization.validate()?;
        self.reset.validate()?;
        self.terrain_shares.validate()
    }

    /// Settings of the physics with these gains.
    pub fn physics(&self) -> PhysicsConfig {
        let mut config = PhysicsConfig::default();
        config.actuator.stiffness = self.stiffness;
        config.actuator.damping = self.damping;
        config
    }
}
