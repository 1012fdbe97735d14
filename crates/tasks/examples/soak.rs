//! Robots under random actions, pushes and extreme randomization on rough ground; reports what is no longer made of
//! numbers and how fast things got: `cargo run --release -p guidedog-tasks --example soak [robot steps] [robots]`.

#[path = "../tests/soak/mod.rs"]
mod soak;

use std::time::{Duration, Instant};

fn main() {
    let mut arguments = std::env::args().skip(1).map(|text| text.parse::<f64>().expect("a number, like 1e8"));
    let robot_steps = arguments.next().unwrap_or(1e8) as u64;
    let robots = arguments.next().unwrap_or(1024.0) as usize;
    let (start, mut told) = (Instant::now(), Instant::now());
    let tally = soak::soak(robots, robot_steps, |tally| {
        if told.elapsed() > Duration::from_secs(10) {
            told = Instant::now();
            let share = tally.robot_steps as f64 / robot_steps as f64;
            let left = start.elapsed().as_secs_f64() * (1.0 - share).max(0.0) / share;
            eprintln!("{:3.0} %, {left:.0} s left: {tally:?}", 100.0 * share);
        }
    });
    let seconds = start.elapsed().as_secs_f64();
    println!("{:.3e} robot-steps in {seconds:.0} s", tally.robot_steps as f64);
    println!(
        "states that are no numbers: {}, faster than a robot can be: {}, falls: {}",
        tally.broken, tally.thrown, tally.falls
    );
    println!(
        "fastest base {:.1} m/s, {:.1} rad/s; fastest joint {:.1} rad/s",
        tally.base_speed, tally.base_rate, tally.joint_rate
    );
}
