//! guidedog: a robotic guide dog that understands the pull of a hand on its harness.
//!
//! This library is the door to the crates behind the program, and what its verbs share: run folders, metrics,
//! layered configuration, progress.

pub mod config;
pub mod error;
pub mod everything;
pub mod interrupt;
pub mod judging;
pub mod learner;
pub mod machine;
pub mod metrics;
pub mod plots;
pub mod policies;
pub mod progress;
pub mod ranks;
pub mod result_tables;
pub mod run_config;
pub mod run_folder;
pub mod say;
pub mod server;
pub mod session;
pub mod stages;
pub mod tensorboard;
pub mod time_to_quality;
pub mod training;
pub mod watch;

pub use {evaluation, physics, policy, ppo, robot, spatial, tasks, terrain};
