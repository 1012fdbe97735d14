//! The locomotion task: walk as told over rough ground, whatever pulls.

mod command;
mod config;
mod disturbance;
mod environment;
mod ground;
mod mean_error;
mod metrics;
pub mod reward;
mod reward_config;
mod robot_task;
mod task_group;

pub use command::CommandConfig;
pub use config::LocomotionConfig;
pub use disturbance::{Disturbance, DisturbanceConfig};
pub use environment::LocomotionEnv;
pub use ground::{Terrain, TerrainShares};
pub use reward_config::RewardConfig;
pub use robot_task::Way;
