//! Looking at a training while it runs: what `--watch` shows, and how it gets there without touching what is learned.
//!
//! ```text
//! Watched environment ── frames ──┐
//!                                 ├─► Window ◄── server::live, one thread a page
//! training loop ─────── curves ───┘
//! ```
//!
//! [`Watched`] stands between learner and environment and reads poses after a step, when anyone looks. [`Window`] keeps what
//! is worth showing: the last frames, the curves. Trainings put in and never wait; pages take out, and who is slow misses frames.

mod curves;
mod watched;
mod window;

pub use curves::Curves;
pub use watched::Watched;
pub use window::{About, Cursor, Ground, News, Window};
