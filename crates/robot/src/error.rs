//! What can be wrong with a robot description.

/// A description that cannot be used: names the element, what was found, what is allowed.
#[derive(Debug, thiserror::Error)]
pub enum RobotError {
    /// The file cannot be read.
    #[error("cannot read {path}: {source}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not XML.
    #[error("not well-formed XML: {0}")]
    Xml(#[from] roxmltree::Error),
    /// The document is something else.
    #[error("the root element is <{found}>, must be <robot>")]
    NotARobot {
        /// Name of the root element.
        found: String,
    },
    /// An attribute or child element is missing.
    #[error("{element} has no {missing}")]
    Missing {
        /// The element.
        element: String,
        /// What it lacks.
        missing: String,
    },
    /// A value cannot be used.
    #[error("{element}: {what} is `{found}`, must be {allowed}")]
    Value {
        /// The element.
        element: String,
        /// Which value.
        what: String,
        /// The value.
        found: String,
        /// What would do.
        allowed: String,
    },
    /// The links and joints do not make a tree.
    #[error("{element}: {problem}")]
    Tree {
        /// The element.
        element: String,
        /// What is wrong.
        problem: String,
    },
}

impl RobotError {
    pub(crate) fn value(element: &str, what: &str, found: impl ToString, allowed: &str) -> Self {
        Self::Value {
            element: element.to_owned(),
            what: what.to_owned(),
            found: found.to_string(),
            allowed: allowed.to_owned(),
        }
    }
    pub(crate) fn missing(element: &str, missing: &str) -> Self {
        Self::Missing { element: element.to_owned(), missing: missing.to_owned() }
    }
    pub(crate) fn tree(element: &str, problem: impl Into<String>) -> Self {
        Self::Tree { element: element.to_owned(), problem: problem.into() }
    }
}
