//! Robots of many shapes on the ground: whatever hangs on what, they come to rest, the ground carries their weight, and
//! every joint is in balance.

mod trees;

use std::sync::Arc;

use physics::{Block, Config, Engine};
use robot::{JointKind, RobotModel, parse_urdf};
use spatial::{Quat, Vec3};
use terrain::HeightField;
use trees::poses;

const STEPS: usize = 2000;

/// Drops a robot from a height, servos holding `target`, and lets it come to rest.
fn drop(robot: RobotModel, height: f64, target: impl Fn(&str) -> f64) -> (Engine<f64>, Block<f64>) {
    let engine = Engine::<f64>::new(robot, Arc::new(HeightField::flat(0.0)), Config::default());
    let mut block = Block::new(&engine);
    block.state.base_position.z = height;
    block.state.base_orientation = Quat::from_roll_pitch_yaw(0.02, -0.03, 0.5);
    for (j, joint) in engine.robot.joints.iter().enumerate() {
        block.input.joint_target[j] = target(&joint.name);
        block.state.joint_position[j] = target(&joint.name);
    }
    (0..STEPS).for_each(|_| block.step(&engine));
    (engine, block)
}

/// What the ground's forces are worth at each joint: the virtual work of a unit motion \[N m or N\].
fn ground_torque(robot: &RobotModel, block: &Block<f64>) -> Vec<f64> {
    let poses = poses(robot, block);
    let mut torque = vec![0.0; robot.joints.len()];
    for (sphere, &force) in robot.contacts.iter().zip(&block.output.contact_force) {
        let (r, p) = poses[sphere.link];
        let point = r * sphere.center + p - Vec3::splat([0.0, 0.0, sphere.radius]);
        let mut link = sphere.link;
        while link > 0 {
            let joint = &robot.joints[link - 1];
            let (r, p) = poses[link];
            torque[link - 1] += match joint.kind {
                JointKind::Revolute => (r * joint.axis).dot((point - p).cross(force)),
                JointKind::Prismatic => (r * joint.axis).dot(force),
            };
            link = joint.parent_link;
        }
    }
    torque
}

#[track_caller]
fn assert_rests(engine: &Engine<f64>, block: &mut Block<f64>) {
    let name = &engine.robot.name;
    let speed = block.state.base_linear_velocity.norm() + block.state.base_angular_velocity.norm();
    let joints = block.state.joint_velocity.iter().fold(0.0_f64, |largest, rate| largest.max(rate.abs()));
    assert!(speed + joints < 1e-2, "{name}: still moves, base {speed:e}, joints {joints:e}");
    let weight = engine.robot.total_mass() * 9.81;
    let force = block.output.contact_force.iter().fold(Vec3::zero(), |sum, &force| sum + force);
    assert!(
        (force - Vec3::splat([0.0, 0.0, weight])).norm() < 5e-3 * weight,
        "{name}: {force:?}, {weight} N"
    );
    let (needed, ground) = (block.bias_force(engine), ground_torque(&engine.robot, block));
    for (j, joint) in engine.robot.joints.iter().enumerate() {
        let (lower, upper) = joint.position_limits;
        let q = block.state.joint_position[j];
        assert!(lower - 0.02 < q && q < upper + 0.02, "{name}: {} at {q}", joint.name);
        // A limit only ever pushes back.
        let limit = needed[6 + j] - block.output.joint_torque[j] - ground[j];
        let allowed = 2e-3 * weight;
        let pushes = if q < lower + 0.02 { limit > -allowed } else { limit < allowed };
        let balances = limit.abs() < allowed || q < lower + 0.02 || q > upper - 0.02;
        assert!(pushes && balances, "{name}: {} at {q} is out of balance by {limit}", joint.name);
    }
}

#[test]
fn quadrupeds_of_two_sizes_stand() {
    let small = parse_urdf(include_str!("../../robot/tests/robots/small_quadruped.urdf")).unwrap();
    let (engine, mut block) = drop(small, 0.4, |joint| match joint {
        joint if joint.ends_with("thigh_joint") => 0.75,
        joint if joint.ends_with("calf_joint") => -1.5,
        _ => 0.0,
    });
    assert_rests(&engine, &mut block);
    assert!(block.state.base_position.z > 0.25, "fell to {} m", block.state.base_position.z);
    let large = parse_urdf(include_str!("../../robot/tests/robots/large_quadruped.urdf")).unwrap();
    let (engine, mut block) = drop(large, 0.65, |joint| match joint {
        joint if joint.ends_with("HFE") => 0.4,
        joint if joint.ends_with("KFE") => -0.8,
        _ => 0.0,
    });
    assert_rests(&engine, &mut block);
    assert!(block.state.base_position.z > 0.45, "fell to {} m", block.state.base_position.z);
}

/// They are not told how to stand: they fall over and lie.
#[test]
fn a_biped_and_a_chain_come_to_lie() {
    let biped = parse_urdf(include_str!("../../robot/tests/robots/biped.urdf")).unwrap();
    let (engine, mut block) = drop(biped, 1.1, |joint| if joint.ends_with("knee") { 0.3 } else { 0.0 });
    assert_rests(&engine, &mut block);
    let chain = parse_urdf(include_str!("../../robot/tests/robots/chain.urdf")).unwrap();
    let (engine, mut block) = drop(chain, 1.6, |_| 0.1);
    assert_rests(&engine, &mut block);
}
