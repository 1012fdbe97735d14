//! Hard contacts with friction: block projected Gauss–Seidel in whitened coordinates.
//!
//! Each contact is a 3-vector impulse λ (two tangents and the normal) inside the cone |λ_t| ≤ µ λ_n. One visit solves the contact's 3 × 3
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

/// A piece of ground that spheres of a limb, in each lane another one, may touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<L> {
    /// World frame; far where it does not enter the solver.
    pub(crate) near: Proximity<L>,
    /// Where the ground touches, base frame \[m\].
    pub(crate) point: Vec3<L>,
    /// Place among all possible contacts: the first faces of all spheres, then the second, then the third.
    pub(crate) slot: L,
    /// Degrees of freedom that move the sphere: the first of the limb's chain.
    pub(crate) depth: L,
}

impl<L: Lane> Candidate<L> {
    #[inline(always)]
    fn select(mask: L::Mask, if_true: &Self, if_false: &Self) -> Self {
        Self {
            near: Proximity::select(mask, if_true.near, if_false.near),
            point: Vec3::select(mask, if_true.point, if_false.point),
            slot: mask.select(if_true.slot, if_false.slot),
            depth: mask.select(if_true.depth, if_false.depth),
        }
    }
}

/// One contact that entered the solver.
#[derive(Clone, Debug)]
pub(crate) struct Contact<L> {
    limb: usize,
    slot: L,
    /// Two tangents and the normal, base frame: x, y and z of everything below.
    axes: [Vec3<L>; 3],
    /// Whitened Jacobian, one column a degree of freedom of the limb's chain.
    columns: Vec<Vec3<L>>,
    /// Speed the contact may at most approach with, negative: must leave with \[m/s\].
    allowed_approach: L,
    /// Inverse of the 3 × 3 block, `[xx, yy, zz, xy, xz, yz]`.
    inverse_block: [L; 6],
    /// What a unit of normal impulse adds to the slip.
    slip_of_normal: [L; 2],
    inverse_normal: L,
    /// Step along the slip that cannot overshoot: the inverse of the trace of the tangential block.
    tangential_step: L,
    impulse: Vec3<L>,
}

impl<L: Lane> Contact<L> {
    fn new(max_chain: usize) -> Self {
        Self {
            limb: 0,
            slot: L::zero(),
            columns: vec![Vec3::zero(); max_chain],
            axes: [Vec3::zero(); 3],
            allowed_approach: L::zero(),
            inverse_block: [L::zero(); 6],
            slip_of_normal: [L::zero(); 2],
            inverse_normal: L::zero(),
            tangential_step: L::zero(),
            impulse: Vec3::zero(),
        }
    }
}

/// All contacts of a step.
#[derive(Clone, Debug)]
pub(crate) struct ContactSet<L> {
    contacts: Vec<Contact<L>>,
    active: usize,
    /// Slots of the candidates.
    slots: Vec<usize>,
    /// Candidates of the limb at hand, in each lane the nearest first.
    sorted: Vec<Candidate<L>>,
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
        let slots = ground::FACES * spheres;
        Self {
            contacts: (0..slots).map(|_| Contact::new(max_chain)).collect(),
            active: 0,
            slots: Vec::with_capacity(slots),
            sorted: Vec::with_capacity(slots),
        }
    }

    /// Starts a new step.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.active = 0;
        self.slots.clear();
        self.sorted.clear();
    }

    /// Takes a piece of ground in among the limb's: behind those that are nearer, in each lane by itself. The limb gets
    /// as many contacts as one of the lanes has, not as all of them together. `slot` is the candidate's, the same in all lanes.
    #[inline(always)]
    pub(crate) fn consider(&mut self, slot: usize, candidate: Candidate<L>) {
        let near = |candidate: &Candidate<L>| candidate.near.gap.lt(ground::far()).any();
        if !near(&candidate) {
            return;
        }
        self.slots.push(slot);
        let mut candidate = candidate;
        for kept in &mut self.sorted {
            let nearer = candidate.near.gap.lt(kept.near.gap);
            let behind = Candidate::select(nearer, kept, &candidate);
            *kept = Candidate::select(nearer, &candidate, kept);
            candidate = behind;
        }
        if near(&candidate) {
            self.sorted.push(candidate);
        }
    }

    /// Makes contacts of the limb's candidates, which begin with the impulses of the last step (world frame \[N s\], one a slot).
    #[inline(always)]
    pub(crate) fn add_limb(&mut self, frame: &ContactFrame<L>, limb: usize, last_impulse: &[Vec3<L>]) {
        let chain = &frame.structure.limbs[limb].chain;
        for candidate in &self.sorted {
            let contact = &mut self.contacts[self.active];
            self.active += 1;
            contact.limb = limb;
            contact.slot = candidate.slot;
            contact.axes = axes(frame.r_wb.transpose_mul(candidate.near.normal));
            contact.allowed_approach = allowed_approach(frame.config, candidate.near.gap);
            let mut kept = Vec3::zero();
            for lane in 0..L::WIDTH {
                kept.set(lane, last_impulse[candidate.slot.index(lane)].get(lane));
            }
            // A lane where it is far must not notice that another brought the contact in.
            let within = candidate.near.gap.lt(ground::far());
            let kept = frame.r_wb.transpose_mul(kept).scale(within.select(L::one(), L::zero()));
            // The normal may have turned since: never a pull.
            let [x, y, z] = contact.axes.map(|axis| axis.dot(kept));
            contact.impulse = Vec3::new(x, y, z.max(L::zero()));
            fill_columns(frame, chain, candidate, &contact.axes, &mut contact.columns);
            let columns = &mut contact.columns[..chain.len()];
            whiten_jacobian(frame.structure, frame.factor, frame.inverse_diagonal, chain, columns);
            prepare_block(contact, chain.len());
        }
        self.sorted.clear();
    }

    /// Applies the warm-start impulses to the whitened velocity.
    #[inline(always)]
    pub(crate) fn warm_start(&self, structure: &Structure<L::Scalar>, whitened: &mut [L]) {
        for contact in &self.contacts[..self.active] {
            apply(contact, &structure.limbs[contact.limb].chain, contact.impulse, whitened);
        }
    }

    /// One Gauss–Seidel sweep.
    #[inline(always)]
    pub(crate) fn sweep(&mut self, structure: &Structure<L::Scalar>, friction: L, whitened: &mut [L]) {
        for contact in &mut self.contacts[..self.active] {
            let chain = &structure.limbs[contact.limb].chain;
            if let Some(change) = visit(contact, chain, friction, whitened) {
                apply(contact, chain, change, whitened);
            }
        }
    }

    /// Work that getting out of overlaps takes at most \[J\].
    #[inline(always)]
    pub(crate) fn work_of_pushing_out(&self) -> L {
        let work = |contact: &Contact<L>| contact.impulse.z * contact.allowed_approach.min(L::zero());
        self.contacts[..self.active].iter().fold(L::zero(), |sum, contact| sum - work(contact))
    }

    /// Multiplies all impulses.
    #[inline(always)]
    pub(crate) fn scale(&mut self, share: L) {
        for contact in &mut self.contacts[..self.active] {
            contact.impulse = contact.impulse.scale(share);
        }
    }

    /// Writes the impulses, for the next step, and forces per sphere (world frame, \[N s\] and \[N\]); `touched` are the slots
    /// that differ from zero.
    #[inline(always)]
    pub(crate) fn finish(
        &self,
        r_wb: spatial::Mat3<L>,
        time_step: f64,
        impulses: &mut [Vec3<L>],
        touched: &mut Vec<usize>,
        force: &mut [Vec3<L>],
    ) {
        let spheres = force.len();
        for slot in touched.drain(..) {
            impulses[slot] = Vec3::zero();
            force[slot % spheres] = Vec3::zero();
        }
        for contact in &self.contacts[..self.active] {
            let [x, y, normal] = contact.axes;
            let Vec3 { x: a, y: b, z: c } = contact.impulse;
            let impulse = r_wb * x.scale_add(a, y.scale_add(b, normal.scale(c)));
            for lane in 0..L::WIDTH {
                impulses[contact.slot.index(lane)].set(lane, impulse.get(lane));
            }
        }
        let per_time = L::splat(1.0 / time_step);
        touched.extend_from_slice(&self.slots);
        for &slot in &*touched {
            let sphere = slot % spheres;
            force[sphere] = impulses[slot].scale_add(per_time, force[sphere]);
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

/// Two tangents and the unit normal, right-handed (Duff et al. 2017, *Building an orthonormal basis, revisited*).
#[inline(always)]
fn axes<L: Lane>(n: Vec3<L>) -> [Vec3<L>; 3] {
    let sign = n.z.ge(L::zero()).select(L::one(), -L::one());
    let a = -(L::one() / (sign + n.z));
    let b = n.x * n.y * a;
    let x = Vec3::new((sign * n.x * n.x).mul_add(a, L::one()), sign * b, -(sign * n.x));
    let y = Vec3::new(b, (n.y * n.y).mul_add(a, sign), -n.y);
    [x, y, n]
}

/// Velocity of the candidate's point along the contact's axes, per unit velocity of each degree of freedom of the chain.
#[inline(always)]
fn fill_columns<L: Lane>(
    frame: &ContactFrame<L>,
    chain: &[usize],
    candidate: &Candidate<L>,
    axes: &[Vec3<L>; 3],
    columns: &mut [Vec3<L>],
) {
    let point = candidate.point;
    // Along an axis a, turning about e_k moves the point by (e_k × p) · a = e_k · (p × a).
    let [x, y, z] = axes.map(|axis| point.cross(axis).to_array());
    let [ax, ay, az] = axes.map(Vec3::to_array);
    for k in 0..3 {
        columns[k] = Vec3::new(x[k], y[k], z[k]);
        columns[3 + k] = Vec3::new(ax[k], ay[k], az[k]);
    }
    for (place, (column, &dof)) in columns.iter_mut().zip(chain).enumerate().skip(BASE_DOFS) {
        let link = &frame.links[dof - BASE_DOFS + 1];
        let moves = L::splat(place as f64).lt(candidate.depth).select(L::one(), L::zero());
        let motion = match frame.structure.joints[dof - BASE_DOFS].kind {
            JointKind::Revolute => link.axis.cross(point - link.p_bl),
            JointKind::Prismatic => link.axis,
        }
        .scale(moves);
        let [x, y, z] = axes.map(|axis| axis.dot(motion));
        *column = Vec3::new(x, y, z);
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
    contact.slip_of_normal = [w[4], w[5]];
    contact.inverse_normal = L::one() / w[2];
    contact.tangential_step = L::one() / (w[0] + w[1]);
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

/// Solves one contact given all others; returns the change of its impulse, if there is one in any lane.
#[inline(always)]
fn visit<L: Lane>(contact: &mut Contact<L>, chain: &[usize], friction: L, whitened: &[L]) -> Option<Vec3<L>> {
    let mut velocity = Vec3::zero();
    for (&column, &dof) in contact.columns.iter().zip(chain) {
        velocity = column.scale_add(whitened[dof], velocity);
    }
    let old = contact.impulse;
    // Rest: no velocity but the allowed approach along the normal.
    let approach = velocity.z + contact.allowed_approach;
    // What neither approaches nor pushes stays as it is, even where friction alone could press it on: of two solutions the
    // one without contact.
    let acts = approach.lt(L::zero()).or(old.dot(old).gt(L::zero()));
    if !acts.any() {
        return None;
    }
    let residual = Vec3::new(velocity.x, velocity.y, approach);
    let sticking = old - symmetric_mul(&contact.inverse_block, residual);
    let length_squared = sticking.x.mul_add(sticking.x, sticking.y * sticking.y);
    let limit = friction * sticking.z.max(L::zero());
    let sticks = length_squared.le(limit * limit).and(sticking.z.ge(L::zero())).and(acts);

    // Otherwise first the normal alone, then a step against the slip that is left, back onto the disk µ λ_n: at the
    // solution friction opposes the slip (maximum dissipation), and it never drives it on the way there.
    let normal = contact.inverse_normal.neg_mul_add(approach, old.z).max(L::zero());
    let change = normal - old.z;
    let [slip_x, slip_y] = contact.slip_of_normal;
    let trial_x = contact.tangential_step.neg_mul_add(slip_x.mul_add(change, velocity.x), old.x);
    let trial_y = contact.tangential_step.neg_mul_add(slip_y.mul_add(change, velocity.y), old.y);
    let length = trial_x.mul_add(trial_x, trial_y * trial_y).max(L::splat(1e-20)).sqrt();
    let within = (friction * normal / length).min(L::one());

    let new = Vec3::select(sticks, sticking, Vec3::new(trial_x * within, trial_y * within, normal));
    contact.impulse = new;
    Some(new - old)
}

#[inline(always)]
fn apply<L: Lane>(contact: &Contact<L>, chain: &[usize], impulse: Vec3<L>, whitened: &mut [L]) {
    for (&column, &dof) in contact.columns.iter().zip(chain) {
        whitened[dof] += column.dot(impulse);
    }
}
