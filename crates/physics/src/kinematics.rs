//! Where every link is, how it moves and what it weighs, along the axes of the base frame.
//!
//! Parallel axes spare the rotation from link to link. Spatial quantities are about each link's own origin: about a common one,
//! what a far joint feels would be the small difference of large numbers, and single precision would lose a digit or two.

use robot::JointKind;
use spatial::{Inertia, Lane, Mat3, Vec3};

use crate::{
    block::{Parameters, State},
    structure::{Structure, broadcast},
};

/// A spatial vector: motion (angular, linear at a point) or force (moment about a point, force).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<L> {
    pub(crate) angular: Vec3<L>,
    pub(crate) linear: Vec3<L>,
}

impl<L: Lane> Spatial<L> {
    pub(crate) fn zero() -> Self {
        Self { angular: Vec3::zero(), linear: Vec3::zero() }
    }
    #[inline(always)]
    pub(crate) fn add(self, o: Self) -> Self {
        Self { angular: self.angular + o.angular, linear: self.linear + o.linear }
    }
    /// A motion, at the point `offset` away from the present one.
    #[inline(always)]
    pub(crate) fn motion_at(self, offset: Vec3<L>) -> Self {
        Self { angular: self.angular, linear: self.linear + self.angular.cross(offset) }
    }
    /// A force, about the point from which the present one is `offset` away.
    #[inline(always)]
    pub(crate) fn force_from(self, offset: Vec3<L>) -> Self {
        Self { angular: self.angular + offset.cross(self.linear), linear: self.linear }
    }
    /// The part that a joint's axis through the point sees.
    #[inline(always)]
    pub(crate) fn along(self, kind: JointKind, axis: Vec3<L>) -> L {
        match kind {
            JointKind::Revolute => self.angular.dot(axis),
            JointKind::Prismatic => self.linear.dot(axis),
        }
    }
    /// A motion together with that of a joint, `rate` along its axis through the point.
    #[inline(always)]
    pub(crate) fn with_joint(self, kind: JointKind, rate: Vec3<L>) -> Self {
        match kind {
            JointKind::Revolute => Self { angular: self.angular + rate, ..self },
            JointKind::Prismatic => Self { linear: self.linear + rate, ..self },
        }
    }
    #[inline(always)]
    pub(crate) fn to_array(self) -> [L; 6] {
        let ([a, b, c], [d, e, f]) = (self.angular.to_array(), self.linear.to_array());
        [a, b, c, d, e, f]
    }
}

/// One link's pose, axis and inertia.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkKinematics<L> {
    /// Rotation of the link in the base frame.
    pub(crate) r_bl: Mat3<L>,
    /// Origin of the link in the base frame \[m\].
    pub(crate) p_bl: Vec3<L>,
    /// Origin of the link from its parent's, base axes \[m\].
    pub(crate) offset: Vec3<L>,
    /// Unit axis of the joint, base axes.
    pub(crate) axis: Vec3<L>,
    /// Inertia about the link's origin, base axes.
    pub(crate) inertia: Inertia<L>,
}

impl<L: Lane> LinkKinematics<L> {
    pub(crate) fn base() -> Self {
        Self {
            r_bl: Mat3::identity(),
            p_bl: Vec3::zero(),
            offset: Vec3::zero(),
            axis: Vec3::zero(),
            inertia: Inertia::zero(),
        }
    }
}

/// Fills `links` (one for the base, one a joint) from the joint positions.
#[inline(never)]
pub(crate) fn forward_kinematics<L: Lane>(
    structure: &Structure<L::Scalar>,
    parameters: &Parameters<L>,
    state: &State<L>,
    links: &mut [LinkKinematics<L>],
) {
    links[0].inertia = parameters.base_inertia;
    for (j, joint) in structure.joints.iter().enumerate() {
        let parent = &links[joint.parent_link];
        let origin = parent.r_bl * broadcast(joint.origin);
        let axis = joint.axis.in_base(&parent.r_bl);
        let position = state.joint_position[j];
        let (r_bl, offset) = match joint.kind {
            JointKind::Revolute => (joint.axis.turn(&parent.r_bl, position), origin),
            JointKind::Prismatic => (parent.r_bl, axis.scale_add(position, origin)),
        };
        let inertia = joint.inertia.broadcast().rotated(r_bl);
        links[j + 1] = LinkKinematics { r_bl, p_bl: parent.p_bl + offset, offset, axis, inertia };
    }
}
