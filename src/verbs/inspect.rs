//! `guidedog inspect`: what a robot description or a policy file holds.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Subcommand};
use guidedog::error::OrBadInput as _;
use guidedog::robot::{Harness, RobotModel, anymal_d, load_urdf};
use serde_json::json;

/// Shows what a robot description holds
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
Examples:
  guidedog inspect robot                     ANYmal D with its harness, as trained
  guidedog inspect robot my_dog.urdf --json  another robot, for a program";

#[derive(Debug, Subcommand)]
enum What {
    /// The tree of links and joints after fixed joints are merged
    Robot {
        /// A URDF file [default: ANYmal D with the harness]
        file: Option<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    match &arguments.what {
        What::Robot { file, json } => {
            let model = robot(file.as_deref())?;
            print!("{}", if *json { robot_json(&model) } else { model.tree_text() });
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn robot(file: Option<&Path>) -> Result<RobotModel> {
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
