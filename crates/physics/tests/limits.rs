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
fn free(robot: RobotModel, gains: [f64; 2]) -> (Engine<f64>, Block<f64>) {
    free_in_steps_of(Config::default().time_step, robot, gains)
}

fn free_in_steps_of(
    time_step: f64,
    robot: RobotModel,
    [stiffness, damping]: [f64; 2],
) -> (Engine<f64>, Block<f64>) {
    let mut config = Config { time_step, gravity: [0.0; 3], ..Config::default() };
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

/// Kinetic energy of an arm that has stopped at ±[`LIMIT`] \[J\]: the robot moves as one body, with the momentum it has.
fn energy_as_one_body([angular, linear]: [Vec3<f64>; 2]) -> f64 {
    // About the common center of mass 3 kg and 1 kg are 3/4 kg at the distance of their centers.
    let (x, y) = (0.1 + 0.2 * LIMIT.cos(), 0.2 * LIMIT.sin());
    let inertia = 0.03 + 0.03 + 0.75 * (x * x + y * y);
    linear.dot(linear) / (2.0 * 4.0) + angular.z * angular.z / (2.0 * inertia)
}

#[test]
fn a_joint_thrown_into_its_limit_loses_what_an_inelastic_stop_takes_and_gains_nothing() {
    for kind in [JointKind::Revolute, JointKind::Prismatic] {
        for (time_step, speed) in
            [5e-3, 1e-3].into_iter().flat_map(|dt| [0.5, 3.0, 7.5, 9.9, 30.0].map(|v| (dt, v)))
        {
            let (engine, mut block) = free_in_steps_of(time_step, arm(kind), [0.0, 0.0]);
            block.state.joint_velocity[0] = speed;
            // At 5 ms the limit is seen a step ahead up to 10 rad/s; beyond, a step may end behind it.
            let beyond = (speed * time_step - 0.05).max(1e-9);
            let (momentum, start) = block.momentum_and_energy(&engine);
            let mut energy = start;
            for _ in 0..(1.0 / time_step).round() as usize {
                block.step(&engine);
                energy = block.momentum_and_energy(&engine).1;
                assert!(energy < (1.0 + 1e-12) * start, "{kind:?} at {speed}: {start} J became {energy} J");
                assert!(block.state.joint_position[0].abs() < LIMIT + beyond);
            }
            // What swings or turns is off by a share of what it turns by in a step, measured 0.28; what slides is not.
            let allowed = if kind == JointKind::Revolute { 0.3 * speed * time_step } else { 1e-11 };
            let off = energy / energy_as_one_body(momentum) - 1.0;
            assert!(
                beyond > 1e-9 || off.abs() < allowed,
                "{kind:?} at {speed}, {time_step} s: off by {off:e}"
            );
        }
    }
}

#[test]
fn of_two_limits_near_each_other_the_farther_is_seen_from_the_middle_on() {
    let travel = 0.04;
    let overshoot = |speed: f64| {
        let mut robot = arm(JointKind::Prismatic);
        robot.joints[0].position_limits = (0.0, travel);
        let (engine, at_rest) = free(robot, [0.0, 0.0]);
        let mut furthest = 0.0_f64;
        for start in 0..20 {
            let mut block = at_rest.clone();
            block.state.joint_position[0] = 1e-3 * f64::from(start);
            block.state.joint_velocity[0] = speed;
            for _ in 0..20 {
                block.step(&engine);
                furthest = furthest.max(block.state.joint_position[0]);
            }
        }
        furthest - travel
    };
    // Up to 100 R per second nothing gets past it, beyond by up to speed · 5 ms - R / 2.
    assert!(overshoot(3.9) < 1e-9, "{:e} m past the limit", overshoot(3.9));
    let most = 6.0 * 5e-3 - 0.5 * travel;
    assert!((0.8 * most..most).contains(&overshoot(6.0)), "{:e} m past the limit", overshoot(6.0));
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

/// A servo follows the line it begins a step on ([`physics::Actuator::effort_limit`], 80 N m) wherever the step ends.
#[test]
fn a_servo_whose_joint_is_turned_around_in_a_step_gives_more_than_its_motor_can() {
    let (beyond, thrown_back) = (0.1, -4.0);
    // On the motor's slope 120 N m − 16 N m s/rad · q̇, more than the stall torque; in the PD law 76 − 2 q̇.
    for (speed, spring, expected) in [(5.0, 800.0, 184.0), (1.0, 76.0, 84.0)] {
        let (engine, mut block) = free(arm(JointKind::Revolute), [80.0, 2.0]);
        block.state.joint_position[0] = LIMIT + beyond;
        block.state.joint_velocity[0] = speed;
        block.input.joint_target[0] = LIMIT + beyond + spring / 80.0;
        block.step(&engine);
        // The limit corrects a fifth of what the joint is beyond it, in 5 ms.
        let [rate, torque] = [block.state.joint_velocity[0], block.output.joint_torque[0]];
        assert!((rate - thrown_back).abs() < 1e-9, "from {speed} to {rate} rad/s");
        assert!((torque - expected).abs() < 1e-6, "{torque} N m, not {expected}");
    }
}
