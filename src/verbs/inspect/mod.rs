//! `guidedog inspect`: what a robot description or a policy file holds, and how a robot would move.

mod dynamics;
mod policy;
mod robot;
mod state;

use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::Result;
use clap::{Args, Subcommand};

/// Shows what a robot description or a policy file holds, and how a robot would move
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    what: What,
}

const EXAMPLES: &str = "\
Examples:
  guidedog inspect robot                         ANYmal D with its harness, as trained
  guidedog inspect robot my_dog.urdf --json      another robot, for a program
  guidedog inspect policy runs/walk/policy.onnx  layers, limits and metadata of a network
  guidedog inspect dynamics --state state.json   mass matrix, forces and accelerations of a state";

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
    /// The network of an ONNX file: inputs, layers, activation, output limits, parameters, metadata
    #[command(after_help = policy::HELP)]
    Policy {
        /// An ONNX file
        file: PathBuf,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
    /// Mass matrix, bias forces, accelerations and contacts of a state, to check us against another engine
    #[command(after_help = dynamics::HELP)]
    Dynamics {
        /// A URDF file [default: ANYmal D with the harness]
        #[arg(long, value_name = "FILE")]
        robot: Option<PathBuf>,
        /// The state, a JSON file [default: everything zero]
        #[arg(long, value_name = "FILE")]
        state: Option<PathBuf>,
        /// Print JSON
        #[arg(long)]
        json: bool,
    },
}

pub(crate) fn run(arguments: &Arguments) -> Result<ExitCode> {
    let text = match &arguments.what {
        What::Robot { file, json } => robot::show(file.as_deref(), *json)?,
        What::Policy { file, json } => policy::show(file, *json)?,
        What::Dynamics { robot, state, json } => dynamics::show(robot.as_deref(), state.as_deref(), *json)?,
    };
    guidedog::say!("{}", text.trim_end());
    Ok(ExitCode::SUCCESS)
}
