//! Many robots learning to walk.

use std::sync::Arc;

use policy::{Mirror, Share, StepBuffers, VecEnv, layout};
use rayon::prelude::*;
use spatial::{Philox, Purpose};
use terrain::{HeightField, TerrainGrid, next_level};

use super::{
    LocomotionConfig, Terrain, Way, metrics::Metrics, reward::StepQuantities, robot_task::RobotTask,
};
use crate::{
    archive::{Archive, Archived, Reader, Writer},
    simulation::{ACTION_SCALE, CONTACT_THRESHOLD_N, CONTROL_PERIOD_S, GROUP, Group, Simulation},
    view::View,
};

const OBSERVATION: usize = layout::LOCOMOTION_OBSERVATION;
/// Version of the saved state.
const STATE_VERSION: u32 = 3;

/// The locomotion task for a number of robots.
pub struct LocomotionEnv {
    config: LocomotionConfig,
    seed: u64,
    simulation: Simulation,
    grid: TerrainGrid,
    groups: Vec<TaskGroup>,
    /// Robots of all shares.
    total_envs: usize,
    /// Control steps during which robots walked as told, and those not yet judged.
    walked_steps: u32,
    new_steps: u32,
}

/// Sixteen robots and their episodes.
#[derive(Clone)]
struct TaskGroup {
    first_env: usize,
    group: Group,
    robots: Vec<RobotTask>,
    metrics: Metrics,
}

/// What the groups need of the environment while they step side by side.
struct Shared<'a> {
    config: &'a LocomotionConfig,
    seed: u64,
    simulation: &'a Simulation,
    grid: &'a TerrainGrid,
    /// Growth of the disturbances, 0 to 1.
    progress: f32,
    /// Present strength of the penalties, 0 to 1.
    penalty_scale: f32,
    episode_steps: u32,
}

impl LocomotionEnv {
    /// `num_envs` robots, a multiple of sixteen.
    ///
    /// # Errors
    /// Names the value that is out of range, and what is allowed.
    pub fn new(config: LocomotionConfig, num_envs: usize, seed: u64) -> Result<Self, String> {
        Self::with_share(config, Share::whole(num_envs), seed)
    }

    /// Some of the robots of a training, whole groups of sixteen.
    ///
    /// # Errors
    /// Names the value that is out of range, and what is allowed.
    pub fn with_share(config: LocomotionConfig, share: Share, seed: u64) -> Result<Self, String> {
        config.validate()?;
        let grid = config.terrain.grid(seed)?;
        let simulation = Simulation::new(grid.field.clone(), config.physics());
        let groups = simulation.groups(share.envs.clone(), &config.randomization, seed)?;
        let with_task = |(index, group): (usize, Group)| {
            let first_env = share.envs.start + index * GROUP;
            let robot = |lane: usize| {
                let env = first_env + lane;
                let mut random = Philox::new(seed, env, 0, 1, Purpose::Environment);
                let levels = grid.levels().min(config.max_initial_level + 1);
                RobotTask {
                    level: random.below(levels as u32) as usize,
                    column: grid.column_of_env(env, share.total),
                    ..RobotTask::default()
                }
            };
            TaskGroup {
                first_env,
                group,
                robots: (0..GROUP).map(robot).collect(),
                metrics: Metrics::default(),
            }
        };
        let groups = groups.into_iter().enumerate().map(with_task).collect();
        let total_envs = share.total;
        Ok(Self { config, seed, simulation, grid, groups, total_envs, walked_steps: 0, new_steps: 0 })
    }

    fn split(&mut self) -> (Shared<'_>, &mut [TaskGroup]) {
        let grown =
            |ramp: u32| if ramp == 0 { 1.0 } else { (self.walked_steps as f32 / ramp as f32).min(1.0) };
        let reward = &self.config.reward;
        let shared = Shared {
            config: &self.config,
            seed: self.seed,
            simulation: &self.simulation,
            grid: &self.grid,
            progress: grown(self.config.disturbance.ramp_steps),
            penalty_scale: reward.penalty_scale_at(grown(reward.penalty_ramp_steps)),
            episode_steps: steps(self.config.episode_s),
        };
        (shared, &mut self.groups)
    }
}

/// Control steps in a time \[s\], at least one.
fn steps(time_s: f32) -> u32 {
    ((time_s / CONTROL_PERIOD_S).round() as u32).max(1)
}

impl TaskGroup {
    fn random(&self, shared: &Shared<'_>, lane: usize, purpose: Purpose) -> Philox {
        let robot = &self.robots[lane];
        Philox::new(shared.seed, self.first_env + lane, robot.episode, robot.step, purpose)
    }

    /// Begins a new episode.
    fn reset(&mut self, shared: &Shared<'_>, lane: usize) {
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

    /// Draws what is due at this step.
    fn draw_command_and_force(&mut self, shared: &Shared<'_>, lane: usize) {
        let step = self.robots[lane].step;
        if step >= self.robots[lane].next_command {
            let mut random = self.random(shared, lane, Purpose::Command);
            let config = &shared.config.command;
            let robot = &mut self.robots[lane];
            robot.command = config.draw(&mut random);
            let [short, long] = config.period_s;
            robot.next_command = step + steps(random.uniform(short, long));
        }
        let input = &mut self.group.block.input;
        if step >= self.robots[lane].next_force {
            let mut random = self.random(shared, lane, Purpose::Disturbance);
            let drawn = shared.config.disturbance.draw(shared.progress, &mut random);
            let input = &mut self.group.block.input;
            input.base_force.set(lane, drawn.base_force.map(f64::from));
            input.hand_force.set(lane, drawn.hand_force.map(f64::from));
            let robot = &mut self.robots[lane];
            robot.force_end = step + steps(drawn.duration_s);
            robot.next_force = step + steps(drawn.period_s);
        } else if step >= self.robots[lane].force_end {
            input.base_force.set(lane, [0.0; 3]);
            input.hand_force.set(lane, [0.0; 3]);
        }
    }

    fn observe(&self, shared: &Shared<'_>, lane: usize, out: &mut [f32]) {
        let mut random = self.random(shared, lane, Purpose::Observation);
        let noise = shared.config.observation_noise;
        shared.simulation.sense(&self.group, lane, noise, &mut random, layout::LOCOMOTION_SCAN, out);
        out[layout::VELOCITY_COMMAND.range()].copy_from_slice(&self.robots[lane].command);
        out[layout::PREVIOUS_ACTION.range()].copy_from_slice(&self.robots[lane].previous_action);
    }

    /// One control step of all robots; rows of `out` are theirs.
    fn step(&mut self, shared: &Shared<'_>, actions: &[f32], out: GroupBuffers<'_>) {
        shared.simulation.control_step(&mut self.group, actions);
        for lane in 0..GROUP {
            let action: &[f32; 12] = actions[12 * lane..][..12].try_into().expect("twelve joints");
            self.robots[lane].step += 1;
            let sound = self.group.is_sound(lane);
            let fell = !sound || self.group.has_fallen(lane);
            // A robot whose state is no longer numbers is reset and counted; it neither earns nor teaches.
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
        robot.way.walk(robot.command, &motion);
        let Group { block, contacts, previous_joint_velocity } = &self.group;
        let number = |lanes: &spatial::f32x16| lanes.as_array()[lane];
        let position: [f32; 12] = std::array::from_fn(|j| number(&block.state.joint_position[j]));
        let default = &shared.simulation.default_joint_position;
        let acceleration = std::array::from_fn(|j| {
            (number(&block.state.joint_velocity[j]) - number(&previous_joint_velocity[j])) / CONTROL_PERIOD_S
        });
        let hand_touches = contacts.hand_force[lane] > CONTACT_THRESHOLD_N;
        let quantities = StepQuantities {
            motion,
            command: shared.config.command.meant(self.robots[lane].command),
            joint_offset: &std::array::from_fn(|j| position[j] - default[j]),
            joint_acceleration: &acceleration,
            joint_torque: &std::array::from_fn(|j| number(&block.output.joint_torque[j])),
            joint_excess: joint_excess(shared.simulation, &position),
            action,
            previous_action: &self.robots[lane].previous_action,
            touchdown: std::array::from_fn(|foot| contacts.touchdown[foot][lane]),
            carries: std::array::from_fn(|foot| contacts.carries[foot][lane]),
            undesired_contacts: contacts.legs_touching[lane] + f32::from(u8::from(hand_touches)),
        };
        let terms = shared.config.reward.terms(&quantities, shared.penalty_scale, CONTROL_PERIOD_S);
        self.metrics.add(&quantities, &terms);
        shared.config.reward.total(&terms, fell)
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

/// The rows of one group in the step's buffers.
struct GroupBuffers<'a> {
    observations: &'a mut [f32],
    rewards: &'a mut [f32],
    terminated: &'a mut [bool],
    truncated: &'a mut [bool],
    last_observations: &'a mut [f32],
}

impl View for LocomotionEnv {
    fn ground(&self) -> &Arc<HeightField> {
        &self.grid.field
    }

    fn step_s(&self) -> f32 {
        CONTROL_PERIOD_S
    }

    fn write_view(&self, robot: usize, out: &mut Vec<f32>) {
        let (group, lane) = (&self.groups[robot / GROUP], robot % GROUP);
        group.group.write_view(lane, group.robots[lane].command, out);
    }
}

impl VecEnv for LocomotionEnv {
    fn num_envs(&self) -> usize {
        self.groups.len() * GROUP
    }

    fn observation_dim(&self) -> usize {
        OBSERVATION
    }

    fn action_dim(&self) -> usize {
        layout::JOINTS
    }

    /// legged_gym's factors, which learned where raw observations did not; but 2 instead of 5 for the height scan, whose errors would
    /// otherwise make up most of the input.
    fn observation_scale(&self) -> Vec<f32> {
        let mut scale = vec![1.0; OBSERVATION];
        scale[layout::BASE_LINEAR_VELOCITY.range()].fill(2.0);
        scale[layout::BASE_ANGULAR_VELOCITY.range()].fill(0.25);
        scale[layout::VELOCITY_COMMAND.range()].copy_from_slice(&[2.0, 2.0, 0.25]);
        scale[layout::JOINT_VELOCITY.range()].fill(0.05);
        scale[layout::LOCOMOTION_SCAN.range()].fill(2.0);
        scale
    }

    fn mirror(&self) -> Option<Mirror> {
        Some(layout::locomotion_mirror())
    }

    fn metadata(&self) -> Vec<(String, String)> {
        let robot = self.simulation.robot();
        let actuator = &self.simulation.engine.config.actuator;
        let list = |values: Vec<String>| values.join(",");
        let each = |value: f64| list(vec![value.to_string(); robot.joints.len()]);
        let default = &self.simulation.default_joint_position;
        let pairs = [
            ("joint_names", list(robot.joints.iter().map(|joint| joint.name.clone()).collect())),
            ("default_joint_pos", list(default.iter().map(f32::to_string).collect())),
            ("action_scale", ACTION_SCALE.to_string()),
            ("joint_stiffness", each(actuator.stiffness)),
            ("joint_damping", each(actuator.damping)),
            ("joint_effort_limit", each(actuator.effort_limit)),
            ("joint_armature", list(robot.joints.iter().map(|joint| joint.armature.to_string()).collect())),
            ("actuator", "dc_motor".into()),
            ("saturation_torque", actuator.saturation_torque.to_string()),
            ("velocity_limit", actuator.velocity_limit.to_string()),
            ("observation_names", list(layout::LOCOMOTION.iter().map(|s| s.name.to_owned()).collect())),
            ("control_period", CONTROL_PERIOD_S.to_string()),
        ];
        pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    fn reset(&mut self, observations: &mut [f32]) {
        let (shared, groups) = self.split();
        groups.par_iter_mut().zip(observations.par_chunks_mut(GROUP * OBSERVATION)).for_each(
            |(group, rows)| {
                for (lane, row) in rows.chunks_exact_mut(OBSERVATION).enumerate() {
                    group.reset(&shared, lane);
                    group.observe(&shared, lane, row);
                }
            },
        );
    }

    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        self.new_steps += 1;
        let (shared, groups) = self.split();
        groups
            .par_iter_mut()
            .zip(actions.par_chunks(GROUP * layout::JOINTS))
            .zip(out.observations.par_chunks_mut(GROUP * OBSERVATION))
            .zip(out.last_observations.par_chunks_mut(GROUP * OBSERVATION))
            .zip(out.rewards.par_chunks_mut(GROUP))
            .zip(out.terminated.par_chunks_mut(GROUP))
            .zip(out.truncated.par_chunks_mut(GROUP))
            .for_each(|rows| {
                let (((((chunk, observations), last_observations), rewards), terminated), truncated) = rows;
                let (group, actions) = chunk;
                let out = GroupBuffers { observations, rewards, terminated, truncated, last_observations };
                group.step(&shared, actions, out);
            });
    }

    fn take_sums(&mut self) -> Vec<f64> {
        let sums = |group: &mut TaskGroup| {
            group.metrics.levels = group.robots.iter().map(|robot| robot.level as f64).sum();
            std::mem::take(&mut group.metrics).to_sums()
        };
        self.groups.iter_mut().flat_map(sums).collect()
    }

    fn report(&mut self, sums: &[f64]) -> Vec<(String, f64)> {
        let mut total = Metrics::default();
        sums.as_chunks().0.iter().for_each(|sums| total.merge(&Metrics::from_sums(sums)));
        let new_steps = std::mem::take(&mut self.new_steps);
        if total.linear_tracking() >= f64::from(self.config.ramp_tracking) {
            self.walked_steps = self.walked_steps.saturating_add(new_steps);
        }
        let mut named = total.named();
        named.push(("terrain_level".into(), total.levels / self.total_envs as f64));
        named
    }

    fn save_state(&self, out: &mut Vec<u8>) {
        let mut writer = Writer(out);
        writer.u32(&mut STATE_VERSION.clone());
        writer.u32(&mut self.walked_steps.clone());
        writer.u32(&mut self.new_steps.clone());
        for group in &self.groups {
            let mut group = group.clone();
            group.group.visit(&mut writer);
            group.robots.iter_mut().for_each(|robot| robot.visit(&mut writer));
        }
    }

    fn common_state_len(&self) -> usize {
        size_of_val(&STATE_VERSION) + size_of_val(&self.walked_steps) + size_of_val(&self.new_steps)
    }

    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut reader = Reader::new(bytes);
        let mut version = 0;
        reader.u32(&mut version);
        if version != STATE_VERSION {
            return Err(format!("version is {version}, must be {STATE_VERSION}"));
        }
        reader.u32(&mut self.walked_steps);
        reader.u32(&mut self.new_steps);
        for group in &mut self.groups {
            group.group.visit(&mut reader);
            group.robots.iter_mut().for_each(|robot| robot.visit(&mut reader));
        }
        reader.finish()
    }
}

#[cfg(test)]
mod non_finite;
