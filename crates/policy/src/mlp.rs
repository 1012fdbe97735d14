//! A multi-layer perceptron as plain data and its forward pass.

use crate::{
    activation::elu_in_place,
    matmul::{MatRef, add_product},
};

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

/// Scratch memory of a forward pass; grows as needed.
#[derive(Clone, Debug, Default)]
pub struct ForwardWorkspace {
    current: Vec<f32>,
    next: Vec<f32>,
}

/// A network whose parts do not fit together.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("layer {layer}: {what} is {found}, must be {allowed}")]
pub struct ShapeError {
    /// Which layer, from 0.
    pub layer: usize,
    /// What does not fit.
    pub what: &'static str,
    /// Its size.
    pub found: String,
    /// What would do.
    pub allowed: String,
}

impl Mlp {
    /// Width of an input.
    pub fn inputs(&self) -> usize {
        self.layers.first().map_or(0, |layer| layer.inputs)
    }

    /// Width of an output.
    pub fn outputs(&self) -> usize {
        self.layers.last().map_or(0, |layer| layer.outputs)
    }

    /// Weights and biases of all layers.
    pub fn num_parameters(&self) -> usize {
        self.layers.iter().map(Linear::num_parameters).sum()
    }

    /// Checks that the layers fit together and hold finite numbers.
    ///
    /// # Errors
    /// The first layer that does not.
    pub fn validate(&self) -> Result<(), ShapeError> {
        let refuse =
            |layer, what, found: String, allowed: String| Err(ShapeError { layer, what, found, allowed });
        if self.layers.is_empty() {
            return refuse(0, "number of layers", "0".into(), "at least 1".into());
        }
        let mut width = self.inputs();
        for (i, layer) in self.layers.iter().enumerate() {
            if layer.inputs != width || width == 0 || layer.outputs == 0 {
                let found = format!("{} → {}", layer.inputs, layer.outputs);
                return refuse(i, "shape", found, format!("{} → at least 1", width.max(1)));
            }
            if layer.weight.len() != layer.inputs * layer.outputs || layer.bias.len() != layer.outputs {
                let found = format!("{} weights, {} biases", layer.weight.len(), layer.bias.len());
                let allowed = format!("{} and {}", layer.inputs * layer.outputs, layer.outputs);
                return refuse(i, "size", found, allowed);
            }
            if let Some(bad) = layer.weight.iter().chain(&layer.bias).find(|x| !x.is_finite()) {
                return refuse(i, "a weight", bad.to_string(), "finite".into());
            }
            width = layer.outputs;
        }
        if let Some((low, high)) = &self.output_limits {
            let ordered = low.iter().zip(high).all(|(low, high)| low <= high);
            if low.len() != width || high.len() != width || !ordered {
                let found = format!("{low:?} to {high:?}");
                return refuse(
                    self.layers.len() - 1,
                    "output limits",
                    found,
                    format!("{width} ordered pairs"),
                );
            }
        }
        Ok(())
    }

    /// Evaluates `batch` rows of `input` (`batch × inputs`) into `output` (`batch × outputs`).
    ///
    /// # Panics
    /// If a buffer is too short.
    pub fn forward(&self, batch: usize, input: &[f32], output: &mut [f32], workspace: &mut ForwardWorkspace) {
        let ForwardWorkspace { current, next } = workspace;
        let (last, hidden) = self.layers.split_last().expect("a network has layers");
        for (i, layer) in hidden.iter().enumerate() {
            next.resize(batch * layer.outputs, 0.0);
            layer.forward(batch, if i == 0 { input } else { current }, next);
            self.activation.apply(next);
            std::mem::swap(current, next);
        }
        last.forward(batch, if hidden.is_empty() { input } else { current }, output);
        if let Some((low, high)) = &self.output_limits {
            for row in output[..batch * last.outputs].chunks_exact_mut(last.outputs) {
                for ((y, low), high) in row.iter_mut().zip(low).zip(high) {
                    *y = y.min(*high).max(*low);
                }
            }
        }
    }
}

impl Linear {
    /// Weights and biases.
    pub fn num_parameters(&self) -> usize {
        self.weight.len() + self.bias.len()
    }

    /// `y = W x + b` for `batch` rows.
    ///
    /// # Panics
    /// If a buffer is too short.
    pub fn forward(&self, batch: usize, input: &[f32], output: &mut [f32]) {
        let output = &mut output[..batch * self.outputs];
        for row in output.chunks_exact_mut(self.outputs) {
            row.copy_from_slice(&self.bias);
        }
        let x = MatRef::new(input, batch, self.inputs);
        let w = MatRef::new(&self.weight, self.outputs, self.inputs);
        add_product(x, w.transposed(), output);
    }
}

impl Activation {
    /// Applies the function to every value.
    pub fn apply(self, values: &mut [f32]) {
        match self {
            Self::Elu => elu_in_place(values),
            Self::Tanh => values.iter_mut().for_each(|x| *x = x.tanh()),
            Self::Relu => values.iter_mut().for_each(|x| *x = x.max(0.0)),
        }
    }
}

#[cfg(test)]
mod tests {
    use spatial::{Philox, Purpose};

    use super::*;

    /// A network of the given widths with weights of about 1/√inputs.
    fn network(widths: &[usize], activation: Activation) -> Mlp {
        let mut random = Philox::new(3, 0, 0, 0, Purpose::Evaluation);
        let layers = widths
            .windows(2)
            .map(|w| {
                let bound = 1.0 / (w[0] as f32).sqrt();
                Linear {
                    inputs: w[0],
                    outputs: w[1],
                    weight: (0..w[0] * w[1]).map(|_| random.uniform(-bound, bound)).collect(),
                    bias: (0..w[1]).map(|_| random.uniform(-bound, bound)).collect(),
                }
            })
            .collect();
        Mlp { layers, activation, output_limits: None }
    }

    fn reference(mlp: &Mlp, input: &[f32]) -> Vec<f64> {
        let mut x: Vec<f64> = input.iter().map(|&x| f64::from(x)).collect();
        for (i, layer) in mlp.layers.iter().enumerate() {
            x = (0..layer.outputs)
                .map(|o| {
                    let row = &layer.weight[o * layer.inputs..][..layer.inputs];
                    let sum: f64 = row.iter().zip(&x).map(|(&w, x)| f64::from(w) * x).sum();
                    let y = sum + f64::from(layer.bias[o]);
                    match mlp.activation {
                        _ if i + 1 == mlp.layers.len() => y,
                        Activation::Elu => {
                            if y > 0.0 {
                                y
                            } else {
                                y.exp_m1()
                            }
                        }
                        Activation::Tanh => y.tanh(),
                        Activation::Relu => y.max(0.0),
                    }
                })
                .collect();
        }
        x
    }

    #[test]
    fn forward_matches_the_definition() {
        for activation in [Activation::Elu, Activation::Tanh, Activation::Relu] {
            let mlp = network(&[37, 64, 32, 5], activation);
            mlp.validate().unwrap();
            let input: Vec<f32> = (0..37 * 9).map(|i| (i as f32 * 0.7).sin() * 2.0).collect();
            let mut output = vec![0.0; 5 * 9];
            mlp.forward(9, &input, &mut output, &mut ForwardWorkspace::default());
            for (row, x) in output.chunks(5).zip(input.chunks(37)) {
                for (a, b) in row.iter().zip(reference(&mlp, x)) {
                    assert!((f64::from(*a) - b).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn outputs_are_limited_each_by_its_own() {
        let mut mlp = network(&[4, 8, 2], Activation::Elu);
        mlp.layers[1].bias = vec![5.0, -5.0];
        mlp.output_limits = Some((vec![-1.0, -2.0], vec![1.0, 2.0]));
        let mut output = [0.0; 2];
        mlp.forward(1, &[0.0; 4], &mut output, &mut ForwardWorkspace::default());
        assert_eq!(output, [1.0, -2.0]);
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let mut mlp = network(&[4, 8, 2], Activation::Elu);
        mlp.layers[1].inputs = 7;
        let message = mlp.validate().unwrap_err().to_string();
        assert!(message.contains("layer 1") && message.contains("7 → 2"), "{message}");
    }
}
