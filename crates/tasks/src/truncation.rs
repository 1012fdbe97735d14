//! The check both environments are put to: an episode that is cut short ends exactly at its last step, and its last observation is the
//! one it would have gone on from.

use policy::{StepBuffers, VecEnv};

use crate::simulation::{CONTROL_PERIOD_S, GROUP, control_steps};

/// Robots.
pub(crate) const ENVS: usize = GROUP;
const EPISODE_S: f32 = 1.0;

/// Ends the episodes of an environment of [`ENVS`] whose commands and forces stay and under which robots that do nothing stand. It is
/// made with episodes of some length \[s\]; `set_head_start` sets the control steps a robot counts as having lived before.
pub(crate) fn episodes_end_at_their_last_step<E: VecEnv>(
    make: impl Fn(f32) -> E,
    set_head_start: impl Fn(&mut E, usize, u32),
    step_s: f32,
) {
    let mut envs = [EPISODE_S, 100.0].map(make);
    let (width, actions) = (envs[0].observation_dim(), vec![0.0; ENVS * envs[0].action_dim()]);
    let in_a_step = (step_s / CONTROL_PERIOD_S).round() as u32;
    let steps = control_steps(EPISODE_S) / in_a_step;
    let lived = |robot: usize| robot as u32 % (steps - 1);
    let [mut short, mut long] = [(); 2].map(|()| StepBuffers::new(ENVS, width));
    for (env, buffers) in envs.iter_mut().zip([&mut short, &mut long]) {
        env.reset(&mut buffers.observations);
        (0..ENVS).for_each(|robot| set_head_start(env, robot, lived(robot) * in_a_step));
    }
    for step in 1..=2 * steps {
        envs[0].step(&actions, &mut short);
        envs[1].step(&actions, &mut long);
        for robot in 0..ENVS {
            let first = steps - lived(robot);
            let ends = step == first || step == first + steps;
            assert_eq!(
                (short.truncated[robot], long.truncated[robot]),
                (ends, false),
                "robot {robot}, step {step}"
            );
            assert!(!short.terminated[robot] && !long.terminated[robot], "robot {robot} fell");
            let row = robot * width..(robot + 1) * width;
            let goes_on = &long.observations[row.clone()];
            if step < first {
                assert_eq!(&short.observations[row], goes_on, "robot {robot}, step {step}");
            } else if step == first {
                assert_eq!(&short.last_observations[row.clone()], goes_on, "robot {robot}, step {step}");
                assert_ne!(&short.observations[row], goes_on, "a new episode begins");
                assert_eq!(short.rewards[robot].to_bits(), long.rewards[robot].to_bits());
            }
        }
    }
}
