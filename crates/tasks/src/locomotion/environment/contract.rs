//! When episodes end, what their mirror images do, when disturbances and penalties grow.

use super::*;
use crate::{
    locomotion::{DisturbanceConfig, Terrain},
    mirror_image,
    simulation::{Randomization, ResetSpread},
    truncation,
};

/// On level ground, nobody pushed, told the same all the time.
fn quiet() -> LocomotionConfig {
    let mut config = LocomotionConfig { terrain: Terrain::Flat, ..LocomotionConfig::default() };
    config.disturbance.strength = 0.0;
    config.command.period_s = [1000.0; 2];
    config.reset = ResetSpread::standing();
    config
}

#[test]
fn episodes_end_at_their_last_step() {
    let make = |episode_s| {
        LocomotionEnv::new(LocomotionConfig { episode_s, ..quiet() }, truncation::ENVS, 3).unwrap()
    };
    let set = |env: &mut LocomotionEnv, robot: usize, steps| env.groups[0].robots[robot].head_start = steps;
    truncation::episodes_end_at_their_last_step(make, set, CONTROL_PERIOD_S);
}

#[test]
fn a_mirror_image_stays_one() {
    let make = |side| {
        let config =
            LocomotionConfig { observation_noise: 0.0, randomization: Randomization::none(), ..quiet() };
        let mut env = LocomotionEnv::new(config, mirror_image::ENVS, 3).unwrap();
        env.simulation = Simulation::new(mirror_image::slope(side), env.config.physics());
        env
    };
    let set = |env: &mut LocomotionEnv, side: f32| {
        let TaskGroup { group, robots, .. } = &mut env.groups[0];
        for (lane, robot) in robots.iter_mut().enumerate() {
            let turned = side * (0.1 * lane as f32 - 0.8);
            robot.command = [0.5, turned, -turned];
            group.block.input.hand_force.set(lane, [-50.0, 40.0 * f64::from(side), 20.0]);
        }
    };
    mirror_image::a_mirror_image_stays_one(make, |env| &mut env.groups[0].group, set);
}

/// Disturbances and penalties wait for robots that walk as told.
#[test]
fn what_grows_does_so_only_while_robots_walk_as_told() {
    let mut config = LocomotionConfig { ramp_tracking: 0.6, ..quiet() };
    config.disturbance = DisturbanceConfig { ramp_steps: 40, ..config.disturbance };
    (config.reward.penalty_start, config.reward.penalty_ramp_steps) = (0.2, 20);
    let mut env = LocomotionEnv::new(config, GROUP, 3).unwrap();
    let mut buffers = StepBuffers::new(GROUP, OBSERVATION);
    env.reset(&mut buffers.observations);
    let mut grown_after = |tracking: f64| {
        for _ in 0..10 {
            env.step(&[0.0; GROUP * layout::JOINTS], &mut buffers);
        }
        // Of two groups, one of which tracks nothing: the mean over both decides. In the order of `Metrics::to_sums`.
        let mut sums = [Metrics::default().to_sums(); 2];
        [sums[0][0], sums[1][0], sums[0][4]] = [100.0, 100.0, 200.0 * tracking];
        let named = env.report(sums.as_flattened());
        let reported = named.iter().find(|(name, _)| name == "tracking_linear").unwrap().1;
        assert!((reported - tracking).abs() < 1e-12, "{reported}, not {tracking}");
        let (shared, _) = env.split();
        (shared.progress, shared.penalty_scale)
    };
    assert_eq!(grown_after(0.599), (0.0, 0.2));
    assert_eq!(grown_after(0.601), (0.25, 0.6));
    assert_eq!(grown_after(0.599), (0.25, 0.6), "it does not go back");
    assert_eq!(grown_after(0.9), (0.5, 1.0));
    assert_eq!(grown_after(0.9), (0.75, 1.0));
}
