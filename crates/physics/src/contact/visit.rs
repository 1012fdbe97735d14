//! One contact solved while all others rest: what a sweep does again and again.

use spatial::{Lane, Mask, Vec3};

use super::constraint::{Contact, LARGEST_JUMP_MPS};
use crate::structure::BASE_DOFS;

impl<L: Lane> Contact<L> {
    /// Solves the contact given all others; `base` and `joints` are the whitened velocity, `limb` the numbers of its
    /// joints.
    #[inline(always)]
    pub(super) fn visit(&mut self, limb: &[usize], friction: L, base: &mut [L; BASE_DOFS], joints: &mut [L]) {
        let velocity = self.velocity(limb, base, joints);
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
        let length = trial_x.mul_add(trial_x, trial_y * trial_y).max(L::splat(1e-20)).sqrt();
        let within = (friction * normal / length).min(L::one());

        self.impulse = Vec3::select(sticks, sticking, Vec3::new(trial_x * within, trial_y * within, normal));
        self.apply(limb, self.impulse - old, base, joints);
    }

    /// Velocity of the contact along its axes. The sums of base and joints are apart: the base's begins when the visit before
    /// has ended, the joints' long before.
    #[inline(always)]
    pub(super) fn velocity(&self, limb: &[usize], base: &[L; BASE_DOFS], joints: &[L]) -> Vec3<L> {
        let mut of_joints = Vec3::zero();
        for (&column, &joint) in self.joint_columns.iter().zip(limb) {
            of_joints = column.scale_add(joints[joint], of_joints);
        }
        let c = &self.base_columns;
        let angular = c[2].scale_add(base[2], c[1].scale_add(base[1], c[0].scale_add(base[0], of_joints)));
        let linear = c[5].scale_add(base[5], c[4].scale_add(base[4], c[3].scale(base[3])));
        angular + linear
    }

    /// Adds what an impulse changes to the whitened velocity.
    #[inline(always)]
    pub(super) fn apply(
        &self,
        limb: &[usize],
        impulse: Vec3<L>,
        base: &mut [L; BASE_DOFS],
        joints: &mut [L],
    ) {
        let along = |c: Vec3<L>, before: L| {
            c.z.mul_add(impulse.z, c.y.mul_add(impulse.y, c.x.mul_add(impulse.x, before)))
        };
        for (velocity, &column) in base.iter_mut().zip(&self.base_columns) {
            *velocity = along(column, *velocity);
        }
        for (&column, &joint) in self.joint_columns.iter().zip(limb) {
            joints[joint] = along(column, joints[joint]);
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
