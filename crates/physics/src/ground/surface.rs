//! The triangles of the ground around a sphere: which of them it can touch.
//!
//! A sphere touches a triangle where the foot of the perpendicular from its center lies inside; in a valley that is so
//! for several. Where it is so for none, it touches the nearest edge or corner, on a ridge or a peak. Nothing else is a
//! contact: a point of an edge that is not the nearest of all lies ahead on a surface the sphere already touches, and
//! would stop it there.

use spatial::{Lane, Mask, Vec3};

use super::{
    Proximity, far,
    patch::{Corners, Patch},
};

/// A center nearer than this to the plane below it \[m\] touches that, wherever the foot is: the direction from an
/// edge would be rounding.
const ON_PLANE: f64 = 1e-5;
/// Distances that differ by less are the same \[m\].
const TIE: f64 = 1e-6;

/// A plane z = `height` + `slope_x` x + `slope_y` y.
#[derive(Clone, Copy)]
struct Plane<L> {
    slope_x: L,
    slope_y: L,
    height: L,
}

/// A sphere over a plane.
struct OverPlane<L> {
    near: Proximity<L>,
    /// Distance of the center, signed \[m\].
    distance: L,
    /// Foot of the perpendicular \[m\].
    foot_x: L,
    foot_y: L,
}

impl<L: Lane> Plane<L> {
    #[inline(always)]
    fn under(self, center: Vec3<L>, radius: L) -> OverPlane<L> {
        let Self { slope_x, slope_y, height } = self;
        let cosine = L::one() / slope_x.mul_add(slope_x, slope_y.mul_add(slope_y, L::one())).sqrt();
        let above = center.z - slope_x.mul_add(center.x, slope_y.mul_add(center.y, height));
        let normal = Vec3::new(-slope_x * cosine, -slope_y * cosine, cosine);
        let distance = above * cosine;
        OverPlane {
            near: Proximity { gap: above.mul_add(cosine, -radius), normal },
            distance,
            foot_x: normal.x.neg_mul_add(distance, center.x),
            foot_y: normal.y.neg_mul_add(distance, center.y),
        }
    }
}

/// The two triangles of a cell, in axes in which it is the square from 0 to `size`.
struct Cell<L: Lane> {
    /// Over the first one [`Cell::side`] is positive.
    planes: [Plane<L>; 2],
    /// Split along the diagonal through the origin; otherwise along the other.
    split_here: L::Mask,
    size: L,
}

impl<L: Lane> Cell<L> {
    #[inline(always)]
    fn new(corners: &Corners<L>, split_here: L::Mask, size: L) -> Self {
        let per_meter = L::one() / size;
        let Corners { at, x, y, opposite } = *corners;
        let (near_x, far_x) = ((x - at) * per_meter, (opposite - y) * per_meter);
        let (near_y, far_y) = ((y - at) * per_meter, (opposite - x) * per_meter);
        let first = Plane { slope_x: near_x, slope_y: split_here.select(far_y, near_y), height: at };
        let second = Plane {
            slope_x: far_x,
            slope_y: split_here.select(near_y, far_y),
            height: split_here.select(at, x + y - opposite),
        };
        Self { planes: [first, second], split_here, size }
    }

    #[inline(always)]
    fn side(&self, x: L, y: L) -> L {
        self.split_here.select(x, self.size - x) - y
    }

    /// Whether the foot of the perpendicular is inside the first and the second triangle, and the center above it. The
    /// diagonal belongs to the first.
    #[inline(always)]
    fn have_foot(&self, [first, second]: [&OverPlane<L>; 2]) -> [L::Mask; 2] {
        let zero = L::zero();
        let quadrant =
            |over: &OverPlane<L>| over.foot_x.ge(zero).and(over.foot_y.ge(zero)).and(over.distance.ge(zero));
        [
            quadrant(first).and(self.side(first.foot_x, first.foot_y).ge(zero)),
            quadrant(second).and(self.side(second.foot_x, second.foot_y).lt(zero)),
        ]
    }

    /// The nearer of its faces that have the foot of the perpendicular inside, for a cell the center is not over. The
    /// borders do not belong to it: on level ground no foot is ever there.
    #[inline(always)]
    fn nearest_face(&self, center: Vec3<L>, radius: L) -> Proximity<L> {
        let [first, second] = self.planes.map(|plane| plane.under(center, radius));
        let inner = |over: &OverPlane<L>| over.foot_x.gt(L::zero()).and(over.foot_y.gt(L::zero()));
        let [first_has, second_has] = self.have_foot([&first, &second]);
        let first_face = first.near.only_where(first_has.and(inner(&first)));
        first_face.or_nearer(second.near.only_where(second_has.and(inner(&second))))
    }
}

/// What a sphere can touch of the surface, in the patch's axes.
pub(super) struct Touched<L> {
    /// The nearer triangle of the cell under the center; where it touches none of them, the edge that is nearest of all.
    pub(super) own: Proximity<L>,
    /// Other triangles, by where they are: of those that meet in a valley, no two share a place.
    pub(super) beside_x: Proximity<L>,
    pub(super) beside_y: Proximity<L>,
}

impl<L: Lane> Touched<L> {
    /// Of a level cell among level cells: its own plane; what stands higher beside it is the walls' business.
    #[inline(always)]
    pub(super) fn level(z: L, radius: L) -> Self {
        let none = Proximity::none();
        Self { own: Proximity { gap: z - radius, ..none }, beside_x: none, beside_y: none }
    }

    /// As [`Touched::level`] where nothing slopes: what a lane gets must not depend on the others'.
    #[inline(always)]
    pub(super) fn only_where(self, slopes: L::Mask, z: L, radius: L) -> Self {
        Self {
            own: Proximity::select(slopes, self.own, Self::level(z, radius).own),
            beside_x: self.beside_x.only_where(slopes),
            beside_y: self.beside_y.only_where(slopes),
        }
    }
}

/// All triangles around; `z` is above the patch's base. An edge counts only if it is nearer than `wall`, the gap to the
/// nearest wall \[m\].
#[inline(never)]
pub(super) fn touched<L: Lane>(patch: &Patch<L>, z: L, radius: L, wall: L) -> Touched<L> {
    let Patch { x, y, size, split_here, .. } = *patch;
    let (zero, one) = (L::zero(), L::one());
    let center = Vec3::new(x, y, z);

    let own = Cell::new(&patch.own, split_here, size);
    let on_first = own.side(x, y).ge(zero);
    let [first, second] = own.planes.map(|plane| plane.under(center, radius));
    let above = on_first.select(first.distance, second.distance).gt(L::splat(ON_PLANE));
    let [first_has, second_has] = own.have_foot([&first, &second]);
    let (first_face, second_face) = (first.near.only_where(first_has), second.near.only_where(second_has));
    let nearest_own = first_face.or_nearer(second_face);
    // A center that is not above the ground is pushed out of the triangle it is under, and of nothing else.
    let own_face =
        Proximity::select(above, nearest_own, Proximity::select(on_first, first.near, second.near));
    let other_own = Proximity::select(first_face.gap.le(second_face.gap), second_face, first_face);

    // The two cells beside are split along the other diagonal.
    let split_beside = split_here.select(zero, one).gt(zero);
    let x_face = Cell::new(&patch.beside_x, split_beside, size)
        .nearest_face(Vec3::new(-x, y, z), radius)
        .flip(-one, one);
    let y_face = Cell::new(&patch.beside_y, split_beside, size)
        .nearest_face(Vec3::new(x, -y, z), radius)
        .flip(one, -one);
    let across_face = Cell::new(&patch.across, split_here, size)
        .nearest_face(Vec3::new(-x, -y, z), radius)
        .flip(-one, -one);
    let beside_x = x_face.or_nearer(other_own).only_where(above);
    let beside_y = y_face.or_nearer(across_face).only_where(above);

    let nearest = own_face.gap.min(beside_x.gap).min(beside_y.gap).min(wall);
    let edge = nearest_edge(patch, center, radius);
    let edge = edge.only_where(above.and(edge.gap.lt(nearest - L::splat(TIE))));
    let on_own = own_face.gap.lt(far());
    Touched {
        own: Proximity::select(on_own, own_face, edge),
        beside_x,
        beside_y: Proximity::select(on_own, edge.or_nearer(beside_y), beside_y),
    }
}

/// A point over a line segment.
#[derive(Clone, Copy)]
struct OverEdge<L> {
    squared: L,
    /// From the nearest point of the segment.
    offset: Vec3<L>,
}

impl<L: Lane> OverEdge<L> {
    /// `from` is the point seen from the segment's beginning, `along` the segment.
    #[inline(always)]
    fn new(from: Vec3<L>, along: Vec3<L>) -> Self {
        let share = (from.dot(along) / along.dot(along)).clamp(L::zero(), L::one());
        let offset = along.scale_add(-share, from);
        Self { squared: offset.dot(offset), offset }
    }

    #[inline(always)]
    fn or_nearer(self, other: Self) -> Self {
        let nearer = self.squared.le(other.squared);
        Self {
            squared: self.squared.min(other.squared),
            offset: Vec3::select(nearer, self.offset, other.offset),
        }
    }
}

/// The nearest edge of all that are within half a cell.
#[inline(always)]
fn nearest_edge<L: Lane>(patch: &Patch<L>, center: Vec3<L>, radius: L) -> Proximity<L> {
    let Patch { own, beside_x, beside_y, across, size, split_here, .. } = patch;
    let zero = L::zero();
    let from = |height: L| Vec3::new(center.x, center.y, center.z - height);
    let border_x = OverEdge::new(from(own.at), Vec3::new(*size, zero, own.x - own.at));
    let border_y = OverEdge::new(from(own.at), Vec3::new(zero, *size, own.y - own.at));
    let beyond_x = OverEdge::new(from(beside_x.at), Vec3::new(-*size, zero, beside_x.x - beside_x.at));
    let beyond_y = OverEdge::new(from(beside_y.at), Vec3::new(zero, -*size, beside_y.y - beside_y.at));
    // The two diagonals that end in the corner: own and across, or beside along x and along y.
    let (start_a, start_b) =
        (split_here.select(own.at, beside_x.at), split_here.select(across.at, beside_y.at));
    let end_a = split_here.select(own.opposite, beside_x.opposite);
    let end_b = split_here.select(across.opposite, beside_y.opposite);
    let toward_own = split_here.select(*size, -*size);
    let diagonal_a = OverEdge::new(from(start_a), Vec3::new(toward_own, *size, end_a - start_a));
    let diagonal_b = OverEdge::new(from(start_b), Vec3::new(-toward_own, -*size, end_b - start_b));
    // The own diagonal where it does not end in the corner.
    let seen = Vec3::new(center.x - *size, center.y, center.z - own.x);
    let facing = OverEdge::new(seen, Vec3::new(-*size, *size, own.y - own.x));
    let facing = OverEdge { squared: split_here.select(far(), facing.squared), ..facing };

    let nearest = border_x.or_nearer(border_y).or_nearer(beyond_x).or_nearer(beyond_y);
    let nearest = nearest.or_nearer(diagonal_a).or_nearer(diagonal_b).or_nearer(facing);
    let distance = nearest.squared.max(L::splat(1e-12)).sqrt();
    Proximity { gap: distance - radius, normal: nearest.offset.scale(L::one() / distance) }
}
