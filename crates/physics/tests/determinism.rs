//! The same bits for any number of threads, any place of a robot among the lanes and whoever shares its block.

mod fixture;

use std::sync::Arc;

use fixture::{STANCE, quadruped};
use physics::{Block, Config, Engine};
use spatial::{Lane, Philox, Purpose, Quat, f32x16};
use terrain::HeightField;

const ROBOTS: usize = 7 * 16;
const STEPS: usize = 150;

/// Blocks of half a meter and 0 to 20 cm height: risers, inner and outer corners everywhere.
fn engine() -> Engine<f32x16> {
    let count = 60;
    let mut random = Philox::new(3, 0, 0, 0, Purpose::Terrain);
    let tops: Vec<f32> = (0..144).map(|_| random.uniform(0.0, 0.2)).collect();
    let cell = |i: usize| [tops[i / count / 5 * 12 + i % count / 5]; 4];
    let cells = (0..count * count).map(cell).collect();
    let ground = HeightField { cell_size: 0.1, origin: [-3.0, -3.0], columns: count, rows: count, cells };
    Engine::new(quadruped(), Arc::new(ground), Config::default())
}

/// Puts a robot by its number into a lane: somewhere, tumbling, with gains, friction and targets of its own.
fn place(block: &mut Block<f32x16>, lane: usize, robot: usize) {
    let mut random = Philox::new(3, robot, 0, 0, Purpose::Evaluation);
    let mut draw = |width: f32| f64::from(random.uniform(-width, width));
    block.state.base_position.set(lane, [draw(2.0), draw(2.0), 0.8 + draw(0.1)]);
    let q = Quat::from_roll_pitch_yaw(draw(1.0), draw(1.0), draw(3.0));
    block.state.base_orientation.set(lane, [q.w, q.x, q.y, q.z]);
    // Up to 40 mm along an axis in a step: beyond the margin of 10 mm, within the 50 mm that are looked ahead.
    block.state.base_linear_velocity.set(lane, [draw(8.0), draw(8.0), draw(8.0)]);
    for j in 0..12 {
        block.state.joint_position[j].set(lane, STANCE[j]);
        block.state.joint_velocity[j].set(lane, draw(3.0));
        block.input.joint_target[j].set(lane, STANCE[j] + draw(0.5));
    }
    block.parameters.friction.set(lane, 0.7 + draw(0.5));
    block.parameters.stiffness.set(lane, 80.0 + draw(40.0));
}

/// Every bit of the state of a robot.
fn bits(block: &Block<f32x16>, lane: usize) -> Vec<u64> {
    let state = &block.state;
    let vectors = [state.base_position, state.base_linear_velocity, state.base_angular_velocity];
    let joints = state.joint_position.iter().chain(&state.joint_velocity).map(|q| q.get(lane));
    let base = vectors.into_iter().flat_map(|v| v.get(lane)).chain(state.base_orientation.get(lane));
    let forces = block.output.contact_force.iter().flat_map(|force| force.get(lane));
    base.chain(joints).chain(forces).map(f64::to_bits).collect()
}

/// Runs robots on `threads`, robot `i` in place `order[i]` of all lanes; returns the bits by robot.
fn run(threads: usize, order: &[usize]) -> Vec<Vec<u64>> {
    let engine = engine();
    let mut blocks = vec![Block::new(&engine); ROBOTS / 16];
    for (robot, place_at) in order.iter().enumerate() {
        place(&mut blocks[place_at / 16], place_at % 16, robot);
    }
    let share = blocks.len().div_ceil(threads);
    std::thread::scope(|scope| {
        for share in blocks.chunks_mut(share) {
            let engine = &engine;
            scope.spawn(move || (0..STEPS).for_each(|_| share.iter_mut().for_each(|b| b.step(engine))));
        }
    });
    order.iter().map(|place_at| bits(&blocks[place_at / 16], place_at % 16)).collect()
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let order: Vec<usize> = (0..ROBOTS).collect();
    let expected = run(1, &order);
    for threads in [2, 7] {
        assert!(run(threads, &order) == expected, "{threads} threads");
    }
}

#[test]
fn neither_lane_nor_company_changes_a_bit() {
    let order: Vec<usize> = (0..ROBOTS).collect();
    let expected = run(1, &order);
    // Multipliers without a common factor with 112 = 16 · 7 deal the robots out anew.
    for multiplier in [3, 5, 45, 111] {
        let order: Vec<usize> = order.iter().map(|robot| (robot * multiplier + 9) % ROBOTS).collect();
        let found = run(1, &order);
        let differing: Vec<usize> = (0..ROBOTS).filter(|&robot| found[robot] != expected[robot]).collect();
        assert!(differing.is_empty(), "dealt out by {multiplier}: {differing:?} differ");
    }
}

#[test]
fn a_state_that_is_no_number_stays_in_its_lane() {
    let engine = engine();
    let mut clean = Block::new(&engine);
    (0..16).for_each(|lane| place(&mut clean, lane, lane));
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e38] {
        let mut expected = clean.clone();
        let mut spoilt = clean.clone();
        spoilt.state.base_position.set(2, [bad, 0.0, 0.5]);
        spoilt.state.base_position.set(3, [0.0, 0.0, bad]);
        spoilt.state.base_orientation.set(7, [bad, 0.0, 0.0, 1.0]);
        spoilt.state.base_linear_velocity.set(8, [0.0, bad, 0.0]);
        spoilt.state.joint_position[4].set(11, bad);
        spoilt.state.joint_velocity[9].set(13, bad);
        spoilt.input.joint_target[0].set(14, bad);
        for _ in 0..STEPS {
            expected.step(&engine);
            spoilt.step(&engine);
        }
        for lane in [0, 1, 4, 5, 6, 9, 10, 12, 15] {
            assert!(bits(&spoilt, lane) == bits(&expected, lane), "{bad} reached lane {lane}");
        }
    }
}
