//! Proximal policy optimization with explicit gradients: rollout, advantage, loss, gradient, optimizer, trainer.
//!
//! Knows environments only as [`policy::VecEnv`]. The same seed gives the same bits for any number of threads and
//! across interrupt and resume.

mod adam;
pub mod advantage;
pub mod config;
mod gradient;
mod loss;
mod network;
mod rollout;
mod trainer;

pub use config::{Config, ConfigError};
pub use trainer::{Iteration, TrainError, Trainer};
