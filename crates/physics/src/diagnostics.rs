//! Quantities nobody needs to step, but everybody to check: momentum, energy.

use spatial::{Lane, Vec3};

use crate::{
    block::Block,
    engine::Engine,
    kinematics::{Spatial, forward_kinematics},
};

impl<L: Lane> Block<L> {
    /// Momentum of the whole robot in the world frame — angular about the center of mass \[N m s\], then linear
    /// \[N s\] — and its kinetic energy \[J\], without armature.
    pub fn momentum_and_energy(&mut self, engine: &Engine<L>) -> ([Vec3<L>; 2], L) {
        let Self { state, parameters, workspace: w, .. } = self;
        let structure = engine.structure();
        forward_kinematics(structure, parameters, state, &mut w.links);
        let base = Spatial { angular: state.base_angular_velocity, linear: state.base_linear_velocity };
        let mut velocity = vec![base; w.links.len()];
        let mut total = Spatial::zero();
        let (mut mass, mut moment) = (L::zero(), Vec3::zero());
        let mut twice_energy = L::zero();
        for (i, link) in w.links.iter().enumerate() {
            if i > 0 {
                let parent = velocity[structure.joints[i - 1].parent_link];
                velocity[i] = link.subspace.scale_add(state.joint_velocity[i - 1], parent);
            }
            let (angular, linear) = link.inertia.momentum(velocity[i].angular, velocity[i].linear);
            let momentum = Spatial { angular, linear };
            twice_energy += momentum.dot(velocity[i]);
            total = total.add(momentum);
            mass += link.inertia.mass;
            moment += link.inertia.moment;
        }
        let center = moment.scale(L::one() / mass);
        let r_wb = state.base_orientation.to_matrix();
        let angular = total.angular - center.cross(total.linear);
        ([r_wb * angular, r_wb * total.linear], L::splat(0.5) * twice_energy)
    }
}
