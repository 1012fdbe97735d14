//! How far a sphere is from the ground, and which way the ground pushes it.
//!
//! The ground is triangles, and vertical faces where neighboring cells do not meet. A sphere is held against all of it
//! around the nearest corner of the grid, so it can touch tread and riser of a stair at once, rest in a valley on both
//! sides, and roll over a ridge.

mod map;
mod patch;
mod surface;
mod wall;

pub(crate) use map::Map;
use map::Surroundings;
use patch::Patch;
use spatial::{Lane, Mask, Vec3};
use surface::{Touched, touched};
use wall::walls;

/// A possible contact of a sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Proximity<L> {
    /// Distance between sphere and ground \[m\]; negative when they overlap.
    pub(crate) gap: L,
    /// Direction in which the ground pushes, world frame.
    pub(crate) normal: Vec3<L>,
}

/// Widest gap at which ground is a contact \[m\]: half of a terrain's cell. What falls by more in one step, faster than 10 m/s, can be
/// inside before it is seen.
///
/// Sideways, walls are seen from half a cell ([`terrain::HeightField::cell_size`], here 0.1 m) of a sphere's *center*. So up to
/// (0.05 m − radius) / step a sphere stops at a wall: a foot up to 3.7 m/s, a hand up to 2 m/s. Faster ones, and at any speed
/// those with a radius of 0.05 m or more (knees, thighs, the base's drives), overlap it before they see it, and are pushed out.
pub(crate) const REACH: f64 = 0.05;

/// Pieces of ground a sphere can touch at once.
pub(crate) const FACES: usize = 3;

/// A gap that never closes.
#[inline(always)]
pub(crate) fn far<L: Lane>() -> L {
    L::splat(1e3)
}

impl<L: Lane> Proximity<L> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { gap: far(), normal: Vec3::new(L::zero(), L::zero(), L::one()) }
    }

    #[inline(always)]
    pub(crate) fn select(mask: L::Mask, if_true: Self, if_false: Self) -> Self {
        Self {
            gap: mask.select(if_true.gap, if_false.gap),
            normal: Vec3::select(mask, if_true.normal, if_false.normal),
        }
    }

    #[inline(always)]
    fn or_nearer(self, other: Self) -> Self {
        Self::select(self.gap.le(other.gap), self, other)
    }

    #[inline(always)]
    pub(crate) fn only_where(self, mask: L::Mask) -> Self {
        Self { gap: mask.select(self.gap, far()), ..self }
    }

    /// Turns axes around, ±1 each.
    #[inline(always)]
    fn flip(self, x: L, y: L) -> Self {
        Self { normal: Vec3::new(self.normal.x * x, self.normal.y * y, self.normal.z), ..self }
    }
}

/// The highest ground around a robot's base: parts above it need no look at the map.
pub(crate) struct Ceiling<L> {
    /// Above the base \[m\]; mostly below it.
    height: L,
}

impl<L: Lane> Ceiling<L> {
    /// Over a base at a world position.
    #[inline(always)]
    pub(crate) fn over(map: &Map, base: Vec3<L>) -> Self {
        Self { height: map.ceiling(&map.spot(base.x, base.y)) - base.z }
    }

    /// Whether in some lane a sphere may touch the ground, which is `height` above the base and as far from it as `offset` is long
    /// \[m\].
    #[inline(always)]
    pub(crate) fn is_reached(&self, height: L, radius: L, offset: Vec3<L>) -> bool {
        // A millimeter more, so that rounding never decides here.
        let low = (height - radius - self.height).lt(L::splat(REACH + 1e-3));
        low.or(offset.dot(offset).gt(L::splat(map::WIDE * map::WIDE))).any()
    }
}

/// What the gap to anything a sphere at a world position can touch is at least \[m\].
#[inline(always)]
pub(crate) fn least_gap<L: Lane>(map: &Map, center: Vec3<L>, radius: L) -> L {
    center.z - map.top(&map.spot(center.x, center.y)) - radius
}

/// What a sphere can touch, each with a place of its own in the solver: the triangle under its center or the edge it
/// rolls over; and of what is beside it along x and along y (walls, upright edges, other sides of valleys) the nearer, then
/// the other.
///
/// Exact for what is within half a cell of the center sideways: see [`REACH`]. `least` is the sphere's [`least_gap`].
#[inline(never)]
pub(crate) fn faces<L: Lane>(map: &Map, center: Vec3<L>, radius: L, least: L) -> [Proximity<L>; FACES] {
    let none = Proximity::none();
    let spot = map.spot(center.x, center.y);
    let Surroundings { walls: has_walls, slopes } = map.surroundings(&spot);
    if !has_walls.or(slopes).any() {
        return [Proximity { gap: least, ..none }, none, none];
    }
    let patch = Patch::around(map, &spot);
    let z = center.z - patch.base;
    let [x_wall, y_wall] = if has_walls.any() { walls(&patch, z, radius) } else { [none, none] };
    let Touched { own, beside_x, beside_y } = if slopes.any() {
        touched(&patch, z, radius, x_wall.gap.min(y_wall.gap)).only_where(slopes, z, radius)
    } else {
        Touched::level(z, radius)
    };
    let (along_x, along_y) = (x_wall.or_nearer(beside_x), y_wall.or_nearer(beside_y));
    // Few robots touch three pieces at once: in most steps the third place stays empty, and costs nothing.
    let x_nearer = along_x.gap.le(along_y.gap);
    let (nearer, other) =
        (Proximity::select(x_nearer, along_x, along_y), Proximity::select(x_nearer, along_y, along_x));
    [own, nearer, other].map(|near| near.flip(patch.sign_x, patch.sign_y))
}

#[cfg(test)]
mod tests {
    use terrain::HeightField;

    use super::*;

    fn near(map: &Map, center: Vec3<f64>, radius: f64) -> [Proximity<f64>; FACES] {
        faces(map, center, radius, least_gap(map, center, radius))
    }

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
        let [surface, x_wall, y_wall] = near(&Map::new(&step()), Vec3::splat([x, 0.55, z]), 0.03);
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
        let [_, edge, y_wall] = near(&Map::new(&field), Vec3::splat([0.97, 0.96, 0.03]), 0.03);
        assert!((edge.gap - 0.02).abs() < 1e-6 && y_wall.gap > 1.0);
        assert!((edge.normal - Vec3::splat([-0.6, -0.8, 0.0])).norm() < 1e-6);
        // Beside a face the edge is none.
        let [_, x_wall, y_wall] = near(&Map::new(&field), Vec3::splat([0.97, 1.01, 0.03]), 0.03);
        assert!(x_wall.gap.abs() < 1e-6 && x_wall.normal.y == 0.0 && y_wall.gap > 1.0);
    }

    #[test]
    fn a_slope_pushes_along_its_normal() {
        let mut field = HeightField::flat(0.0);
        field.cells = vec![[0.0, 0.05, 0.0, 0.05]];
        let [p, ..] = near(&Map::new(&field), Vec3::splat([0.0, 0.0, 0.1]), 0.03);
        // The plane z = 0.025 + x / 2 at the cell's center.
        let cosine = 1.0 / 1.25_f64.sqrt();
        assert!((p.gap - (0.075 * cosine - 0.03)).abs() < 1e-6);
        assert!((p.normal.x + 0.5 * cosine).abs() < 1e-6);
    }

    #[test]
    fn far_outside_the_field_the_border_goes_on() {
        for x in [-1e6, 1e6, 1e30] {
            let ground = if x < 0.0 { 0.0 } else { 0.2 };
            let [p, ..] = near(&Map::new(&step()), Vec3::splat([x, 0.0, ground + 0.01]), 0.0);
            assert!((p.gap - 0.01).abs() < 1e-6);
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

    /// Every sphere of a foot's size that rests on scattered heights touches, along the right normal, and nothing it touches
    /// is nearer than it is. The last is what robots learn on (`terrain`, random rough).
    #[test]
    fn a_ball_rests_where_the_ground_is() {
        let radius = 0.031;
        for unit in [0.005, 0.01, 0.02] {
            let ground = rough(unit);
            let map = Map::new(&ground);
            let (mut worst, mut off) = (0.0_f64, 0);
            for i in 0..1000 {
                // Evenly scattered: multiples of the golden ratio and of the root of two.
                let [x, y] = [0.618_034, 0.414_214].map(|step| 0.1 + 1.8 * (f64::from(i) * step).fract());
                let (height, normal) = resting(&ground, x, y, radius);
                let touched = near(&map, Vec3::splat([x, y, height]), radius);
                let nearest = touched.into_iter().min_by(|a, b| a.gap.total_cmp(&b.gap)).expect("three");
                worst = worst.max(nearest.gap.abs() * 1e3);
                let along = |near: &Proximity<f64>| {
                    near.gap < nearest.gap + 1e-4 && near.normal.dot(normal) > 5.0_f64.to_radians().cos()
                };
                off += usize::from(!touched.iter().any(along));
            }
            // The search for the resting height is itself in steps of 0.8 mm sideways.
            assert!(worst < 0.3 && off == 0, "{unit} m: {worst} mm, {off} normals");
        }
    }
}
