//! The arithmetic everything else stands on: SIMD lanes, vectors, rotations, rigid-body inertias and
//! counter-based random streams.
//!
//! Every type is generic over [`Lane`]: `f64` is the plain reference, [`lane::f32x16`] carries sixteen
//! environments at once. Quantities are SI; the caller names the frame.

pub mod inertia;
pub mod lane;
pub mod matrix;
pub mod quaternion;
pub mod random;
pub mod vector;

pub use inertia::Inertia;
pub use lane::{Lane, Mask, f32x16};
pub use matrix::Mat3;
pub use quaternion::Quat;
pub use random::{Philox, Purpose};
pub use vector::Vec3;
