//! The trainable multi-layer perceptron: forward with activations kept, and backward.
//!
//! Parameters live in one flat vector (per layer the weights `outputs × inputs`, then the biases), gradients in another of
//! the same layout.

use policy::{
    Activation, Linear, Mlp,
    activation::{elu_in_place, elu_slope},
    matmul::{Into, MatRef, matmul},
};
use spatial::{Philox, Purpose};

/// Widths from input to output; ELU between the layers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Architecture {
    widths: Vec<usize>,
}

/// Rows of activations of every layer, and of their gradients.
#[derive(Clone, Debug)]
pub(crate) struct Activations {
    /// `values[0]` is the input; one buffer a layer, `rows × width`.
    pub(crate) values: Vec<Vec<f32>>,
    /// Gradient of the loss with respect to `values`, from index 1 on; before the activation function.
    pub(crate) gradients: Vec<Vec<f32>>,
}

impl Architecture {
    pub(crate) fn new(inputs: usize, hidden: &[usize], outputs: usize) -> Self {
        let mut widths = vec![inputs];
        widths.extend_from_slice(hidden);
        widths.push(outputs);
        Self { widths }
    }

    pub(crate) fn num_parameters(&self) -> usize {
        self.widths.windows(2).map(|w| (w[0] + 1) * w[1]).sum()
    }

    /// Buffers for up to `rows` rows.
    pub(crate) fn activations(&self, rows: usize) -> Activations {
        let buffers = |widths: &[usize]| widths.iter().map(|width| vec![0.0; rows * width]).collect();
        Activations { values: buffers(&self.widths), gradients: buffers(&self.widths) }
    }

    /// Uniform weights and biases within ±1/√inputs of their layer (PyTorch's default for linear layers).
    pub(crate) fn initialize(&self, seed: u64, stream: usize, parameters: &mut [f32]) {
        let mut random = Philox::new(seed, stream, 0, 0, Purpose::Weights);
        let mut rest = parameters;
        for w in self.widths.windows(2) {
            let (layer, next) = rest.split_at_mut((w[0] + 1) * w[1]);
            let bound = 1.0 / (w[0] as f32).sqrt();
            layer.fill_with(|| random.uniform(-bound, bound));
            rest = next;
        }
    }

    /// Evaluates the first `rows` rows of `activations.values[0]`; the result is in the last buffer.
    pub(crate) fn forward(&self, parameters: &[f32], rows: usize, activations: &mut Activations) {
        let mut rest = parameters;
        let layers = self.widths.len() - 1;
        for (layer, w) in self.widths.windows(2).enumerate() {
            let (weight, after) = rest.split_at(w[0] * w[1]);
            let (bias, after) = after.split_at(w[1]);
            rest = after;
            let (before, after) = activations.values.split_at_mut(layer + 1);
            let output = &mut after[0][..rows * w[1]];
            for row in output.chunks_exact_mut(w[1]) {
                row.copy_from_slice(bias);
            }
            let x = MatRef::new(&before[layer], rows, w[0]);
            let weight = MatRef::new(weight, w[1], w[0]);
            matmul(x, weight.transposed(), Into::Accumulate, output);
            if layer + 1 < layers {
                elu_in_place(output);
            }
        }
    }

    /// Adds to `gradient` the parameters' gradient, given that of the output in the last of
    /// `activations.gradients`, for the rows of the last forward pass.
    pub(crate) fn backward(
        &self,
        parameters: &[f32],
        rows: usize,
        activations: &mut Activations,
        gradient: &mut [f32],
    ) {
        let mut end = self.num_parameters();
        for layer in (0..self.widths.len() - 1).rev() {
            let (inputs, outputs) = (self.widths[layer], self.widths[layer + 1]);
            let start = end - (inputs + 1) * outputs;
            let (weight_gradient, bias_gradient) = gradient[start..end].split_at_mut(inputs * outputs);
            let (before, after) = activations.gradients.split_at_mut(layer + 1);
            let delta = &after[0][..rows * outputs];
            for row in delta.chunks_exact(outputs) {
                for (sum, value) in bias_gradient.iter_mut().zip(row) {
                    *sum += value;
                }
            }
            let delta = MatRef::new(delta, rows, outputs);
            let x = MatRef::new(&activations.values[layer], rows, inputs);
            matmul(delta.transposed(), x, Into::Accumulate, weight_gradient);
            if layer > 0 {
                let weight = MatRef::new(&parameters[start..], outputs, inputs);
                let back = &mut before[layer][..rows * inputs];
                matmul(delta, weight, Into::Replace, back);
                for (gradient, &value) in back.iter_mut().zip(&activations.values[layer]) {
                    *gradient *= elu_slope(value);
                }
            }
            end = start;
        }
    }

    /// Takes the weights of a network that [`Architecture::to_mlp`] might have given.
    ///
    /// # Errors
    /// Says in which layer its shape differs, or that its activation does.
    pub(crate) fn read_mlp(
        &self,
        mlp: &Mlp,
        input_scale: &[f32],
        parameters: &mut [f32],
    ) -> Result<(), String> {
        if mlp.activation != Activation::Elu || mlp.layers.len() != self.widths.len() - 1 {
            let (found, allowed) = (mlp.layers.len(), self.widths.len() - 1);
            return Err(format!("{found} layers and {:?}, must be {allowed} layers and Elu", mlp.activation));
        }
        let mut rest = parameters;
        for (i, (layer, w)) in mlp.layers.iter().zip(self.widths.windows(2)).enumerate() {
            if (layer.inputs, layer.outputs) != (w[0], w[1]) {
                let (inputs, outputs) = (layer.inputs, layer.outputs);
                return Err(format!("layer {i} is {inputs} to {outputs}, must be {} to {}", w[0], w[1]));
            }
            let (weight, after) = rest.split_at_mut(w[0] * w[1]);
            let (bias, after) = after.split_at_mut(w[1]);
            rest = after;
            weight.copy_from_slice(&layer.weight);
            bias.copy_from_slice(&layer.bias);
            if i == 0 {
                for row in weight.chunks_exact_mut(w[0]) {
                    row.iter_mut().zip(input_scale).for_each(|(weight, scale)| *weight /= scale);
                }
            }
        }
        Ok(())
    }

    /// The network as data, its input multiplied by `input_scale` first.
    pub(crate) fn to_mlp(&self, parameters: &[f32], input_scale: &[f32]) -> Mlp {
        let mut rest = parameters;
        let mut layers = Vec::new();
        for w in self.widths.windows(2) {
            let (weight, after) = rest.split_at(w[0] * w[1]);
            let (bias, after) = after.split_at(w[1]);
            rest = after;
            let (weight, bias) = (weight.to_vec(), bias.to_vec());
            layers.push(Linear { inputs: w[0], outputs: w[1], weight, bias });
        }
        for row in layers[0].weight.chunks_exact_mut(self.widths[0]) {
            for (weight, scale) in row.iter_mut().zip(input_scale) {
                *weight *= scale;
            }
        }
        Mlp { layers, activation: Activation::Elu, output_limits: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_go_out_and_come_back() {
        let network = Architecture::new(3, &[4], 2);
        let mut parameters = vec![0.0; network.num_parameters()];
        network.initialize(1, 0, &mut parameters);
        let scale = [2.0, 0.25, 4.0];
        let mlp = network.to_mlp(&parameters, &scale);
        let mut back = vec![0.0; parameters.len()];
        network.read_mlp(&mlp, &scale, &mut back).unwrap();
        assert_eq!(back, parameters);
        let wider = Architecture::new(3, &[5], 2);
        let message = wider.read_mlp(&mlp, &scale, &mut vec![0.0; 100]).unwrap_err();
        assert_eq!(message, "layer 0 is 3 to 4, must be 3 to 5");
    }

    #[test]
    fn backward_is_the_derivative_of_forward() {
        let network = Architecture::new(5, &[7, 6], 3);
        let mut parameters = vec![0.0; network.num_parameters()];
        network.initialize(1, 0, &mut parameters);
        let rows = 4;
        let input: Vec<f32> = (0..rows * 5).map(|i| (i as f32).sin()).collect();
        let weights: Vec<f32> = (0..rows * 3).map(|i| (i as f32 * 1.3).cos()).collect();
        // The loss is a weighted sum of the outputs, so its gradient with respect to them is the weights.
        let loss = |parameters: &[f32]| {
            let mut activations = network.activations(rows);
            activations.values[0].copy_from_slice(&input);
            network.forward(parameters, rows, &mut activations);
            activations.values[3].iter().zip(&weights).map(|(y, w)| f64::from(y * w)).sum::<f64>()
        };
        let mut activations = network.activations(rows);
        activations.values[0].copy_from_slice(&input);
        network.forward(&parameters, rows, &mut activations);
        activations.gradients[3].copy_from_slice(&weights);
        let mut gradient = vec![0.0; parameters.len()];
        network.backward(&parameters, rows, &mut activations, &mut gradient);
        for i in 0..parameters.len() {
            let mut moved = parameters.clone();
            moved[i] += 1e-2;
            let above = loss(&moved);
            moved[i] -= 2e-2;
            let difference = (above - loss(&moved)) / 2e-2;
            assert!((f64::from(gradient[i]) - difference).abs() < 2e-3, "parameter {i}");
        }
    }
}
