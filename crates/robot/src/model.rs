//! The robot as the dynamics sees it: a floating base and a tree of one-degree-of-freedom joints.

use spatial::{Inertia, Vec3};

/// A robot with all fixed joints merged.
///
/// Every link frame has its origin at the joint that moves the link and, at zero joint positions, the
/// orientation of the base frame (x forward, y left, z up), so a joint is one offset and one axis.
/// Link 0 is the floating base; joint `j` moves link `j + 1`. Joints are in breadth-first order with siblings by
/// name, so a parent always comes before its children and ANYmal D's order is Isaac Lab's (`mdp/symmetry/anymal.py`):
/// LF, LH, RF, RH for HAA, then HFE, then KFE.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotModel {
    /// Name of the robot.
    pub name: String,
    /// Links; the first is the base.
    pub links: Vec<Link>,
    /// Joints; `joints[j]` moves `links[j + 1]`.
    pub joints: Vec<Joint>,
    /// Spheres that can touch the ground.
    pub contacts: Vec<ContactSphere>,
    /// Where the handler's hand is, if the robot carries a harness.
    pub harness: Option<Harness>,
}

/// A rigid link.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Name of the link (of the one nearest the base among those merged).
    pub name: String,
    /// Inertia about the link origin in the link frame (kg, kg m, kg m²).
    pub inertia: Inertia<f64>,
}

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis \[rad\].
    Revolute,
    /// Slides along its axis \[m\].
    Prismatic,
}

/// A joint of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Name of the joint.
    pub name: String,
    /// Kind of motion.
    pub kind: JointKind,
    /// Index of the link it hangs on; less than or equal to the joint's own index.
    pub parent_link: usize,
    /// Joint origin in the parent link's frame \[m\].
    pub origin: Vec3<f64>,
    /// Unit axis in the link frame.
    pub axis: Vec3<f64>,
    /// Position limits \[rad or m\]; infinite for a continuous joint.
    pub position_limits: (f64, f64),
    /// Largest torque or force \[N m or N\], as described; `physics` does not read it, its servos have limits of their own.
    pub effort_limit: f64,
    /// Largest speed \[rad/s or m/s\], as described; `physics` does not read it either.
    pub velocity_limit: f64,
    /// Reflected rotor inertia added to the joint \[kg m² or kg\].
    pub armature: f64,
}

/// Which part of the body a contact sphere stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BodyPart {
    /// A foot: meant to touch the ground.
    Foot,
    /// Between knee and foot.
    Shank,
    /// The knee.
    Knee,
    /// Between hip and knee.
    Thigh,
    /// The trunk; touching the ground ends an episode.
    Base,
    /// The handler's hand at the end of the bar.
    Hand,
}

/// A sphere fixed to a link that can touch the ground.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSphere {
    /// Name, unique in the robot.
    pub name: String,
    /// Link it is fixed to.
    pub link: usize,
    /// Center in the link frame \[m\].
    pub center: Vec3<f64>,
    /// Radius \[m\].
    pub radius: f64,
    /// What it stands for.
    pub part: BodyPart,
}

/// A rigid bar on the base with the handler's hand at its end, as a uniform rod and a sphere.
///
/// Defaults: ours; training randomizes `bar_length` and `hand_mass`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harness {
    /// Where the bar is fixed, base frame \[m\].
    pub bar_start: Vec3<f64>,
    /// Length from the fixing to the center of the hand \[m\].
    pub bar_length: f64,
    /// Mass of the bar \[kg\].
    pub bar_mass: f64,
    /// Height of the hand's center above the base origin, base frame \[m\].
    pub hand_height: f64,
    /// Mass of the hand \[kg\].
    pub hand_mass: f64,
    /// Radius of the hand's sphere \[m\].
    pub hand_radius: f64,
}
