//! Judging a supervisor over a locomotion policy: the cases of a suite, and the behavior reward over the paper's pulls.

use rayon::prelude::*;
use spatial::{Philox, Purpose};
use tasks::{
    guidance::{Behavior, Course, LocomotionPolicy, PullConfig, Squad, Supervisor, behavior_reward},
    simulation::{GROUP, Randomization, ResetSpread, Simulation},
};
use terrain::{SubTerrain, TerrainGrid};

use crate::{
    guided::Guided,
    motion::{DRIFT_WINDOW_S, Motion, STEP_S, Sample},
    report::PathTrace,
    results::{BehaviorReward, CaseResult},
    suite::Case,
};

/// Time without force before the pull \[s\]. Source: design section 3.
const SETTLING_S: f64 = 2.0;
/// Length of a behavior-reward episode, and time between two pulls in it \[s\]. Source: the paper.
const REWARD_EPISODE_S: f64 = 20.0;
/// Tiles along each axis of an evaluation ground; robots start on inner ones, and walk at most 17 m.
const TILES: usize = 10;
const BORDER_TILES: usize = 2;
/// Steps between two points of a path trace: 0.1 s.
const TRACE_STEPS: usize = 5;

/// The ground of an evaluation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ground {
    /// Level.
    Flat,
    /// All families, every tile of one level.
    Rough,
    /// Stairs up and down, every tile of one level.
    Stairs,
}

impl Ground {
    /// The name used in `results.json`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Rough => "rough",
            Self::Stairs => "stairs",
        }
    }
}

/// What is to be judged, and where.
#[derive(Clone, Debug)]
pub struct Setting {
    /// The ground.
    pub ground: Ground,
    /// Level of every tile, 0 to 9; not used on flat ground.
    pub level: usize,
    /// Robots, friction and harness drawn as in training, first states too; otherwise the nominal robot, standing.
    pub randomize: bool,
    /// Episodes of every case.
    pub episodes: usize,
    /// Seed of all draws: the same for every supervisor, so that comparisons are paired.
    pub seed: u64,
}

/// A place to judge supervisors in, with the policy that walks.
#[derive(Debug)]
pub struct Arena {
    course: Course,
    grid: TerrainGrid,
    setting: Setting,
}

impl Arena {
    /// Builds the ground.
    ///
    /// # Errors
    /// The level is out of range.
    pub fn new(locomotion: LocomotionPolicy, setting: Setting) -> Result<Self, String> {
        let uniform = |kind| TerrainGrid::uniform(kind, setting.level, setting.seed, TILES);
        let grid = match setting.ground {
            Ground::Flat => Ok(TerrainGrid::flat()),
            Ground::Rough => uniform(None),
            Ground::Stairs => uniform(Some(SubTerrain::StairsUp)),
        };
        let grid = grid.map_err(|error| error.to_string())?;
        let simulation = Simulation::new(grid.field.clone(), locomotion.physics());
        let course = Course { simulation, policy: locomotion, observation_noise: 0.0, seed: setting.seed };
        Ok(Self { course, grid, setting })
    }

    /// The setting.
    pub fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Squads for `count` robots (rounded up to whole groups), each at its start.
    fn squads(&self, count: usize) -> Result<Vec<Squad>, String> {
        let randomization =
            if self.setting.randomize { Randomization::default() } else { Randomization::none() };
        let spread = if self.setting.randomize { ResetSpread::default() } else { ResetSpread::standing() };
        let mut squads = self.course.squads(count.next_multiple_of(GROUP), &randomization)?;
        squads.par_iter_mut().for_each(|squad| {
            for robot in 0..squad.robots() {
                let number = squad.first_robot + robot;
                let mut random = Philox::new(self.setting.seed, number, 0, 0, Purpose::Reset);
                let mut inner = |count: usize| {
                    let border = BORDER_TILES.min((count - 1) / 2);
                    border + random.below((count - 2 * border) as u32) as usize
                };
                let (level, column) = (inner(self.grid.levels()), inner(self.grid.columns()));
                let spawn = self.grid.spawn(level, column);
                squad.reset(&self.course, robot, spawn, &spread, &mut random);
            }
        });
        Ok(squads)
    }

    /// Runs every case of a suite; `progress` is told of every squad that is done, with the number of all. Also gives the
    /// path of one robot a case.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn judge(
        &self,
        supervisor: &Supervisor,
        cases: &[Case],
        progress: &(dyn Fn(usize) + Sync),
    ) -> Result<(Vec<CaseResult>, Vec<PathTrace>), String> {
        let episodes = self.setting.episodes;
        let count = cases.len() * episodes;
        let squads = self.squads(count)?;
        let total = squads.len();
        // Robot r plays episode r % episodes of case r / episodes.
        let outcomes: Vec<Episode> = squads
            .into_par_iter()
            .flat_map_iter(|squad| {
                let outcomes = self.episode(supervisor, squad, cases);
                progress(total);
                outcomes
            })
            .collect();
        let of_case = |(i, case): (usize, &Case)| summarize(case, &outcomes[i * episodes..][..episodes]);
        let results = cases.iter().enumerate().map(of_case).collect();
        let trace = |(i, case): (usize, &Case)| outcomes[i * episodes].trace(case);
        Ok((results, cases.iter().enumerate().map(trace).collect()))
    }

    /// Two seconds without force, then the pull.
    fn episode(&self, supervisor: &Supervisor, squad: Squad, cases: &[Case]) -> Vec<Episode> {
        let first = squad.first_robot;
        let robots = squad.robots();
        let case = |robot: usize| cases.get((first + robot) / self.setting.episodes);
        let mut guided = Guided::new(&self.course, supervisor, squad);
        for _ in 0..steps(SETTLING_S) {
            guided.control_step();
        }
        for robot in 0..robots {
            guided.pull(robot, case(robot).map_or([0.0; 3], |case| case.force));
        }
        let mut samples = vec![Vec::with_capacity(steps(DRIFT_WINDOW_S[1])); robots];
        let mut rewards = vec![0.0; robots];
        for _ in 0..steps(DRIFT_WINDOW_S[1]) {
            guided.control_step();
            for (robot, samples) in samples.iter_mut().enumerate() {
                let last = samples.last().copied();
                let sample = sample(&guided, robot, last);
                if let Some(case) = case(robot).filter(|_| !guided.has_fallen(robot)) {
                    rewards[robot] += f64::from(behavior_reward(case.target(), sample.velocity));
                }
                samples.push(sample);
            }
        }
        let outcome = |(robot, samples): (usize, Vec<Sample>)| Episode {
            fell: guided.has_fallen(robot),
            reward: rewards[robot] / samples.len() as f64,
            samples,
        };
        let wanted = self.setting.episodes * cases.len();
        let real = robots.min(wanted.saturating_sub(first));
        samples.into_iter().enumerate().take(real).map(outcome).collect()
    }

    /// The behavior reward of Table I over the paper's pulls, drawn anew every five seconds of twenty: means over all scheduled
    /// steps, zero after a fall.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn behavior_reward(&self, supervisor: &Supervisor, robots: usize) -> Result<BehaviorReward, String> {
        let pulls = PullConfig::paper();
        let squads = self.squads(robots)?;
        let sums: Vec<[f64; 4]> =
            squads.into_par_iter().map(|squad| self.reward_episode(supervisor, squad, &pulls)).collect();
        let scheduled = (robots.next_multiple_of(GROUP) * steps(REWARD_EPISODE_S)) as f64;
        let share =
            |behavior: Behavior| sums.iter().map(|sum| sum[behavior as usize]).sum::<f64>() / scheduled;
        let [walk, stop, turn, spin] = Behavior::ALL.map(share);
        Ok(BehaviorReward { total: walk + stop + turn + spin, stop, walk, turn, spin })
    }

    fn reward_episode(&self, supervisor: &Supervisor, squad: Squad, pulls: &PullConfig) -> [f64; 4] {
        let robots = squad.robots();
        let mut guided = Guided::new(&self.course, supervisor, squad);
        let mut forces = vec![[0.0; 3]; robots];
        let mut sums = [0.0; 4];
        for step in 0..steps(REWARD_EPISODE_S) {
            if step % steps(f64::from(pulls.period_s)) == 0 {
                for (robot, force) in forces.iter_mut().enumerate() {
                    let number = guided.squad.first_robot + robot;
                    let mut random = Philox::new(self.setting.seed, number, 0, step as u32, Purpose::Command);
                    *force = pulls.draw(&mut random);
                    guided.pull(robot, *force);
                }
            }
            guided.control_step();
            for (robot, &force) in forces.iter().enumerate() {
                if !guided.has_fallen(robot) {
                    let behavior = Behavior::of_force(force);
                    let velocity = sample(&guided, robot, None).velocity;
                    sums[behavior as usize] += f64::from(behavior_reward(behavior.target(force), velocity));
                }
            }
        }
        sums
    }
}

/// What one robot did from the pull on.
struct Episode {
    fell: bool,
    /// Mean behavior reward.
    reward: f64,
    samples: Vec<Sample>,
}

impl Episode {
    /// Its path in the frame of the first sample.
    fn trace(&self, case: &Case) -> PathTrace {
        let start = self.samples[0];
        let (sin, cos) = f64::from(start.yaw).sin_cos();
        let point = |s: &Sample| {
            let [dx, dy] = [0, 1].map(|i| f64::from(s.position[i] - start.position[i]));
            [cos * dx + sin * dy, cos * dy - sin * dx, f64::from(s.yaw - start.yaw)]
        };
        PathTrace {
            behavior: case.behavior(),
            case: case.name.clone(),
            points: self.samples.iter().step_by(TRACE_STEPS).map(point).collect(),
            period_s: TRACE_STEPS as f64 * STEP_S,
        }
    }
}

fn steps(time_s: f64) -> usize {
    (time_s / STEP_S).round() as usize
}

/// How a robot moves now; one that has fallen stays where it was (`last`).
fn sample(guided: &Guided<'_>, robot: usize, last: Option<Sample>) -> Sample {
    if guided.has_fallen(robot) {
        return Sample { velocity: [0.0; 3], ..last.unwrap_or_default() };
    }
    let motion = guided.squad.motion(robot);
    let [x, y, _] = motion.position;
    let [v_x, v_y, _] = motion.linear_velocity;
    // Continuous heading: the turn nearest to the sample before.
    let yaw = last.map_or(motion.yaw, |last| {
        let turns = ((last.yaw - motion.yaw) / std::f32::consts::TAU).round();
        motion.yaw + turns * std::f32::consts::TAU
    });
    Sample { velocity: [v_x, v_y, motion.angular_velocity[2]], position: [x, y], yaw }
}

fn summarize(case: &Case, episodes: &[Episode]) -> CaseResult {
    let (behavior, target) = (case.behavior(), case.target());
    let motions: Vec<Motion> = episodes.iter().map(|e| Motion::of(&e.samples, target[2])).collect();
    let obeyed = episodes.iter().zip(&motions).filter(|(e, m)| !e.fell && m.obeys(behavior, target));
    let falls = episodes.iter().filter(|episode| episode.fell).count();
    let count = episodes.len().max(1) as f64;
    let mean = |of: &dyn Fn(&Motion) -> f64| motions.iter().map(of).sum::<f64>() / count;
    CaseResult {
        name: case.name.clone(),
        fx: f64::from(case.force[0]),
        fy: f64::from(case.force[1]),
        group: case.group,
        behavior,
        mean_vx: mean(&|m| m.velocity[0]),
        mean_vy: mean(&|m| m.velocity[1]),
        mean_wz: mean(&|m| m.velocity[2]),
        heading_drift_deg_per_10s: mean(&|m| m.heading_drift.abs().to_degrees()),
        mean_planar_speed: Some(mean(&|m| m.planar_speed)),
        position_drift_m: Some(mean(&|m| m.excursion)),
        reward: Some(episodes.iter().map(|episode| episode.reward).sum::<f64>() / count),
        ..CaseResult::from_counts(episodes.len(), obeyed.count(), falls)
    }
}
