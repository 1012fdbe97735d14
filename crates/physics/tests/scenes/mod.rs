//! Scenes with contact that MuJoCo has simulated too (`scripts/reference/mint_trajectories.py`): ground, targets and
//! forces as there, and our engine run on them. Shared by the tests and by the example that draws the figures.

#[path = "../fixture/brick.rs"]
mod brick;
mod difference;
pub(crate) mod sample;

use std::{f64::consts::TAU, sync::Arc};

use physics::{Block, Config, Engine};
use robot::{Harness, RobotModel, anymal_d, anymal_d_default_joint_position};
use spatial::{Lane, Vec3};
use terrain::HeightField;

pub(crate) use difference::QUANTITIES;
pub(crate) use sample::{Sample, golden};

/// Time between two samples; joint targets and forces are constant in between \[s\].
pub(crate) const CONTROL_PERIOD: f64 = 0.02;
const CELL: f32 = 0.1;
const COLUMNS: usize = 80;
const ROWS: usize = 40;
const STEP_HEIGHT: f32 = 0.06;
/// Columns before the step: its face is at x = −2 m + 27 · 0.1 m.
const COLUMNS_BEFORE_STEP: usize = 27;

/// What happens to which body on which ground.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    robot: fn() -> RobotModel,
    ground: fn() -> HeightField,
    friction: f64,
    targets: fn(f64) -> [f64; 12],
    /// Force at the base, heading frame \[N\].
    force: fn(f64) -> [f64; 3],
}

/// All scenes, in the order of the golden file.
pub(crate) fn all() -> [Scene; 8] {
    let robot =
        |name, ground, targets, force| Scene { name, robot: anymal, ground, friction: 1.0, targets, force };
    [
        robot("drop", level, hold, no_force),
        robot("stand", level, hold, no_force),
        robot("push", level, hold, push),
        robot("trot", level, trot, no_force),
        robot("rough", rough, trot, no_force),
        robot("step", step, trot, no_force),
        robot("ridges", ridges, trot, no_force),
        Scene { robot: brick::brick, friction: 0.5, ..robot("slide", level, hold, no_force) },
    ]
}

impl Scene {
    /// Samples of a simulation by our engine from the state of `start`, itself the first of them.
    pub(crate) fn simulate<L: Lane>(&self, start: &Sample, samples: usize, config: Config) -> Vec<Sample> {
        let substeps = (CONTROL_PERIOD / config.time_step).round() as usize;
        let engine = Engine::<L>::new((self.robot)(), Arc::new((self.ground)()), config);
        let mut block = Block::new(&engine);
        block.parameters.friction = L::splat(self.friction);
        start.write(&mut block.state);
        let mut found = vec![start.clone()];
        for tick in 0..samples - 1 {
            let time = tick as f64 * CONTROL_PERIOD;
            for (input, target) in block.input.joint_target.iter_mut().zip((self.targets)(time)) {
                *input = L::splat(target);
            }
            block.input.base_force = Vec3::splat((self.force)(time));
            let mut vertical_force = 0.0;
            for _ in 0..substeps {
                block.step(&engine);
                vertical_force += block.output.contact_force.iter().map(|f| f.z.get(0)).sum::<f64>();
            }
            found.push(Sample::read(&block.state, vertical_force / substeps as f64));
        }
        found
    }
}

fn anymal() -> RobotModel {
    anymal_d().with_harness(Harness::default()).expect("the nominal harness can be built")
}

fn level() -> HeightField {
    HeightField::flat(0.0)
}

fn field(cell: impl Fn(usize, usize) -> [f32; 4]) -> HeightField {
    let cells = (0..COLUMNS * ROWS).map(|i| cell(i % COLUMNS, i / COLUMNS)).collect();
    HeightField { cell_size: CELL, origin: [-2.0, -2.0], columns: COLUMNS, rows: ROWS, cells }
}

/// Vertices 0.1 m apart at 0, 5, 10 or 15 mm.
fn rough() -> HeightField {
    scattered(0.005)
}

/// Twice as steep: feet stand on ridges and in valleys.
fn ridges() -> HeightField {
    scattered(0.01)
}

fn scattered(unit: f32) -> HeightField {
    let height =
        |column: usize, row: usize| ((column * 7 + row * 3 + column * row * 5) % 11 % 4) as f32 * unit;
    field(|x, y| [height(x, y), height(x + 1, y), height(x, y + 1), height(x + 1, y + 1)])
}

fn step() -> HeightField {
    field(|column, _| [if column < COLUMNS_BEFORE_STEP { 0.0 } else { STEP_HEIGHT }; 4])
}

fn hold(_: f64) -> [f64; 12] {
    anymal_d_default_joint_position()
}

/// Diagonal legs together, 1.5 times a second; the foot is swung forward while the leg is drawn up.
fn trot(time: f64) -> [f64; 12] {
    let ramp = (time / 0.5).min(1.0);
    let mut target = anymal_d_default_joint_position();
    for leg in 0..4 {
        let half_turn = if leg == 0 || leg == 3 { 0.0 } else { 0.5 };
        let phase = TAU * (1.5 * time + half_turn);
        // Hind legs are bent the other way.
        let fold = if leg % 2 == 0 { 1.0 } else { -1.0 };
        let lift = ramp * 0.35 * phase.sin().max(0.0);
        target[4 + leg] += fold * lift + ramp * 0.10 * phase.cos();
        target[8 + leg] -= 2.0 * fold * lift;
    }
    target
}

fn no_force(_: f64) -> [f64; 3] {
    [0.0; 3]
}

fn push(time: f64) -> [f64; 3] {
    if (1.0..1.5).contains(&time) { [0.0, 60.0, 0.0] } else { [0.0; 3] }
}
