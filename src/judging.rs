//! Judging policies with progress on the terminal: what `evaluate` and `reproduce` share.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use anyhow::{Result, anyhow};
use evaluation::judge::Arena;
use evaluation::report::PathTrace;
use evaluation::results::{BehaviorReward, CaseResult, Results};
use evaluation::suite::Case;
use tasks::guidance::Supervisor;

use crate::progress::Progress;

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
    let (cases, traces) = run_suite(arena, supervisor, cases, &names.supervisor)?;
    let reward_of = |supervisor| arena.behavior_reward(supervisor, REWARD_ROBOTS).map_err(|m| anyhow!(m));
    let oracle_reward = oracle_reward.map_or_else(|| reward_of(&Supervisor::Oracle), Ok)?;
    let reward = if *supervisor == Supervisor::Oracle { oracle_reward } else { reward_of(supervisor)? };
    let setting = arena.setting();
    let results = Results {
        suite: names.suite.clone(),
        ground: setting.ground.name().into(),
        level: setting.level,
        randomize: setting.randomize,
        episodes: setting.episodes,
        seed: setting.seed,
        locomotion: names.locomotion.clone(),
        supervisor: names.supervisor.clone(),
        cases,
        reward,
        oracle_reward,
    };
    Ok((results, traces))
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

/// The table a person reads on the terminal.
pub fn table(results: &Results) -> String {
    let mut text = format!(
        "{} on {} ground{}, {} episodes a case; locomotion {}, supervisor {}\n\n",
        results.suite,
        results.ground,
        if results.ground == "flat" { String::new() } else { format!(" of level {}", results.level) },
        results.episodes,
        results.locomotion,
        results.supervisor
    );
    text += "case      behavior group    success  95 % interval  falls    v_x    v_y    ω_z  drift °/10 s\n";
    for case in &results.cases {
        text += &format!(
            "{:9} {:8} {:8} {:7.3}  {:.3} to {:.3} {:6} {:6.2} {:6.2} {:6.2} {:13.1}\n",
            case.name,
            case.behavior,
            case.group,
            case.success_rate,
            case.wilson_low,
            case.wilson_high,
            case.falls,
            case.mean_vx,
            case.mean_vy,
            case.mean_wz,
            case.heading_drift_deg_per_10s
        );
    }
    let paper = BehaviorReward::PAPER;
    text += "\nbehavior reward   total   stop   spin   walk   turn\n";
    let rows = [
        (results.supervisor.as_str(), results.reward),
        ("oracle", results.oracle_reward),
        ("the paper", paper),
    ];
    for (name, r) in rows {
        let name: String = name.chars().rev().take(16).collect::<Vec<_>>().into_iter().rev().collect();
        text += &format!(
            "{name:16} {:6.3} {:6.3} {:6.3} {:6.3} {:6.3}\n",
            r.total, r.stop, r.spin, r.walk, r.turn
        );
    }
    text
}
