//! Trains a small walking policy on flat ground, in as few lines as that takes:
//! `cargo run --release --example learn_to_walk [iterations] [robots]`.

use guidedog::{
    ppo::{Config, Trainer},
    tasks::locomotion::{LocomotionConfig, LocomotionEnv, Terrain},
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<usize>());
    let iterations = arguments.next().transpose()?.unwrap_or(10);
    let robots = arguments.next().transpose()?.unwrap_or(512);
    let task = LocomotionConfig { terrain: Terrain::Flat, ..LocomotionConfig::default() };
    let small = vec![128, 128, 128];
    let config =
        Config { actor_hidden: small.clone(), critic_hidden: small, desired_kl: 0.02, ..Config::default() };
    let mut trainer = Trainer::new(config, 1, LocomotionEnv::new(task, robots, 1)?)?;
    let start = std::time::Instant::now();
    for _ in 0..iterations {
        let now = trainer.iterate()?;
        let [simulation, networks, update] = now.times_s;
        let metric =
            |name: &str| now.environment.iter().find(|(key, _)| key == name).map_or(0.0, |pair| pair.1);
        println!(
            "{:4} {:5.0} s: reward {:.4}, episode {:5.0} steps, tracking {:.2} {:.2}, falls {:.1}, std {:.2} \
             (simulation {simulation:.2} s, networks {networks:.2} s, update {update:.2} s)",
            now.index,
            start.elapsed().as_secs_f64(),
            now.step_reward,
            now.episode_length,
            metric("tracking_linear"),
            metric("tracking_yaw"),
            metric("falls_per_1000"),
            now.action_std,
        );
    }
    Ok(())
}
