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

/// Entries of the base's packed block.
const BASE_ENTRIES: usize = BASE_DOFS * (BASE_DOFS + 1) / 2;

/// Where the row of a degree of freedom of the base starts among them.
#[inline(always)]
const fn start(dof: usize) -> usize {
    dof * (dof + 1) / 2
}

/// A row of the factor: what is the base's, what is the joints', and the diagonal's entry, which is the last.
#[inline(always)]
fn row_of<'a, L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &'a [L],
    dof: usize,
) -> (&'a [L; BASE_DOFS], &'a [L]) {
    let row = &factor[structure.row_start(dof)..][..structure.chain(dof).len()];
    row.split_first_chunk().expect("joints hang on the base")
}

/// The base's block of the factor.
#[inline(always)]
fn base_of<L: Lane>(factor: &[L]) -> &[L; BASE_ENTRIES] {
    factor.first_chunk().expect("a base has six degrees of freedom")
}

/// Replaces the packed mass matrix by its factor L, and fills `inverse_diagonal` with 1 / L_kk.
///
/// The base's block, which every joint changes, stays in registers; so does the base's part of vectors in what follows.
#[inline(never)]
pub(crate) fn factorize<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &mut [L],
    inverse_diagonal: &mut [L],
) {
    let mut base = *base_of(factor);
    for dof in (BASE_DOFS..structure.num_dofs()).rev() {
        let chain = structure.chain(dof);
        let (ancestors, row) = factor.split_at_mut(structure.row_start(dof));
        let (of_base, rest) = row.split_first_chunk_mut::<BASE_DOFS>().expect("joints hang on the base");
        let (of_joints, last) = rest[..chain.len() - BASE_DOFS].split_at_mut(chain.len() - BASE_DOFS - 1);
        let inverse = last[0].inverse_sqrt();
        last[0] *= inverse;
        inverse_diagonal[dof] = inverse;
        let mut scaled = *of_base;
        for k in 0..BASE_DOFS {
            scaled[k] *= inverse;
        }
        *of_base = scaled;
        for entry in of_joints.iter_mut() {
            *entry *= inverse;
        }
        for (place, &pivot) in of_joints.iter().enumerate() {
            let target = &mut ancestors[structure.row_start(chain[BASE_DOFS + place])..];
            let (to_base, to_joints) =
                target.split_first_chunk_mut::<BASE_DOFS>().expect("joints hang on the base");
            for k in 0..BASE_DOFS {
                to_base[k] = pivot.neg_mul_add(scaled[k], to_base[k]);
            }
            for (to, &entry) in to_joints.iter_mut().zip(&of_joints[..=place]) {
                *to = pivot.neg_mul_add(entry, *to);
            }
        }
        subtract_square(&mut base, &scaled);
    }
    factorize_base(&mut base, inverse_diagonal);
    factor[..BASE_ENTRIES].copy_from_slice(&base);
}

/// Subtracts r rᵀ from the base's block. Bounds are constants here and below, so that loops unroll and entries stay in registers.
#[inline(always)]
fn subtract_square<L: Lane>(base: &mut [L; BASE_ENTRIES], r: &[L; BASE_DOFS]) {
    for row in 0..BASE_DOFS {
        for column in 0..BASE_DOFS {
            if column <= row {
                let at = start(row) + column;
                base[at] = r[row].neg_mul_add(r[column], base[at]);
            }
        }
    }
}

/// The same of the base's block alone.
#[inline(always)]
fn factorize_base<L: Lane>(base: &mut [L; BASE_ENTRIES], inverse_diagonal: &mut [L]) {
    for dof in (0..BASE_DOFS).rev() {
        let inverse = base[start(dof) + dof].inverse_sqrt();
        inverse_diagonal[dof] = inverse;
        let mut scaled = [L::zero(); BASE_DOFS];
        for k in 0..BASE_DOFS {
            if k <= dof {
                base[start(dof) + k] *= inverse;
                scaled[k] = base[start(dof) + k];
            }
        }
        for row in 0..BASE_DOFS {
            for column in 0..BASE_DOFS {
                if column <= row && row < dof {
                    let at = start(row) + column;
                    base[at] = scaled[row].neg_mul_add(scaled[column], base[at]);
                }
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
    let base: [L; BASE_DOFS] = *velocity.first_chunk().expect("a base has six degrees of freedom");
    let mut sums = [L::zero(); BASE_DOFS];
    for row in 0..BASE_DOFS {
        for column in 0..BASE_DOFS {
            if column <= row {
                sums[row] = base_of(factor)[start(row) + column].mul_add(base[column], sums[row]);
            }
        }
    }
    whitened[..BASE_DOFS].copy_from_slice(&sums);
    for dof in BASE_DOFS..structure.num_dofs() {
        let (of_base, of_joints) = row_of(structure, factor, dof);
        let mut sum = L::zero();
        for k in 0..BASE_DOFS {
            sum = of_base[k].mul_add(base[k], sum);
        }
        for (&entry, &ancestor) in of_joints.iter().zip(&structure.chain(dof)[BASE_DOFS..]) {
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
    let mut base: [L; BASE_DOFS] = *force.first_chunk().expect("a base has six degrees of freedom");
    for dof in (BASE_DOFS..structure.num_dofs()).rev() {
        let (of_base, of_joints) = row_of(structure, factor, dof);
        let scaled = force[dof] * inverse_diagonal[dof];
        force[dof] = scaled;
        for k in 0..BASE_DOFS {
            base[k] = of_base[k].neg_mul_add(scaled, base[k]);
        }
        let ancestors = &structure.chain(dof)[BASE_DOFS..];
        for (&entry, &ancestor) in of_joints[..of_joints.len() - 1].iter().zip(ancestors) {
            force[ancestor] = entry.neg_mul_add(scaled, force[ancestor]);
        }
    }
    let factor = base_of(factor);
    for dof in (0..BASE_DOFS).rev() {
        base[dof] *= inverse_diagonal[dof];
        for k in 0..BASE_DOFS {
            if k < dof {
                base[k] = factor[start(dof) + k].neg_mul_add(base[dof], base[k]);
            }
        }
    }
    force[..BASE_DOFS].copy_from_slice(&base);
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
    let of_factor = base_of(factor);
    let mut base: [L; BASE_DOFS] = *whitened.first_chunk().expect("a base has six degrees of freedom");
    for dof in 0..BASE_DOFS {
        for k in 0..BASE_DOFS {
            if k < dof {
                base[dof] = of_factor[start(dof) + k].neg_mul_add(base[k], base[dof]);
            }
        }
        base[dof] *= inverse_diagonal[dof];
    }
    velocity[..BASE_DOFS].copy_from_slice(&base);
    for dof in BASE_DOFS..structure.num_dofs() {
        let (of_base, of_joints) = row_of(structure, factor, dof);
        let mut sum = whitened[dof];
        for k in 0..BASE_DOFS {
            sum = of_base[k].neg_mul_add(base[k], sum);
        }
        let ancestors = &structure.chain(dof)[BASE_DOFS..];
        for (&entry, &ancestor) in of_joints[..of_joints.len() - 1].iter().zip(ancestors) {
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
    let factor = base_of(factor);
    // Every bound a constant: all columns stay in registers.
    for dof in (0..BASE_DOFS).rev() {
        base[dof] = base[dof].scale(inverse_diagonal[dof]);
        for k in 0..BASE_DOFS {
            if k < dof {
                base[k] = base[dof].scale_add(-factor[start(dof) + k], base[k]);
            }
        }
    }
}
