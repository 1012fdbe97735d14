//! Scratch memory of a step, allocated once, and what is kept from one step to the next for warm starting.

use spatial::{Inertia, Lane, Vec3};

use crate::{
    actuator::AffineTorque, bias::LinkMotion, contact::ContactSet, engine::Engine, joint_limit::LimitSet,
    kinematics::LinkKinematics,
};

/// Scratch memory of one block.
#[derive(Clone, Debug)]
pub(crate) struct Workspace<L> {
    /// Per link: pose, axis, inertia.
    pub(crate) links: Vec<LinkKinematics<L>>,
    /// Per link: velocity, acceleration, force.
    pub(crate) motion: Vec<LinkMotion<L>>,
    /// Per link: inertia of the subtree.
    pub(crate) composite: Vec<Inertia<L>>,
    /// Per joint: torque of the servo.
    pub(crate) torque: Vec<AffineTorque<L>>,
    /// Per joint: armature plus implicit damping \[kg m²\].
    pub(crate) diagonal: Vec<L>,
    /// Packed mass matrix, then its factor.
    pub(crate) factor: Vec<L>,
    /// Per degree of freedom: inverse diagonal of the factor.
    pub(crate) inverse_diagonal: Vec<L>,
    /// Per degree of freedom: velocity.
    pub(crate) velocity: Vec<L>,
    /// Per degree of freedom: generalized force.
    pub(crate) force: Vec<L>,
    /// Per degree of freedom: whitened velocity.
    pub(crate) whitened: Vec<L>,
    pub(crate) contacts: ContactSet<L>,
    pub(crate) limits: LimitSet<L>,
}

impl<L: Lane> Workspace<L> {
    pub(crate) fn new(engine: &Engine<L>) -> Self {
        let structure = engine.structure();
        let joints = structure.joints.len();
        let dofs = structure.num_dofs();
        Self {
            links: vec![LinkKinematics::base(); joints + 1],
            motion: vec![LinkMotion::zero(); joints + 1],
            composite: vec![Inertia::zero(); joints + 1],
            torque: vec![AffineTorque { constant: L::zero(), damping: L::zero() }; joints],
            diagonal: vec![L::zero(); joints],
            factor: vec![L::zero(); structure.packed_len()],
            inverse_diagonal: vec![L::zero(); dofs],
            velocity: vec![L::zero(); dofs],
            force: vec![L::zero(); dofs],
            whitened: vec![L::zero(); dofs],
            contacts: ContactSet::new(structure.spheres.len(), structure.max_chain()),
            limits: LimitSet::new(joints, structure.max_chain()),
        }
    }

    pub(crate) fn forget_contacts(&mut self, lane: usize) {
        self.contacts.forget(lane);
    }

    /// Contact impulses of the last step \[N s\], world frame.
    pub(crate) fn impulses(&self) -> &[Vec3<L>] {
        &self.contacts.last_impulse
    }

    pub(crate) fn set_impulses(&mut self, impulses: &[Vec3<L>]) {
        self.contacts.last_impulse.copy_from_slice(impulses);
    }
}
