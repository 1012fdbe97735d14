//! The report through its public face: the page as a whole, and what its figures show.

mod figures;
mod fixture;
mod page;
