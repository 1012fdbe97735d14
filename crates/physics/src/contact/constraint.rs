//! One contact as the solver has it: its axes, its whitened Jacobian, its 3 × 3 block.

use robot::JointKind;
use spatial::{Lane, Mask, Mat3, Vec3};

use super::Candidate;
use crate::{
    engine::Config,
    kinematics::LinkKinematics,
    mass_matrix::whiten_jacobian,
    structure::{BASE_DOFS, Structure},
};

/// A contact in the solver. Vectors are along its axes: two tangents, and the normal as z.
#[derive(Clone, Debug)]
pub(super) struct Contact<L> {
    /// Of the candidate it was made of.
    pub(super) slot: L,
    /// Base frame.
    pub(super) axes: [Vec3<L>; 3],
    /// Whitened Jacobian, one column a degree of freedom: of the base, and of the limb's joints.
    pub(super) base_columns: [Vec3<L>; BASE_DOFS],
    pub(super) joint_columns: Vec<Vec3<L>>,
    /// Speed the contact may at most approach with, negative: must leave with \[m/s\].
    pub(super) allowed_approach: L,
    /// Inverse of the 3 × 3 block, `[xx, yy, zz, xy, xz, yz]`.
    pub(super) inverse_block: [L; 6],
    /// What a unit of normal impulse adds to the slip.
    pub(super) slip_of_normal: [L; 2],
    pub(super) inverse_normal: L,
    /// Step along the slip that cannot overshoot: the inverse of the largest eigenvalue of the tangential block.
    pub(super) tangential_step: L,
    /// \[N s\]
    pub(super) impulse: Vec3<L>,
}

/// What a normal impulse can change its own contact's speed by at most \[m/s\].
///
/// A robot wedged in between two walls overlaps both, and nothing frees it of either: each pushes against the other, sweep after
/// sweep and, begun where the last step ended, step after step, until the sum is rounding. What stops a falling robot on a
/// stretched leg is a tenth of this.
pub(super) const LARGEST_JUMP_MPS: f64 = 200.0;

/// What is needed to turn a nearby piece of ground into a contact.
pub(crate) struct ContactFrame<'a, L: Lane> {
    pub(crate) structure: &'a Structure<L::Scalar>,
    pub(crate) config: &'a Config,
    pub(crate) factor: &'a [L],
    pub(crate) inverse_diagonal: &'a [L],
    pub(crate) links: &'a [LinkKinematics<L>],
    pub(crate) r_wb: Mat3<L>,
}

impl<L: Lane> Contact<L> {
    /// Room for a contact of a limb of at most `joints` joints.
    pub(super) fn new(joints: usize) -> Self {
        Self {
            slot: L::zero(),
            axes: [Vec3::zero(); 3],
            base_columns: [Vec3::zero(); BASE_DOFS],
            joint_columns: vec![Vec3::zero(); joints],
            allowed_approach: L::zero(),
            inverse_block: [L::zero(); 6],
            slip_of_normal: [L::zero(); 2],
            inverse_normal: L::zero(),
            tangential_step: L::zero(),
            impulse: Vec3::zero(),
        }
    }

    /// Becomes the contact of a candidate, without impulse.
    #[inline(never)]
    pub(super) fn become_that_of(&mut self, frame: &ContactFrame<L>, limb: usize, candidate: &Candidate<L>) {
        // Of a leg's three joints the compiler knows that they are three: loops over them unroll.
        match *frame.structure.limbs[limb].joints {
            [hip, thigh, shank] => self.become_with(frame, &[hip, thigh, shank], candidate),
            [] => self.become_with(frame, &[], candidate),
            ref joints => self.become_with(frame, joints, candidate),
        }
    }

    #[inline(always)]
    fn become_with(&mut self, frame: &ContactFrame<L>, joints: &[usize], candidate: &Candidate<L>) {
        self.slot = candidate.slot;
        self.axes = axes(candidate.normal);
        self.allowed_approach = allowed_approach(frame.config, candidate.gap);
        // The base's columns stay in registers until they are done.
        let mut base_columns = self.base_columns_of(candidate.point);
        let joint_columns = &mut self.joint_columns[..joints.len()];
        fill_joint_columns(frame, &self.axes, joints, candidate, joint_columns);
        whiten_jacobian(
            frame.structure,
            frame.factor,
            frame.inverse_diagonal,
            joints,
            &mut base_columns,
            joint_columns,
        );
        self.prepare_block(&base_columns, joints.len());
        self.base_columns = base_columns;
    }

    /// Velocity of a point along the contact's axes, per unit velocity of each degree of freedom of the base.
    #[inline(always)]
    fn base_columns_of(&self, point: Vec3<L>) -> [Vec3<L>; BASE_DOFS] {
        // Along an axis a, turning about e_k moves the point by (e_k × p) · a = e_k · (p × a).
        let [x, y, z] = self.axes.map(|axis| point.cross(axis));
        let [ax, ay, az] = self.axes;
        [
            Vec3::new(x.x, y.x, z.x),
            Vec3::new(x.y, y.y, z.y),
            Vec3::new(x.z, y.z, z.z),
            Vec3::new(ax.x, ay.x, az.x),
            Vec3::new(ax.y, ay.y, az.y),
            Vec3::new(ax.z, ay.z, az.z),
        ]
    }

    #[inline(always)]
    fn prepare_block(&mut self, base_columns: &[Vec3<L>; BASE_DOFS], joints: usize) {
        let mut w = [L::zero(); 6];
        for k in 0..BASE_DOFS {
            add_square(&mut w, base_columns[k]);
        }
        for k in 0..joints {
            add_square(&mut w, self.joint_columns[k]);
        }
        self.slip_of_normal = [w[4], w[5]];
        self.inverse_normal = L::one() / w[2];
        let half_difference = (w[0] - w[1]) * L::splat(0.5);
        let root = half_difference.mul_add(half_difference, w[3] * w[3]).sqrt();
        self.tangential_step = L::one() / (w[0] + w[1]).mul_add(L::splat(0.5), root);
        self.inverse_block = symmetric_inverse(&w);
    }
}

/// Velocity of the candidate's point along a contact's axes, per unit velocity of each of a limb's joints.
#[inline(always)]
fn fill_joint_columns<L: Lane>(
    frame: &ContactFrame<L>,
    axes: &[Vec3<L>; 3],
    joints: &[usize],
    candidate: &Candidate<L>,
    columns: &mut [Vec3<L>],
) {
    let point = candidate.point;
    for (place, (column, &joint)) in columns.iter_mut().zip(joints).enumerate() {
        let link = &frame.links[joint + 1];
        let place = L::splat((BASE_DOFS + place) as f64);
        let moves = place.lt(candidate.depth).select(L::one(), L::zero());
        let motion = match frame.structure.joints[joint].kind {
            JointKind::Revolute => link.axis.cross(point - link.p_bl),
            JointKind::Prismatic => link.axis,
        }
        .scale(moves);
        let [x, y, z] = axes.map(|axis| axis.dot(motion));
        *column = Vec3::new(x, y, z);
    }
}

/// A gap may close within the step; an overlap must open by a capped share.
#[inline(always)]
fn allowed_approach<L: Lane>(config: &Config, gap: L) -> L {
    let per_step = L::splat(1.0 / config.time_step);
    let correction = (gap * L::splat(config.error_reduction / config.time_step))
        .max(L::splat(-config.max_depenetration_speed));
    gap.gt(L::zero()).select(gap * per_step, correction)
}

/// Two tangents and the unit normal, right-handed (Duff et al. 2017, *Building an orthonormal basis, revisited*).
#[inline(always)]
fn axes<L: Lane>(n: Vec3<L>) -> [Vec3<L>; 3] {
    let sign = n.z.ge(L::zero()).select(L::one(), -L::one());
    let a = -(L::one() / (sign + n.z));
    let b = n.x * n.y * a;
    let x = Vec3::new((sign * n.x * n.x).mul_add(a, L::one()), sign * b, -(sign * n.x));
    let y = Vec3::new(b, (n.y * n.y).mul_add(a, sign), -n.y);
    [x, y, n]
}

/// Adds c cᵀ, `[xx, yy, zz, xy, xz, yz]`.
#[inline(always)]
fn add_square<L: Lane>(w: &mut [L; 6], c: Vec3<L>) {
    w[0] = c.x.mul_add(c.x, w[0]);
    w[1] = c.y.mul_add(c.y, w[1]);
    w[2] = c.z.mul_add(c.z, w[2]);
    w[3] = c.x.mul_add(c.y, w[3]);
    w[4] = c.x.mul_add(c.z, w[4]);
    w[5] = c.y.mul_add(c.z, w[5]);
}

#[inline(always)]
fn symmetric_inverse<L: Lane>(w: &[L; 6]) -> [L; 6] {
    let [xx, yy, zz, xy, xz, yz] = *w;
    let (cxx, cxy, cxz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let inverse = L::one() / (xx * cxx + xy * cxy + xz * cxz);
    [
        cxx * inverse,
        (xx * zz - xz * xz) * inverse,
        (xx * yy - xy * xy) * inverse,
        cxy * inverse,
        cxz * inverse,
        (xy * xz - xx * yz) * inverse,
    ]
}
