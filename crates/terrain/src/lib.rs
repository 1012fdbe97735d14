//! Height fields, sub-terrains, the level x type grid and surface queries.

pub mod height_field;

pub use height_field::{Cell, HeightField};
