//! Several ranks, as threads of this process, train what one process trains: the same checkpoints and metrics.

use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::Result;
use guidedog::config::resolve;
use guidedog::interrupt::Interrupt;
use guidedog::learner::{Start, Trainable, Training};
use guidedog::policy::Checkpoint;
use guidedog::ppo::exchange::threads;
use guidedog::run_config::{LocomotionRun, Run};
use guidedog::run_folder::RunFolder;
use guidedog::tasks::{guidance::GuidanceConfig, locomotion::LocomotionConfig};
use guidedog::training::Outcome;
use serde::{Serialize, de::DeserializeOwned};

/// The settings, with small networks and a checkpoint after every iteration.
fn settings<T: Trainable>(more: &[String]) -> Run<T>
where
    Run<T>: Serialize + DeserializeOwned,
{
    let small = ["training.checkpoint_period_s=1e-6", "ppo.actor_hidden=[8]", "ppo.critic_hidden=[8]"];
    let all: Vec<String> = small.map(str::to_owned).iter().chain(more).cloned().collect();
    resolve(None, &all).unwrap()
}

/// Trains on `ranks` ranks in the run `name`; what each returns.
fn train<T: Trainable + Sync>(
    root: &Path,
    name: &str,
    ranks: usize,
    start: &Start,
    config: impl Fn(usize) -> Run<T> + Sync,
) -> Vec<Result<Outcome>>
where
    Run<T>: Serialize,
{
    let config = &config;
    std::thread::scope(|scope| {
        let begin = |(rank, exchange)| {
            scope.spawn(move || {
                let run = (rank == 0).then(|| RunFolder::open(root, name).unwrap());
                let config = config(rank);
                let training = Training::unseen(&config, start);
                training.learn_together(Box::new(exchange), run.as_ref(), &Interrupt::default())
            })
        };
        let running: Vec<_> = threads(ranks).into_iter().enumerate().map(begin).collect();
        running.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

fn checkpoint(root: &Path, name: &str, iteration: u64) -> Checkpoint {
    Checkpoint::load(&root.join(name).join(format!("checkpoints/{iteration:08}.safetensors"))).unwrap()
}

/// `metrics.csv` without what depends on the clock, and on how many ranks there are.
fn metrics(root: &Path, name: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(root.join(name).join("metrics.csv")).unwrap();
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
    let clock = |name: &str| name.starts_with("time/") || matches!(name, "steps_per_s" | "exchange_mb");
    let kept: Vec<usize> = (0..rows[0].len()).filter(|&column| !clock(rows[0][column])).collect();
    rows.iter().map(|row| kept.iter().map(|&column| row[column].to_owned()).collect()).collect()
}

/// One, two and three ranks, and one run that goes on with another number of them at every iteration.
fn ranks_train_the_same<T: Trainable + Sync>(more: &[&str])
where
    Run<T>: Serialize + DeserializeOwned,
{
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let config = |iterations: u64| {
        let mut all: Vec<String> = more.iter().map(|&setting| setting.to_owned()).collect();
        all.push(format!("training.iterations={iterations}"));
        settings::<T>(&all)
    };
    for ranks in [1, 2, 3] {
        let name = ranks.to_string();
        for outcome in train(root, &name, ranks, &Start::New, |_| config(3)) {
            assert_eq!(outcome.unwrap(), Outcome::Finished);
        }
        assert!(checkpoint(root, &name, 3) == checkpoint(root, "1", 3), "{ranks} ranks: another checkpoint");
        assert_eq!(metrics(root, &name), metrics(root, "1"), "{ranks} ranks");
    }
    for (iterations, ranks) in [(1, 2), (2, 3), (3, 1)] {
        for outcome in train(root, "moved", ranks, &Start::Resume, |_| config(iterations)) {
            outcome.unwrap();
        }
    }
    assert!(
        checkpoint(root, "moved", 3) == checkpoint(root, "1", 3),
        "moved between ranks: another checkpoint"
    );
    assert_eq!(metrics(root, "moved"), metrics(root, "1"));
}

#[test]
fn ranks_that_learn_to_walk_on_rough_ground() {
    // The curriculum and the growing disturbances go by all robots: short episodes, and a ramp that begins at once.
    let more = ["training.num_envs=80", "task.episode_s=0.4", "task.ramp_tracking=0.0"];
    ranks_train_the_same::<LocomotionConfig>(&more);
}

#[test]
fn ranks_that_learn_to_guide() {
    let more = ["training.num_envs=400", "task.episode_s=2.0", "ppo.steps_per_env=6"];
    ranks_train_the_same::<GuidanceConfig>(&more);
}

fn refused(outcomes: Vec<Result<Outcome>>) -> Vec<String> {
    outcomes.into_iter().map(|outcome| format!("{:#}", outcome.unwrap_err())).collect()
}

#[test]
fn what_stops_one_rank_stops_all_and_rank_0_says_it() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let few = |more: &[&str]| {
        let base = ["training.num_envs=32", "training.iterations=2", "task.terrain=flat"];
        settings::<LocomotionConfig>(&base.iter().chain(more).map(|&s| s.to_owned()).collect::<Vec<_>>())
    };
    let said = refused(train(root, "three", 3, &Start::New, |_| few(&[])));
    assert_eq!(said[0], "training.num_envs is 32, must be at least 48 for 3 ranks");
    let other = |rank: usize| few(if rank == 1 { &["ppo.gamma=0.5"][..] } else { &[] });
    let said = refused(train(root, "other", 2, &Start::New, other));
    assert!(said[0].starts_with("rank 1: other settings than rank 0"), "{said:?}");
    // Rank 0 cannot write metrics.csv, and ends rank 1 in order.
    fs::create_dir_all(root.join("disk/metrics.csv")).unwrap();
    let said = refused(train(root, "disk", 2, &Start::New, |_| few(&[])));
    assert!(said[0].contains("metrics.csv") && said[1] == "rank 0 could not go on", "{said:?}");
}

#[test]
fn without_mpi_several_processes_are_refused_and_not_let_into_one_folder() {
    if cfg!(feature = "mpi") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_guidedog"));
    command.current_dir(&folder).args(["train", "locomotion"]).env("OMPI_COMM_WORLD_SIZE", "2");
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("built without MPI") && said.contains("--features mpi"), "{said}");
    assert!(!folder.path().join("runs").exists());
}

/// A run of before that does not name a setting of today goes on with its default.
#[test]
fn a_setting_that_did_not_exist_when_a_run_began_is_its_default() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let config = |iterations: u64| -> LocomotionRun {
        let iterations = format!("training.iterations={iterations}");
        settings(&["training.num_envs=16".into(), "task.terrain=flat".into(), iterations])
    };
    train(root, "old", 1, &Start::New, |_| config(1)).remove(0).unwrap();
    let path = root.join("old/config.toml");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains("gradient_blocks = 1\n"));
    fs::write(&path, text.replace("gradient_blocks = 1\n", "")).unwrap();
    train(root, "old", 1, &Start::Resume, |_| config(2)).remove(0).unwrap();
    fs::write(&path, text.replace("gradient_blocks = 1\n", "gradient_blocks = 2\n")).unwrap();
    let error = train(root, "old", 1, &Start::Resume, |_| config(3)).remove(0).unwrap_err();
    assert!(format!("{error:#}").contains("ppo.gradient_blocks = 2"), "{error:#}");
}
