//! The ranks of a training: whose environments are whose, and what they gather from one another.

use std::cell::Cell;
use std::ops::Range;
use std::time::Instant;

use crate::exchange::{Exchange, RankError};

/// All ranks, as one of them sees them. Without others nothing is copied or waited for.
pub(crate) struct Team {
    exchange: Clocked,
    /// Environments of every rank, by number among all.
    envs: Vec<Range<usize>>,
}

impl Team {
    /// Learns how many environments each rank has; they are numbered in order of ranks.
    pub(crate) fn new(exchange: Box<dyn Exchange>, num_envs: usize) -> Self {
        let mut start = 0;
        let counts = exchange.all_gather(&(num_envs as u64).to_le_bytes());
        let mut range = |count: &Vec<u8>| {
            let count = u64::from_le_bytes(count.as_slice().try_into().expect("eight bytes")) as usize;
            start += count;
            start - count..start
        };
        let envs = counts.iter().map(&mut range).collect();
        Self { exchange: Clocked { inner: exchange, seconds: Cell::new(0.0), bytes: Cell::new(0) }, envs }
    }

    pub(crate) fn exchange(&self) -> &dyn Exchange {
        &self.exchange
    }

    pub(crate) fn is_alone(&self) -> bool {
        self.envs.len() == 1
    }

    /// Environments of every rank.
    pub(crate) fn envs(&self) -> &[Range<usize>] {
        &self.envs
    }

    /// Environments of this rank.
    pub(crate) fn own_envs(&self) -> Range<usize> {
        self.envs[self.exchange.rank()].clone()
    }

    /// Environments of all ranks.
    pub(crate) fn total_envs(&self) -> usize {
        self.envs.last().map_or(0, |envs| envs.end)
    }

    /// Numbers of all ranks, in order of ranks.
    pub(crate) fn gather_f64(&self, own: Vec<f64>) -> Vec<f64> {
        if self.is_alone() {
            return own;
        }
        let own: Vec<u8> = own.iter().flat_map(|value| value.to_le_bytes()).collect();
        let all = self.exchange.all_gather(&own);
        all.iter().flat_map(|bytes| bytes.as_chunks().0).map(|bytes| f64::from_le_bytes(*bytes)).collect()
    }

    /// Numbers of all ranks, in order of ranks; on rank 0 only, unless it is for `everyone`.
    fn gather_f32(&self, own: &[f32], everyone: bool) -> Vec<f32> {
        let own: Vec<u8> = own.iter().flat_map(|value| value.to_le_bytes()).collect();
        let all = if everyone { self.exchange.all_gather(&own) } else { self.exchange.gather(&own) };
        all.iter().flat_map(|bytes| bytes.as_chunks().0).map(|bytes| f32::from_le_bytes(*bytes)).collect()
    }

    /// As many numbers of every environment, of all ranks in order, on rank 0; nothing on the others.
    pub(crate) fn gather_to_lead(&self, own: &[f32]) -> Vec<f32> {
        if self.is_alone() { own.to_vec() } else { self.gather_f32(own, false) }
    }

    /// One number a sample of all ranks, `steps × all environments`, from those of this one.
    pub(crate) fn gather_samples(&self, own: &[f32], steps: usize) -> Vec<f32> {
        let by_rank = self.gather_f32(own, true);
        let total = self.total_envs();
        let mut by_step = vec![0.0; by_rank.len()];
        for envs in &self.envs {
            let of_rank = &by_rank[envs.start * steps..envs.end * steps];
            for (step, values) in of_rank.chunks_exact(envs.len()).enumerate() {
                by_step[step * total..][envs.clone()].copy_from_slice(values);
            }
        }
        by_step
    }

    /// Holds this rank's numbers against those of rank 0.
    ///
    /// # Errors
    /// On all ranks, if one has others: it runs another build, or its processor rounds otherwise.
    pub(crate) fn compare(&self, own: &[f32]) -> Result<(), RankError> {
        if self.is_alone() {
            return Ok(());
        }
        let checksum = own.iter().fold(0_u64, |sum, value| sum.rotate_left(1) ^ u64::from(value.to_bits()));
        let all = self.exchange.all_gather(&checksum.to_le_bytes());
        let other = all.iter().position(|checksum| *checksum != all[0]);
        other.map_or(Ok(()), |rank| {
            let message = "its weights are not those of rank 0, must be the same to the bit: all ranks need the same build \
                           and processors of one kind"
                .into();
            Err(RankError { rank, message })
        })
    }

    /// Time spent with other ranks, waiting for them included, and bytes sent, since the last call.
    pub(crate) fn take_clock(&self) -> (f64, u64) {
        (self.exchange.seconds.take(), self.exchange.bytes.take())
    }
}

/// An exchange that notes what it costs.
struct Clocked {
    inner: Box<dyn Exchange>,
    /// Time within it \[s\].
    seconds: Cell<f64>,
    /// Bytes sent to other ranks.
    bytes: Cell<u64>,
}

impl Clocked {
    fn note(&self, began: Instant, bytes: usize) {
        self.seconds.set(self.seconds.get() + began.elapsed().as_secs_f64());
        self.bytes.set(self.bytes.get() + bytes as u64);
    }
}

impl Exchange for Clocked {
    fn rank(&self) -> usize {
        self.inner.rank()
    }
    fn ranks(&self) -> usize {
        self.inner.ranks()
    }
    fn all_gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let began = Instant::now();
        let all = self.inner.all_gather(own);
        self.note(began, own.len() * (self.ranks() - 1));
        all
    }
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>> {
        let began = Instant::now();
        let all = self.inner.gather(own);
        self.note(began, if self.rank() == 0 { 0 } else { own.len() });
        all
    }
    fn all_to_all(&self, sent: &[f32], counts: &[usize], received: &mut Vec<f32>) -> Vec<usize> {
        let began = Instant::now();
        let found = self.inner.all_to_all(sent, counts, received);
        self.note(began, size_of_val(sent) - size_of::<f32>() * counts[self.rank()]);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::threads;

    #[test]
    fn other_weights_on_a_rank_are_noticed_by_all() {
        let found: Vec<_> = std::thread::scope(|scope| {
            let start = |(rank, exchange)| {
                scope.spawn(move || {
                    let team = Team::new(Box::new(exchange), 1);
                    let odd = if rank == 2 { 1.0_f32.next_up() } else { 1.0 };
                    (team.compare(&[0.5, 1.0]), team.compare(&[0.5, odd]).unwrap_err().rank)
                })
            };
            let running: Vec<_> = threads(3).into_iter().enumerate().map(start).collect();
            running.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert_eq!(found, [(Ok(()), 2), (Ok(()), 2), (Ok(()), 2)]);
    }

    #[test]
    fn samples_of_uneven_ranks_come_in_the_order_of_one() {
        let found: Vec<_> = std::thread::scope(|scope| {
            let start = |(rank, exchange)| {
                scope.spawn(move || {
                    let team = Team::new(Box::new(exchange), 1 + rank);
                    let own: Vec<f32> = (0..2)
                        .flat_map(|step| team.own_envs().map(move |env| (10 * step + env) as f32))
                        .collect();
                    team.gather_samples(&own, 2)
                })
            };
            let running: Vec<_> = threads(2).into_iter().enumerate().map(start).collect();
            running.into_iter().map(|thread| thread.join().unwrap()).collect()
        });
        assert!(found.iter().all(|samples| *samples == [0.0, 1.0, 2.0, 10.0, 11.0, 12.0]), "{found:?}");
    }
}
