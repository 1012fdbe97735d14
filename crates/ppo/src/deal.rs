//! Moves the samples of an epoch to the ranks whose partial gradients they belong to.
//!
//! A shuffle of all samples of all ranks says which partial a sample falls to, and with it which rank learns from it: as a rule
//! not the one that stepped its environment. One exchange an epoch brings each rank the rows it needs.

use std::ops::Range;

use crate::{exchange::Exchange, gradient::TILE, partials::Partials, rollout::Rollout};

/// The rows this rank learns from in one epoch.
#[derive(Clone, Debug)]
pub(crate) struct Deal {
    rows: Rollout,
    sent: Vec<f32>,
    received: Vec<f32>,
}

impl Deal {
    pub(crate) fn new(observation_dim: usize, action_dim: usize) -> Self {
        Self { rows: Rollout::new(0, 0, observation_dim, action_dim), sent: Vec::new(), received: Vec::new() }
    }

    /// The rows dealt to this rank.
    pub(crate) fn rows(&self) -> &Rollout {
        &self.rows
    }

    /// Deals out the samples in `order`, minibatches of `size` one after the other. `envs` are the environments of each rank.
    /// Numbers of samples (`step × all environments + environment`) that fall to this rank become those of rows; the others
    /// lose their meaning.
    pub(crate) fn deal(
        &mut self,
        own: &Rollout,
        envs: &[Range<usize>],
        partials: &Partials,
        (order, size): (&mut [u32], usize),
        exchange: &dyn Exchange,
    ) {
        let total = envs.last().map_or(0, |envs| envs.end);
        let owner = |place: usize| partials.owner_of_tile(place % size / TILE);
        let rank = exchange.rank();
        let here = &envs[rank];
        let mut to: Vec<Vec<usize>> = vec![Vec::new(); envs.len()];
        for (place, &sample) in order.iter().enumerate() {
            let (step, env) = (sample as usize / total, sample as usize % total);
            if here.contains(&env) {
                to[owner(place)].push(step * own.num_envs + env - here.start);
            }
        }
        let width = own.row_width();
        self.sent.clear();
        to.iter().flatten().for_each(|&row| own.append_row(row, &mut self.sent));
        let counts: Vec<usize> = to.iter().map(|rows| rows.len() * width).collect();
        let found = exchange.all_to_all(&self.sent, &counts, &mut self.received);
        // Each rank sent its rows in the order of the shuffle, so one cursor a rank finds them again.
        let mut next = Vec::with_capacity(found.len());
        found.iter().fold(0, |start, count| {
            next.push(start / width);
            start + count
        });
        self.rows.clear_rows();
        for (place, sample) in order.iter_mut().enumerate() {
            if owner(place) != rank {
                continue;
            }
            let env = *sample as usize % total;
            let source = envs.partition_point(|envs| envs.end <= env);
            *sample = self.rows.push_row(&self.received[next[source] * width..][..width]) as u32;
            next[source] += 1;
        }
    }
}
