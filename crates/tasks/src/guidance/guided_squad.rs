//! The episodes of one squad: what handlers want, what robots get for it.

use policy::{StepRows, layout};
use spatial::{Philox, Purpose};
use terrain::TerrainGrid;

use super::{
    Behavior, Course, GuidanceConfig, Squad, behavior_reward, config::limited, drift::Drift,
    force::sensed_force, metrics::Metrics,
};
use crate::{
    archive::{Archive, Archived},
    simulation::CONTROL_PERIOD_S,
};

const OBSERVATION: usize = layout::SUPERVISOR_OBSERVATION;

/// A squad and what its handlers want.
#[derive(Clone)]
pub(super) struct GuidedSquad {
    pub(super) squad: Squad,
    pub(super) robots: Vec<Guided>,
    /// Commands held between two decisions.
    commands: Vec<[f32; 3]>,
    pub(super) metrics: Metrics,
}

/// One robot's episode.
#[derive(Clone, Debug, Default)]
pub(super) struct Guided {
    /// Episodes begun.
    episode: u32,
    /// Control steps of this episode.
    step: u32,
    /// Steps it counts as having lived before, so that episodes do not all end together.
    pub(super) head_start: u32,
    level: usize,
    column: usize,
    /// Scripted force of the hand, heading frame \[N\].
    force: [f32; 3],
    /// The last command, as limited.
    pub(super) previous_command: [f32; 3],
    drift: Drift,
    /// Since the last decision; its end resets the robot.
    fallen: bool,
    /// Whether its state stopped to be numbers since then: it has fallen too.
    broken: bool,
}

/// What squads need of the environment while they step side by side.
pub(super) struct Shared<'a> {
    pub(super) config: &'a GuidanceConfig,
    pub(super) seed: u64,
    pub(super) course: &'a Course,
    pub(super) grid: &'a TerrainGrid,
    pub(super) episode_steps: u32,
    pub(super) period_steps: u32,
    pub(super) pull_steps: u32,
}

impl GuidedSquad {
    /// Robots on their columns of the ground, before their first episode.
    pub(super) fn new(squad: Squad, column: impl Fn(usize) -> usize) -> Self {
        let robot = |i: usize| Guided { column: column(squad.first_robot + i), ..Guided::default() };
        let robots: Vec<Guided> = (0..squad.robots()).map(robot).collect();
        Self { commands: vec![[0.0; 3]; robots.len()], robots, metrics: Metrics::default(), squad }
    }

    fn random(&self, shared: &Shared<'_>, robot: usize, purpose: Purpose) -> Philox {
        let Guided { episode, step, .. } = self.robots[robot];
        Philox::new(shared.seed, self.squad.first_robot + robot, episode, step, purpose)
    }

    /// Begins a new episode.
    pub(super) fn reset(&mut self, shared: &Shared<'_>, robot: usize) {
        let guided = &mut self.robots[robot];
        let column = guided.column;
        *guided = Guided { episode: guided.episode + 1, column, ..Guided::default() };
        let mut random = self.random(shared, robot, Purpose::Reset);
        let guided = &mut self.robots[robot];
        guided.head_start = if guided.episode == 1 { random.below(shared.episode_steps) } else { 0 };
        let levels = shared.grid.levels().min(shared.config.max_level + 1);
        guided.level = random.below(levels as u32) as usize;
        let spawn = shared.grid.spawn(guided.level, column);
        self.squad.reset(shared.course, robot, spawn, &shared.config.reset, &mut random);
        self.pull(shared, robot);
    }

    /// Draws the force where one has come due since the last decision.
    fn pull(&mut self, shared: &Shared<'_>, robot: usize) {
        let drawn = |step: u32| step / shared.pull_steps;
        let step = self.robots[robot].step;
        if step == 0 || drawn(step) != drawn(step - shared.period_steps) {
            let force = shared.config.pull.draw(&mut self.random(shared, robot, Purpose::Command));
            self.robots[robot].force = force;
            self.squad.set_hand_force(robot, force);
        }
    }

    pub(super) fn observe(&self, shared: &Shared<'_>, robot: usize, out: &mut [f32]) {
        let guided = &self.robots[robot];
        let mut random = self.random(shared, robot, Purpose::SupervisorObservation);
        let seen = sensed_force(guided.force, shared.config.pull.noise_n, &mut random);
        self.squad.sense(shared.course, robot, seen, guided.previous_command, &mut random, out);
    }

    /// One decision of every supervisor and the control steps it holds for.
    pub(super) fn step(&mut self, shared: &Shared<'_>, actions: &[f32], out: StepRows<'_>) {
        let decision_s = shared.period_steps as f32 * CONTROL_PERIOD_S;
        for (robot, action) in actions.chunks_exact(layout::COMMAND).enumerate() {
            let command = limited(action);
            let previous = self.robots[robot].previous_command;
            let change: f32 = command.iter().zip(previous).map(|(c, p)| (c - p) * (c - p)).sum();
            out.rewards[robot] = shared.config.command_rate * change * decision_s;
            self.robots[robot].previous_command = command;
            self.commands[robot] = command;
        }
        for _ in 0..shared.period_steps {
            self.control_step(shared, out.rewards);
        }
        for robot in 0..self.robots.len() {
            let guided = &self.robots[robot];
            let out_of_time = guided.step + guided.head_start >= shared.episode_steps;
            out.terminated[robot] = guided.fallen;
            out.truncated[robot] = out_of_time && !guided.fallen;
            let row = robot * OBSERVATION..(robot + 1) * OBSERVATION;
            if guided.broken {
                // As in locomotion it earns nothing, not even the price of a fall: its numbers are none.
                out.rewards[robot] = 0.0;
                out.last_observations[row.clone()].fill(0.0);
                self.metrics.broken += 1.0;
                self.reset(shared, robot);
            } else if guided.fallen || out_of_time {
                self.observe(shared, robot, &mut out.last_observations[row.clone()]);
                self.reset(shared, robot);
            } else {
                self.pull(shared, robot);
            }
            self.observe(shared, robot, &mut out.observations[row]);
        }
    }

    /// One control step: the reward of Table I, less drift, for everyone who has not fallen.
    fn control_step(&mut self, shared: &Shared<'_>, rewards: &mut [f32]) {
        let robots = &self.robots;
        self.squad.control_step(shared.course, &self.commands, |i| (robots[i].episode, robots[i].step));
        for (robot, guided) in self.robots.iter_mut().enumerate() {
            guided.step += 1;
            let behavior = Behavior::of_force_with_margin(guided.force, shared.config.threshold_margin_n);
            let mut reward = 0.0;
            guided.broken |= !self.squad.is_sound(robot);
            if !guided.fallen && self.squad.has_fallen(robot) {
                guided.fallen = true;
                self.metrics.falls += 1.0;
                rewards[robot] += shared.config.fall;
            }
            if !guided.fallen {
                let motion = self.squad.motion(robot);
                let [v_x, v_y, _] = motion.linear_velocity;
                let velocity = [v_x, v_y, motion.angular_velocity[2]];
                let target = behavior.target(guided.force);
                reward = behavior_reward(target, velocity);
                guided.drift.update(std::array::from_fn(|i| velocity[i] - target[i]));
                let heading = guided.drift.of_heading();
                rewards[robot] += shared.config.heading_drift * heading * CONTROL_PERIOD_S;
                self.metrics.add_drift(heading);
                if behavior.stays() {
                    let place = guided.drift.of_place();
                    rewards[robot] += shared.config.place_drift * place * CONTROL_PERIOD_S;
                }
            }
            rewards[robot] += reward * CONTROL_PERIOD_S;
            self.metrics.add(behavior, reward);
        }
    }
}

impl Archived for GuidedSquad {
    fn visit(&mut self, archive: &mut impl Archive) {
        self.squad.visit(archive);
        self.robots.iter_mut().for_each(|robot| robot.visit(archive));
    }
}

impl Archived for Guided {
    fn visit(&mut self, archive: &mut impl Archive) {
        for word in [&mut self.episode, &mut self.step, &mut self.head_start] {
            archive.u32(word);
        }
        archive.index(&mut self.level);
        archive.f32s(&mut self.force);
        archive.f32s(&mut self.previous_command);
        archive.f32s(&mut self.drift.mean);
        archive.flag(&mut self.fallen);
    }
}
