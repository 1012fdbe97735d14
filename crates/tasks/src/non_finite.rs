//! The check both environments are put to: a robot whose state is no longer numbers is reset and counted, and no other robot notices.

use policy::{StepBuffers, VecEnv};
use spatial::Lane as _;

use crate::simulation::{GROUP, Group};

const SPOILT: usize = 21;
/// Robots: the spoilt one, others of its group, and a group beside it.
pub(crate) const ENVS: usize = 2 * GROUP;
/// Steps, and the one before which a robot is spoilt.
const STEPS: usize = 20;
const SPOILT_AT: usize = 5;

/// Ways in which a robot's state can stop to be numbers, or numbers of a sensible size.
const SPOILS: [fn(&mut Group, usize); 6] = [
    |group, lane| group.block.state.base_position.set(lane, [f64::NAN, 0.0, 0.0]),
    |group, lane| group.block.state.base_orientation.set(lane, [f64::INFINITY, 0.0, 0.0, 1.0]),
    |group, lane| group.block.state.base_linear_velocity.set(lane, [0.0, 0.0, 1e30]),
    |group, lane| group.block.state.joint_position[5].set(lane, f64::NEG_INFINITY),
    |group, lane| group.block.state.joint_velocity[11].set(lane, f64::NAN),
    |group, lane| group.block.state.joint_velocity[4].set(lane, 1e3),
];

/// Spoils one robot in every way there is, in an environment of [`ENVS`] made anew each time; `group` finds the group of a robot.
/// Gives what the robot got for it each time.
pub(crate) fn only_the_spoilt_robot_notices<E: VecEnv>(
    make: impl Fn() -> E,
    group: impl Fn(&mut E, usize) -> &mut Group,
) -> Vec<f32> {
    // What every step gives, and how many broken states are reported.
    let run = |spoil: fn(&mut Group, usize)| {
        let mut env = make();
        let (width, actions) = (env.observation_dim(), env.action_dim());
        let mut buffers = StepBuffers::new(ENVS, width);
        env.reset(&mut buffers.observations);
        let mut steps = Vec::new();
        for step in 0..STEPS {
            if step == SPOILT_AT {
                spoil(group(&mut env, SPOILT), SPOILT % GROUP);
            }
            let action = |i: usize| 0.3 * ((i + 7 * step) as f32).sin();
            env.step(&(0..ENVS * actions).map(action).collect::<Vec<_>>(), &mut buffers);
            steps.push(buffers.clone());
        }
        let metrics = env.drain_metrics();
        let broken = metrics.iter().find(|(name, _)| name == "broken_states").expect("it is reported").1;
        assert!(metrics.iter().all(|(_, value)| value.is_finite()), "{metrics:?}");
        (steps, broken, width)
    };
    let (expected, none, width) = run(|_, _| ());
    assert_eq!(none, 0.0);
    let judged = SPOILS.map(|spoil| {
        let (found, broken, _) = run(spoil);
        assert_eq!(broken, 1.0);
        let at = &found[SPOILT_AT];
        assert!(at.terminated[SPOILT] && !at.truncated[SPOILT]);
        assert!(at.last_observations[SPOILT * width..][..width].iter().all(|&x| x == 0.0));
        for (found, expected) in found.iter().zip(&expected) {
            assert!(found.observations.iter().chain(&found.rewards).all(|x| x.is_finite()));
            for env in (0..ENVS).filter(|&env| env != SPOILT) {
                let row = env * width..(env + 1) * width;
                assert!(found.observations[row.clone()] == expected.observations[row], "robot {env}");
                assert_eq!(found.rewards[env].to_bits(), expected.rewards[env].to_bits(), "robot {env}");
                assert_eq!(found.terminated[env], expected.terminated[env], "robot {env}");
            }
        }
        at.rewards[SPOILT]
    });
    judged.to_vec()
}
