//! Batched rigid-body dynamics, actuators, contacts and time stepping.

pub mod block;
pub mod engine;
mod workspace;

pub use block::{Block, Input, Output, Parameters, State};
pub use engine::{Actuator, Config, Engine};
