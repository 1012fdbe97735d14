//! Prints the time of one physics step of one robot on one core: `cargo run --release -p guidedog-physics --example step_speed`.

#[path = "../tests/fixture/mod.rs"]
mod fixture;

use std::{sync::Arc, time::Instant};

use physics::{Block, Config, Engine};
use spatial::{Lane, Vec3, f32x16};
use terrain::HeightField;

fn main() {
    let engine =
        Engine::<f32x16>::new(fixture::quadruped(), Arc::new(HeightField::flat(0.0)), Config::default());
    let mut blocks = vec![Block::new(&engine); 64];
    let stance = fixture::STANCE;
    for block in &mut blocks {
        block.state.base_position = Vec3::splat([0.0, 0.0, 0.6]);
        for j in 0..12 {
            block.state.joint_position[j] = <f32x16 as Lane>::splat(stance[j]);
        }
    }
    for (name, height) in [("standing", 0.0), ("falling", 1e6)] {
        for block in &mut blocks {
            block.state.base_position.z += <f32x16 as Lane>::splat(height);
        }
        let mut times = Vec::new();
        for round in 0..200 {
            for block in &mut blocks {
                for j in 0..12 {
                    let sway = 0.1 * (0.1 * f64::from(round) + j as f64).sin();
                    block.input.joint_target[j] = <f32x16 as Lane>::splat(stance[j] + sway);
                }
            }
            let start = Instant::now();
            for block in &mut blocks {
                block.step(&engine);
            }
            times.push(start.elapsed().as_secs_f64() / (64.0 * 16.0) * 1e6);
        }
        times.sort_by(f64::total_cmp);
        println!("{name}: median {:.3} µs, fastest {:.3} µs a robot-step", times[100], times[0]);
    }
}
