//! Suites, success criteria, statistics and the report.
pub mod results;
pub mod statistics;
