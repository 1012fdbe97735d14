//! Joint position limits as one-sided rows of the same Gauss–Seidel.
//!
//! Of a joint's two limits only the nearer is a row. That is felt where the travel R between them is below twice [`MARGIN`],
//! 0.1 rad or m: such a joint may end a step past the farther limit if it moves by more than R / 2 in it, at 5 ms from 100 R
//! per second on.

use spatial::{Lane, Mask};

use crate::{
    engine::Config,
    ground,
    structure::{BASE_DOFS, Structure},
};

/// One joint near a limit.
#[derive(Clone, Debug)]
struct Limit<L> {
    dof: usize,
    /// Whitened row along the joint's chain.
    row: Vec<L>,
    /// +1 at the lower, −1 at the upper limit: the way the limit pushes.
    direction: L,
    allowed_approach: L,
    inverse: L,
    impulse: L,
}

impl<L: Lane> Limit<L> {
    /// Velocity of the joint.
    #[inline(always)]
    fn speed(&self, chain: &[usize], whitened: &[L]) -> L {
        let mut speed = L::zero();
        for (&entry, &dof) in self.row.iter().zip(chain) {
            speed = entry.mul_add(whitened[dof], speed);
        }
        speed
    }
}

/// All limits of a step.
#[derive(Clone, Debug)]
pub(crate) struct LimitSet<L> {
    limits: Vec<Limit<L>>,
    active: usize,
}

/// A joint this close to a limit enters the solver \[rad or m\].
const MARGIN: f64 = 0.05;

impl<L: Lane> LimitSet<L> {
    pub(crate) fn new(joints: usize, max_chain: usize) -> Self {
        let limit = Limit {
            dof: 0,
            row: vec![L::zero(); max_chain],
            direction: L::zero(),
            allowed_approach: L::zero(),
            inverse: L::zero(),
            impulse: L::zero(),
        };
        Self { limits: vec![limit; joints], active: 0 }
    }

    /// Finds the joints near a limit.
    #[inline(always)]
    pub(crate) fn collect(
        &mut self,
        structure: &Structure<L::Scalar>,
        config: &Config,
        factor: &[L],
        inverse_diagonal: &[L],
        position: &[L],
    ) {
        self.active = 0;
        for (j, joint) in structure.joints.iter().enumerate() {
            let Some([lower, upper]) = joint.limits else { continue };
            let to_lower = position[j] - L::broadcast(lower);
            let to_upper = L::broadcast(upper) - position[j];
            let gap = to_lower.min(to_upper);
            let near = gap.lt(L::splat(MARGIN));
            if !near.any() {
                continue;
            }
            let limit = &mut self.limits[self.active];
            self.active += 1;
            limit.dof = BASE_DOFS + j;
            limit.direction = to_lower.le(to_upper).select(L::one(), -L::one());
            limit.impulse = L::zero();
            let gap = near.select(gap, ground::far());
            let rate = gap.gt(L::zero()).select(L::one(), L::splat(config.error_reduction));
            limit.allowed_approach = gap * rate * L::splat(1.0 / config.time_step);
            whitened_unit_row(structure, factor, inverse_diagonal, limit);
        }
    }

    /// Work that getting back inside the limits takes at most \[J\], if the step ends with this whitened velocity.
    #[inline(always)]
    pub(crate) fn work_of_pushing_out(&self, structure: &Structure<L::Scalar>, whitened: &[L]) -> L {
        let mut sum = L::zero();
        for limit in &self.limits[..self.active] {
            let speed = limit.direction * limit.speed(structure.chain(limit.dof), whitened);
            let pushed = speed.clamp(L::zero(), (-limit.allowed_approach).max(L::zero()));
            sum = limit.impulse.mul_add(pushed, sum);
        }
        sum
    }

    /// One Gauss–Seidel sweep.
    #[inline(always)]
    pub(crate) fn sweep(&mut self, structure: &Structure<L::Scalar>, whitened: &mut [L]) {
        for limit in &mut self.limits[..self.active] {
            let chain = structure.chain(limit.dof);
            let approach = limit.direction.mul_add(limit.speed(chain, whitened), limit.allowed_approach);
            let new = limit.inverse.neg_mul_add(approach, limit.impulse).max(L::zero());
            let change = (new - limit.impulse) * limit.direction;
            limit.impulse = new;
            for (&entry, &dof) in limit.row.iter().zip(chain) {
                whitened[dof] = entry.mul_add(change, whitened[dof]);
            }
        }
    }
}

/// The row of a single joint velocity, `e_jᵀ L⁻¹`.
#[inline(always)]
fn whitened_unit_row<L: Lane>(
    structure: &Structure<L::Scalar>,
    factor: &[L],
    inverse_diagonal: &[L],
    limit: &mut Limit<L>,
) {
    let chain = structure.chain(limit.dof);
    let row = &mut limit.row[..chain.len()];
    row.fill(L::zero());
    row[chain.len() - 1] = L::one();
    let mut block = L::zero();
    for position in (0..chain.len()).rev() {
        let dof = chain[position];
        let scaled = row[position] * inverse_diagonal[dof];
        row[position] = scaled;
        block = scaled.mul_add(scaled, block);
        let start = structure.row_start(dof);
        for (entry, &l) in row[..position].iter_mut().zip(&factor[start..]) {
            *entry = scaled.neg_mul_add(l, *entry);
        }
    }
    limit.inverse = L::one() / block;
}
