//! Networks as data: MLP forward, ONNX in and out, checkpoints, the `VecEnv` contract.

pub mod activation;
pub mod checkpoint;
pub mod environment;
pub mod layout;
pub mod matmul;
pub mod mlp;
pub mod onnx;

pub use checkpoint::{Checkpoint, CheckpointError, write_atomic};
pub use environment::{Mirror, Share, StepBuffers, StepRows, VecEnv};
pub use mlp::{Activation, ForwardWorkspace, Linear, Mlp, ShapeError};
pub use onnx::{OnnxError, OnnxPolicy, load_onnx, read_onnx, save_onnx, write_onnx};
