//! One time step: semi-implicit Euler with contacts solved at velocity level.
//!
//! 1. kinematics, mass matrix (with armature and implicit servo damping), its factor, bias forces;
//! 2. unconstrained velocity; 3. contacts and joint limits, a fixed number of Gauss–Seidel sweeps; 4. positions.
//!
//! The larger stages are never inlined: in one function of thousands of instructions the compiler runs out of registers.

use spatial::{Lane, Mask, Mat3, Vec3};

use crate::{
    actuator::affine_torque,
    bias::bias_force,
    block::{Block, Input, Parameters, State},
    contact::{Candidate, ContactFrame, Found},
    engine::Engine,
    ground,
    kinematics::forward_kinematics,
    mass_matrix::{composite_rigid_body, factorize, unwhiten_velocity, whiten_force, whiten_velocity},
    structure::{BASE_DOFS, Limb, Structure},
    workspace::Workspace,
};

/// Advances a block by one time step.
pub(crate) fn step<L: Lane>(engine: &Engine<L>, block: &mut Block<L>, workspace: &mut Workspace<L>) {
    let r_wb = block.state.base_orientation.to_matrix();
    unconstrained_velocity(engine, block, r_wb, workspace);
    find_contacts(engine, block, r_wb, workspace);
    solve(engine, block.parameters.friction, workspace);
    integrate(engine, block, r_wb, workspace);
}

/// Fills the workspace: kinematics, factor, and the whitened velocity the step would end with without contacts.
#[inline(always)]
fn unconstrained_velocity<L: Lane>(
    engine: &Engine<L>,
    block: &Block<L>,
    r_wb: Mat3<L>,
    w: &mut Workspace<L>,
) {
    let structure = engine.structure();
    let dt = L::splat(engine.config.time_step);
    let Block { state, parameters, input, .. } = block;
    forward_kinematics(structure, parameters, state, &mut w.links);
    for (j, joint) in structure.joints.iter().enumerate() {
        let torque = affine_torque(
            &engine.config.actuator,
            parameters.stiffness,
            parameters.damping,
            input.joint_target[j],
            state.joint_position[j],
            state.joint_velocity[j],
        );
        w.diagonal[j] = dt.mul_add(torque.damping, L::broadcast(joint.armature));
        w.torque[j] = torque;
    }
    composite_rigid_body(structure, &w.links, &w.diagonal, &mut w.composite, &mut w.factor);
    factorize(structure, &mut w.factor, &mut w.inverse_diagonal);

    // Applied minus bias.
    bias(engine, state, r_wb, w);
    subtract_from_base_forces(parameters, input, r_wb, &mut w.force);
    for (j, torque) in w.torque.iter().enumerate() {
        let applied = torque.damping.neg_mul_add(state.joint_velocity[j], torque.constant);
        w.force[BASE_DOFS + j] = applied - w.force[BASE_DOFS + j];
    }
    whiten_force(structure, &w.factor, &w.inverse_diagonal, &mut w.force);
    whiten_velocity(structure, &w.factor, &w.velocity, &mut w.whitened);
    for (x, &force) in w.whitened.iter_mut().zip(&w.force) {
        *x = dt.mul_add(force, *x);
    }
}

/// Fills the workspace's velocity with the state's and its force with the bias force; needs the links' kinematics.
#[inline(always)]
pub(crate) fn bias<L: Lane>(engine: &Engine<L>, state: &State<L>, r_wb: Mat3<L>, w: &mut Workspace<L>) {
    let (angular, linear) = (state.base_angular_velocity, state.base_linear_velocity);
    w.velocity[..BASE_DOFS].copy_from_slice(&[angular.x, angular.y, angular.z, linear.x, linear.y, linear.z]);
    w.velocity[BASE_DOFS..].copy_from_slice(&state.joint_velocity);
    let gravity = r_wb.transpose_mul(Vec3::splat(engine.config.gravity));
    bias_force(engine.structure(), &w.links, gravity, &w.velocity, &mut w.motion, &mut w.force);
}

/// Replaces the base's part of the bias force by what the hand and the disturbance apply, minus it.
#[inline(always)]
pub(crate) fn subtract_from_base_forces<L: Lane>(
    parameters: &Parameters<L>,
    input: &Input<L>,
    r_wb: Mat3<L>,
    bias: &mut [L],
) {
    let hand = r_wb.transpose_mul(heading_to_world(r_wb, input.hand_force));
    let base = r_wb.transpose_mul(heading_to_world(r_wb, input.base_force));
    let moment = parameters.hand_position.cross(hand).to_array();
    let force = (hand + base).to_array();
    for i in 0..3 {
        bias[i] = moment[i] - bias[i];
        bias[3 + i] = force[i] - bias[3 + i];
    }
}

/// A vector of the heading frame (level, x along the base's x on the ground) in the world frame.
#[inline(always)]
pub(crate) fn heading_to_world<L: Lane>(r_wb: Mat3<L>, v: Vec3<L>) -> Vec3<L> {
    let forward = r_wb.columns[0];
    let length = forward.x.mul_add(forward.x, forward.y * forward.y).max(L::splat(1e-12)).sqrt();
    let inverse = L::one() / length;
    let (c, s) = (forward.x * inverse, forward.y * inverse);
    Vec3::new(c.mul_add(v.x, -(s * v.y)), s.mul_add(v.x, c * v.y), v.z)
}

#[inline(never)]
fn find_contacts<L: Lane>(engine: &Engine<L>, block: &Block<L>, r_wb: Mat3<L>, w: &mut Workspace<L>) {
    let structure = engine.structure();
    let frame = ContactFrame {
        structure,
        config: &engine.config,
        factor: &w.factor,
        inverse_diagonal: &w.inverse_diagonal,
        links: &w.links,
        r_wb,
    };
    let dt = L::splat(engine.config.time_step);
    let margin = L::splat(engine.config.contact_margin);
    w.search.run(engine, block, r_wb, &w.links, &w.motion);
    w.contacts.clear();
    for (limb, Limb { spheres, .. }) in structure.limbs.iter().enumerate() {
        for &i in spheres {
            let Found { near: true, center, velocity, faces } = &w.search.found[i] else { continue };
            let sphere = &structure.spheres[i];
            let depth = L::splat(structure.chain_of_link(sphere.link).len() as f64);
            for (k, near) in faces.iter().enumerate() {
                if !near.gap.lt(ground::far()).any() {
                    continue;
                }
                // What the step would not close, and a margin for what the step itself changes, is no contact.
                let normal = r_wb.transpose_mul(near.normal);
                let approach = velocity.dot(normal);
                let least = approach.neg_mul_add(dt, margin).max(margin).min(L::splat(ground::REACH));
                let gap = near.only_where(near.gap.lt(least)).gap;
                let slot = k * structure.spheres.len() + i;
                let point = normal.scale_add(-L::broadcast(sphere.radius), *center);
                let last_impulse = block.impulses[slot];
                let slot_of_lanes = L::splat(slot as f64);
                let candidate = Candidate { gap, normal, point, slot: slot_of_lanes, depth, last_impulse };
                w.contacts.consider(slot, candidate);
            }
        }
        w.contacts.add_limb(&frame, limb);
    }
    w.limits.collect(structure, &engine.config, &w.factor, &w.inverse_diagonal, &block.state.joint_position);
}

#[inline(never)]
fn solve<L: Lane>(engine: &Engine<L>, friction: L, w: &mut Workspace<L>) {
    let structure = engine.structure();
    w.unconstrained.copy_from_slice(&w.whitened);
    w.contacts.warm_start(structure, &mut w.whitened);
    for _ in 0..engine.config.solver_sweeps {
        w.limits.sweep(structure, &mut w.whitened);
        w.contacts.sweep(structure, friction, &mut w.whitened);
    }
    forbid_energy_gain(structure, engine.config.max_depenetration_speed, w);
    unwhiten_velocity(structure, &w.factor, &w.inverse_diagonal, &w.whitened, &mut w.velocity);
}

/// Takes all impulses back by one common share where together they would add energy.
///
/// Hard contacts and limits cannot, but for what pushing out of an overlap takes. A fixed number of sweeps can: beyond some
/// friction a sliding contact has no solution (Painlevé), and the sweeps run away. What counts as
/// energy is ½ |x|² in whitened coordinates, which is ½ vᵀ (M + armature + dt · damping) v: the kinetic energy, and with servos
/// on half of what their damping takes of it in a step. Along the change d of x it is a parabola, and the share is where
/// that comes back to what is allowed: what pushing out takes, and no more than the whole robot has at
/// `max_depenetration_speed`.
#[inline(never)]
fn forbid_energy_gain<L: Lane>(
    structure: &Structure<L::Scalar>,
    max_depenetration_speed: f64,
    w: &mut Workspace<L>,
) {
    let (mut along, mut squared) = (L::zero(), L::zero());
    for (&after, &before) in w.whitened.iter().zip(&w.unconstrained) {
        let change = after - before;
        along = before.mul_add(change, along);
        squared = change.mul_add(change, squared);
    }
    // A five-hundredth of ½ |d|² is let pass: more than rounding, no running away. What gains more loses all of it.
    let slack = L::splat(1e-3) * squared;
    let gain = L::splat(0.5).mul_add(squared, along) - slack;
    if !gain.gt(L::zero()).any() {
        return;
    }
    let pushed = w.contacts.work_of_pushing_out(structure, &mut w.whitened);
    let pushed = pushed + w.limits.work_of_pushing_out(structure, &w.whitened);
    // The whole robot is not to be pushed out faster than a part of it.
    let most = w.composite[0].mass * L::splat(0.5 * max_depenetration_speed * max_depenetration_speed);
    let allowed = pushed.min(most);
    let gains = gain.gt(allowed);
    if !gains.any() {
        return;
    }
    // Roots of ½ d² s² + (x · d) s = allowed.
    let root = along.mul_add(along, L::splat(2.0) * squared * allowed).sqrt();
    let share = ((root - along) / squared.max(L::splat(1e-20))).clamp(L::zero(), L::one());
    let share = gains.select(share, L::one());
    for (after, &before) in w.whitened.iter_mut().zip(&w.unconstrained) {
        *after = gains.select(share.mul_add(*after - before, before), *after);
    }
    w.contacts.scale(share);
}

#[inline(never)]
fn integrate<L: Lane>(engine: &Engine<L>, block: &mut Block<L>, r_wb: Mat3<L>, w: &Workspace<L>) {
    let dt = L::splat(engine.config.time_step);
    let Block { state, output, impulses, touched, .. } = block;
    let v = &w.velocity;
    let angular = Vec3::new(v[0], v[1], v[2]);
    let linear_w = r_wb * Vec3::new(v[3], v[4], v[5]);
    state.base_position = linear_w.scale_add(dt, state.base_position);
    state.base_orientation = state.base_orientation.integrate(angular, dt);
    state.base_angular_velocity = angular;
    // The solved velocity is along the old axes; the state keeps it along the new ones.
    state.base_linear_velocity = state.base_orientation.to_matrix().transpose_mul(linear_w);
    for (j, torque) in w.torque.iter().enumerate() {
        let rate = v[BASE_DOFS + j];
        state.joint_velocity[j] = rate;
        state.joint_position[j] = dt.mul_add(rate, state.joint_position[j]);
        output.joint_torque[j] = torque.damping.neg_mul_add(rate, torque.constant);
    }
    w.contacts.finish(r_wb, engine.config.time_step, impulses, touched, &mut output.contact_force);
}
