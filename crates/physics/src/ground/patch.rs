//! The four cells around the corner nearest to a point.

use std::array;

use spatial::{Lane, Mask};

use super::map::{Map, Spot};

/// Heights at a cell's corners, named from the corner all four cells share \[m\].
#[derive(Clone, Copy, Debug)]
pub(super) struct Corners<L> {
    /// At the shared corner.
    pub(super) at: L,
    /// At the cell's other end along x, along y, and diagonally across.
    pub(super) x: L,
    pub(super) y: L,
    pub(super) opposite: L,
}

/// What a point has around it: its own cell and the three that share the nearest corner with it.
///
/// The corner is the origin, and each axis is turned so that the own cell lies in the positive quadrant; so what is said
/// of one quadrant holds for all four. Heights are above the own cell's at the corner.
pub(super) struct Patch<L: Lane> {
    /// The point, 0 to half a cell \[m\].
    pub(super) x: L,
    pub(super) y: L,
    /// What an axis here is in the world, ±1.
    pub(super) sign_x: L,
    pub(super) sign_y: L,
    /// World height of the own cell at the corner \[m\].
    pub(super) base: L,
    /// The own cell is split along the diagonal through the corner, and so is the one across; the two beside are then
    /// split along the other. Unset it is the other way around.
    pub(super) split_here: L::Mask,
    pub(super) own: Corners<L>,
    pub(super) beside_x: Corners<L>,
    pub(super) beside_y: Corners<L>,
    pub(super) across: Corners<L>,
    /// Edge of a cell \[m\].
    pub(super) size: L,
}

impl<L: Lane> Patch<L> {
    /// Around a spot of the map.
    #[inline(never)]
    pub(super) fn around(map: &Map, spot: &Spot<L>) -> Self {
        let half = L::splat(0.5);
        let size = L::splat(map.cell_size);
        let (upper_x, upper_y) = (spot.u.ge(half), spot.v.ge(half));
        let sign = |upper: L::Mask| upper.select(-L::one(), L::one());
        let (sign_x, sign_y) = (sign(upper_x), sign(upper_y));
        // To turn an axis around is to swap what is numbered 0 and 1 along it: cells as well as their corners.
        let heights = map.around_corner(spot, [upper_x, upper_y]);
        let heights: [L; 16] = array::from_fn(|k| upper_x.select(heights[k ^ 0b01_01], heights[k]));
        let heights: [L; 16] = array::from_fn(|k| upper_y.select(heights[k ^ 0b10_10], heights[k]));
        let [across, beside_y, beside_x, own] = array::from_fn(|cell| {
            let from_corner = |turned: usize| heights[4 * cell + (3 ^ cell ^ turned)];
            let [at, x, y, opposite] = array::from_fn(from_corner);
            Corners { at, x, y, opposite }
        });
        let base = own.at;
        let level = |corners: Corners<L>| Corners {
            at: corners.at - base,
            x: corners.x - base,
            y: corners.y - base,
            opposite: corners.opposite - base,
        };
        Self {
            x: upper_x.select(L::one() - spot.u, spot.u) * size,
            y: upper_y.select(L::one() - spot.v, spot.v) * size,
            sign_x,
            sign_y,
            base,
            split_here: (sign_x * sign_y).gt(L::zero()),
            own: level(own),
            beside_x: level(beside_x),
            beside_y: level(beside_y),
            across: level(across),
            size,
        }
    }
}

#[cfg(test)]
mod tests {
    use terrain::HeightField;

    use super::*;

    /// Heights that say where they are: 100 · column + 10 · row + corner.
    fn labeled() -> HeightField {
        let label = |i: usize| std::array::from_fn(|k| (100 * (i % 3) + 10 * (i / 3) + k) as f32);
        HeightField {
            cell_size: 0.1,
            origin: [0.0; 2],
            columns: 3,
            rows: 3,
            cells: (0..9).map(label).collect(),
        }
    }

    fn around(x: f64, y: f64) -> Patch<f64> {
        let map = Map::new(&labeled());
        Patch::around(&map, &map.spot(x, y))
    }

    fn heights(patch: &Patch<f64>, corners: Corners<f64>) -> [f64; 4] {
        [corners.at, corners.x, corners.y, corners.opposite].map(|h| h + patch.base)
    }

    #[test]
    fn four_cells_seen_from_their_shared_corner() {
        // In the middle cell, near its corner (x1, y0).
        let patch = around(0.18, 0.11);
        assert!((patch.x - 0.02).abs() < 1e-6 && (patch.y - 0.01).abs() < 1e-6);
        assert_eq!((patch.sign_x, patch.sign_y, patch.split_here), (-1.0, 1.0, false));
        assert_eq!(heights(&patch, patch.own), [111.0, 110.0, 113.0, 112.0]);
        assert_eq!(heights(&patch, patch.beside_x), [210.0, 211.0, 212.0, 213.0]);
        assert_eq!(heights(&patch, patch.beside_y), [103.0, 102.0, 101.0, 100.0]);
        assert_eq!(heights(&patch, patch.across), [202.0, 203.0, 200.0, 201.0]);
    }

    #[test]
    fn where_the_field_ends_the_border_goes_on_level() {
        for x in [0.29, 0.3, 7.0] {
            let patch = around(x, 0.16);
            assert_eq!(heights(&patch, patch.own), [213.0, 212.0, 211.0, 210.0]);
            assert_eq!(heights(&patch, patch.beside_x), [213.0, 213.0, 211.0, 211.0]);
            assert_eq!(heights(&patch, patch.across), [221.0, 221.0, 223.0, 223.0]);
        }
    }
}
