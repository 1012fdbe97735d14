//! Exported policies in onnxruntime, and files that are not what they should be.
//!
//! The cross-check skips, saying so, where Python has no `numpy`, `onnx`, `onnxruntime`.

mod python;

use std::path::Path;

use guidedog::policy::{
    Activation, ForwardWorkspace, Linear, Mlp, load_onnx, read_onnx, save_onnx, write_onnx,
};
use guidedog::spatial::{Philox, Purpose};
use python::{has_packages, python};

fn random(stream: usize) -> Philox {
    Philox::new(7, stream, 0, 0, Purpose::Evaluation)
}

/// Layers of these widths with random weights; observations of order 1 give actions of order 1.
fn network(widths: &[usize], output_limits: Option<(Vec<f32>, Vec<f32>)>) -> Mlp {
    let mut random = random(widths[0]);
    let layers = widths.windows(2).map(|pair| {
        let bound = (6.0 / pair[0] as f32).sqrt();
        Linear {
            inputs: pair[0],
            outputs: pair[1],
            weight: (0..pair[0] * pair[1]).map(|_| random.uniform(-bound, bound)).collect(),
            bias: (0..pair[1]).map(|_| random.uniform(-0.5, 0.5)).collect(),
        }
    });
    Mlp { layers: layers.collect(), activation: Activation::Elu, output_limits }
}

fn locomotion() -> Mlp {
    network(&[235, 512, 256, 128, 12], None)
}

fn supervisor() -> Mlp {
    network(&[226, 128, 128, 128, 3], Some((vec![-0.3, -0.4, -1.5], vec![1.2, 0.4, 1.5])))
}

fn metadata() -> Vec<(String, String)> {
    let entries = [
        ("joint_names", "LF_HAA,LH_HAA,RF_HAA,RH_HAA"),
        ("action_scale", "0.5"),
        ("command_low", "-0.3,-0.4,-1.5"),
        ("remark", "ω in rad/s; \"quoted\", line\nbreak"),
        ("empty", ""),
    ];
    entries.map(|(key, value)| (key.to_owned(), value.to_owned())).to_vec()
}

fn observations(mlp: &Mlp, rows: usize, random: &mut Philox) -> Vec<Vec<f32>> {
    (0..rows).map(|_| (0..mlp.inputs()).map(|_| random.uniform(-1.0, 1.0)).collect()).collect()
}

fn forward(mlp: &Mlp, rows: &[Vec<f32>]) -> Vec<f32> {
    let mut output = vec![0.0; rows.len() * mlp.outputs()];
    mlp.forward(rows.len(), &rows.concat(), &mut output, &mut ForwardWorkspace::default());
    output
}

/// What `scripts/reference/check_onnx.py` says of a file and computes for these batches.
fn onnxruntime(folder: &Path, policy: &Path, batches: &[Vec<Vec<f32>>]) -> serde_json::Value {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/reference/check_onnx.py");
    let mut call = python();
    call.arg(script).arg(policy);
    for (i, rows) in batches.iter().enumerate() {
        let path = folder.join(format!("observations-{i}.json"));
        std::fs::write(&path, serde_json::to_vec(rows).unwrap()).unwrap();
        call.arg(path);
    }
    let output = call.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn agrees_with_onnxruntime(mlp: &Mlp) {
    if !has_packages("numpy, onnx, onnxruntime") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("policy.onnx");
    save_onnx(&path, mlp, &metadata()).unwrap();
    let mut random = random(1);
    let batches = [1, 33].map(|rows| observations(mlp, rows, &mut random));
    let found = onnxruntime(folder.path(), &path, &batches);

    assert_eq!(found["inputs"][0]["name"], "obs");
    assert_eq!(found["inputs"][0]["shape"], serde_json::json!(["N", mlp.inputs()]));
    assert_eq!(found["outputs"][0]["name"], "actions");
    assert_eq!(found["outputs"][0]["shape"], serde_json::json!(["N", mlp.outputs()]));
    let expected: serde_json::Map<_, _> = metadata().into_iter().map(|(k, v)| (k, v.into())).collect();
    assert_eq!(found["metadata"], serde_json::Value::Object(expected));
    for (i, rows) in batches.iter().enumerate() {
        let theirs: Vec<Vec<f32>> = serde_json::from_value(found["actions"][i].clone()).unwrap();
        assert_eq!(theirs.len(), rows.len());
        let ours = forward(mlp, rows);
        assert_eq!(ours.len(), theirs.concat().len());
        for (ours, theirs) in ours.iter().zip(theirs.concat()) {
            assert!((ours - theirs).abs() < 1e-5 * theirs.abs().max(1.0), "{ours}, onnxruntime {theirs}");
        }
    }
    let read = load_onnx(&path).unwrap();
    assert_eq!(read.mlp, *mlp);
    assert_eq!(read.metadata, metadata().into_iter().collect());
}

#[test]
fn onnxruntime_computes_what_the_locomotion_network_does() {
    agrees_with_onnxruntime(&locomotion());
}

#[test]
fn onnxruntime_limits_the_commands_of_the_supervisor_as_we_do() {
    let mlp = supervisor();
    let (low, high) = mlp.output_limits.clone().unwrap();
    let actions = forward(&mlp, &observations(&mlp, 33, &mut random(2)));
    let limited = actions.chunks(3).flat_map(|row| row.iter().zip(&low).zip(&high));
    let limited = limited.filter(|((action, low), high)| action == low || action == high).count();
    assert!((10..90).contains(&limited), "{limited} of 99 actions are at a limit: this would show little");
    agrees_with_onnxruntime(&mlp);
}

/// A cut inside the metadata may fall between two entries; then what is left of them is read, and the network is whole.
#[test]
fn a_file_cut_short_is_refused_or_lacks_only_metadata() {
    let (mlp, entries) = (supervisor(), metadata());
    let whole = write_onnx(&mlp, &entries);
    let without = write_onnx(&mlp, &[]).len();
    for end in (0..without).step_by(211).chain(without - 40..whole.len()) {
        match read_onnx(&whole[..end]) {
            Err(error) => assert!(error.to_string().contains("whole"), "cut at {end}: {error}"),
            Ok(read) => {
                assert!(end >= without && read.mlp == mlp, "cut at {end} of {without}");
                assert!(read.metadata.len() < entries.len());
                assert!(entries.iter().take(read.metadata.len()).all(|(k, v)| read.metadata[k] == *v));
            }
        }
    }
}

#[test]
fn weights_and_limits_that_are_no_numbers_are_refused_by_name() {
    let refusal = |change: fn(&mut Mlp)| {
        let mut mlp = network(&[5, 7, 3], Some((vec![-1.0; 3], vec![1.0; 3])));
        change(&mut mlp);
        read_onnx(&write_onnx(&mlp, &[])).unwrap_err().to_string()
    };
    let nan = refusal(|mlp| mlp.layers[1].weight[4] = f32::NAN);
    assert!(nan.contains("weight_1") && nan.contains("NaN"), "{nan}");
    let infinite = refusal(|mlp| mlp.layers[0].bias[2] = f32::INFINITY);
    assert!(infinite.contains("layer 0") && infinite.contains("inf"), "{infinite}");
    let limit = refusal(|mlp| mlp.output_limits.as_mut().unwrap().0[1] = f32::NAN);
    assert!(limit.contains("output_low") && limit.contains("NaN"), "{limit}");
    let narrow = refusal(|mlp| mlp.layers[1] = network(&[6, 3], None).layers.remove(0));
    assert!(narrow.contains("takes 6") && narrow.contains('7'), "{narrow}");
}

#[test]
fn an_operator_of_another_network_is_named() {
    let mut bytes = write_onnx(&supervisor(), &[]);
    let at = bytes.windows(5).position(|word| word == b"\"\x03Elu").expect("the field op_type");
    bytes[at + 2..at + 5].copy_from_slice(b"Sin");
    let error = read_onnx(&bytes).unwrap_err().to_string();
    assert!(error.contains("Sin") && error.contains("Elu"), "{error}");
}

/// Whatever bits flip, reading ends in a refusal or in a network that can be used.
#[test]
fn flipped_bits_never_panic() {
    let whole = write_onnx(&network(&[4, 6, 3], Some((vec![-1.0; 3], vec![1.0; 3]))), &metadata());
    let mut random = random(3);
    let mut refused = 0;
    for _ in 0..20_000 {
        let mut bytes = whole.clone();
        for _ in 0..=random.below(3) {
            let bit = random.below(8 * bytes.len() as u32);
            bytes[bit as usize / 8] ^= 1 << (bit % 8);
        }
        match read_onnx(&bytes) {
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
            Ok(read) => {
                read.mlp.validate().unwrap();
                forward(&read.mlp, &[vec![0.5; read.mlp.inputs()]]);
            }
        }
    }
    assert!(refused > 2000, "only {refused} were refused");
}
