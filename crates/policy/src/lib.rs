//! Networks as data: MLP forward, ONNX in and out, checkpoints, the `VecEnv` contract.

pub mod activation;
pub mod environment;
pub mod matmul;
pub mod mlp;

pub use environment::{Mirror, StepBuffers, VecEnv};
pub use mlp::{Activation, ForwardWorkspace, Linear, Mlp, ShapeError};
