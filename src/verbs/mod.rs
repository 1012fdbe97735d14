//! The verbs of the program, one file each.

pub(crate) mod evaluate;
pub(crate) mod inspect;
pub(crate) mod train;
