//! `guidedog inspect dynamics`: the equation of motion in a state, in double precision.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use anyhow::Result;
use guidedog::physics::{Block, Config, Engine};
use guidedog::robot::RobotModel;
use guidedog::terrain::HeightField;
use serde_json::{Value, json};

use super::{robot, state::StateFile};

pub(super) const HELP: &str = "\
The state is JSON. What is missing is zero, joints by name:

  {
    \"base_position\": [0, 0, 0.6],             world frame, m
    \"base_orientation\": [1, 0, 0, 0],         w, x, y, z
    \"base_linear_velocity\": [0.5, 0, 0],      base frame, m/s
    \"base_angular_velocity\": [0, 0, 0.1],     base frame, rad/s
    \"joint_position\": {\"LF_HFE\": 0.4},        rad, or m for a prismatic joint
    \"joint_velocity\": {\"LF_HFE\": 1.0},
    \"joint_torque\": {\"LF_KFE\": 20},           N m, or N
    \"hand_force\": [-60, 0, 0],                on the robot at the hand, heading frame, N
    \"base_force\": [0, 0, 0]                   at the base origin, heading frame, N
  }

The equation of motion without contacts is M a + bias = applied. Degrees of freedom: the base's angular,
then its linear velocity, both along the base's axes; then the joints. The base's linear acceleration is
that of its origin in the world, turned into the base's axes. Contacts: spheres within 2 cm of level
ground at z = 0; their forces are those of one time step of 5 ms from here, no servo acting.

Examples:
  guidedog inspect dynamics
  guidedog inspect dynamics --state state.json --json | jq .acceleration
  guidedog inspect dynamics --robot my_dog.urdf --state state.json --json";

pub(super) fn show(file: Option<&Path>, state: Option<&Path>, json: bool) -> Result<String> {
    let model = robot::load(file)?;
    let mut config = Config::default();
    (config.actuator.stiffness, config.actuator.damping) = (0.0, 0.0);
    let engine: Engine<f64> = Engine::new(model, Arc::new(HeightField::flat(0.0)), config);
    let mut block = Block::new(&engine);
    let torque = StateFile::load(state)?.apply(&engine, &mut block)?;
    let dynamics = Dynamics::of(&engine, &mut block, &torque);
    Ok(if json { dynamics.to_json(&engine.robot) } else { dynamics.to_text(&engine.robot) })
}

/// Everything that is shown, in the order of the degrees of freedom.
struct Dynamics {
    /// Row by row.
    mass_matrix: Vec<f64>,
    bias: Vec<f64>,
    acceleration: Vec<f64>,
    contacts: Vec<Touching>,
}

/// A sphere near the ground.
struct Touching {
    name: String,
    center: [f64; 3],
    gap: f64,
    force: [f64; 3],
}

impl Dynamics {
    fn of(engine: &Engine<f64>, block: &mut Block<f64>, torque: &[f64]) -> Self {
        Self {
            mass_matrix: block.mass_matrix(engine),
            bias: block.bias_force(engine),
            acceleration: block.forward_dynamics(engine, torque),
            contacts: touching(engine, block),
        }
    }

    fn to_json(&self, robot: &RobotModel) -> String {
        let names = degrees_of_freedom(robot);
        let contact = |c: &Touching| -> Value {
            json!({"name": c.name, "center_m": c.center, "gap_m": c.gap, "force_n": c.force})
        };
        let value = json!({
            "robot": robot.name,
            "degrees_of_freedom": names,
            "mass_matrix": self.mass_matrix.chunks(names.len()).collect::<Vec<_>>(),
            "bias_force": self.bias,
            "acceleration": self.acceleration,
            "contacts": self.contacts.iter().map(contact).collect::<Vec<_>>(),
        });
        format!("{value:#}\n")
    }

    fn to_text(&self, robot: &RobotModel) -> String {
        let names = degrees_of_freedom(robot);
        let mut text = format!("{}: {} degrees of freedom\n\n", robot.name, names.len());
        let _ = writeln!(text, "{:<18}{:>12}{:>14}{:>16}", "", "M diagonal", "bias force", "acceleration");
        for (i, name) in names.iter().enumerate() {
            let diagonal = self.mass_matrix[i * names.len() + i];
            let (bias, acceleration) = (self.bias[i], self.acceleration[i]);
            let _ = writeln!(text, "{name:<18}{diagonal:>12.5}{bias:>14.5}{acceleration:>16.5}");
        }
        text.push_str("\nthe whole mass matrix: --json\n\n");
        if self.contacts.is_empty() {
            text.push_str("no sphere is within 2 cm of the ground\n");
        }
        for Touching { name, center: [x, y, z], gap, force: [fx, fy, fz] } in &self.contacts {
            let _ = writeln!(
                text,
                "{name} at ({x:.4}, {y:.4}, {z:.4}) m, gap {gap:.5} m, force ({fx:.2}, {fy:.2}, {fz:.2}) N"
            );
        }
        text
    }
}

/// Spheres nearer to the ground than this are listed \[m\]; the help says so.
const LISTED: f64 = 0.02;

/// Spheres near the ground, with the forces of one step from here.
fn touching(engine: &Engine<f64>, block: &mut Block<f64>) -> Vec<Touching> {
    let centers = block.contact_centers(engine);
    block.step(engine);
    let spheres = engine.robot.contacts.iter().zip(centers).zip(&block.output.contact_force);
    let all = spheres.map(|((sphere, center), force)| Touching {
        name: sphere.name.clone(),
        center: center.to_array(),
        gap: center.z - sphere.radius,
        force: force.to_array(),
    });
    all.filter(|contact| contact.gap < LISTED).collect()
}

fn degrees_of_freedom(robot: &RobotModel) -> Vec<String> {
    let base = ["base_angular_x", "base_angular_y", "base_angular_z"];
    let base = base.into_iter().chain(["base_linear_x", "base_linear_y", "base_linear_z"]);
    base.map(str::to_owned).chain(robot.joints.iter().map(|joint| joint.name.clone())).collect()
}
