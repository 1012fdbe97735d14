//! Robots under random actions, pushes and extreme randomization; reports what is not sound and how fast things got:
//! `cargo run --release -p guidedog-tasks --example soak [robots] [control steps]`.

use rayon::prelude::*;
use spatial::{Philox, Purpose};
use tasks::simulation::{GROUP, Group, Randomization, ResetSpread, Simulation};
use terrain::{GridConfig, TerrainGrid};

/// What one group went through.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    broken: usize,
    falls: usize,
    fastest: f32,
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<usize>().expect("a number"));
    let robots = arguments.next().unwrap_or(512);
    let steps = arguments.next().unwrap_or(1000);
    let grid = TerrainGrid::new(&GridConfig::default()).expect("the default terrain is sound");
    let simulation = Simulation::new(grid.field.clone(), physics::Config::default());
    let groups = simulation.groups(robots, &Randomization::default(), 1).expect("a multiple of sixteen");
    let tallies: Vec<Tally> = groups
        .into_par_iter()
        .enumerate()
        .map(|(g, group)| soak(&simulation, &grid, g, group, steps))
        .collect();
    let broken: usize = tallies.iter().map(|tally| tally.broken).sum();
    let falls: usize = tallies.iter().map(|tally| tally.falls).sum();
    let fastest = tallies.iter().map(|tally| tally.fastest).fold(0.0, f32::max);
    println!(
        "{} robot-steps: {broken} states that are no numbers, {falls} falls, fastest joint {fastest:.1} rad/s",
        robots * steps * tasks::simulation::DECIMATION
    );
}

fn soak(simulation: &Simulation, grid: &TerrainGrid, g: usize, mut group: Group, steps: usize) -> Tally {
    let mut tally = Tally::default();
    let place = |group: &mut Group, lane: usize, episode: u32| {
        let mut random = Philox::new(1, g * GROUP + lane, episode, 0, Purpose::Reset);
        let level = random.below(grid.levels() as u32) as usize;
        let spawn = grid.spawn(level, g % grid.columns());
        simulation.reset(group, lane, spawn, &ResetSpread::default(), &mut random);
        let mut around = |width: f32| f64::from(random.uniform(-width, width));
        group.block.input.hand_force.set(lane, [0; 3].map(|_| around(100.0)));
        group.block.input.base_force.set(lane, [0; 3].map(|_| around(200.0)));
    };
    (0..GROUP).for_each(|lane| place(&mut group, lane, 0));
    for step in 0..steps {
        let mut random = Philox::new(2, g, step as u32, 0, Purpose::Action);
        let actions: Vec<f32> = (0..GROUP * 12).map(|_| 2.0 * random.normal()).collect();
        simulation.control_step(&mut group, &actions);
        for lane in 0..GROUP {
            let rates = group.block.state.joint_velocity.iter().map(|rate| rate.as_array()[lane].abs());
            tally.fastest = rates.fold(tally.fastest, f32::max);
            let sound = group.is_sound(lane);
            tally.broken += usize::from(!sound);
            if !sound || group.has_fallen(lane) {
                tally.falls += usize::from(sound);
                place(&mut group, lane, step as u32 + 1);
            }
        }
    }
    tally
}
