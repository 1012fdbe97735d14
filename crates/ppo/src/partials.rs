//! In what order partial gradients are added, whoever computed them: the same bits on one rank or many.
//!
//! Tile `t` of a minibatch belongs to partial `t mod n` of n. Partials make blocks of eight, block `b` of B being the partials
//! that leave remainder `b` divided by B. The partials of a block are added in order, then the blocks. Partial `p` is the work
//! of rank `p mod N`: where a rank has a whole block it adds that up by itself and sends one sum, else it sends its partials.

use rayon::prelude::*;

use crate::exchange::Exchange;

/// Partials of a block; more than threads of a desktop, few enough to add up quickly.
const BLOCK: usize = 8;
/// Parameters a thread adds up at a time.
const CHUNK: usize = 16_384;

/// The partial gradients of all ranks, as one of them sees them.
#[derive(Clone, Debug)]
pub(crate) struct Partials {
    blocks: usize,
    rank: usize,
    ranks: usize,
    /// Sums of whole blocks, and what goes to and comes from other ranks; memory that is kept.
    block_sums: Vec<Vec<f32>>,
    sent: Vec<f32>,
    received: Vec<f32>,
}

impl Partials {
    pub(crate) fn new(blocks: usize, exchange: &dyn Exchange) -> Self {
        let (rank, ranks) = (exchange.rank(), exchange.ranks());
        Self { blocks, rank, ranks, block_sums: Vec::new(), sent: Vec::new(), received: Vec::new() }
    }

    /// Of all ranks together.
    pub(crate) fn count(&self) -> usize {
        BLOCK * self.blocks
    }

    /// Those this rank works on.
    pub(crate) fn own(&self) -> impl Iterator<Item = usize> + use<> {
        (self.rank..self.count()).step_by(self.ranks)
    }

    /// The rank that works on a tile of a minibatch.
    pub(crate) fn owner_of_tile(&self, tile: usize) -> usize {
        tile % self.count() % self.ranks
    }

    /// What all ranks found for each of their partials, in the order of partials.
    pub(crate) fn in_order<T: Copy>(&self, of_ranks: &[Vec<T>]) -> Vec<T> {
        (0..self.count()).map(|partial| of_ranks[partial % self.ranks][partial / self.ranks]).collect()
    }

    fn block(&self, block: usize) -> impl Iterator<Item = usize> {
        (block..self.count()).step_by(self.blocks)
    }

    /// The rank that has all partials of a block, if one has.
    fn owner_of_block(&self, block: usize) -> Option<usize> {
        let owner = block % self.ranks;
        self.block(block).all(|partial| partial % self.ranks == owner).then_some(owner)
    }

    /// Adds all partials of all ranks into `sum`, which becomes the same everywhere; `own` are this rank's.
    pub(crate) fn add(&mut self, own: &[&[f32]], exchange: &dyn Exchange, sum: &mut [f32]) {
        let ranks = self.ranks;
        let find = |partial: usize| own[partial / ranks];
        if ranks == 1 {
            let blocks: Vec<Vec<&[f32]>> =
                (0..self.blocks).map(|block| self.block(block).map(find).collect()).collect();
            return add_in_order(&blocks, sum);
        }
        let mut block_sums = std::mem::take(&mut self.block_sums);
        let whole: Vec<usize> =
            (0..self.blocks).filter(|&block| self.owner_of_block(block) == Some(self.rank)).collect();
        block_sums.resize_with(whole.len(), || vec![0.0; sum.len()]);
        for (&block, block_sum) in whole.iter().zip(&mut block_sums) {
            add_in_order(&[self.block(block).map(find).collect()], block_sum);
        }
        // What this rank has to give, in the order in which it is added.
        let mut given: Vec<&[f32]> = Vec::new();
        let mut sums = block_sums.iter();
        for block in 0..self.blocks {
            match self.owner_of_block(block) {
                Some(owner) if owner == self.rank => given.extend(sums.next().map(Vec::as_slice)),
                Some(_) => {}
                None => {
                    given.extend(self.block(block).filter(|partial| partial % ranks == self.rank).map(find))
                }
            }
        }
        // Every rank adds up its part of the parameters, then gives it to all.
        let part = |rank: usize| sum.len() * rank / ranks..sum.len() * (rank + 1) / ranks;
        let parts: Vec<_> = (0..ranks).map(part).collect();
        self.sent.clear();
        for part in &parts {
            given.iter().for_each(|values| self.sent.extend_from_slice(&values[part.clone()]));
        }
        let counts: Vec<usize> = parts.iter().map(|part| given.len() * part.len()).collect();
        let found = exchange.all_to_all(&self.sent, &counts, &mut self.received);
        let own_part = parts[self.rank].clone();
        add_in_order(&self.received_blocks(&found, own_part.len()), &mut sum[own_part.clone()]);
        self.sent.clear();
        (0..ranks).for_each(|_| self.sent.extend_from_slice(&sum[own_part.clone()]));
        exchange.all_to_all(&self.sent, &vec![own_part.len(); ranks], &mut self.received);
        sum.copy_from_slice(&self.received);
        self.block_sums = block_sums;
    }

    /// What was received, by blocks; `found` numbers of each rank, pieces of `length`.
    fn received_blocks(&self, found: &[usize], length: usize) -> Vec<Vec<&[f32]>> {
        let mut rest = &self.received[..];
        let mut of_ranks: Vec<&[f32]> = Vec::new();
        for &count in found {
            let (of_rank, after) = rest.split_at(count);
            of_ranks.push(of_rank);
            rest = after;
        }
        let mut next = |rank: usize| {
            let (piece, after) = of_ranks[rank].split_at(length);
            of_ranks[rank] = after;
            piece
        };
        let block = |block: usize| match self.owner_of_block(block) {
            Some(owner) => vec![next(owner)],
            None => self.block(block).map(|partial| next(partial % self.ranks)).collect(),
        };
        (0..self.blocks).map(block).collect()
    }
}

/// Adds the pieces of every block in order, then the blocks.
fn add_in_order(blocks: &[Vec<&[f32]>], sum: &mut [f32]) {
    sum.par_chunks_mut(CHUNK).enumerate().for_each(|(i, sum)| {
        let range = i * CHUNK..i * CHUNK + sum.len();
        let mut of_block = vec![0.0; if blocks.len() > 1 { sum.len() } else { 0 }];
        for (number, block) in blocks.iter().enumerate() {
            let to = if number == 0 { &mut *sum } else { &mut of_block[..] };
            to.copy_from_slice(&block[0][range.clone()]);
            for piece in &block[1..] {
                add_to(to, &piece[range.clone()]);
            }
            if number > 0 {
                add_to(sum, &of_block);
            }
        }
    });
}

fn add_to(sum: &mut [f32], values: &[f32]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += value;
    }
}

#[cfg(test)]
mod tests {
    use spatial::{Philox, Purpose};

    use super::*;
    use crate::exchange::{Alone, tests::on_ranks};

    /// The sum of random partials, added by `ranks` ranks.
    fn sums(blocks: usize, ranks: usize) -> Vec<Vec<f32>> {
        let values = |partial: usize| -> Vec<f32> {
            let mut random = Philox::new(5, partial, 0, 0, Purpose::Evaluation);
            (0..1001).map(|_| random.normal() * 10.0_f32.powf(random.normal())).collect()
        };
        on_ranks(ranks, |exchange| {
            let mut partials = Partials::new(blocks, exchange);
            let own: Vec<Vec<f32>> = partials.own().map(values).collect();
            let own: Vec<&[f32]> = own.iter().map(Vec::as_slice).collect();
            let mut sum = vec![0.0; 1001];
            partials.add(&own, exchange, &mut sum);
            // Memory that is kept must not change a second sum.
            partials.add(&own, exchange, &mut sum);
            sum
        })
    }

    #[test]
    fn any_number_of_ranks_gives_the_same_bits() {
        for blocks in [1, 2, 3, 4] {
            let expected = sums(blocks, 1).remove(0);
            for ranks in 2..=8 {
                let found = sums(blocks, ranks);
                assert!(found.iter().all(|sum| *sum == expected), "{blocks} blocks, {ranks} ranks");
            }
        }
        assert_ne!(sums(1, 1), sums(2, 1), "the partials differ too little for an order to show");
    }

    #[test]
    fn every_tile_is_the_work_of_the_rank_that_has_its_partial() {
        for rank in 0..3 {
            let partials = Partials { rank, ranks: 3, ..Partials::new(2, &Alone) };
            let own: Vec<usize> = partials.own().collect();
            for tile in 0..100 {
                assert_eq!(partials.owner_of_tile(tile) == rank, own.contains(&(tile % 16)));
            }
        }
    }

    #[test]
    fn as_many_blocks_as_ranks_send_one_sum_each() {
        let partials = Partials { ranks: 4, ..Partials::new(4, &Alone) };
        assert!((0..4).all(|block| partials.owner_of_block(block) == Some(block)));
        let partials = Partials { ranks: 2, ..Partials::new(1, &Alone) };
        assert_eq!(partials.owner_of_block(0), None);
    }
}
