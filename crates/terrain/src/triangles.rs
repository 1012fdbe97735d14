//! The ground as triangles to draw.

use crate::HeightField;

/// A wall lower than this is not drawn \[m\].
const LEAST_WALL_M: f32 = 1e-4;

/// Appends the triangles of the ground within `half_width` \[m\] of (`x`, `y`) to `out`: nine numbers each, world frame \[m\],
/// counterclockwise seen from outside. Level cells of a row that meet are drawn as one; outside the field its border goes on
/// level ([`HeightField::cell`]).
pub fn patch(field: &HeightField, x: f32, y: f32, half_width: f32, out: &mut Vec<f32>) {
    let size = field.cell_size;
    let index = |at: f32, origin: f32| ((at - origin) / size).floor() as i64;
    let (left, right) = (index(x - half_width, field.origin[0]), index(x + half_width, field.origin[0]));
    let (near, far) = (index(y - half_width, field.origin[1]), index(y + half_width, field.origin[1]));
    let at =
        |column: i64, row: i64| [field.origin[0] + column as f32 * size, field.origin[1] + row as f32 * size];
    for row in near..far {
        let mut column = left;
        while column < right {
            let cell = field.cell(column, row);
            let mut end = column + 1;
            while end < right && level(&cell) && field.cell(end, row) == cell {
                end += 1;
            }
            let ([x0, y0], [x1, y1]) = (at(column, row), at(end, row + 1));
            let corners = [[x0, y0, cell[0]], [x1, y0, cell[1]], [x0, y1, cell[2]], [x1, y1, cell[3]]];
            // The diagonal of the physics: from (x0, y0) to (x1, y1).
            quad(out, [corners[0], corners[1], corners[3], corners[2]]);
            let next = field.cell(end, row);
            wall(out, [[x1, y0], [x1, y1]], [cell[1], cell[3]], [next[0], next[2]]);
            for along in column..end {
                let (here, beyond) = (field.cell(along, row), field.cell(along, row + 1));
                let ([a, b], [c, _]) = (at(along, row + 1), at(along + 1, row + 1));
                wall(out, [[c, b], [a, b]], [here[3], here[2]], [beyond[1], beyond[0]]);
            }
            column = end;
        }
    }
}

fn level(cell: &[f32; 4]) -> bool {
    cell.iter().all(|height| *height == cell[0])
}

/// The vertical face over an edge between a cell's heights there and its neighbor's, facing the lower side.
fn wall(out: &mut Vec<f32>, [p, q]: [[f32; 2]; 2], own: [f32; 2], other: [f32; 2]) {
    if (own[0] - other[0]).abs().max((own[1] - other[1]).abs()) < LEAST_WALL_M {
        return;
    }
    let point = |at: [f32; 2], z: f32| [at[0], at[1], z];
    // Seen from the neighbor, p is on the left: outside when the own side is higher.
    quad(out, [point(p, other[0]), point(q, other[1]), point(q, own[1]), point(p, own[0])]);
}

/// Two triangles of four corners in order.
fn quad(out: &mut Vec<f32>, [a, b, c, d]: [[f32; 3]; 4]) {
    for corner in [a, b, c, a, c, d] {
        out.extend(corner);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(field: &HeightField, half_width: f32) -> Vec<[[f32; 3]; 3]> {
        let mut out = Vec::new();
        patch(field, 0.0, 0.0, half_width, &mut out);
        out.chunks_exact(9).map(|t| [[t[0], t[1], t[2]], [t[3], t[4], t[5]], [t[6], t[7], t[8]]]).collect()
    }

    fn normal([a, b, c]: [[f32; 3]; 3]) -> [f32; 3] {
        let [u, v] = [b, c].map(|p| [p[0] - a[0], p[1] - a[1], p[2] - a[2]]);
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
    }

    #[test]
    fn level_ground_is_strips_that_cover_the_patch_once() {
        let drawn = triangles(&HeightField::flat(0.3), 1.0);
        assert_eq!(drawn.len(), 40);
        let area: f32 = drawn.iter().map(|t| 0.5 * normal(*t)[2]).sum();
        assert!((area - 4.0).abs() < 1e-3, "{area}");
        assert!(drawn.iter().flatten().all(|corner| corner[2] == 0.3));
    }

    /// A block of 0.2 m in the middle of a plane: four walls that face outwards.
    #[test]
    fn walls_of_a_block_face_outwards_and_have_its_height() {
        let mut field = HeightField {
            cell_size: 0.1,
            origin: [-0.5, -0.5],
            columns: 10,
            rows: 10,
            cells: vec![[0.0; 4]; 100],
        };
        for (i, cell) in field.cells.iter_mut().enumerate() {
            if (3..7).contains(&(i % 10)) && (3..7).contains(&(i / 10)) {
                *cell = [0.2; 4];
            }
        }
        let drawn = triangles(&field, 0.5);
        let mut walls = 0.0;
        for triangle in drawn {
            let n = normal(triangle);
            if n[2].abs() < 1e-6 {
                walls += 0.5 * n[0].hypot(n[1]);
            }
        }
        assert!((walls - 4.0 * 0.4 * 0.2).abs() < 1e-4, "{walls}");
    }

    #[test]
    fn the_surface_drawn_is_the_one_walked_on() {
        let cells = (0..100).map(|i| [0.1, 0.2, 0.4, 0.8].map(|h| h * ((i * 7 % 5) as f32) * 0.1)).collect();
        let field = HeightField { cell_size: 0.1, origin: [-0.5, -0.5], columns: 10, rows: 10, cells };
        // Well beyond the edge, along which the border slopes.
        let drawn = triangles(&field, 0.75);
        assert!(drawn.iter().flatten().any(|corner| corner[0] < -0.6 && corner[1] > 0.6));
        for triangle in drawn {
            if normal(triangle)[2] > 1e-6 {
                let middle: [f32; 3] =
                    std::array::from_fn(|i| triangle.iter().map(|corner| corner[i]).sum::<f32>() / 3.0);
                assert!((field.height(middle[0], middle[1]) - middle[2]).abs() < 1e-4);
            }
        }
    }
}
