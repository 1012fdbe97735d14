//! An ONNX file as a network: plain chains only, followed from the input to the output.

use std::collections::{BTreeMap, HashMap};

use prost::Message as _;

use super::{
    OnnxError, OnnxPolicy,
    chain::{Chain, attribute, operator, refuse},
    constant::Constant,
    proto::{GraphProto, ModelProto, ValueInfoProto},
};

/// Reads a file's bytes.
///
/// # Errors
/// The file is damaged, or holds something other than a plain chain; says which operator.
pub fn read_onnx(bytes: &[u8]) -> Result<OnnxPolicy, OnnxError> {
    let damaged = |what: &str| OnnxError::Damaged(what.to_owned());
    let model = ModelProto::decode(bytes).map_err(|error| damaged(&error.to_string()))?;
    let graph = model.graph.ok_or_else(|| damaged("there is no graph in it"))?;
    // Written behind the graph, so a file cut there lacks it.
    if model.opset_import.is_empty() {
        return Err(damaged("it names no version of the operators; its end may be missing"));
    }
    let metadata: BTreeMap<_, _> = model
        .metadata_props
        .into_iter()
        .map(|entry| (entry.key.unwrap_or_default(), entry.value.unwrap_or_default()))
        .collect();
    let constants = constants(&graph)?;
    let input = single_input(&graph, &constants)?;
    let mlp = follow(&graph, input, &constants)?.into_mlp()?;
    check_width("input", input, mlp.inputs())?;
    if let Some(output) = graph.output.first() {
        check_width("output", output, mlp.outputs())?;
    }
    Ok(OnnxPolicy { mlp, metadata })
}

/// Initializers and `Constant` operators by name.
fn constants(graph: &GraphProto) -> Result<HashMap<String, Constant>, OnnxError> {
    let mut constants = HashMap::new();
    for tensor in &graph.initializer {
        constants.insert(tensor.name.clone().unwrap_or_default(), Constant::read(tensor)?);
    }
    for node in graph.node.iter().filter(|node| operator(node) == "Constant") {
        let value = attribute(node, "value").and_then(|a| a.t.as_ref());
        let tensor = value.ok_or_else(|| refuse(node, "a constant that is no tensor"))?;
        constants.insert(node.output.first().cloned().unwrap_or_default(), Constant::read(tensor)?);
    }
    Ok(constants)
}

/// The input that is no constant: older files list their initializers among the inputs.
fn single_input<'a>(
    graph: &'a GraphProto,
    constants: &HashMap<String, Constant>,
) -> Result<&'a ValueInfoProto, OnnxError> {
    let mut inputs = graph.input.iter().filter(|input| !constants.contains_key(name(input)));
    match (inputs.next(), inputs.next()) {
        (Some(input), None) => Ok(input),
        _ => Err(OnnxError::Shape("the graph must have exactly one input".into())),
    }
}

/// Follows the value that starts as the input until it is the output.
fn follow(
    graph: &GraphProto,
    input: &ValueInfoProto,
    constants: &HashMap<String, Constant>,
) -> Result<Chain, OnnxError> {
    let output = graph.output.first().map(name).unwrap_or_default();
    let mut current = name(input);
    let mut chain = Chain::default();
    for _ in 0..=graph.node.len() {
        if current == output {
            return Ok(chain);
        }
        let mut users = graph.node.iter().filter(|node| node.input.iter().any(|input| input == current));
        let (Some(node), None) = (users.next(), users.next()) else {
            return Err(OnnxError::Shape(format!("`{current}` must be used by exactly one operator")));
        };
        chain.follow(node, current, constants)?;
        current = node.output.first().map(String::as_str).unwrap_or_default();
    }
    Err(OnnxError::Shape(format!("the chain does not end in the output `{output}`")))
}

fn name(value: &ValueInfoProto) -> &str {
    value.name.as_deref().unwrap_or_default()
}

/// Holds the declared width of an input or output, if there is one, against that of the layers.
fn check_width(role: &str, value: &ValueInfoProto, width: usize) -> Result<(), OnnxError> {
    let tensor = value.r#type.as_ref().and_then(|r#type| r#type.tensor_type.as_ref());
    let dims = tensor.and_then(|tensor| tensor.shape.as_ref()).map_or(&[][..], |shape| &shape.dim);
    // Zero and −1 are other writers' words for an unknown width.
    match dims.last().and_then(|dim| dim.dim_value).filter(|&declared| declared > 0) {
        Some(declared) if usize::try_from(declared) != Ok(width) => Err(OnnxError::Shape(format!(
            "the {role} `{}` is declared {declared} wide, the layers make it {width}",
            name(value)
        ))),
        _ => Ok(()),
    }
}
