//! Quantities nobody needs to step, but everybody to check: momentum, energy, the equation of motion.
//!
//! Without contacts and joint limits a robot moves by `M(q) v̇ + bias(q, v) = applied force`. Degrees of freedom are in
//! the order base angular, base linear, joints (model order); quantities of the base are along its axes. The base's
//! linear `v̇` is the acceleration of the base origin in the world, turned into the base's axes: `r_wbᵀ p̈`. The rate
//! of change of [`State::base_linear_velocity`](crate::State), whose axes turn, is that minus ω × v.

use spatial::{Lane, Vec3};

use crate::{
    block::Block,
    engine::Engine,
    kinematics::{Spatial, forward_kinematics},
    mass_matrix::{composite_rigid_body, factorize, unwhiten_velocity, whiten_force},
    step,
    structure::{BASE_DOFS, SphereConstants},
    workspace::Workspace,
};

impl<L: Lane> Block<L> {
    /// Momentum of the whole robot in the world frame — angular about the center of mass \[N m s\], then linear
    /// \[N s\] — and its kinetic energy \[J\], without armature.
    pub fn momentum_and_energy(&self, engine: &Engine<L>) -> ([Vec3<L>; 2], L) {
        let Self { state, parameters, .. } = self;
        let mut w = Workspace::new(engine);
        let structure = engine.structure();
        forward_kinematics(structure, parameters, state, &mut w.links);
        let base = Spatial { angular: state.base_angular_velocity, linear: state.base_linear_velocity };
        let mut velocity = vec![base; w.links.len()];
        let mut total = Spatial::zero();
        let (mut mass, mut moment) = (L::zero(), Vec3::zero());
        let mut twice_energy = L::zero();
        for (i, link) in w.links.iter().enumerate() {
            if i > 0 {
                let joint = &structure.joints[i - 1];
                let rate = link.axis.scale(state.joint_velocity[i - 1]);
                velocity[i] = velocity[joint.parent_link].motion_at(link.offset).with_joint(joint.kind, rate);
            }
            let Spatial { angular: w, linear: v } = velocity[i];
            let (angular, linear) = link.inertia.momentum(w, v);
            twice_energy += angular.dot(w) + linear.dot(v);
            total = total.add(Spatial { angular, linear }.force_from(link.p_bl));
            mass += link.inertia.mass;
            moment += link.p_bl.scale_add(link.inertia.mass, link.inertia.moment);
        }
        let center = moment.scale(L::one() / mass);
        let r_wb = state.base_orientation.to_matrix();
        let angular = total.angular - center.cross(total.linear);
        ([r_wb * angular, r_wb * total.linear], L::splat(0.5) * twice_energy)
    }

    /// Centers of the contact spheres in the world frame \[m\], in the order of `RobotModel::contacts`.
    pub fn contact_centers(&self, engine: &Engine<L>) -> Vec<Vec3<L>> {
        let Self { state, parameters, .. } = self;
        let mut w = Workspace::new(engine);
        let structure = engine.structure();
        forward_kinematics(structure, parameters, state, &mut w.links);
        let r_wb = state.base_orientation.to_matrix();
        let center = |sphere: &SphereConstants<L::Scalar>| {
            r_wb * sphere.center_in_base(parameters, &w.links) + state.base_position
        };
        structure.spheres.iter().map(center).collect()
    }

    /// Mass matrix with armature, full and symmetric, row by row: kg m² where both degrees of freedom turn, kg m
    /// where one does, kg where none does.
    pub fn mass_matrix(&self, engine: &Engine<L>) -> Vec<L> {
        let w = self.mass_matrix_and_kinematics(engine);
        let structure = engine.structure();
        let dofs = structure.num_dofs();
        let mut full = vec![L::zero(); dofs * dofs];
        for dof in 0..dofs {
            let row = &w.factor[structure.row_start(dof)..];
            for (&entry, &ancestor) in row.iter().zip(structure.chain(dof)) {
                full[dof * dofs + ancestor] = entry;
                full[ancestor * dofs + dof] = entry;
            }
        }
        full
    }

    /// The generalized force that gravity and velocity take, one entry a degree of freedom \[N m or N\]: what must be
    /// applied for `v̇` to be zero.
    pub fn bias_force(&self, engine: &Engine<L>) -> Vec<L> {
        let Self { state, parameters, .. } = self;
        let mut w = Workspace::new(engine);
        forward_kinematics(engine.structure(), parameters, state, &mut w.links);
        step::bias(engine, state, state.base_orientation.to_matrix(), &mut w);
        w.force
    }

    /// The acceleration `v̇` under these joint torques \[N m or N\] and the forces of [`Block::input`]; neither ground nor
    /// joint limits nor servos act. It comes from the same factor a step uses.
    ///
    /// # Panics
    /// If there is not one torque for each joint.
    pub fn forward_dynamics(&self, engine: &Engine<L>, joint_torque: &[L]) -> Vec<L> {
        assert_eq!(joint_torque.len(), engine.num_joints(), "one torque a joint");
        let mut w = self.mass_matrix_and_kinematics(engine);
        let structure = engine.structure();
        let Self { state, parameters, input, .. } = self;
        factorize(structure, &mut w.factor, &mut w.inverse_diagonal);
        let r_wb = state.base_orientation.to_matrix();
        step::bias(engine, state, r_wb, &mut w);
        step::subtract_from_base_forces(parameters, input, r_wb, &mut w.force);
        for (force, &torque) in w.force[BASE_DOFS..].iter_mut().zip(joint_torque) {
            *force = torque - *force;
        }
        // v̇ = L⁻¹ L⁻ᵀ (applied − bias).
        whiten_force(structure, &w.factor, &w.inverse_diagonal, &mut w.force);
        let mut acceleration = vec![L::zero(); structure.num_dofs()];
        unwhiten_velocity(structure, &w.factor, &w.inverse_diagonal, &w.force, &mut acceleration);
        acceleration
    }

    /// A workspace with kinematics and, in place of the factor, the packed mass matrix.
    fn mass_matrix_and_kinematics(&self, engine: &Engine<L>) -> Workspace<L> {
        let Self { state, parameters, .. } = self;
        let mut w = Workspace::new(engine);
        let structure = engine.structure();
        forward_kinematics(structure, parameters, state, &mut w.links);
        for (diagonal, joint) in w.diagonal.iter_mut().zip(&structure.joints) {
            *diagonal = L::broadcast(joint.armature);
        }
        composite_rigid_body(structure, &w.links, &w.diagonal, &mut w.composite, &mut w.factor);
        w
    }
}
