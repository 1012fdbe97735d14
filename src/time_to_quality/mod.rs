//! How long trainings take from nothing to a stated score, and what they spend on it: `guidedog bench learning`.
//!
//! A trial is one training with one seed, in a run folder of its own; a training may go through stages with settings of their
//! own, each from the weights of the one before. Trials that are compared take turns, an interval of
//! training each, so that whatever else the machine does slows all of them alike. After every interval the policy is judged (that
//! time is not counted), the score written down and a checkpoint saved, in this order: a bench that is killed goes on where the
//! last checkpoint was, with the time that had been spent until then.

mod findings;
mod task;
mod trial;

pub use findings::{Finding, picture, table};
pub use task::{Stage, Task, Variant};
pub use trial::{Bounds, Trial};

use anyhow::Result;

use crate::interrupt::Interrupt;
use crate::progress::Progress;

/// Lets trials take turns until all have ended; false if the user interrupts.
///
/// # Errors
/// A trial cannot begin or go on, or the disk refuses.
pub fn take_turns(what: &str, trials: &mut [Trial<'_>], interrupt: &Interrupt) -> Result<bool> {
    let total: f64 = trials.iter().map(Trial::limit_s).sum();
    let spent = |trials: &[Trial<'_>]| trials.iter().map(Trial::bounded_s).sum::<f64>() as u64;
    let mut progress = Progress::new(format!("{what}: second of training"), spent(trials), total as u64);
    while !trials.iter().all(Trial::has_ended) {
        for turn in 0..trials.len() {
            if trials[turn].has_ended() {
                continue;
            }
            let others: f64 =
                trials.iter().enumerate().filter(|(i, _)| *i != turn).map(|(_, t)| t.bounded_s()).sum();
            trials[turn].take_turn(interrupt, |trial, row| {
                progress.update((others + trial.bounded_s()) as u64, &trial.headline(row));
            })?;
            if interrupt.requested() {
                progress.finish("");
                return Ok(false);
            }
            if trials[turn].has_ended() {
                progress.say(&trials[turn].farewell());
            }
        }
    }
    progress.finish("");
    Ok(true)
}
