//! The ranks of an MPI program.

use mpi::collective::CommunicatorCollectives as _;
use mpi::collective::Root as _;
use mpi::datatype::{Partition, PartitionMut};
use mpi::environment::{Universe, initialize_with_threading};
use mpi::topology::{Communicator as _, SimpleCommunicator};
use mpi::{Count, Threading};
use ppo::Exchange;

use crate::error::BadInput;

/// One rank of all that `mpirun` started.
struct Mpi {
    /// Ends MPI when it goes: no rank may leave before.
    _universe: Universe,
    rank: usize,
    ranks: usize,
}

/// Begins MPI; `variable` says that there are `ranks` processes.
pub(super) fn join(variable: &str, ranks: usize) -> Result<Box<dyn Exchange>, BadInput> {
    let started = initialize_with_threading(Threading::Serialized);
    let (universe, threading) = started.ok_or_else(|| BadInput::new("MPI was already begun"))?;
    let world = universe.world();
    let seen = world.size() as usize;
    if seen != ranks {
        return Err(BadInput::new(format!(
            "{variable} is {ranks}, but the MPI library this guidedog was built with sees {seen} processes: \
             build it with the MPI whose mpirun starts it"
        )));
    }
    if threading < Threading::Serialized {
        return Err(BadInput::new(format!(
            "the MPI library allows calls as {threading:?}, must allow Serialized"
        )));
    }
    // A rank that panics cannot meet the others again: end them, too.
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        before(panic);
        SimpleCommunicator::world().abort(101);
    }));
    let rank = world.rank() as usize;
    Ok(Box::new(Mpi { _universe: universe, rank, ranks }))
}

/// Where each part begins, and the end.
fn places(counts: &[Count]) -> (Vec<Count>, usize) {
    let mut end = 0_usize;
    let place = |&count: &Count| {
        let begin = end;
        end += count as usize;
        Count::try_from(begin).expect("an exchange of less than 2^31 numbers")
    };
    (counts.iter().map(place).collect(), end)
}

fn count(of: usize) -> Count {
    Count::try_from(of).expect("an exchange of less than 2^31 numbers")
}

/// Cuts what was received into what each rank gave.
fn cut(all: &[u8], counts: &[Count], places: &[Count]) -> Vec<Vec<u8>> {
    let part = |(&count, &place): (&Count, &Count)| all[place as usize..][..count as usize].to_vec();
    counts.iter().zip(places).map(part).collect()
}

impl Exchange for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn ranks(&self) -> usize {
        self.ranks
    }

    fn all_gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let world = SimpleCommunicator::world();
        let mut counts = vec![0; self.ranks];
        world.all_gather_into(&count(own.len()), &mut counts[..]);
        let (places, end) = places(&counts);
        let mut all = vec![0; end];
        if end > 0 {
            world.all_gather_varcount_into(
                own,
                &mut PartitionMut::new(&mut all[..], &counts[..], &places[..]),
            );
        }
        cut(&all, &counts, &places)
    }

    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let world = SimpleCommunicator::world();
        let root = world.process_at_rank(0);
        if self.rank > 0 {
            root.gather_into(&count(own.len()));
            root.gather_varcount_into(own);
            return Vec::new();
        }
        let mut counts = vec![0; self.ranks];
        root.gather_into_root(&count(own.len()), &mut counts[..]);
        let (places, end) = places(&counts);
        let mut all = vec![0; end];
        root.gather_varcount_into_root(own, &mut PartitionMut::new(&mut all[..], &counts[..], &places[..]));
        cut(&all, &counts, &places)
    }

    fn all_to_all(&self, sent: &[f32], counts: &[usize], received: &mut Vec<f32>) -> Vec<usize> {
        let world = SimpleCommunicator::world();
        let counts: Vec<Count> = counts.iter().map(|&of| count(of)).collect();
        let mut found: Vec<Count> = vec![0; self.ranks];
        world.all_to_all_into(&counts[..], &mut found[..]);
        let (places_sent, _) = places(&counts);
        let (places_found, end) = places(&found);
        received.resize(end, 0.0);
        world.all_to_all_varcount_into(
            &Partition::new(sent, &counts[..], &places_sent[..]),
            &mut PartitionMut::new(&mut received[..], &found[..], &places_found[..]),
        );
        found.into_iter().map(|of| of as usize).collect()
    }
}
