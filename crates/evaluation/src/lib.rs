//! Suites, success criteria, statistics and the report.
pub mod criteria;
pub mod exchange;
pub mod film;
mod guided;
pub mod judge;
pub mod locomotion;
pub mod measures;
pub mod milestones;
pub mod motion;
pub mod outcome;
pub mod plane;
pub mod recording;
pub mod report;
pub mod results;
pub mod script;
mod setting;
pub mod statistics;
pub mod suite;
