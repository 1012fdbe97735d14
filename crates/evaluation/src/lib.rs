//! Suites, success criteria, statistics and the report.
pub mod report;
pub mod results;
pub mod statistics;
