//! Batched rigid-body dynamics of legged robots: actuators, contacts with the ground, time stepping.
//!
//! A [`Block`] steps as many robots as its lane type is wide; everything they share is in an [`Engine`]. Kernels
//! are written once over [`spatial::Lane`]: sixteen `f32` lanes to learn with, `f64` as their reference.

mod actuator;
mod bias;
pub mod block;
mod contact;
mod diagnostics;
pub mod engine;
mod ground;
mod joint_limit;
mod kinematics;
mod mass_matrix;
mod step;
mod structure;
mod workspace;

pub use block::{Block, Input, Output, Parameters, State};
pub use engine::{Actuator, Config, Engine};
