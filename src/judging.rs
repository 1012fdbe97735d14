//! Judging policies with progress on the terminal: what `evaluate` and `reproduce` share.

use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Result, anyhow};
use evaluation::episode::{onset, pulled_steps};
use evaluation::exchange::recordings;
use evaluation::judge::{Arena, draws, summaries, trace};
use evaluation::measures::split::Met;
use evaluation::outcome::Outcome;
use evaluation::plane::{Line, lines};
use evaluation::report::PathTrace;
use evaluation::results::{BehaviorReward, CaseResult, PlaneResult, Results, VERSION};
use evaluation::suite::{Case, SUITES, suite};
use policy::Checkpoint;
use tasks::guidance::Supervisor;

use crate::error::BadInput;
use crate::policies;
use crate::progress::Progress;

/// Level of rough ground and stairs that is judged on unless another is asked for.
pub const LEVEL: usize = 5;
/// Robots over which the behavior reward is averaged.
const REWARD_ROBOTS: usize = 1024;

/// What is judged, by the names that go to `results.json`.
#[derive(Clone, Debug)]
pub struct Names {
    /// The suite.
    pub suite: String,
    /// The locomotion policy.
    pub locomotion: String,
    /// The supervisor.
    pub supervisor: String,
    /// Checksum of both ([`crate::policies::checksum`]).
    pub policies: String,
}

impl Names {
    /// Of policies by their sources.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn new(suite: &str, locomotion: &str, supervisor: &str) -> Result<Self, BadInput> {
        let policies = policies::checksum(locomotion, supervisor)?;
        let [suite, locomotion, supervisor] = [suite, locomotion, supervisor].map(str::to_owned);
        Ok(Self { suite, locomotion, supervisor, policies })
    }
}

/// Runs a suite and the behavior reward; the oracle's too, unless it is known already.
///
/// # Errors
/// There is nothing to run.
pub fn judge(
    arena: &Arena,
    supervisor: &Supervisor,
    cases: &[Case],
    names: &Names,
    oracle_reward: Option<BehaviorReward>,
) -> Result<(Results, Vec<PathTrace>)> {
    let (results, traces) = judge_cases(arena, supervisor, cases, names)?;
    let scan = || scan(arena, supervisor, &names.supervisor, &results.cases);
    let plane = (names.suite == "plane").then(scan).transpose()?;
    let reward_of = |supervisor| arena.behavior_reward(supervisor, REWARD_ROBOTS).map_err(|m| anyhow!(m));
    let oracle_reward = oracle_reward.map_or_else(|| reward_of(&Supervisor::Oracle), Ok)?;
    let reward = if *supervisor == Supervisor::Oracle { oracle_reward } else { reward_of(supervisor)? };
    Ok((Results { reward, oracle_reward, plane, ..results }, traces))
}

/// Runs some cases of a suite, without the behavior reward.
///
/// # Errors
/// There is nothing to run.
pub fn judge_cases(
    arena: &Arena,
    supervisor: &Supervisor,
    cases: &[Case],
    names: &Names,
) -> Result<(Results, Vec<PathTrace>)> {
    let setting = arena.setting();
    let (cases, traces) = run_suite(arena, supervisor, cases, &names.supervisor)?;
    let results = Results {
        cases,
        suite: names.suite.clone(),
        version: VERSION,
        policies: names.policies.clone(),
        ground: setting.ground.name().into(),
        level: setting.level,
        randomize: setting.randomize,
        friction: setting.friction,
        force_noise_n: setting.force_noise_n,
        sensor_noise: setting.sensor_noise,
        unloaded: setting.unloaded,
        episodes: setting.episodes,
        seed: setting.seed,
        locomotion: names.locomotion.clone(),
        supervisor: names.supervisor.clone(),
        ..Results::default()
    };
    Ok((results.with_sums(), traces))
}

/// Scans the lines across the thresholds.
fn scan(arena: &Arena, supervisor: &Supervisor, name: &str, grid: &[CaseResult]) -> Result<PlaneResult> {
    let lines = lines();
    let cases: Vec<Case> = lines.iter().flat_map(|line| line.cases.iter().cloned()).collect();
    let (results, _) = run_suite(arena, supervisor, &cases, &format!("{name} across the thresholds"))?;
    let mut rest = results.as_slice();
    let mut threshold = |line: &Line| {
        let (own, others) = rest.split_at(line.cases.len());
        rest = others;
        line.threshold(own)
    };
    let thresholds = lines.iter().map(&mut threshold).collect();
    Ok(PlaneResult::new(grid, thresholds))
}

/// Robots over which the behavior reward is averaged in another engine, which is slower.
const PLANNED_REWARD_ROBOTS: usize = 128;

/// Writes the episodes of a suite for another engine to play.
///
/// # Errors
/// The disk refuses.
pub fn write_plan(arena: &Arena, cases: &[Case], suite: &str, path: &Path) -> Result<()> {
    let setting = arena.setting();
    let header = [
        ("suite", suite.to_owned()),
        ("ground", setting.ground.name().into()),
        ("level", setting.level.to_string()),
        ("randomize", setting.randomize.to_string()),
        ("episodes", setting.episodes.to_string()),
        ("seed", setting.seed.to_string()),
        ("version", VERSION.to_string()),
    ];
    let plan = arena.plan(cases, PLANNED_REWARD_ROBOTS, &header).map_err(|m| anyhow!(m))?;
    Ok(plan.save(path)?)
}

/// Whether what was judged or planned as `version` may stand beside what is judged now.
///
/// # Errors
/// It is of other suites or measures.
pub fn check_version(version: u32) -> Result<(), BadInput> {
    if version == VERSION {
        return Ok(());
    }
    Err(BadInput::new(format!("version is {version}, must be {VERSION}: have this guidedog make it anew")))
}

/// Judges what another engine recorded after a plan.
///
/// # Errors
/// The file is no record, or not of a suite known here, or of measures and suites of before.
pub fn judge_record(path: &Path) -> Result<(Results, Vec<PathTrace>)> {
    let record = Checkpoint::load(path)?;
    let text = |name: &str| record.number::<String>(name);
    let name = text("suite")?;
    check_version(record.number("version")?)?;
    let cases =
        suite(&name).ok_or_else(|| anyhow!("suite is `{name}`, must be one of {}", SUITES.join(", ")))?;
    let episodes: usize = record.number("episodes")?;
    let seed: u64 = record.number("seed")?;
    let mut recordings = recordings(&record).map_err(|m| anyhow!(m))?;
    let wanted = cases.len().checked_mul(episodes).filter(|&wanted| wanted > 0);
    let wanted = wanted.ok_or_else(|| anyhow!("episodes is {episodes}, must be those of the plan"))?;
    let (of_cases, of_reward) = recordings
        .split_at_mut_checked(wanted)
        .ok_or_else(|| anyhow!("{name} needs {wanted} robots and those of the reward"))?;
    let mut outcomes = Vec::with_capacity(of_cases.len());
    let mut traces = Vec::new();
    for (robot, recording) in of_cases.iter_mut().enumerate() {
        let case = &cases[robot / episodes];
        recording.onset = onset(draws(seed), robot);
        let (found, wanted) = (recording.samples.len(), recording.onset + pulled_steps(case));
        if found != wanted {
            return Err(anyhow!(
                "{}, robot {robot}: an episode of {found} steps, must be {wanted}",
                case.name
            ));
        }
        if robot % episodes == 0 {
            traces.push(trace(case, recording));
        }
        outcomes.push(Outcome::of(case, recording, Met::default()));
    }
    let results = Results {
        suite: name,
        version: VERSION,
        ground: text("ground")?,
        level: record.number("level")?,
        randomize: record.number("randomize")?,
        episodes,
        seed,
        locomotion: text("locomotion")?,
        supervisor: text("supervisor")?,
        cases: summaries(&cases, &outcomes),
        reward: Arena::recorded_reward(of_reward),
        engine: Some(text("engine")?),
        ..Results::default()
    };
    Ok((results.with_sums(), traces))
}

fn run_suite(
    arena: &Arena,
    supervisor: &Supervisor,
    cases: &[Case],
    name: &str,
) -> Result<(Vec<CaseResult>, Vec<PathTrace>)> {
    let what = format!("judging {name}: squad");
    with_progress(&what, |progress| arena.judge(supervisor, cases, progress)).map_err(|m| anyhow!(m))
}

/// Runs work that reports every piece it has done, with the number of all, from any thread.
pub fn with_progress<T>(what: &str, work: impl FnOnce(&(dyn Fn(usize) + Sync)) -> T) -> T {
    let done = AtomicUsize::new(0);
    let bar: Mutex<Option<Progress>> = Mutex::new(None);
    work(&|total: usize| {
        let made = done.fetch_add(1, Ordering::Relaxed) as u64 + 1;
        let Ok(mut bar) = bar.lock() else { return };
        let bar = bar.get_or_insert_with(|| Progress::new(what, 0, total as u64));
        bar.update(made, "");
        if made == total as u64 {
            bar.finish("");
        }
    })
}
