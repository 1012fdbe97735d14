//! `guidedog inspect robot`: the tree of links and joints.

use std::path::Path;

use anyhow::Result;
use guidedog::error::OrBadInput as _;
use guidedog::robot::{Harness, RobotModel, anymal_d, load_urdf};
use serde_json::json;

pub(super) fn show(file: Option<&Path>, json: bool) -> Result<String> {
    let model = load(file)?;
    Ok(if json { robot_json(&model) } else { model.tree_text() })
}

/// The robot of a URDF file; ANYmal D with its harness where there is none.
pub(super) fn load(file: Option<&Path>) -> Result<RobotModel> {
    Ok(match file {
        Some(path) => load_urdf(path).or_bad_input(|| format!("robot {}", path.display()))?,
        None => anymal_d().with_harness(Harness::default())?,
    })
}

fn robot_json(model: &RobotModel) -> String {
    let joints = model.joints.iter().enumerate().map(|(index, joint)| {
        json!({
            "name": joint.name,
            "parent": model.links[joint.parent_link].name,
            "link": model.links[index + 1].name,
            "axis": [joint.axis.x, joint.axis.y, joint.axis.z],
            "origin_m": [joint.origin.x, joint.origin.y, joint.origin.z],
            "position_low": joint.position_limits.0,
            "position_high": joint.position_limits.1,
            "effort_limit": joint.effort_limit,
            "velocity_limit": joint.velocity_limit,
        })
    });
    let links = model.links.iter().map(|link| json!({"name": link.name, "mass_kg": link.inertia.mass}));
    let value = json!({
        "name": model.name,
        "total_mass_kg": model.total_mass(),
        "links": links.collect::<Vec<_>>(),
        "joints": joints.collect::<Vec<_>>(),
        "contacts": model.contacts.iter().map(|c| &c.name).collect::<Vec<_>>(),
    });
    format!("{value:#}\n")
}
