//! Proximal policy optimization with explicit gradients: rollout, advantage, loss, gradient, optimizer, trainer.
//!
//! Knows environments only as [`policy::VecEnv`]. The same seed gives the same bits for any number of threads and
//! across interrupt and resume.

mod adam;
pub mod advantage;
#[cfg(target_arch = "x86_64")]
mod brain;
pub mod config;
mod gradient;
mod loss;
mod network;
mod operations;
mod panels;
#[cfg(test)]
mod pytorch;
mod rollout;
mod trainer;

pub use config::{Config, ConfigError, Precision};
pub use trainer::{Iteration, TrainError, Trainer};
