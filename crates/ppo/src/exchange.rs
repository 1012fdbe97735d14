//! How processes that train together speak with one another.
//!
//! The learner needs three things of them, and nothing of what carries them: [`Alone`] for one process, [`threads`] for several
//! ranks within one (the tests), MPI in the program.

use std::fmt::Display;
use std::sync::mpsc::{Receiver, Sender, channel};

/// One of the processes ("ranks") of a training. All call the same methods in the same order, and wait for one another.
pub trait Exchange: Send {
    /// The number of this rank, from 0. Rank 0 leads: it writes what is written.
    fn rank(&self) -> usize;
    /// How many there are.
    fn ranks(&self) -> usize;
    /// What every rank gave, in order of ranks.
    fn all_gather(&self, own: &[u8]) -> Vec<Vec<u8>>;
    /// On rank 0 what every rank gave, in order of ranks; nothing on the others.
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>>;
    /// Gives the first `counts[0]` numbers of `sent` to rank 0, the next `counts[1]` to rank 1 and so on. Fills `received` with
    /// what all gave to this rank, in order of ranks, and returns how many numbers are of each.
    fn all_to_all(&self, sent: &[f32], counts: &[usize], received: &mut Vec<f32>) -> Vec<usize>;
}

/// What went wrong on another rank.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rank {rank}: {message}")]
pub struct RankError {
    /// Which rank.
    pub rank: usize,
    /// What it said.
    pub message: String,
}

impl dyn Exchange + '_ {
    /// Goes on only if all ranks can: an error of one becomes one of all, so that nobody waits for who has left.
    ///
    /// # Errors
    /// Its own on a rank that has one; on the others the first one of another rank.
    pub fn agree<T, E: Display + From<RankError>>(&self, result: Result<T, E>) -> Result<T, E> {
        let own = result.as_ref().err().map_or(String::new(), |error| format!("{error:#} "));
        let failed =
            self.all_gather(own.as_bytes()).into_iter().enumerate().find(|(_, said)| !said.is_empty());
        match (result, failed) {
            (Ok(_), Some((rank, said))) => {
                Err(RankError { rank, message: String::from_utf8_lossy(&said).trim_end().to_owned() }.into())
            }
            (result, _) => result,
        }
    }

    /// Bytes that rank 0 makes, on all ranks.
    ///
    /// # Errors
    /// Rank 0 could not make them.
    pub fn lead<E: Display + From<RankError>>(
        &self,
        make: impl FnOnce() -> Result<Vec<u8>, E>,
    ) -> Result<Vec<u8>, E> {
        let made = self.agree(if self.rank() == 0 { make() } else { Ok(Vec::new()) })?;
        Ok(self.all_gather(&made).swap_remove(0))
    }
}

/// One process by itself.
#[derive(Clone, Copy, Debug)]
pub struct Alone;

impl Exchange for Alone {
    fn rank(&self) -> usize {
        0
    }
    fn ranks(&self) -> usize {
        1
    }
    fn all_gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        vec![own.to_vec()]
    }
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        vec![own.to_vec()]
    }
    fn all_to_all(&self, sent: &[f32], counts: &[usize], received: &mut Vec<f32>) -> Vec<usize> {
        received.clear();
        received.extend_from_slice(sent);
        counts.to_vec()
    }
}

/// Ends of the two channels between two ranks, one for bytes and one for numbers.
type Outgoing = (Sender<Vec<u8>>, Sender<Vec<f32>>);
type Incoming = (Receiver<Vec<u8>>, Receiver<Vec<f32>>);

/// One of several ranks that are threads of one process.
#[derive(Debug)]
pub struct ThreadRank {
    rank: usize,
    to: Vec<Outgoing>,
    from: Vec<Incoming>,
}

/// `ranks` ranks within this process, each to be moved to a thread of its own. One that ends too early lets the others panic,
/// not wait.
pub fn threads(ranks: usize) -> Vec<ThreadRank> {
    let mut all: Vec<ThreadRank> =
        (0..ranks).map(|rank| ThreadRank { rank, to: Vec::new(), from: Vec::new() }).collect();
    for from in 0..ranks {
        for to in 0..ranks {
            let ((bytes, take_bytes), (numbers, take_numbers)) = (channel(), channel());
            all[from].to.push((bytes, numbers));
            all[to].from.push((take_bytes, take_numbers));
        }
    }
    all
}

const LEFT: &str = "another rank has left";

impl Exchange for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }
    fn ranks(&self) -> usize {
        self.to.len()
    }
    fn all_gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        self.to.iter().for_each(|(to, _)| to.send(own.to_vec()).expect(LEFT));
        self.from.iter().map(|(from, _)| from.recv().expect(LEFT)).collect()
    }
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        self.to[0].0.send(own.to_vec()).expect(LEFT);
        let heard = if self.rank == 0 { &self.from[..] } else { &[] };
        heard.iter().map(|(from, _)| from.recv().expect(LEFT)).collect()
    }
    fn all_to_all(&self, sent: &[f32], counts: &[usize], received: &mut Vec<f32>) -> Vec<usize> {
        let mut rest = sent;
        for ((_, to), &count) in self.to.iter().zip(counts) {
            let (part, after) = rest.split_at(count);
            to.send(part.to_vec()).expect(LEFT);
            rest = after;
        }
        received.clear();
        let take = |(_, from): &(_, Receiver<Vec<f32>>)| {
            let part = from.recv().expect(LEFT);
            received.extend_from_slice(&part);
            part.len()
        };
        self.from.iter().map(take).collect()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// What `work` gives on each of `ranks` ranks.
    pub(crate) fn on_ranks<T: Send>(ranks: usize, work: impl Fn(&dyn Exchange) -> T + Sync) -> Vec<T> {
        let work = &work;
        std::thread::scope(|scope| {
            let ranks = threads(ranks).into_iter();
            let running: Vec<_> = ranks.map(|rank| scope.spawn(move || work(&rank))).collect();
            running.into_iter().map(|thread| thread.join().unwrap()).collect()
        })
    }

    #[test]
    fn everyone_gets_what_was_meant_for_it() {
        let found = on_ranks(3, |exchange| {
            let rank = exchange.rank();
            let gathered = exchange.all_gather(&vec![rank as u8; rank]);
            assert_eq!(gathered, [vec![], vec![1], vec![2, 2]]);
            assert_eq!(exchange.gather(&[rank as u8]).len(), if rank == 0 { 3 } else { 0 });
            // To rank r go r numbers that say from where and where to.
            let sent: Vec<f32> = [1, 2, 2].map(|to| (10 * rank + to) as f32).into();
            let mut received = vec![7.0];
            assert_eq!(exchange.all_to_all(&sent, &[0, 1, 2], &mut received), [rank; 3]);
            received
        });
        assert_eq!(found, [vec![], vec![1.0, 11.0, 21.0], vec![2.0, 2.0, 12.0, 12.0, 22.0, 22.0]]);
    }

    #[test]
    fn an_error_of_one_is_an_error_of_all() {
        let failure = |rank, message: &str| RankError { rank, message: message.into() };
        let found = on_ranks(3, |exchange| {
            let own = if exchange.rank() == 1 { Err(failure(9, "no disk")) } else { Ok(()) };
            (exchange.agree(own), exchange.agree(Ok::<_, RankError>(1)))
        });
        assert_eq!(found[0], (Err(failure(1, "rank 9: no disk")), Ok(1)));
        assert_eq!(found[1], (Err(failure(9, "no disk")), Ok(1)));
        assert_eq!(found[2], found[0]);
        let led = on_ranks(2, |exchange| exchange.lead(|| Ok::<_, RankError>(vec![exchange.rank() as u8])));
        assert_eq!(led, [Ok(vec![0]), Ok(vec![0])]);
    }
}
