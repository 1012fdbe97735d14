//! The locomotion and guidance environments.

pub mod archive;
pub mod bounds;
pub mod guidance;
pub mod locomotion;
#[cfg(test)]
mod non_finite;
pub mod simulation;
mod view;

pub use view::{VIEW_FIELDS, View};
