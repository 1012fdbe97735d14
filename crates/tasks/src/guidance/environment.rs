//! Many robots whose supervisors learn to obey the hand.

use std::sync::Arc;

use policy::{Mirror, Share, StepBuffers, StepRows, VecEnv, layout};
use rayon::prelude::*;
use terrain::{HeightField, TerrainGrid};

use super::{
    Course, GuidanceConfig, LocomotionPolicy,
    config::{COMMAND_HIGH, COMMAND_LOW},
    guided_squad::{GuidedSquad, Shared},
    metrics::Metrics,
};
use crate::{
    archive::{Archive as _, Archived as _, Reader, Writer},
    locomotion::TerrainShares,
    simulation::{Simulation, control_steps},
    view::View,
};

const OBSERVATION: usize = layout::SUPERVISOR_OBSERVATION;
/// Version of the saved state.
const STATE_VERSION: u32 = 5;
/// The one before, which does not say what policy walked; one rank by itself still reads it.
const VERSION_WITHOUT_WALK: u32 = 4;

/// The guidance task for a number of robots.
pub struct GuidanceEnv {
    config: GuidanceConfig,
    seed: u64,
    course: Course,
    grid: TerrainGrid,
    squads: Vec<GuidedSquad>,
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
        let grid = config.terrain.grid(&TerrainShares::default(), seed)?;
        let simulation = Simulation::new(grid.field.clone(), locomotion.physics());
        let observation_noise = config.observation_noise;
        let course = Course { simulation, policy: locomotion, observation_noise, seed };
        let column = |robot: usize| grid.column_of_env(robot, share.total);
        let squads = course.squads_of(share.envs, &config.randomization)?;
        let squads = squads.into_iter().map(|squad| GuidedSquad::new(squad, column)).collect();
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

    /// Locomotion's factors for linear velocity and joint velocities, the unit of force, and 1 for all else: also where locomotion
    /// has others, for angular velocity, command and height scan.
    fn observation_scale(&self) -> Vec<f32> {
        let mut scale = vec![1.0; OBSERVATION];
        scale[layout::BASE_LINEAR_VELOCITY.range()].fill(2.0);
        scale[layout::BASE_ANGULAR_VELOCITY.range()].fill(1.0);
        scale[layout::HARNESS_FORCE.range()].fill(1.0 / self.config.force_unit_n);
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
        let rows: Vec<StepRows<'_>> = out.parts(super::SQUAD).collect();
        squads
            .par_iter_mut()
            .zip(actions.par_chunks(super::SQUAD * layout::COMMAND))
            .zip(rows)
            .for_each(|((squad, actions), rows)| squad.step(&shared, actions, rows));
    }

    fn take_sums(&mut self) -> Vec<f64> {
        self.squads.iter_mut().flat_map(|squad| std::mem::take(&mut squad.metrics).to_sums()).collect()
    }

    fn report(&mut self, sums: &[f64]) -> Vec<(String, f64)> {
        let mut total = Metrics::default();
        sums.as_chunks().0.iter().for_each(|sums| total.merge(&Metrics::from_sums(sums)));
        total.named(self.config.asks_as_the_paper())
    }

    fn common_state_len(&self) -> usize {
        2 * size_of_val(&STATE_VERSION)
    }

    fn save_state(&self, out: &mut Vec<u8>) {
        let mut writer = Writer(out);
        writer.u32(&mut STATE_VERSION.clone());
        writer.u32(&mut self.course.policy.checksum());
        for squad in &self.squads {
            squad.clone().visit(&mut writer);
        }
    }

    fn load_state(&mut self, bytes: &[u8]) -> Result<(), String> {
        let mut reader = Reader::new(bytes);
        let (mut version, own) = (0, self.course.policy.checksum());
        reader.u32(&mut version);
        let mut walk = own;
        match version {
            STATE_VERSION => reader.u32(&mut walk),
            VERSION_WITHOUT_WALK => (),
            _ => return Err(format!("version is {version}, must be {STATE_VERSION}")),
        }
        if walk != own {
            return Err(format!(
                "the supervisor was trained over another walking policy: checksum {walk:08x}, must be {own:08x}, that of `{}`",
                self.config.locomotion
            ));
        }
        for squad in &mut self.squads {
            squad.visit(&mut reader);
        }
        reader.finish()
    }
}

#[cfg(test)]
mod contract;
#[cfg(test)]
mod pulls;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{falls, guidance::test_policy, locomotion::Terrain, non_finite};

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
            noise_n: [0.0; 3],
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
    fn creeping_costs_where_a_robot_is_to_stay_and_nowhere_else() {
        let rewards = |x: f32, place_drift: f32| {
            let pull = super::super::PullConfig {
                x_n: [x, x],
                y_n: [0.0, 0.0],
                near_threshold_share: 0.0,
                ..Default::default()
            };
            let mut env = env(GuidanceConfig { pull, place_drift, ..GuidanceConfig::default() });
            let mut buffers = StepBuffers::new(144, OBSERVATION);
            env.reset(&mut buffers.observations);
            run(&mut env, &mut buffers, 3);
            buffers.rewards
        };
        assert_eq!(rewards(0.0, -2.0), rewards(0.0, 0.0));
        let [free, priced] = [0.0, -2.0].map(|place_drift| rewards(-60.0, place_drift));
        let most = 2.0 * 0.15 * 0.1;
        assert!(free.iter().zip(&priced).all(|(free, priced)| (0.0..most + 1e-4).contains(&(free - priced))));
        assert!(free.iter().zip(&priced).any(|(free, priced)| free - priced > 1e-3));
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
        assert!(env(GuidanceConfig::default()).load_state(&[4, 0, 0, 0, 7]).is_err());
    }

    #[test]
    fn a_robot_that_is_no_longer_numbers_is_reset_and_counted_and_nobody_else_notices() {
        let config = GuidanceConfig { terrain: Terrain::Flat, ..GuidanceConfig::default() };
        let policy = LocomotionPolicy::new(test_policy()).unwrap();
        let make = || GuidanceEnv::new(config.clone(), policy.clone(), non_finite::ENVS, 3).unwrap();
        let rewards = non_finite::only_the_spoilt_robot_notices(make, |env, robot| {
            env.squads[0].squad.group_mut(robot)
        });
        assert!(rewards.iter().all(|&reward| reward == 0.0), "{rewards:?}");
    }

    #[test]
    fn a_robot_that_tips_over_ends_and_pays() {
        let policy = LocomotionPolicy::new(test_policy()).unwrap();
        let make = |fall| {
            let config = GuidanceConfig { terrain: Terrain::Flat, fall, ..GuidanceConfig::default() };
            GuidanceEnv::new(config, policy.clone(), falls::ENVS, 3).unwrap()
        };
        falls::a_robot_that_tips_over_ends_and_pays(make, |env| env.squads[0].squad.group_mut(0));
    }

    #[test]
    fn a_state_is_loaded_over_the_same_walk_only() {
        let over = |bias: f32| {
            let mut file = test_policy();
            file.mlp.layers[0].bias[3] = bias;
            let config = GuidanceConfig { terrain: Terrain::Flat, ..GuidanceConfig::default() };
            GuidanceEnv::new(config, LocomotionPolicy::new(file).unwrap(), 16, 3).unwrap()
        };
        let mut state = Vec::new();
        over(0.0).save_state(&mut state);
        over(0.0).load_state(&state).unwrap();
        let message = over(0.1).load_state(&state).unwrap_err();
        assert!(message.contains("another walking policy") && message.contains("`shipped`"), "{message}");
        // As version 4 had it, without the checksum.
        let before = [&VERSION_WITHOUT_WALK.to_le_bytes(), &state[over(0.0).common_state_len()..]].concat();
        over(0.1).load_state(&before).unwrap();
    }

    #[test]
    fn time_truncates() {
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
