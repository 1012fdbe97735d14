//! What a verb tells the user.

/// Writes a line to the standard output. A reader that has gone (`| head`) is no error, where `println!` would panic.
#[macro_export]
macro_rules! say {
    ($($part:tt)*) => {{
        let _ = std::io::Write::write_fmt(&mut std::io::stdout(), format_args!("{}\n", format_args!($($part)*)));
    }};
}
