//! From the elements of a URDF file to a [`RobotModel`]: one tree, fixed joints merged, all frames parallel to the
//! base's at zero joint positions, joints breadth-first with siblings by name.

use std::{
    collections::{BTreeMap, VecDeque},
    iter,
};

use spatial::{Inertia, Mat3, Vec3};

use crate::{
    RobotError,
    model::{BodyPart, ContactSphere, Joint, Link, RobotModel},
    urdf::{RawJoint, RawLink},
};

/// A link being placed: which body it belongs to and its pose in that body's frame.
struct Placed {
    name: String,
    body: usize,
    r_body: Mat3<f64>,
    p_body: Vec3<f64>,
}

/// Builds the model.
pub(crate) fn merge(
    name: &str,
    links: Vec<RawLink>,
    joints: Vec<RawJoint>,
) -> Result<RobotModel, RobotError> {
    let mut by_name = BTreeMap::new();
    for link in &links {
        if by_name.insert(link.name.as_str(), link).is_some() {
            return Err(RobotError::tree(&format!("link `{}`", link.name), "the name is used twice"));
        }
    }
    let root = find_root(&links, &joints, &by_name)?;
    let mut children: BTreeMap<&str, Vec<&RawJoint>> = BTreeMap::new();
    for joint in &joints {
        children.entry(joint.parent.as_str()).or_default().push(joint);
    }
    for siblings in children.values_mut() {
        siblings.sort_by(|a, b| a.name.cmp(&b.name));
    }

    let mut model = RobotModel {
        name: name.to_owned(),
        links: vec![Link { name: root.to_owned(), inertia: Inertia::zero() }],
        joints: Vec::new(),
        contacts: Vec::new(),
        harness: None,
    };
    // Fixed children are placed at once, moving ones wait their turn: breadth-first in bodies.
    let mut waiting = VecDeque::new();
    let mut place =
        vec![Placed { name: root.to_owned(), body: 0, r_body: Mat3::identity(), p_body: Vec3::zero() }];
    let mut visited = 0;
    loop {
        while let Some(placed) = place.pop() {
            visited += 1;
            absorb(&mut model, &placed, by_name[placed.name.as_str()]);
            for joint in children.get(placed.name.as_str()).into_iter().flatten() {
                let r_body = placed.r_body * joint.pose.0;
                let p_body = placed.r_body * joint.pose.1 + placed.p_body;
                let placed = Placed { name: joint.child.clone(), body: placed.body, r_body, p_body };
                if joint.kind.is_some() { waiting.push_back((*joint, placed)) } else { place.push(placed) }
            }
        }
        waiting.make_contiguous().sort_by(|a, b| (a.1.body, &a.0.name).cmp(&(b.1.body, &b.0.name)));
        let Some((joint, placed)) = waiting.pop_front() else { break };
        place.push(add_body(&mut model, joint, placed));
    }
    if visited < links.len() {
        let lost = links.iter().find(|link| is_in_loop(link, &joints)).unwrap_or(&links[0]);
        return Err(RobotError::tree(&format!("link `{}`", lost.name), "is part of a loop"));
    }
    check_inertias(&model)?;
    model.contacts.sort_by_key(|sphere| rank(sphere.part));
    Ok(model)
}

/// Order of parts among the contacts.
fn rank(part: BodyPart) -> usize {
    match part {
        BodyPart::Foot => 0,
        BodyPart::Hand => 1,
        BodyPart::Base => 2,
        BodyPart::Thigh => 3,
        BodyPart::Knee => 4,
        BodyPart::Shank => 5,
    }
}

fn find_root<'a>(
    links: &'a [RawLink],
    joints: &[RawJoint],
    by_name: &BTreeMap<&str, &RawLink>,
) -> Result<&'a str, RobotError> {
    let mut parents: BTreeMap<&str, &str> = BTreeMap::new();
    let mut names = BTreeMap::new();
    for joint in joints {
        let owner = format!("joint `{}`", joint.name);
        if names.insert(joint.name.as_str(), ()).is_some() {
            return Err(RobotError::tree(&owner, "the name is used twice"));
        }
        for (role, link) in [("parent", &joint.parent), ("child", &joint.child)] {
            if !by_name.contains_key(link.as_str()) {
                return Err(RobotError::tree(&owner, format!("its {role} link `{link}` does not exist")));
            }
        }
        if let Some(other) = parents.insert(&joint.child, &joint.name) {
            let problem = format!("its child link `{}` already hangs on joint `{other}`", joint.child);
            return Err(RobotError::tree(&owner, problem));
        }
    }
    let mut roots = links.iter().filter(|link| !parents.contains_key(link.name.as_str()));
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(&root.name),
        (None, _) => {
            let problem =
                if links.is_empty() { "has no links" } else { "every link hangs on another: a loop" };
            Err(RobotError::tree("<robot>", problem))
        }
        (Some(a), Some(b)) => {
            let problem = format!("`{}` and `{}` both hang on nothing; one root is allowed", a.name, b.name);
            Err(RobotError::tree("<robot>", problem))
        }
    }
}

fn is_in_loop(link: &RawLink, joints: &[RawJoint]) -> bool {
    let mut at = link.name.as_str();
    for _ in 0..=joints.len() {
        match joints.iter().find(|joint| joint.child == at) {
            Some(joint) if joint.parent == link.name => return true,
            Some(joint) => at = &joint.parent,
            None => return false,
        }
    }
    false
}

/// Adds what a placed link weighs and touches with to its body.
fn absorb(model: &mut RobotModel, placed: &Placed, raw: &RawLink) {
    let body = &mut model.links[placed.body];
    if let Some(inertia) = raw.inertia {
        body.inertia = body.inertia + inertia.transformed(placed.r_body, placed.p_body);
    }
    for (i, sphere) in raw.spheres.iter().enumerate() {
        let name = match &sphere.name {
            Some(name) => name.clone(),
            None => format!("{}_{i}", raw.name),
        };
        let is_free = |name: &String| model.contacts.iter().all(|other| other.name != *name);
        let numbered = (i..).map(|number| format!("{name}_{number}"));
        let unique = iter::once(name.clone()).chain(numbered).find(is_free).expect("numbers do not end");
        model.contacts.push(ContactSphere {
            part: part_of(sphere.name.as_deref(), &raw.name),
            name: unique,
            link: placed.body,
            center: placed.r_body * sphere.center + placed.p_body,
            radius: sphere.radius,
        });
    }
}

/// The part a sphere stands for, by the name of its collision element, else of its link. A robot's own hands are no
/// [`BodyPart::Hand`]: that is the handler's, which comes with a harness.
fn part_of(collision: Option<&str>, link: &str) -> BodyPart {
    let known = [
        ("foot", BodyPart::Foot),
        ("shank", BodyPart::Shank),
        ("calf", BodyPart::Shank),
        ("knee", BodyPart::Knee),
        ("thigh", BodyPart::Thigh),
        ("base", BodyPart::Base),
    ];
    for name in collision.into_iter().chain([link]) {
        let name = name.to_lowercase();
        if let Some((_, part)) = known.iter().find(|(word, _)| name.contains(word)) {
            return *part;
        }
    }
    BodyPart::Base
}

/// Adds a joint and the body it moves; the body's frame is parallel to its parent's at zero position.
fn add_body(model: &mut RobotModel, raw: &RawJoint, placed: Placed) -> Placed {
    model.joints.push(Joint {
        name: raw.name.clone(),
        kind: raw.kind.expect("only moving joints wait"),
        parent_link: placed.body,
        origin: placed.p_body,
        axis: placed.r_body * raw.axis,
        position_limits: raw.position_limits,
        effort_limit: raw.effort_limit,
        velocity_limit: raw.velocity_limit,
        armature: raw.armature,
    });
    model.links.push(Link { name: raw.child.clone(), inertia: Inertia::zero() });
    Placed { body: model.links.len() - 1, p_body: Vec3::zero(), ..placed }
}

/// Every body must have a mass and an inertia a real body can have: principal moments positive, none above the
/// sum of the other two.
fn check_inertias(model: &RobotModel) -> Result<(), RobotError> {
    for link in &model.links {
        let owner = format!("link `{}`", link.name);
        let mass = link.inertia.mass;
        if !(mass.is_finite() && mass > 0.0) {
            let allowed = "finite and above 0 together with what is fixed to it: it moves";
            return Err(RobotError::value(&owner, "mass", mass, allowed));
        }
        let about_center =
            link.inertia.transformed(Mat3::identity(), -link.inertia.center_of_mass()).rotational;
        let [xx, yy, zz, xy, xz, yz] = about_center;
        let found =
            format!("ixx {xx:.3e}, iyy {yy:.3e}, izz {zz:.3e}, ixy {xy:.3e}, ixz {xz:.3e}, iyz {yz:.3e}");
        if !is_positive_definite(about_center) {
            return Err(RobotError::value(&owner, "inertia", found, "positive definite"));
        }
        // Along each principal axis ½ trace − moment is ½ (sum of the other two − moment), with a slack for rounding.
        let half = 0.5 * (1.0 + 1e-6) * (xx + yy + zz);
        if !is_positive_definite([half - xx, half - yy, half - zz, -xy, -xz, -yz]) {
            let allowed = "such that no principal moment exceeds the sum of the other two";
            return Err(RobotError::value(&owner, "inertia", found, allowed));
        }
    }
    Ok(())
}

/// Whether a symmetric matrix `[xx, yy, zz, xy, xz, yz]` is positive definite (Sylvester's criterion); one with a NaN is not.
fn is_positive_definite([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> bool {
    let minor = xx * yy - xy * xy;
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    xx > 0.0 && minor > 0.0 && determinant > 0.0
}
