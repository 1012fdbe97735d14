//! The four cells around the corner nearest to a point.

use spatial::{Lane, Mask};
use terrain::HeightField;

/// No lane type is wider.
const MAX_WIDTH: usize = 16;

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
/// of one quadrant holds for all four. Heights are above the own cell's at the corner. Where the field ends, the
/// border goes on level outward.
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

/// One axis of a lane's cell.
#[derive(Clone, Copy)]
struct Axis {
    /// Index of the own cell, and of the one beside; the same where the field ends.
    own: usize,
    beside: usize,
    /// The corner is the cell's upper end.
    upper: bool,
}

impl Axis {
    #[inline(always)]
    fn new(index: usize, within: f64, count: usize) -> Self {
        let own = index.min(count - 1);
        let upper = within >= 0.5;
        let beside = if upper { (own + 1).min(count - 1) } else { own.saturating_sub(1) };
        Self { own, beside, upper }
    }

    /// Cell index, and which of its two ends is at the corner and which is far from it.
    #[inline(always)]
    fn cell(self, beside: bool) -> (usize, usize, usize) {
        let upper = usize::from(self.upper);
        match beside {
            false => (self.own, upper, 1 - upper),
            true if self.beside == self.own => (self.own, upper, upper),
            true => (self.beside, 1 - upper, upper),
        }
    }
}

impl<L: Lane> Patch<L> {
    /// Around the world position (x, y) \[m\]; positions outside the field are moved to its border.
    #[inline(always)]
    pub(super) fn around(ground: &HeightField, x: L, y: L) -> Self {
        let size = L::splat(f64::from(ground.cell_size));
        let inverse = L::splat(1.0 / f64::from(ground.cell_size));
        let along = |position: L, start: f32, count: usize| {
            let cells =
                ((position - L::splat(f64::from(start))) * inverse).clamp(L::zero(), L::splat(count as f64));
            let index = cells.floor().min(L::splat((count - 1) as f64));
            (index, cells - index)
        };
        let (column, u) = along(x, ground.origin[0], ground.columns);
        let (row, v) = along(y, ground.origin[1], ground.rows);
        let mut axes = [[Axis { own: 0, beside: 0, upper: false }; 2]; MAX_WIDTH];
        for (lane, axes) in axes.iter_mut().enumerate().take(L::WIDTH) {
            axes[0] = Axis::new(column.index(lane), u.get(lane), ground.columns);
            axes[1] = Axis::new(row.index(lane), v.get(lane), ground.rows);
        }
        let half = L::splat(0.5);
        let (upper_x, upper_y) = (u.ge(half), v.ge(half));
        let sign = |upper: L::Mask| upper.select(-L::one(), L::one());
        let (sign_x, sign_y) = (sign(upper_x), sign(upper_y));
        let own = gather(ground, &axes, [false, false]);
        let level = |corners: Corners<L>| Corners {
            at: corners.at - own.at,
            x: corners.x - own.at,
            y: corners.y - own.at,
            opposite: corners.opposite - own.at,
        };
        Self {
            x: upper_x.select(L::one() - u, u) * size,
            y: upper_y.select(L::one() - v, v) * size,
            sign_x,
            sign_y,
            base: own.at,
            split_here: (sign_x * sign_y).gt(L::zero()),
            own: level(own),
            beside_x: level(gather(ground, &axes, [true, false])),
            beside_y: level(gather(ground, &axes, [false, true])),
            across: level(gather(ground, &axes, [true, true])),
            size,
        }
    }

    /// Highest and lowest of all corners \[m\], above the base.
    #[inline(always)]
    pub(super) fn range(&self) -> (L, L) {
        let cells = [&self.own, &self.beside_x, &self.beside_y, &self.across];
        cells.iter().fold((L::zero(), L::zero()), |(top, bottom), cell| {
            let [a, b, c, d] = [cell.at, cell.x, cell.y, cell.opposite];
            (top.max(a.max(b).max(c.max(d))), bottom.min(a.min(b).min(c.min(d))))
        })
    }
}

/// Corner heights of the own cell, or of one `beside` along x, along y or both.
#[inline(always)]
fn gather<L: Lane>(ground: &HeightField, axes: &[[Axis; 2]; MAX_WIDTH], beside: [bool; 2]) -> Corners<L> {
    let zero = L::zero();
    let mut corners = Corners { at: zero, x: zero, y: zero, opposite: zero };
    for (lane, [x, y]) in axes.iter().enumerate().take(L::WIDTH) {
        let (column, near_x, far_x) = x.cell(beside[0]);
        let (row, near_y, far_y) = y.cell(beside[1]);
        let cell = &ground.cells[row * ground.columns + column];
        let height = |x: usize, y: usize| f64::from(cell[x + 2 * y]);
        corners.at.set(lane, height(near_x, near_y));
        corners.x.set(lane, height(far_x, near_y));
        corners.y.set(lane, height(near_x, far_y));
        corners.opposite.set(lane, height(far_x, far_y));
    }
    corners
}

#[cfg(test)]
mod tests {
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

    fn heights(patch: &Patch<f64>, corners: Corners<f64>) -> [f64; 4] {
        [corners.at, corners.x, corners.y, corners.opposite].map(|h| h + patch.base)
    }

    #[test]
    fn four_cells_seen_from_their_shared_corner() {
        // In the middle cell, near its corner (x1, y0).
        let patch = Patch::around(&labeled(), 0.18, 0.11);
        assert!((patch.x - 0.02).abs() < 1e-6 && (patch.y - 0.01).abs() < 1e-6);
        assert_eq!((patch.sign_x, patch.sign_y, patch.split_here), (-1.0, 1.0, false));
        assert_eq!(heights(&patch, patch.own), [111.0, 110.0, 113.0, 112.0]);
        assert_eq!(heights(&patch, patch.beside_x), [210.0, 211.0, 212.0, 213.0]);
        assert_eq!(heights(&patch, patch.beside_y), [103.0, 102.0, 101.0, 100.0]);
        assert_eq!(heights(&patch, patch.across), [202.0, 203.0, 200.0, 201.0]);
        assert_eq!(patch.range(), (102.0, -11.0));
    }

    #[test]
    fn where_the_field_ends_the_border_goes_on_level() {
        for x in [0.29, 0.3, 7.0] {
            let patch = Patch::around(&labeled(), x, 0.16);
            assert_eq!(heights(&patch, patch.own), [213.0, 212.0, 211.0, 210.0]);
            assert_eq!(heights(&patch, patch.beside_x), [213.0, 213.0, 211.0, 211.0]);
            assert_eq!(heights(&patch, patch.across), [221.0, 221.0, 223.0, 223.0]);
        }
    }
}
