//! Robots on a ground under supervisors and one handler's pull.

use std::ops::Range;

use policy::{ForwardWorkspace, layout};
use spatial::{Philox, Purpose};
use tasks::{
    guidance::{Behavior, Course, LocomotionPolicy, Squad, Supervisor, SupervisorPolicy, sensed_force},
    simulation::{CONTROL_PERIOD_S, GROUP, ResetSpread, Simulation},
};
use terrain::HeightField;

use crate::{
    reading::Reading,
    settings::{Mind, Settings},
};

/// Weakest and strongest pull along each axis \[N\]; what is beyond is limited. Ours: along x and y the plane of `guidedog evaluate --suite plane`.
pub const FORCE_LOW: [f32; 3] = [-120.0, -60.0, -40.0];
/// See [`FORCE_LOW`].
pub const FORCE_HIGH: [f32; 3] = [60.0, 60.0, 40.0];

/// Numbers at the head of a frame: time \[s\], robots, force on the robots \[N\] ×3, Table II's label.
pub const FRAME_HEADER: usize = 6;
/// Fields of a robot's row in a frame, by name and width. `behavior` counts walk, stop, turn, spin; quaternions are w, x, y, z.
pub const ROBOT_FIELDS: [(&str, usize); 9] = [
    ("position", 3),
    ("orientation", 4),
    ("joints", 12),
    ("command", 3),
    ("velocity", 3),
    ("observed_force", 3),
    ("behavior", 1),
    ("heading_drift", 1),
    ("fallen", 1),
];

/// Numbers of a robot in a frame.
pub fn row_width() -> usize {
    ROBOT_FIELDS.iter().map(|(_, width)| width).sum()
}

/// Distance between neighbors in a herd, and between lanes \[m\].
const SPACING_M: f32 = 1.8;
/// A robot that fell lies for this long before it begins again \[s\].
const LYING_S: f32 = 2.0;

/// A supervisor and the robots it has.
#[derive(Clone, Debug)]
struct Lane {
    supervisor: Supervisor,
    robots: Range<usize>,
}

/// A pull on top of the one that is held, for a while.
#[derive(Clone, Copy, Debug)]
struct Tug {
    force: [f32; 3],
    until: u32,
}

/// What is known of a robot beside its state.
#[derive(Clone, Debug, Default)]
struct Dog {
    command: [f32; 3],
    seen: [f32; 3],
    reading: Reading,
    /// Control steps since it fell.
    lying: Option<u32>,
}

/// A running simulation.
#[derive(Clone, Debug)]
pub struct Session {
    settings: Settings,
    course: Course,
    squads: Vec<Squad>,
    lanes: Vec<Lane>,
    dogs: Vec<Dog>,
    spawns: Vec<[f32; 3]>,
    held: [f32; 3],
    tug: Option<Tug>,
    step: u32,
    commands: Vec<[f32; 3]>,
    observations: Vec<f32>,
    workspace: ForwardWorkspace,
}

impl Session {
    /// Robots standing on their ground, no hand on the bar.
    ///
    /// # Errors
    /// A setting is out of range; the message names it.
    pub fn new(
        settings: Settings,
        locomotion: &LocomotionPolicy,
        learned: &SupervisorPolicy,
    ) -> Result<Self, String> {
        settings.validate()?;
        let grid = settings.grid().map_err(|error| error.to_string())?;
        let simulation = Simulation::new(grid.field.clone(), locomotion.physics());
        let course = Course {
            simulation,
            policy: locomotion.clone(),
            observation_noise: settings.sensor_noise,
            seed: settings.seed,
        };
        let count = settings.robots.max(settings.minds.len());
        let squads = course.squads(count.next_multiple_of(GROUP), &settings.randomization())?;
        let total = squads.iter().map(Squad::robots).sum();
        let center = grid.spawn(grid.levels() / 2, grid.columns() / 2);
        let mut session = Self {
            lanes: lanes(&settings, learned),
            settings,
            course,
            squads,
            dogs: vec![Dog::default(); count],
            spawns: spawns(center, count, total),
            held: [0.0; 3],
            tug: None,
            step: 0,
            commands: vec![[0.0; 3]; total],
            observations: vec![0.0; count * layout::SUPERVISOR_OBSERVATION],
            workspace: ForwardWorkspace::default(),
        };
        session.reset();
        Ok(session)
    }

    /// The choices it was made with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The ground.
    pub fn ground(&self) -> &HeightField {
        self.course.simulation.engine.terrain()
    }

    /// Takes other minds and noise without a break; `settings` must have the same robots.
    pub fn adjust(&mut self, settings: Settings, learned: &SupervisorPolicy) {
        debug_assert!(self.settings.same_robots(&settings));
        self.lanes = lanes(&settings, learned);
        self.course.observation_noise = settings.sensor_noise;
        self.settings = settings;
    }

    /// Everyone back to the start; the hand lets go.
    pub fn reset(&mut self) {
        self.step = 0;
        self.tug = None;
        self.held = [0.0; 3];
        self.dogs.fill(Dog::default());
        self.commands.fill([0.0; 3]);
        for robot in 0..self.commands.len() {
            self.put_at_start(robot);
        }
    }

    fn put_at_start(&mut self, robot: usize) {
        let (squad, index) = locate(&mut self.squads, robot);
        let spread = ResetSpread { position_m: 0.0, yaw_rad: 0.0, ..ResetSpread::standing() };
        let mut random = Philox::new(self.course.seed, robot, 0, self.step, Purpose::Reset);
        squad.reset(&self.course, index, self.spawns[robot], &spread, &mut random);
    }

    /// The pull that is held from now on, heading frame \[N\].
    pub fn pull(&mut self, force: [f32; 3]) {
        if force != self.held {
            self.held = force;
            self.dogs.iter_mut().for_each(|dog| dog.reading.forget_drift());
        }
    }

    /// Adds a pull for a while \[s\].
    pub fn tug(&mut self, force: [f32; 3], duration_s: f32) {
        let steps = (duration_s.clamp(0.0, 10.0) / CONTROL_PERIOD_S).round() as u32;
        self.tug = Some(Tug { force, until: self.step + steps });
    }

    /// The pull of this moment \[N\], within limits; what is no number pulls with the lower one.
    pub fn force(&self) -> [f32; 3] {
        let tug = self.tug.map_or([0.0; 3], |tug| tug.force);
        std::array::from_fn(|axis| (self.held[axis] + tug[axis]).max(FORCE_LOW[axis]).min(FORCE_HIGH[axis]))
    }

    /// One control step: 0.02 s.
    pub fn advance(&mut self) {
        if self.tug.is_some_and(|tug| self.step >= tug.until) {
            self.tug = None;
        }
        let force = self.force();
        for robot in 0..self.dogs.len() {
            let (squad, index) = locate(&mut self.squads, robot);
            squad.set_hand_force(index, force);
        }
        for lane in 0..self.lanes.len() {
            if self.step.is_multiple_of(self.lanes[lane].supervisor.period_steps()) {
                self.decide(lane, force);
            }
        }
        let step = self.step;
        for squad in &mut self.squads {
            let commands = &self.commands[squad.first_robot..][..squad.robots()];
            squad.control_step(&self.course, commands, |_| (0, step));
        }
        self.step += 1;
        self.watch(Behavior::of_force(force).target(force)[2]);
    }

    /// A decision of one lane's supervisor for all its robots.
    fn decide(&mut self, lane: usize, force: [f32; 3]) {
        let Lane { supervisor, robots } = &self.lanes[lane];
        let noise = self.settings.force_noise_n;
        let rows = &mut self.observations[..robots.len() * layout::SUPERVISOR_OBSERVATION];
        for (robot, row) in robots.clone().zip(rows.chunks_exact_mut(layout::SUPERVISOR_OBSERVATION)) {
            let mut random =
                Philox::new(self.course.seed, robot, 0, self.step, Purpose::SupervisorObservation);
            let dog = &mut self.dogs[robot];
            dog.seen = sensed_force(force, [noise; 3], &mut random);
            if supervisor.observes() {
                let (squad, index) = locate(&mut self.squads, robot);
                squad.sense(&self.course, index, dog.seen, dog.command, &mut random, row);
            }
        }
        let forces: Vec<_> = robots.clone().map(|robot| [self.dogs[robot].seen, force]).collect();
        let commands = &mut self.commands[robots.clone()];
        supervisor.decide(rows, &forces, &mut self.workspace, commands);
        for (robot, command) in robots.clone().zip(commands) {
            self.dogs[robot].command = *command;
        }
    }

    /// Reads every robot, and picks up those that fell.
    fn watch(&mut self, wanted_yaw_rate: f32) {
        for robot in 0..self.dogs.len() {
            let (squad, index) = locate(&mut self.squads, robot);
            let sound = squad.is_sound(index);
            let motion = squad.motion(index);
            let fallen = squad.has_fallen(index);
            let dog = &mut self.dogs[robot];
            dog.lying = dog.lying.map(|steps| steps + 1).or(fallen.then_some(0));
            if !sound || dog.lying.is_some_and(|steps| steps as f32 * CONTROL_PERIOD_S >= LYING_S) {
                *dog = Dog::default();
                self.commands[robot] = [0.0; 3];
                self.put_at_start(robot);
            } else {
                let [x, y, _] = motion.linear_velocity;
                dog.reading.update([x, y, motion.angular_velocity[2]], wanted_yaw_rate);
            }
        }
        // Robots that only fill up a group of sixteen begin again unseen.
        for robot in self.dogs.len()..self.commands.len() {
            let (squad, index) = locate(&mut self.squads, robot);
            if squad.has_fallen(index) {
                self.put_at_start(robot);
            }
        }
    }

    /// Appends the present to `out`: [`FRAME_HEADER`] numbers, then a row of [`ROBOT_FIELDS`] for every robot.
    pub fn write_frame(&self, out: &mut Vec<f32>) {
        let force = self.force();
        out.extend([self.step as f32 * CONTROL_PERIOD_S, self.dogs.len() as f32]);
        out.extend(force);
        out.push(Behavior::of_force(force) as usize as f32);
        for (robot, dog) in self.dogs.iter().enumerate() {
            let squad = self.squads.iter().rev().find(|squad| squad.first_robot <= robot);
            let squad = squad.expect("the first squad begins with robot 0");
            squad.write_pose(robot - squad.first_robot, out);
            let motion = squad.motion(robot - squad.first_robot);
            out.extend(dog.command);
            out.extend([motion.linear_velocity[0], motion.linear_velocity[1], motion.angular_velocity[2]]);
            out.extend(dog.seen);
            out.push(dog.reading.behavior() as usize as f32);
            out.push(dog.reading.heading_drift());
            out.push(f32::from(u8::from(dog.lying.is_some())));
        }
    }
}

/// The squad a robot is in, and its number there.
fn locate(squads: &mut [Squad], robot: usize) -> (&mut Squad, usize) {
    let index = squads.iter().rposition(|squad| squad.first_robot <= robot).unwrap_or(0);
    let squad = &mut squads[index];
    let first = squad.first_robot;
    (squad, robot - first)
}

fn lanes(settings: &Settings, learned: &SupervisorPolicy) -> Vec<Lane> {
    let lane = |(index, mind): (usize, &Mind)| Lane {
        supervisor: match mind {
            Mind::Learned => Supervisor::Learned(learned.clone()),
            Mind::Rules => Supervisor::Rules,
            Mind::Dominance => Supervisor::Dominance,
            Mind::Oracle => Supervisor::Oracle,
        },
        robots: index..index + settings.robots,
    };
    settings.minds.iter().enumerate().map(lane).collect()
}

/// Starting places of `total` robots: the `shown` ones in a square around `center`, or side by side; the rest among them.
fn spawns(center: [f32; 3], shown: usize, total: usize) -> Vec<[f32; 3]> {
    let columns = (shown as f32).sqrt().ceil() as usize;
    let columns = if shown == 2 { 1 } else { columns };
    let rows = shown.div_ceil(columns);
    let place = |robot: usize| {
        let (column, row) = (robot % shown % columns, robot % shown / columns);
        let along = |index: usize, count: usize| SPACING_M * (index as f32 - 0.5 * (count as f32 - 1.0));
        [center[0] - along(column, columns), center[1] - along(row, rows), center[2]]
    };
    (0..total).map(place).collect()
}
