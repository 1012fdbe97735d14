//! Matrix products on slices: a safe, checked door to the kernels of the `gemm` crates.
//!
//! Single-threaded: callers divide rows into tiles of fixed size and give tiles to threads, so that results do not
//! depend on how many threads there are.

// The kernels take raw pointers; the bounds checked here are what makes that sound.
#![allow(unsafe_code)]

/// A matrix in a slice: entry (i, j) is `data[i * row_stride + j * column_stride]`.
#[derive(Clone, Copy, Debug)]
pub struct MatRef<'a> {
    data: &'a [f32],
    rows: usize,
    columns: usize,
    row_stride: usize,
    column_stride: usize,
}

impl<'a> MatRef<'a> {
    /// A row-major matrix of `rows × columns`.
    ///
    /// # Panics
    /// If `data` is shorter than that.
    pub fn new(data: &'a [f32], rows: usize, columns: usize) -> Self {
        assert!(data.len() >= rows * columns, "{} numbers for a {rows} × {columns} matrix", data.len());
        Self { data, rows, columns, row_stride: columns, column_stride: 1 }
    }

    /// The transposed matrix, without moving a number.
    pub fn transposed(self) -> Self {
        Self {
            rows: self.columns,
            columns: self.rows,
            row_stride: self.column_stride,
            column_stride: self.row_stride,
            ..self
        }
    }
}

/// `out += a b`; `out` is row-major, `a.rows × b.columns`.
///
/// # Panics
/// If the shapes do not fit or `out` is too short.
pub fn add_product(a: MatRef<'_>, b: MatRef<'_>, out: &mut [f32]) {
    assert_eq!(a.columns, b.rows, "inner dimensions of a product");
    assert!(out.len() >= a.rows * b.columns, "{} numbers for {} × {}", out.len(), a.rows, b.columns);
    // SAFETY: `MatRef::new` checked that every entry of `a` and `b` lies in its slice (transposing exchanges both the
    // dimensions and the strides), the assertion above does so for `out`, and `out` is exclusively borrowed.
    // The kernels like columns: what is computed is outᵀ = bᵀ aᵀ.
    unsafe {
        gemm_f32::gemm::f32::get_gemm_fn()(
            b.columns,
            a.rows,
            a.columns,
            out.as_mut_ptr(),
            b.columns as isize,
            1,
            true,
            b.data.as_ptr(),
            b.row_stride as isize,
            b.column_stride as isize,
            a.data.as_ptr(),
            a.row_stride as isize,
            a.column_stride as isize,
            1.0,
            1.0,
            false,
            false,
            false,
            gemm_common::Parallelism::None,
        );
    }
}

#[cfg(test)]
mod tests {
    use spatial::{Philox, Purpose};

    use super::*;

    fn random(len: usize, stream: usize) -> Vec<f32> {
        let mut random = Philox::new(1, stream, 0, 0, Purpose::Evaluation);
        (0..len).map(|_| random.uniform(-1.0, 1.0)).collect()
    }

    #[test]
    fn products_with_and_without_transposes_match_the_definition() {
        let (m, k, n) = (7, 19, 33);
        let (a, b) = (random(m * k, 0), random(k * n, 1));
        let mut expected = vec![0.0_f64; m * n];
        for i in 0..m {
            for j in 0..n {
                for l in 0..k {
                    expected[i * n + j] += f64::from(a[i * k + l]) * f64::from(b[l * n + j]);
                }
            }
        }
        let mut a_transposed = vec![0.0; m * k];
        let mut b_transposed = vec![0.0; k * n];
        for l in 0..k {
            for i in 0..m {
                a_transposed[l * m + i] = a[i * k + l];
            }
            for j in 0..n {
                b_transposed[j * k + l] = b[l * n + j];
            }
        }
        let a_forms = [MatRef::new(&a, m, k), MatRef::new(&a_transposed, k, m).transposed()];
        let b_forms = [MatRef::new(&b, k, n), MatRef::new(&b_transposed, n, k).transposed()];
        for a in a_forms {
            for b in b_forms {
                let mut out = vec![1.0; m * n];
                add_product(a, b, &mut out);
                for (found, expected) in out.iter().zip(&expected) {
                    assert!((f64::from(*found) - (1.0 + expected)).abs() < 1e-5);
                }
            }
        }
    }
}
