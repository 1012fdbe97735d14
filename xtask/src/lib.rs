//! Chores of this repository that are too long for a shell line.

pub mod manifest;
pub mod web;
