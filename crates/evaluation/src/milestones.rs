//! One number a task that says how far a training has come: the mean action, without noise, on the same draws every time.
//!
//! Seconds of one core each, so that a training can be asked every minute. The draws are fixed here and not taken from the
//! training's settings, so that trainings with different settings are held against the same thing.

use rayon::prelude::*;
use spatial::{Philox, Purpose};
use tasks::{
    guidance::{Course, LocomotionPolicy, Squad, Supervisor},
    locomotion::{CommandConfig, Way},
    simulation::{Randomization, ResetSpread, Simulation},
};
use terrain::{GridConfig, LEVELS, SubTerrain, TerrainGrid, next_level};

use crate::{
    judge::{Arena, Setting},
    locomotion::{EPISODE_S, Judge},
    recording::steps,
};

/// Seed of all draws; trainings count theirs from 1.
const SEED: u64 = 20_250_101;
/// Robots on level ground, and under the paper's pulls.
const ROBOTS: usize = 128;
/// Robots on every tile of the rough ground, which has 200.
const ROBOTS_A_TILE: usize = 2;
/// Time between two commands on rough ground \[s\].
const COMMAND_S: f64 = 5.0;
/// What the curriculum must reach on rough ground, and what share of the robots must survive there.
const LEVEL: f64 = 5.0;
const SURVIVAL: f64 = 0.9;

/// How far a training has come.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Score {
    /// The one number.
    pub value: f64,
    /// What it is made of, by name.
    pub parts: Vec<(&'static str, f64)>,
}

/// Commands a guide dog gets on level ground, as in `configs/locomotion/flat.toml`.
fn flat_commands() -> CommandConfig {
    CommandConfig { forward_mps: 1.0, sideways_mps: 0.6, yaw_rate_radps: 1.5, ..CommandConfig::default() }
}

/// Walking on level ground: the two tracking terms of Isaac Lab's reward as a share of their ceiling,
/// (exp(−|e_xy|² / 0.25) + exp(−e_ω² / 0.25) / 2) / 1.5, the mean over the last 18 of 20 seconds, 0 after a fall.
///
/// 128 nominal robots from standing, each under one command for the whole episode.
///
/// # Errors
/// There is nothing to run.
pub fn flat(policy: &LocomotionPolicy) -> Result<Score, String> {
    let commands = flat_commands();
    let command = |robot: usize, _| commands.draw(&mut Philox::new(SEED, robot, 0, 0, Purpose::Command));
    let judge = Judge { policy, episodes: ROBOTS, seed: SEED };
    let row = judge.row(TerrainGrid::flat(), false, [0.0; 3], command)?;
    Ok(Score {
        value: (row.tracking + 0.5 * row.yaw_tracking) / 1.5,
        parts: vec![
            ("tracking_linear", row.tracking),
            ("tracking_yaw", row.yaw_tracking),
            ("survival", row.survival),
        ],
    })
}

/// Walking on rough ground: the mean level on which the terrain curriculum would come to rest if this policy went on for
/// ever, or less where fewer than nine in ten survive there: min(level, 5 · survival / 0.9). 6.0 for one that always goes up,
/// because those who pass the top begin anew anywhere.
///
/// Two robots, drawn as in training, on every tile of a training ground of another seed play one episode of 20 s under commands
/// that change every five, without pulls. What the curriculum's rule then says gives, for every kind of ground and every level, how many
/// go up and how many down, and from that where they would settle; survival is weighted alike.
///
/// # Errors
/// There is nothing to run.
pub fn rough(policy: &LocomotionPolicy) -> Result<Score, String> {
    let config = GridConfig { seed: SEED, ..GridConfig::default() };
    let grid = TerrainGrid::new(&config).map_err(|error| error.to_string())?;
    let simulation = Simulation::new(grid.field.clone(), policy.physics());
    let course = Course { simulation, policy: policy.clone(), observation_noise: 0.0, seed: SEED };
    let robots = ROBOTS_A_TILE * grid.levels() * grid.columns();
    let squads = course.squads(robots, &Randomization::default())?;
    let tile = |robot: usize| {
        let tile = robot / ROBOTS_A_TILE;
        (tile % grid.levels(), tile / grid.levels())
    };
    let ends: Vec<(bool, Way)> = squads
        .into_par_iter()
        .flat_map_iter(|mut squad| {
            for robot in 0..squad.robots() {
                let number = squad.first_robot + robot;
                let (level, column) = tile(number);
                let mut random = Philox::new(SEED, number, 0, 0, Purpose::Reset);
                let spawn = grid.spawn(level, column);
                squad.reset(&course, robot, spawn, &ResetSpread::default(), &mut random);
            }
            walk(&course, squad)
        })
        .collect();
    let mut families: Vec<(SubTerrain, Climb)> = Vec::new();
    for (robot, (fell, way)) in ends.into_iter().enumerate() {
        let (level, column) = tile(robot);
        let kind = grid.kind(level, column);
        if !families.iter().any(|(known, _)| *known == kind) {
            families.push((kind, Climb::default()));
        }
        let climb = families.iter_mut().find(|(known, _)| *known == kind).map(|(_, climb)| climb);
        climb.expect("it was just added").add(level, fell, &way);
    }
    let mut sums = [0.0; 2];
    for (_, climb) in &families {
        let share = climb.robots() / robots as f64;
        let at_rest = climb.at_rest();
        (0..2).for_each(|i| sums[i] += share * at_rest[i]);
    }
    let [level, survival] = sums;
    Ok(Score {
        value: level.min(LEVEL * survival / SURVIVAL),
        parts: vec![("level", level), ("survival", survival)],
    })
}

/// One episode: who fell, and how far everyone came.
fn walk(course: &Course, mut squad: Squad) -> Vec<(bool, Way)> {
    let config = CommandConfig::default();
    let mut ends = vec![(false, Way::default()); squad.robots()];
    let mut commands = vec![[0.0; 3]; squad.robots()];
    for step in 0..steps(EPISODE_S) {
        if step % steps(COMMAND_S) == 0 {
            for (robot, command) in commands.iter_mut().enumerate() {
                let number = squad.first_robot + robot;
                *command = config.draw(&mut Philox::new(SEED, number, 0, step as u32, Purpose::Command));
            }
        }
        squad.control_step(course, &commands, |_| (0, step as u32));
        for (robot, (fell, way)) in ends.iter_mut().enumerate() {
            *fell |= squad.has_fallen(robot);
            if !*fell {
                way.walk(config.meant(commands[robot]), &squad.motion(robot));
            }
        }
    }
    ends
}

/// What the curriculum's rule made of robots of one kind of ground, by level.
#[derive(Clone, Debug, Default)]
struct Climb {
    robots: [f64; LEVELS],
    up: [f64; LEVELS],
    down: [f64; LEVELS],
    survived: [f64; LEVELS],
}

impl Climb {
    fn add(&mut self, level: usize, fell: bool, way: &Way) {
        let mut unused = Philox::new(SEED, 0, 0, 0, Purpose::Terrain);
        // A level more than there is, so that the rule draws nothing.
        let (progress, commanded) = (f64::from(way.progress), f64::from(way.commanded));
        let next = next_level(level, progress, commanded, LEVELS + 1, &mut unused);
        self.robots[level] += 1.0;
        self.up[level] += f64::from(u8::from(next > level));
        self.down[level] += f64::from(u8::from(next < level));
        self.survived[level] += f64::from(u8::from(!fell));
    }

    fn robots(&self) -> f64 {
        self.robots.iter().sum()
    }

    /// Mean level and survival once as many go up as go down everywhere; those who pass the top go anywhere.
    fn at_rest(&self) -> [f64; 2] {
        let share = |counts: &[f64; LEVELS], level: usize| counts[level] / self.robots[level].max(1.0);
        let mut present = [1.0 / LEVELS as f64; LEVELS];
        for _ in 0..10_000 {
            let mut next = [0.0; LEVELS];
            for (level, &here) in present.iter().enumerate() {
                let (up, down) = (here * share(&self.up, level), here * share(&self.down, level));
                next[level] += here - up - down;
                next[level.saturating_sub(1)] += down;
                match next.get_mut(level + 1) {
                    Some(above) => *above += up,
                    None => next.iter_mut().for_each(|anywhere| *anywhere += up / LEVELS as f64),
                }
            }
            present = next;
        }
        let mean = |of: &dyn Fn(usize) -> f64| (0..LEVELS).map(|level| present[level] * of(level)).sum();
        [mean(&|level| level as f64), mean(&|level| share(&self.survived, level))]
    }
}

/// Understanding pulls: the behavior reward as a share of the oracle's over the same walk.
///
/// 128 nominal robots on level ground, 20 s each, pulls from the paper's ranges drawn anew every five seconds.
#[derive(Debug)]
pub struct Understanding {
    arena: Arena,
    oracle: f64,
}

impl Understanding {
    /// Lets the oracle play.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn new(locomotion: LocomotionPolicy) -> Result<Self, String> {
        let setting = Setting { episodes: 1, seed: SEED, ..Setting::default() };
        let arena = Arena::new(locomotion, setting)?;
        let oracle = arena.behavior_reward(&Supervisor::Oracle, ROBOTS)?.total;
        Ok(Self { arena, oracle })
    }

    /// How far a supervisor has come.
    ///
    /// # Errors
    /// There is nothing to run.
    pub fn score(&self, supervisor: &Supervisor) -> Result<Score, String> {
        let reward = self.arena.behavior_reward(supervisor, ROBOTS)?;
        Ok(Score {
            value: reward.total / self.oracle,
            parts: vec![("behavior_reward", reward.total), ("oracle_reward", self.oracle)],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn climb(next: impl Fn(usize) -> Way) -> [f64; 2] {
        let mut climb = Climb::default();
        (0..LEVELS).for_each(|level| (0..4).for_each(|_| climb.add(level, level > 7, &next(level))));
        climb.at_rest()
    }

    #[test]
    fn robots_settle_where_the_rule_leaves_them() {
        let (good, bad) = (Way { progress: 9.0, commanded: 10.0 }, Way { progress: 1.0, commanded: 10.0 });
        // All up and no one down: level l is visited from l + 1 beginnings, Σ l (l + 1) / Σ (l + 1) = 330 / 55.
        let [level, survival] = climb(|_| good);
        assert!((level - 6.0).abs() < 1e-9, "{level}");
        // Levels 8 and 9, on which all fall here, are 19 of those 55.
        assert!((survival - 36.0 / 55.0).abs() < 1e-9, "{survival}");
        assert!(climb(|_| bad)[0] < 1e-9);
        // Up to level 3 and down again from 4: back and forth between the two.
        let [level, survival] = climb(|level| if level < 4 { good } else { bad });
        assert!((level - 3.5).abs() < 1e-9 && (survival - 1.0).abs() < 1e-9, "{level} {survival}");
    }
}
