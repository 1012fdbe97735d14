//! How far a sphere is from the ground, and which way the ground pushes it.
//!
//! A sphere can touch the surface of the cell under its center and, beside it, a vertical face where a neighboring
//! cell stands higher: tread and riser of a stair at once. The face's upper border is an edge the sphere rolls over.

use spatial::{Lane, Mask, Vec3};
use terrain::HeightField;

/// A possible contact of a sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proximity<L> {
    /// Distance between sphere and ground \[m\]; negative when they overlap.
    pub(crate) gap: L,
    /// Direction in which the ground pushes, world frame.
    pub(crate) normal: Vec3<L>,
}

/// Where a point lies in the grid.
struct GridPoint<L> {
    column: [usize; MAX_WIDTH],
    row: [usize; MAX_WIDTH],
    /// The column and row beside that are nearer.
    beside_column: [usize; MAX_WIDTH],
    beside_row: [usize; MAX_WIDTH],
    /// Position within the cell, 0 to 1.
    u: L,
    v: L,
}

/// No lane type is wider.
const MAX_WIDTH: usize = 16;
/// A step lower than this between neighboring cells is no wall \[m\].
const MIN_WALL_HEIGHT: f64 = 1e-3;
/// No wall is looked for this far above the ground \[m\]: no step of any terrain is higher.
const MAX_WALL_HEIGHT: f64 = 0.5;

/// Pieces of ground a sphere can touch at once: the surface under its center, a wall across x (or, where there is
/// none, an upright edge) and a wall across y.
pub(crate) const FACES: usize = 3;

/// The border of a cell that is nearer along one axis.
struct Border<L: Lane> {
    /// It is the one toward the greater coordinate.
    greater: L::Mask,
    /// From the point to it \[m\].
    distance: L,
    /// Direction along the axis from it to the point, ±1.
    away: L,
}

impl<L: Lane> Border<L> {
    #[inline(always)]
    fn nearer(within: L, size: L) -> Self {
        let greater = within.ge(L::splat(0.5));
        Self {
            greater,
            distance: greater.select(L::one() - within, within) * size,
            away: greater.select(-L::one(), L::one()),
        }
    }
}

/// Distances of spheres to the pieces of ground they can touch.
///
/// Each wall has a place of its own, for where two of them meet a sphere rests on both: with the nearer alone it
/// sinks into the other by what a step moves it.
#[inline(always)]
pub(crate) fn faces<L: Lane>(ground: &HeightField, center: Vec3<L>, radius: L) -> [Proximity<L>; FACES] {
    let point = locate(ground, center.x, center.y);
    let own = gather::<L>(ground, &point.column, &point.row);
    let surface = surface_of_cell(ground, &point, &own, center, radius);

    // Only the nearer border along each axis is within a sphere's reach: cells are 0.1 m wide.
    let size = L::splat(f64::from(ground.cell_size));
    let (x, y) = (Border::nearer(point.u, size), Border::nearer(point.v, size));
    let beside_x = gather::<L>(ground, &point.beside_column, &point.row);
    let beside_y = gather::<L>(ground, &point.column, &point.beside_row);

    let mix = |a: L, b: L, t: L| t.mul_add(b - a, a);
    let [h00, h10, h01, h11] = own;
    let x_wall = {
        let own_height = x.greater.select(mix(h10, h11, point.v), mix(h00, h01, point.v));
        let [n00, n10, n01, n11] = beside_x;
        let top = x.greater.select(mix(n00, n01, point.v), mix(n10, n11, point.v));
        let (gap, across, up) = wall(center.z, radius, own_height, top, x.distance);
        Proximity { gap, normal: Vec3::new(x.away * across, L::zero(), up) }
    };
    let y_wall = {
        let own_height = y.greater.select(mix(h01, h11, point.u), mix(h00, h10, point.u));
        let [n00, n10, n01, n11] = beside_y;
        let top = y.greater.select(mix(n00, n10, point.u), mix(n01, n11, point.u));
        let (gap, across, up) = wall(center.z, radius, own_height, top, y.distance);
        Proximity { gap, normal: Vec3::new(L::zero(), y.away * across, up) }
    };
    let foot = x.greater.select(y.greater.select(h11, h10), y.greater.select(h01, h00));
    let top = height_across(ground, &point);
    let alone = x_wall.gap.ge(far()).and(y_wall.gap.ge(far())).and(stands(center.z, foot, top));
    if !alone.any() {
        return [surface, x_wall, y_wall];
    }
    let edge = upright_edge(center.z, radius, foot, top, &x, &y);
    [surface, select(alone, edge, x_wall), y_wall]
}

#[inline(always)]
fn select<L: Lane>(mask: L::Mask, if_true: Proximity<L>, if_false: Proximity<L>) -> Proximity<L> {
    let (a, b) = (if_true.normal, if_false.normal);
    Proximity {
        gap: mask.select(if_true.gap, if_false.gap),
        normal: Vec3::new(mask.select(a.x, b.x), mask.select(a.y, b.y), mask.select(a.z, b.z)),
    }
}

/// The corner of a box seen from the cell that touches it there only: without it a sphere would be inside before it
/// met a wall.
#[inline(always)]
fn upright_edge<L: Lane>(z: L, radius: L, foot: L, top: L, x: &Border<L>, y: &Border<L>) -> Proximity<L> {
    let distance = x.distance.mul_add(x.distance, y.distance * y.distance).sqrt();
    let tiny = L::splat(1e-6);
    let inverse = L::one() / distance.max(tiny);
    let at_edge = distance.lt(tiny);
    let along_x = at_edge.select(L::one(), x.distance * inverse);
    let along_y = at_edge.select(L::zero(), y.distance * inverse);
    let (gap, across, up) = wall(z, radius, foot, top, distance);
    Proximity { gap, normal: Vec3::new(x.away * along_x * across, y.away * along_y * across, up) }
}

/// A gap that never closes.
#[inline(always)]
pub(crate) fn far<L: Lane>() -> L {
    L::splat(1e3)
}

/// Gap to a wall rising from `foot` to `top` at a horizontal `distance`, and the normal's components away
/// from the wall and up.
#[inline(always)]
fn wall<L: Lane>(z: L, radius: L, foot: L, top: L, distance: L) -> (L, L, L) {
    let above = (z - top).max(L::zero());
    let reach = distance.mul_add(distance, above * above).sqrt();
    let tiny = L::splat(1e-6);
    let inverse = L::one() / reach.max(tiny);
    let at_border = reach.lt(tiny);
    let across = at_border.select(L::one(), distance * inverse);
    let up = at_border.select(L::zero(), above * inverse);
    (stands(z, foot, top).select(reach - radius, far()), across, up)
}

#[inline(always)]
fn stands<L: Lane>(z: L, foot: L, top: L) -> L::Mask {
    (top - foot).gt(L::splat(MIN_WALL_HEIGHT)).and((z - foot).lt(L::splat(MAX_WALL_HEIGHT)))
}

#[inline(always)]
fn locate<L: Lane>(ground: &HeightField, x: L, y: L) -> GridPoint<L> {
    let inverse = L::splat(1.0 / f64::from(ground.cell_size));
    let (columns, rows) = (ground.columns, ground.rows);
    let across = |position: L, start: f32, count: usize| {
        ((position - L::splat(f64::from(start))) * inverse).clamp(L::zero(), L::splat(count as f64))
    };
    let x = across(x, ground.origin[0], columns);
    let y = across(y, ground.origin[1], rows);
    let cell_x = x.floor().min(L::splat((columns - 1) as f64));
    let cell_y = y.floor().min(L::splat((rows - 1) as f64));
    let (u, v) = (x - cell_x, y - cell_y);
    let nothing = [0; MAX_WIDTH];
    let mut point =
        GridPoint { column: nothing, row: nothing, beside_column: nothing, beside_row: nothing, u, v };
    for lane in 0..L::WIDTH {
        let (column, row) = (cell_x.index(lane).min(columns - 1), cell_y.index(lane).min(rows - 1));
        point.column[lane] = column;
        point.row[lane] = row;
        point.beside_column[lane] = nearer(column, u.get(lane), columns);
        point.beside_row[lane] = nearer(row, v.get(lane), rows);
    }
    point
}

/// Index of the nearer of the two beside `index`; itself where the field ends.
#[inline(always)]
fn nearer(index: usize, within: f64, count: usize) -> usize {
    if within >= 0.5 { (index + 1).min(count - 1) } else { index.saturating_sub(1) }
}

/// Corner heights of one cell a lane.
#[inline(always)]
fn gather<L: Lane>(ground: &HeightField, column: &[usize; MAX_WIDTH], row: &[usize; MAX_WIDTH]) -> [L; 4] {
    let mut corners = [L::zero(); 4];
    for lane in 0..L::WIDTH {
        let cell = ground.cells[row[lane] * ground.columns + column[lane]];
        for (corner, height) in corners.iter_mut().zip(cell) {
            corner.set(lane, f64::from(height));
        }
    }
    corners
}

/// Height of the cell diagonally across at the corner that is shared with it \[m\].
#[inline(always)]
fn height_across<L: Lane>(ground: &HeightField, point: &GridPoint<L>) -> L {
    let mut height = L::zero();
    for lane in 0..L::WIDTH {
        let corner = usize::from(point.u.get(lane) < 0.5) + 2 * usize::from(point.v.get(lane) < 0.5);
        let cell = ground.cells[point.beside_row[lane] * ground.columns + point.beside_column[lane]];
        height.set(lane, f64::from(cell[corner]));
    }
    height
}

/// Distance to the plane of the triangle under the center.
#[inline(always)]
fn surface_of_cell<L: Lane>(
    ground: &HeightField,
    point: &GridPoint<L>,
    corners: &[L; 4],
    center: Vec3<L>,
    radius: L,
) -> Proximity<L> {
    let [h00, h10, h01, h11] = *corners;
    let lower = point.u.ge(point.v);
    let along_x = lower.select(h10 - h00, h11 - h01);
    let along_y = lower.select(h11 - h10, h01 - h00);
    let height = point.u.mul_add(along_x, point.v.mul_add(along_y, h00));
    let inverse = L::splat(1.0 / f64::from(ground.cell_size));
    let (slope_x, slope_y) = (along_x * inverse, along_y * inverse);
    let cosine = L::one() / slope_x.mul_add(slope_x, slope_y.mul_add(slope_y, L::one())).sqrt();
    Proximity {
        gap: (center.z - height).mul_add(cosine, -radius),
        normal: Vec3::new(-slope_x * cosine, -slope_y * cosine, cosine),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ground 0 for x < 1, a step of 0.2 m from there on.
    fn step() -> HeightField {
        let mut field = HeightField {
            cell_size: 0.1,
            origin: [0.0, 0.0],
            columns: 20,
            rows: 20,
            cells: vec![[0.0; 4]; 400],
        };
        for (i, cell) in field.cells.iter_mut().enumerate() {
            if i % 20 >= 10 {
                *cell = [0.2; 4];
            }
        }
        field
    }

    fn at(x: f64, z: f64) -> [Proximity<f64>; 2] {
        let [surface, x_wall, y_wall] = faces(&step(), Vec3::splat([x, 0.55, z]), 0.03);
        assert_eq!(y_wall.gap, far::<f64>());
        [surface, x_wall]
    }

    #[test]
    fn a_sphere_in_the_inner_edge_touches_tread_and_riser() {
        let [tread, riser] = at(0.97, 0.03);
        assert!(tread.gap.abs() < 1e-6 && riser.gap.abs() < 1e-6);
        assert!((tread.normal.z - 1.0).abs() < 1e-12);
        assert!((riser.normal.x + 1.0).abs() < 1e-12);
    }

    #[test]
    fn beside_the_outer_edge_the_normal_points_from_the_edge() {
        let [surface, edge] = at(0.98, 0.22);
        assert!((surface.gap - 0.19).abs() < 1e-6);
        let expected = (2.0_f64).sqrt() * 0.02 - 0.03;
        assert!((edge.gap - expected).abs() < 1e-6);
        assert!((edge.normal.x + 0.5_f64.sqrt()).abs() < 1e-5);
        assert!((edge.normal.z - 0.5_f64.sqrt()).abs() < 1e-5);
    }

    #[test]
    fn on_the_plateau_there_is_no_wall() {
        let [surface, wall] = at(1.02, 0.23);
        assert!(surface.gap.abs() < 1e-6);
        assert!(wall.gap > 1.0);
    }

    #[test]
    fn the_corner_of_a_box_pushes_away_from_its_upright_edge() {
        let mut field = step();
        for (i, cell) in field.cells.iter_mut().enumerate() {
            *cell = [if i % 20 >= 10 && i / 20 >= 10 { 0.2 } else { 0.0 }; 4];
        }
        let [_, edge, y_wall] = faces(&field, Vec3::splat([0.97, 0.96, 0.03]), 0.03);
        assert!((edge.gap - 0.02).abs() < 1e-6 && y_wall.gap > 1.0);
        assert!((edge.normal - Vec3::splat([-0.6, -0.8, 0.0])).norm() < 1e-6);
        // Beside a face the edge is none.
        let [_, x_wall, y_wall] = faces(&field, Vec3::splat([0.97, 1.01, 0.03]), 0.03);
        assert!(x_wall.gap.abs() < 1e-6 && x_wall.normal.y == 0.0 && y_wall.gap > 1.0);
    }

    #[test]
    fn a_slope_pushes_along_its_normal() {
        let mut field = HeightField::flat(0.0);
        field.cells = vec![[0.0, 0.05, 0.0, 0.05]];
        let [p, ..] = faces(&field, Vec3::splat([0.0, 0.0, 0.1]), 0.03);
        // The plane z = 0.025 + x / 2 at the cell's center.
        let cosine = 1.0 / 1.25_f64.sqrt();
        assert!((p.gap - (0.075 * cosine - 0.03)).abs() < 1e-6);
        assert!((p.normal.x + 0.5 * cosine).abs() < 1e-6);
    }

    #[test]
    fn far_outside_the_field_the_border_goes_on() {
        for x in [-1e6, 1e6, 1e30] {
            let [p, ..] = faces(&step(), Vec3::splat([x, 0.0, 1.0]), 0.0);
            let ground = if x < 0.0 { 0.0 } else { 0.2 };
            assert!((p.gap - (1.0 - ground)).abs() < 1e-6);
        }
    }

    /// Vertices 0.1 m apart at `unit` times 0 to 4, scattered.
    fn rough(unit: f32) -> HeightField {
        let height = |x: usize, y: usize| ((x * 7 + y * 3 + x * y * 5) % 11 % 5) as f32 * unit;
        let corners = |x, y| [height(x, y), height(x + 1, y), height(x, y + 1), height(x + 1, y + 1)];
        let cells = (0..400).map(|i| corners(i % 20, i / 20)).collect();
        HeightField { cells, ..step() }
    }

    /// Height at which a ball comes to rest on the ground, over all of it, and the normal there.
    fn resting(ground: &HeightField, x: f64, y: f64, radius: f64) -> (f64, Vec3<f64>) {
        let offsets =
            (-40..=40).flat_map(|i| (-40..=40).map(move |j| [i, j].map(|k| f64::from(k) / 40.0 * radius)));
        let within = offsets.filter(|[dx, dy]| dx.hypot(*dy) < radius);
        let touching = within.map(|[dx, dy]| {
            let up = (radius * radius - dx * dx - dy * dy).sqrt();
            let height = f64::from(ground.height((x + dx) as f32, (y + dy) as f32)) + up;
            (height, Vec3::new(-dx, -dy, up).scale(1.0 / radius))
        });
        touching.max_by(|a, b| a.0.total_cmp(&b.0)).expect("a disk of points")
    }

    /// The plane of the triangle under the center stands for all triangles a ball may touch. What that costs by a crease
    /// is known: the steeper the ground, the more. The last is what robots learn on (`terrain`, random rough).
    #[test]
    fn how_far_the_plane_under_the_center_is_from_the_ground() {
        let radius = 0.031;
        // Unit of height, worst error of the resting height [mm], share of places whose normal is off by over 5°.
        // Measured: 1.04, 4.3 and 15.1 mm; 2.9, 11 and 20.7 %.
        for (unit, worst_mm, share) in [(0.005, 1.2, 0.04), (0.01, 5.0, 0.13), (0.02, 17.0, 0.25)] {
            let ground = rough(unit);
            let (mut worst, mut off) = (0.0_f64, 0);
            for i in 0..1000 {
                // Evenly scattered: multiples of the golden ratio and of the root of two.
                let [x, y] = [0.618_034, 0.414_214].map(|step| 0.1 + 1.8 * (f64::from(i) * step).fract());
                let (height, normal) = resting(&ground, x, y, radius);
                let [ours, ..] = faces(&ground, Vec3::splat([x, y, height]), radius);
                worst = worst.max((ours.gap / ours.normal.z).abs() * 1e3);
                off += i32::from(ours.normal.dot(normal) < 5.0_f64.to_radians().cos());
            }
            let off = f64::from(off) / 1000.0;
            assert!(worst < worst_mm && off < share, "{unit} m: {worst} mm, {off}");
        }
    }
}
