//! Every configuration in `configs/` resolves, validates and builds its environments.

use std::path::Path;

use guidedog::config::resolve;
use guidedog::learner::Trainable as _;
use guidedog::run_config::{LocomotionRun, SupervisorRun};

fn files(folder: &str) -> Vec<std::path::PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(folder);
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files: Vec<_> = files.filter(|path| path.is_file()).collect();
    assert!(!files.is_empty());
    files
}

#[test]
fn locomotion_configurations_can_be_trained() {
    for file in files("locomotion").into_iter().chain(files("locomotion/shipped")) {
        let config: LocomotionRun = resolve(Some(&file), &[]).unwrap();
        config.validate().unwrap();
        config.task.environments(16, 1).unwrap();
    }
}

#[test]
fn supervisor_configurations_can_be_trained() {
    for file in files("supervisor") {
        let config: SupervisorRun = resolve(Some(&file), &[]).unwrap();
        config.validate().unwrap();
        config.task.environments(16, 1).unwrap();
    }
}

/// What the paper fixes, and what its framework's defaults are where it does not.
#[test]
fn the_papers_setting_is_the_papers() {
    let file = |name: &str| Path::new(env!("CARGO_MANIFEST_DIR")).join("configs").join(name);
    let walk: LocomotionRun = resolve(Some(&file("locomotion/paper.toml")), &[]).unwrap();
    assert_eq!((walk.training.num_envs, walk.ppo.steps_per_env), (4096, 24));
    assert_eq!(walk.ppo.actor_hidden, [512, 256, 128]);
    let guide: SupervisorRun = resolve(Some(&file("supervisor/paper.toml")), &[]).unwrap();
    assert_eq!((guide.training.num_envs, guide.training.iterations), (4096, 3000));
    assert_eq!(guide.ppo.actor_hidden, [128, 128, 128]);
    assert_eq!(guide.task.pull.x_n, [-80.0, 0.0]);
    assert_eq!((guide.task.command_rate, guide.task.heading_drift), (-1e-4, 0.0));
}
