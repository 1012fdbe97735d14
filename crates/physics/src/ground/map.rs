//! The height field as contacts are looked for in it: with a rim, and with what tells at once that there is nothing near.

use std::ops::BitOr;

use spatial::{Lane, Mask};
use terrain::{Cell, HeightField};

use super::wall::MIN_HEIGHT;

/// A height field with a rim of cells that go on level where it ends, so that every cell has neighbors.
#[derive(Clone, Debug)]
pub(crate) struct Map {
    /// World position of the first cell that is none of the rim's \[m\].
    origin: [f64; 2],
    pub(super) cell_size: f64,
    /// Cells along x and y, with the rim.
    columns: usize,
    rows: usize,
    /// For the lower corner of each cell the heights of the four cells that meet there: those of the cells below along both axes,
    /// above along x, above along y, and the cell itself, each in the order of a [`Cell`]. So all that a sphere near a corner can
    /// touch is in one cache line.
    pub(super) around_corner: Vec<[f32; 16]>,
    /// Highest corner of each cell and those around it \[m\]: by itself, as it is all that most spheres ask for.
    tops: Vec<f32>,
    /// What else there is in them.
    kinds: Vec<f32>,
    /// Highest corner within [`WIDE`] of each cell \[m\].
    ceilings: Vec<f32>,
}

/// How far around a robot's base its parts are expected \[m\]; what is further out is looked after by itself.
pub(super) const WIDE: f64 = 1.5;

/// What three by three cells hold, as bits.
const SLOPES: u8 = 1;
const WALLS: u8 = 2;

/// Where points are on the map.
pub(super) struct Spot<L> {
    /// Index of the cell, a whole number.
    cell: L,
    /// Position within the cell, 0 to 1.
    pub(super) u: L,
    pub(super) v: L,
}

impl Map {
    /// The map of a field.
    ///
    /// # Panics
    /// The field has 2²⁴ cells or more with its rim: a cell's index must be exact in single precision.
    pub(crate) fn new(field: &HeightField) -> Self {
        let (columns, rows) = (field.columns + 2, field.rows + 2);
        assert!(columns * rows < 1 << 24, "a field of {columns} × {rows} cells is too large");
        let cell = |i: usize| field.cell((i % columns) as i64 - 1, (i / columns) as i64 - 1);
        let cells: Vec<Cell> = (0..columns * rows).map(cell).collect();
        let (tops, kinds): (Vec<_>, Vec<_>) = (0..cells.len()).map(|i| inventory(&cells, columns, i)).unzip();
        let tops = widened(&widened(&tops, columns, 1, f32::max), rows, columns, f32::max);
        let mut ceilings = tops.clone();
        // However small the cells are, after as many passes as there are of them nothing is left to spread.
        let passes = (WIDE / f64::from(field.cell_size)).ceil() as usize;
        for _ in 0..passes.min(columns.max(rows)) {
            ceilings = widened(&widened(&ceilings, columns, 1, f32::max), rows, columns, f32::max);
        }
        let kinds = widened(&widened(&kinds, columns, 1, BitOr::bitor), rows, columns, BitOr::bitor);
        // A corner of the rim has no cells below: those at the other end stand in, and no sphere asks for them.
        let around = |i: usize| {
            let below = |stride: usize| cells[(i + cells.len() - stride) % cells.len()];
            let four = [below(columns + 1), below(columns), below(1), cells[i]];
            std::array::from_fn(|k| four[k / 4][k % 4])
        };
        Self {
            origin: field.origin.map(f64::from),
            cell_size: f64::from(field.cell_size),
            columns,
            rows,
            around_corner: (0..cells.len()).map(around).collect(),
            tops,
            ceilings,
            kinds: kinds.into_iter().map(f32::from).collect(),
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

    /// Highest ground \[m\] of the cell at a spot and those around it.
    #[inline(always)]
    pub(super) fn top<L: Lane>(&self, spot: &Spot<L>) -> L {
        self.lookup(&self.tops, spot)
    }

    /// Highest ground \[m\] within [`WIDE`] of a spot.
    #[inline(always)]
    pub(super) fn ceiling<L: Lane>(&self, spot: &Spot<L>) -> L {
        self.lookup(&self.ceilings, spot)
    }

    /// What else there is around a spot's cell.
    #[inline(always)]
    pub(super) fn surroundings<L: Lane>(&self, spot: &Spot<L>) -> Surroundings<L> {
        let kind = self.lookup(&self.kinds, spot);
        let above_slopes = L::splat(f64::from(WALLS));
        let walls = kind.ge(above_slopes);
        Surroundings { walls, slopes: walls.select(kind - above_slopes, kind).gt(L::zero()) }
    }

    #[inline(always)]
    fn lookup<L: Lane>(&self, table: &[f32], spot: &Spot<L>) -> L {
        let cells = spot.cell.indices(table.len());
        L::from_fn(|lane| f64::from(table[cells.as_ref()[lane] as usize]))
    }

    /// Heights of the four cells around the corner nearest to a spot, `upper` along x and y of its cell.
    #[inline(always)]
    pub(super) fn around_corner<L: Lane>(&self, spot: &Spot<L>, [upper_x, upper_y]: [L::Mask; 2]) -> [L; 16] {
        let step = |upper: L::Mask, stride: usize| upper.select(L::splat(stride as f64), L::zero());
        let corner = spot.cell + step(upper_x, 1) + step(upper_y, self.columns);
        L::gather(&self.around_corner, &corner.indices(self.around_corner.len()))
    }
}

/// What three by three cells hold.
pub(super) struct Surroundings<L: Lane> {
    /// There are vertical faces.
    pub(super) walls: L::Mask,
    /// There is something that is not level.
    pub(super) slopes: L::Mask,
}

/// Of one cell the highest corner; and whether a wall stands on its borders, whether it slopes or has a border too low for a
/// wall.
fn inventory(cells: &[Cell], columns: usize, i: usize) -> (f32, u8) {
    let [a, b, c, d] = cells[i];
    let (top, bottom) = (a.max(b).max(c.max(d)), a.min(b).min(c.min(d)));
    let (column, row) = (i % columns, i / columns);
    // The rim has no border outward.
    let beside = |here: usize, count: usize, stride: usize, there: [usize; 2], own: [f32; 2], upper: bool| {
        let inside = if upper { here + 1 < count } else { here > 0 };
        let other = inside.then(|| cells[if upper { i + stride } else { i - stride }]);
        other.map_or(0.0, |other| (other[there[0]] - own[0]).abs().max((other[there[1]] - own[1]).abs()))
    };
    let rows = cells.len() / columns;
    let steps = [
        beside(column, columns, 1, [0, 2], [b, d], true),
        beside(column, columns, 1, [1, 3], [a, c], false),
        beside(row, rows, columns, [0, 1], [c, d], true),
        beside(row, rows, columns, [2, 3], [a, b], false),
    ];
    let is_wall = |step: &&f32| f64::from(**step) > MIN_HEIGHT;
    let wall = steps.iter().any(|step| is_wall(&step));
    let uneven = top > bottom || steps.iter().any(|step| *step > 0.0 && !is_wall(&step));
    (top, if wall { WALLS } else { 0 } | if uneven { SLOPES } else { 0 })
}

/// Each cell's value `joined` with those of the two that are `stride` before and after it, along an axis of `count` cells; at its
/// ends, which are the rim's, the cell's alone.
fn widened<T: Copy>(values: &[T], count: usize, stride: usize, joined: impl Fn(T, T) -> T) -> Vec<T> {
    let widen = |(i, &own): (usize, &T)| {
        let place = i / stride % count;
        if place == 0 || place + 1 == count {
            return own;
        }
        joined(own, joined(values[i - stride], values[i + stride]))
    };
    values.iter().enumerate().map(widen).collect()
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
                let top = around.into_iter().flatten().fold(f32::MIN, f32::max);
                let [x, y] = [column, row].map(|i| (i as f64 + 0.5) * 0.1);
                let spot = map.spot(x, y);
                let found = map.surroundings(&spot);
                assert_eq!(map.top(&spot), f64::from(top));
                assert!(found.walls && !found.slopes);
            }
        }
    }

    /// A field whose heights all differ, and the highest within `width` \[m\] of a place along both axes.
    fn scattered(cell_size: f32) -> (HeightField, impl Fn([f64; 2], f64) -> f64) {
        let cells = (0..77).map(|i| [(i * 17 % 79) as f32; 4]).collect();
        let field = HeightField { cell_size, origin: [0.0; 2], columns: 11, rows: 7, cells };
        let own = field.clone();
        let highest = move |[x, y]: [f64; 2], width: f64| {
            let cells = |at: f64| {
                let index = |at: f64| (at / f64::from(cell_size)).floor() as i64;
                index(at - width)..=index(at + width)
            };
            let heights = cells(y).flat_map(|row| cells(x).map(move |column| (column, row)));
            heights.fold(f64::MIN, |top, (column, row)| top.max(f64::from(own.cell(column, row)[0])))
        };
        (field, highest)
    }

    #[test]
    fn a_ceiling_is_above_all_ground_within_its_width() {
        for cell_size in [0.25, 0.5, 0.7, 2.0] {
            let (field, highest) = scattered(cell_size);
            let map = Map::new(&field);
            for i in 0..500 {
                // Evenly scattered: multiples of the golden ratio and of the root of two.
                let [along_x, along_y] = [0.618_034, 0.414_214].map(|step| (f64::from(i) * step).fract());
                let size = f64::from(cell_size);
                let place = [11.0 * size * along_x, 7.0 * size * along_y];
                let ceiling = map.ceiling(&map.spot(place[0], place[1]));
                let (within, further) = (highest(place, WIDE), highest(place, WIDE + 2.0 * size));
                assert!(
                    (within..=further).contains(&ceiling),
                    "cells of {size} m, {place:?}: {ceiling}, must be {within} to {further}"
                );
            }
        }
    }

    #[test]
    fn no_cell_is_too_small_for_a_map() {
        let (field, _) = scattered(f32::MIN_POSITIVE);
        let map = Map::new(&field);
        assert_eq!(map.ceiling(&map.spot(0.0, 0.0)), 78.0);
    }

    #[test]
    fn places_outside_and_places_that_are_none_are_on_the_map() {
        let map = Map::new(&HeightField::flat(0.3));
        for x in [-1e30, f64::NEG_INFINITY, 1e30, f64::INFINITY, f64::NAN] {
            let spot = map.spot(x, 0.0);
            let found = map.surroundings(&spot);
            assert_eq!(map.top(&spot), f64::from(0.3_f32));
            assert!(!found.walls && !found.slopes);
        }
    }
}
