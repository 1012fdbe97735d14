//! The locomotion and guidance environments.

pub mod archive;
pub mod locomotion;
pub mod simulation;
