//! Joint limits: a joint that is driven into one stops there, and what stops it is an inner force.

use std::sync::Arc;

use physics::{Block, Config, Engine};
use robot::{Joint, JointKind, Link, RobotModel};
use spatial::{Inertia, Vec3};
use terrain::HeightField;

const LIMIT: f64 = 0.3;

/// A base of 3 kg and an arm of 1 kg on a joint about z, or along x, that ends at ±[`LIMIT`].
fn arm(kind: JointKind) -> RobotModel {
    let link = |name: &str, mass: f64, center: [f64; 3]| {
        let inertia =
            Inertia::from_center_of_mass(mass, Vec3::splat(center), [0.02, 0.02, 0.03, 0.0, 0.0, 0.0]);
        Link { name: name.to_owned(), inertia }
    };
    let axis = if kind == JointKind::Revolute { [0.0, 0.0, 1.0] } else { [1.0, 0.0, 0.0] };
    let joint = Joint {
        name: "joint".to_owned(),
        kind,
        parent_link: 0,
        origin: Vec3::splat([0.1, 0.0, 0.0]),
        axis: Vec3::splat(axis),
        position_limits: (-LIMIT, LIMIT),
        effort_limit: 80.0,
        velocity_limit: 100.0,
        armature: 0.0,
    };
    RobotModel {
        name: "arm".to_owned(),
        links: vec![link("base", 3.0, [0.0; 3]), link("arm", 1.0, [0.2, 0.0, 0.0])],
        joints: vec![joint],
        contacts: vec![],
        harness: None,
    }
}

/// The robot in free space, its servo with the given gains.
fn free(robot: RobotModel, [stiffness, damping]: [f64; 2]) -> (Engine<f64>, Block<f64>) {
    let mut config = Config { gravity: [0.0; 3], ..Config::default() };
    config.actuator.stiffness = stiffness;
    config.actuator.damping = damping;
    let engine = Engine::new(robot, Arc::new(HeightField::flat(-100.0)), config);
    let block = Block::new(&engine);
    (engine, block)
}

#[test]
fn a_joint_driven_into_its_limit_stops_there_with_the_momentum_it_had() {
    for (kind, target) in [
        (JointKind::Revolute, 2.0),
        (JointKind::Revolute, -2.0),
        (JointKind::Prismatic, 2.0),
        (JointKind::Prismatic, -2.0),
    ] {
        let (engine, mut block) = free(arm(kind), [2.0, 0.0]);
        block.input.joint_target[0] = target;
        let mut furthest = 0.0_f64;
        for _ in 0..400 {
            block.step(&engine);
            furthest = furthest.max(block.state.joint_position[0].abs());
        }
        assert!(furthest < LIMIT + 1e-9, "{kind:?} went on to {furthest}");
        assert!((block.state.joint_position[0] - LIMIT * f64::signum(target)).abs() < 1e-6);
        assert!(block.state.joint_velocity[0].abs() < 1e-9, "{kind:?} does not rest");
        // The servo still drives; the limit takes that up inside the robot, which as a whole does not turn or move
        // (but for the drift of a first-order step on the way).
        assert!((block.output.joint_torque[0].abs() - 2.0 * (2.0 - LIMIT)).abs() < 1e-6);
        let ([angular, linear], energy) = block.momentum_and_energy(&engine);
        assert!(angular.norm() < 5e-4 && linear.norm() < 5e-4, "{kind:?}: {angular:?} {linear:?}");
        assert!(energy < 1e-6, "{kind:?} is left with {energy} J");
    }
}

#[test]
fn a_limit_carries_what_hangs_on_it() {
    // The base is pulled; the arm, at its lower limit, must be pulled along as one body.
    let (engine, mut block) = free(arm(JointKind::Prismatic), [0.0, 0.0]);
    block.state.joint_position[0] = -LIMIT;
    block.input.base_force = Vec3::splat([8.0, 0.0, 0.0]);
    for count in 1..=100 {
        block.step(&engine);
        let speed = block.state.base_linear_velocity.x;
        let expected = 8.0 / 4.0 * 0.005 * f64::from(count);
        assert!((speed - expected).abs() < 1e-9, "{speed} m/s after {count} steps, expected {expected}");
        assert!((block.state.joint_position[0] + LIMIT).abs() < 1e-9);
    }
}

#[test]
fn a_joint_thrown_into_its_limit_loses_energy_and_never_gains_any() {
    for kind in [JointKind::Revolute, JointKind::Prismatic] {
        for speed in [0.5, 3.0, 7.5, 9.9, 30.0] {
            let (engine, mut block) = free(arm(kind), [0.0, 0.0]);
            block.state.joint_velocity[0] = speed;
            // Up to 10 rad/s the limit is seen a step ahead; beyond, a step may end behind it.
            let beyond = (speed * engine.config.time_step - 0.05).max(1e-9);
            let mut energy = block.momentum_and_energy(&engine).1;
            for _ in 0..200 {
                block.step(&engine);
                let after = block.momentum_and_energy(&engine).1;
                assert!(after < 1.002 * energy, "{kind:?} at {speed}: {energy} J became {after} J");
                assert!(block.state.joint_position[0].abs() < LIMIT + beyond);
                energy = after;
            }
            // A sliding arm takes the base along: a quarter of the energy is left in the common motion.
            if kind == JointKind::Prismatic && speed < 10.0 {
                assert!((energy / (speed * speed / 8.0) - 1.0).abs() < 1e-6, "at {speed}: {energy} J");
            }
        }
    }
}

#[test]
fn a_joint_with_one_finite_limit_stops_there() {
    let mut robot = arm(JointKind::Prismatic);
    robot.joints[0].position_limits = (f64::NEG_INFINITY, LIMIT);
    let (engine, mut block) = free(robot, [0.0, 0.0]);
    block.state.joint_velocity[0] = 2.0;
    (0..200).for_each(|_| block.step(&engine));
    assert!((block.state.joint_position[0] - LIMIT).abs() < 1e-6, "at {}", block.state.joint_position[0]);
}
