//! A network as an ONNX file: input `obs` \[N, inputs\], output `actions` \[N, outputs\], f32.

use prost::Message as _;

use super::proto::{
    AttributeProto, DimensionProto, GraphProto, ModelProto, NodeProto, OperatorSetIdProto,
    StringStringEntryProto, TensorProto, TensorShapeProto, TensorTypeProto, TypeProto, ValueInfoProto,
};
use crate::mlp::{Activation, Mlp};

const FLOAT: i32 = 1;
const IR_VERSION: i64 = 8;
const OPSET: i64 = 17;

/// The file's bytes. Layers become `Gemm`, limits `Min` and `Max` with one constant an output.
pub fn write_onnx(mlp: &Mlp, metadata: &[(String, String)]) -> Vec<u8> {
    let mut graph = GraphProto {
        name: Some("policy".into()),
        input: vec![matrix("obs", mlp.inputs())],
        output: vec![matrix("actions", mlp.outputs())],
        ..GraphProto::default()
    };
    let activation = match mlp.activation {
        Activation::Elu => "Elu",
        Activation::Tanh => "Tanh",
        Activation::Relu => "Relu",
    };
    let mut current = "obs".to_owned();
    for (i, layer) in mlp.layers.iter().enumerate() {
        let (weight, bias) = (format!("weight_{i}"), format!("bias_{i}"));
        graph.initializer.push(tensor(&weight, &[layer.outputs, layer.inputs], &layer.weight));
        graph.initializer.push(tensor(&bias, &[layer.outputs], &layer.bias));
        let transposed = AttributeProto {
            name: Some("transB".into()),
            i: Some(1),
            r#type: Some(2),
            ..AttributeProto::default()
        };
        current = push(&mut graph, "Gemm", &[&current, &weight, &bias], vec![transposed]);
        if i + 1 < mlp.layers.len() {
            current = push(&mut graph, activation, &[&current], Vec::new());
        }
    }
    if let Some((low, high)) = &mlp.output_limits {
        for (operator, name, limits) in [("Min", "output_high", high), ("Max", "output_low", low)] {
            graph.initializer.push(tensor(name, &[limits.len()], limits));
            current = push(&mut graph, operator, &[&current, name], Vec::new());
        }
    }
    graph.node.last_mut().expect("a network has layers").output = vec!["actions".into()];
    let entry = |(key, value): &(String, String)| StringStringEntryProto {
        key: Some(key.clone()),
        value: Some(value.clone()),
    };
    let model = ModelProto {
        ir_version: Some(IR_VERSION),
        producer_name: Some("guidedog".into()),
        producer_version: Some(env!("CARGO_PKG_VERSION").into()),
        graph: Some(graph),
        opset_import: vec![OperatorSetIdProto { domain: Some(String::new()), version: Some(OPSET) }],
        metadata_props: metadata.iter().map(entry).collect(),
    };
    model.encode_to_vec()
}

/// Adds an operator; returns the name of its output.
fn push(graph: &mut GraphProto, operator: &str, inputs: &[&str], attribute: Vec<AttributeProto>) -> String {
    let name = format!("{}_{}", operator.to_lowercase(), graph.node.len());
    graph.node.push(NodeProto {
        input: inputs.iter().map(|&input| input.to_owned()).collect(),
        output: vec![name.clone()],
        name: Some(name.clone()),
        op_type: Some(operator.to_owned()),
        attribute,
    });
    name
}

fn tensor(name: &str, dims: &[usize], values: &[f32]) -> TensorProto {
    TensorProto {
        dims: dims.iter().map(|&dim| dim as i64).collect(),
        data_type: Some(FLOAT),
        name: Some(name.to_owned()),
        raw_data: Some(values.iter().flat_map(|value| value.to_le_bytes()).collect()),
        ..TensorProto::default()
    }
}

fn matrix(name: &str, width: usize) -> ValueInfoProto {
    let dim = vec![
        DimensionProto { dim_param: Some("N".into()), dim_value: None },
        DimensionProto { dim_value: Some(width as i64), dim_param: None },
    ];
    let tensor_type = TensorTypeProto { elem_type: Some(FLOAT), shape: Some(TensorShapeProto { dim }) };
    let r#type = Some(TypeProto { tensor_type: Some(tensor_type) });
    ValueInfoProto { name: Some(name.to_owned()), r#type }
}
