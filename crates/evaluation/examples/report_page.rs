//! Writes a report of invented data, to look at the page without a training and an evaluation before:
//! `cargo run -p guidedog-evaluation --example report_page [FILE]`.

use std::path::PathBuf;

use evaluation::report::{Curve, PathTrace, ReportData, TrainingCurves, write};
use evaluation::results::{Behavior, BehaviorReward, CaseResult, Group, Results};

/// Forces \[N\], group, and successes of 200 for the judged supervisor, the oracle, the rules and the dominance rule.
type Row = (f64, f64, Group, [usize; 4]);

const CASES: [Row; 17] = [
    (0.0, 0.0, Group::Trained, [200, 200, 198, 196]),
    (-20.0, 10.0, Group::Trained, [200, 200, 197, 181]),
    (-40.0, 0.0, Group::Edge, [198, 200, 121, 140]),
    (0.0, 20.0, Group::Edge, [197, 200, 116, 92]),
    (20.0, 0.0, Group::Outside, [194, 196, 190, 171]),
    (-60.0, 0.0, Group::Trained, [200, 199, 199, 188]),
    (-60.0, -10.0, Group::Trained, [200, 198, 196, 180]),
    (-60.0, 20.0, Group::Edge, [199, 193, 109, 130]),
    (-100.0, 0.0, Group::Outside, [196, 174, 170, 150]),
    (0.0, 30.0, Group::Trained, [200, 189, 188, 166]),
    (-20.0, -30.0, Group::Trained, [200, 190, 190, 169]),
    (-40.0, 30.0, Group::Edge, [197, 188, 110, 101]),
    (0.0, 50.0, Group::Outside, [190, 141, 139, 97]),
    (20.0, 50.0, Group::Outside, [183, 118, 112, 60]),
    (-60.0, 30.0, Group::Trained, [200, 199, 197, 177]),
    (-60.0, -30.0, Group::Trained, [200, 200, 197, 175]),
    (-100.0, 50.0, Group::Outside, [195, 171, 168, 122]),
];

fn main() -> std::io::Result<()> {
    let path = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("report.html"), PathBuf::from);
    write(&invented(), &path)?;
    println!("{}", path.display());
    Ok(())
}

fn invented() -> ReportData {
    let note = |key: &str, value: &str| (key.to_owned(), value.to_owned());
    ReportData {
        title: "A report of invented data".into(),
        judged: results("supervisor.onnx", 0, 0.93),
        baselines: vec![results("oracle", 1, 0.91), results("rules", 2, 0.84), results("dominance", 3, 0.69)],
        training: Some(training()),
        traces: CASES.iter().map(trace).collect(),
        notes: vec![
            note("Made by", "an example program: none of these numbers was measured"),
            note("Seed", "1"),
            note("Wall time", "0 s"),
        ],
    }
}

/// The rows of Table II.
fn behavior(fx: f64, fy: f64) -> Behavior {
    match (fx >= -40.0, fy.abs() <= 20.0) {
        (true, true) => Behavior::Walk,
        (false, true) => Behavior::Stop,
        (true, false) => Behavior::Turn,
        (false, false) => Behavior::Spin,
    }
}

/// Forward speed and yaw rate of Table II.
fn targets(fx: f64, fy: f64) -> (f64, f64) {
    (if fx >= -40.0 { 0.8 } else { 0.0 }, if fy.abs() > 20.0 { 0.02 * fy } else { 0.0 })
}

fn results(supervisor: &str, column: usize, reward: f64) -> Results {
    let case = |(fx, fy, group, successes): &Row| {
        let (speed, yaw_rate) = targets(*fx, *fy);
        let missed = 200 - successes[column];
        CaseResult {
            name: format!("{fx}/{fy}"),
            fx: *fx,
            fy: *fy,
            group: *group,
            behavior: behavior(*fx, *fy),
            mean_vx: 0.98 * speed - 0.0004 * fx.abs(),
            mean_vy: 0.001 * fy,
            mean_wz: 0.97 * yaw_rate - 0.0003 * fy,
            heading_drift_deg_per_10s: 1.0 + 0.03 * (fx.abs() + fy.abs()),
            ..CaseResult::from_counts(200, successes[column], missed / 4)
        }
    };
    Results {
        suite: "paper17".into(),
        ground: "flat".into(),
        episodes: 200,
        seed: 1,
        locomotion: "locomotion.onnx".into(),
        supervisor: supervisor.into(),
        cases: CASES.iter().map(case).collect(),
        reward: shares(reward),
        oracle_reward: shares(0.91),
        ..Results::default()
    }
}

fn shares(total: f64) -> BehaviorReward {
    let part = |weight: f64| weight * total / 4.0;
    BehaviorReward { total, stop: part(1.04), walk: part(1.01), turn: part(0.96), spin: part(0.99) }
}

fn training() -> TrainingCurves {
    let uniform = |i: u64| ((i as f64 * 12.9898).sin() * 43_758.545_3).rem_euclid(1.0) - 0.5;
    let noise = |i: u64| uniform(i) + uniform(i + 10_000) + uniform(i + 20_000);
    let curve = |name: &str, end: f64, slowness: f64, spread: f64| Curve {
        name: name.into(),
        points: (1..=1500)
            .map(|i| (i, (end * (1.0 - (-(i as f64) / slowness).exp()) + spread * noise(i)).max(0.0)))
            .collect(),
    };
    TrainingCurves {
        total: curve("Behavior reward", 0.86, 260.0, 0.05),
        behaviors: vec![
            (Behavior::Walk, curve("Share of walk", 0.21, 180.0, 0.02)),
            (Behavior::Stop, curve("Share of stop", 0.235, 90.0, 0.02)),
            (Behavior::Turn, curve("Share of turn", 0.2, 420.0, 0.02)),
            (Behavior::Spin, curve("Share of spin", 0.22, 300.0, 0.02)),
        ],
    }
}

/// Ten seconds of a robot that takes a moment to follow, and sways with its gait.
fn trace((fx, fy, ..): &Row) -> PathTrace {
    let period_s = 0.1;
    let (speed, yaw_rate) = targets(*fx, *fy);
    let (mut x, mut y, mut yaw) = (0.0, 0.0, 0.0_f64);
    let mut points = Vec::new();
    for step in 0..=100 {
        points.push([x, y, yaw]);
        let time = f64::from(step) * period_s;
        let follow = 1.0 - (-time / 0.5).exp();
        let forward = 0.75 + (speed - 0.75) * follow;
        let sway = 0.04 * (9.0 * time).sin() + 0.0006 * fy + 0.0008 * fx;
        x += period_s * (forward * yaw.cos() - sway * yaw.sin());
        y += period_s * (forward * yaw.sin() + sway * yaw.cos());
        yaw += period_s * (yaw_rate * follow - 0.0005 * fy + 0.0007 * fx);
    }
    PathTrace { behavior: behavior(*fx, *fy), case: format!("{fx}/{fy}"), points, period_s }
}
