//! Networks as data: MLP forward, Gaussian distribution, ONNX in and out, checkpoints, the VecEnv contract.

pub mod environment;
pub mod mlp;

pub use environment::{Mirror, StepBuffers, VecEnv};
pub use mlp::{Activation, Linear, Mlp};
