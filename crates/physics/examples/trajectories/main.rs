//! Draws our trajectories beside MuJoCo's into `docs/physics/` and prints how far they are apart:
//! `cargo run --release -p guidedog-physics --example trajectories`. With a file of `mint_trajectories.py` at other
//! settings as its argument it draws nothing and prints how far that one is from the one in the tests: MuJoCo from
//! itself.

#[path = "../../tests/scenes/mod.rs"]
mod scenes;

mod figure;

use std::{fs, path::Path};

use figure::{Panel, figure};
use physics::Config;
use scenes::{CONTROL_PERIOD, QUANTITIES, Sample, golden, sample::recorded};

/// MuJoCo's, of all records \[s\].
const MUJOCO_TIME_STEP: f64 = 0.000_05;

/// What a panel shows.
type Curve = (&'static str, fn(&Sample) -> f64);

const X: Curve = ("base x [m]", |s| s.position[0]);
const Y: Curve = ("base y [m]", |s| s.position[1]);
const HEIGHT: Curve = ("base height [m]", |s| s.position[2]);
const FORCE: Curve = ("vertical force of the ground [N]", |s| s.vertical_force);
const SPEED: Curve = ("forward speed [m/s]", |s| s.velocity[0]);
const KNEE: Curve = ("knee of the left front leg [rad]", |s| s.joints[8]);

fn curves(scene: &str) -> [Curve; 3] {
    match scene {
        "push" => [Y, HEIGHT, FORCE],
        "slide" => [X, SPEED, FORCE],
        "drop" | "stand" => [HEIGHT, FORCE, KNEE],
        _ => [X, HEIGHT, KNEE],
    }
}

fn main() -> std::io::Result<()> {
    let others = std::env::args().nth(1).map(fs::read_to_string).transpose()?;
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/physics");
    fs::create_dir_all(&folder)?;
    println!(
        "| scene | until | step | {} |",
        QUANTITIES.each_ref().map(|quantity| quantity.name).join(" | ")
    );
    println!("|---|---|---|{}", "---|".repeat(QUANTITIES.len()));
    for scene in scenes::all() {
        let mujoco = golden(scene.name);
        if let Some(others) = &others {
            rows(scene.name, MUJOCO_TIME_STEP, &recorded(others, scene.name), &mujoco);
            continue;
        }
        for time_step in [0.005, 0.001] {
            let config = Config { time_step, ..Config::default() };
            let ours = scene.simulate::<f64>(&mujoco[0], mujoco.len(), config);
            rows(scene.name, time_step, &ours, &mujoco);
            if time_step == 0.005 {
                let panel = |(label, value): Curve| Panel {
                    label,
                    ours: ours.iter().map(value).collect(),
                    mujoco: mujoco.iter().map(value).collect(),
                };
                let panels = curves(scene.name).map(panel);
                fs::write(folder.join(format!("{}.svg", scene.name)), figure(&panels, CONTROL_PERIOD))?;
            }
        }
    }
    Ok(())
}

/// Half a second, one and a half, all.
fn rows(scene: &str, time_step: f64, ours: &[Sample], mujoco: &[Sample]) {
    for samples in [26, 76, mujoco.len()].into_iter().filter(|&samples| samples <= ours.len()) {
        row(scene, time_step, &ours[..samples], mujoco);
    }
}

/// Largest differences, and in brackets how many time steps they are worth while that is a few.
fn row(scene: &str, time_step: f64, ours: &[Sample], mujoco: &[Sample]) {
    let until = (ours.len() - 1) as f64 * CONTROL_PERIOD;
    print!("| {scene} | {until:.1} s | {} ms |", time_step * 1e3);
    for quantity in &QUANTITIES {
        let steps = quantity.steps_off(ours, &mujoco[..ours.len()], time_step);
        let steps = if steps < 10.0 { format!(" ({steps:.1})") } else { String::new() };
        print!(" {}{steps} |", quantity.text(quantity.difference(ours, mujoco)));
    }
    println!();
}
