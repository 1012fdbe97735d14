//! What is measured on a recording beside success. One measure, one file.

pub mod chatter;
pub mod comfort;
pub mod latency;
pub mod reading;
pub mod split;
pub mod stopping;
pub mod threshold;
