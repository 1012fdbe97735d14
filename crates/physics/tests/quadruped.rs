//! A whole robot: it stands, carries its weight, and sixteen lanes do what sixteen scalars do.

mod fixture;

use std::sync::Arc;

use fixture::{STANCE, quadruped};
use physics::{Block, Config, Engine};
use robot::{BodyPart, Harness, anymal_d};
use spatial::{Lane, Philox, Purpose, Quat, Vec3, f32x16};
use terrain::HeightField;

fn engine<L: Lane>(ground: HeightField) -> Engine<L> {
    Engine::new(quadruped(), Arc::new(ground), Config::default())
}

fn stand<L: Lane>(engine: &Engine<L>) -> Block<L> {
    let mut block = Block::new(engine);
    block.state.base_position = Vec3::splat([0.0, 0.0, 0.6]);
    for (j, q) in STANCE.into_iter().enumerate() {
        block.state.joint_position[j] = L::splat(q);
        block.input.joint_target[j] = L::splat(q);
    }
    block
}

#[test]
fn a_standing_robot_carries_its_weight_and_does_not_drift() {
    let engine = engine::<f64>(HeightField::flat(0.0));
    let mut block = stand(&engine);
    for _ in 0..2000 {
        block.step(&engine);
    }
    let before = block.state.base_position;
    for _ in 0..2000 {
        block.step(&engine);
    }
    let weight = 9.81 * engine.robot.links.iter().map(|link| link.inertia.mass).sum::<f64>();
    let carried: f64 = block.output.contact_force.iter().map(|f| f.z).sum();
    assert!((carried / weight - 1.0).abs() < 1e-6, "feet carry {carried} N of {weight} N");
    assert!(block.state.base_position.z > 0.4);
    assert!((block.state.base_position - before).norm() < 1e-6);
}

#[test]
fn a_pull_at_the_hand_is_taken_up_by_the_feet() {
    let engine = engine::<f64>(HeightField::flat(0.0));
    let mut block = stand(&engine);
    block.parameters.hand_position = Vec3::splat([-1.2, 0.0, 0.3]);
    block.input.hand_force = Vec3::splat([-20.0, 5.0, 0.0]);
    for _ in 0..2000 {
        block.step(&engine);
    }
    let sum = block.output.contact_force.iter().fold(Vec3::zero(), |sum, f| sum + *f);
    // The pull turns with the heading; the yielding robot has yawed a little.
    let (sin, cos) = block.state.base_orientation.yaw().sin_cos();
    let expected = Vec3::splat([20.0 * cos + 5.0 * sin, 20.0 * sin - 5.0 * cos, sum.z]);
    assert!((sum - expected).norm() < 0.02, "feet push with {sum:?} against {expected:?}");
}

#[test]
fn the_hand_pulls_where_the_harness_has_it_with_or_without_a_sphere() {
    let position = |robot| {
        let ground = Arc::new(HeightField::flat(0.0));
        Engine::<f64>::new(robot, ground, Config::default()).nominal_parameters().hand_position
    };
    let mut robot = anymal_d().with_harness(Harness::default()).unwrap();
    let sphere = robot.contacts[robot.contacts_of(BodyPart::Hand)[0]].center;
    assert_eq!(position(robot.clone()), sphere);
    robot.contacts.retain(|sphere| sphere.part != BodyPart::Hand);
    assert_eq!(position(robot), sphere);
    assert_eq!(position(anymal_d()), Vec3::zero());
}

#[test]
fn moving_joints_without_contact_conserve_momentum() {
    let mut config = Config { gravity: [0.0; 3], time_step: 1e-4, ..Config::default() };
    config.actuator.stiffness = 0.0;
    config.actuator.damping = 0.0;
    let mut robot = quadruped();
    for joint in &mut robot.joints {
        joint.armature = 0.0;
        joint.position_limits = (f64::NEG_INFINITY, f64::INFINITY);
    }
    let engine = Engine::<f64>::new(robot, Arc::new(HeightField::flat(-100.0)), config);
    let mut block = stand(&engine);
    for (j, rate) in block.state.joint_velocity.iter_mut().enumerate() {
        *rate = 2.0 - 0.3 * j as f64;
    }
    let (momentum, energy) = block.momentum_and_energy(&engine);
    for _ in 0..5000 {
        block.step(&engine);
    }
    let (momentum_after, energy_after) = block.momentum_and_energy(&engine);
    for (a, b) in momentum.iter().zip(momentum_after) {
        assert!((*a - b).norm() < 2e-3 * (1.0 + a.norm()), "{a:?} became {b:?}");
    }
    assert!((energy_after / energy - 1.0).abs() < 2e-3, "energy {energy} became {energy_after}");
}

/// Random states in sixteen lanes, stepped a few times as lanes and one by one.
#[test]
fn lanes_do_what_the_scalar_reference_does() {
    let ground = || HeightField {
        cell_size: 0.1,
        origin: [-2.0, -2.0],
        columns: 40,
        rows: 40,
        cells: (0..1600).map(|i| [if (i / 3) % 7 == 0 { 0.05 } else { 0.0 }; 4]).collect(),
    };
    let lanes = engine::<f32x16>(ground());
    let scalar = engine::<f64>(ground());
    let mut block = stand(&lanes);
    let mut singles: Vec<Block<f64>> = (0..16).map(|_| stand(&scalar)).collect();
    for (lane, single) in singles.iter_mut().enumerate() {
        let mut random = Philox::new(5, lane, 0, 0, Purpose::Evaluation);
        let mut draw = |width: f32| f64::from(random.uniform(-width, width));
        let attitude = Quat::from_roll_pitch_yaw(draw(0.2), draw(0.2), draw(3.0));
        let q = [attitude.w, attitude.x, attitude.y, attitude.z].map(|x| f64::from(x as f32));
        single.state.base_orientation.set(0, q);
        block.state.base_orientation.set(lane, q);
        let position = [draw(1.0), draw(1.0), 0.62 + draw(0.02)].map(|x| f64::from(x as f32));
        single.state.base_position = Vec3::splat(position);
        block.state.base_position.set(lane, position);
        for j in 0..12 {
            let rate = draw(2.0);
            single.state.joint_velocity[j] = rate;
            block.state.joint_velocity[j].set(lane, rate);
        }
    }
    for _ in 0..4 {
        block.step(&lanes);
        for single in &mut singles {
            single.step(&scalar);
        }
    }
    for (lane, single) in singles.iter().enumerate() {
        for j in 0..12 {
            let (a, b) = (block.state.joint_velocity[j].get(lane), single.state.joint_velocity[j]);
            assert!((a - b).abs() < 2e-3 * (1.0 + b.abs()), "lane {lane} joint {j}: {a} and {b}");
        }
        let a = Vec3::<f64>::splat(block.state.base_position.get(lane));
        assert!((a - single.state.base_position).norm() < 1e-5);
    }
}

/// What one lane does must not depend on who shares the block.
#[test]
fn a_lane_does_not_notice_its_neighbors() {
    let engine = engine::<f32x16>(HeightField::flat(0.0));
    let mut alone = stand(&engine);
    let mut crowd = stand(&engine);
    for lane in 1..16 {
        crowd.state.base_position.set(lane, [0.0, 0.0, 0.05 * lane as f64]);
        crowd.state.base_orientation.set(lane, [0.9, 0.1 * lane as f64, 0.2, 0.0]);
    }
    for _ in 0..200 {
        alone.step(&engine);
        crowd.step(&engine);
    }
    assert_eq!(alone.state.base_position.get(0), crowd.state.base_position.get(0));
    for j in 0..12 {
        assert_eq!(alone.state.joint_velocity[j].get(0), crowd.state.joint_velocity[j].get(0));
    }
}
