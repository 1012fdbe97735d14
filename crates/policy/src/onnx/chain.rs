//! A chain of operators as layers: affine ones with one activation between them, and whatever scales, shifts and limits
//! stand before and behind them.
//!
//! Scales and shifts are folded into the neighboring layer, so the result takes raw observations.

use std::collections::HashMap;

use super::{
    OnnxError,
    constant::{Constant, widened},
    proto::{AttributeProto, NodeProto},
};
use crate::mlp::{Activation, Linear, Mlp};

/// Operators a chain may have: name, how many inputs at most, whether the value that runs through the chain may be
/// any of them (else it is the first, and the others are constants).
const OPERATORS: [(&str, usize, bool); 13] = [
    ("Identity", 1, false),
    ("Gemm", 3, false),
    ("MatMul", 2, false),
    ("Elu", 1, false),
    ("Tanh", 1, false),
    ("Relu", 1, false),
    ("Add", 2, true),
    ("Sub", 2, false),
    ("Mul", 2, true),
    ("Div", 2, false),
    ("Min", 2, true),
    ("Max", 2, true),
    ("Clip", 3, false),
];

/// The chain as far as it has been followed.
#[derive(Default)]
pub(super) struct Chain {
    /// Shift and scale of the input: what comes in is `x · scale + shift`.
    input: Affine,
    layers: Vec<Linear>,
    activation: Option<Activation>,
    /// Activations after the layers; the last layer must have none.
    activated: Vec<bool>,
    low: Option<Vec<f32>>,
    high: Option<Vec<f32>>,
}

/// One factor and summand an entry; empty while nothing is known of the width.
#[derive(Default)]
struct Affine {
    scale: Vec<f32>,
    shift: Vec<f32>,
}

impl Chain {
    /// Takes in one operator; `current` is the value that runs through the chain.
    pub(super) fn follow(
        &mut self,
        node: &NodeProto,
        current: &str,
        constants: &HashMap<String, Constant>,
    ) -> Result<(), OnnxError> {
        let others = other_inputs(node, current, constants)?;
        let limited = self.low.is_some() || self.high.is_some();
        if limited && !matches!(operator(node), "Identity" | "Min" | "Max" | "Clip") {
            return Err(refuse(node, "arithmetic behind a limit"));
        }
        let other = |i: usize| others.get(i).copied().ok_or_else(|| refuse(node, "too few inputs"));
        let row = |i: usize| other(i)?.row(node);
        match operator(node) {
            "Identity" => Ok(()),
            "Gemm" => self.gemm(node, other(0)?, others.get(1).copied()),
            "MatMul" => self.affine(node, other(0)?, false, None),
            "Elu" | "Tanh" | "Relu" => self.activate(node),
            "Add" => self.shift(node, row(0)?, 1.0),
            "Sub" => self.shift(node, row(0)?, -1.0),
            "Mul" => self.scale(node, row(0)?),
            "Div" => {
                let inverse: Vec<f32> = row(0)?.iter().map(|value| 1.0 / value).collect();
                self.scale(node, &inverse)
            }
            "Min" => self.limit(node, None, Some(row(0)?)),
            "Max" => self.limit(node, Some(row(0)?), None),
            "Clip" => self.clip(node, constants),
            name => Err(OnnxError::Operator(name.to_owned())),
        }
    }

    fn gemm(
        &mut self,
        node: &NodeProto,
        weight: &Constant,
        bias: Option<&Constant>,
    ) -> Result<(), OnnxError> {
        let number = |name, default: f32| attribute(node, name).and_then(|a| a.f).unwrap_or(default);
        let flag = |name| attribute(node, name).and_then(|a| a.i).unwrap_or(0) != 0;
        if number("alpha", 1.0) != 1.0 || number("beta", 1.0) != 1.0 || flag("transA") {
            return Err(refuse(node, "alpha, beta or transA other than 1, 1 and 0"));
        }
        self.affine(node, weight, flag("transB"), bias)
    }

    /// Adds a layer; `transposed` weights are `outputs × inputs`.
    fn affine(
        &mut self,
        node: &NodeProto,
        weight: &Constant,
        transposed: bool,
        bias: Option<&Constant>,
    ) -> Result<(), OnnxError> {
        let [rows, columns] = weight.dims[..] else {
            return Err(refuse(node, "a weight that is no matrix"));
        };
        let (inputs, outputs) = if transposed { (columns, rows) } else { (rows, columns) };
        if let Some(before) = self.layers.last().filter(|layer| layer.outputs != inputs) {
            let found = format!("takes {inputs} numbers, the layer before gives {}", before.outputs);
            return Err(refuse(node, &found));
        }
        let mut layer = Linear { inputs, outputs, weight: weight.values.clone(), bias: vec![0.0; outputs] };
        if !transposed {
            for i in 0..inputs {
                for o in 0..outputs {
                    layer.weight[o * inputs + i] = weight.values[i * outputs + o];
                }
            }
        }
        if let Some(bias) = bias {
            layer.bias = widened(node, bias.row(node)?, outputs)?;
        }
        if self.layers.is_empty() {
            self.fold_input(node, &mut layer)?;
        }
        self.layers.push(layer);
        self.activated.push(false);
        Ok(())
    }

    /// Folds what happens to the input before the first layer into it: W (s x + t) + b = (W s) x + (W t + b).
    fn fold_input(&self, node: &NodeProto, layer: &mut Linear) -> Result<(), OnnxError> {
        if self.input.scale.is_empty() {
            return Ok(());
        }
        let scale = widened(node, &self.input.scale, layer.inputs)?;
        let shift = widened(node, &self.input.shift, layer.inputs)?;
        for (row, bias) in layer.weight.chunks_exact_mut(layer.inputs).zip(&mut layer.bias) {
            *bias += row.iter().zip(&shift).map(|(w, t)| w * t).sum::<f32>();
            row.iter_mut().zip(&scale).for_each(|(w, s)| *w *= s);
        }
        Ok(())
    }

    fn activate(&mut self, node: &NodeProto) -> Result<(), OnnxError> {
        let activation = match operator(node) {
            "Elu" => Activation::Elu,
            "Tanh" => Activation::Tanh,
            _ => Activation::Relu,
        };
        if attribute(node, "alpha").and_then(|a| a.f).unwrap_or(1.0) != 1.0 {
            return Err(refuse(node, "alpha other than 1"));
        }
        if self.activation.is_some_and(|other| other != activation) {
            return Err(refuse(node, "two kinds of activation in one network"));
        }
        match self.activated.last_mut() {
            Some(activated) if !*activated => *activated = true,
            _ => return Err(refuse(node, "an activation that follows no layer")),
        }
        self.activation = Some(activation);
        Ok(())
    }

    fn shift(&mut self, node: &NodeProto, values: &[f32], sign: f32) -> Result<(), OnnxError> {
        let signed: Vec<f32> = values.iter().map(|value| sign * value).collect();
        self.transform(node, &[1.0], &signed)
    }

    fn scale(&mut self, node: &NodeProto, values: &[f32]) -> Result<(), OnnxError> {
        self.transform(node, values, &[0.0])
    }

    /// y ← y · scale + shift, on the input or on the last layer's output.
    fn transform(&mut self, node: &NodeProto, scale: &[f32], shift: &[f32]) -> Result<(), OnnxError> {
        match (self.layers.last_mut(), self.activated.last()) {
            (Some(layer), Some(false)) => {
                let scale = widened(node, scale, layer.outputs)?;
                let shift = widened(node, shift, layer.outputs)?;
                for (o, row) in layer.weight.chunks_exact_mut(layer.inputs).enumerate() {
                    row.iter_mut().for_each(|w| *w *= scale[o]);
                    layer.bias[o] = layer.bias[o] * scale[o] + shift[o];
                }
                Ok(())
            }
            (None, _) => {
                let width = self.input.scale.len().max(scale.len()).max(shift.len());
                let affine = &mut self.input;
                let old = if affine.scale.is_empty() {
                    (vec![1.0], vec![0.0])
                } else {
                    (std::mem::take(&mut affine.scale), std::mem::take(&mut affine.shift))
                };
                let (old_scale, old_shift) = (widened(node, &old.0, width)?, widened(node, &old.1, width)?);
                let (scale, shift) = (widened(node, scale, width)?, widened(node, shift, width)?);
                affine.scale = old_scale.iter().zip(&scale).map(|(a, b)| a * b).collect();
                affine.shift =
                    old_shift.iter().zip(&scale).zip(&shift).map(|((t, s), shift)| t * s + shift).collect();
                Ok(())
            }
            _ => Err(refuse(node, "arithmetic between an activation and the next layer")),
        }
    }

    fn clip(&mut self, node: &NodeProto, constants: &HashMap<String, Constant>) -> Result<(), OnnxError> {
        let bound = |i: usize, name| -> Option<Vec<f32>> {
            let input = node.input.get(i).and_then(|input| constants.get(input)).map(|c| c.values.clone());
            input.or_else(|| Some(vec![attribute(node, name)?.f?]))
        };
        let (low, high) = (bound(1, "min"), bound(2, "max"));
        self.limit(node, low.as_deref(), high.as_deref())
    }

    fn limit(
        &mut self,
        node: &NodeProto,
        low: Option<&[f32]>,
        high: Option<&[f32]>,
    ) -> Result<(), OnnxError> {
        let (Some(layer), Some(false)) = (self.layers.last(), self.activated.last()) else {
            return Err(refuse(node, "a limit that does not follow the last layer"));
        };
        let width = layer.outputs;
        if let Some(low) = low {
            let low = widened(node, low, width)?;
            let old = self.low.take().unwrap_or_else(|| vec![f32::NEG_INFINITY; width]);
            self.low = Some(old.iter().zip(low).map(|(a, b)| a.max(b)).collect());
            // A later lower limit beats an earlier upper one.
            if let (Some(low), Some(high)) = (&self.low, &mut self.high) {
                high.iter_mut().zip(low).for_each(|(high, low)| *high = high.max(*low));
            }
        }
        if let Some(high) = high {
            let high = widened(node, high, width)?;
            let old = self.high.take().unwrap_or_else(|| vec![f32::INFINITY; width]);
            self.high = Some(old.iter().zip(high).map(|(a, b)| a.min(b)).collect());
            if let (Some(low), Some(high)) = (&mut self.low, &self.high) {
                low.iter_mut().zip(high).for_each(|(low, high)| *low = low.min(*high));
            }
        }
        Ok(())
    }

    /// The network, once the chain has ended.
    pub(super) fn into_mlp(self) -> Result<Mlp, OnnxError> {
        let Some((last, hidden)) = self.activated.split_last() else {
            return Err(OnnxError::Shape("the graph has no layers".into()));
        };
        if *last || hidden.iter().any(|activated| !activated) {
            return Err(OnnxError::Shape(
                "an activation must follow every layer but the last, and not the last".into(),
            ));
        }
        let width = self.layers.last().map_or(0, |layer| layer.outputs);
        let output_limits = (self.low.is_some() || self.high.is_some()).then(|| {
            let low = self.low.unwrap_or_else(|| vec![f32::NEG_INFINITY; width]);
            (low, self.high.unwrap_or_else(|| vec![f32::INFINITY; width]))
        });
        let activation = self.activation.unwrap_or(Activation::Elu);
        let mlp = Mlp { layers: self.layers, activation, output_limits };
        mlp.validate().map_err(|error| OnnxError::Shape(error.to_string()))?;
        Ok(mlp)
    }
}

/// The constants an operator takes beside the running value; all of its inputs are accounted for.
fn other_inputs<'a>(
    node: &NodeProto,
    current: &str,
    constants: &'a HashMap<String, Constant>,
) -> Result<Vec<&'a Constant>, OnnxError> {
    let known = OPERATORS.iter().find(|(name, ..)| *name == operator(node));
    let Some((_, most, anywhere)) = known else {
        return Err(OnnxError::Operator(operator(node).to_owned()));
    };
    if node.input.len() > *most {
        return Err(refuse(node, &format!("{} inputs, must be at most {most}", node.input.len())));
    }
    if !anywhere && node.input.first().is_none_or(|name| name != current) {
        return Err(refuse(node, "a constant as its first input"));
    }
    let times = node.input.iter().filter(|name| *name == current).count();
    if times != 1 {
        return Err(refuse(node, &format!("takes `{current}` {times} times, must take it once")));
    }
    let others = node.input.iter().filter(|name| *name != current && !name.is_empty());
    others
        .map(|name| constants.get(name).ok_or_else(|| refuse(node, "an input that is no constant")))
        .collect()
}

pub(super) fn operator(node: &NodeProto) -> &str {
    node.op_type.as_deref().unwrap_or_default()
}

pub(super) fn attribute<'a>(node: &'a NodeProto, name: &str) -> Option<&'a AttributeProto> {
    node.attribute.iter().find(|attribute| attribute.name.as_deref() == Some(name))
}

/// A refusal that names the operator.
pub(super) fn refuse(node: &NodeProto, what: &str) -> OnnxError {
    let name = node.name.as_deref().unwrap_or_default();
    OnnxError::Shape(format!("operator {} `{name}`: {what}", operator(node)))
}
