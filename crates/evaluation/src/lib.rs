//! Suites, success criteria, statistics and the report.
mod guided;
pub mod judge;
pub mod locomotion;
pub mod motion;
pub mod report;
pub mod results;
pub mod statistics;
pub mod suite;
