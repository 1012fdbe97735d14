//! The verbs of the program, one file each.

pub(crate) mod bench;
pub(crate) mod config;
pub(crate) mod evaluate;
pub(crate) mod inspect;
pub(crate) mod picture;
pub(crate) mod play;
mod pulls;
pub(crate) mod reproduce;
mod serving;
mod situation;
pub(crate) mod train;
