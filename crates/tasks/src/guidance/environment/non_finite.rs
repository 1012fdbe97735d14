//! A robot whose state is no longer numbers is reset and counted, and no other robot notices.

use super::*;
use crate::{
    guidance::test_policy,
    locomotion::Terrain,
    simulation::{GROUP, Group, SPOILS},
};

const ENVS: usize = 32;
const SPOILT: usize = 21;

/// What every decision gives before and after robot [`SPOILT`] is spoilt, and how many broken states are reported.
fn run(spoil: fn(&mut Group, usize)) -> (Vec<StepBuffers>, f64) {
    let config = GuidanceConfig { terrain: Terrain::Flat, ..GuidanceConfig::default() };
    let policy = LocomotionPolicy::new(test_policy()).unwrap();
    let mut env = GuidanceEnv::new(config, policy, ENVS, 3).unwrap();
    let mut buffers = StepBuffers::new(ENVS, OBSERVATION);
    env.reset(&mut buffers.observations);
    let mut steps = Vec::new();
    for step in 0..12 {
        if step == 3 {
            spoil(env.squads[0].squad.group_mut(SPOILT), SPOILT % GROUP);
        }
        let actions: Vec<f32> = (0..ENVS * 3).map(|i| ((i + step) as f32).sin()).collect();
        env.step(&actions, &mut buffers);
        steps.push(buffers.clone());
    }
    let metrics = env.drain_metrics();
    let broken = metrics.iter().find(|(name, _)| name == "broken_states").expect("it is reported").1;
    assert!(metrics.iter().all(|(_, value)| value.is_finite()), "{metrics:?}");
    (steps, broken)
}

#[test]
fn a_robot_that_is_no_longer_numbers_is_reset_and_counted_and_nobody_else_notices() {
    let (expected, none) = run(|_, _| ());
    assert_eq!(none, 0.0);
    for spoil in SPOILS {
        let (found, broken) = run(spoil);
        assert_eq!(broken, 1.0);
        let at = &found[3];
        assert!(at.terminated[SPOILT] && !at.truncated[SPOILT]);
        assert!(at.last_observations[SPOILT * OBSERVATION..][..OBSERVATION].iter().all(|&x| x == 0.0));
        for (found, expected) in found.iter().zip(&expected) {
            assert!(found.observations.iter().chain(&found.rewards).all(|x| x.is_finite()));
            for env in (0..ENVS).filter(|&env| env != SPOILT) {
                let row = env * OBSERVATION..(env + 1) * OBSERVATION;
                assert!(found.observations[row.clone()] == expected.observations[row], "robot {env}");
                assert_eq!(found.rewards[env].to_bits(), expected.rewards[env].to_bits(), "robot {env}");
                assert_eq!(found.terminated[env], expected.terminated[env], "robot {env}");
            }
        }
    }
}
