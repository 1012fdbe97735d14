//! Reading URDF: the elements of the file as they stand, every number checked.
//!
//! What is read is said at [`parse_urdf`]. Shape into a tree: `merge.rs`.

use std::path::Path;

use roxmltree::{Document, Node};
use spatial::{Inertia, Mat3, Quat, Vec3};

use crate::{RobotError, RobotModel, merge::merge, model::JointKind};

/// A pose of one frame in another: rotation and origin.
pub(crate) type Pose = (Mat3<f64>, Vec3<f64>);

/// A `<link>`.
pub(crate) struct RawLink {
    pub(crate) name: String,
    /// About the link origin, link axes.
    pub(crate) inertia: Option<Inertia<f64>>,
    pub(crate) spheres: Vec<RawSphere>,
}

/// A sphere taken from a `<collision>`.
pub(crate) struct RawSphere {
    pub(crate) name: Option<String>,
    pub(crate) center: Vec3<f64>,
    pub(crate) radius: f64,
}

/// A `<joint>`; `kind` is absent for a fixed one.
pub(crate) struct RawJoint {
    pub(crate) name: String,
    pub(crate) kind: Option<JointKind>,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) pose: Pose,
    pub(crate) axis: Vec3<f64>,
    pub(crate) position_limits: (f64, f64),
    pub(crate) effort_limit: f64,
    pub(crate) velocity_limit: f64,
    pub(crate) armature: f64,
}

/// Reads a robot from a URDF file, as [`parse_urdf`] does.
///
/// # Errors
/// Anything [`RobotError`] names.
pub fn load_urdf(path: &Path) -> Result<RobotModel, RobotError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| RobotError::Read { path: path.display().to_string(), source })?;
    parse_urdf(&text)
}

/// Reads a robot from the text of a URDF file.
///
/// What is read: links with inertial and collision (sphere, box, cylinder; meshes are passed over, other shapes
/// refused), joints of type revolute, continuous, prismatic and fixed. One extension: `<dynamics armature="…">`, the
/// rotor inertia seen at the joint \[kg m² or kg\], 0 where absent.
///
/// `damping` and `friction` of `<dynamics>` are passed over: `physics` has servos of its own at the joints and no other
/// friction there. The official description of ANYmal D gives 0 at the legs; only the joints of its inspection payload, which
/// ours does not carry, have others.
///
/// # Errors
/// Anything [`RobotError`] names; among it a `<mimic>` at a joint that moves.
pub fn parse_urdf(text: &str) -> Result<RobotModel, RobotError> {
    let document = Document::parse(text)?;
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        return Err(RobotError::NotARobot { found: robot.tag_name().name().to_owned() });
    }
    let name = robot.attribute("name").unwrap_or("robot");
    let links = elements(robot, "link").map(read_link).collect::<Result<Vec<_>, _>>()?;
    let joints = elements(robot, "joint").map(read_joint).collect::<Result<Vec<_>, _>>()?;
    merge(name, links, joints)
}

fn elements<'a>(parent: Node<'a, 'a>, name: &'a str) -> impl Iterator<Item = Node<'a, 'a>> {
    parent.children().filter(move |node| node.has_tag_name(name))
}

fn child<'a>(parent: Node<'a, 'a>, name: &'a str) -> Option<Node<'a, 'a>> {
    elements(parent, name).next()
}

fn attribute<'a>(node: Node<'a, 'a>, owner: &str, name: &str) -> Result<&'a str, RobotError> {
    let what = format!("<{}> attribute `{name}`", node.tag_name().name());
    node.attribute(name).ok_or_else(|| RobotError::missing(owner, &what))
}

fn numbers<const N: usize>(text: &str, owner: &str, what: &str) -> Result<[f64; N], RobotError> {
    let wrong = || RobotError::value(owner, what, text, &format!("{N} finite numbers"));
    let values: Vec<f64> =
        text.split_whitespace().map(str::parse).collect::<Result<_, _>>().map_err(|_| wrong())?;
    let values: [f64; N] = values.try_into().map_err(|_| wrong())?;
    if values.iter().all(|value| value.is_finite()) { Ok(values) } else { Err(wrong()) }
}

fn number(node: Node<'_, '_>, owner: &str, name: &str) -> Result<f64, RobotError> {
    Ok(numbers::<1>(attribute(node, owner, name)?, owner, name)?[0])
}

fn positive(node: Node<'_, '_>, owner: &str, name: &str) -> Result<f64, RobotError> {
    let value = number(node, owner, name)?;
    if value > 0.0 { Ok(value) } else { Err(RobotError::value(owner, name, value, "above 0")) }
}

fn pose(node: Node<'_, '_>, owner: &str) -> Result<Pose, RobotError> {
    let Some(origin) = child(node, "origin") else {
        return Ok((Mat3::identity(), Vec3::zero()));
    };
    let read = |name| match origin.attribute(name) {
        Some(text) => numbers::<3>(text, owner, name),
        None => Ok([0.0; 3]),
    };
    let [roll, pitch, yaw] = read("rpy")?;
    Ok((Quat::from_roll_pitch_yaw(roll, pitch, yaw).to_matrix(), Vec3::splat(read("xyz")?)))
}

fn read_link(node: Node<'_, '_>) -> Result<RawLink, RobotError> {
    let name = attribute(node, "a <link>", "name")?.to_owned();
    let owner = format!("link `{name}`");
    let inertia = child(node, "inertial").map(|inertial| read_inertia(inertial, &owner)).transpose()?;
    let mut spheres = Vec::new();
    for collision in elements(node, "collision") {
        read_collision(collision, &owner, &mut spheres)?;
    }
    Ok(RawLink { name, inertia, spheres })
}

fn read_inertia(node: Node<'_, '_>, owner: &str) -> Result<Inertia<f64>, RobotError> {
    let mass = child(node, "mass").ok_or_else(|| RobotError::missing(owner, "<mass>"))?;
    let mass = number(mass, owner, "value")?;
    if mass < 0.0 {
        return Err(RobotError::value(owner, "mass", mass, "0 or above"));
    }
    let tensor = child(node, "inertia").ok_or_else(|| RobotError::missing(owner, "<inertia>"))?;
    let mut about_center = [0.0; 6];
    for (value, name) in about_center.iter_mut().zip(["ixx", "iyy", "izz", "ixy", "ixz", "iyz"]) {
        *value = number(tensor, owner, name)?;
    }
    let (rotation, center) = pose(node, owner)?;
    let body = Inertia::from_center_of_mass(mass, Vec3::zero(), about_center);
    Ok(body.transformed(rotation, center))
}

fn read_collision(node: Node<'_, '_>, owner: &str, out: &mut Vec<RawSphere>) -> Result<(), RobotError> {
    let name = node.attribute("name").map(str::to_owned);
    let (rotation, center) = pose(node, owner)?;
    let mut add = |offset: [f64; 3], radius| {
        let center = center + rotation * Vec3::splat(offset);
        out.push(RawSphere { name: name.clone(), center, radius });
    };
    let geometry = child(node, "geometry").ok_or_else(|| RobotError::missing(owner, "<geometry>"))?;
    if let Some(sphere) = child(geometry, "sphere") {
        add([0.0; 3], positive(sphere, owner, "radius")?);
    } else if let Some(cylinder) = child(geometry, "cylinder") {
        let radius = positive(cylinder, owner, "radius")?;
        // Spheres inside the cylinder, touching its ends; of one that is shorter than wide, the sphere stands out at both.
        let half = 0.5 * positive(cylinder, owner, "length")? - radius;
        if half > 0.0 {
            add([0.0, 0.0, half], radius);
            add([0.0, 0.0, -half], radius);
        } else {
            add([0.0; 3], radius);
        }
    } else if let Some(cuboid) = child(geometry, "box") {
        let text = attribute(cuboid, owner, "size")?;
        let size @ [x, y, z] = numbers::<3>(text, owner, "size")?;
        if size.iter().any(|edge| *edge <= 0.0) {
            return Err(RobotError::value(owner, "size", text, "3 numbers above 0"));
        }
        for corner in 0..8 {
            let sign = |bit: u32| if corner >> bit & 1 == 0 { 0.5 } else { -0.5 };
            add([sign(0) * x, sign(1) * y, sign(2) * z], 0.0);
        }
    } else if child(geometry, "mesh").is_none() {
        let shape = geometry.children().find(Node::is_element);
        let found = shape.map_or("empty", |shape| shape.tag_name().name());
        let allowed = "sphere, box or cylinder, or mesh, which is passed over";
        return Err(RobotError::value(owner, "<geometry>", found, allowed));
    }
    Ok(())
}

fn read_joint(node: Node<'_, '_>) -> Result<RawJoint, RobotError> {
    let name = attribute(node, "a <joint>", "name")?.to_owned();
    let owner = format!("joint `{name}`");
    let joint_type = attribute(node, &owner, "type")?;
    let kind = match joint_type {
        "revolute" | "continuous" => Some(JointKind::Revolute),
        "prismatic" => Some(JointKind::Prismatic),
        "fixed" => None,
        other => {
            return Err(RobotError::value(&owner, "type", other, "revolute, continuous, prismatic or fixed"));
        }
    };
    let link = |tag| {
        let element = child(node, tag).ok_or_else(|| RobotError::missing(&owner, &format!("<{tag}>")))?;
        attribute(element, &owner, "link").map(str::to_owned)
    };
    let mut joint = RawJoint {
        parent: link("parent")?,
        child: link("child")?,
        pose: pose(node, &owner)?,
        kind,
        axis: Vec3::splat([1.0, 0.0, 0.0]),
        position_limits: (f64::NEG_INFINITY, f64::INFINITY),
        effort_limit: f64::INFINITY,
        velocity_limit: f64::INFINITY,
        armature: 0.0,
        name,
    };
    if kind.is_some() {
        read_motion(node, &owner, joint_type == "continuous", &mut joint)?;
    }
    Ok(joint)
}

fn read_motion(
    node: Node<'_, '_>,
    owner: &str,
    continuous: bool,
    joint: &mut RawJoint,
) -> Result<(), RobotError> {
    if let Some(mimic) = child(node, "mimic") {
        let followed = attribute(mimic, owner, "joint")?;
        return Err(RobotError::value(owner, "<mimic>", followed, "absent, as no joint can follow another"));
    }
    if let Some(axis) = child(node, "axis") {
        let text = attribute(axis, owner, "xyz")?;
        let axis = Vec3::splat(numbers::<3>(text, owner, "axis")?);
        let norm: f64 = axis.norm();
        if !(norm.is_finite() && norm >= 1e-9) {
            return Err(RobotError::value(owner, "axis", text, "a vector of finite length, 1e-9 or more"));
        }
        joint.axis = axis.scale(1.0 / norm);
    }
    match child(node, "limit") {
        Some(limit) => {
            joint.effort_limit = positive(limit, owner, "effort")?;
            joint.velocity_limit = positive(limit, owner, "velocity")?;
            if !continuous {
                let (lower, upper) = (number(limit, owner, "lower")?, number(limit, owner, "upper")?);
                if lower >= upper {
                    let found = format!("{lower}…{upper}");
                    return Err(RobotError::value(owner, "limit", found, "lower below upper"));
                }
                joint.position_limits = (lower, upper);
            }
        }
        None if continuous => {}
        None => return Err(RobotError::missing(owner, "<limit>")),
    }
    if let Some(armature) = child(node, "dynamics").filter(|node| node.has_attribute("armature")) {
        joint.armature = number(armature, owner, "armature")?;
        if joint.armature < 0.0 {
            return Err(RobotError::value(owner, "armature", joint.armature, "0 or above"));
        }
    }
    Ok(())
}
