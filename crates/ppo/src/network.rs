//! The trainable multi-layer perceptron: forward with activations kept, and backward.
//!
//! Parameters live in one flat vector (per layer the weights `outputs × inputs`, then the biases), gradients in another of
//! the same layout.

use policy::{
    Activation, Linear, Mlp,
    activation::{elu_in_place, elu_slope},
};
use spatial::{Philox, Purpose};

use crate::panels::{LANES, Precision, Tile, Weights, add_transposed_product, panels_of};

/// Widths from input to output; ELU between the layers.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Architecture {
    widths: Vec<usize>,
}

/// A network's parameters, arranged for products; made anew whenever they change.
#[derive(Clone, Debug)]
pub(crate) struct PackedNetwork<P: Precision> {
    layers: Vec<PackedLayer<P>>,
}

#[derive(Clone, Debug)]
struct PackedLayer<P: Precision> {
    /// `Wᵀ`, for the forward pass.
    forward: Weights<P>,
    /// `W`, for the gradient of the input; empty in the first layer.
    backward: Weights<P>,
    /// Biases by panel.
    bias: Vec<[f32; LANES]>,
}

/// What a forward pass leaves for the backward pass, and the gradients on their way back.
#[derive(Clone, Debug)]
pub(crate) struct Activations<P: Precision> {
    /// Values of the hidden layers.
    hidden: Vec<P::Panels>,
    /// Gradients before the activation functions, of every layer.
    gradients: Vec<P::Panels>,
    /// The last layer's values, `rows × outputs`, row-major.
    pub(crate) output: Vec<f32>,
    /// The gradient of the loss with respect to them.
    pub(crate) output_gradient: Vec<f32>,
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

    pub(crate) fn inputs(&self) -> usize {
        self.widths[0]
    }

    /// Weights (`units × inputs`) and biases of the first layer.
    pub(crate) fn first_layer_mut<'a>(&self, parameters: &'a mut [f32]) -> (&'a mut [f32], &'a mut [f32]) {
        let (weights, rest) = parameters.split_at_mut(self.widths[0] * self.widths[1]);
        (weights, &mut rest[..self.widths[1]])
    }

    /// Appends, for every parameter, where in `images` its mirror image is, and with what sign, given the maps of mirrored inputs and
    /// outputs; hidden units are the mirror images of one another, the first of the last and so on.
    pub(crate) fn append_images(
        &self,
        input: &[(usize, f32)],
        output: &[(usize, f32)],
        images: &mut Vec<(usize, f32)>,
    ) {
        let last = self.widths.len() - 2;
        let hidden = |layer: usize| (0..self.widths[layer]).rev().map(|unit| (unit, 1.0)).collect::<Vec<_>>();
        for (layer, w) in self.widths.windows(2).enumerate() {
            let from = if layer == 0 { input.to_vec() } else { hidden(layer) };
            let to = if layer == last { output.to_vec() } else { hidden(layer + 1) };
            let start = images.len();
            for &(row, row_sign) in &to {
                images.extend(
                    from.iter().map(|&(column, sign)| (start + row * w[0] + column, row_sign * sign)),
                );
            }
            let start = start + w[0] * w[1];
            images.extend(to.iter().map(|&(unit, sign)| (start + unit, sign)));
        }
    }

    fn outputs(&self) -> usize {
        *self.widths.last().expect("a network has an output")
    }

    /// Buffers for up to `rows` rows, a multiple of [`LANES`].
    pub(crate) fn activations<P: Precision>(&self, rows: usize) -> Activations<P> {
        let panels = |widths: &[usize]| widths.iter().map(|&width| P::panels(rows, width)).collect();
        Activations {
            hidden: panels(&self.widths[1..self.widths.len() - 1]),
            gradients: panels(&self.widths[1..]),
            output: vec![0.0; rows * self.outputs()],
            output_gradient: vec![0.0; rows * self.outputs()],
        }
    }

    /// Room for this network's parameters.
    pub(crate) fn packed<P: Precision>(&self) -> PackedNetwork<P> {
        let layer = |(i, w): (usize, &[usize])| PackedLayer {
            forward: Weights::new(w[0], w[1]),
            backward: if i == 0 { Weights::new(0, 0) } else { Weights::new(w[1], w[0]) },
            bias: vec![[0.0; LANES]; panels_of(w[1])],
        };
        PackedNetwork { layers: self.widths.windows(2).enumerate().map(layer).collect() }
    }

    /// Arranges `parameters` for products.
    pub(crate) fn pack<P: Precision>(&self, parameters: &[f32], packed: &mut PackedNetwork<P>) {
        let mut rest = parameters;
        for (i, (layer, w)) in packed.layers.iter_mut().zip(self.widths.windows(2)).enumerate() {
            let (weight, after) = rest.split_at(w[0] * w[1]);
            let (bias, after) = after.split_at(w[1]);
            rest = after;
            layer.forward.load(weight, 1, w[0]);
            if i > 0 {
                layer.backward.load(weight, w[0], 1);
            }
            layer.bias.as_flattened_mut()[..w[1]].copy_from_slice(bias);
        }
    }

    /// Uniform weights and biases within ±1/√inputs of their layer (PyTorch's default for linear layers), those of the last layer
    /// within `output_scale` times as much.
    pub(crate) fn initialize(&self, seed: u64, stream: usize, output_scale: f32, parameters: &mut [f32]) {
        let mut random = Philox::new(seed, stream, 0, 0, Purpose::Weights);
        let mut rest = parameters;
        let last = self.widths.len() - 2;
        for (i, w) in self.widths.windows(2).enumerate() {
            let (layer, next) = rest.split_at_mut((w[0] + 1) * w[1]);
            let scale = if i == last { output_scale } else { 1.0 };
            let bound = scale / (w[0] as f32).sqrt();
            layer.fill_with(|| random.uniform(-bound, bound));
            rest = next;
        }
    }

    /// Evaluates the first `rows` rows of `input`; rows beyond, up to the next multiple of [`LANES`], must be there.
    pub(crate) fn forward<P: Precision>(
        &self,
        network: &PackedNetwork<P>,
        rows: usize,
        input: &P::Panels,
        activations: &mut Activations<P>,
    ) {
        let padded = rows.next_multiple_of(LANES);
        let outputs = self.outputs();
        for (i, layer) in network.layers.iter().enumerate() {
            let (before, after) = activations.hidden.split_at_mut(i);
            let input = before.last().unwrap_or(input);
            let output = &mut activations.output;
            layer.forward.multiply(input, padded, |panel, row, mut tile| {
                for values in &mut tile {
                    values.iter_mut().zip(&layer.bias[panel]).for_each(|(value, bias)| *value += bias);
                }
                if let Some(hidden) = after.first_mut() {
                    elu_in_place(tile.as_flattened_mut());
                    P::write(hidden, panel, row, &tile);
                } else {
                    copy_tile(&tile, panel, row, outputs, output);
                }
            });
        }
    }

    /// Adds to `gradient` the parameters' gradient, given `activations.output_gradient`, for the rows of the last forward
    /// pass.
    pub(crate) fn backward<P: Precision>(
        &self,
        network: &PackedNetwork<P>,
        rows: usize,
        input: &P::Panels,
        activations: &mut Activations<P>,
        gradient: &mut [f32],
    ) {
        let padded = rows.next_multiple_of(LANES);
        let Activations { hidden, gradients, output_gradient, .. } = activations;
        let last = gradients.last_mut().expect("a network has an output");
        store_rows::<P>(output_gradient, self.outputs(), rows, last);
        let mut end = self.num_parameters();
        for layer in (0..self.widths.len() - 1).rev() {
            let (inputs, outputs) = (self.widths[layer], self.widths[layer + 1]);
            let start = end - (inputs + 1) * outputs;
            let (weight_gradient, bias_gradient) = gradient[start..end].split_at_mut(inputs * outputs);
            end = start;
            let (before, after) = gradients.split_at_mut(layer);
            let delta = &after[0];
            for (panel, sums) in bias_gradient.chunks_mut(LANES).enumerate() {
                let column_sums = P::column_sums(delta, panel, padded);
                sums.iter_mut().zip(column_sums).for_each(|(sum, value)| *sum += value);
            }
            let Some(below) = before.last_mut() else {
                add_transposed_product::<P>((delta, outputs), (input, inputs), padded, weight_gradient);
                return;
            };
            let values = &hidden[layer - 1];
            add_transposed_product::<P>((delta, outputs), (values, inputs), padded, weight_gradient);
            network.layers[layer].backward.multiply(delta, padded, |panel, row, mut tile| {
                let values = P::read(values, panel, row);
                for (gradient, value) in tile.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
                    *gradient *= elu_slope(*value);
                }
                P::write(below, panel, row, &tile);
            });
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

/// Copies the part of a tile that is inside a row-major matrix of `columns`.
fn copy_tile(tile: &Tile, panel: usize, row: usize, columns: usize, matrix: &mut [f32]) {
    let start = panel * LANES;
    let width = LANES.min(columns - start);
    for (values, row) in tile.iter().zip(matrix.chunks_exact_mut(columns).skip(row)) {
        row[start..start + width].copy_from_slice(&values[..width]);
    }
}

/// Stores the first `rows` rows of a row-major matrix, and zeros up to the next multiple of [`LANES`].
pub(crate) fn store_rows<P: Precision>(matrix: &[f32], columns: usize, rows: usize, panels: &mut P::Panels) {
    for row in (0..rows).step_by(LANES) {
        let count = LANES.min(rows - row);
        for panel in 0..panels_of(columns) {
            let start = panel * LANES;
            let width = LANES.min(columns - start);
            let mut tile: Tile = [[0.0; LANES]; LANES];
            for (i, values) in tile[..count].iter_mut().enumerate() {
                let from = &matrix[(row + i) * columns + start..][..width];
                values[..width].copy_from_slice(from);
            }
            P::write(panels, panel, row, &tile);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panels::Single;

    #[test]
    fn weights_go_out_and_come_back() {
        let network = Architecture::new(3, &[4], 2);
        let mut parameters = vec![0.0; network.num_parameters()];
        network.initialize(1, 0, 1.0, &mut parameters);
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
        network.initialize(1, 0, 1.0, &mut parameters);
        let rows = 4;
        let input: Vec<f32> = (0..rows * 5).map(|i| (i as f32).sin()).collect();
        let weights: Vec<f32> = (0..rows * 3).map(|i| (i as f32 * 1.3).cos()).collect();
        // The loss is a weighted sum of the outputs, so its gradient with respect to them is the weights.
        let mut panels = Single::panels(LANES, 5);
        store_rows::<Single>(&input, 5, rows, &mut panels);
        let forward = |parameters: &[f32]| {
            let mut packed = network.packed::<Single>();
            let mut activations = network.activations::<Single>(LANES);
            network.pack(parameters, &mut packed);
            network.forward(&packed, rows, &panels, &mut activations);
            (packed, activations)
        };
        let loss = |parameters: &[f32]| {
            forward(parameters).1.output.iter().zip(&weights).map(|(y, w)| f64::from(y * w)).sum::<f64>()
        };
        let (packed, mut activations) = forward(&parameters);
        activations.output_gradient[..weights.len()].copy_from_slice(&weights);
        let mut gradient = vec![0.0; parameters.len()];
        network.backward(&packed, rows, &panels, &mut activations, &mut gradient);
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
