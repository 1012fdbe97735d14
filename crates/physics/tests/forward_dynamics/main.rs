//! The equation of motion of robots of many shapes: identities, then MuJoCo's numbers
//! (`scripts/reference/mint_forward_dynamics.py`).

mod golden;

use golden::Golden;
use physics::{Block, Config};
use spatial::{Lane, Vec3, f32x16};

/// Norm of the error over norm of what is expected.
fn relative_error(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|x| x * x).sum::<f64>().sqrt();
    norm(&mut found.iter().zip(expected).map(|(a, b)| a - b)) / norm(&mut expected.iter().copied())
}

fn lane_of<L: Lane>(values: &[L], lane: usize) -> Vec<f64> {
    values.iter().map(|value| value.get(lane)).collect()
}

/// A full matrix times a vector.
fn product(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    let dot = |row: &[f64]| row.iter().zip(vector).map(|(a, b)| a * b).sum();
    matrix.chunks(vector.len()).map(dot).collect()
}

/// Of the equation's solution by the factor alone: mass matrix and bias force are ours on both sides, and are held
/// against MuJoCo's below.
#[test]
fn the_acceleration_solves_the_equation_of_motion() {
    for golden in golden::all() {
        golden.for_each_block::<f64>(|engine, block, torque, _| {
            block.input.hand_force = Vec3::zero();
            let acceleration = block.forward_dynamics(engine, torque);
            let mut force = product(&block.mass_matrix(engine), &acceleration);
            force.iter_mut().zip(block.bias_force(engine)).for_each(|(force, bias)| *force += bias);
            let error = relative_error(&force, &[&[0.0; 6][..], torque].concat());
            assert!(error < 1e-11, "{}: off by {error:e}", golden.name);
        });
    }
}

/// Ties the accelerations' meaning to the step: base velocities along turning axes change by v̇ − ω × v.
#[test]
fn a_short_step_in_the_air_follows_the_acceleration() {
    for golden in golden::all() {
        let mut config = Config { time_step: 1e-7, ..Config::default() };
        config.actuator.stiffness = 0.0;
        config.actuator.damping = 0.0;
        let (dt, engine) = (config.time_step, golden.engine::<f64>(config));
        let mut block = Block::new(&engine);
        let mut none = vec![0.0; engine.num_joints()];
        golden.load(&mut block, &mut none, 0, 0);
        none.fill(0.0);
        // Away from the limits, which would push.
        for (position, joint) in block.state.joint_position.iter_mut().zip(&golden.robot.joints) {
            let (lower, upper) = joint.position_limits;
            *position = if lower.is_finite() { 0.4 * lower + 0.6 * upper } else { 1.0 };
        }
        let before = block.state.clone();
        let mut expected = block.forward_dynamics(&engine, &none);
        block.step(&engine);
        let (v, w) = (before.base_linear_velocity, before.base_angular_velocity);
        let turning = w.cross(v).to_array();
        (0..3).for_each(|i| expected[3 + i] -= turning[i]);
        let change = [
            (block.state.base_angular_velocity - w).to_array(),
            (block.state.base_linear_velocity - v).to_array(),
        ];
        let joints = block.state.joint_velocity.iter().zip(&before.joint_velocity).map(|(a, b)| a - b);
        let rate: Vec<f64> = change.concat().into_iter().chain(joints).map(|change| change / dt).collect();
        let error = relative_error(&rate, &expected);
        assert!(error < 1e-6, "{}: off by {error:e}", golden.name);
    }
}

#[test]
fn masses_are_those_of_mujoco() {
    for golden in golden::all() {
        let (robot, mass) = (&golden.robot, golden.whole("total_mass")[0]);
        assert!((robot.total_mass() / mass - 1.0).abs() < 1e-14, "{}: not {mass} kg", golden.name);
        // Mass, first and second moment: what is fixed to the base merged into it.
        let base = &robot.links[0].inertia;
        let found = [&[base.mass][..], &base.moment.to_array(), &base.rotational].concat();
        for (found, expected) in found.iter().zip(golden.whole("base_inertia")) {
            assert!((found - expected).abs() < 1e-14 * mass, "{}: {found}, not {expected}", golden.name);
        }
        let block = Block::<f64>::new(&golden.engine(Config::default()));
        let off = block.parameters.hand_position - Vec3::splat(golden.fixed("force_point", 0));
        assert!(off.norm() < 1e-15, "{}: the force acts {off:?} m from where MuJoCo's does", golden.name);
    }
}

/// Largest relative errors over all states: of mass matrix times vector, bias force, acceleration, and of the base's
/// part of the acceleration by itself.
fn largest_errors<L: Lane>(golden: &Golden) -> [f64; 4] {
    let mut largest = [0.0_f64; 4];
    golden.for_each_block::<L>(|engine, block, torque, states| {
        let mass = block.mass_matrix(engine);
        let bias = block.bias_force(engine);
        let acceleration = block.forward_dynamics(engine, torque);
        for (lane, state) in states.enumerate() {
            let expected = golden.row("acceleration", state);
            let found = lane_of(&acceleration, lane);
            let moved = product(&lane_of(&mass, lane), golden.row("vector", state));
            let errors = [
                relative_error(&moved, golden.row("mass_times_vector", state)),
                relative_error(&lane_of(&bias, lane), golden.row("bias_force", state)),
                relative_error(&found, expected),
                relative_error(&found[..6], &expected[..6]),
            ];
            for (largest, error) in largest.iter_mut().zip(errors) {
                assert!(error.is_finite(), "{}: state {state} gives {error}", golden.name);
                *largest = largest.max(error);
            }
        }
    });
    largest
}

/// Prints a row for `docs/physics.md` and holds every error against what is allowed.
fn hold<L: Lane>(golden: &Golden, allowed: [f64; 4]) {
    let errors = largest_errors::<L>(golden);
    let text = |numbers: [f64; 4]| numbers.map(|number| format!("{number:.1e}")).join(" | ");
    println!("| {} | {} | {} | {} |", golden.name, 6 + golden.robot.joints.len(), L::WIDTH, text(errors));
    let within = errors.iter().zip(allowed).all(|(error, allowed)| *error <= allowed);
    assert!(within, "{}: off by {}, allowed {}", golden.name, text(errors), text(allowed));
}

#[test]
fn double_precision_agrees_with_mujoco() {
    for golden in golden::all() {
        hold::<f64>(&golden, [1e-12; 4]);
    }
}

/// The base's own errors are large where its acceleration is small beside the joints'. The chain amplifies rounding most:
/// much of its weight swings on the base, and the mass matrix is the worse conditioned for it.
#[test]
fn single_precision_lanes_agree_with_mujoco() {
    for golden in golden::all() {
        let [all, base] = if golden.name == "anymal_d" { [1e-6, 1e-5] } else { [1e-5, 4e-5] };
        hold::<f32x16>(&golden, [1e-6, 2e-6, all, base]);
    }
}
