//! Matrices in panels of sixteen columns, and the two products that training needs of them.
//!
//! A panel holds sixteen columns of all rows, row after row, so that whatever a product reads lies side by side and no
//! operand is ever moved: the activations that one layer writes are what the next one reads, and what its weight gradient
//! reads later. Both products keep 8 × 32 sums in registers, 6 × 16 where there are only AVX2's (Goto and van de Geijn, *Anatomy
//! of high-performance matrix multiplication*, 2008, without the packing of A), and give them as tiles of 16 × 16.
//!
//! Rows, columns and depths are counted in sixteens; what is beyond the matrix is zero and adds nothing.

use rayon::prelude::*;
use spatial::{Lane, f32x16};

/// Columns of a panel, and rows of a tile.
pub(crate) const LANES: usize = 16;
/// What a product gives at a time: sixteen rows of one panel.
pub(crate) type Tile = [[f32; LANES]; LANES];

/// How numbers are stored and multiplied. Sums are always single precision, whatever is multiplied.
pub(crate) trait Precision: Copy + std::fmt::Debug + Send + Sync + 'static {
    /// Activations, or their gradients.
    type Panels: Clone + std::fmt::Debug + Send + Sync;
    /// A panel of weights as the second factor of a product.
    type WeightPanel: Clone + std::fmt::Debug + Send + Sync;
    /// Panels, one or two, whose sums fit in registers beside what is multiplied.
    const SUMMED_PANELS: usize;

    /// Zeros for `rows × columns`; rows a multiple of [`LANES`].
    fn panels(rows: usize, columns: usize) -> Self::Panels;
    /// Stores the rows from `row` of a panel.
    fn write(to: &mut Self::Panels, panel: usize, row: usize, tile: &Tile);
    /// The rows from `row` of a panel.
    fn read(from: &Self::Panels, panel: usize, row: usize) -> Tile;
    /// Sums over the first `rows` rows of a panel's columns.
    fn column_sums(of: &Self::Panels, panel: usize, rows: usize) -> [f32; LANES];
    /// Room for a panel of `depth` rows.
    fn weight_panel(depth: usize) -> Self::WeightPanel;
    /// Stores a row of a panel of weights.
    fn set_weights(panel: &mut Self::WeightPanel, row: usize, values: &[f32; LANES]);
    /// Sixteen rows of `a` from `row`, times panels of weights.
    fn times_weights<const N: usize>(a: &Self::Panels, row: usize, b: &[Self::WeightPanel]) -> [Tile; N];
    /// `aᵀ b` over the first `rows` rows: a panel of `a`, times panels of `b` from the one given.
    fn transposed_times<const N: usize>(
        a: (&Self::Panels, usize),
        b: (&Self::Panels, usize),
        rows: usize,
    ) -> [Tile; N];
}

/// Panels that cover so many columns.
pub(crate) fn panels_of(columns: usize) -> usize {
    columns.div_ceil(LANES)
}

/// Weights as the second factor of products with a common depth, by panel.
#[derive(Clone, Debug)]
pub(crate) struct Weights<P: Precision> {
    depth: usize,
    columns: usize,
    panels: Vec<P::WeightPanel>,
}

impl<P: Precision> Weights<P> {
    pub(crate) fn new(depth: usize, columns: usize) -> Self {
        Self { depth, columns, panels: vec![P::weight_panel(depth); panels_of(columns)] }
    }

    /// Takes the entries `data[row * row_stride + column * column_stride]`.
    pub(crate) fn load(&mut self, data: &[f32], row_stride: usize, column_stride: usize) {
        let (depth, columns) = (self.depth, self.columns);
        self.panels.par_iter_mut().enumerate().for_each(|(p, panel)| {
            let width = LANES.min(columns - p * LANES);
            let mut values = [0.0; LANES];
            for row in 0..depth {
                let start = row * row_stride + p * LANES * column_stride;
                for (i, value) in values[..width].iter_mut().enumerate() {
                    *value = data[start + i * column_stride];
                }
                P::set_weights(panel, row, &values);
            }
        });
    }

    /// Calls `each` with every tile of the first `rows` rows of `a` times the weights: panel, first row, tile.
    pub(crate) fn multiply(&self, a: &P::Panels, rows: usize, mut each: impl FnMut(usize, usize, Tile)) {
        for (group, b) in self.panels.chunks(P::SUMMED_PANELS).enumerate() {
            let panel = group * P::SUMMED_PANELS;
            for row in (0..rows).step_by(LANES) {
                if b.len() == 2 {
                    let [first, second] = P::times_weights::<2>(a, row, b);
                    each(panel, row, first);
                    each(panel + 1, row, second);
                } else {
                    let [tile] = P::times_weights::<1>(a, row, b);
                    each(panel, row, tile);
                }
            }
        }
    }
}

/// Adds `aᵀ b` over the first `rows` rows to `out`, row-major, `a_columns × b_columns`.
pub(crate) fn add_transposed_product<P: Precision>(
    (a, a_columns): (&P::Panels, usize),
    (b, b_columns): (&P::Panels, usize),
    rows: usize,
    out: &mut [f32],
) {
    let mut add = |first: usize, panel: usize, tile: &Tile| {
        let width = LANES.min(b_columns - panel * LANES);
        let rows = LANES.min(a_columns - first * LANES);
        for (i, values) in tile[..rows].iter().enumerate() {
            let start = (first * LANES + i) * b_columns + panel * LANES;
            let out = &mut out[start..start + width];
            if let Ok(out) = <&mut [f32; LANES]>::try_from(&mut *out) {
                out.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            } else {
                out.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
            }
        }
    };
    let panels = panels_of(b_columns);
    for panel in (0..panels).step_by(P::SUMMED_PANELS) {
        for first in 0..panels_of(a_columns) {
            if P::SUMMED_PANELS.min(panels - panel) == 2 {
                let [left, right] = P::transposed_times::<2>((a, first), (b, panel), rows);
                add(first, panel, &left);
                add(first, panel + 1, &right);
            } else {
                let [tile] = P::transposed_times::<1>((a, first), (b, panel), rows);
                add(first, panel, &tile);
            }
        }
    }
}

/// Single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Single;

/// Panels of single-precision numbers.
#[derive(Clone, Debug)]
pub(crate) struct SinglePanels {
    rows: usize,
    data: Vec<[f32; LANES]>,
}

/// Whether there are AVX-512's thirty-two wide registers, and not sixteen of half the width.
const WIDE: bool = cfg!(target_feature = "avx512f");

impl Precision for Single {
    type Panels = SinglePanels;
    type WeightPanel = Vec<[f32; LANES]>;
    const SUMMED_PANELS: usize = if WIDE { 2 } else { 1 };

    fn panels(rows: usize, columns: usize) -> SinglePanels {
        SinglePanels { rows, data: vec![[0.0; LANES]; rows * panels_of(columns)] }
    }

    #[inline]
    fn write(to: &mut SinglePanels, panel: usize, row: usize, tile: &Tile) {
        to.data[panel * to.rows + row..][..LANES].copy_from_slice(tile);
    }

    #[inline]
    fn read(from: &SinglePanels, panel: usize, row: usize) -> Tile {
        from.data[panel * from.rows + row..][..LANES].try_into().expect("as many rows")
    }

    fn column_sums(of: &SinglePanels, panel: usize, rows: usize) -> [f32; LANES] {
        let mut sums = f32x16::ZERO;
        for row in &of.data[panel * of.rows..][..rows] {
            sums += f32x16::from(*row);
        }
        sums.to_array()
    }

    fn weight_panel(depth: usize) -> Self::WeightPanel {
        vec![[0.0; LANES]; depth.next_multiple_of(LANES)]
    }

    fn set_weights(panel: &mut Self::WeightPanel, row: usize, values: &[f32; LANES]) {
        panel[row] = *values;
    }

    #[inline(never)]
    fn times_weights<const N: usize>(a: &SinglePanels, row: usize, b: &[Self::WeightPanel]) -> [Tile; N] {
        let mut out = [[[0.0; LANES]; LANES]; N];
        if WIDE {
            rows_times::<8, N>(a, row, b, 0, &mut out);
            rows_times::<8, N>(a, row, b, 8, &mut out);
        } else {
            rows_times::<6, N>(a, row, b, 0, &mut out);
            rows_times::<6, N>(a, row, b, 6, &mut out);
            rows_times::<4, N>(a, row, b, 12, &mut out);
        }
        out
    }

    #[inline(never)]
    fn transposed_times<const N: usize>(
        (a, first): (&SinglePanels, usize),
        (b, panel): (&SinglePanels, usize),
        rows: usize,
    ) -> [Tile; N] {
        let mut out = [[[0.0; LANES]; LANES]; N];
        let a = &a.data[first * a.rows..][..rows];
        let b: [&[[f32; LANES]]; N] = std::array::from_fn(|n| &b.data[(panel + n) * b.rows..][..rows]);
        if WIDE {
            columns_times::<8, N>(a, b, 0, &mut out);
            columns_times::<8, N>(a, b, 8, &mut out);
        } else {
            columns_times::<6, N>(a, b, 0, &mut out);
            columns_times::<6, N>(a, b, 6, &mut out);
            columns_times::<4, N>(a, b, 12, &mut out);
        }
        out
    }
}

/// `M` rows of a tile from `part` on: those of `a`, from `row + part` on, times panels of weights.
#[inline(always)]
fn rows_times<const M: usize, const N: usize>(
    a: &SinglePanels,
    row: usize,
    b: &[Vec<[f32; LANES]>],
    part: usize,
    out: &mut [Tile; N],
) {
    let mut sums = [[f32x16::ZERO; N]; M];
    for chunk in 0..b[0].len() / LANES {
        let a: &[[f32; LANES]; M] =
            a.data[chunk * a.rows + row + part..][..M].try_into().expect("as many rows");
        let b: [&[[f32; LANES]; LANES]; N] =
            std::array::from_fn(|n| b[n][chunk * LANES..][..LANES].try_into().expect("as many rows"));
        for k in 0..LANES {
            for n in 0..N {
                let b = f32x16::from(b[n][k]);
                for m in 0..M {
                    sums[m][n] = Lane::mul_add(f32x16::splat(a[m][k]), b, sums[m][n]);
                }
            }
        }
    }
    store(&sums, part, out);
}

/// `M` rows of a tile from `part` on: those columns of a panel, transposed, times other panels.
#[inline(always)]
fn columns_times<const M: usize, const N: usize>(
    a: &[[f32; LANES]],
    b: [&[[f32; LANES]]; N],
    part: usize,
    out: &mut [Tile; N],
) {
    let mut sums = [[f32x16::ZERO; N]; M];
    let b = b.map(|b| &b[..a.len()]);
    for (k, a) in a.iter().enumerate() {
        let a: &[f32; M] = a[part..part + M].try_into().expect("as many columns");
        for n in 0..N {
            let b = f32x16::from(b[n][k]);
            for m in 0..M {
                sums[m][n] = Lane::mul_add(f32x16::splat(a[m]), b, sums[m][n]);
            }
        }
    }
    store(&sums, part, out);
}

fn store<const M: usize, const N: usize>(sums: &[[f32x16; N]; M], part: usize, out: &mut [Tile; N]) {
    for (m, row) in sums.iter().enumerate() {
        for (tile, value) in out.iter_mut().zip(row) {
            tile[part + m] = value.to_array();
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use spatial::{Philox, Purpose};

    use super::*;

    fn random(rows: usize, columns: usize, stream: usize) -> Vec<f32> {
        let mut random = Philox::new(1, stream, 0, 0, Purpose::Evaluation);
        (0..rows * columns).map(|_| random.uniform(-1.0, 1.0)).collect()
    }

    fn load<P: Precision>(matrix: &[f32], rows: usize, columns: usize) -> P::Panels {
        let padded = rows.next_multiple_of(LANES);
        let mut panels = P::panels(padded, columns);
        for panel in 0..panels_of(columns) {
            for row in (0..padded).step_by(LANES) {
                let entry = |i: usize, j: usize| {
                    let inside = i < rows && j < columns;
                    if inside { matrix[i * columns + j] } else { 0.0 }
                };
                let tile =
                    std::array::from_fn(|i| std::array::from_fn(|j| entry(row + i, panel * LANES + j)));
                P::write(&mut panels, panel, row, &tile);
            }
        }
        panels
    }

    /// Compares both products, and what is stored, with their definitions; `rounded` is what storing does to a number.
    pub(crate) fn products_match_their_definition<P: Precision>(rounded: impl Fn(f32) -> f32) {
        for (rows, depth, columns) in [(8, 16, 16), (13, 235, 37), (40, 50, 12), (24, 33, 1)] {
            let (a, b) = (random(rows, depth, 0), random(depth, columns, 1));
            let c = random(rows, columns, 2);
            let padded = rows.next_multiple_of(LANES);
            let panels = load::<P>(&a, rows, depth);
            let mut weights = Weights::<P>::new(depth, columns);
            // From the transposed matrix, as the forward pass takes them.
            let transposed: Vec<f32> =
                (0..columns * depth).map(|i| b[i % depth * columns + i / depth]).collect();
            weights.load(&transposed, 1, depth);
            weights.multiply(&panels, padded, |panel, row, tile| {
                for (i, values) in tile.iter().enumerate().filter(|(i, _)| row + i < rows) {
                    for (j, value) in values.iter().enumerate() {
                        let column = panel * LANES + j;
                        let expected: f64 = (0..depth)
                            .filter(|_| column < columns)
                            .map(|k| {
                                let a = f64::from(rounded(a[(row + i) * depth + k]));
                                a * f64::from(rounded(b[k * columns + column]))
                            })
                            .sum();
                        assert!((f64::from(*value) - expected).abs() < 3e-5, "{value} {expected}");
                    }
                }
            });
            let other = load::<P>(&c, rows, columns);
            let mut product = vec![1.0; depth * columns];
            add_transposed_product::<P>((&panels, depth), (&other, columns), padded, &mut product);
            for k in 0..depth {
                for j in 0..columns {
                    let terms = (0..rows).map(|i| {
                        f64::from(rounded(a[i * depth + k])) * f64::from(rounded(c[i * columns + j]))
                    });
                    let expected = 1.0 + terms.sum::<f64>();
                    let value = f64::from(product[k * columns + j]);
                    assert!((value - expected).abs() < 3e-5, "{value} {expected}");
                }
            }
            for j in 0..columns {
                let expected: f32 = (0..rows).map(|i| rounded(c[i * columns + j])).sum();
                let sums = P::column_sums(&other, j / LANES, padded);
                assert!((sums[j % LANES] - expected).abs() < 1e-5);
            }
            let tile = P::read(&other, 0, 0);
            assert_eq!(tile[1][0], rounded(c[columns]));
        }
    }

    #[test]
    fn single_precision_products_match_their_definition() {
        products_match_their_definition::<Single>(|x| x);
    }
}
