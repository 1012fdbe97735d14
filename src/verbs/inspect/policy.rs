//! `guidedog inspect policy`: the network of an ONNX file.

use std::fmt::Write as _;
use std::path::Path;

use anyhow::Result;
use guidedog::error::OrBadInput as _;
use guidedog::policy::{Mlp, OnnxPolicy, layout, read_onnx};
use serde_json::json;

pub(super) const HELP: &str = "\
Read are plain chains of layers (Gemm, or MatMul and Add) with one activation between them (Elu, Tanh,
Relu). Scales and shifts before the first or behind a layer are folded into it, and Min, Max or Clip at
the end become output limits: what is shown takes raw observations in SI units. Any other file is
refused with the operator's name, exit code 2.

A locomotion policy has 235 inputs and 12 outputs, a supervisor 226 and 3; docs/notation.md tells what
stands where. Metadata says how to use the outputs: joint_names, default_joint_pos, action_scale, …

Examples:
  guidedog inspect policy runs/walk/policy.onnx
  guidedog inspect policy runs/walk/policy.onnx --json | jq -r .metadata.joint_names";

pub(super) fn show(file: &Path, json: bool) -> Result<String> {
    let policy = policy(file)?;
    Ok(if json { policy_json(&policy) } else { policy_text(file, &policy) })
}

fn policy(file: &Path) -> Result<OnnxPolicy> {
    let what = || format!("policy {}", file.display());
    let bytes = std::fs::read(file).or_bad_input(what)?;
    Ok(read_onnx(&bytes).or_bad_input(what)?)
}

fn policy_text(file: &Path, policy: &OnnxPolicy) -> String {
    let OnnxPolicy { mlp, metadata } = policy;
    let mut text = format!("{}: {} parameters\n", file.display(), mlp.num_parameters());
    let _ = writeln!(text, "inputs: {}{}", mlp.inputs(), known_observation(mlp));
    for (i, layer) in mlp.layers.iter().enumerate() {
        let last = i + 1 == mlp.layers.len();
        let activation = if last { String::new() } else { format!(", then {}", activation(mlp)) };
        let _ = writeln!(text, "layer {i}: {} to {}{activation}", layer.inputs, layer.outputs);
    }
    let _ = write!(text, "outputs: {}", mlp.outputs());
    match &mlp.output_limits {
        None => text.push_str(", not limited\n"),
        Some((low, high)) => {
            text.push('\n');
            for (i, (low, high)) in low.iter().zip(high).enumerate() {
                let _ = writeln!(text, "  {i}: {low} to {high}");
            }
        }
    }
    text.push_str(if metadata.is_empty() { "no metadata\n" } else { "metadata:\n" });
    for (key, value) in metadata {
        let _ = writeln!(text, "  {}: {}", printable(key), printable(value));
    }
    text
}

/// Whose observation has this many entries.
fn known_observation(mlp: &Mlp) -> &'static str {
    match mlp.inputs() {
        layout::LOCOMOTION_OBSERVATION => " (as many as a locomotion observation has)",
        layout::SUPERVISOR_OBSERVATION => " (as many as a supervisor observation has)",
        _ => "",
    }
}

fn activation(mlp: &Mlp) -> String {
    format!("{:?}", mlp.activation).to_lowercase()
}

/// Line breaks and control characters, which could steer a terminal, written out.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { c.escape_default().to_string() } else { c.into() }).collect()
}

fn policy_json(policy: &OnnxPolicy) -> String {
    let OnnxPolicy { mlp, metadata } = policy;
    // The shortest decimal of the f32; JSON has no infinity, null is no limit.
    let number = |limit: &f32| limit.to_string().parse::<f64>().ok().filter(|limit| limit.is_finite());
    let side = |limits: &Vec<f32>| limits.iter().map(number).collect::<Vec<_>>();
    let layers = mlp.layers.iter().map(|layer| json!({"inputs": layer.inputs, "outputs": layer.outputs}));
    let value = json!({
        "inputs": mlp.inputs(),
        "outputs": mlp.outputs(),
        "layers": layers.collect::<Vec<_>>(),
        "activation": if mlp.layers.len() > 1 { Some(activation(mlp)) } else { None },
        "output_low": mlp.output_limits.as_ref().map(|(low, _)| side(low)),
        "output_high": mlp.output_limits.as_ref().map(|(_, high)| side(high)),
        "parameters": mlp.num_parameters(),
        "metadata": metadata,
    });
    format!("{value:#}\n")
}
