//! When episodes end, and what their mirror images do.

use super::*;
use crate::{
    guidance::{PullConfig, test_policy},
    locomotion::Terrain,
    mirror_image,
    simulation::{Randomization, ResetSpread},
    truncation,
};

/// On level ground, under one pull.
fn steady(force: [f32; 3]) -> GuidanceConfig {
    let [x_n, y_n, z_n] = force.map(|newtons| [newtons; 2]);
    let pull = PullConfig {
        x_n,
        y_n,
        z_n,
        near_threshold_share: 0.0,
        noise_n: [0.0; 3],
        period_s: 1000.0,
        ..PullConfig::default()
    };
    GuidanceConfig {
        terrain: Terrain::Flat,
        reset: ResetSpread::standing(),
        pull,
        ..GuidanceConfig::default()
    }
}

#[test]
fn episodes_end_at_their_last_step() {
    let policy = LocomotionPolicy::new(test_policy()).unwrap();
    let make = |episode_s| {
        let config = GuidanceConfig { episode_s, ..steady([-10.0, 5.0, 0.0]) };
        GuidanceEnv::new(config, policy.clone(), truncation::ENVS, 3).unwrap()
    };
    let set = |env: &mut GuidanceEnv, robot: usize, steps| env.squads[0].robots[robot].head_start = steps;
    let step_s = GuidanceConfig::default().supervisor_period_s;
    truncation::episodes_end_at_their_last_step(make, set, step_s);
}

#[test]
fn a_mirror_image_stays_one() {
    // Joints follow their own position, and the hips what is commanded to the side and around: as symmetric as a walk has to be.
    let mut file = test_policy();
    let layer = &mut file.mlp.layers[0];
    for joint in 0..layout::JOINTS {
        let row = &mut layer.weight[joint * layer.inputs..][..layer.inputs];
        row[layout::JOINT_POSITION.offset + joint] = 0.5;
        if joint < 4 {
            let is_front = joint % 2 == 0;
            let around = if is_front { 1.0 } else { -1.0 };
            row[layout::VELOCITY_COMMAND.range()].copy_from_slice(&[0.0, 1.0, around]);
        }
    }
    let policy = LocomotionPolicy::new(file).unwrap();
    let make = |side: f32| {
        let config = GuidanceConfig {
            observation_noise: 0.0,
            supervisor_period_s: 0.02,
            randomization: Randomization::none(),
            ..steady([-50.0, side * 40.0, 20.0])
        };
        let mut env = GuidanceEnv::new(config, policy.clone(), mirror_image::ENVS, 3).unwrap();
        env.course.simulation = Simulation::new(mirror_image::slope(side), policy.physics());
        env
    };
    mirror_image::a_mirror_image_stays_one(make, |env| env.squads[0].squad.group_mut(0), |_, _| ());
}
