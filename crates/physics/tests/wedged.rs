//! A body between walls that are too near: there is no way out, and whatever pushes must not build up.

#[path = "fixture/brick.rs"]
mod brick;

use std::sync::Arc;

use brick::brick;
use physics::{Block, Config, Engine};
use spatial::{Lane, Vec3, f32x16};
use terrain::HeightField;

/// A ditch of two cells along x, between walls of 0.3 m: 0.21 m wide, for a brick of 0.22 m.
fn ditch() -> HeightField {
    let (columns, rows) = (20, 6);
    let cell = |i: usize| if matches!(i / columns, 2 | 3) { [0.0; 4] } else { [0.3; 4] };
    let cells = (0..columns * rows).map(cell).collect();
    HeightField { cell_size: 0.105, origin: [-1.05, -0.315], columns, rows, cells }
}

#[test]
fn a_wedged_brick_neither_builds_up_force_nor_breaks_out() {
    let config = Config::default();
    let engine = Engine::<f32x16>::new(brick(), Arc::new(ditch()), config.clone());
    let mut block = Block::new(&engine);
    block.state.base_position = Vec3::splat([0.0, 0.0, 0.049]);
    block.parameters.friction = f32x16::from_fn(|lane| 0.2 * lane as f64);
    let (mut hardest, mut fastest) = (0.0_f64, 0.0_f64);
    for _ in 0..4000 {
        block.step(&engine);
        for lane in 0..16 {
            let norm = |v: Vec3<f32x16>| v.get(lane).into_iter().map(|x| x * x).sum::<f64>().sqrt();
            hardest = block.output.contact_force.iter().map(|&force| norm(force)).fold(hardest, f64::max);
            fastest = fastest.max(norm(block.state.base_linear_velocity));
        }
    }
    // A brick of 10 kg stopped from 200 m/s, by four corners with friction up to 3.
    assert!(hardest < 4.0 * 10.0 * 200.0 / config.time_step, "{hardest} N");
    // Once it tilts it gets out, at about the speed overlaps are opened with.
    assert!(fastest < 2.0 * config.max_depenetration_speed, "{fastest} m/s");
}
