//! The check both environments are put to: a robot that tips over has fallen, which ends its episode without return and has its price.

use std::f64::consts::FRAC_1_SQRT_2;

use policy::{StepBuffers, VecEnv};

use crate::simulation::{GROUP, Group};

/// Robots, and the one that tips over.
pub(crate) const ENVS: usize = GROUP;
const TIPPED: usize = 5;
const PRICE: f32 = -2.5;

/// Tips one robot over in an environment of [`ENVS`] on flat ground, made with a price on falls; `group` finds the robots' group.
pub(crate) fn a_robot_that_tips_over_ends_and_pays<E: VecEnv>(
    make: impl Fn(f32) -> E,
    group: impl Fn(&mut E) -> &mut Group,
) {
    let rewards = |price: f32| {
        let mut env = make(price);
        let mut buffers = StepBuffers::new(ENVS, env.observation_dim());
        env.reset(&mut buffers.observations);
        // A quarter turn about x.
        let on_its_side = [FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0];
        group(&mut env).block.state.base_orientation.set(TIPPED, on_its_side);
        env.step(&vec![0.0; ENVS * env.action_dim()], &mut buffers);
        for robot in 0..ENVS {
            assert_eq!(buffers.terminated[robot], robot == TIPPED, "robot {robot}");
        }
        assert!(!buffers.truncated[TIPPED]);
        let broken = env.drain_metrics().into_iter().find(|(name, _)| name == "broken_states").unwrap();
        assert_eq!(broken.1, 0.0, "it has fallen, and is still made of numbers");
        buffers.rewards
    };
    let (free, priced) = (rewards(0.0), rewards(PRICE));
    for robot in 0..ENVS {
        let price = if robot == TIPPED { PRICE } else { 0.0 };
        assert!((priced[robot] - free[robot] - price).abs() < 1e-5, "robot {robot}");
    }
}
