//! The equation of motion of ANYmal D with its harness: identities, then MuJoCo's numbers
//! (`scripts/reference/mint_forward_dynamics.py`).

use std::{collections::HashMap, sync::Arc};

use physics::{Block, Config, Engine};
use robot::{Harness, RobotModel, anymal_d, anymal_d_default_joint_position};
use spatial::{Lane, Vec3, f32x16};
use terrain::HeightField;

const GOLDEN: &str = include_str!("golden/forward_dynamics.txt");
const DOFS: usize = 18;

/// Numbers by name: what stands in the file before the first state, or one state.
type Record = HashMap<&'static str, Vec<f64>>;

fn golden() -> (Record, Vec<Record>) {
    let mut records = vec![Record::new()];
    for line in GOLDEN.lines().filter(|line| !line.starts_with('#')) {
        let (key, numbers) = line.split_once(' ').expect("a key and numbers");
        if key == "state" {
            records.push(Record::new());
        } else {
            let numbers = numbers.split(' ').map(|number| number.parse().expect("a number")).collect();
            records.last_mut().expect("a record").insert(key, numbers);
        }
    }
    let states = records.split_off(1);
    assert!(states.len() >= 256, "only {} states were read", states.len());
    (records.remove(0), states)
}

fn robot() -> RobotModel {
    anymal_d().with_harness(Harness::default()).unwrap()
}

fn engine<L: Lane>(config: Config) -> Engine<L> {
    Engine::new(robot(), Arc::new(HeightField::flat(-100.0)), config)
}

fn three(numbers: &[f64]) -> [f64; 3] {
    numbers.try_into().expect("three numbers")
}

/// Puts a state with its force at the hand into a lane, and its torques into the lane of `torque`.
fn load<L: Lane>(block: &mut Block<L>, torque: &mut [L], lane: usize, record: &Record) {
    let state = &mut block.state;
    let q: &[f64] = &record["base_orientation"];
    state.base_orientation.set(lane, q.try_into().expect("four numbers"));
    state.base_linear_velocity.set(lane, three(&record["base_linear_velocity"]));
    state.base_angular_velocity.set(lane, three(&record["base_angular_velocity"]));
    block.input.hand_force.set(lane, three(&record["hand_force"]));
    for (j, torque) in torque.iter_mut().enumerate() {
        state.joint_position[j].set(lane, record["joint_position"][j]);
        state.joint_velocity[j].set(lane, record["joint_velocity"][j]);
        torque.set(lane, record["joint_torque"][j]);
    }
}

/// Norm of the error over norm of what is expected.
fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut found.iter().zip(expected).map(|(a, b)| a - b)) / norm(&mut expected.iter().copied())
}

/// Calls `each` with every state and a block that holds it in the given lane.
fn for_each_state<L: Lane>(
    states: &[Record],
    mut each: impl FnMut(&Engine<L>, &mut Block<L>, &[L], usize, &Record),
) {
    let engine = engine(Config::default());
    let mut block = Block::new(&engine);
    let mut torque = vec![L::zero(); engine.num_joints()];
    for group in states.chunks(L::WIDTH) {
        for (lane, record) in group.iter().enumerate() {
            load(&mut block, &mut torque, lane, record);
        }
        for (lane, record) in group.iter().enumerate() {
            each(&engine, &mut block, &torque, lane, record);
        }
    }
}

fn lane_of<L: Lane>(values: &[L], lane: usize) -> Vec<f64> {
    values.iter().map(|value| value.get(lane)).collect()
}

#[test]
fn mass_times_acceleration_and_bias_are_the_applied_torques() {
    let (_, states) = golden();
    for_each_state::<f64>(&states, |engine, block, torque, _, record| {
        block.input.hand_force = Vec3::zero();
        let mass = block.mass_matrix(engine);
        let bias = block.bias_force(engine);
        let acceleration = block.forward_dynamics(engine, torque);
        let force: Vec<f64> = (0..DOFS)
            .map(|i| (0..DOFS).map(|k| mass[i * DOFS + k] * acceleration[k]).sum::<f64>() + bias[i])
            .collect();
        let applied = [&[0.0; 6][..], &record["joint_torque"]].concat();
        let error = relative_error(&force, &applied);
        assert!(error < 1e-12, "off by {error:e}");
    });
}

/// Ties the accelerations' meaning to the step: base velocities along turning axes change by v̇ − ω × v.
#[test]
fn a_short_step_in_the_air_follows_the_acceleration() {
    let mut config = Config { time_step: 1e-7, ..Config::default() };
    config.actuator.stiffness = 0.0;
    config.actuator.damping = 0.0;
    let (dt, engine) = (config.time_step, engine::<f64>(config));
    let mut block = Block::new(&engine);
    load(&mut block, &mut [0.0; 12], 0, &golden().1[0]);
    block.state.joint_position = anymal_d_default_joint_position().to_vec();
    let before = block.state.clone();
    let acceleration = block.forward_dynamics(&engine, &[0.0; 12]);
    block.step(&engine);
    let (v, w) = (before.base_linear_velocity, before.base_angular_velocity);
    let turning = w.cross(v).to_array();
    let change = [
        (block.state.base_angular_velocity - w).to_array(),
        (block.state.base_linear_velocity - v).to_array(),
    ];
    let joints = block.state.joint_velocity.iter().zip(&before.joint_velocity).map(|(a, b)| a - b);
    let rate: Vec<f64> = change.concat().into_iter().chain(joints).map(|change| change / dt).collect();
    let mut expected = acceleration;
    (0..3).for_each(|i| expected[3 + i] -= turning[i]);
    let error = relative_error(&rate, &expected);
    assert!(error < 1e-6, "off by {error:e}");
}

#[test]
fn masses_are_those_of_mujoco() {
    let (whole, _) = golden();
    let (robot, mass) = (robot(), whole["total_mass"][0]);
    assert!((robot.total_mass() / mass - 1.0).abs() < 1e-14, "{} kg, not {mass} kg", robot.total_mass());
    // Mass, first and second moment: bar and hand merged into the base.
    let base = &robot.links[0].inertia;
    let found = [&[base.mass][..], &base.moment.to_array(), &base.rotational].concat();
    for (found, expected) in found.iter().zip(&whole["base_inertia"]) {
        assert!((found - expected).abs() < 1e-14 * mass, "{found}, not {expected}");
    }
}

#[test]
fn mass_matrix_and_bias_force_are_those_of_mujoco() {
    let (_, states) = golden();
    let with_matrix: Vec<_> = states.into_iter().filter(|state| state.contains_key("mass_matrix")).collect();
    assert!(!with_matrix.is_empty());
    fn compare<L: Lane>(states: &[Record], allowed: f64) {
        for_each_state::<L>(states, |engine, block, _, lane, record| {
            let mass = lane_of(&block.mass_matrix(engine), lane);
            let lower: Vec<f64> = (0..DOFS).flat_map(|i| mass[i * DOFS..=i * DOFS + i].to_vec()).collect();
            let error = relative_error(&lower, &record["mass_matrix"]);
            assert!(error < allowed, "mass matrix off by {error:e}");
            let error = relative_error(&lane_of(&block.bias_force(engine), lane), &record["bias_force"]);
            assert!(error < allowed, "bias force off by {error:e}");
        });
    }
    compare::<f64>(&with_matrix, 1e-13);
    compare::<f32x16>(&with_matrix, 1e-6);
}

/// Largest relative errors over all states: of all eighteen accelerations together, of the base's angular and of its
/// linear one.
fn largest_errors<L: Lane>() -> [f64; 3] {
    let mut largest = [0.0_f64; 3];
    for_each_state::<L>(&golden().1, |engine, block, torque, lane, record| {
        let found = lane_of(&block.forward_dynamics(engine, torque), lane);
        let expected = &record["acceleration"];
        for (largest, part) in largest.iter_mut().zip([0..DOFS, 0..3, 3..6]) {
            *largest = largest.max(relative_error(&found[part.clone()], &expected[part]));
        }
    });
    largest
}

#[test]
fn accelerations_are_those_of_mujoco() {
    // Measured: 5.6e-15, 3.8e-14, 1.1e-14.
    let [all, angular, linear] = largest_errors::<f64>();
    assert!(all < 1e-13 && angular < 1e-12 && linear < 1e-12, "off by {all:e}, {angular:e}, {linear:e}");
}

#[test]
fn single_precision_lanes_agree_with_mujoco() {
    // Measured: 6.1e-7, 3.3e-6, 2.2e-6; without fused multiply-add 6.3e-7, 5.3e-6, 2.8e-6. Rounding the model and the
    // attitude alone costs 4e-8 of all. The base's own errors are large where its acceleration is small: the worst are
    // at about 1 % of the joints' and a tenth of the base's usual acceleration.
    let [all, angular, linear] = largest_errors::<f32x16>();
    assert!(all < 1e-6 && angular < 1e-5 && linear < 1e-5, "off by {all:e}, {angular:e}, {linear:e}");
}
