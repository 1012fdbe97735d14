//! Scratch memory of a step.

use std::sync::{Mutex, MutexGuard, PoisonError};

use spatial::{Inertia, Lane};

use crate::{
    actuator::AffineTorque,
    bias::LinkMotion,
    contact::{ContactSet, Search},
    engine::Engine,
    joint_limit::LimitSet,
    kinematics::LinkKinematics,
};

/// Scratch memory of one step: nothing in it is read before it is written.
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
    /// Per joint: armature plus implicit damping \[kg m² or kg\].
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
    /// The same before contacts and limits.
    pub(crate) unconstrained: Vec<L>,
    pub(crate) search: Search<L>,
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
            unconstrained: vec![L::zero(); dofs],
            search: Search::new(structure.spheres.len()),
            contacts: ContactSet::new(structure),
            limits: LimitSet::new(joints, structure.max_chain()),
        }
    }
}

/// Workspaces that are not in use.
///
/// A block borrows one for a step: the few that take turns stay in a core's nearest cache, where one for each block would be
/// fetched from afar.
#[derive(Debug)]
pub(crate) struct Pool<L>(Mutex<Vec<Workspace<L>>>);

impl<L: Lane> Pool<L> {
    pub(crate) fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    pub(crate) fn take(&self, engine: &Engine<L>) -> Workspace<L> {
        self.free().pop().unwrap_or_else(|| Workspace::new(engine))
    }

    pub(crate) fn give_back(&self, workspace: Workspace<L>) {
        self.free().push(workspace);
    }

    /// A panic elsewhere leaves nothing half-done in a list of what is free.
    fn free(&self) -> MutexGuard<'_, Vec<Workspace<L>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<L: Lane> Clone for Pool<L> {
    fn clone(&self) -> Self {
        Self::new()
    }
}
