//! The joint-space mass matrix, its sparse factor, and what the factor is used for.
//!
//! Composite-rigid-body algorithm and the factorization M = LᵀL along chains (Featherstone 2008, sections 6.2 and 6.5, tables 6.2 and
//! 6.3). With x = L v as coordinates of velocity the mass matrix becomes the identity: an impulse p moves x by L⁻ᵀ p, so a contact needs
//! one whitened Jacobian J L⁻¹ for both its velocity and its effect.

use robot::JointKind;
use spatial::{Inertia, Lane, Vec3};

use crate::{
    kinematics::{LinkKinematics, Spatial},
    structure::{BASE_DOFS, Structure},
};

/// Composite-rigid-body algorithm: fills the packed lower triangle `mass` (rows along chains) and uses
/// `composite` (one a link) as scratch. The diagonal of joints gets `diagonal` (armature and implicit damping) added.
#[inline(never)]
pub(crate) fn composite_rigid_body<L: Lane>(
    structure: &Structure<L::Scalar>,
    links: &[LinkKinematics<L>],
    diagonal: &[L],
    composite: &mut [Inertia<L>],
    mass: &mut [L],
) {
    for (composite, link) in composite.iter_mut().zip(links) {
        *composite = link.inertia;
    }
    for (j, joint) in structure.joints.iter().enumerate().rev() {
        let (link, whole) = (&links[j + 1], composite[j + 1]);
        composite[joint.parent_link] = composite[joint.parent_link] + whole.shifted(link.offset);
        let (angular, linear) = match joint.kind {
            JointKind::Revolute => whole.momentum_turning(link.axis),
            JointKind::Prismatic => whole.momentum_sliding(link.axis),
        };
        let mut momentum = Spatial { angular, linear };
        let dof = BASE_DOFS + j;
        let chain = structure.chain(dof);
        let row = &mut mass[structure.row_start(dof)..][..chain.len()];
        for (entry, &ancestor) in row.iter_mut().zip(chain).skip(BASE_DOFS).rev() {
            let link = &links[ancestor - BASE_DOFS + 1];
            *entry = momentum.along(structure.joints[ancestor - BASE_DOFS].kind, link.axis);
            momentum = momentum.force_from(link.offset);
        }
        row[..BASE_DOFS].copy_from_slice(&momentum.to_array());
        row[chain.len() - 1] += diagonal[j];
    }
    base_block(&composite[0], mass);
}

/// The 6 × 6 block of the base: [I, h×; −h×, m 1], packed by rows.
#[inline(always)]
fn base_block<L: Lane>(total: &Inertia<L>, mass: &mut [L]) {
    let [xx, yy, zz, xy, xz, yz] = total.rotational;
    let h = total.moment;
    let (zero, m) = (L::zero(), total.mass);
    let block = [
        xx, xy, yy, xz, yz, zz, // angular
        zero, h.z, -h.y, m, // linear x: (−h×) row 0 = (0, h_z, −h_y)
        -h.z, zero, h.x, zero, m, // linear y
        h.y, -h.x, zero, zero, zero, m, // linear z
    ];
    mass[..block.len()].copy_from_slice(&block);
}

/// Replaces the packed mass matrix by its factor L, and fills `inverse_diagonal` with 1 / L_kk.
#[inline(never)]
pub(crate) fn factorize<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &mut [L],
    inverse_diagonal: &mut [L],
) {
    for dof in (0..structure.num_dofs()).rev() {
        let chain = structure.chain(dof);
        let (ancestors, row) = factor.split_at_mut(structure.row_start(dof));
        let (row, last) = row[..chain.len()].split_at_mut(chain.len() - 1);
        let root = last[0].sqrt();
        let inverse = L::one() / root;
        last[0] = root;
        inverse_diagonal[dof] = inverse;
        for entry in row.iter_mut() {
            *entry *= inverse;
        }
        for (position, &ancestor) in chain[..chain.len() - 1].iter().enumerate() {
            let pivot = row[position];
            let target = &mut ancestors[structure.row_start(ancestor)..][..=position];
            for (target, &entry) in target.iter_mut().zip(row.iter()) {
                *target = pivot.neg_mul_add(entry, *target);
            }
        }
    }
}

/// `x = L v`.
#[inline(never)]
pub(crate) fn whiten_velocity<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &[L],
    velocity: &[L],
    whitened: &mut [L],
) {
    for dof in 0..structure.num_dofs() {
        let chain = structure.chain(dof);
        let row = &factor[structure.row_start(dof)..][..chain.len()];
        let mut sum = L::zero();
        for (&entry, &ancestor) in row.iter().zip(chain) {
            sum = entry.mul_add(velocity[ancestor], sum);
        }
        whitened[dof] = sum;
    }
}

/// Replaces a generalized force `p` by `L⁻ᵀ p`.
#[inline(never)]
pub(crate) fn whiten_force<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &[L],
    inverse_diagonal: &[L],
    force: &mut [L],
) {
    for dof in (0..structure.num_dofs()).rev() {
        let chain = structure.chain(dof);
        let row = &factor[structure.row_start(dof)..][..chain.len() - 1];
        let scaled = force[dof] * inverse_diagonal[dof];
        force[dof] = scaled;
        for (&entry, &ancestor) in row.iter().zip(chain) {
            force[ancestor] = entry.neg_mul_add(scaled, force[ancestor]);
        }
    }
}

/// `v = L⁻¹ x`.
#[inline(never)]
pub(crate) fn unwhiten_velocity<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &[L],
    inverse_diagonal: &[L],
    whitened: &[L],
    velocity: &mut [L],
) {
    for dof in 0..structure.num_dofs() {
        let chain = structure.chain(dof);
        let row = &factor[structure.row_start(dof)..][..chain.len() - 1];
        let mut sum = whitened[dof];
        for (&entry, &ancestor) in row.iter().zip(chain) {
            sum = entry.neg_mul_add(velocity[ancestor], sum);
        }
        velocity[dof] = sum * inverse_diagonal[dof];
    }
}

/// Replaces the columns of a Jacobian (one vector a degree of freedom: the base's, and those of the joints of a limb) by
/// those of `J L⁻¹`.
#[inline(always)]
pub(crate) fn whiten_jacobian<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &[L],
    inverse_diagonal: &[L],
    limb: &[usize],
    base: &mut [Vec3<L>; BASE_DOFS],
    joints: &mut [Vec3<L>],
) {
    for place in (0..limb.len()).rev() {
        let dof = BASE_DOFS + limb[place];
        let row = &factor[structure.row_start(dof)..][..BASE_DOFS + limb.len()];
        let scaled = joints[place].scale(inverse_diagonal[dof]);
        joints[place] = scaled;
        for k in 0..BASE_DOFS {
            base[k] = scaled.scale_add(-row[k], base[k]);
        }
        for k in 0..limb.len() {
            if k < place {
                joints[k] = scaled.scale_add(-row[BASE_DOFS + k], joints[k]);
            }
        }
    }
    let factor = &factor[..BASE_DOFS * (BASE_DOFS + 1) / 2];
    // Every bound a constant: all columns stay in registers.
    for dof in (0..BASE_DOFS).rev() {
        base[dof] = base[dof].scale(inverse_diagonal[dof]);
        for k in 0..BASE_DOFS {
            if k < dof {
                base[k] = base[dof].scale_add(-factor[dof * (dof + 1) / 2 + k], base[k]);
            }
        }
    }
}
