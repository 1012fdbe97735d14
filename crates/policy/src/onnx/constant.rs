//! Constants of a graph: weights, biases, scales, limits.

use super::{
    OnnxError,
    chain::refuse,
    proto::{NodeProto, TensorProto},
};

/// Networks beyond this are refused before memory is asked for.
const MAX_NUMBERS: usize = 1 << 26;

/// A constant: its shape and numbers.
#[derive(Clone)]
pub(super) struct Constant {
    pub(super) dims: Vec<usize>,
    pub(super) values: Vec<f32>,
}

impl Constant {
    /// Takes a tensor's numbers out of the file.
    pub(super) fn read(tensor: &TensorProto) -> Result<Self, OnnxError> {
        let name = tensor.name.as_deref().unwrap_or_default();
        let damaged = |what: String| OnnxError::Damaged(format!("tensor `{name}`: {what}"));
        if tensor.data_type != Some(1) {
            return Err(damaged(format!("data type is {}, must be 1 (f32)", tensor.data_type.unwrap_or(0))));
        }
        let mut numbers = 1_usize;
        let mut dims = Vec::new();
        for &dim in &tensor.dims {
            let size = usize::try_from(dim).ok().filter(|&dim| dim > 0);
            numbers = size
                .and_then(|size| numbers.checked_mul(size))
                .filter(|&n| n <= MAX_NUMBERS)
                .ok_or_else(|| {
                    damaged(format!(
                        "shape {:?} must be positive and of at most {MAX_NUMBERS} numbers",
                        tensor.dims
                    ))
                })?;
            dims.extend(size);
        }
        let values: Vec<f32> = match &tensor.raw_data {
            Some(raw) => raw.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect(),
            None => tensor.float_data.clone(),
        };
        let raw_len = tensor.raw_data.as_ref().map_or(numbers * 4, Vec::len);
        if values.len() != numbers || raw_len != numbers * 4 {
            return Err(damaged(format!(
                "{} numbers, its shape {:?} says {numbers}",
                values.len(),
                tensor.dims
            )));
        }
        if values.iter().any(|value| value.is_nan()) {
            return Err(damaged("holds a NaN".into()));
        }
        Ok(Self { dims, values })
    }

    /// The numbers as one row, the same for every row of a batch.
    pub(super) fn row(&self, node: &NodeProto) -> Result<&[f32], OnnxError> {
        let leading = self.dims.split_last().map_or(&[][..], |(_, leading)| leading);
        if leading.iter().any(|&dim| dim != 1) {
            return Err(refuse(node, &format!("a constant of shape {:?}, must be a single row", self.dims)));
        }
        Ok(&self.values)
    }
}

/// A vector of `width` numbers from one of that length or a single number.
pub(super) fn widened(node: &NodeProto, values: &[f32], width: usize) -> Result<Vec<f32>, OnnxError> {
    match values {
        [one] => Ok(vec![*one; width]),
        _ if values.len() == width => Ok(values.to_vec()),
        _ => Err(refuse(node, &format!("a constant of {} numbers, must be 1 or {width}", values.len()))),
    }
}
