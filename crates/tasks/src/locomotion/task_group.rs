//! The episodes of sixteen robots: what they are told, what pushes them, what they get for it.

use policy::{StepRows, layout};
use spatial::{Philox, Purpose};
use terrain::{TerrainGrid, next_level};

use super::{
    LocomotionConfig, Terrain, Way, metrics::Metrics, reward::StepQuantities, robot_task::RobotTask,
};
use crate::{
    archive::{Archive, Archived},
    guidance::Behavior,
    simulation::{CONTACT_THRESHOLD_N, CONTROL_PERIOD_S, GROUP, Group, Simulation, control_steps},
};

const OBSERVATION: usize = layout::LOCOMOTION_OBSERVATION;

/// Sixteen robots and their episodes.
#[derive(Clone)]
pub(super) struct TaskGroup {
    pub(super) first_env: usize,
    pub(super) group: Group,
    pub(super) robots: Vec<RobotTask>,
    pub(super) metrics: Metrics,
}

/// What the groups need of the environment while they step side by side.
pub(super) struct Shared<'a> {
    pub(super) config: &'a LocomotionConfig,
    pub(super) seed: u64,
    pub(super) simulation: &'a Simulation,
    pub(super) grid: &'a TerrainGrid,
    /// Growth of the disturbances, 0 to 1.
    pub(super) progress: f32,
    /// Present strength of the penalties, 0 to 1.
    pub(super) penalty_scale: f32,
    pub(super) episode_steps: u32,
}

impl TaskGroup {
    fn random(&self, shared: &Shared<'_>, lane: usize, purpose: Purpose) -> Philox {
        let robot = &self.robots[lane];
        Philox::new(shared.seed, self.first_env + lane, robot.episode, robot.step, purpose)
    }

    /// Begins a new episode.
    pub(super) fn reset(&mut self, shared: &Shared<'_>, lane: usize) {
        self.robots[lane].episode += 1;
        self.robots[lane].step = 0;
        let mut random = self.random(shared, lane, Purpose::Reset);
        let robot = &mut self.robots[lane];
        robot.head_start = if robot.episode == 1 { random.below(shared.episode_steps) } else { 0 };
        robot.next_command = 0;
        robot.force_end = 0;
        robot.next_force = 0;
        robot.previous_action = [0.0; 12];
        robot.way = Way::default();
        let spawn = shared.grid.spawn(robot.level, robot.column);
        shared.simulation.reset(&mut self.group, lane, spawn, &shared.config.reset, &mut random);
        self.draw_command_and_force(shared, lane);
    }

    /// Where a robot is: x, y \[m\].
    fn place(&self, lane: usize) -> [f32; 2] {
        let [x, y, _] = self.group.base_motion(lane).position;
        [x, y]
    }

    /// Draws what is due at this step.
    fn draw_command_and_force(&mut self, shared: &Shared<'_>, lane: usize) {
        let step = self.robots[lane].step;
        if step >= self.robots[lane].next_command {
            let place = self.place(lane);
            let mut random = self.random(shared, lane, Purpose::Command);
            let config = &shared.config.command;
            let robot = &mut self.robots[lane];
            robot.tell(config.draw(&mut random), place);
            let [short, long] = config.period_s;
            robot.next_command = step + control_steps(random.uniform(short, long));
        }
        if step >= self.robots[lane].next_force {
            let place = self.place(lane);
            let mut random = self.random(shared, lane, Purpose::Disturbance);
            let drawn = shared.config.disturbance.draw(shared.progress, &mut random);
            let input = &mut self.group.block.input;
            input.base_force.set(lane, drawn.base_force.map(f64::from));
            input.hand_force.set(lane, drawn.hand_force.map(f64::from));
            let robot = &mut self.robots[lane];
            robot.force_end = step + control_steps(drawn.duration_s);
            robot.next_force = step + control_steps(drawn.period_s);
            if drawn.meant {
                // Also of a force that has yet to grow: at 0 it says to walk.
                robot.tell(Behavior::of_force(drawn.hand_force).target(drawn.hand_force), place);
                robot.next_command = robot.force_end.min(robot.next_force);
            }
        } else if step >= self.robots[lane].force_end {
            let input = &mut self.group.block.input;
            input.base_force.set(lane, [0.0; 3]);
            input.hand_force.set(lane, [0.0; 3]);
        }
    }

    pub(super) fn observe(&self, shared: &Shared<'_>, lane: usize, out: &mut [f32]) {
        let mut random = self.random(shared, lane, Purpose::Observation);
        let noise = shared.config.observation_noise;
        shared.simulation.sense(&self.group, lane, noise, &mut random, layout::LOCOMOTION_SCAN, out);
        out[layout::VELOCITY_COMMAND.range()].copy_from_slice(&self.robots[lane].command);
        out[layout::PREVIOUS_ACTION.range()].copy_from_slice(&self.robots[lane].previous_action);
    }

    /// One control step of all robots; rows of `out` are theirs.
    pub(super) fn step(&mut self, shared: &Shared<'_>, actions: &[f32], out: StepRows<'_>) {
        shared.simulation.control_step(&mut self.group, actions);
        for lane in 0..GROUP {
            let action: &[f32; 12] = actions[12 * lane..][..12].try_into().expect("twelve joints");
            self.robots[lane].step += 1;
            let sound = self.group.is_sound(lane);
            let fell = !sound || self.group.has_fallen(lane);
            // A robot whose state is no longer numbers is reset and counted; it earns nothing, its episode ends as by a fall.
            out.rewards[lane] = if sound { self.reward(shared, lane, action, fell) } else { 0.0 };
            self.robots[lane].previous_action = *action;
            let robot = &self.robots[lane];
            let out_of_time = robot.step + robot.head_start >= shared.episode_steps;
            out.terminated[lane] = fell;
            out.truncated[lane] = out_of_time && !fell;
            let row = lane * OBSERVATION..(lane + 1) * OBSERVATION;
            self.metrics.steps += 1.0;
            self.metrics.broken += f64::from(u8::from(!sound));
            if fell || out_of_time {
                self.metrics.falls += f64::from(u8::from(fell));
                if sound {
                    self.observe(shared, lane, &mut out.last_observations[row.clone()]);
                } else {
                    out.last_observations[row.clone()].fill(0.0);
                }
                self.change_level(shared, lane, sound);
                self.reset(shared, lane);
            } else {
                self.draw_command_and_force(shared, lane);
            }
            self.observe(shared, lane, &mut out.observations[row]);
        }
    }

    /// The terrain curriculum's rule at the end of an episode.
    fn change_level(&mut self, shared: &Shared<'_>, lane: usize, sound: bool) {
        if shared.config.terrain == Terrain::Flat || !sound {
            return;
        }
        let mut random = self.random(shared, lane, Purpose::Terrain);
        let robot = &mut self.robots[lane];
        let (progress, commanded) = (f64::from(robot.way.progress), f64::from(robot.way.commanded));
        robot.level = next_level(robot.level, progress, commanded, shared.grid.levels(), &mut random);
    }

    fn reward(&mut self, shared: &Shared<'_>, lane: usize, action: &[f32; 12], fell: bool) -> f32 {
        let motion = self.group.base_motion(lane);
        let robot = &mut self.robots[lane];
        let command = shared.config.command.meant(robot.command);
        robot.way.walk(command, &motion);
        let Group { block, contacts, previous_joint_velocity } = &self.group;
        let number = |lanes: &spatial::f32x16| lanes.as_array()[lane];
        let position: [f32; 12] = std::array::from_fn(|j| number(&block.state.joint_position[j]));
        let default = &shared.simulation.default_joint_position;
        let acceleration = std::array::from_fn(|j| {
            (number(&block.state.joint_velocity[j]) - number(&previous_joint_velocity[j])) / CONTROL_PERIOD_S
        });
        let ([v_x, v_y, _], [x, y, _]) = (motion.linear_velocity, motion.position);
        let velocity = [v_x, v_y, motion.angular_velocity[2]];
        let mean_error = robot.mean_error.update(std::array::from_fn(|i| velocity[i] - command[i]));
        let hand_touches = contacts.hand_force[lane] > CONTACT_THRESHOLD_N;
        let quantities = StepQuantities {
            motion,
            command,
            mean_error,
            displacement: (x - robot.told_at[0]).hypot(y - robot.told_at[1]),
            joint_offset: &std::array::from_fn(|j| position[j] - default[j]),
            joint_acceleration: &acceleration,
            joint_torque: &std::array::from_fn(|j| number(&block.output.joint_torque[j])),
            joint_excess: joint_excess(shared.simulation, &position),
            action,
            previous_action: &self.robots[lane].previous_action,
            touchdown: std::array::from_fn(|foot| contacts.touchdown[foot][lane]),
            carries: std::array::from_fn(|foot| contacts.carries[foot][lane]),
            stumbles: std::array::from_fn(|foot| contacts.stumbles[foot][lane]),
            undesired_contacts: contacts.legs_touching[lane] + f32::from(u8::from(hand_touches)),
        };
        let terms = shared.config.reward.terms(&quantities, shared.penalty_scale, CONTROL_PERIOD_S);
        self.metrics.add(&quantities, &terms);
        shared.config.reward.total(&terms, fell)
    }
}

impl Archived for TaskGroup {
    fn visit(&mut self, archive: &mut impl Archive) {
        self.group.visit(archive);
        self.robots.iter_mut().for_each(|robot| robot.visit(archive));
    }
}

/// Radians beyond 95 % of the joints' ranges, summed.
fn joint_excess(simulation: &Simulation, position: &[f32; 12]) -> f32 {
    let excess = |(joint, &q): (&robot::Joint, &f32)| {
        let (lower, upper) = joint.position_limits;
        let (center, half) = (0.5 * (lower + upper), 0.475 * (upper - lower));
        ((f64::from(q) - center).abs() - half).max(0.0) as f32
    };
    simulation.robot().joints.iter().zip(position).map(excess).sum()
}
