//! Questions to ask a robot model.

use std::fmt::Write as _;

use crate::{
    RobotError,
    model::{BodyPart, JointKind, RobotModel},
};

impl RobotModel {
    /// Mass of all links \[kg\].
    pub fn total_mass(&self) -> f64 {
        self.links.iter().map(|link| link.inertia.mass).sum()
    }

    /// Index of a joint by name.
    ///
    /// # Errors
    /// There is no such joint; names those there are.
    pub fn joint_index(&self, name: &str) -> Result<usize, RobotError> {
        self.joints.iter().position(|joint| joint.name == name).ok_or_else(|| {
            let names: Vec<_> = self.joints.iter().map(|joint| joint.name.as_str()).collect();
            RobotError::value(&self.name, "joint", name, &format!("one of {}", names.join(", ")))
        })
    }

    /// Indices of the contact spheres that stand for a part of the body.
    pub fn contacts_of(&self, part: BodyPart) -> Vec<usize> {
        (0..self.contacts.len()).filter(|&i| self.contacts[i].part == part).collect()
    }

    /// The tree as text: one line a link with its joint, axis, limits, mass and center of mass.
    pub fn tree_text(&self) -> String {
        let mut text = format!("{}: {:.3} kg, {} joints\n", self.name, self.total_mass(), self.joints.len());
        self.write_link(&mut text, 0, 0);
        text
    }

    fn write_link(&self, text: &mut String, link: usize, depth: usize) {
        let body = &self.links[link];
        let [x, y, z] = body.inertia.center_of_mass().to_array();
        let indent = "  ".repeat(depth);
        let mut line =
            format!("{indent}{}: {:.4} kg at ({x:.4}, {y:.4}, {z:.4}) m", body.name, body.inertia.mass);
        if let Some(joint) = link.checked_sub(1).map(|j| &self.joints[j]) {
            let (unit, kind) = match joint.kind {
                JointKind::Revolute => ("rad", "turns about"),
                JointKind::Prismatic => ("m", "slides along"),
            };
            let [ax, ay, az] = joint.axis.to_array();
            let (lower, upper) = joint.position_limits;
            let effort = joint.effort_limit;
            let _ = write!(
                line,
                "; {} {kind} ({ax:.3}, {ay:.3}, {az:.3}), {lower:.3} to {upper:.3} {unit}, effort {effort}",
                joint.name
            );
        }
        text.push_str(line.trim_end());
        text.push('\n');
        for child in 1..self.links.len() {
            if self.joints[child - 1].parent_link == link {
                self.write_link(text, child, depth + 1);
            }
        }
    }
}
