//! Many robots learning to walk.

use std::sync::Arc;

use policy::{Mirror, Share, StepBuffers, StepRows, VecEnv, layout};
use rayon::prelude::*;
use spatial::{Philox, Purpose};
use terrain::{HeightField, TerrainGrid};

use super::{
    LocomotionConfig,
    metrics::Metrics,
    robot_task::RobotTask,
    task_group::{Shared, TaskGroup},
};
use crate::{
    archive::{Archive as _, Archived as _, Reader, Writer},
    simulation::{ACTION_SCALE, ACTUATOR, CONTROL_PERIOD_S, GROUP, Group, Simulation, control_steps},
    view::View,
};

const OBSERVATION: usize = layout::LOCOMOTION_OBSERVATION;
/// Version of the saved state.
const STATE_VERSION: u32 = 4;

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
        let grid = config.terrain.grid(&config.terrain_shares, seed)?;
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
            episode_steps: control_steps(self.config.episode_s),
        };
        (shared, &mut self.groups)
    }
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

    /// legged_gym's factors, which learned where raw observations did not; but [`LocomotionConfig::scan_scale`] for the height scan,
    /// whose errors would at 5 make up most of the input.
    fn observation_scale(&self) -> Vec<f32> {
        let mut scale = vec![1.0; OBSERVATION];
        scale[layout::BASE_LINEAR_VELOCITY.range()].fill(2.0);
        scale[layout::BASE_ANGULAR_VELOCITY.range()].fill(0.25);
        scale[layout::VELOCITY_COMMAND.range()].copy_from_slice(&[2.0, 2.0, 0.25]);
        scale[layout::JOINT_VELOCITY.range()].fill(0.05);
        scale[layout::LOCOMOTION_SCAN.range()].fill(self.config.scan_scale);
        scale
    }

    fn mirror(&self) -> Option<Mirror> {
        Some(layout::locomotion_mirror())
    }

    fn metadata(&self) -> Vec<(String, String)> {
        let robot = self.simulation.robot();
        let actuator = &self.simulation.engine.config().actuator;
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
            ("actuator", ACTUATOR.into()),
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
        let rows: Vec<StepRows<'_>> = out.parts(GROUP).collect();
        groups
            .par_iter_mut()
            .zip(actions.par_chunks(GROUP * layout::JOINTS))
            .zip(rows)
            .for_each(|((group, actions), rows)| group.step(&shared, actions, rows));
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
            group.clone().visit(&mut writer);
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
            group.visit(&mut reader);
        }
        reader.finish()
    }
}

#[cfg(test)]
mod contract;
#[cfg(test)]
mod meant_pulls;
#[cfg(test)]
mod scan_scale;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{falls, locomotion::Terrain, non_finite};

    #[test]
    fn a_robot_that_is_no_longer_numbers_is_reset_and_counted_and_nobody_else_notices() {
        let make = || LocomotionEnv::new(LocomotionConfig::default(), non_finite::ENVS, 3).unwrap();
        let rewards = non_finite::only_the_spoilt_robot_notices(make, |env, robot| {
            &mut env.groups[robot / GROUP].group
        });
        assert!(rewards.iter().all(|&reward| reward == 0.0), "{rewards:?}");
    }

    #[test]
    fn a_robot_that_tips_over_ends_and_pays() {
        let make = |fall| {
            let mut config = LocomotionConfig { terrain: Terrain::Flat, ..LocomotionConfig::default() };
            config.reward.fall = fall;
            LocomotionEnv::new(config, falls::ENVS, 3).unwrap()
        };
        falls::a_robot_that_tips_over_ends_and_pays(make, |env| &mut env.groups[0].group);
    }

    /// Commands to stand are small numbers, not zeros; nobody who obeys them has a way to make good.
    #[test]
    fn robots_told_to_stand_that_stand_keep_their_level() {
        let mut config = LocomotionConfig { episode_s: 1.0, ..LocomotionConfig::default() };
        (config.command.standing_share, config.command.spinning_share, config.command.guiding_share) =
            (1.0, 0.0, 0.0);
        let mut env = LocomotionEnv::new(config, 64, 3).unwrap();
        let levels = |env: &LocomotionEnv| -> Vec<usize> {
            env.groups.iter().flat_map(|group| group.robots.iter().map(|robot| robot.level)).collect()
        };
        let mut buffers = StepBuffers::new(64, OBSERVATION);
        env.reset(&mut buffers.observations);
        let before = levels(&env);
        let mut ended = [false; 64];
        for _ in 0..60 {
            env.step(&[0.0; 64 * 12], &mut buffers);
            let over = buffers.truncated.iter().zip(&buffers.terminated).map(|(a, b)| a | b);
            ended.iter_mut().zip(over).for_each(|(ended, over)| *ended |= over);
        }
        assert!(ended.iter().all(|ended| *ended) && before.iter().any(|level| *level > 0), "{before:?}");
        assert_eq!(levels(&env), before);
    }
}
