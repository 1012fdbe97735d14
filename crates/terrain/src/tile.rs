//! One tile of the grid, 8 m by 8 m, while it is being shaped.

use crate::height_field::Cell;

/// Edge of a tile \[m\].
pub const TILE_SIZE_M: f64 = 8.0;
/// Edge of a cell \[m\].
pub const CELL_SIZE_M: f64 = 0.1;
/// Cells along the edge of a tile.
pub const TILE_CELLS: usize = 80;

/// Half the edge of the square around the center in which a robot starts, in cells (1 m).
const START_CELLS: usize = 10;

/// The cells of a tile, `TILE_CELLS` × `TILE_CELLS`, x fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct TileCells {
    cells: Vec<Cell>,
}

impl TileCells {
    /// A level tile at height 0.
    pub fn flat() -> Self {
        Self { cells: vec![[0.0; 4]; TILE_CELLS * TILE_CELLS] }
    }

    /// Makes every cell level at `height(column, row)` \[m\], with vertical faces between unequal neighbors.
    pub fn set_cells(&mut self, height: impl Fn(usize, usize) -> f32) {
        for row in 0..TILE_CELLS {
            for column in 0..TILE_CELLS {
                self.cells[row * TILE_CELLS + column] = [height(column, row); 4];
            }
        }
    }

    /// Makes a continuous surface through `height(column, row)` \[m\] at the grid's vertices, `0..=TILE_CELLS`
    /// along each axis; called once for each, x fastest.
    pub fn set_vertices(&mut self, mut height: impl FnMut(usize, usize) -> f32) {
        const EDGE: usize = TILE_CELLS + 1;
        let vertices: Vec<f32> = (0..EDGE * EDGE).map(|i| height(i % EDGE, i / EDGE)).collect();
        for row in 0..TILE_CELLS {
            for column in 0..TILE_CELLS {
                let lower = &vertices[row * EDGE + column..][..2];
                let upper = &vertices[(row + 1) * EDGE + column..][..2];
                self.cells[row * TILE_CELLS + column] = [lower[0], lower[1], upper[0], upper[1]];
            }
        }
    }

    /// The cells of one row, along x.
    pub fn row(&self, row: usize) -> &[Cell] {
        &self.cells[row * TILE_CELLS..][..TILE_CELLS]
    }

    /// The highest point within 1 m of the center along x and y \[m\]: the ground on which a robot starts.
    pub fn start_height(&self) -> f32 {
        let square = TILE_CELLS / 2 - START_CELLS..TILE_CELLS / 2 + START_CELLS;
        let corners = square.clone().flat_map(|row| self.row(row)[square.clone()].iter().flatten());
        corners.copied().fold(f32::NEG_INFINITY, f32::max)
    }
}

/// Distance from the nearest edge of the tile, for a cell or vertex at (`column`, `row`) where `last` is the
/// greatest index along an axis: 0 on the edge itself.
pub(crate) fn edge_distance(column: usize, row: usize, last: usize) -> usize {
    column.min(row).min(last - column).min(last - row)
}
