//! The shipped policies paired with others: what one is worth without the other it was made with.

use anyhow::Result;

use super::Maker;
use super::pair::{Pair, table};
use crate::interrupt::Interrupt;
use crate::policies::{self, SHIPPED};
use crate::stages;

impl Maker {
    /// Every pairing of the shipped policies with others: a walk of level ground and the supervisor trained over it. False if the
    /// user interrupts.
    pub(super) fn swaps(&self, interrupt: &Interrupt) -> Result<bool> {
        let walk = stages::learn_all(&self.folder, "other-walk", stages::FLAT, &[], interrupt)?;
        let Some(walk) = walk else { return Ok(false) };
        let walk = policies::name(&walk)?;
        let over_it = [format!("task.locomotion={walk:?}"), "task.terrain=\"flat\"".into()];
        let Some(other) = self.supervisor("other-supervisor", &over_it, interrupt)? else { return Ok(false) };
        let mut rows = Vec::new();
        for (walk_name, walk) in [("shipped", SHIPPED), ("other", walk)] {
            let mut oracle = None;
            for (name, supervisor) in [("shipped", SHIPPED), ("other", &other)] {
                let pair = Pair {
                    name: format!("swap-{walk_name}-{name}"),
                    walk: walk.to_owned(),
                    supervisor: supervisor.to_owned(),
                    ..Pair::default()
                };
                let found = self.pair(&pair, oracle)?;
                oracle = Some(found.oracle_reward);
                rows.push((format!("{walk_name} walk, {name} supervisor"), vec![found]));
            }
        }
        let head = format!(
            "the shipped policies and others of level ground, paired; paper17 on level ground, {} episodes a case, randomized robots\n",
            self.pair_episodes()
        );
        self.write("swaps", "txt", (head + &table(&rows)).as_bytes())?;
        Ok(true)
    }
}
