//! What a verb tells the user.

use std::fmt::Arguments;
use std::io::Write;

/// Writes a line. A reader that has gone is no error, where `println!` and `eprintln!` would panic.
pub fn line(mut to: impl Write, text: Arguments<'_>) {
    let _ = writeln!(to, "{text}");
}

/// Writes a line to the standard output, which somebody may have stopped to read (`| head`).
#[macro_export]
macro_rules! say {
    ($($part:tt)*) => { $crate::say::line(std::io::stdout(), format_args!($($part)*)) };
}

/// Writes a line to the standard error: a log that nobody reads any more must not end a training.
#[macro_export]
macro_rules! tell {
    ($($part:tt)*) => { $crate::say::line(std::io::stderr(), format_args!($($part)*)) };
}
