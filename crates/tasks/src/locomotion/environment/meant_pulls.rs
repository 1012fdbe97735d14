//! While a pull that is meant lasts, robots are told to do what Table II says of it.

use super::*;
use crate::guidance::Behavior;
use crate::locomotion::DisturbanceConfig;

const ENVS: usize = 64;

/// How many robots are told what Table II says of the force at their hand, of those that feel one, over some steps.
fn obedience(meant_share: f32) -> [usize; 2] {
    let disturbance = DisturbanceConfig {
        ramp_steps: 0,
        base_share: 0.0,
        hand_share: 1.0,
        meant_share,
        duration_s: [0.1, 2.0],
        period_s: [0.5, 1.5],
        ..DisturbanceConfig::default()
    };
    let mut env =
        LocomotionEnv::new(LocomotionConfig { disturbance, ..LocomotionConfig::default() }, ENVS, 3).unwrap();
    let mut buffers = StepBuffers::new(ENVS, OBSERVATION);
    env.reset(&mut buffers.observations);
    let mut counts = [0; 2];
    for _ in 0..60 {
        env.step(&[0.0; ENVS * 12], &mut buffers);
        for group in &env.groups {
            for (lane, robot) in group.robots.iter().enumerate() {
                let force = group.group.block.input.hand_force.get(lane).map(|f| f as f32);
                if force != [0.0; 3] {
                    counts[0] += usize::from(robot.command == Behavior::of_force(force).target(force));
                    counts[1] += 1;
                }
            }
        }
    }
    counts
}

#[test]
fn robots_are_told_what_a_pull_means_while_it_lasts() {
    let [obeyed, all] = obedience(1.0);
    assert!(obeyed == all && all > 1000, "{obeyed} of {all}");
    assert_eq!(obedience(0.0)[0], 0, "by chance never");
}
