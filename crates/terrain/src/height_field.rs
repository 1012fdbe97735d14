//! The ground: a grid of cells whose four corners each have a height of their own.
//!
//! Neighboring cells that share corner heights make a continuous surface (slopes, roughness); cells that do not
//! make a vertical face between them, as high as the difference (stairs, boxes). So a riser is a wall, not a ramp one
//! cell wide, and a query needs one 16-byte load.

/// Corner heights of a cell \[m\]: at (x0, y0), (x1, y0), (x0, y1), (x1, y1).
pub type Cell = [f32; 4];

/// Ground over a rectangle; outside it the heights along its border go on level.
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

    /// The cell at (`column`, `row`). One outside the field has the heights of the border next to it, and goes on level
    /// outward, as [`HeightField::height`] does.
    #[inline(always)]
    pub fn cell(&self, column: i64, row: i64) -> Cell {
        let (last_column, last_row) = (self.columns as i64 - 1, self.rows as i64 - 1);
        let (nearest_column, nearest_row) = (column.clamp(0, last_column), row.clamp(0, last_row));
        let [mut a, mut b, mut c, mut d] =
            self.cells[nearest_row as usize * self.columns + nearest_column as usize];
        if column < 0 {
            (b, d) = (a, c);
        } else if column > last_column {
            (a, c) = (b, d);
        }
        if row < 0 {
            (c, d) = (a, b);
        } else if row > last_row {
            (a, b) = (c, d);
        }
        [a, b, c, d]
    }

    /// Height of the ground at the world position (x, y) \[m\]; of the nearest border outside the field, and of
    /// some cell of it at a position that is not a number.
    ///
    /// A cell is two triangles, split along the diagonal from (x0, y0) to (x1, y1).
    #[inline(always)]
    pub fn height(&self, x: f32, y: f32) -> f32 {
        let [x, y] = self.in_cells(x, y);
        self.height_in_cells(x, y)
    }

    /// World position (x, y) \[m\] counted in cells from the field's corner.
    #[inline(always)]
    pub(crate) fn in_cells(&self, x: f32, y: f32) -> [f32; 2] {
        let per_meter = self.cell_size.recip();
        [(x - self.origin[0]) * per_meter, (y - self.origin[1]) * per_meter]
    }

    /// Height of the ground \[m\] at a position counted in cells from the field's corner.
    #[inline(always)]
    pub(crate) fn height_in_cells(&self, x: f32, y: f32) -> f32 {
        let (column, row) = self.index_of(x, y);
        let cell = &self.cells[row * self.columns + column];
        height_in_cell(cell, clamp_to_unit(x - column as f32), clamp_to_unit(y - row as f32))
    }

    #[inline(always)]
    fn index_of(&self, x: f32, y: f32) -> (usize, usize) {
        // A float-to-integer cast saturates, so far-away and non-finite positions stay inside.
        ((x as usize).min(self.columns - 1), (y as usize).min(self.rows - 1))
    }
}

/// Height at (u, v) in the unit square of a cell \[m\].
///
/// From (x0, y0) first along the longer way, over the corner on this side of the diagonal, then along the shorter;
/// which side a point is on selects a corner, not a branch, as no processor could foretell it.
#[inline(always)]
pub(crate) fn height_in_cell(cell: &Cell, u: f32, v: f32) -> f32 {
    let corner = cell[if u >= v { 1 } else { 2 }];
    cell[0] + u.max(v) * (corner - cell[0]) + u.min(v) * (cell[3] - corner)
}

/// `t` within \[0, 1\], and 0 for what is not a number.
#[inline(always)]
#[expect(clippy::manual_clamp, reason = "clamp keeps a NaN, max replaces it")]
fn clamp_to_unit(t: f32) -> f32 {
    t.max(0.0).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cells along x: a slope from 0 to 0.1 m, then a plateau at 0.3 m.
    fn slope_and_step() -> HeightField {
        HeightField {
            cell_size: 0.1,
            origin: [-0.1, 0.0],
            columns: 2,
            rows: 1,
            cells: vec![[0.0, 0.1, 0.0, 0.1], [0.3; 4]],
        }
    }

    #[test]
    fn a_step_between_cells_is_vertical() {
        let field = slope_and_step();
        assert!((field.height(-1e-4, 0.05) - 0.1).abs() < 2e-4);
        assert_eq!(field.height(1e-4, 0.05), 0.3);
    }

    #[test]
    fn both_triangles_pass_through_the_corners_and_the_diagonal() {
        let cell = [0.1, 0.2, 0.4, 0.8];
        for (u, v, height) in [(0.0, 0.0, 0.1), (1.0, 0.0, 0.2), (0.0, 1.0, 0.4), (1.0, 1.0, 0.8)] {
            assert!((height_in_cell(&cell, u, v) - height).abs() < 1e-6);
        }
        let below = height_in_cell(&cell, 0.5, 0.5 - 1e-6);
        let above = height_in_cell(&cell, 0.5, 0.5 + 1e-6);
        assert!((below - 0.45).abs() < 1e-5 && (above - 0.45).abs() < 1e-5);
    }

    #[test]
    fn outside_the_field_the_border_goes_on() {
        let field = slope_and_step();
        for far in [1.0, 1e9, f32::MAX, f32::INFINITY] {
            assert_eq!(field.height(-far, -far), 0.0);
            assert_eq!(field.height(far, far), 0.3);
        }
        assert_eq!(field.cell(i64::MIN, i64::MAX), [0.0; 4]);
        assert_eq!(field.cell(i64::MAX, i64::MIN), [0.3; 4]);
        // Along the slope's side it goes on with the slope.
        assert_eq!(field.cell(0, -1), field.cells[0]);
        assert_eq!(field.cell(0, 1), field.cells[0]);
    }

    #[test]
    fn a_position_that_is_not_a_number_has_a_finite_height() {
        let field = slope_and_step();
        assert!(field.height(f32::NAN, 0.05).is_finite());
        assert!(field.height(0.05, f32::NAN).is_finite());
        assert!(field.height(f32::NAN, f32::NAN).is_finite());
    }
}
