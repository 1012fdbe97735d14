//! bf16 in single precision: every number is rounded to eight bits' precision (Google Brain's format) when it is stored, and
//! multiplied as single precision is. A product of two such numbers is exact, so this is what `brain.rs` computes but for the
//! order of its sums: its plain reference, and its stand-in on processors without its instructions, a little slower than f32.

use crate::panels::{LANES, Precision, Single, SinglePanels, Tile};

/// Products of bf16 numbers, sums in single precision, on any processor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rounded;

impl Precision for Rounded {
    type Panels = SinglePanels;
    type WeightPanel = <Single as Precision>::WeightPanel;
    const SUMMED_PANELS: usize = Single::SUMMED_PANELS;

    fn panels(rows: usize, columns: usize) -> SinglePanels {
        Single::panels(rows, columns)
    }

    fn write(to: &mut SinglePanels, panel: usize, row: usize, tile: &Tile) {
        Single::write(to, panel, row, &tile.map(|values| values.map(nearest)));
    }

    fn read(from: &SinglePanels, panel: usize, row: usize) -> Tile {
        Single::read(from, panel, row)
    }

    fn column_sums(of: &SinglePanels, panel: usize, rows: usize) -> [f32; LANES] {
        Single::column_sums(of, panel, rows)
    }

    fn weight_panel(depth: usize) -> Self::WeightPanel {
        Single::weight_panel(depth)
    }

    fn set_weights(panel: &mut Self::WeightPanel, row: usize, values: &[f32; LANES]) {
        Single::set_weights(panel, row, &values.map(nearest));
    }

    fn times_weights<const N: usize>(a: &SinglePanels, row: usize, b: &[Self::WeightPanel]) -> [Tile; N] {
        Single::times_weights(a, row, b)
    }

    fn transposed_times<const N: usize>(
        a: (&SinglePanels, usize),
        b: (&SinglePanels, usize),
        rows: usize,
    ) -> [Tile; N] {
        Single::transposed_times(a, b, rows)
    }
}

/// The nearest bf16 number.
pub(crate) fn nearest(value: f32) -> f32 {
    f32::from_bits(bf16(value) << 16)
}

/// The bits of the nearest bf16 number, ties to even, in the lower half; what is not a number stays so.
pub(crate) fn bf16(value: f32) -> u32 {
    let bits = value.to_bits();
    if value.is_nan() { bits >> 16 | 0x40 } else { bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_match_their_definition() {
        crate::panels::tests::products_match_their_definition::<Rounded>(nearest);
    }

    #[test]
    fn rounding_is_to_the_nearest_and_keeps_what_is_no_number() {
        assert_eq!(nearest(1.0 + 1.0 / 256.0), 1.0);
        assert_eq!(nearest(1.0 + 3.0 / 256.0), 1.0 + 4.0 / 256.0);
        assert!(nearest(f32::NAN).is_nan() && nearest(f32::from_bits(0x7fff_ffff)).is_nan());
        assert_eq!(nearest(f32::NEG_INFINITY), f32::NEG_INFINITY);
    }
}
