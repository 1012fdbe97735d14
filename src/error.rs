//! The one distinction the program makes between errors: the caller's mistake, or not.

/// A mistake of the caller: a flag, a value or a file that cannot be used. Ends the program with exit code 2.
///
/// The message names the thing, the value found and the values allowed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct BadInput {
    message: String,
}

impl BadInput {
    /// An error with this message.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into() }
    }
}

/// Marks any error as the caller's mistake, keeping its message and those of its causes.
pub trait OrBadInput<T> {
    /// The same value, its error turned into [`BadInput`] with `what` in front.
    ///
    /// # Errors
    /// Whatever `self` holds.
    fn or_bad_input(self, what: impl FnOnce() -> String) -> Result<T, BadInput>;
}

impl<T, E: Into<anyhow::Error>> OrBadInput<T> for Result<T, E> {
    fn or_bad_input(self, what: impl FnOnce() -> String) -> Result<T, BadInput> {
        self.map_err(|error| BadInput::new(format!("{}: {}", what(), with_causes(&error.into()))))
    }
}

/// An error and its causes in one line; a cause that the message before it already tells is not told again.
pub fn with_causes(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(|cause| cause.to_string()) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_told_once() {
        let error = anyhow::anyhow!("no such file").context("cannot read a: no such file").context("robot");
        assert_eq!(with_causes(&error), "robot: cannot read a: no such file");
    }
}
