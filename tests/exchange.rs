//! Episodes for another engine: what it records of them is judged as our own are.

use std::path::Path;

use guidedog::evaluation::judge::{Arena, Setting};
use guidedog::evaluation::results::Results;
use guidedog::evaluation::suite::suite;
use guidedog::judging::{Names, judge_cases, judge_record, write_plan};
use guidedog::policies::{self, SHIPPED};
use guidedog::policy::Checkpoint;

const EPISODES: usize = 2;
const OF_CASES: usize = 17 * EPISODES;
/// Numbers of a sample: velocity, place, command, fallen.
const RECORDED: usize = 10;
/// The step at which the first robot of the reward falls, of a thousand.
const FALL: usize = 400;

fn arena() -> Arena {
    let setting = Setting { randomize: true, episodes: EPISODES, seed: 5, ..Setting::default() };
    Arena::new(policies::locomotion(SHIPPED).unwrap(), setting).unwrap()
}

fn flag(is: bool) -> f32 {
    f32::from(u8::from(is))
}

/// What our own engine makes of a plan, written as another would; robots of the reward walk on at 0.8 m/s, whatever they are told.
fn record(plan: &Checkpoint, arena: &Arena) -> Checkpoint {
    let (robots, longest) = (plan.tensors["force"].0[0], plan.tensors["force"].0[1]);
    let (cases, supervisor) = (suite("paper17").unwrap(), policies::supervisor(SHIPPED).unwrap());
    let played = arena.play(&supervisor, &cases, &|_| {}, |_, _, recording| recording).unwrap();
    let mut samples = Vec::new();
    for robot in 0..robots {
        for step in 0..longest {
            let row = match played.get(robot) {
                None => {
                    let fallen = flag(robot == OF_CASES && step >= FALL);
                    [0.8, 0.0, 0.0, 0.0, 0.0, 0.0, 0.8, 0.0, 0.0, fallen]
                }
                Some(recording) => recording.samples.get(step).map_or([0.0; RECORDED], |sample| {
                    let force = &plan.tensors["force"].1[3 * (robot * longest + step)..][..3];
                    assert_eq!(force, sample.force, "robot {robot} is pulled as planned at step {step}");
                    let ([v_x, v_y, w_z], [x, y], [a, b, c]) =
                        (sample.velocity, sample.position, sample.command);
                    let fallen = flag(recording.fell_at.is_some_and(|fell| step >= fell));
                    [v_x, v_y, w_z, x, y, sample.yaw, a, b, c, fallen]
                }),
            };
            samples.extend(row);
        }
    }
    let mut record = plan.clone();
    record.tensors.insert("samples".into(), (vec![robots, longest, RECORDED], samples));
    for (name, text) in [("engine", "another"), ("locomotion", "a"), ("supervisor", "b")] {
        record.header.insert(name.into(), text.into());
    }
    record
}

/// Table I and Table II by hand, for robots that walk on at 0.8 m/s.
fn reward_of_walking_on(plan: &Checkpoint) -> f64 {
    let (robots, longest) = (plan.tensors["force"].0[0], plan.tensors["force"].0[1]);
    let mut sum = 0.0;
    for robot in OF_CASES..robots {
        for step in 0..if robot == OF_CASES { FALL } else { 1000 } {
            let force = &plan.tensors["force"].1[3 * (robot * longest + step)..];
            let missed = if force[0] < -40.0 { 0.8 } else { 0.0 };
            let turn = if force[1].abs() > 20.0 { 0.02 * f64::from(force[1]) } else { 0.0 };
            sum += (-10.0 * (missed * missed + turn * turn)).exp();
        }
    }
    sum / ((robots - OF_CASES) * 1000) as f64
}

fn judged(record: &Checkpoint, folder: &Path) -> anyhow::Result<Results> {
    let path = folder.join("record");
    record.save(&path)?;
    Ok(judge_record(&path)?.0)
}

#[test]
fn a_record_of_our_own_episodes_is_judged_as_they_are() {
    let (arena, folder) = (arena(), tempfile::tempdir().unwrap());
    let (path, cases) = (folder.path().join("plan"), suite("paper17").unwrap());
    write_plan(&arena, &cases, "paper17", &path).unwrap();
    let plan = Checkpoint::load(&path).unwrap();
    let record = record(&plan, &arena);
    let found = judged(&record, folder.path()).unwrap();

    let names = Names::new("paper17", SHIPPED, SHIPPED).unwrap();
    let (own, _) = judge_cases(&arena, &policies::supervisor(SHIPPED).unwrap(), &cases, &names).unwrap();
    let mut own_cases = own.cases;
    // What robots met is not in a record.
    own_cases.iter_mut().for_each(|case| case.splits.clear());
    assert_eq!(found.cases, own_cases);
    assert_eq!((found.confusion, found.falls_per_1000), (own.confusion, own.falls_per_1000));
    assert_eq!((found.engine.as_deref(), found.randomize, found.episodes), (Some("another"), true, EPISODES));
    let expected = reward_of_walking_on(&plan);
    assert!((found.reward.total - expected).abs() < 1e-6, "{} and {expected}", found.reward.total);

    for (name, text, message) in [
        ("version", "1", "version is 1"),
        ("episodes", "0", "episodes is 0"),
        ("episodes", "18446744073709551615", "episodes is 18446744073709551615"),
        ("episodes", "10", "paper17 needs 170 robots"),
        ("suite", "paper18", "suite is `paper18`"),
    ] {
        let mut wrong = record.clone();
        wrong.header.insert(name.into(), text.into());
        let refused = judged(&wrong, folder.path()).unwrap_err().to_string();
        assert!(refused.contains(message), "{name} {text}: {refused}");
    }
}
