//! Proximal policy optimization with explicit gradients: rollout, advantage, loss, gradient, optimizer, trainer.
//!
//! Knows environments only as [`policy::VecEnv`], and other processes only as [`Exchange`]. The same seed gives the same bits for
//! any number of threads and ranks, and across interrupt and resume.

mod adam;
mod advantage;
#[cfg(target_arch = "x86_64")]
mod brain;
pub mod config;
mod deal;
pub mod exchange;
mod gradient;
mod loss;
mod network;
mod operations;
mod panels;
mod partials;
#[cfg(test)]
mod pytorch;
mod quiet;
mod rollout;
mod rounded;
mod slot;
mod symmetry;
mod team;
mod trainer;

pub use config::{Config, ConfigError, Precision, SymmetryBy};
pub use exchange::{Exchange, RankError};
pub use trainer::{Iteration, TrainError, Trainer};
