//! Draws our trajectories beside MuJoCo's into `docs/physics/` and prints how far they are apart:
//! `cargo run --release -p guidedog-physics --example trajectories`.

#[path = "../../tests/scenes/mod.rs"]
mod scenes;

mod figure;

use std::{fs, path::Path};

use figure::{Panel, figure};
use physics::Config;
use scenes::{CONTROL_PERIOD, QUANTITIES, Sample, golden};

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
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/physics");
    fs::create_dir_all(&folder)?;
    println!(
        "| scene | until | step | {} |",
        QUANTITIES.each_ref().map(|quantity| quantity.name).join(" | ")
    );
    println!("|---|---|---|{}", "---|".repeat(QUANTITIES.len()));
    for scene in scenes::all() {
        let mujoco = golden(scene.name);
        for time_step in [0.005, 0.001] {
            let config = Config { time_step, ..Config::default() };
            let ours = scene.simulate::<f64>(&mujoco[0], mujoco.len(), config);
            for samples in [26, 76, mujoco.len()].into_iter().filter(|&samples| samples <= ours.len()) {
                row(scene.name, time_step, &ours[..samples], &mujoco);
            }
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
