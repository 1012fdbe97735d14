//! Judging a supervisor over a locomotion policy: the cases of a suite, and the behavior reward over the paper's pulls.

use policy::Checkpoint;
use rayon::prelude::*;
use spatial::{Philox, Purpose};
use tasks::{
    guidance::{Behavior, Course, LocomotionPolicy, PullConfig, Squad, Supervisor, behavior_reward},
    simulation::{GROUP, ResetSpread, Simulation},
};
use terrain::{SubTerrain, TerrainGrid};

pub use crate::setting::{Ground, Setting, draws};

use crate::{
    episode::Episode,
    exchange::{Planned, plan},
    film::{FRAME_STEPS, Pose},
    ground::{start, tiles},
    guided::Guided,
    measures::split::Met,
    outcome::{Outcome, reward_of, summarize},
    recording::{Recording, STEP_S, Sample, steps},
    report::PathTrace,
    results::{BehaviorReward, CaseResult},
    suite::Case,
};

/// Length of a behavior-reward episode, and time between two pulls in it \[s\]. Source: the paper.
const REWARD_EPISODE_S: f64 = 20.0;
/// Steps between two points of a path trace: 0.1 s.
const TRACE_STEPS: usize = 5;

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
        let seed = draws(setting.seed);
        let uniform = |kind| tiles(kind, setting.level, seed, setting.tiles.unwrap_or(setting.episodes));
        let grid = match setting.ground {
            Ground::Flat => TerrainGrid::flat(),
            Ground::Rough => uniform(None)?,
            Ground::Stairs => uniform(Some(SubTerrain::StairsUp))?,
        };
        let simulation = Simulation::new(grid.field.clone(), locomotion.physics());
        let observation_noise = setting.sensor_noise as f32;
        let course = Course { simulation, policy: locomotion, observation_noise, seed };
        Ok(Self { course, grid, setting })
    }

    /// The setting.
    pub fn setting(&self) -> &Setting {
        &self.setting
    }

    /// Squads for `count` robots (rounded up to whole groups), each at its start.
    fn squads(&self, count: usize) -> Result<Vec<Squad>, String> {
        let spread = if self.setting.randomize { ResetSpread::default() } else { ResetSpread::standing() };
        let mut squads = self.course.squads(count.next_multiple_of(GROUP), &self.setting.randomization())?;
        squads.par_iter_mut().for_each(|squad| {
            for robot in 0..squad.robots() {
                let number = squad.first_robot + robot;
                let mut random = Philox::new(self.course.seed, number, 0, 0, Purpose::Reset);
                let spawn = start(&self.grid, &mut random);
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
        let measured = self.play(supervisor, cases, progress, |robot, case, recording| {
            let trace = robot.is_multiple_of(episodes).then(|| trace(case, &recording));
            (Outcome::of(case, &recording, self.met(robot, &recording)), trace)
        })?;
        let (outcomes, traces): (Vec<Outcome>, Vec<Option<PathTrace>>) = measured.into_iter().unzip();
        Ok((summaries(cases, &outcomes), traces.into_iter().flatten().collect()))
    }

    /// What a robot of this setting met.
    fn met(&self, robot: usize, recording: &Recording) -> Met {
        let robots = self.setting.randomization();
        let friction = || robots.draw(self.course.simulation.robot(), self.course.seed, robot).friction;
        Met {
            ground: (self.setting.ground != Ground::Flat)
                .then(|| self.grid.kind_at(recording.pulled()[0].position)),
            friction: (robots.friction[0] < robots.friction[1]).then(friction),
        }
    }

    /// Plays every case, and has every recording measured where it was made: none is kept. Robot r plays episode
    /// r % episodes of case r / episodes; measures come in the order of the robots, whatever the number of threads.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn play<T: Send>(
        &self,
        supervisor: &Supervisor,
        cases: &[Case],
        progress: &(dyn Fn(usize) + Sync),
        measure: impl Fn(usize, &Case, Recording) -> T + Sync,
    ) -> Result<Vec<T>, String> {
        let squads = self.squads(cases.len() * self.setting.episodes)?;
        let total = squads.len();
        let played = squads.into_par_iter().flat_map_iter(|squad| {
            let first = squad.first_robot;
            let recordings = self.episode(supervisor, squad, cases);
            let of = |(i, recording)| measure(first + i, self.case(cases, first + i), recording);
            let measured: Vec<T> = recordings.into_iter().enumerate().map(of).collect();
            progress(total);
            measured
        });
        Ok(played.collect())
    }

    /// The same episodes as a plan for another engine: those of the cases, then `reward_robots` with the pulls of the behavior
    /// reward, but from other starts. `names` go into the file's header.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn plan(
        &self,
        cases: &[Case],
        reward_robots: usize,
        names: &[(&str, String)],
    ) -> Result<Checkpoint, String> {
        let of_cases = cases.len() * self.setting.episodes;
        let case_force = |robot: usize| {
            let played = self.played(cases, robot);
            (0..played.steps()).map(|step| played.force(step)).collect()
        };
        let pulls = PullConfig::paper();
        let period = steps(f64::from(pulls.period_s));
        let reward_force = |robot: usize| {
            (0..steps(REWARD_EPISODE_S))
                .map(|step| self.reward_pull(&pulls, robot, step / period * period))
                .collect()
        };
        let squads = self.squads(of_cases + reward_robots)?;
        let robots = squads.iter().flat_map(|squad| (0..squad.robots()).map(move |robot| (squad, robot)));
        let planned: Vec<Planned> = robots
            .take(of_cases + reward_robots)
            .map(|(squad, robot)| {
                let (number, motion) = (squad.first_robot + robot, squad.motion(robot));
                let ([x, y, z], [a, b, c]) = (motion.position, motion.linear_velocity);
                let [d, e, f] = motion.angular_velocity;
                Planned {
                    start: [x, y, z, motion.yaw],
                    velocity: [a, b, c, d, e, f],
                    joint_position: squad.joint_position(robot),
                    force: if number < of_cases {
                        case_force(number)
                    } else {
                        reward_force(number - of_cases)
                    },
                }
            })
            .collect();
        Ok(plan(&self.course, &self.setting.randomization(), &planned, names))
    }

    /// The case that a robot plays; those that only fill up the last group play the last one.
    fn case<'a>(&self, cases: &'a [Case], robot: usize) -> &'a Case {
        &cases[(robot / self.setting.episodes).min(cases.len() - 1)]
    }

    /// Robots of this arena under a supervisor.
    fn guided<'a>(&'a self, supervisor: &'a Supervisor, squad: Squad) -> Guided<'a> {
        Guided::new(&self.course, supervisor, squad, &self.setting)
    }

    /// The episode of a robot.
    fn played<'a>(&self, cases: &'a [Case], robot: usize) -> Episode<'a> {
        Episode::new(self.case(cases, robot), self.course.seed, robot)
    }

    /// A time without force, then the pull. Recordings of the robots that count.
    fn episode(&self, supervisor: &Supervisor, squad: Squad, cases: &[Case]) -> Vec<Recording> {
        let first = squad.first_robot;
        let robots = squad.robots();
        let played: Vec<Episode<'_>> = (0..robots).map(|robot| self.played(cases, first + robot)).collect();
        let mut guided = self.guided(supervisor, squad);
        let lengths: Vec<usize> = played.iter().map(Episode::steps).collect();
        let mut recordings: Vec<Recording> = played
            .iter()
            .map(|episode| Recording {
                samples: Vec::with_capacity(episode.steps()),
                onset: episode.onset,
                fell_at: None,
            })
            .collect();
        for step in 0..lengths.iter().copied().max().unwrap_or(0) {
            for (robot, played) in played.iter().enumerate() {
                guided.pull(robot, played.force(step));
            }
            guided.control_step();
            for (robot, recording) in recordings.iter_mut().enumerate() {
                if step < lengths[robot] {
                    let last = recording.samples.last().copied();
                    recording.samples.push(sample(&guided, robot, last));
                    if guided.has_fallen(robot) {
                        recording.fell_at.get_or_insert(step);
                    }
                }
            }
        }
        let wanted = self.setting.episodes * cases.len();
        recordings.truncate(wanted.saturating_sub(first));
        recordings
    }

    /// One episode of a case.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn record(&self, supervisor: &Supervisor, case: &Case) -> Result<Recording, String> {
        let cases = std::slice::from_ref(case);
        Ok(self.play(supervisor, cases, &|_| {}, |_, _, recording| recording)?.swap_remove(0))
    }

    /// The first robot's poses over an episode of a case, for a film; ends where it falls.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn poses(&self, supervisor: &Supervisor, case: &Case) -> Result<Vec<Pose>, String> {
        let squad = self.squads(1)?.swap_remove(0);
        let played = self.played(std::slice::from_ref(case), 0);
        let mut guided = self.guided(supervisor, squad);
        let mut poses = Vec::new();
        for step in 0..played.steps() {
            guided.pull(0, played.force(step));
            guided.control_step();
            if guided.has_fallen(0) {
                break;
            }
            if step % FRAME_STEPS == 0 {
                poses.push(self.pose(&guided));
            }
        }
        Ok(poses)
    }

    fn pose(&self, guided: &Guided<'_>) -> Pose {
        let centers = guided.squad.contact_centers(&self.course, 0);
        let contacts = &self.course.simulation.robot().contacts;
        let named = |name: &str| {
            contacts.iter().position(|contact| contact.name == name).map_or([0.0; 3], |i| centers[i])
        };
        let leg = |leg: &str| ["BASE_X_DRIVE", "X_KNEE", "X_FOOT"].map(|name| named(&name.replace('X', leg)));
        let motion = guided.squad.motion(0);
        Pose {
            base: motion.position,
            yaw: motion.yaw,
            legs: ["LF", "LH", "RF", "RH"].map(leg),
            hand: named("HAND"),
            force: guided.told(0).1,
        }
    }

    /// The ground.
    pub fn ground(&self) -> &terrain::HeightField {
        &self.grid.field
    }

    /// The behavior reward of episodes that another engine recorded after a [`Arena::plan`].
    pub fn recorded_reward(recordings: &[Recording]) -> BehaviorReward {
        let mut sums = [0.0; 4];
        let mut scheduled = 0;
        for recording in recordings {
            scheduled += recording.pulled().len();
            for (behavior, reward) in recording.upright().iter().map(reward_of) {
                sums[behavior as usize] += reward;
            }
        }
        shares(sums, scheduled)
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
        let total: [f64; 4] = std::array::from_fn(|i| sums.iter().map(|sum| sum[i]).sum());
        Ok(shares(total, robots.next_multiple_of(GROUP) * steps(REWARD_EPISODE_S)))
    }

    /// The pull that a robot gets at a step of a reward episode.
    fn reward_pull(&self, pulls: &PullConfig, robot: usize, step: usize) -> [f32; 3] {
        pulls.draw(&mut Philox::new(self.course.seed, robot, 0, step as u32, Purpose::Command))
    }

    fn reward_episode(&self, supervisor: &Supervisor, squad: Squad, pulls: &PullConfig) -> [f64; 4] {
        let robots = squad.robots();
        let mut guided = self.guided(supervisor, squad);
        let mut forces = vec![[0.0; 3]; robots];
        let mut sums = [0.0; 4];
        for step in 0..steps(REWARD_EPISODE_S) {
            if step % steps(f64::from(pulls.period_s)) == 0 {
                for (robot, force) in forces.iter_mut().enumerate() {
                    *force = self.reward_pull(pulls, guided.squad.first_robot + robot, step);
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

/// Shares of the reward from its sums by behavior, in the order of [`Behavior::ALL`].
fn shares(sums: [f64; 4], scheduled: usize) -> BehaviorReward {
    let [walk, stop, turn, spin] = sums.map(|sum| sum / scheduled.max(1) as f64);
    BehaviorReward { total: walk + stop + turn + spin, stop, walk, turn, spin }
}

/// Results of all cases, from the outcomes of their episodes in order.
pub fn summaries(cases: &[Case], outcomes: &[Outcome]) -> Vec<CaseResult> {
    let episodes = outcomes.len() / cases.len().max(1);
    cases
        .iter()
        .zip(outcomes.chunks(episodes.max(1)))
        .map(|(case, outcomes)| summarize(case, outcomes))
        .collect()
}

/// The path of a recording in the frame of its first sample.
pub fn trace(case: &Case, recording: &Recording) -> PathTrace {
    let start = recording.pulled()[0];
    let (sin, cos) = f64::from(start.yaw).sin_cos();
    let point = |s: &Sample| {
        let [dx, dy] = [0, 1].map(|i| f64::from(s.position[i] - start.position[i]));
        [cos * dx + sin * dy, cos * dy - sin * dx, f64::from(s.yaw - start.yaw)]
    };
    PathTrace {
        behavior: case.behavior(),
        case: case.name.clone(),
        points: recording.pulled().iter().step_by(TRACE_STEPS).map(point).collect(),
        period_s: TRACE_STEPS as f64 * STEP_S,
    }
}

/// How a robot moves now; one that has fallen stays where it was (`last`).
fn sample(guided: &Guided<'_>, robot: usize, last: Option<Sample>) -> Sample {
    let (command, force) = guided.told(robot);
    if guided.has_fallen(robot) {
        return Sample { velocity: [0.0; 3], command, force, ..last.unwrap_or_default() };
    }
    let motion = guided.squad.motion(robot);
    let [x, y, _] = motion.position;
    let [v_x, v_y, _] = motion.linear_velocity;
    // Continuous heading: the turn nearest to the sample before.
    let yaw = last.map_or(motion.yaw, |last| {
        let turns = ((last.yaw - motion.yaw) / std::f32::consts::TAU).round();
        motion.yaw + turns * std::f32::consts::TAU
    });
    Sample { velocity: [v_x, v_y, motion.angular_velocity[2]], position: [x, y], yaw, command, force }
}
