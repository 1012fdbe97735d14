//! A multi-layer perceptron as plain data and its forward pass.

/// What follows a hidden layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// `x` above zero, `exp(x) − 1` below.
    Elu,
    /// Hyperbolic tangent.
    Tanh,
    /// `max(x, 0)`.
    Relu,
}

/// One affine layer `y = W x + b`.
#[derive(Clone, Debug, PartialEq)]
pub struct Linear {
    /// Inputs.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Weights, `outputs × inputs`, row-major.
    pub weight: Vec<f32>,
    /// Biases, `outputs`.
    pub bias: Vec<f32>,
}

/// Affine layers with one activation between them, and an optional limit on the output.
///
/// Takes raw observations: every scale and normalizer is folded into the first and last layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Mlp {
    /// At least one layer; each takes what the one before gives.
    pub layers: Vec<Linear>,
    /// Follows every layer but the last.
    pub activation: Activation,
    /// Lower and upper limit of each output, applied after the last layer.
    pub output_limits: Option<(Vec<f32>, Vec<f32>)>,
}
