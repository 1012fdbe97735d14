//! Judging a locomotion policy by itself: commands under steady pulls on level ground, and every kind of ground by level.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spatial::{Philox, Purpose};
use tasks::{
    guidance::{Course, LocomotionPolicy, Squad},
    locomotion::Way,
    simulation::{GROUP, Randomization, ResetSpread, Simulation},
};
use terrain::{SubTerrain, TerrainGrid};

use crate::{
    ground::{start, tiles},
    recording::steps,
    results::VERSION,
    setting::draws,
    statistics::wilson_interval,
};

/// Length of an episode \[s\].
pub(crate) const EPISODE_S: f64 = 20.0;
/// Not judged: time to get going \[s\].
const SETTLING_S: f64 = 2.0;
/// Time between two commands on terrain \[s\].
const COMMAND_S: f64 = 5.0;
/// Time over which a robot is looked at for being stuck \[s\].
const STUCK_S: f64 = 1.0;
/// It is stuck if it makes less than this share of the way it is told to go, along the commands.
const STUCK_SHARE: f64 = 0.25;

/// Commands v_x, v_y \[m/s\], ω_z \[rad/s\] by name.
const COMMANDS: [(&str, [f32; 3]); 9] = [
    ("stand", [0.0, 0.0, 0.0]),
    ("forward", [1.0, 0.0, 0.0]),
    ("backward", [-1.0, 0.0, 0.0]),
    ("left", [0.0, 0.5, 0.0]),
    ("right", [0.0, -0.5, 0.0]),
    ("turn left", [0.0, 0.0, 1.5]),
    ("turn right", [0.0, 0.0, -1.5]),
    ("guide", [0.8, 0.0, 0.6]),
    ("spin", [0.0, 0.0, 0.6]),
];
/// Steady forces at the hand, heading frame \[N\].
const PULLS: [(&str, [f32; 3]); 5] = [
    ("none", [0.0; 3]),
    ("back 40 N", [-40.0, 0.0, 0.0]),
    ("forward 40 N", [40.0, 0.0, 0.0]),
    ("left 40 N", [0.0, 40.0, 0.0]),
    ("right 40 N", [0.0, -40.0, 0.0]),
];
/// Kinds of ground: all but level.
const FAMILIES: [SubTerrain; 6] = [
    SubTerrain::StairsUp,
    SubTerrain::StairsDown,
    SubTerrain::Boxes,
    SubTerrain::RandomRough,
    SubTerrain::SlopeUp,
    SubTerrain::SlopeDown,
];
/// Levels judged.
const LEVELS: [usize; 4] = [0, 3, 5, 8];

/// One row of a table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// The command, or the kind of ground.
    pub name: String,
    /// The pull, or the level.
    pub under: String,
    /// Episodes run.
    pub episodes: usize,
    /// Episodes without a fall.
    pub survived: usize,
    /// `survived / episodes`.
    pub survival: f64,
    /// Lower end of the 95 % Wilson interval of the survival.
    pub wilson_low: f64,
    /// Mean error of v_x, v_y \[m/s\], ω_z \[rad/s\] while upright: what was done less what was told.
    pub error: [f64; 3],
    /// Mean of exp(−(e_x² + e_y²) / 0.25) over all scheduled steps, 0 after a fall.
    pub tracking: f64,
    /// Mean of exp(−e_ω² / 0.25) over all scheduled steps, 0 after a fall.
    #[serde(default)]
    pub yaw_tracking: f64,
    /// Mean of exp(−10 (e_x² + e_y² + e_ω²)) over all scheduled steps, 0 after a fall.
    pub behavior_reward: f64,
    /// Share of the seconds upright and told to walk in which less than a fourth of the way was made, along the commands.
    #[serde(default)]
    pub stuck: f64,
}

/// What judging a locomotion policy found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LocomotionResults {
    /// "locomotion".
    pub suite: String,
    /// The [`VERSION`] that found it; 0 in files from before there was one.
    #[serde(default)]
    pub version: u32,
    /// The policy: "shipped" or a file.
    pub locomotion: String,
    /// Episodes of every row.
    pub episodes: usize,
    /// Seed of all draws.
    pub seed: u64,
    /// Level ground: commands under pulls, nominal robot.
    pub flat: Vec<Row>,
    /// Every kind of ground by level: changing commands, robots drawn as in training.
    pub terrain: Vec<Row>,
}

/// Judges a policy; `progress` is told of every table row that is done, with the number of all.
///
/// # Errors
/// There is nothing to run.
pub fn judge_locomotion(
    policy: &LocomotionPolicy,
    name: &str,
    episodes: usize,
    seed: u64,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<LocomotionResults, String> {
    let total = COMMANDS.len() * PULLS.len() + FAMILIES.len() * LEVELS.len();
    let judge = Judge { policy, episodes, seed: draws(seed) };
    let mut results = LocomotionResults {
        suite: "locomotion".into(),
        version: VERSION,
        locomotion: name.into(),
        episodes,
        seed,
        ..Default::default()
    };
    // All rows side by side: one alone has too few squads to keep every thread busy until its end.
    let flat: Vec<_> =
        COMMANDS.iter().flat_map(|command| PULLS.iter().map(move |pull| (command, pull))).collect();
    let judged = flat.into_par_iter().map(|((command_name, command), (pull_name, pull))| {
        let row = judge.row(TerrainGrid::flat(), false, *pull, |_, _| *command)?;
        progress(total);
        Ok(Row { name: (*command_name).into(), under: (*pull_name).into(), ..row })
    });
    results.flat = judged.collect::<Result<_, String>>()?;
    let grounds: Vec<_> =
        FAMILIES.iter().flat_map(|family| LEVELS.map(move |level| (family, level))).collect();
    let judged = grounds.into_par_iter().map(|(family, level)| {
        let grid = tiles(Some(*family), level, judge.seed, episodes)?;
        let row = judge.row(grid, true, [0.0; 3], |robot, step| changing_command(judge.seed, robot, step))?;
        progress(total);
        Ok(Row { name: family.name().into(), under: format!("level {level}"), ..row })
    });
    results.terrain = judged.collect::<Result<_, String>>()?;
    Ok(results)
}

/// A command as a guide dog gets them, another every few seconds: mostly forward, turning, hardly sideways.
fn changing_command(seed: u64, robot: usize, step: usize) -> [f32; 3] {
    let drawn = step / steps(COMMAND_S);
    let mut random = Philox::new(seed, robot, drawn as u32, 1, Purpose::Command);
    [random.uniform(0.3, 1.0), random.uniform(-0.2, 0.2), random.uniform(-0.8, 0.8)]
}

pub(crate) struct Judge<'a> {
    pub(crate) policy: &'a LocomotionPolicy,
    pub(crate) episodes: usize,
    pub(crate) seed: u64,
}

/// Sums over the steps of a number of robots.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    survived: usize,
    upright: f64,
    error: [f64; 3],
    tracking: f64,
    yaw_tracking: f64,
    behavior_reward: f64,
    /// Seconds told to walk, and those of them in which a robot was stuck.
    walks: f64,
    stuck: f64,
}

impl Judge<'_> {
    /// Episodes on a ground, of the nominal robot or of robots drawn as in training, under a steady pull at the hand.
    pub(crate) fn row(
        &self,
        grid: TerrainGrid,
        randomize: bool,
        pull: [f32; 3],
        command: impl Fn(usize, usize) -> [f32; 3] + Sync,
    ) -> Result<Row, String> {
        let simulation = Simulation::new(grid.field.clone(), self.policy.physics());
        let course =
            Course { simulation, policy: self.policy.clone(), observation_noise: 0.0, seed: self.seed };
        let (randomization, spread) = if randomize {
            (Randomization::default(), ResetSpread::default())
        } else {
            (Randomization::none(), ResetSpread::standing())
        };
        let squads = course.squads(self.episodes.next_multiple_of(GROUP), &randomization)?;
        let sums: Vec<Sums> = squads
            .into_par_iter()
            .map(|mut squad| {
                for robot in 0..squad.robots() {
                    let number = squad.first_robot + robot;
                    let mut random = Philox::new(self.seed, number, 0, 0, Purpose::Reset);
                    let spawn = start(&grid, &mut random);
                    squad.reset(&course, robot, spawn, &spread, &mut random);
                    squad.set_hand_force(robot, pull);
                }
                run(&course, squad, self.episodes, &command)
            })
            .collect();
        Ok(self.summarize(&sums))
    }

    fn summarize(&self, sums: &[Sums]) -> Row {
        let sum = |of: &dyn Fn(&Sums) -> f64| sums.iter().map(of).sum::<f64>();
        let survived = sums.iter().map(|sums| sums.survived).sum();
        let scheduled = (self.episodes * steps(EPISODE_S - SETTLING_S)) as f64;
        let upright = sum(&|s| s.upright).max(1.0);
        Row {
            episodes: self.episodes,
            survived,
            survival: survived as f64 / self.episodes as f64,
            wilson_low: wilson_interval(survived, self.episodes).low,
            error: [0, 1, 2].map(|axis| sum(&|s| s.error[axis]) / upright),
            tracking: sum(&|s| s.tracking) / scheduled,
            yaw_tracking: sum(&|s| s.yaw_tracking) / scheduled,
            behavior_reward: sum(&|s| s.behavior_reward) / scheduled,
            stuck: sum(&|s| s.stuck) / sum(&|s| s.walks).max(1.0),
            ..Row::default()
        }
    }
}

/// Whether a robot was stuck on a way; none if it was not told to go far enough to tell.
fn was_stuck(way: &Way) -> Option<bool> {
    let told_to_go = f64::from(way.commanded) > 0.25 * STUCK_S;
    told_to_go.then_some(f64::from(way.progress) < STUCK_SHARE * f64::from(way.commanded))
}

fn run(
    course: &Course,
    mut squad: Squad,
    episodes: usize,
    command: &(impl Fn(usize, usize) -> [f32; 3] + Sync),
) -> Sums {
    let robots = squad.robots();
    let judged = robots.min(episodes.saturating_sub(squad.first_robot));
    let mut fallen = vec![false; robots];
    let mut ways = vec![Way::default(); judged];
    let mut sums = Sums::default();
    for step in 0..steps(EPISODE_S) {
        let commands: Vec<[f32; 3]> = (0..robots).map(|r| command(squad.first_robot + r, step)).collect();
        squad.control_step(course, &commands, |_| (0, step as u32));
        for robot in 0..judged {
            fallen[robot] |= squad.has_fallen(robot);
            if fallen[robot] || step < steps(SETTLING_S) {
                continue;
            }
            let motion = squad.motion(robot);
            let [v_x, v_y, _] = motion.linear_velocity;
            let done = [v_x, v_y, motion.angular_velocity[2]];
            let e: [f64; 3] = std::array::from_fn(|i| f64::from(done[i] - commands[robot][i]));
            let planar = e[0] * e[0] + e[1] * e[1];
            sums.upright += 1.0;
            (0..3).for_each(|axis| sums.error[axis] += e[axis]);
            sums.tracking += (-planar / 0.25).exp();
            sums.yaw_tracking += (-e[2] * e[2] / 0.25).exp();
            sums.behavior_reward += (-10.0 * (planar + e[2] * e[2])).exp();
            ways[robot].walk(commands[robot], &motion);
            if (step + 1) % steps(STUCK_S) == 0
                && let Some(stuck) = was_stuck(&std::mem::take(&mut ways[robot]))
            {
                sums.walks += 1.0;
                sums.stuck += f64::from(u8::from(stuck));
            }
        }
    }
    sums.survived = fallen[..judged].iter().filter(|&&fell| !fell).count();
    sums
}

impl LocomotionResults {
    /// The tables a person reads on the terminal.
    pub fn tables(&self) -> String {
        let head = |first: &str, second: &str| {
            format!(
                "{first:13} {second:13} survival  at least  tracking  behavior reward  stuck  error v_x    v_y    ω_z\n"
            )
        };
        let row = |r: &Row| {
            let [x, y, w] = r.error;
            format!(
                "{:13} {:13} {:8.3} {:9.3} {:9.3} {:16.3} {:6.2} {:10.2} {:6.2} {:6.2}\n",
                r.name, r.under, r.survival, r.wilson_low, r.tracking, r.behavior_reward, r.stuck, x, y, w
            )
        };
        let mut text =
            format!("locomotion policy {}, {} episodes of 20 s a row\n\n", self.locomotion, self.episodes);
        text += &head("command", "pull");
        self.flat.iter().for_each(|r| text += &row(r));
        text += "\n";
        text += &head("ground", "level");
        self.terrain.iter().for_each(|r| text += &row(r));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stuck_is_less_than_a_fourth_of_the_way() {
        let after = |progress, commanded| was_stuck(&Way { progress, commanded });
        assert_eq!(after(0.19, 0.8), Some(true));
        assert_eq!(after(0.21, 0.8), Some(false));
        assert_eq!(after(0.0, 0.2), None, "told to stand");
    }
}
