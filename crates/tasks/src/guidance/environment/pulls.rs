//! Pulls change at the first decision at or after each multiple of their period, also where that is none of the supervisor's.

use super::*;
use crate::{
    guidance::{PullConfig, test_policy},
    locomotion::Terrain,
    simulation::ResetSpread,
};

const ENVS: usize = 16;

/// After which decisions, counted from 1, the robots feel another force.
fn changes(supervisor_period_s: f32, decisions: u32) -> Vec<u32> {
    // Pulls that nobody falls from, in episodes that go on, which the seed sees to.
    let pull = PullConfig {
        x_n: [-1.0, 1.0],
        y_n: [-1.0, 1.0],
        near_threshold_share: 0.0,
        noise_n: [0.0; 3],
        ..PullConfig::default()
    };
    let config = GuidanceConfig {
        terrain: Terrain::Flat,
        episode_s: 1000.0,
        supervisor_period_s,
        pull,
        reset: ResetSpread::standing(),
        ..GuidanceConfig::default()
    };
    let policy = LocomotionPolicy::new(test_policy()).unwrap();
    let mut env = GuidanceEnv::new(config, policy, ENVS, 1).unwrap();
    let mut buffers = StepBuffers::new(ENVS, OBSERVATION);
    env.reset(&mut buffers.observations);
    let forces = |buffers: &StepBuffers| -> Vec<Vec<f32>> {
        let rows = buffers.observations.chunks_exact(OBSERVATION);
        rows.map(|row| row[layout::HARNESS_FORCE.range()].to_vec()).collect()
    };
    let mut before = forces(&buffers);
    let changed = |_: &u32| {
        env.step(&[0.0; ENVS * layout::COMMAND], &mut buffers);
        assert!(buffers.terminated.iter().chain(&buffers.truncated).all(|ended| !ended));
        let now = forces(&buffers);
        let changed = before.iter().zip(&now).filter(|(before, now)| before != now).count();
        before = now;
        assert!(changed == 0 || changed == ENVS, "{changed}");
        changed > 0
    };
    (1..=decisions).filter(changed).collect()
}

#[test]
fn pulls_change_at_the_first_decision_at_or_after_each_multiple_of_their_period() {
    assert_eq!(PullConfig::default().period_s, 2.5);
    assert_eq!(changes(0.2, 52), [13, 25, 38, 50]);
    assert_eq!(changes(0.1, 75), [25, 50, 75]);
}
