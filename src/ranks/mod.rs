//! Several processes that train together: how they were started, and who does what.
//!
//! Rank 0 leads. It runs the training loop of one process, and before everything that takes all ranks it says what comes next;
//! the others follow. So the loop, the run's folder, the progress bar and Ctrl-C know nothing of ranks, and an error of the
//! leader (a full disk) ends all of them in order.

#[cfg(feature = "mpi")]
mod mpi;
mod parting;

use std::path::Path;

use anyhow::Result;
use policy::VecEnv;
use ppo::exchange::Alone;
use ppo::{Exchange, Trainer};

use crate::error::BadInput;
use crate::training::{Learner, Outcome};

pub use parting::{resumed, tell_when_ended};

/// What the launchers of MPI programs tell a process of how many there are: Open MPI; MPICH, Intel MPI and Slurm; MVAPICH.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"];

/// This process, with those started beside it by `mpirun`, if any.
///
/// # Errors
/// There are others, but this program was built without MPI, or with another one's.
pub fn join() -> Result<Box<dyn Exchange>, BadInput> {
    match started_beside(|name| std::env::var(name).ok()) {
        Some((name, ranks)) => join_others(name, ranks),
        None => Ok(Box::new(Alone)),
    }
}

/// The tasks of a Slurm step; they are ranks if PMIx numbers them, too.
const SLURM_SIZE: &str = "SLURM_STEP_NUM_TASKS";
const PMIX_RANK: &str = "PMIX_RANK";

/// Which variable says that more than one process was started, and how many.
fn started_beside(variable: impl Fn(&str) -> Option<String>) -> Option<(&'static str, usize)> {
    let size = |name: &'static str| Some((name, variable(name)?.trim().parse().ok()?));
    let slurm = variable(PMIX_RANK).map(|_| SLURM_SIZE);
    SIZES.into_iter().chain(slurm).filter_map(size).find(|(_, ranks)| *ranks > 1)
}

#[cfg(feature = "mpi")]
fn join_others(variable: &str, ranks: usize) -> Result<Box<dyn Exchange>, BadInput> {
    mpi::join(variable, ranks)
}

#[cfg(not(feature = "mpi"))]
fn join_others(variable: &str, ranks: usize) -> Result<Box<dyn Exchange>, BadInput> {
    Err(BadInput::new(format!(
        "{variable} is {ranks}: started as one of {ranks} processes, but this guidedog was built without MPI, and each would train \
         by itself into the same folder; build it with `cargo build --release --features mpi` (docs/cluster.md), or start it alone"
    )))
}

/// What all ranks do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
enum Order {
    Iterate,
    Checkpoint,
    Distributions,
    /// The training is over: finished, interrupted, failed.
    Finish,
    Interrupt,
    Fail,
}

impl Order {
    const ALL: [Self; 6] =
        [Self::Iterate, Self::Checkpoint, Self::Distributions, Self::Finish, Self::Interrupt, Self::Fail];
}

/// The learner of rank 0 as the training loop sees it: whatever it does, all ranks do.
pub(crate) struct Leader<'a, E: VecEnv>(pub(crate) &'a mut Trainer<E>);

impl<E: VecEnv> Leader<'_, E> {
    fn order(&self, order: Order) {
        self.0.exchange().all_gather(&[order as u8]);
    }

    /// Tells the others how it ended.
    pub(crate) fn end(self, result: Result<Outcome>) -> Result<Outcome> {
        self.order(match &result {
            Ok(Outcome::Finished) => Order::Finish,
            Ok(Outcome::Interrupted) => Order::Interrupt,
            Err(_) => Order::Fail,
        });
        result
    }
}

impl<E: VecEnv> Learner for Leader<'_, E> {
    fn iteration(&self) -> u64 {
        self.0.iteration()
    }

    fn iterate(&mut self) -> Result<Vec<(String, f64)>> {
        self.order(Order::Iterate);
        Learner::iterate(self.0)
    }

    fn steps_per_iteration(&self) -> u64 {
        self.0.steps_per_iteration()
    }

    fn distributions(&self) -> Vec<(String, Vec<f32>)> {
        self.order(Order::Distributions);
        self.0.distributions()
    }

    fn save(&self, path: &Path) -> Result<()> {
        self.order(Order::Checkpoint);
        self.0.save(path)
    }

    fn export(&self, path: &Path) -> Result<()> {
        self.0.export(path)
    }
}

/// Does what rank 0 says until the training is over.
///
/// # Errors
/// Rank 0 could not go on; it says why.
pub(crate) fn follow<E: VecEnv>(trainer: &mut Trainer<E>) -> Result<Outcome> {
    loop {
        let said = trainer.exchange().all_gather(&[]).swap_remove(0);
        match Order::ALL.into_iter().find(|&order| said == [order as u8]) {
            // An error is one of all ranks: the leader reports it and ends the training.
            Some(Order::Iterate) => drop(trainer.iterate()),
            Some(Order::Checkpoint) => drop(trainer.checkpoint()),
            Some(Order::Distributions) => drop(trainer.distributions()),
            Some(Order::Finish) => return Ok(Outcome::Finished),
            Some(Order::Interrupt) => return Ok(Outcome::Interrupted),
            Some(Order::Fail) | None => anyhow::bail!("rank 0 could not go on"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_are_known_by_what_they_set() {
        let found = |name: &str, value: &str| started_beside(|asked| (asked == name).then(|| value.into()));
        assert_eq!(found("OMPI_COMM_WORLD_SIZE", "2"), Some(("OMPI_COMM_WORLD_SIZE", 2)));
        assert_eq!(found("PMI_SIZE", "64"), Some(("PMI_SIZE", 64)));
        for (name, value) in [("OMPI_COMM_WORLD_SIZE", "1"), ("PMI_SIZE", "?"), (SLURM_SIZE, "4")] {
            assert_eq!(found(name, value), None, "{name}={value}");
        }
        let by_srun = |name: &str| [PMIX_RANK, SLURM_SIZE].contains(&name).then(|| "4".into());
        assert_eq!(started_beside(by_srun), Some((SLURM_SIZE, 4)));
    }
}
