//! The scores that trainings are timed to: what the shipped policies have of them, and what those who do nothing have.

use std::time::Instant;

use guidedog::evaluation::milestones::{self, Score, Understanding};
use guidedog::policies::{SHIPPED, locomotion, supervisor};
use guidedog::policy::read_onnx;
use guidedog::tasks::guidance::LocomotionPolicy;

/// The shipped network with the last layer at zero: the default pose, held.
fn standing() -> LocomotionPolicy {
    let mut file = read_onnx(guidedog::policies::LOCOMOTION).unwrap();
    let last = file.mlp.layers.last_mut().unwrap();
    last.weight.fill(0.0);
    last.bias.fill(0.0);
    LocomotionPolicy::new(file).unwrap()
}

fn timed(what: &str, score: impl FnOnce() -> Result<Score, String>) -> Score {
    let started = Instant::now();
    let score = score().unwrap();
    println!("{what}: {:.3} {:?} in {:.1} s", score.value, score.parts, started.elapsed().as_secs_f64());
    score
}

fn part(score: &Score, name: &str) -> f64 {
    score.parts.iter().find(|(known, _)| *known == name).unwrap().1
}

#[test]
fn on_level_ground_the_shipped_walk_is_there_and_standing_is_not() {
    let shipped = locomotion(SHIPPED).unwrap();
    let walking = timed("shipped, flat", || milestones::flat(&shipped));
    assert!((0.9..1.0).contains(&walking.value), "{walking:?}");
    let combined = (part(&walking, "tracking_linear") + 0.5 * part(&walking, "tracking_yaw")) / 1.5;
    assert!((walking.value - combined).abs() < 1e-12);
    assert_eq!(walking, milestones::flat(&shipped).unwrap(), "judged twice, scored twice");
    let standing = timed("standing, flat", || milestones::flat(&standing()));
    assert!((0.3..0.6).contains(&standing.value) && part(&standing, "survival") == 1.0, "{standing:?}");
}

#[test]
fn on_rough_ground_the_shipped_walk_climbs_and_standing_does_not() {
    let shipped = timed("shipped, rough", || milestones::rough(&locomotion(SHIPPED).unwrap()));
    assert!((5.0..6.0).contains(&shipped.value) && part(&shipped, "survival") > 0.94, "{shipped:?}");
    let standing = timed("standing, rough", || milestones::rough(&standing()));
    assert!(standing.value < 0.5, "{standing:?}");
}

#[test]
fn the_shipped_supervisor_is_near_the_oracle_and_rules_that_see_the_same_are_level_with_it() {
    let judge = Understanding::new(locomotion(SHIPPED).unwrap()).unwrap();
    let score = |source: &str| timed(source, || judge.score(&supervisor(source).unwrap())).value;
    assert!(score(SHIPPED) > 0.9);
    // Without noise, and with pulls that change when rules decide, they give the oracle's commands.
    assert!((score("rules") - 1.0).abs() < 1e-3);
    assert!(score("dominance") < 0.7);
}
