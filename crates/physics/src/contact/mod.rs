//! Hard contacts with friction: block projected Gauss–Seidel in whitened coordinates.
//!
//! Each contact is a 3-vector impulse λ (two tangents and the normal) inside the cone |λ_t| ≤ µ λ_n. One visit solves the contact's 3 × 3
//! block for rest, and where that leaves the cone lets it slide: tangential part onto the disk, normal part solved anew.
//! The number of sweeps is fixed, so a lane never waits for another. Zero restitution; penetration is corrected by a
//! capped share each step, and a gap not yet closed only limits the approach (speculative contact).

mod constraint;
mod search;
mod visit;

use std::ops::Range;

use constraint::Contact;
pub(crate) use constraint::ContactFrame;
pub(crate) use search::{Found, Search};
use spatial::{Lane, Mask, Mat3, Vec3};

use crate::{
    ground,
    structure::{BASE_DOFS, Structure},
};

/// A piece of ground that spheres of a limb, in each lane another one, may touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate<L> {
    /// Distance between sphere and ground \[m\]; far where it does not enter the solver.
    pub(crate) gap: L,
    /// Direction in which the ground pushes, base frame.
    pub(crate) normal: Vec3<L>,
    /// Where the ground touches, base frame \[m\].
    pub(crate) point: Vec3<L>,
    /// Place among all possible contacts: the first faces of all spheres, then the second, then the third.
    pub(crate) slot: L,
    /// Degrees of freedom that move the sphere: the first of the limb's chain.
    pub(crate) depth: L,
    /// What the ground pushed with there in the last step, world frame \[N s\].
    pub(crate) last_impulse: Vec3<L>,
}

impl<L: Lane> Candidate<L> {
    #[inline(always)]
    fn select(mask: L::Mask, if_true: &Self, if_false: &Self) -> Self {
        Self {
            gap: mask.select(if_true.gap, if_false.gap),
            normal: Vec3::select(mask, if_true.normal, if_false.normal),
            point: Vec3::select(mask, if_true.point, if_false.point),
            slot: mask.select(if_true.slot, if_false.slot),
            depth: mask.select(if_true.depth, if_false.depth),
            last_impulse: Vec3::select(mask, if_true.last_impulse, if_false.last_impulse),
        }
    }
}

/// Does work with the velocities of a limb's joints side by side; a leg of three has them in registers.
macro_rules! with_joints {
    ($joints:expr, $velocity:ident, $room:expr, $own:ident => $work:block) => {
        match *$joints {
            [] => {
                let $own: &mut [L] = &mut [];
                $work
            }
            [hip, thigh, shank] => {
                let mut three = [$velocity[hip], $velocity[thigh], $velocity[shank]];
                {
                    let $own: &mut [L] = &mut three;
                    $work
                }
                [$velocity[hip], $velocity[thigh], $velocity[shank]] = three;
            }
            ref joints => {
                let $own: &mut [L] = &mut $room[..joints.len()];
                for (own, &joint) in $own.iter_mut().zip(joints) {
                    *own = $velocity[joint];
                }
                $work
                for (own, &joint) in $own.iter().zip(joints) {
                    $velocity[joint] = *own;
                }
            }
        }
    };
}

/// All contacts of a step.
#[derive(Clone, Debug)]
pub(crate) struct ContactSet<L> {
    contacts: Vec<Contact<L>>,
    active: usize,
    /// Limbs that have contacts, and which.
    runs: Vec<(usize, Range<usize>)>,
    /// Room for velocities of a limb's joints.
    joints: Vec<L>,
    /// Slots of the candidates.
    slots: Vec<usize>,
    /// Candidates of the limb at hand, in each lane the nearest first.
    sorted: Vec<Candidate<L>>,
}

impl<L: Lane> ContactSet<L> {
    pub(crate) fn new(structure: &Structure<L::Scalar>) -> Self {
        let slots = ground::FACES * structure.spheres.len();
        let joints = structure.max_chain() - BASE_DOFS;
        Self {
            contacts: vec![Contact::new(joints); slots],
            active: 0,
            runs: Vec::with_capacity(structure.limbs.len()),
            joints: vec![L::zero(); joints],
            slots: Vec::with_capacity(slots),
            sorted: Vec::with_capacity(slots),
        }
    }

    /// Starts a new step.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.active = 0;
        self.runs.clear();
        self.slots.clear();
        self.sorted.clear();
    }

    /// Takes a piece of ground in among the limb's: behind those that are nearer, in each lane by itself. The limb gets
    /// as many contacts as one of the lanes has, not as all of them together. `slot` is the candidate's, the same in all lanes.
    #[inline(always)]
    pub(crate) fn consider(&mut self, slot: usize, candidate: Candidate<L>) {
        let near = |candidate: &Candidate<L>| candidate.gap.lt(ground::far()).any();
        if !near(&candidate) {
            return;
        }
        self.slots.push(slot);
        let mut candidate = candidate;
        for kept in &mut self.sorted {
            let nearer = candidate.gap.lt(kept.gap);
            let behind = Candidate::select(nearer, kept, &candidate);
            *kept = Candidate::select(nearer, &candidate, kept);
            candidate = behind;
        }
        if near(&candidate) {
            self.sorted.push(candidate);
        }
    }

    /// Makes contacts of the limb's candidates, which begin with the impulses of the last step.
    #[inline(never)]
    pub(crate) fn add_limb(&mut self, frame: &ContactFrame<L>, limb: usize) {
        if self.sorted.is_empty() {
            return;
        }
        self.runs.push((limb, self.active..self.active + self.sorted.len()));
        for candidate in &self.sorted {
            let contact = &mut self.contacts[self.active];
            self.active += 1;
            contact.become_that_of(frame, limb, candidate);
            // A lane where it is far must not notice that another brought the contact in.
            let within = candidate.gap.lt(ground::far());
            let kept =
                frame.r_wb.transpose_mul(candidate.last_impulse).scale(within.select(L::one(), L::zero()));
            // The normal may have turned since: never a pull.
            let [x, y, z] = contact.axes.map(|axis| axis.dot(kept));
            contact.impulse = Vec3::new(x, y, z.max(L::zero()));
        }
        self.sorted.clear();
    }

    /// Applies the warm-start impulses to the whitened velocity.
    #[inline(never)]
    pub(crate) fn warm_start(&mut self, structure: &Structure<L::Scalar>, whitened: &mut [L]) {
        let (base, joints) = split(whitened);
        let mut base_now = *base;
        for (limb, contacts) in self.runs.iter().cloned() {
            with_joints!(structure.limbs[limb].joints, joints, self.joints, own => {
                for contact in &self.contacts[contacts] {
                    contact.apply(contact.impulse, &mut base_now, own);
                }
            });
        }
        *base = base_now;
    }

    /// One Gauss–Seidel sweep.
    #[inline(never)]
    pub(crate) fn sweep(&mut self, structure: &Structure<L::Scalar>, friction: L, whitened: &mut [L]) {
        let (base, joints) = split(whitened);
        // Every contact moves the base: it stays in registers, and so does a leg while its contacts are visited.
        let mut base_now = *base;
        for (limb, contacts) in self.runs.iter().cloned() {
            with_joints!(structure.limbs[limb].joints, joints, self.joints, own => {
                for contact in &mut self.contacts[contacts] {
                    contact.visit(friction, &mut base_now, own);
                }
            });
        }
        *base = base_now;
    }

    /// Work that getting out of overlaps takes at most \[J\], if the step ends with this whitened velocity.
    #[inline(always)]
    pub(crate) fn work_of_pushing_out(&mut self, structure: &Structure<L::Scalar>, whitened: &mut [L]) -> L {
        let (base, joints) = split(whitened);
        let mut sum = L::zero();
        for (limb, contacts) in self.runs.iter().cloned() {
            with_joints!(structure.limbs[limb].joints, joints, self.joints, own => {
                for contact in &self.contacts[contacts] {
                    let speed = contact.velocity(base, own).z;
                    let pushed = speed.clamp(L::zero(), (-contact.allowed_approach).max(L::zero()));
                    sum = contact.impulse.z.mul_add(pushed, sum);
                }
            });
        }
        sum
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
    #[inline(never)]
    pub(crate) fn finish(
        &self,
        r_wb: Mat3<L>,
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
            for (lane, &slot) in contact.slot.indices(impulses.len()).as_ref().iter().enumerate() {
                impulses[slot as usize].set(lane, impulse.get(lane));
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

/// A velocity of all degrees of freedom: the base's and the joints'.
#[inline(always)]
fn split<L>(velocity: &mut [L]) -> (&mut [L; BASE_DOFS], &mut [L]) {
    velocity.split_first_chunk_mut().expect("a base has six degrees of freedom")
}
