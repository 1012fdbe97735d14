//! The generalized force that gravity, Coriolis and centrifugal effects take: recursive Newton–Euler at zero
//! acceleration (Featherstone 2008, table 5.1), along the base's axes.

use robot::JointKind;
use spatial::{Lane, Vec3};

use crate::{
    kinematics::{LinkKinematics, Spatial},
    structure::{BASE_DOFS, Structure},
};

/// Motion of a link and the force it needs, at and about its origin.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkMotion<L> {
    velocity: Spatial<L>,
    acceleration: Spatial<L>,
    force: Spatial<L>,
}

impl<L: Lane> LinkMotion<L> {
    pub(crate) fn zero() -> Self {
        Self { velocity: Spatial::zero(), acceleration: Spatial::zero(), force: Spatial::zero() }
    }

    /// Velocity of the link's point `offset` away from its origin, base axes.
    #[inline(always)]
    pub(crate) fn velocity_of(&self, offset: Vec3<L>) -> Vec3<L> {
        self.velocity.motion_at(offset).linear
    }
}

/// Fills `bias` (one a degree of freedom) such that `M v̇ + bias = applied force`, where the base's linear `v̇` is
/// the acceleration of its origin along axes that do not turn.
///
/// `gravity` is in the base frame; `velocity` in degree-of-freedom order; `motion` is scratch, one a link.
#[inline(never)]
pub(crate) fn bias_force<L: Lane>(
    structure: &Structure<L::Scalar>,
    links: &[LinkKinematics<L>],
    gravity: Vec3<L>,
    velocity: &[L],
    motion: &mut [LinkMotion<L>],
    bias: &mut [L],
) {
    let angular = Vec3::new(velocity[0], velocity[1], velocity[2]);
    let linear = Vec3::new(velocity[3], velocity[4], velocity[5]);
    // An origin that moves along fixed axes while the body turns has the spatial acceleration −ω × v;
    // gravity enters as an upward acceleration of the base.
    let base = Spatial { angular, linear };
    let acceleration = Spatial { angular: Vec3::zero(), linear: -(angular.cross(linear) + gravity) };
    motion[0] = newton_euler(&links[0], base, acceleration);
    for (j, joint) in structure.joints.iter().enumerate() {
        let (link, parent) = (&links[j + 1], &motion[joint.parent_link]);
        let carried = parent.velocity.motion_at(link.offset);
        let rate = link.axis.scale(velocity[BASE_DOFS + j]);
        // The axis turns with the parent: its motion changes by v × rate (Featherstone's ×).
        let mut acceleration = parent.acceleration.motion_at(link.offset);
        match joint.kind {
            JointKind::Revolute => {
                acceleration.angular += carried.angular.cross(rate);
                acceleration.linear += carried.linear.cross(rate);
            }
            JointKind::Prismatic => acceleration.linear += carried.angular.cross(rate),
        }
        motion[j + 1] = newton_euler(link, carried.with_joint(joint.kind, rate), acceleration);
    }
    for (j, joint) in structure.joints.iter().enumerate().rev() {
        let (link, force) = (&links[j + 1], motion[j + 1].force);
        bias[BASE_DOFS + j] = force.along(joint.kind, link.axis);
        motion[joint.parent_link].force = motion[joint.parent_link].force.add(force.force_from(link.offset));
    }
    bias[..BASE_DOFS].copy_from_slice(&motion[0].force.to_array());
}

/// Newton's and Euler's equations of one link: f = I a + v ×* I v.
#[inline(always)]
fn newton_euler<L: Lane>(
    link: &LinkKinematics<L>,
    velocity: Spatial<L>,
    acceleration: Spatial<L>,
) -> LinkMotion<L> {
    let (k, l) = link.inertia.momentum(velocity.angular, velocity.linear);
    let (moment, force) = link.inertia.momentum(acceleration.angular, acceleration.linear);
    let (w, v) = (velocity.angular, velocity.linear);
    let force = Spatial { angular: moment + w.cross(k) + v.cross(l), linear: force + w.cross(l) };
    LinkMotion { velocity, acceleration, force }
}
