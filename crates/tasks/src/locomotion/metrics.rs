//! What is reported of the robots' steps beside their rewards.

use super::reward::{StepQuantities, TERMS, linear_error, term_names, yaw_error};

/// Numbers in [`Metrics`] beside the terms of the reward, and all.
const OTHERS: usize = 7;
const SUMS: usize = OTHERS + TERMS;

/// Sums over steps.
#[derive(Clone, Debug, Default)]
pub(super) struct Metrics {
    /// Steps of all robots.
    pub(super) steps: f64,
    /// Episodes that ended in a fall.
    pub(super) falls: f64,
    /// States that were no longer numbers.
    pub(super) broken: f64,
    /// Terrain levels of the robots, as they are.
    pub(super) levels: f64,
    terms: [f64; TERMS],
    linear_tracking: f64,
    yaw_tracking: f64,
    guidance_score: f64,
}

impl Metrics {
    /// Takes in one step.
    pub(super) fn add(&mut self, q: &StepQuantities<'_>, terms: &[f32; TERMS]) {
        for (sum, term) in self.terms.iter_mut().zip(terms) {
            *sum += f64::from(*term);
        }
        let (linear, yaw) = (linear_error(q), yaw_error(q));
        self.linear_tracking += f64::from((-linear / 0.25).exp());
        self.yaw_tracking += f64::from((-yaw / 0.25).exp());
        self.guidance_score += f64::from((-10.0 * (linear + yaw)).exp());
    }

    /// The sums, in a fixed order.
    pub(super) fn to_sums(&self) -> [f64; SUMS] {
        let mut sums = [0.0; SUMS];
        let others = [
            self.steps,
            self.falls,
            self.broken,
            self.levels,
            self.linear_tracking,
            self.yaw_tracking,
            self.guidance_score,
        ];
        sums[..OTHERS].copy_from_slice(&others);
        sums[OTHERS..].copy_from_slice(&self.terms);
        sums
    }

    /// What [`Metrics::to_sums`] gave.
    pub(super) fn from_sums(sums: &[f64; SUMS]) -> Self {
        let &[steps, falls, broken, levels, linear_tracking, yaw_tracking, guidance_score, ref terms @ ..] =
            sums;
        Self { steps, falls, broken, levels, linear_tracking, yaw_tracking, guidance_score, terms: *terms }
    }

    /// Adds another sum.
    pub(super) fn merge(&mut self, o: &Self) {
        self.steps += o.steps;
        self.falls += o.falls;
        self.broken += o.broken;
        self.levels += o.levels;
        self.linear_tracking += o.linear_tracking;
        self.yaw_tracking += o.yaw_tracking;
        self.guidance_score += o.guidance_score;
        for (sum, term) in self.terms.iter_mut().zip(o.terms) {
            *sum += term;
        }
    }

    /// Mean of exp(−|e_xy|² / 0.25).
    pub(super) fn linear_tracking(&self) -> f64 {
        self.linear_tracking / self.steps.max(1.0)
    }

    /// Means per step, by name.
    pub(super) fn named(&self) -> Vec<(String, f64)> {
        let steps = self.steps.max(1.0);
        let mut named = vec![
            ("tracking_linear".to_owned(), self.linear_tracking()),
            ("tracking_yaw".to_owned(), self.yaw_tracking / steps),
            ("guidance_score".to_owned(), self.guidance_score / steps),
            ("falls_per_1000".to_owned(), 1000.0 * self.falls / steps),
            ("broken_states".to_owned(), self.broken),
        ];
        for (name, sum) in term_names().iter().zip(self.terms) {
            named.push((format!("reward/{name}"), sum / steps));
        }
        named
    }
}
