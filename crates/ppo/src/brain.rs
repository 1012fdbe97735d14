//! bf16 panels: products of numbers of eight bits' precision (Google Brain's format), summed in single precision by the
//! AVX-512 BF16 instructions. The only unsafe code of this crate.
//!
//! `vdpbf16ps` multiplies pairs that are neighbors in the dimension summed over. A panel is therefore stored twice: with
//! neighboring columns in a word, as the first factor of a product with weights, and with neighboring rows in a word, for the
//! products that sum over rows. Plain reference: `rounded.rs`; `panels.rs` tests the products of all against their definition.

#![allow(unsafe_code)]

use std::arch::x86_64::{
    __m256i, __m512, __m512bh, __m512i, _mm256_storeu_si256, _mm512_cvtepu16_epi32, _mm512_cvtneps_pbh,
    _mm512_dpbf16_ps, _mm512_loadu_ps, _mm512_loadu_si512, _mm512_or_si512, _mm512_set1_epi32,
    _mm512_setzero_ps, _mm512_slli_epi32, _mm512_storeu_ps, _mm512_storeu_si512,
};

use crate::{
    panels::{LANES, Precision, Tile, panels_of},
    rounded::bf16,
};

/// Words of a row of a panel.
const PAIRS: usize = LANES / 2;
/// Rows of a tile whose sums fit in registers beside what is multiplied.
const SUMMED_ROWS: usize = 8;

/// Products in bf16, sums in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Brain;

impl Brain {
    /// Whether this processor has the instructions.
    pub(crate) fn available() -> bool {
        is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512bf16")
    }
}

/// Panels of bf16 numbers. They are made only where the processor has the instructions, so whoever holds one may use them.
#[derive(Clone, Debug)]
pub(crate) struct BrainPanels {
    rows: usize,
    /// Words of two neighboring columns, `panels × rows`.
    by_columns: Vec<[u32; PAIRS]>,
    /// Words of two neighboring rows, `panels × rows / 2`.
    by_rows: Vec<[u32; LANES]>,
}

/// Upper and lower number of a word.
fn halves(word: u32) -> [f32; 2] {
    [f32::from_bits(word << 16), f32::from_bits(word & 0xffff_0000)]
}

impl Precision for Brain {
    type Panels = BrainPanels;
    type WeightPanel = Vec<[u32; LANES]>;
    const SUMMED_PANELS: usize = 2;

    fn panels(rows: usize, columns: usize) -> BrainPanels {
        assert!(Self::available(), "bf16 needs a processor with AVX-512 BF16");
        let panels = panels_of(columns);
        BrainPanels {
            rows,
            by_columns: vec![[0; PAIRS]; rows * panels],
            by_rows: vec![[0; LANES]; rows / 2 * panels],
        }
    }

    fn write(to: &mut BrainPanels, panel: usize, row: usize, tile: &Tile) {
        let start = panel * to.rows + row;
        let by_columns = (&mut to.by_columns[start..start + LANES]).try_into().expect("as many rows");
        let by_rows = (&mut to.by_rows[start / 2..][..PAIRS]).try_into().expect("as many rows");
        // SAFETY: `to` exists, so the processor has the instructions.
        unsafe { convert(tile, by_columns, by_rows) }
    }

    fn read(from: &BrainPanels, panel: usize, row: usize) -> Tile {
        let words = &from.by_columns[panel * from.rows + row..][..LANES];
        std::array::from_fn(|i| std::array::from_fn(|j| halves(words[i][j / 2])[j % 2]))
    }

    fn column_sums(of: &BrainPanels, panel: usize, rows: usize) -> [f32; LANES] {
        let mut sums = [0.0; LANES];
        for words in &of.by_rows[panel * of.rows / 2..][..rows / 2] {
            for (sum, &word) in sums.iter_mut().zip(words) {
                let [first, second] = halves(word);
                *sum += first + second;
            }
        }
        sums
    }

    fn weight_panel(depth: usize) -> Self::WeightPanel {
        vec![[0; LANES]; depth.next_multiple_of(LANES) / 2]
    }

    fn set_weights(panel: &mut Self::WeightPanel, row: usize, values: &[f32; LANES]) {
        for (word, value) in panel[row / 2].iter_mut().zip(values) {
            let (kept, shift) = if row.is_multiple_of(2) { (0xffff_0000, 0) } else { (0x0000_ffff, 16) };
            *word = *word & kept | bf16(*value) << shift;
        }
    }

    fn times_weights<const N: usize>(a: &BrainPanels, row: usize, b: &[Self::WeightPanel]) -> [Tile; N] {
        let mut out = [[[0.0; LANES]; LANES]; N];
        for part in (0..LANES).step_by(SUMMED_ROWS) {
            // SAFETY: `a` exists, so the processor has the instructions.
            unsafe { rows_times(a, row, b, part, &mut out) };
        }
        out
    }

    fn transposed_times<const N: usize>(
        (a, first): (&BrainPanels, usize),
        (b, panel): (&BrainPanels, usize),
        rows: usize,
    ) -> [Tile; N] {
        let pairs = rows / 2;
        let a = &a.by_rows[first * a.rows / 2..][..pairs];
        let b = std::array::from_fn(|n| &b.by_rows[(panel + n) * b.rows / 2..][..pairs]);
        let mut out = [[[0.0; LANES]; LANES]; N];
        for part in (0..LANES).step_by(SUMMED_ROWS) {
            // SAFETY: panels exist, so the processor has the instructions.
            unsafe { columns_times(a, b, part, &mut out) };
        }
        out
    }
}

/// Rounds a tile and stores it in both forms.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
fn convert(tile: &Tile, by_columns: &mut [[u32; PAIRS]; LANES], by_rows: &mut [[u32; LANES]; PAIRS]) {
    for i in 0..PAIRS {
        let wide: [__m512i; 2] = std::array::from_fn(|half| {
            // SAFETY: the pointers are those of sixteen numbers and of eight words; both formats of 256 bits are plain bits.
            unsafe {
                let values = _mm512_loadu_ps(tile[2 * i + half].as_ptr());
                let narrow: __m256i = std::mem::transmute(_mm512_cvtneps_pbh(values));
                _mm256_storeu_si256(by_columns[2 * i + half].as_mut_ptr().cast(), narrow);
                _mm512_cvtepu16_epi32(narrow)
            }
        });
        let pairs = _mm512_or_si512(wide[0], _mm512_slli_epi32::<16>(wide[1]));
        // SAFETY: the pointer is that of sixteen words.
        unsafe { _mm512_storeu_si512(by_rows[i].as_mut_ptr().cast(), pairs) };
    }
}

/// The same pair in all places.
#[target_feature(enable = "avx512f,avx512bf16")]
fn splat(word: u32) -> __m512bh {
    // SAFETY: both are 512 plain bits.
    unsafe { std::mem::transmute(_mm512_set1_epi32(word.cast_signed())) }
}

#[target_feature(enable = "avx512f,avx512bf16")]
fn load(words: &[u32; LANES]) -> __m512bh {
    // SAFETY: the pointer is that of sixteen words; both are 512 plain bits.
    unsafe { std::mem::transmute(_mm512_loadu_si512(words.as_ptr().cast())) }
}

/// Rows of a tile from `part` on: those of `a`, from `row + part` on, times panels of weights.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
fn rows_times<const N: usize>(
    a: &BrainPanels,
    row: usize,
    b: &[Vec<[u32; LANES]>],
    part: usize,
    out: &mut [Tile; N],
) {
    let mut sums = [[_mm512_setzero_ps(); N]; SUMMED_ROWS];
    for chunk in 0..b[0].len() / PAIRS {
        let a: &[[u32; PAIRS]; SUMMED_ROWS] =
            a.by_columns[chunk * a.rows + row + part..][..SUMMED_ROWS].try_into().expect("as many rows");
        let b: [&[[u32; LANES]; PAIRS]; N] =
            std::array::from_fn(|n| b[n][chunk * PAIRS..][..PAIRS].try_into().expect("as many rows"));
        for k in 0..PAIRS {
            for n in 0..N {
                let b = load(&b[n][k]);
                for m in 0..SUMMED_ROWS {
                    sums[m][n] = _mm512_dpbf16_ps(sums[m][n], splat(a[m][k]), b);
                }
            }
        }
    }
    store(&sums, part, out);
}

/// Rows of a tile from `part` on: those columns of a panel, transposed, times other panels.
#[target_feature(enable = "avx512f,avx512bw,avx512bf16")]
fn columns_times<const N: usize>(
    a: &[[u32; LANES]],
    b: [&[[u32; LANES]]; N],
    part: usize,
    out: &mut [Tile; N],
) {
    let mut sums = [[_mm512_setzero_ps(); N]; SUMMED_ROWS];
    let b = b.map(|b| &b[..a.len()]);
    for (k, a) in a.iter().enumerate() {
        let a: &[u32; SUMMED_ROWS] = a[part..part + SUMMED_ROWS].try_into().expect("as many columns");
        for n in 0..N {
            let b = load(&b[n][k]);
            for m in 0..SUMMED_ROWS {
                sums[m][n] = _mm512_dpbf16_ps(sums[m][n], splat(a[m]), b);
            }
        }
    }
    store(&sums, part, out);
}

#[target_feature(enable = "avx512f")]
fn store<const N: usize>(sums: &[[__m512; N]; SUMMED_ROWS], part: usize, out: &mut [Tile; N]) {
    for (m, row) in sums.iter().enumerate() {
        for (tile, value) in out.iter_mut().zip(row) {
            // SAFETY: the pointer is that of sixteen numbers.
            unsafe { _mm512_storeu_ps(tile[part + m].as_mut_ptr(), *value) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_match_their_definition() {
        if Brain::available() {
            crate::panels::tests::products_match_their_definition::<Brain>(crate::rounded::nearest);
        } else {
            eprintln!("skipped: this processor has no AVX-512 BF16");
        }
    }
}
