//! The height scan: what the robot knows of the ground around it.

use spatial::f32x16;

use crate::height_field::HeightField;

/// Points of the scan along x, from −0.8 m to +0.8 m; the fast index.
pub const SCAN_COLUMNS: usize = 17;
/// Points of the scan along y, from −0.5 m to +0.5 m.
pub const SCAN_ROWS: usize = 11;
/// Points of the scan.
pub const SCAN_POINTS: usize = SCAN_COLUMNS * SCAN_ROWS;

/// Distance between neighboring points \[m\].
const SPACING: f32 = 0.1;
/// Height of the base above level ground at which the scan is zero \[m\].
const NOMINAL_HEIGHT: f32 = 0.5;

/// Points handled side by side.
const LANES: usize = 16;
/// Places of the points in the heading frame, in spacings ahead and to the left; the last vector is filled up.
static AHEAD: [[f32; LANES]; SCAN_POINTS.div_ceil(LANES)] = places(true);
static LEFT: [[f32; LANES]; SCAN_POINTS.div_ceil(LANES)] = places(false);

const fn places<const VECTORS: usize>(ahead: bool) -> [[f32; LANES]; VECTORS] {
    let mut places = [[0.0; LANES]; VECTORS];
    let mut k = 0;
    while k < SCAN_POINTS {
        let (i, j) = (k % SCAN_COLUMNS, k / SCAN_COLUMNS);
        places[k / LANES][k % LANES] = if ahead { i as f32 - 8.0 } else { j as f32 - 5.0 };
        k += 1;
    }
    places
}

impl HeightField {
    /// Height of the base above the ground, less 0.5 m, clipped to ±1 m, at 17 × 11 points in the heading frame.
    ///
    /// The points are centered on the base at (x, y) \[m\], turned with its `yaw` \[rad\], not with roll and
    /// pitch. `out[17 · j + i]` belongs to the point (0.1 (i − 8), 0.1 (j − 5)) m in the heading frame. Layout and
    /// offset are those of Isaac Lab's rough task (`velocity_env_cfg.py`, `envs/mdp/observations.py`). Beyond the
    /// first [`SCAN_POINTS`] values `out` is left alone.
    pub fn scan(&self, x: f32, y: f32, yaw: f32, base_z: f32, out: &mut [f32]) {
        let (sin, cos) = yaw.sin_cos();
        let spacing = SPACING * self.cell_size.recip();
        let [base_x, base_y] = self.in_cells(x, y).map(f32x16::splat);
        let [along_x, along_y] = [cos * spacing, sin * spacing].map(f32x16::splat);
        let zero_at = f32x16::splat(base_z - NOMINAL_HEIGHT);
        let length = out.len().min(SCAN_POINTS);
        for ((values, ahead), left) in out[..length].chunks_mut(LANES).zip(&AHEAD).zip(&LEFT) {
            let (ahead, left) = (f32x16::from(*ahead), f32x16::from(*left));
            let ground = self.heights_in_cells(
                base_x + ahead * along_x - left * along_y,
                base_y + ahead * along_y + left * along_x,
            );
            let clipped = (zero_at - ground).max(f32x16::splat(-1.0)).min(f32x16::splat(1.0));
            values.copy_from_slice(&clipped.to_array()[..values.len()]);
        }
    }

    /// [`HeightField::height`] of sixteen points at once, positions counted in cells.
    #[inline(always)]
    fn heights_in_cells(&self, x: f32x16, y: f32x16) -> f32x16 {
        let (column, u) = split(x, self.columns);
        let (row, v) = split(y, self.rows);
        let upper = u.simd_lt(v).to_bitmask();
        let (mut start, mut corner, mut end) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for k in 0..LANES {
            let cell = &self.cells[row[k] as usize * self.columns + column[k] as usize];
            // Which side of the diagonal a point is on selects a corner, not a branch.
            (start[k], corner[k], end[k]) = (cell[0], cell[1 + (upper >> k & 1) as usize], cell[3]);
        }
        let [start, corner, end] = [start, corner, end].map(f32x16::from);
        start + u.max(v) * (corner - start) + u.min(v) * (end - corner)
    }
}

/// Cells along one axis, clamped to `0..count`, and the places in them, 0 to 1.
#[inline(always)]
fn split(position: f32x16, count: usize) -> ([i32; LANES], f32x16) {
    let position = position.max(f32x16::ZERO).min(f32x16::splat(count as f32));
    let cell = position.floor().min(f32x16::splat((count - 1) as f32));
    (cell.fast_trunc_int().to_array(), position - cell)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::{FRAC_PI_2, PI};

    /// The surface z = 0.2 x + 0.05 y over ±4 m.
    fn plane() -> HeightField {
        let mut field = HeightField {
            cell_size: 0.1,
            origin: [-4.0, -4.0],
            columns: 80,
            rows: 80,
            cells: Vec::with_capacity(6400),
        };
        let height =
            |column: usize, row: usize| 0.2 * (column as f32 * 0.1 - 4.0) + 0.05 * (row as f32 * 0.1 - 4.0);
        for row in 0..80 {
            for column in 0..80 {
                field.cells.push([
                    height(column, row),
                    height(column + 1, row),
                    height(column, row + 1),
                    height(column + 1, row + 1),
                ]);
            }
        }
        field
    }

    fn scan(field: &HeightField, x: f32, y: f32, yaw: f32, base_z: f32) -> [f32; SCAN_POINTS] {
        let mut out = [f32::NAN; SCAN_POINTS];
        field.scan(x, y, yaw, base_z, &mut out);
        out
    }

    #[test]
    fn level_ground_under_a_standing_robot_reads_its_height_less_half_a_meter() {
        let out = scan(&HeightField::flat(0.2), 3.0, -2.0, 0.7, 0.8);
        assert!(out.iter().all(|value| (value - 0.1).abs() < 1e-6));
    }

    #[test]
    fn a_slope_reads_as_its_plane_whatever_the_heading() {
        for yaw in [0.0, 0.3, FRAC_PI_2, -2.5, PI] {
            let (x, y, base_z) = (0.33, -0.61, 0.5);
            let out = scan(&plane(), x, y, yaw, base_z);
            for j in 0..SCAN_ROWS {
                for i in 0..SCAN_COLUMNS {
                    let (ahead, left) = (0.1 * (i as f32 - 8.0), 0.1 * (j as f32 - 5.0));
                    let point_x = x + yaw.cos() * ahead - yaw.sin() * left;
                    let point_y = y + yaw.sin() * ahead + yaw.cos() * left;
                    let expected = base_z - (0.2 * point_x + 0.05 * point_y) - 0.5;
                    assert!((out[j * SCAN_COLUMNS + i] - expected).abs() < 1e-5, "{yaw} {i} {j}");
                }
            }
        }
    }

    #[test]
    fn each_value_is_the_height_below_its_point() {
        let mut field = plane();
        // Unequal, unshared corners: every lookup differs.
        field.cells.iter_mut().enumerate().for_each(|(i, cell)| cell[i % 4] += (i % 97) as f32 * 1e-3);
        let out = scan(&field, 0.512, 0.337, 0.0, 0.4);
        for (k, value) in out.iter().enumerate() {
            let (i, j) = (k % SCAN_COLUMNS, k / SCAN_COLUMNS);
            let ground = field.height(0.512 + 0.1 * (i as f32 - 8.0), 0.337 + 0.1 * (j as f32 - 5.0));
            assert!((value - (0.4 - ground - 0.5)).abs() < 1e-5);
        }
    }

    #[test]
    fn values_are_clipped_to_one_meter() {
        assert!(scan(&HeightField::flat(0.0), 0.0, 0.0, 0.0, 9.0).iter().all(|value| *value == 1.0));
        assert!(scan(&HeightField::flat(0.0), 0.0, 0.0, 0.0, -9.0).iter().all(|value| *value == -1.0));
    }

    #[test]
    fn a_mirrored_field_gives_a_mirrored_scan() {
        // Level cells, since the diagonal that splits a cell has no mirror image.
        let mut field = plane();
        field.cells.iter_mut().enumerate().for_each(|(i, cell)| *cell = [(i * i % 31) as f32 * 0.01; 4]);
        let mut mirrored = field.clone();
        for row in 0..80 {
            for column in 0..80 {
                mirrored.cells[row * 80 + column] = field.cells[(79 - row) * 80 + column];
            }
        }
        let out = scan(&field, 0.217, 0.123, 0.4, 0.6);
        let image = scan(&mirrored, 0.217, -0.123, -0.4, 0.6);
        for j in 0..SCAN_ROWS {
            for i in 0..SCAN_COLUMNS {
                assert_eq!(
                    out[j * SCAN_COLUMNS + i],
                    image[(SCAN_ROWS - 1 - j) * SCAN_COLUMNS + i],
                    "{i} {j}"
                );
            }
        }
    }

    #[test]
    fn any_position_and_any_buffer_are_survived() {
        for position in [1e30, f32::MAX, f32::INFINITY, f32::NAN] {
            let out = scan(&plane(), position, -position, 0.3, 0.5);
            assert!(out.iter().all(|value| value.is_finite()));
        }
        plane().scan(0.0, 0.0, 0.0, 0.5, &mut []);
        let mut long = [7.0; SCAN_POINTS + 20];
        plane().scan(0.0, 0.0, 0.0, 0.5, &mut long);
        assert!(long[SCAN_POINTS - 1] != 7.0 && long[SCAN_POINTS..].iter().all(|value| *value == 7.0));
    }
}
