//! The four cells around the corner nearest to a point.

use spatial::{Lane, Mask};
use terrain::Cell;

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
    #[inline(always)]
    pub(super) fn around(map: &Map, spot: &Spot<L>) -> Self {
        let half = L::splat(0.5);
        let size = L::splat(map.cell_size);
        let (upper_x, upper_y) = (spot.u.ge(half), spot.v.ge(half));
        let sign = |upper: L::Mask| upper.select(-L::one(), L::one());
        let (sign_x, sign_y) = (sign(upper_x), sign(upper_y));
        // The number of the own cell's corner: 1 along x, 2 along y.
        let corner = upper_x.select(L::one(), L::zero()) + upper_y.select(L::splat(2.0), L::zero());
        let nothing = Corners { at: L::zero(), x: L::zero(), y: L::zero(), opposite: L::zero() };
        let [mut own, mut beside_x, mut beside_y, mut across] = [nothing; 4];
        // A position that is no number has the index of the rim's first cell, which has no neighbors.
        let (first, last) = (map.columns + 1, map.cells.len() - map.columns - 2);
        for lane in 0..L::WIDTH {
            let (cell, corner) = (spot.cell.index(lane).clamp(first, last), corner.index(lane));
            let column = if corner & 1 == 1 { cell + 1 } else { cell - 1 };
            let rows = if corner & 2 == 2 { map.columns as isize } else { -(map.columns as isize) };
            let row = |cell: usize| cell.wrapping_add_signed(rows);
            own.read(lane, &map.cells[cell], corner);
            beside_x.read(lane, &map.cells[column], corner ^ 1);
            beside_y.read(lane, &map.cells[row(cell)], corner ^ 2);
            across.read(lane, &map.cells[row(column)], corner ^ 3);
        }
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

impl<L: Lane> Corners<L> {
    /// Takes the heights of a cell as seen from its corner of number `corner`.
    #[inline(always)]
    fn read(&mut self, lane: usize, cell: &Cell, corner: usize) {
        self.at.set(lane, f64::from(cell[corner & 3]));
        self.x.set(lane, f64::from(cell[(corner ^ 1) & 3]));
        self.y.set(lane, f64::from(cell[(corner ^ 2) & 3]));
        self.opposite.set(lane, f64::from(cell[(corner ^ 3) & 3]));
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
