//! Where every link is, how it moves and what it weighs, all in the base frame about the base origin.
//!
//! In these coordinates spatial quantities of different links add without transforms; single precision suffices
//! because a robot is about a meter large.

use robot::JointKind;
use spatial::{Inertia, Lane, Mat3, Vec3};

use crate::{
    block::{Parameters, State},
    structure::{Structure, broadcast},
};

/// A spatial vector: motion (angular, linear at the base origin) or force (moment about it, force).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spatial<L> {
    pub(crate) angular: Vec3<L>,
    pub(crate) linear: Vec3<L>,
}

impl<L: Lane> Spatial<L> {
    pub(crate) fn zero() -> Self {
        Self { angular: Vec3::zero(), linear: Vec3::zero() }
    }
    /// Power of a force along a motion.
    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> L {
        self.angular.dot(o.angular) + self.linear.dot(o.linear)
    }
    #[inline(always)]
    pub(crate) fn scale_add(self, s: L, o: Self) -> Self {
        Self { angular: self.angular.scale_add(s, o.angular), linear: self.linear.scale_add(s, o.linear) }
    }
    #[inline(always)]
    pub(crate) fn add(self, o: Self) -> Self {
        Self { angular: self.angular + o.angular, linear: self.linear + o.linear }
    }
    #[inline(always)]
    pub(crate) fn component(self, i: usize) -> L {
        if i < 3 { self.angular.to_array()[i] } else { self.linear.to_array()[i - 3] }
    }
}

/// One link's pose, axis and inertia.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkKinematics<L> {
    /// Rotation of the link in the base frame.
    pub(crate) r_bl: Mat3<L>,
    /// Origin of the link in the base frame \[m\].
    pub(crate) p_bl: Vec3<L>,
    /// Motion of the link per unit joint velocity.
    pub(crate) subspace: Spatial<L>,
    /// Inertia about the base origin.
    pub(crate) inertia: Inertia<L>,
}

impl<L: Lane> LinkKinematics<L> {
    pub(crate) fn base() -> Self {
        Self {
            r_bl: Mat3::identity(),
            p_bl: Vec3::zero(),
            subspace: Spatial::zero(),
            inertia: Inertia::zero(),
        }
    }
}

/// Fills `links` (one for the base, one a joint) from the joint positions.
#[inline(always)]
pub(crate) fn forward_kinematics<L: Lane>(
    structure: &Structure<L::Scalar>,
    parameters: &Parameters<L>,
    state: &State<L>,
    links: &mut [LinkKinematics<L>],
) {
    links[0].inertia = parameters.base_inertia;
    for (j, joint) in structure.joints.iter().enumerate() {
        let parent = &links[joint.parent_link];
        let origin = parent.r_bl * broadcast(joint.origin) + parent.p_bl;
        let position = state.joint_position[j];
        let (r_bl, p_bl, subspace) = match joint.kind {
            JointKind::Revolute => {
                let r_bl = joint.axis.turn(&parent.r_bl, position);
                let axis = joint.axis.in_base(&parent.r_bl);
                (r_bl, origin, Spatial { angular: axis, linear: origin.cross(axis) })
            }
            JointKind::Prismatic => {
                let axis = joint.axis.in_base(&parent.r_bl);
                let subspace = Spatial { angular: Vec3::zero(), linear: axis };
                (parent.r_bl, axis.scale_add(position, origin), subspace)
            }
        };
        let inertia = joint.inertia.broadcast().transformed(r_bl, p_bl);
        links[j + 1] = LinkKinematics { r_bl, p_bl, subspace, inertia };
    }
}
