//! Suites, success criteria, statistics and the report.
