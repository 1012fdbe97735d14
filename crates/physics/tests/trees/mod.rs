//! Random robots in random states, and what is worked out of any robot's state a second time.
#![allow(dead_code, reason = "no test uses all of it")]

use std::sync::Arc;

use physics::{Block, Config, Engine};
use robot::{BodyPart, ContactSphere, Joint, JointKind, Link, RobotModel};
use spatial::{Inertia, Mat3, Philox, Purpose, Quat, Vec3};
use terrain::HeightField;

/// The random numbers of one case.
pub(crate) fn stream(case: usize) -> Philox {
    Philox::new(11, case, 0, 0, Purpose::Evaluation)
}

fn around(random: &mut Philox, width: f32) -> f64 {
    f64::from(random.uniform(-width, width))
}

pub(crate) fn vector(random: &mut Philox, width: f32) -> Vec3<f64> {
    Vec3::splat([0; 3].map(|_| around(random, width)))
}

fn direction(random: &mut Philox) -> Vec3<f64> {
    let v = Vec3::splat([0; 3].map(|_| f64::from(random.normal())));
    v.scale(1.0 / v.norm())
}

/// A link of four equal masses at random, so its inertia is one that exists.
fn link(random: &mut Philox, name: String, mass: f64) -> Link {
    let points = [0; 4].map(|_| vector(random, 0.15));
    let point = |p: &Vec3<f64>| Inertia::from_center_of_mass(mass / 4.0, *p, [0.0; 6]);
    let inertia = points.iter().map(point).fold(Inertia::zero(), |sum, part| sum + part);
    Link { name, inertia }
}

fn joint(random: &mut Philox, index: usize) -> Joint {
    let turns = random.uniform01() < 0.75;
    // Axes of the frame have kernels of their own.
    let axis = match random.below(6) {
        side @ 0..3 => {
            let mut axis = [0.0; 3];
            axis[side as usize] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            Vec3::splat(axis)
        }
        _ => direction(random),
    };
    Joint {
        name: format!("joint {index}"),
        kind: if turns { JointKind::Revolute } else { JointKind::Prismatic },
        parent_link: random.below(index as u32 + 1) as usize,
        origin: vector(random, 0.3),
        axis,
        position_limits: (f64::NEG_INFINITY, f64::INFINITY),
        effort_limit: 80.0,
        velocity_limit: 1e3,
        armature: 0.0,
    }
}

/// 3 to 20 joints that turn or slide, branching at random; a contact sphere on every link.
pub(crate) fn tree(random: &mut Philox) -> RobotModel {
    let count = 3 + random.below(18) as usize;
    let joints: Vec<_> = (0..count).map(|index| joint(random, index)).collect();
    let masses = (0..=count).map(|i| if i == 0 { 5.0 } else { f64::from(random.uniform(0.3, 3.0)) });
    let masses: Vec<_> = masses.collect();
    let link = |(i, &mass): (usize, &f64)| link(random, format!("link {i}"), mass);
    let links: Vec<_> = masses.iter().enumerate().map(link).collect();
    let sphere = |link: usize| ContactSphere {
        name: format!("sphere {link}"),
        link,
        center: links[link].inertia.moment.scale(1.0 / links[link].inertia.mass),
        radius: 0.05,
        part: BodyPart::Base,
    };
    let contacts = (0..=count).map(sphere).collect();
    RobotModel { name: "tree".to_owned(), links, joints, contacts, harness: None }
}

/// Any attitude, and velocities and joint positions of a moving robot.
pub(crate) fn shake(block: &mut Block<f64>, random: &mut Philox) {
    let turn = direction(random);
    let half = 0.5 * around(random, std::f32::consts::PI);
    let [x, y, z] = turn.scale(half.sin()).to_array();
    block.state.base_orientation = Quat { w: half.cos(), x, y, z };
    block.state.base_linear_velocity = vector(random, 1.0);
    block.state.base_angular_velocity = vector(random, 2.0);
    for q in &mut block.state.joint_position {
        *q = around(random, 0.5);
    }
    for qd in &mut block.state.joint_velocity {
        *qd = around(random, 2.0);
    }
}

/// Settings without servos.
pub(crate) fn passive(time_step: f64) -> Config {
    let mut config = Config { time_step, ..Config::default() };
    config.actuator.stiffness = 0.0;
    config.actuator.damping = 0.0;
    config
}

/// A robot far above the ground.
pub(crate) fn in_the_air(robot: RobotModel, config: Config) -> (Engine<f64>, Block<f64>) {
    let engine = Engine::new(robot, Arc::new(HeightField::flat(-1e3)), config);
    let block = Block::new(&engine);
    (engine, block)
}

/// Attitude and origin of every link in the world: kinematics written a second time.
pub(crate) fn poses(robot: &RobotModel, block: &Block<f64>) -> Vec<(Mat3<f64>, Vec3<f64>)> {
    let mut poses = vec![(block.state.base_orientation.to_matrix(), block.state.base_position)];
    for (joint, &q) in robot.joints.iter().zip(&block.state.joint_position) {
        let (r, p) = poses[joint.parent_link];
        let origin = r * joint.origin + p;
        poses.push(match joint.kind {
            JointKind::Revolute => (r * Mat3::from_axis_angle(joint.axis.to_array(), q), origin),
            JointKind::Prismatic => (r, origin + r * joint.axis.scale(q)),
        });
    }
    poses
}

/// Kinetic energy and potential energy above height 0 \[J\].
pub(crate) fn energy(engine: &Engine<f64>, block: &mut Block<f64>) -> f64 {
    let gravity = Vec3::splat(engine.config().gravity);
    let poses = poses(&engine.robot, block);
    let moment = |((r, p), link): (&(Mat3<f64>, Vec3<f64>), &Link)| {
        p.scale_add(link.inertia.mass, *r * link.inertia.moment)
    };
    let potential = -poses.iter().zip(&engine.robot.links).map(|pair| moment(pair).dot(gravity)).sum::<f64>();
    block.momentum_and_energy(engine).1 + potential
}

/// Centers of the contact spheres in the world \[m\].
pub(crate) fn centers(robot: &RobotModel, block: &Block<f64>) -> Vec<Vec3<f64>> {
    let poses = poses(robot, block);
    robot.contacts.iter().map(|sphere| poses[sphere.link].0 * sphere.center + poses[sphere.link].1).collect()
}
