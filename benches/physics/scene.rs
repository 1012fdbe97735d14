//! Robots trotting in place, without feedback, on different grounds. `compare.py` builds the same scenes for MuJoCo.

use std::{f64::consts::TAU, sync::Arc};

use physics::{Block, Config, Engine};
use rayon::prelude::*;
use robot::{BodyPart, Harness, RobotModel, anymal_d, anymal_d_default_joint_position};
use spatial::{Lane, f32x16};
use terrain::HeightField;

use crate::counted::{self, Counted, Operations};

/// Physics steps of a pass: two seconds.
pub(crate) const STEPS: usize = 400;
const TIME_STEP: f64 = 0.005;
/// Physics steps for which a joint target holds.
const DECIMATION: usize = 4;
const CELL: f64 = 0.1;
/// Cells along the ground's edge: 8 m.
const CELLS: usize = 80;
/// Base height above the ground at which the feet of the default pose touch it \[m\].
const STANCE: f64 = 0.5885;

/// One scene.
pub(crate) struct Scene {
    pub(crate) name: &'static str,
    /// Height \[m\] of a vertex or, on stairs, of a cell.
    height: fn(usize, usize) -> f64,
    /// Heights belong to cells, with risers between them.
    stepped: bool,
    /// Only feet can touch the ground.
    feet_only: bool,
    /// Above the ground at the start \[m\].
    lift: f64,
}

/// All scenes.
pub(crate) const SCENES: [Scene; 5] = [
    Scene { name: "free", height: level, stepped: false, feet_only: false, lift: 1000.0 },
    Scene { name: "flat", height: level, stepped: false, feet_only: false, lift: 0.0 },
    Scene { name: "rough_feet", height: rough, stepped: false, feet_only: true, lift: 0.0 },
    Scene { name: "rough", height: rough, stepped: false, feet_only: false, lift: 0.0 },
    Scene { name: "stairs", height: stairs, stepped: true, feet_only: false, lift: 0.0 },
];

fn level(_: usize, _: usize) -> f64 {
    0.0
}

/// Vertices at 0, 2, 4, 6 or 8 cm, as the random rough ground of training.
fn rough(column: usize, row: usize) -> f64 {
    ((column * 7 + row * 3 + column * row * 5) % 11 % 5) as f64 * 0.02
}

/// Seven steps of 14 cm up to a plateau, treads of 30 cm.
fn stairs(column: usize, row: usize) -> f64 {
    let inward = column.min(CELLS - 1 - column).min(row.min(CELLS - 1 - row));
    let steps = if inward < 10 { 0 } else { (inward - 10) / 3 + 1 };
    steps.min(7) as f64 * 0.14
}

impl Scene {
    fn ground(&self) -> HeightField {
        if std::ptr::fn_addr_eq(self.height, level as fn(usize, usize) -> f64) {
            return HeightField::flat(0.0);
        }
        let cell = |i: usize| {
            let (x, y) = (i % CELLS, i / CELLS);
            let h = |dx: usize, dy: usize| (self.height)(x + dx, y + dy) as f32;
            if self.stepped { [h(0, 0); 4] } else { [h(0, 0), h(1, 0), h(0, 1), h(1, 1)] }
        };
        let origin = [-4.0; 2];
        let cells = (0..CELLS * CELLS).map(cell).collect();
        HeightField { cell_size: CELL as f32, origin, columns: CELLS, rows: CELLS, cells }
    }

    fn robot(&self) -> RobotModel {
        let mut robot =
            anymal_d().with_harness(Harness::default()).expect("the nominal harness can be built");
        robot.contacts.retain(|sphere| !self.feet_only || sphere.part == BodyPart::Foot);
        robot
    }

    /// Where the base of a robot starts: scattered over 5 m × 5 m by multiples of the golden ratio and of the root of
    /// two, over the highest ground within half a meter.
    fn start(&self, robot: usize) -> [f64; 3] {
        let scatter = |step: f64| -2.5 + 5.0 * (robot as f64 * step).fract();
        let (x, y) = (scatter(0.618_034), scatter(0.414_214));
        let cells = |from: f64, to: f64| ((from + 4.0) / CELL) as usize..=((to + 4.0) / CELL) as usize;
        let heights = cells(x - 0.5, x + 0.5)
            .flat_map(|column| cells(y - 0.5, y + 0.5).map(move |row| (self.height)(column, row)));
        [x, y, heights.fold(0.0, f64::max) + STANCE + self.lift]
    }
}

/// Diagonal legs together, 1.5 times a second.
fn trot(time: f64) -> [f64; 12] {
    let mut target = anymal_d_default_joint_position();
    for leg in 0..4 {
        let half_turn = if leg == 0 || leg == 3 { 0.0 } else { 0.5 };
        // Hind legs are bent the other way.
        let fold = if leg % 2 == 0 { 1.0 } else { -1.0 };
        let lift = 0.35 * (TAU * (1.5 * time + half_turn)).sin().max(0.0);
        target[4 + leg] += fold * lift;
        target[8 + leg] -= 2.0 * fold * lift;
    }
    target
}

/// Robots in one scene.
pub(crate) struct Herd<L: Lane> {
    engine: Engine<L>,
    blocks: Vec<Block<L>>,
    fresh: Vec<Block<L>>,
}

impl<L: Lane> Herd<L> {
    fn of(scene: &Scene, robots: usize) -> Self {
        let config = Config { time_step: TIME_STEP, ..Config::default() };
        let engine = Engine::new(scene.robot(), Arc::new(scene.ground()), config);
        let block = |index: usize| {
            let mut block = Block::new(&engine);
            for lane in 0..L::WIDTH {
                block.state.base_position.set(lane, scene.start(index * L::WIDTH + lane));
            }
            for (q, default) in block.state.joint_position.iter_mut().zip(trot(0.0)) {
                *q = L::splat(default);
            }
            block
        };
        let fresh: Vec<_> = (0..robots / L::WIDTH).map(block).collect();
        Self { blocks: fresh.clone(), fresh, engine }
    }

    /// Puts everyone back to the start.
    pub(crate) fn reset(&mut self) {
        self.blocks.clone_from(&self.fresh);
    }

    /// One pass.
    pub(crate) fn run(&mut self) {
        let engine = &self.engine;
        for tick in 0..STEPS / DECIMATION {
            let target = trot(tick as f64 * TIME_STEP * DECIMATION as f64);
            self.blocks.par_iter_mut().for_each(|block| {
                for (input, target) in block.input.joint_target.iter_mut().zip(target) {
                    *input = L::splat(target);
                }
                for _ in 0..DECIMATION {
                    block.step(engine);
                }
            });
        }
    }
}

impl Herd<f32x16> {
    /// `robots` in `scene`, sixteen a block.
    pub(crate) fn new(scene: &Scene, robots: usize) -> Self {
        Self::of(scene, robots)
    }
}

/// Mean operations of one physics step of one robot.
pub(crate) fn operations(scene: &Scene) -> Operations {
    const ROBOTS: usize = 16;
    let mut herd = Herd::<Counted>::of(scene, ROBOTS);
    counted::take();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
    let total = pool.install(|| {
        herd.run();
        counted::take()
    });
    total.per((ROBOTS * STEPS) as u64)
}
