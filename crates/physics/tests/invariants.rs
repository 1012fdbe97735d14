//! What holds for any robot: equations of motion and conserved quantities of random trees of joints.

mod trees;

use spatial::Vec3;
use trees::{energy, in_the_air, passive, shake, stream, tree, vector};

const TREES: usize = 60;

/// Smallest pivot of a Cholesky factorization, row by row, over the largest entry; not above 0 if there is none.
fn smallest_pivot(mut matrix: Vec<f64>, size: usize) -> f64 {
    let largest = matrix.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
    let mut smallest = f64::INFINITY;
    for k in 0..size {
        let pivot = matrix[k * size + k];
        smallest = smallest.min(pivot);
        for i in k + 1..size {
            let ratio = matrix[i * size + k] / pivot;
            for j in k..size {
                matrix[i * size + j] -= ratio * matrix[k * size + j];
            }
        }
    }
    smallest / largest
}

fn times(matrix: &[f64], v: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(v.len()).map(|row| row.iter().zip(v).map(|(a, b)| a * b).sum()).collect()
}

#[test]
fn the_mass_matrix_is_positive_definite_and_gives_the_kinetic_energy() {
    for case in 0..TREES {
        let mut random = stream(case);
        let (engine, mut block) = in_the_air(tree(&mut random), passive(1e-3));
        shake(&mut block, &mut random);
        let size = engine.num_dofs();
        let matrix = block.mass_matrix(&engine);
        let pivot = smallest_pivot(matrix.clone(), size);
        assert!(pivot > 1e-6, "case {case}: pivot {pivot:e}");
        let state = &block.state;
        let mut v = state.base_angular_velocity.to_array().to_vec();
        v.extend(state.base_linear_velocity.to_array());
        v.extend(&state.joint_velocity);
        let twice: f64 = times(&matrix, &v).iter().zip(&v).map(|(p, v)| p * v).sum();
        let expected = 2.0 * block.momentum_and_energy(&engine).1;
        assert!((twice / expected - 1.0).abs() < 1e-12, "case {case}: {twice} and {expected}");
    }
}

/// Of the equation's solution alone: mass matrix and bias force are ours on both sides.
#[test]
fn the_factor_solves_mass_times_acceleration_for_applied_minus_bias() {
    let mut worst = 0.0_f64;
    for case in 0..TREES {
        let mut random = stream(case);
        let (engine, mut block) = in_the_air(tree(&mut random), passive(1e-3));
        shake(&mut block, &mut random);
        block.parameters.hand_position = vector(&mut random, 1.0);
        block.input.hand_force = vector(&mut random, 50.0);
        block.input.base_force = vector(&mut random, 50.0);
        let torque: Vec<_> = (0..engine.num_joints()).map(|_| vector(&mut random, 20.0).x).collect();
        let acceleration = block.forward_dynamics(&engine, &torque);

        // Forces are given in the heading frame: turned by the yaw alone.
        let (sin, cos) = block.state.base_orientation.yaw().sin_cos();
        let r_wb = block.state.base_orientation.to_matrix();
        let in_base = |f: Vec3<f64>| {
            r_wb.transpose_mul(Vec3::splat([cos * f.x - sin * f.y, sin * f.x + cos * f.y, f.z]))
        };
        let (hand, base) = (in_base(block.input.hand_force), in_base(block.input.base_force));
        let mut applied = block.parameters.hand_position.cross(hand).to_array().to_vec();
        applied.extend((hand + base).to_array());
        applied.extend(&torque);

        let needed = times(&block.mass_matrix(&engine), &acceleration);
        let bias = block.bias_force(&engine);
        let size = applied.iter().chain(&bias).fold(0.0_f64, |most, f| most.max(f.abs()));
        for ((needed, bias), applied) in needed.iter().zip(&bias).zip(&applied) {
            worst = worst.max((needed + bias - applied).abs() / size);
        }
    }
    assert!(worst < 1e-11, "off by {worst:e} of the largest force");
}

/// How far energy, angular and linear momentum get in 0.25 s without contact, relative to what there is: the worst of all
/// trees.
fn drift(time_step: f64, gravity: f64) -> [f64; 3] {
    let mut worst = [0.0_f64; 3];
    for case in 0..TREES {
        let mut random = stream(case);
        let mut config = passive(time_step);
        config.gravity = [0.0, 0.0, -gravity];
        let (engine, mut block) = in_the_air(tree(&mut random), config);
        shake(&mut block, &mut random);
        let ([angular, linear], kinetic) = block.momentum_and_energy(&engine);
        let before = energy(&engine, &mut block);
        for _ in 0..(0.25 / time_step).round() as usize {
            block.step(&engine);
        }
        let ([angular_after, linear_after], _) = block.momentum_and_energy(&engine);
        let drifts = [
            (energy(&engine, &mut block) - before).abs() / kinetic,
            (angular_after - angular).norm() / angular.norm(),
            (linear_after - linear).norm() / linear.norm(),
        ];
        for (worst, drift) in worst.iter_mut().zip(drifts) {
            *worst = worst.max(drift);
        }
    }
    worst
}

/// Asserts that a drift is below `most` at 1 ms, and a quarter as large at 0.25 ms: the integrator is of first order.
#[track_caller]
fn assert_first_order(what: &str, coarse: f64, fine: f64, most: f64) {
    assert!(coarse < most, "{what}: {coarse:e} at 1 ms, not below {most:e}");
    assert!((0.2..0.3).contains(&(fine / coarse)), "{what}: {coarse:e} at 1 ms, {fine:e} at 0.25 ms");
}

/// Measured at 1 ms: 5.6e-3, 4.5e-3 and 3.0e-3, falling 6.3e-2.
#[test]
fn energy_and_momentum_are_kept_ever_better_by_shorter_steps() {
    let (coarse, fine) = (drift(1e-3, 0.0), drift(2.5e-4, 0.0));
    for (i, (what, most)) in
        [("energy", 6e-3), ("angular momentum", 5e-3), ("linear momentum", 3.3e-3)].into_iter().enumerate()
    {
        assert_first_order(what, coarse[i], fine[i], most);
    }
    assert_first_order("energy, falling", drift(1e-3, 9.81)[0], drift(2.5e-4, 9.81)[0], 7e-2);
}
