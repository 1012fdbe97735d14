//! Policies as ONNX files, written and read by ourselves: the interface to every other engine.

mod chain;
mod constant;
mod proto;
mod read;
mod write;

use std::{collections::BTreeMap, fs, path::Path};

pub use read::read_onnx;
pub use write::write_onnx;

use crate::{checkpoint::write_atomic, mlp::Mlp};

/// A network and what its file says about it.
#[derive(Clone, Debug, PartialEq)]
pub struct OnnxPolicy {
    /// The network, taking raw observations.
    pub mlp: Mlp,
    /// The file's metadata.
    pub metadata: BTreeMap<String, String>,
}

/// A file that cannot be used as a policy.
#[derive(Debug, thiserror::Error)]
pub enum OnnxError {
    /// The file cannot be read or written.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not whole or not ONNX.
    #[error("not a whole ONNX file: {0}")]
    Damaged(String),
    /// An operator other than those of plain feed-forward networks.
    #[error(
        "operator {0} is not among Gemm, MatMul, Add, Sub, Mul, Div, Elu, Tanh, Relu, Min, Max, Clip, Identity, Constant"
    )]
    Operator(String),
    /// The operators do not make a plain chain, or its parts do not fit.
    #[error("not a plain feed-forward network: {0}")]
    Shape(String),
}

/// Writes a policy; a crash leaves the previous file.
///
/// # Errors
/// The disk refuses.
pub fn save_onnx(path: &Path, mlp: &Mlp, metadata: &[(String, String)]) -> Result<(), OnnxError> {
    let io = |source| OnnxError::Io { path: path.display().to_string(), source };
    write_atomic(path, &write_onnx(mlp, metadata)).map_err(io)
}

/// Reads a policy.
///
/// # Errors
/// The file cannot be read or used.
pub fn load_onnx(path: &Path) -> Result<OnnxPolicy, OnnxError> {
    let io = |source| OnnxError::Io { path: path.display().to_string(), source };
    read_onnx(&fs::read(path).map_err(io)?)
}

#[cfg(test)]
mod tests {
    use prost::Message as _;

    use super::{
        proto::{ModelProto, NodeProto, TensorProto},
        *,
    };
    use crate::mlp::{Activation, ForwardWorkspace, Linear};

    fn network() -> Mlp {
        let layer = |inputs: usize, outputs: usize| Linear {
            inputs,
            outputs,
            weight: (0..inputs * outputs).map(|i| (i as f32 * 0.7).sin()).collect(),
            bias: (0..outputs).map(|i| (i as f32).cos()).collect(),
        };
        Mlp {
            layers: vec![layer(3, 5), layer(5, 2)],
            activation: Activation::Elu,
            output_limits: Some((vec![-0.5, -1.0], vec![0.5, 2.0])),
        }
    }

    fn evaluate(mlp: &Mlp, input: &[f32]) -> Vec<f32> {
        let mut output = vec![0.0; mlp.outputs()];
        mlp.forward(1, input, &mut output, &mut ForwardWorkspace::default());
        output
    }

    /// The file of `network`, changed.
    fn changed(change: impl FnOnce(&mut ModelProto)) -> Result<OnnxPolicy, OnnxError> {
        let mut model = ModelProto::decode(&write_onnx(&network(), &[])[..]).unwrap();
        change(&mut model);
        read_onnx(&model.encode_to_vec())
    }

    #[test]
    fn what_is_written_is_read() {
        let metadata = vec![("joint_names".to_owned(), "a,b".to_owned())];
        let read = read_onnx(&write_onnx(&network(), &metadata)).unwrap();
        assert_eq!(read.mlp, network());
        assert_eq!(read.metadata["joint_names"], "a,b");
    }

    #[test]
    fn a_file_cut_anywhere_is_refused_or_at_least_no_panic() {
        let whole = write_onnx(&network(), &[]);
        for end in 0..whole.len() {
            let _ = read_onnx(&whole[..end]);
        }
        assert!(read_onnx(&whole[..whole.len() / 2]).is_err());
        assert!(read_onnx(b"").unwrap_err().to_string().contains("no graph"));
    }

    #[test]
    fn operators_and_shapes_that_do_not_belong_are_named() {
        let softmax = changed(|model| {
            model.graph.as_mut().unwrap().node[1].op_type = Some("Softmax".into());
        });
        assert!(softmax.unwrap_err().to_string().contains("Softmax"));
        let narrow = changed(|model| {
            let tensor = &mut model.graph.as_mut().unwrap().initializer[2];
            tensor.dims = vec![2, 4];
            tensor.raw_data = Some(vec![0; 32]);
        });
        assert!(narrow.unwrap_err().to_string().contains("takes 4 numbers"));
        let huge = changed(|model| {
            model.graph.as_mut().unwrap().initializer[0].dims = vec![1 << 40, 1 << 40];
        });
        assert!(huge.unwrap_err().to_string().contains("weight_0"));
        let nan = changed(|model| {
            let raw = model.graph.as_mut().unwrap().initializer[0].raw_data.as_mut().unwrap();
            raw[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        });
        assert!(nan.unwrap_err().to_string().contains("NaN"));
    }

    /// A file that the reader would have to misunderstand to accept.
    #[track_caller]
    fn assert_refused(change: impl FnOnce(&mut ModelProto), words: &[&str]) {
        let error = changed(change).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "`{error}` does not say `{word}`");
        }
    }

    #[test]
    fn declared_widths_are_those_of_the_layers() {
        use super::proto::ValueInfoProto;
        fn widen(value: &mut ValueInfoProto, width: i64) {
            let tensor = value.r#type.as_mut().unwrap().tensor_type.as_mut().unwrap();
            tensor.shape.as_mut().unwrap().dim[1].dim_value = Some(width);
        }
        let input = |model: &mut ModelProto| widen(&mut model.graph.as_mut().unwrap().input[0], 235);
        assert_refused(input, &["`obs`", "235", "3"]);
        let output = |model: &mut ModelProto| widen(&mut model.graph.as_mut().unwrap().output[0], 12);
        assert_refused(output, &["`actions`", "12", "2"]);
    }

    #[test]
    fn a_file_that_ends_behind_its_graph_is_refused() {
        assert_refused(|model| model.opset_import.clear(), &["version", "end"]);
    }

    #[test]
    fn nothing_an_operator_takes_is_passed_over() {
        // Node 0 is Gemm, 1 Elu, 2 Gemm, 3 Min, 4 Max.
        let node = |i: usize, change: fn(&mut NodeProto)| {
            move |model: &mut ModelProto| change(&mut model.graph.as_mut().unwrap().node[i])
        };
        let computed_bias = node(0, |gemm| gemm.input[2] = "elsewhere".into());
        assert_refused(computed_bias, &["Gemm", "constant"]);
        let third = node(3, |min| min.input.push("output_low".into()));
        assert_refused(third, &["Min", "3 inputs"]);
        let computed_bound = node(3, |clip| {
            clip.op_type = Some("Clip".into());
            clip.input[1] = "elsewhere".into();
        });
        assert_refused(computed_bound, &["Clip", "constant"]);
        let as_bound = node(3, |clip| {
            clip.op_type = Some("Clip".into());
            clip.input.reverse();
        });
        assert_refused(as_bound, &["Clip", "first input"]);
        let subtracted = node(3, |sub| {
            sub.op_type = Some("Sub".into());
            sub.input.reverse();
        });
        assert_refused(subtracted, &["Sub", "first input"]);
        let twice = node(3, |clip| {
            clip.op_type = Some("Clip".into());
            clip.input.insert(1, clip.input[0].clone());
        });
        assert_refused(twice, &["Clip", "2 times", "once"]);
    }

    #[test]
    fn nothing_but_limits_follows_a_limit() {
        // Gemm, Clip, Tanh, Gemm, and Gemm, Clip, Gemm: not a network with the limit at its end.
        for (operator, behind) in [("Tanh", "Tanh"), ("Identity", "Gemm")] {
            let limited = |model: &mut ModelProto| {
                let graph = model.graph.as_mut().unwrap();
                graph.node.truncate(3);
                let clip = NodeProto {
                    input: vec!["limited".into(), "limit".into()],
                    output: std::mem::replace(&mut graph.node[0].output, vec!["limited".into()]),
                    op_type: Some("Clip".into()),
                    ..NodeProto::default()
                };
                graph.node.insert(1, clip);
                graph.node[2].op_type = Some(operator.into());
                graph.node[3].output = vec!["actions".into()];
                graph.initializer.push(constant("limit", &[-0.5]));
            };
            assert_refused(limited, &[behind, "behind a limit"]);
        }
    }

    fn constant(name: &str, values: &[f32]) -> TensorProto {
        TensorProto {
            dims: vec![values.len() as i64],
            data_type: Some(1),
            name: Some(name.into()),
            float_data: values.to_vec(),
            ..TensorProto::default()
        }
    }

    #[test]
    fn a_constant_that_differs_from_row_to_row_is_refused() {
        let tall = |model: &mut ModelProto| model.graph.as_mut().unwrap().initializer[1].dims = vec![5, 1];
        assert_refused(tall, &["Gemm", "[5, 1]"]);
    }

    #[test]
    fn normalizers_and_output_scales_fold_into_the_layers() {
        let node = |operator: &str, input: [&str; 2], output: &str| NodeProto {
            input: input.map(str::to_owned).to_vec(),
            output: vec![output.into()],
            op_type: Some(operator.into()),
            ..NodeProto::default()
        };
        let folded = changed(|model| {
            let graph = model.graph.as_mut().unwrap();
            graph.initializer.push(constant("mean", &[1.0, -2.0, 0.5]));
            graph.initializer.push(constant("deviation", &[2.0, 0.5, 4.0]));
            graph.initializer.push(constant("gain", &[0.25]));
            graph.node.truncate(3);
            graph.node[0].input[0] = "normal".into();
            graph.node[2].output = vec!["raw".into()];
            graph.node.push(node("Mul", ["gain", "raw"], "actions"));
            graph.node.push(node("Sub", ["obs", "mean"], "centered"));
            graph.node.push(node("Div", ["centered", "deviation"], "normal"));
        })
        .unwrap();
        let plain = Mlp { output_limits: None, ..network() };
        let expected = evaluate(&plain, &[(0.3 - 1.0) / 2.0, (0.1 + 2.0) / 0.5, (-0.7 - 0.5) / 4.0]);
        for (a, b) in evaluate(&folded.mlp, &[0.3, 0.1, -0.7]).iter().zip(expected) {
            assert!((a - 0.25 * b).abs() < 1e-5);
        }
    }
}
