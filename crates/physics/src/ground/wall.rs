//! Vertical faces: what stands where neighboring cells do not meet.

use spatial::{Lane, Mask, Vec3};

use super::{Proximity, far, patch::Patch};

/// A step lower than this between neighboring cells is no wall \[m\].
pub(super) const MIN_HEIGHT: f64 = 1e-3;
/// No wall is looked for this far above the ground \[m\]: no step of any terrain is higher.
const MAX_HEIGHT: f64 = 0.5;

/// Proximities to the wall across x and to the one across y, in the patch's axes; `z` is above its base. An upright edge that is
/// nearer than the farther of them has its place.
///
/// Each wall has a place of its own, for where two of them meet a sphere rests on both: with the nearer alone it
/// sinks into the other by what a step moves it.
#[inline(always)]
pub(super) fn walls<L: Lane>(patch: &Patch<L>, z: L, radius: L) -> [Proximity<L>; 2] {
    let per_cell = L::one() / patch.size;
    let mix = |a: L, b: L, t: L| t.mul_add(b - a, a);
    let Patch { own, beside_x, beside_y, across, .. } = patch;
    let x_wall = {
        let along = patch.y * per_cell;
        let (foot, top) = (mix(own.at, own.y, along), mix(beside_x.at, beside_x.y, along));
        let (gap, away, up) = wall(z, radius, foot, top, patch.x);
        Proximity { gap, normal: Vec3::new(away, L::zero(), up) }
    };
    let y_wall = {
        let along = patch.x * per_cell;
        let (foot, top) = (mix(own.at, own.x, along), mix(beside_y.at, beside_y.x, along));
        let (gap, away, up) = wall(z, radius, foot, top, patch.y);
        Proximity { gap, normal: Vec3::new(L::zero(), away, up) }
    };
    // Where all four heights differ the tallest cell may be the one across: its edge stands free above the taller neighbor.
    let foot = own.at.max(beside_x.at).max(beside_y.at);
    let free = stands(z, foot, across.at).and(z.ge(foot));
    if !free.any() {
        return [x_wall, y_wall];
    }
    let edge = upright_edge(patch, z, radius, foot).only_where(free);
    let x_is_farther = x_wall.gap.ge(y_wall.gap);
    let y_is_farther = x_wall.gap.lt(y_wall.gap);
    [(x_wall, x_is_farther), (y_wall, y_is_farther)]
        .map(|(wall, farther)| Proximity::select(farther.and(edge.gap.lt(wall.gap)), edge, wall))
}

/// The corner of a box seen from the cell that touches it there only: without it a sphere would be inside before it
/// met a wall. It stands free from `foot` up.
#[inline(always)]
fn upright_edge<L: Lane>(patch: &Patch<L>, z: L, radius: L, foot: L) -> Proximity<L> {
    let Patch { x, y, across, .. } = patch;
    let distance = x.mul_add(*x, *y * *y).sqrt();
    let tiny = L::splat(1e-6);
    let inverse = L::one() / distance.max(tiny);
    let at_edge = distance.lt(tiny);
    let along_x = at_edge.select(L::one(), *x * inverse);
    let along_y = at_edge.select(L::zero(), *y * inverse);
    let (gap, away, up) = wall(z, radius, foot, across.at, distance);
    Proximity { gap, normal: Vec3::new(along_x * away, along_y * away, up) }
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
    let away = at_border.select(L::one(), distance * inverse);
    let up = at_border.select(L::zero(), above * inverse);
    (stands(z, foot, top).select(reach - radius, far()), away, up)
}

#[inline(always)]
fn stands<L: Lane>(z: L, foot: L, top: L) -> L::Mask {
    (top - foot).gt(L::splat(MIN_HEIGHT)).and((z - foot).lt(L::splat(MAX_HEIGHT)))
}
