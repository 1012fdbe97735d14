//! Robots that flail, are pushed and lie about: what breaks a simulation, if anything does.

use rayon::prelude::*;
use spatial::{Lane, Philox, Purpose};
use tasks::simulation::{DECIMATION, GROUP, Group, Randomization, ResetSpread, Simulation};
use terrain::{GridConfig, TerrainGrid};

/// Control steps from one push to the next; a robot that has fallen lies that long at most.
const ROUND: usize = 50;

/// What robots went through.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Tally {
    /// Physics steps, of all robots.
    pub(crate) robot_steps: u64,
    /// States that were no longer numbers.
    pub(crate) broken: u64,
    /// States beyond what a training takes for a robot's: numbers, but faster.
    pub(crate) thrown: u64,
    /// Robots found fallen at a push.
    pub(crate) falls: u64,
    /// Largest speed of a base \[m/s\].
    pub(crate) base_speed: f32,
    /// Largest rate a base turned with \[rad/s\].
    pub(crate) base_rate: f32,
    /// Largest rate of a joint \[rad/s\].
    pub(crate) joint_rate: f32,
}

/// Sixteen robots and what they went through.
struct Squad {
    index: usize,
    group: Group,
    tally: Tally,
}

/// Runs `robots` for at least `robot_steps` physics steps in all, on rough ground with all threads; `report` is told of
/// the sum now and then.
///
/// Mass, friction, bar and hand vary as far as they may, the servos' gains more than any task has them.
pub(crate) fn soak(robots: usize, robot_steps: u64, mut report: impl FnMut(&Tally)) -> Tally {
    let grid = TerrainGrid::new(&GridConfig::default()).expect("the default terrain is sound");
    let simulation = Simulation::new(grid.field.clone(), physics::Config::default());
    let extreme = Randomization {
        base_mass_kg: [-20.0, 50.0],
        friction: [0.0, 3.0],
        bar_length_m: [0.3, 2.0],
        hand_mass_kg: [0.01, 20.0],
    };
    let groups = simulation.groups(0..robots, &extreme, 1).expect("a multiple of sixteen");
    let squad = |(index, group)| Squad { index, group, tally: Tally::default() };
    let mut squads: Vec<Squad> = groups.into_iter().enumerate().map(squad).collect();
    let rounds = robot_steps.div_ceil((robots * ROUND * DECIMATION) as u64);
    let mut total = Tally::default();
    for round in 0..rounds as u32 {
        squads.par_iter_mut().for_each(|squad| squad.run(&simulation, &grid, round));
        total = squads.iter().fold(Tally::default(), |sum, squad| sum.with(&squad.tally));
        report(&total);
    }
    total
}

impl Tally {
    fn with(self, o: &Self) -> Self {
        Self {
            robot_steps: self.robot_steps + o.robot_steps,
            broken: self.broken + o.broken,
            thrown: self.thrown + o.thrown,
            falls: self.falls + o.falls,
            base_speed: self.base_speed.max(o.base_speed),
            base_rate: self.base_rate.max(o.base_rate),
            joint_rate: self.joint_rate.max(o.joint_rate),
        }
    }
}

impl Squad {
    fn run(&mut self, simulation: &Simulation, grid: &TerrainGrid, round: u32) {
        for lane in 0..GROUP {
            let mut random = Philox::new(1, self.index * GROUP + lane, round, 0, Purpose::Reset);
            let fell = round > 0 && self.group.has_fallen(lane);
            self.tally.falls += u64::from(fell);
            if round == 0 || fell {
                self.place(simulation, grid, lane, &mut random);
            }
            self.push(lane, &mut random);
        }
        for step in 0..ROUND as u32 {
            let mut random = Philox::new(1, self.index, round, step, Purpose::Action);
            let actions: Vec<f32> = (0..GROUP * 12).map(|_| 2.0 * random.normal()).collect();
            simulation.control_step(&mut self.group, &actions);
            self.tally.robot_steps += (GROUP * DECIMATION) as u64;
            for lane in 0..GROUP {
                if self.group.is_sound(lane) {
                    self.measure(lane);
                    continue;
                }
                let count =
                    if self.is_finite(lane) { &mut self.tally.thrown } else { &mut self.tally.broken };
                *count += 1;
                self.place(simulation, grid, lane, &mut random);
            }
        }
    }

    /// Somewhere on the ground, with servos of its own.
    fn place(&mut self, simulation: &Simulation, grid: &TerrainGrid, lane: usize, random: &mut Philox) {
        let level = random.below(grid.levels() as u32) as usize;
        let spawn = grid.spawn(level, random.below(grid.columns() as u32) as usize);
        simulation.reset(&mut self.group, lane, spawn, &ResetSpread::default(), random);
        let parameters = &mut self.group.block.parameters;
        parameters.stiffness.as_mut_array()[lane] = random.uniform(10.0, 300.0);
        parameters.damping.as_mut_array()[lane] = random.uniform(0.0, 10.0);
    }

    /// Forces until the next push, and a kick.
    fn push(&mut self, lane: usize, random: &mut Philox) {
        let block = &mut self.group.block;
        let mut vector = |width: f32| [0; 3].map(|_| f64::from(random.uniform(-width, width)));
        block.input.hand_force.set(lane, vector(100.0));
        block.input.base_force.set(lane, vector(500.0));
        let (velocity, kick) = (block.state.base_linear_velocity.get(lane), vector(2.0));
        block.state.base_linear_velocity.set(lane, std::array::from_fn(|i| velocity[i] + kick[i]));
    }

    fn is_finite(&self, lane: usize) -> bool {
        let state = &self.group.block.state;
        let joints = state.joint_position.iter().chain(&state.joint_velocity);
        let vectors = [state.base_position, state.base_linear_velocity, state.base_angular_velocity];
        joints.map(|value| value.get(lane)).all(f64::is_finite)
            && vectors.iter().all(|vector| vector.get(lane).into_iter().all(f64::is_finite))
            && state.base_orientation.get(lane).into_iter().all(f64::is_finite)
    }

    fn measure(&mut self, lane: usize) {
        let motion = self.group.base_motion(lane);
        let norm = |v: [f32; 3]| v.iter().map(|x| x * x).sum::<f32>().sqrt();
        let rates = self.group.block.state.joint_velocity.iter().map(|rate| rate.as_array()[lane].abs());
        let tally = &mut self.tally;
        tally.base_speed = tally.base_speed.max(norm(motion.linear_velocity));
        tally.base_rate = tally.base_rate.max(norm(motion.angular_velocity));
        tally.joint_rate = rates.fold(tally.joint_rate, f32::max);
    }
}
