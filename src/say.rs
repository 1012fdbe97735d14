//! What a verb tells the user.

/// Writes a line to the standard output. A reader that has gone (`| head`) is no error, where `println!` would panic.
#[macro_export]
macro_rules! say {
    ($($part:tt)*) => {{
        let _ = std::io::Write::write_fmt(&mut std::io::stdout(), format_args!("{}\n", format_args!($($part)*)));
    }};
}

/// Writes a line to the standard error, as [`say!`](crate::say) does to the output: a log that nobody reads any more must not end a
/// training.
#[macro_export]
macro_rules! tell {
    ($($part:tt)*) => {{
        let _ = std::io::Write::write_fmt(&mut std::io::stderr(), format_args!("{}\n", format_args!($($part)*)));
    }};
}
