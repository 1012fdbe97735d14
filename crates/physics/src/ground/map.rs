//! The height field as contacts are looked for in it: with a rim, and with what tells at once that there is nothing near.

use spatial::Lane;
use terrain::{Cell, HeightField};

/// A height field with a rim of cells that go on level where it ends, so that every cell has neighbors.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    /// World position of the first cell that is none of the rim's \[m\].
    origin: [f64; 2],
    pub(super) cell_size: f64,
    /// Cells along x and y, with the rim.
    pub(super) columns: usize,
    rows: usize,
    pub(super) cells: Vec<Cell>,
    /// Highest and lowest corner of each cell and those around it \[m\].
    bounds: Vec<[f32; 2]>,
}

/// Where points are on the map.
pub(super) struct Spot<L> {
    /// Index of the cell.
    pub(super) cell: L,
    /// Position within the cell, 0 to 1.
    pub(super) u: L,
    pub(super) v: L,
}

impl Map {
    /// The map of a field.
    ///
    /// # Panics
    /// The field has 2²⁴ cells or more: a cell's index must be exact in single precision.
    pub(crate) fn new(field: &HeightField) -> Self {
        let (columns, rows) = (field.columns + 2, field.rows + 2);
        assert!(columns * rows < 1 << 24, "a field of {columns} × {rows} cells is too large");
        let cell = |i: usize| {
            let (column, row) = ((i % columns) as i64 - 1, (i / columns) as i64 - 1);
            let [mut a, mut b, mut c, mut d] = field.cell(column, row);
            // Beyond an end both corners along that axis are as high as the end.
            if column < 0 {
                (b, d) = (a, c);
            } else if column == field.columns as i64 {
                (a, c) = (b, d);
            }
            if row < 0 {
                (c, d) = (a, b);
            } else if row == field.rows as i64 {
                (a, b) = (c, d);
            }
            [a, b, c, d]
        };
        let cells: Vec<Cell> = (0..columns * rows).map(cell).collect();
        let own = cells.iter().map(|cell| {
            let [a, b, c, d] = *cell;
            [a.max(b).max(c.max(d)), a.min(b).min(c.min(d))]
        });
        let along_x = widened(&own.collect::<Vec<_>>(), columns, 1);
        Self {
            origin: field.origin.map(f64::from),
            cell_size: f64::from(field.cell_size),
            columns,
            rows,
            bounds: widened(&along_x, rows, columns),
            cells,
        }
    }

    /// Where the world position (x, y) \[m\] is; positions outside the field are moved to its border.
    #[inline(always)]
    pub(super) fn spot<L: Lane>(&self, x: L, y: L) -> Spot<L> {
        let inverse = L::splat(1.0 / self.cell_size);
        let along = |position: L, start: f64, count: usize| {
            let cells = ((position - L::splat(start)) * inverse).clamp(L::zero(), L::splat(count as f64));
            let index = cells.floor().min(L::splat((count - 1) as f64));
            (index, cells - index)
        };
        let (column, u) = along(x, self.origin[0], self.columns - 2);
        let (row, v) = along(y, self.origin[1], self.rows - 2);
        let cell = (row + L::one()).mul_add(L::splat(self.columns as f64), column + L::one());
        Spot { cell, u, v }
    }

    /// Highest and lowest ground \[m\] of the cell at a spot and those around it.
    #[inline(always)]
    pub(super) fn bounds<L: Lane>(&self, spot: &Spot<L>) -> [L; 2] {
        let [mut top, mut bottom] = [L::zero(); 2];
        for lane in 0..L::WIDTH {
            let [high, low] = self.bounds[spot.cell.index(lane)];
            top.set(lane, f64::from(high));
            bottom.set(lane, f64::from(low));
        }
        [top, bottom]
    }
}

/// Bounds of each cell and of the two that are `stride` before and after it, along an axis of `count` cells; at its ends,
/// which are the rim's, of the cell alone.
fn widened(bounds: &[[f32; 2]], count: usize, stride: usize) -> Vec<[f32; 2]> {
    let widen = |(i, &[top, bottom]): (usize, &[f32; 2])| {
        let place = i / stride % count;
        if place == 0 || place + 1 == count {
            return [top, bottom];
        }
        let [before, after] = [bounds[i - stride], bounds[i + stride]];
        [top.max(before[0]).max(after[0]), bottom.min(before[1]).min(after[1])]
    };
    bounds.iter().enumerate().map(widen).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_those_of_three_by_three_cells() {
        let cells = (0..35).map(|i| [(i * 17 % 23) as f32; 4]).collect();
        let field = HeightField { cell_size: 0.1, origin: [0.0; 2], columns: 7, rows: 5, cells };
        let map = Map::new(&field);
        for row in 0..5_i64 {
            for column in 0..7_i64 {
                let beside = [-1, 0, 1];
                let around = beside.map(|dy| beside.map(|dx| field.cell(column + dx, row + dy)[0]));
                let (top, bottom) = around
                    .iter()
                    .flatten()
                    .fold((f32::MIN, f32::MAX), |(top, bottom), &h| (top.max(h), bottom.min(h)));
                let [x, y] = [column, row].map(|i| (i as f64 + 0.5) * 0.1);
                assert_eq!(map.bounds(&map.spot(x, y)), [top, bottom].map(f64::from));
            }
        }
    }

    #[test]
    fn places_outside_and_places_that_are_none_are_on_the_map() {
        let map = Map::new(&HeightField::flat(0.3));
        for x in [-1e30, f64::NEG_INFINITY, 1e30, f64::INFINITY, f64::NAN] {
            let spot = map.spot(x, 0.0);
            assert_eq!(map.bounds(&spot), [f64::from(0.3_f32); 2]);
        }
    }
}
