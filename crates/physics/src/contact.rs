//! Hard contacts with friction: block projected Gauss–Seidel in whitened coordinates.
//!
//! Each contact is a 3-vector impulse λ (base frame) inside the cone |λ_t| ≤ µ λ_n. One visit solves the contact's 3 × 3
//! block for rest, and where that leaves the cone lets it slide: tangential part onto the disk, normal part solved anew.
//! The number of sweeps is fixed, so a lane never waits for another. Zero restitution; penetration is corrected by a
//! capped share each step, and a gap not yet closed only limits the approach (speculative contact).

use robot::JointKind;
use spatial::{Lane, Mask, Vec3};

use crate::{
    engine::Config,
    ground::{self, Proximity},
    mass_matrix::whiten_jacobian,
    structure::{BASE_DOFS, Structure},
};

/// One contact that entered the solver.
#[derive(Clone, Debug)]
pub(crate) struct Contact<L> {
    /// Place among all possible contacts: the first faces of all spheres, then the second, then the third.
    slot: usize,
    link: usize,
    /// Whitened Jacobian, one column a degree of freedom of the link's chain; base frame.
    columns: Vec<Vec3<L>>,
    normal: Vec3<L>,
    /// Speed the contact may at most approach with, negative: must leave with \[m/s\].
    allowed_approach: L,
    /// Inverse of the 3 × 3 block, `[xx, yy, zz, xy, xz, yz]`.
    inverse_block: [L; 6],
    /// The block times the normal, and the inverse of its normal component.
    block_normal: Vec3<L>,
    inverse_normal: L,
    /// Step along the slip that cannot overshoot: the inverse of the trace of the tangential block.
    tangential_step: L,
    impulse: Vec3<L>,
}

impl<L: Lane> Contact<L> {
    fn new(max_chain: usize) -> Self {
        Self {
            slot: 0,
            link: 0,
            columns: vec![Vec3::zero(); max_chain],
            normal: Vec3::zero(),
            allowed_approach: L::zero(),
            inverse_block: [L::zero(); 6],
            block_normal: Vec3::zero(),
            inverse_normal: L::zero(),
            tangential_step: L::zero(),
            impulse: Vec3::zero(),
        }
    }
}

/// All contacts of a step, and the impulses of the last for warm starting.
#[derive(Clone, Debug)]
pub(crate) struct ContactSet<L> {
    contacts: Vec<Contact<L>>,
    active: usize,
    /// Impulses of the last step in the world frame \[N s\], one a slot.
    pub(crate) last_impulse: Vec<Vec3<L>>,
}

/// What is needed to turn a nearby piece of ground into a solver row.
pub(crate) struct ContactFrame<'a, L: Lane> {
    pub(crate) structure: &'a Structure<L::Scalar>,
    pub(crate) config: &'a Config,
    pub(crate) factor: &'a [L],
    pub(crate) inverse_diagonal: &'a [L],
    pub(crate) links: &'a [crate::kinematics::LinkKinematics<L>],
    pub(crate) r_wb: spatial::Mat3<L>,
}

impl<L: Lane> ContactSet<L> {
    pub(crate) fn new(spheres: usize, max_chain: usize) -> Self {
        Self {
            contacts: (0..ground::FACES * spheres).map(|_| Contact::new(max_chain)).collect(),
            active: 0,
            last_impulse: vec![Vec3::zero(); ground::FACES * spheres],
        }
    }

    pub(crate) fn forget(&mut self, lane: usize) {
        for impulse in &mut self.last_impulse {
            impulse.set(lane, [0.0; 3]);
        }
    }

    /// Starts a new step.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.active = 0;
    }

    /// Adds a contact of the sphere of `slot` on `link` if any lane is within the margin.
    #[inline(always)]
    pub(crate) fn add(
        &mut self,
        frame: &ContactFrame<L>,
        slot: usize,
        link: usize,
        center_b: Vec3<L>,
        radius: L,
        near: Proximity<L>,
    ) {
        let margin = L::splat(frame.config.contact_margin);
        let within = near.gap.lt(margin);
        if !within.any() {
            return;
        }
        let contact = &mut self.contacts[self.active];
        self.active += 1;
        contact.slot = slot;
        contact.link = link;
        contact.normal = frame.r_wb.transpose_mul(near.normal);
        // A lane outside the margin must not notice that a neighbor brought the contact in.
        let gap = within.select(near.gap, ground::far());
        contact.allowed_approach = allowed_approach(frame.config, gap);
        let kept = frame.r_wb.transpose_mul(self.last_impulse[slot]);
        contact.impulse = into_push(kept, contact.normal).scale(within.select(L::one(), L::zero()));
        let point = center_b - contact.normal.scale(radius);
        fill_columns(frame, link, point, &mut contact.columns);
        let chain = frame.structure.chain_of_link(link);
        whiten_jacobian(
            frame.structure,
            frame.factor,
            frame.inverse_diagonal,
            chain,
            &mut contact.columns[..chain.len()],
        );
        prepare_block(contact, chain.len());
    }

    /// Applies the warm-start impulses to the whitened velocity.
    #[inline(always)]
    pub(crate) fn warm_start(&self, structure: &Structure<L::Scalar>, whitened: &mut [L]) {
        for contact in &self.contacts[..self.active] {
            apply(contact, structure.chain_of_link(contact.link), contact.impulse, whitened);
        }
    }

    /// One Gauss–Seidel sweep.
    #[inline(always)]
    pub(crate) fn sweep(&mut self, structure: &Structure<L::Scalar>, friction: L, whitened: &mut [L]) {
        for contact in &mut self.contacts[..self.active] {
            let chain = structure.chain_of_link(contact.link);
            let change = visit(contact, chain, friction, whitened);
            apply(contact, chain, change, whitened);
        }
    }

    /// Keeps the impulses for the next step and writes forces per sphere (world frame, \[N\]).
    #[inline(always)]
    pub(crate) fn finish(&mut self, r_wb: spatial::Mat3<L>, time_step: f64, force: &mut [Vec3<L>]) {
        force.fill(Vec3::zero());
        self.last_impulse.fill(Vec3::zero());
        let per_time = L::splat(1.0 / time_step);
        for contact in &self.contacts[..self.active] {
            let impulse = r_wb * contact.impulse;
            self.last_impulse[contact.slot] = impulse;
            let sphere = contact.slot % force.len();
            force[sphere] = impulse.scale_add(per_time, force[sphere]);
        }
    }
}

/// A gap may close within the step; an overlap must open by a capped share.
#[inline(always)]
fn allowed_approach<L: Lane>(config: &Config, gap: L) -> L {
    let per_step = L::splat(1.0 / config.time_step);
    let correction = (gap * L::splat(config.error_reduction / config.time_step))
        .max(L::splat(-config.max_depenetration_speed));
    gap.gt(L::zero()).select(gap * per_step, correction)
}

/// An impulse of the last step, for a normal that has turned since: never a pull.
#[inline(always)]
fn into_push<L: Lane>(impulse: Vec3<L>, normal: Vec3<L>) -> Vec3<L> {
    let pull = impulse.dot(normal).min(L::zero());
    normal.scale_add(-pull, impulse)
}

/// Velocity of a point of a link per unit velocity of each degree of freedom of its chain; base frame.
#[inline(always)]
fn fill_columns<L: Lane>(frame: &ContactFrame<L>, link: usize, point: Vec3<L>, columns: &mut [Vec3<L>]) {
    let (zero, one) = (L::zero(), L::one());
    // e_k × p for the angular, e_k for the linear velocity of the base.
    columns[0] = Vec3::new(zero, -point.z, point.y);
    columns[1] = Vec3::new(point.z, zero, -point.x);
    columns[2] = Vec3::new(-point.y, point.x, zero);
    columns[3] = Vec3::new(one, zero, zero);
    columns[4] = Vec3::new(zero, one, zero);
    columns[5] = Vec3::new(zero, zero, one);
    let chain = frame.structure.chain_of_link(link);
    for (column, &dof) in columns.iter_mut().zip(chain).skip(BASE_DOFS) {
        let link = &frame.links[dof - BASE_DOFS + 1];
        *column = match frame.structure.joints[dof - BASE_DOFS].kind {
            JointKind::Revolute => link.axis.cross(point - link.p_bl),
            JointKind::Prismatic => link.axis,
        };
    }
}

#[inline(always)]
fn prepare_block<L: Lane>(contact: &mut Contact<L>, chain_len: usize) {
    let mut w = [L::zero(); 6];
    for c in &contact.columns[..chain_len] {
        w[0] = c.x.mul_add(c.x, w[0]);
        w[1] = c.y.mul_add(c.y, w[1]);
        w[2] = c.z.mul_add(c.z, w[2]);
        w[3] = c.x.mul_add(c.y, w[3]);
        w[4] = c.x.mul_add(c.z, w[4]);
        w[5] = c.y.mul_add(c.z, w[5]);
    }
    let n = contact.normal;
    contact.block_normal = symmetric_mul(&w, n);
    let normal_block = contact.block_normal.dot(n);
    contact.inverse_normal = L::one() / normal_block;
    contact.tangential_step = L::one() / (w[0] + w[1] + w[2] - normal_block);
    contact.inverse_block = symmetric_inverse(&w);
}

#[inline(always)]
fn symmetric_mul<L: Lane>(w: &[L; 6], v: Vec3<L>) -> Vec3<L> {
    let [xx, yy, zz, xy, xz, yz] = *w;
    Vec3::new(
        xx.mul_add(v.x, xy.mul_add(v.y, xz * v.z)),
        xy.mul_add(v.x, yy.mul_add(v.y, yz * v.z)),
        xz.mul_add(v.x, yz.mul_add(v.y, zz * v.z)),
    )
}

#[inline(always)]
fn symmetric_inverse<L: Lane>(w: &[L; 6]) -> [L; 6] {
    let [xx, yy, zz, xy, xz, yz] = *w;
    let (cxx, cxy, cxz) = (yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy);
    let inverse = L::one() / (xx * cxx + xy * cxy + xz * cxz);
    [
        cxx * inverse,
        (xx * zz - xz * xz) * inverse,
        (xx * yy - xy * xy) * inverse,
        cxy * inverse,
        cxz * inverse,
        (xy * xz - xx * yz) * inverse,
    ]
}

/// Solves one contact given all others; returns the change of its impulse.
#[inline(always)]
fn visit<L: Lane>(contact: &mut Contact<L>, chain: &[usize], friction: L, whitened: &[L]) -> Vec3<L> {
    let mut velocity = Vec3::zero();
    for (&column, &dof) in contact.columns.iter().zip(chain) {
        velocity = column.scale_add(whitened[dof], velocity);
    }
    let n = contact.normal;
    let old = contact.impulse;
    // Rest: no velocity but the allowed approach along the normal.
    let residual = n.scale_add(contact.allowed_approach, velocity);
    let sticking = old - symmetric_mul(&contact.inverse_block, residual);
    let sticking_normal = sticking.dot(n);
    let tangential = n.scale_add(-sticking_normal, sticking);
    let length_squared = tangential.dot(tangential);
    let limit = friction * sticking_normal.max(L::zero());
    let sticks = length_squared.le(limit * limit).and(sticking_normal.ge(L::zero()));

    // Otherwise first the normal alone, then a step against the slip that is left, back onto the disk µ λ_n: at the
    // solution friction opposes the slip (maximum dissipation), and it never drives it on the way there.
    let old_normal = old.dot(n);
    let normal = contact.inverse_normal.neg_mul_add(residual.dot(n), old_normal).max(L::zero());
    let velocity = contact.block_normal.scale_add(normal - old_normal, velocity);
    let slip = n.scale_add(-velocity.dot(n), velocity);
    let trial = slip.scale_add(-contact.tangential_step, n.scale_add(-old_normal, old));
    let inverse_length = L::one() / trial.dot(trial).max(L::splat(1e-20)).sqrt();
    let within = (friction * normal * inverse_length).min(L::one());
    let sliding = n.scale_add(normal, trial.scale(within));

    let new = Vec3::new(
        sticks.select(sticking.x, sliding.x),
        sticks.select(sticking.y, sliding.y),
        sticks.select(sticking.z, sliding.z),
    );
    contact.impulse = new;
    new - old
}

#[inline(always)]
fn apply<L: Lane>(contact: &Contact<L>, chain: &[usize], impulse: Vec3<L>, whitened: &mut [L]) {
    for (&column, &dof) in contact.columns.iter().zip(chain) {
        whitened[dof] += column.dot(impulse);
    }
}
