//! The ground: a grid of cells whose four corners each have a height of their own.
//!
//! Neighboring cells that share corner heights make a continuous surface (slopes, roughness); cells that do not
//! make a vertical face between them, as high as the difference (stairs, boxes). So a riser is a wall, not a ramp one
//! cell wide, and a query needs one 16-byte load.

/// Corner heights of a cell \[m\]: at (x0, y0), (x1, y0), (x0, y1), (x1, y1).
pub type Cell = [f32; 4];

/// Ground over a rectangle; outside it the border cells go on flat.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// Edge of a square cell \[m\].
    pub cell_size: f32,
    /// World position of the corner (x0, y0) of the first cell \[m\].
    pub origin: [f32; 2],
    /// Cells along x.
    pub columns: usize,
    /// Cells along y.
    pub rows: usize,
    /// Cells, x fastest: `cells[row * columns + column]`.
    pub cells: Vec<Cell>,
}

impl HeightField {
    /// Level ground at height `z` \[m\] everywhere.
    pub fn flat(z: f32) -> Self {
        Self { cell_size: 0.1, origin: [-0.05, -0.05], columns: 1, rows: 1, cells: vec![[z; 4]] }
    }

    /// Index of the cell under the world position (x, y) \[m\], clamped to the field.
    #[inline(always)]
    pub fn cell_at(&self, x: f32, y: f32) -> (usize, usize) {
        let index = |position: f32, start: f32, count: usize| {
            // A float-to-integer cast saturates, so far-away and non-finite positions stay inside.
            ((position - start) / self.cell_size) as usize
        };
        let column = index(x, self.origin[0], self.columns).min(self.columns - 1);
        let row = index(y, self.origin[1], self.rows).min(self.rows - 1);
        (column, row)
    }

    /// Height of the ground at the world position (x, y) \[m\].
    ///
    /// A cell is two triangles, split along the diagonal from (x0, y0) to (x1, y1).
    #[inline(always)]
    pub fn height(&self, x: f32, y: f32) -> f32 {
        let (column, row) = self.cell_at(x, y);
        let [h00, h10, h01, h11] = self.cells[row * self.columns + column];
        let u = ((x - self.origin[0]) / self.cell_size - column as f32).clamp(0.0, 1.0);
        let v = ((y - self.origin[1]) / self.cell_size - row as f32).clamp(0.0, 1.0);
        if u >= v { h00 + u * (h10 - h00) + v * (h11 - h10) } else { h00 + v * (h01 - h00) + u * (h11 - h01) }
    }
}
