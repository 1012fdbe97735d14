//! The robot's tree as the kernels want it: chains of degrees of freedom and constants at lane precision.
//!
//! Degrees of freedom 0–2 are the base's angular, 3–5 its linear velocity (base frame); joint `j` is degree of
//! freedom `6 + j`. Because parents come first, the chain of any degree of freedom (itself and everything it hangs on, from the
//! base outward) begins with the chain of each of its ancestors: all sparsity of the mass matrix follows from that
//! (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, section 6.4).

use robot::{JointKind, RobotModel};
use spatial::{Inertia, Lane, Mat3, Vec3};

use crate::{block::Parameters, kinematics::LinkKinematics};

/// Degrees of freedom of the floating base.
pub(crate) const BASE_DOFS: usize = 6;

/// An inertia with constants at lane precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InertiaConstants<S> {
    mass: S,
    moment: [S; 3],
    rotational: [S; 6],
}

/// A joint and the link it moves.
#[derive(Clone, Debug)]
pub(crate) struct JointConstants<S> {
    pub(crate) kind: JointKind,
    pub(crate) parent_link: usize,
    pub(crate) origin: [S; 3],
    pub(crate) axis: Axis,
    pub(crate) inertia: InertiaConstants<S>,
    pub(crate) armature: S,
    /// Lower and upper position limit, of which one may be infinite; absent for a continuous joint.
    pub(crate) limits: Option<[S; 2]>,
}

/// A joint axis; turning about a frame axis is cheaper than about a general one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Axis {
    /// A frame axis (0, 1, 2) and its sign.
    Frame(usize, f64),
    /// Any unit vector.
    General([f64; 3]),
}

impl Axis {
    fn from_unit(axis: [f64; 3]) -> Self {
        // By the other two components: the largest one hides an error of 1e-6 in its twelfth digit.
        let is_along = |i: usize| axis.iter().enumerate().all(|(k, a)| k == i || a.abs() < 1e-12);
        match (0..3).find(|&i| is_along(i)) {
            Some(i) => Self::Frame(i, axis[i].signum()),
            None => Self::General(axis),
        }
    }

    /// `r_bp` turned by `angle` \[rad\] about the axis.
    #[inline(always)]
    pub(crate) fn turn<L: Lane>(self, r_bp: &Mat3<L>, angle: L) -> Mat3<L> {
        match self {
            Self::Frame(i, sign) => {
                let (s, c) = angle.sin_cos();
                let s = s * L::splat(sign);
                let (j, k) = ((i + 1) % 3, (i + 2) % 3);
                let mut turned = *r_bp;
                let (pj, pk) = (r_bp.columns[j], r_bp.columns[k]);
                turned.columns[j] = pj.scale_add(c, pk.scale(s));
                turned.columns[k] = pk.scale_add(c, -pj.scale(s));
                turned
            }
            Self::General(axis) => *r_bp * Mat3::from_axis_angle(axis, angle),
        }
    }

    /// The axis in the base frame, given the link's rotation.
    #[inline(always)]
    pub(crate) fn in_base<L: Lane>(self, r_bl: &Mat3<L>) -> Vec3<L> {
        match self {
            Self::Frame(i, sign) => r_bl.columns[i].scale(L::splat(sign)),
            Self::General(axis) => *r_bl * Vec3::splat(axis),
        }
    }
}

impl<S: Copy> InertiaConstants<S> {
    fn new<L: Lane<Scalar = S>>(inertia: &Inertia<f64>) -> Self {
        Self {
            mass: L::scalar(inertia.mass),
            moment: inertia.moment.to_array().map(L::scalar),
            rotational: inertia.rotational.map(L::scalar),
        }
    }

    /// The inertia in every lane.
    #[inline(always)]
    pub(crate) fn broadcast<L: Lane<Scalar = S>>(&self) -> Inertia<L> {
        Inertia {
            mass: L::broadcast(self.mass),
            moment: broadcast(self.moment),
            rotational: self.rotational.map(L::broadcast),
        }
    }
}

/// A constant vector in every lane.
#[inline(always)]
pub(crate) fn broadcast<L: Lane>(v: [L::Scalar; 3]) -> Vec3<L> {
    Vec3::new(L::broadcast(v[0]), L::broadcast(v[1]), L::broadcast(v[2]))
}

/// A contact sphere with constants at lane precision.
#[derive(Clone, Debug)]
pub(crate) struct SphereConstants<S> {
    pub(crate) link: usize,
    pub(crate) center: [S; 3],
    pub(crate) radius: S,
    /// Its center is the hand's, which differs between robots.
    pub(crate) is_hand: bool,
}

impl<S: Copy> SphereConstants<S> {
    /// The center in the base frame \[m\].
    #[inline(always)]
    pub(crate) fn center_in_base<L: Lane<Scalar = S>>(
        &self,
        parameters: &Parameters<L>,
        links: &[LinkKinematics<L>],
    ) -> Vec3<L> {
        let link = &links[self.link];
        link.r_bl * self.center_in_link(parameters) + link.p_bl
    }

    /// The center in the link's frame \[m\].
    #[inline(always)]
    pub(crate) fn center_in_link<L: Lane<Scalar = S>>(&self, parameters: &Parameters<L>) -> Vec3<L> {
        if self.is_hand { parameters.hand_position } else { broadcast(self.center) }
    }
}

/// Spheres whose links hang on each other: each is moved by a first part of the same chain. A contact of the limb can so be of
/// another sphere in every lane.
#[derive(Clone, Debug)]
pub(crate) struct Limb {
    /// The joints that move the outermost link, from the base on.
    pub(crate) joints: Vec<usize>,
    /// Indices of the spheres.
    pub(crate) spheres: Vec<usize>,
}

/// The tree.
#[derive(Clone, Debug)]
pub(crate) struct Structure<S> {
    pub(crate) joints: Vec<JointConstants<S>>,
    pub(crate) spheres: Vec<SphereConstants<S>>,
    pub(crate) limbs: Vec<Limb>,
    /// For each degree of freedom its chain, base first, itself last.
    chains: Vec<Vec<usize>>,
    /// Where the row of each degree of freedom starts in a packed triangular matrix.
    row_starts: Vec<usize>,
}

impl<S: Copy> Structure<S> {
    pub(crate) fn new<L: Lane<Scalar = S>>(robot: &RobotModel) -> Self {
        let joints: Vec<_> = robot
            .joints
            .iter()
            .enumerate()
            .map(|(j, joint)| JointConstants {
                kind: joint.kind,
                parent_link: joint.parent_link,
                origin: joint.origin.to_array().map(L::scalar),
                axis: Axis::from_unit(joint.axis.to_array()),
                inertia: InertiaConstants::new::<L>(&robot.links[j + 1].inertia),
                armature: L::scalar(joint.armature),
                limits: (joint.position_limits.0.is_finite() || joint.position_limits.1.is_finite())
                    .then(|| [L::scalar(joint.position_limits.0), L::scalar(joint.position_limits.1)]),
            })
            .collect();
        let spheres = robot
            .contacts
            .iter()
            .map(|sphere| SphereConstants {
                link: sphere.link,
                center: sphere.center.to_array().map(L::scalar),
                radius: L::scalar(sphere.radius),
                is_hand: sphere.part == robot::BodyPart::Hand && robot.harness.is_some(),
            })
            .collect();
        let mut chains: Vec<Vec<usize>> = (0..BASE_DOFS).map(|dof| (0..=dof).collect()).collect();
        for (j, joint) in joints.iter().enumerate() {
            let mut chain = chains[dof_of_link(joint.parent_link)].clone();
            chain.push(BASE_DOFS + j);
            chains.push(chain);
        }
        let links: Vec<usize> = robot.contacts.iter().map(|sphere| sphere.link).collect();
        let limbs = limbs(&links, &chains);
        let mut row_starts = vec![0];
        for chain in &chains {
            row_starts.push(row_starts[row_starts.len() - 1] + chain.len());
        }
        Self { joints, spheres, limbs, chains, row_starts }
    }

    pub(crate) fn num_dofs(&self) -> usize {
        self.chains.len()
    }
    /// Entries of a packed triangular matrix.
    pub(crate) fn packed_len(&self) -> usize {
        self.row_starts[self.num_dofs()]
    }
    /// First entry of the row of `dof`.
    #[inline(always)]
    pub(crate) fn row_start(&self, dof: usize) -> usize {
        self.row_starts[dof]
    }
    /// The degrees of freedom that move `dof`, base first, itself last.
    #[inline(always)]
    pub(crate) fn chain(&self, dof: usize) -> &[usize] {
        &self.chains[dof]
    }
    /// The degrees of freedom that move a link, base first.
    #[inline(always)]
    pub(crate) fn chain_of_link(&self, link: usize) -> &[usize] {
        &self.chains[dof_of_link(link)]
    }
    /// Length of the longest chain.
    pub(crate) fn max_chain(&self) -> usize {
        self.chains.iter().map(Vec::len).max().unwrap_or(BASE_DOFS)
    }
}

/// The limbs of spheres on `links`; those on the base are one of their own.
fn limbs(links: &[usize], chains: &[Vec<usize>]) -> Vec<Limb> {
    let joints = |sphere: usize| -> Vec<usize> {
        chains[dof_of_link(links[sphere])][BASE_DOFS..].iter().map(|dof| dof - BASE_DOFS).collect()
    };
    let mut outermost_first: Vec<usize> = (0..links.len()).collect();
    outermost_first.sort_by_key(|&sphere| std::cmp::Reverse(joints(sphere).len()));
    let mut limbs: Vec<Limb> = Vec::new();
    for sphere in outermost_first {
        let joints = joints(sphere);
        let belongs = |limb: &&mut Limb| {
            if joints.is_empty() { limb.joints.is_empty() } else { limb.joints.starts_with(&joints) }
        };
        match limbs.iter_mut().find(belongs) {
            Some(limb) => limb.spheres.push(sphere),
            None => limbs.push(Limb { joints, spheres: vec![sphere] }),
        }
    }
    limbs
}

/// The last degree of freedom that moves a link.
#[inline(always)]
pub(crate) fn dof_of_link(link: usize) -> usize {
    BASE_DOFS + link - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_leg_is_a_limb_and_so_is_the_trunk() {
        let robot = robot::anymal_d().with_harness(robot::Harness::default()).unwrap();
        let structure = Structure::new::<f64>(&robot);
        let joints: Vec<usize> = structure.limbs.iter().map(|limb| limb.joints.len()).collect();
        assert_eq!(joints, [3, 3, 3, 3, 0]);
        let mut spheres: Vec<usize> = structure.limbs.iter().flat_map(|limb| limb.spheres.clone()).collect();
        spheres.sort_unstable();
        assert_eq!(spheres, (0..robot.contacts.len()).collect::<Vec<_>>());
        for limb in &structure.limbs {
            for &sphere in &limb.spheres {
                let chain = structure.chain_of_link(structure.spheres[sphere].link);
                let moved = limb.joints.iter().map(|joint| BASE_DOFS + joint);
                assert!(moved.zip(&chain[BASE_DOFS..]).all(|(limb, own)| limb == *own));
                assert!(limb.joints.len() + BASE_DOFS >= chain.len());
            }
        }
    }
}
