//! Many robots whose supervisors learn to obey the hand.

use std::sync::Arc;

use policy::{Mirror, Share, StepBuffers, VecEnv, layout};
use rayon::prelude::*;
use spatial::{Philox, Purpose};
use terrain::{HeightField, TerrainGrid};

use super::{
    Behavior, Course, GuidanceConfig, LocomotionPolicy, Squad, behavior_reward,
    config::{COMMAND_HIGH, COMMAND_LOW, control_steps},
    heading_drift::HeadingDrift,
    metrics::Metrics,
};
use crate::{
    archive::{Archive, Archived, Reader, Writer},
    simulation::{CONTROL_PERIOD_S, Simulation},
    view::View,
};

const OBSERVATION: usize = layout::SUPERVISOR_OBSERVATION;
/// Version of the saved state.
const STATE_VERSION: u32 = 3;

/// The guidance task for a number of robots.
pub struct GuidanceEnv {
    config: GuidanceConfig,
    seed: u64,
    course: Course,
    grid: TerrainGrid,
    squads: Vec<GuidedSquad>,
}

/// A squad and what its handlers want.
#[derive(Clone)]
struct GuidedSquad {
    squad: Squad,
    robots: Vec<Guided>,
    /// Commands held between two decisions.
    commands: Vec<[f32; 3]>,
    metrics: Metrics,
}

/// One robot's episode.
#[derive(Clone, Debug, Default)]
struct Guided {
    /// Episodes begun.
    episode: u32,
    /// Control steps of this episode.
    step: u32,
    /// Steps it counts as having lived before, so that episodes do not all end together.
    head_start: u32,
    level: usize,
    column: usize,
    /// Scripted force of the hand, heading frame \[N\].
    force: [f32; 3],
    /// The last command, as limited.
    previous_command: [f32; 3],
    drift: HeadingDrift,
    fallen: bool,
}

/// What squads need of the environment while they step side by side.
struct Shared<'a> {
    config: &'a GuidanceConfig,
    seed: u64,
    course: &'a Course,
    grid: &'a TerrainGrid,
    episode_steps: u32,
    period_steps: u32,
    pull_steps: u32,
}

impl GuidanceEnv {
    /// `num_envs` robots, a multiple of sixteen, walked by `locomotion`.
    ///
    /// # Errors
    /// Names the value that is out of range, and what is allowed.
    pub fn new(
        config: GuidanceConfig,
        locomotion: LocomotionPolicy,
        num_envs: usize,
        seed: u64,
    ) -> Result<Self, String> {
        Self::with_share(config, locomotion, Share::whole(num_envs), seed)
    }

    /// Some of the robots of a training: whole squads, but for the last.
    ///
    /// # Errors
    /// Names the value that is out of range, and what is allowed.
    pub fn with_share(
        config: GuidanceConfig,
        locomotion: LocomotionPolicy,
        share: Share,
        seed: u64,
    ) -> Result<Self, String> {
        config.validate()?;
        let grid = config.terrain.grid(seed)?;
        let simulation = Simulation::new(grid.field.clone(), locomotion.physics());
        let observation_noise = config.observation_noise;
        let course = Course { simulation, policy: locomotion, observation_noise, seed };
        let guided = |squad: Squad| {
            let robot = |i: usize| Guided {
                column: grid.column_of_env(squad.first_robot + i, share.total),
                ..Guided::default()
            };
            let robots = squad.robots();
            GuidedSquad {
                robots: (0..robots).map(robot).collect(),
                commands: vec![[0.0; 3]; robots],
                metrics: Metrics::default(),
                squad,
            }
        };
        let squads = course.squads_of(share.envs, &config.randomization)?;
        let squads = squads.into_iter().map(guided).collect();
        Ok(Self { config, seed, course, grid, squads })
    }

    fn split(&mut self) -> (Shared<'_>, &mut [GuidedSquad]) {
        let shared = Shared {
            config: &self.config,
            seed: self.seed,
            course: &self.course,
            grid: &self.grid,
            episode_steps: control_steps(self.config.episode_s),
            period_steps: control_steps(self.config.supervisor_period_s),
            pull_steps: control_steps(self.config.pull.period_s),
        };
        (shared, &mut self.squads)
    }
}

/// An action within the limits of a command; what is no number becomes the lower limit.
fn limited(action: &[f32]) -> [f32; 3] {
    std::array::from_fn(|i| action[i].max(COMMAND_LOW[i]).min(COMMAND_HIGH[i]))
}

impl GuidedSquad {
    fn random(&self, shared: &Shared<'_>, robot: usize, purpose: Purpose) -> Philox {
        let Guided { episode, step, .. } = self.robots[robot];
        Philox::new(shared.seed, self.squad.first_robot + robot, episode, step, purpose)
    }

    /// Begins a new episode.
    fn reset(&mut self, shared: &Shared<'_>, robot: usize) {
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

    /// Draws the force where one is due.
    fn pull(&mut self, shared: &Shared<'_>, robot: usize) {
        if self.robots[robot].step.is_multiple_of(shared.pull_steps) {
            let force = shared.config.pull.draw(&mut self.random(shared, robot, Purpose::Command));
            self.robots[robot].force = force;
            self.squad.set_hand_force(robot, force);
        }
    }

    fn observe(&self, shared: &Shared<'_>, robot: usize, out: &mut [f32]) {
        let guided = &self.robots[robot];
        let mut random = self.random(shared, robot, Purpose::SupervisorObservation);
        let noise = shared.config.pull.noise_n;
        let seen = guided.force.map(|f| if noise > 0.0 { f + random.uniform(-noise, noise) } else { f });
        self.squad.sense(shared.course, robot, seen, guided.previous_command, &mut random, out);
    }

    /// One decision of every supervisor and the control steps it holds for.
    fn step(&mut self, shared: &Shared<'_>, actions: &[f32], out: SquadBuffers<'_>) {
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
            if guided.fallen || out_of_time {
                if self.squad.is_sound(robot) {
                    self.observe(shared, robot, &mut out.last_observations[row.clone()]);
                } else {
                    out.last_observations[row.clone()].fill(0.0);
                    self.metrics.broken += 1.0;
                }
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
                let drift = guided.drift.update(velocity[2] - target[2]);
                rewards[robot] += shared.config.heading_drift * drift * CONTROL_PERIOD_S;
                self.metrics.add_drift(drift);
            }
            rewards[robot] += reward * CONTROL_PERIOD_S;
            self.metrics.add(behavior, reward);
        }
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
        archive.f32(&mut self.drift.mean);
        archive.flag(&mut self.fallen);
    }
}

/// The rows of one squad in the step's buffers.
struct SquadBuffers<'a> {
    observations: &'a mut [f32],
    rewards: &'a mut [f32],
    terminated: &'a mut [bool],
    truncated: &'a mut [bool],
    last_observations: &'a mut [f32],
}

impl View for GuidanceEnv {
    fn ground(&self) -> &Arc<HeightField> {
        &self.grid.field
    }

    fn step_s(&self) -> f32 {
        self.config.supervisor_period_s
    }

    fn write_view(&self, robot: usize, out: &mut Vec<f32>) {
        let (squad, index) = (&self.squads[robot / super::SQUAD], robot % super::SQUAD);
        squad.squad.write_view(index, squad.robots[index].previous_command, out);
    }
}

impl VecEnv for GuidanceEnv {
    fn num_envs(&self) -> usize {
        self.squads.iter().map(|squad| squad.robots.len()).sum()
    }

    fn observation_dim(&self) -> usize {
        OBSERVATION
    }

    fn action_dim(&self) -> usize {
        layout::COMMAND
    }

    /// As in locomotion, with 5 N as the unit of force, a quarter of Table II's smaller threshold, so that its steps are steep enough to learn.
    fn observation_scale(&self) -> Vec<f32> {
        let mut scale = vec![1.0; OBSERVATION];
        scale[layout::BASE_LINEAR_VELOCITY.range()].fill(2.0);
        scale[layout::BASE_ANGULAR_VELOCITY.range()].fill(1.0);
        scale[layout::HARNESS_FORCE.range()].fill(1.0 / 5.0);
        scale[layout::JOINT_VELOCITY.range()].fill(0.05);
        scale
    }

    fn mirror(&self) -> Option<Mirror> {
        Some(layout::supervisor_mirror())
    }

    fn output_limits(&self) -> Option<(Vec<f32>, Vec<f32>)> {
        Some((COMMAND_LOW.to_vec(), COMMAND_HIGH.to_vec()))
    }

    fn metadata(&self) -> Vec<(String, String)> {
        let robot = self.course.simulation.robot();
        let harness = robot.harness.unwrap_or_default();
        let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let floats = |values: [f32; 3]| values.map(|value| value.to_string()).join(",");
        let pairs = [
            ("observation_names", layout::SUPERVISOR.map(|segment| segment.name).join(",")),
            ("control_period", self.config.supervisor_period_s.to_string()),
            ("command_low", floats(COMMAND_LOW)),
            ("command_high", floats(COMMAND_HIGH)),
            ("bar_start", list(&harness.bar_start.to_array())),
            ("bar_length", harness.bar_length.to_string()),
            ("hand_position", list(&harness.hand_position().to_array())),
            ("bar_mass", harness.bar_mass.to_string()),
            ("hand_mass", harness.hand_mass.to_string()),
        ];
        pairs.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
    }

    fn reset(&mut self, observations: &mut [f32]) {
        let (shared, squads) = self.split();
        let rows = observations.par_chunks_mut(super::SQUAD * OBSERVATION);
        squads.par_iter_mut().zip(rows).for_each(|(squad, rows)| {
            for (robot, row) in rows.chunks_exact_mut(OBSERVATION).enumerate() {
                squad.reset(&shared, robot);
                squad.observe(&shared, robot, row);
            }
        });
    }

    fn step(&mut self, actions: &[f32], out: &mut StepBuffers) {
        let (shared, squads) = self.split();
        const SQUAD: usize = super::SQUAD;
        squads
            .par_iter_mut()
            .zip(actions.par_chunks(SQUAD * layout::COMMAND))
            .zip(out.observations.par_chunks_mut(SQUAD * OBSERVATION))
            .zip(out.last_observations.par_chunks_mut(SQUAD * OBSERVATION))
            .zip(out.rewards.par_chunks_mut(SQUAD))
            .zip(out.terminated.par_chunks_mut(SQUAD))
            .zip(out.truncated.par_chunks_mut(SQUAD))
            .for_each(|rows| {
                let (((((chunk, observations), last_observations), rewards), terminated), truncated) = rows;
                let (squad, actions) = chunk;
                let out = SquadBuffers { observations, rewards, terminated, truncated, last_observations };
                squad.step(&shared, actions, out);
            });
    }

    fn take_sums(&mut self) -> Vec<f64> {
        self.squads.iter_mut().flat_map(|squad| std::mem::take(&mut squad.metrics).to_sums()).collect()
    }

    fn report(&mut self, sums: &[f64]) -> Vec<(String, f64)> {
        let mut total = Metrics::default();
        sums.as_chunks().0.iter().for_each(|sums| total.merge(&Metrics::from_sums(sums)));
        total.named()
    }

    fn common_state_len(&self) -> usize {
        size_of_val(&STATE_VERSION)
    }

    fn save_state(&self, out: &mut Vec<u8>) {
        let mut writer = Writer(out);
        writer.u32(&mut STATE_VERSION.clone());
        for squad in &self.squads {
            let mut squad = squad.clone();
            squad.squad.visit(&mut writer);
            squad.robots.iter_mut().for_each(|robot| robot.visit(&mut writer));
        }
    }

    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut reader = Reader::new(bytes);
        let mut version = 0;
        reader.u32(&mut version);
        if version != STATE_VERSION {
            return Err(format!("version is {version}, must be {STATE_VERSION}"));
        }
        for squad in &mut self.squads {
            squad.squad.visit(&mut reader);
            squad.robots.iter_mut().for_each(|robot| robot.visit(&mut reader));
        }
        reader.finish()
    }
}

#[cfg(test)]
mod non_finite;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{guidance::test_policy, locomotion::Terrain};

    fn env(config: GuidanceConfig) -> GuidanceEnv {
        let config = GuidanceConfig { terrain: Terrain::Flat, ..config };
        GuidanceEnv::new(config, LocomotionPolicy::new(test_policy()).unwrap(), 144, 3).unwrap()
    }

    fn run(env: &mut GuidanceEnv, buffers: &mut StepBuffers, steps: usize) {
        for step in 0..steps {
            let actions: Vec<f32> = (0..144 * 3).map(|i| ((i + step) as f32).sin()).collect();
            env.step(&actions, buffers);
        }
    }

    #[test]
    fn a_standing_robot_earns_by_hand_what_table_one_says_of_its_pull() {
        let pull = super::super::PullConfig {
            x_n: [-60.0, -60.0],
            y_n: [0.0, 0.0],
            z_n: [0.0, 0.0],
            near_threshold_share: 0.0,
            ..Default::default()
        };
        let reset = crate::simulation::ResetSpread::standing();
        let config = GuidanceConfig { pull, reset, observation_noise: 0.0, ..GuidanceConfig::default() };
        let mut env = env(GuidanceConfig { command_rate: -1.0, ..config });
        let mut buffers = StepBuffers::new(144, OBSERVATION);
        env.reset(&mut buffers.observations);
        assert_eq!(buffers.observations[layout::HARNESS_FORCE.range()], [-60.0, 0.0, 0.0]);
        for _ in 0..10 {
            env.step(&[0.0; 144 * 3], &mut buffers);
        }
        // Told to stop, it stands still: nearly everything there is, 0.1 a decision.
        let mean = buffers.rewards.iter().sum::<f32>() / 144.0;
        assert!(mean > 0.08 && mean <= 0.1, "{mean}");
        let before = buffers.rewards.clone();
        env.step(&[9.0, 0.0, 0.0].repeat(144), &mut buffers);
        let goes_on = |robot: &usize| !buffers.terminated[*robot] && !buffers.truncated[*robot];
        let robot = (0..144).find(goes_on).expect("not all episodes end at once");
        // The command is limited to 1.2 m/s before it is fined, once.
        let fine = before[robot] - buffers.rewards[robot];
        assert!((fine - 1.44 * 0.1).abs() < 0.02, "{fine}");
        let observation = &buffers.observations[robot * OBSERVATION..];
        assert_eq!(observation[layout::PREVIOUS_COMMAND.range()], [1.2, 0.0, 0.0]);
    }

    #[test]
    fn the_same_bits_for_any_number_of_threads_and_after_a_resume() {
        let after = |threads: usize, cut: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let mut first = env(GuidanceConfig::default());
                let mut buffers = StepBuffers::new(144, OBSERVATION);
                first.reset(&mut buffers.observations);
                run(&mut first, &mut buffers, cut);
                let mut state = Vec::new();
                first.save_state(&mut state);
                let mut second = env(GuidanceConfig::default());
                second.load_state(&state).unwrap();
                for step in cut..12 {
                    let actions: Vec<f32> = (0..144 * 3).map(|i| ((i + step) as f32).sin()).collect();
                    second.step(&actions, &mut buffers);
                }
                buffers
            })
        };
        let expected = after(1, 12);
        for (threads, cut) in [(2, 12), (7, 5)] {
            let found = after(threads, cut);
            assert!(found.observations == expected.observations && found.rewards == expected.rewards);
        }
        assert!(env(GuidanceConfig::default()).load_state(&[3, 0, 0, 0, 7]).is_err());
    }

    #[test]
    fn time_truncates_and_a_fall_terminates() {
        let mut env = env(GuidanceConfig { episode_s: 1.0, ..GuidanceConfig::default() });
        let mut buffers = StepBuffers::new(144, OBSERVATION);
        env.reset(&mut buffers.observations);
        let mut truncated = 0;
        for _ in 0..10 {
            run(&mut env, &mut buffers, 1);
            truncated += buffers.truncated.iter().filter(|&&ended| ended).count();
            assert!(buffers.truncated.iter().zip(&buffers.terminated).all(|(a, b)| !(a & b)));
        }
        assert!(truncated > 100, "{truncated}");
    }
}
