//! Mechanics with known answers: free fall, a pendulum, a torque-free body, blocks on inclines, a drop.

#[path = "fixture/brick.rs"]
mod brick;
mod trees;

use std::sync::Arc;

use brick::brick;
use physics::{Block, Config, Engine};
use robot::{Joint, JointKind, Link, RobotModel};
use spatial::{Inertia, Quat, Vec3};
use terrain::HeightField;
use trees::passive;

const DT: f64 = 0.005;

fn body(name: &str, mass: f64, center: [f64; 3], about_center: [f64; 6]) -> Link {
    let inertia = Inertia::from_center_of_mass(mass, Vec3::splat(center), about_center);
    Link { name: name.to_owned(), inertia }
}

/// A base so heavy that it stands still for a pendulum of 1 kg on a massless 1 m rod.
fn pendulum() -> RobotModel {
    RobotModel {
        name: "pendulum".to_owned(),
        links: vec![
            body("base", 1e7, [0.0; 3], [1e7, 1e7, 1e7, 0.0, 0.0, 0.0]),
            body("bob", 1.0, [0.0, 0.0, -1.0], [0.0; 6]),
        ],
        joints: vec![Joint {
            name: "hinge".to_owned(),
            kind: JointKind::Revolute,
            parent_link: 0,
            origin: Vec3::zero(),
            axis: Vec3::splat([0.0, 1.0, 0.0]),
            position_limits: (f64::NEG_INFINITY, f64::INFINITY),
            effort_limit: 0.0,
            velocity_limit: 100.0,
            armature: 0.0,
        }],
        contacts: vec![],
        harness: None,
    }
}

fn engine(robot: RobotModel, ground: HeightField, config: Config) -> Engine<f64> {
    Engine::new(robot, Arc::new(ground), config)
}

/// Ground rising along x with the given gradient, through (0, 0, 0); one cell wide enough for any test.
fn incline(gradient: f32) -> HeightField {
    let half = 50.0;
    let (low, high) = (-half * gradient, half * gradient);
    HeightField {
        cell_size: 2.0 * half,
        origin: [-half, -half],
        columns: 1,
        rows: 1,
        cells: vec![[low, high, low, high]],
    }
}

#[test]
fn a_falling_body_falls_as_galileo_says() {
    let engine = engine(brick(), HeightField::flat(-100.0), Config::default());
    let mut block = Block::new(&engine);
    block.state.base_linear_velocity = Vec3::splat([1.0, 0.0, 0.0]);
    block.state.base_angular_velocity = Vec3::splat([0.0, 0.0, 3.0]);
    for _ in 0..200 {
        block.step(&engine);
    }
    // Semi-implicit Euler falls g t (t + dt) / 2; a straight flight although the body spins.
    let fall = 9.81 * 1.0 * (1.0 + DT) / 2.0;
    assert!((block.state.base_position.z + fall).abs() < 1e-9);
    assert!((block.state.base_position.x - 1.0).abs() < 1e-9);
    assert!(block.state.base_position.y.abs() < 1e-9);
}

#[test]
fn a_pendulum_swings_with_its_period() {
    let engine = engine(pendulum(), HeightField::flat(-100.0), passive(1e-3));
    let mut block = Block::new(&engine);
    block.state.joint_position[0] = 0.1;
    let mut crossings = Vec::new();
    let mut before = 0.1;
    for step in 0..10_000 {
        // Hold the base: gravity would take it along.
        block.state.base_linear_velocity = Vec3::zero();
        block.state.base_position = Vec3::zero();
        block.input.base_force = Vec3::splat([0.0, 0.0, 1e7 * 9.81]);
        block.step(&engine);
        let now = block.state.joint_position[0];
        if before < 0.0 && now >= 0.0 {
            crossings.push((step as f64 + before / (before - now)) * 1e-3);
        }
        before = now;
    }
    let periods = crossings.len() - 1;
    let measured = (crossings[periods] - crossings[0]) / periods as f64;
    let amplitude: f64 = 0.1;
    let expected = std::f64::consts::TAU * (1.0_f64 / 9.81).sqrt() * (1.0 + amplitude * amplitude / 16.0);
    assert!((measured / expected - 1.0).abs() < 1e-4, "period {measured} s, expected {expected} s");
}

#[test]
fn a_servo_is_stable_up_to_the_stiffness_that_its_step_allows() {
    // Inertia 1 kg m². With q' = q + dt v' and (I + dt kd) v' = I v - dt kp q, both roots are inside the unit circle while
    // dt² kp < 2 (2 I + dt kd).
    for damping in [1.0, 100.0] {
        let limit = 2.0 * (2.0 + DT * damping) / (DT * DT);
        let after = |stiffness: f64| {
            let mut config = Config { gravity: [0.0; 3], ..passive(DT) };
            (config.actuator.stiffness, config.actuator.damping) = (stiffness, damping);
            let engine = engine(pendulum(), HeightField::flat(-100.0), config);
            let mut block = Block::new(&engine);
            // So little that no torque reaches the motor's limit.
            block.state.joint_position[0] = 1e-9;
            (0..4000).for_each(|_| block.step(&engine));
            block.state.joint_velocity[0].abs()
        };
        let (below, above) = (after(0.99 * limit), after(1.01 * limit));
        assert!(below < 1e-9 && above > 1e-2, "damping {damping}: {below:e} and {above:e} rad/s");
    }
}

#[test]
fn a_torque_free_body_keeps_energy_and_angular_momentum() {
    let config = Config { gravity: [0.0; 3], ..passive(1e-4) };
    let engine = engine(brick(), HeightField::flat(-100.0), config);
    let mut block = Block::new(&engine);
    block.state.base_angular_velocity = Vec3::splat([0.1, 5.0, 0.1]);
    let inertia = engine.robot.links[0].inertia;
    let momentum = |block: &Block<f64>| {
        let spin = inertia.momentum(block.state.base_angular_velocity, Vec3::zero()).0;
        (block.state.base_orientation.to_matrix() * spin, spin.dot(block.state.base_angular_velocity))
    };
    let (spin, energy) = momentum(&block);
    for _ in 0..30_000 {
        block.step(&engine);
    }
    let (spin_after, energy_after) = momentum(&block);
    assert!((spin_after - spin).norm() / spin.norm() < 2e-3);
    assert!((energy_after / energy - 1.0).abs() < 2e-3);
}

/// Slides a brick that starts at rest on an incline; returns its speed down the slope after one second.
fn slide(gradient: f32, friction: f64) -> f64 {
    let engine = engine(brick(), incline(gradient), Config::default());
    let mut block = Block::new(&engine);
    let angle = f64::from(gradient).atan();
    block.state.base_orientation = Quat::from_roll_pitch_yaw(0.0, -angle, 0.0);
    block.state.base_position = Vec3::splat([-0.05 * angle.sin(), 0.0, 0.05 * angle.cos()]);
    block.parameters.friction = friction;
    for _ in 0..200 {
        block.step(&engine);
    }
    -block.state.base_linear_velocity.x
}

#[test]
fn a_block_on_an_incline_slides_only_beyond_the_friction_angle() {
    let gradient = 0.5_f32;
    let angle = f64::from(gradient).atan();
    assert!(slide(gradient, 0.55).abs() < 1e-6, "creeps at {} m/s", slide(gradient, 0.55));
    for friction in [0.2, 0.4, 0.45] {
        let expected = 9.81 * (angle.sin() - friction * angle.cos());
        let speed = slide(gradient, friction);
        assert!((speed / expected - 1.0).abs() < 0.01, "µ {friction}: {speed} m/s, expected {expected}");
    }
}

#[test]
fn a_dropped_brick_lands_without_a_bounce_and_carries_its_weight() {
    let engine = engine(brick(), HeightField::flat(0.0), Config::default());
    let mut block = Block::new(&engine);
    block.state.base_position.z = 0.40;
    let mut landed = false;
    for _ in 0..600 {
        block.step(&engine);
        landed |= block.state.base_position.z < 0.0505;
        assert!(
            !landed || block.state.base_position.z < 0.0515,
            "bounced to {}",
            block.state.base_position.z
        );
        assert!(block.state.base_position.z > 0.0495);
    }
    let weight: f64 = block.output.contact_force.iter().map(|f| f.z).sum();
    assert!((weight - 98.1).abs() < 1e-6, "carries {weight} N of 98.1 N");
    assert!(block.state.base_linear_velocity.norm() < 1e-9);
}
