//! The locomotion and guidance environments.

pub mod archive;
pub mod bounds;
#[cfg(test)]
mod falls;
pub mod guidance;
pub mod locomotion;
#[cfg(test)]
mod mirror_image;
#[cfg(test)]
mod non_finite;
pub mod simulation;
#[cfg(test)]
mod truncation;
mod view;

pub use view::{VIEW_FIELDS, View};
