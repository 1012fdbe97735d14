//! One contact solved while all others rest: what a sweep does again and again.

use spatial::{Lane, Mask, Vec3};

use super::constraint::{Contact, LARGEST_JUMP_MPS};
use crate::structure::BASE_DOFS;

impl<L: Lane> Contact<L> {
    /// Solves the contact given all others; `base` and `joints` are the whitened velocity, of the limb's joints only.
    #[inline(always)]
    pub(super) fn visit(&mut self, friction: L, base: &mut [L; BASE_DOFS], joints: &mut [L]) {
        let velocity = self.velocity(base, joints);
        let old = self.impulse;
        // Rest: no velocity but the allowed approach along the normal.
        let approach = velocity.z + self.allowed_approach;
        // What neither approaches nor pushes stays as it is, even where friction alone could press it on: of two solutions the
        // one without contact.
        let acts = approach.lt(L::zero()).or(old.dot(old).gt(L::zero()));
        if !acts.any() {
            return;
        }
        let residual = Vec3::new(velocity.x, velocity.y, approach);
        let sticking = old - symmetric_mul(&self.inverse_block, residual);
        let length_squared = sticking.x.mul_add(sticking.x, sticking.y * sticking.y);
        let limit = friction * sticking.z.max(L::zero());
        let largest = self.inverse_normal * L::splat(LARGEST_JUMP_MPS);
        let possible = sticking.z.ge(L::zero()).and(sticking.z.le(largest));
        let sticks = length_squared.le(limit * limit).and(possible).and(acts);

        // Otherwise first the normal alone, then a step against the slip that is left, back onto the disk µ λ_n: at the
        // solution friction opposes the slip (maximum dissipation), and it never drives it on the way there.
        let normal = self.inverse_normal.neg_mul_add(approach, old.z).clamp(L::zero(), largest);
        let change = normal - old.z;
        let [slip_x, slip_y] = self.slip_of_normal;
        let trial_x = self.tangential_step.neg_mul_add(slip_x.mul_add(change, velocity.x), old.x);
        let trial_y = self.tangential_step.neg_mul_add(slip_y.mul_add(change, velocity.y), old.y);
        let inverse_length = trial_x.mul_add(trial_x, trial_y * trial_y).max(L::splat(1e-20)).inverse_sqrt();
        let within = (friction * normal * inverse_length).min(L::one());

        self.impulse = Vec3::select(sticks, sticking, Vec3::new(trial_x * within, trial_y * within, normal));
        self.apply(self.impulse - old, base, joints);
    }

    /// Velocity of the contact along its axes: three short sums in place of a long one, as a visit waits for it.
    #[inline(always)]
    pub(super) fn velocity(&self, base: &[L; BASE_DOFS], joints: &[L]) -> Vec3<L> {
        let mut of_joints = Vec3::zero();
        for (&column, &joint) in self.joint_columns[..joints.len()].iter().zip(joints) {
            of_joints = column.scale_add(joint, of_joints);
        }
        let c = &self.base_columns;
        let angular = c[2].scale_add(base[2], c[1].scale_add(base[1], c[0].scale(base[0])));
        let linear = c[5].scale_add(base[5], c[4].scale_add(base[4], c[3].scale(base[3])));
        angular + linear + of_joints
    }

    /// Adds what an impulse changes to the whitened velocity.
    #[inline(always)]
    pub(super) fn apply(&self, impulse: Vec3<L>, base: &mut [L; BASE_DOFS], joints: &mut [L]) {
        // The normal part is known long before the others.
        let along = |c: Vec3<L>, before: L| {
            c.y.mul_add(impulse.y, c.x.mul_add(impulse.x, c.z.mul_add(impulse.z, before)))
        };
        for (velocity, &column) in base.iter_mut().zip(&self.base_columns) {
            *velocity = along(column, *velocity);
        }
        for (&column, joint) in self.joint_columns[..joints.len()].iter().zip(joints) {
            *joint = along(column, *joint);
        }
    }
}

#[inline(always)]
fn symmetric_mul<L: Lane>(w: &[L; 6], v: Vec3<L>) -> Vec3<L> {
    let [xx, yy, zz, xy, xz, yz] = *w;
    Vec3::new(
        xx.mul_add(v.x, xy.mul_add(v.y, xz * v.z)),
        xy.mul_add(v.x, yy.mul_add(v.y, yz * v.z)),
        xz.mul_add(v.x, yz.mul_add(v.y, zz * v.z)),
    )
}
