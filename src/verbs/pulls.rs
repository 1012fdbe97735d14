//! The pulls that `evaluate` and `picture` are asked for by name.

use guidedog::error::BadInput;
use guidedog::evaluation::suite::{Case, SUITES, suite};

/// The pulls of a suite; the error also names what else the verb takes as one.
pub(crate) fn cases(name: &str, others: &[&str]) -> Result<Vec<Case>, BadInput> {
    suite(name).ok_or_else(|| {
        let known = [&SUITES, others].concat().join(", ");
        BadInput::new(format!("--suite {name}: must be one of {known}"))
    })
}

/// A pull of a suite, or any steady one as `f_x/f_y`.
pub(crate) fn case(suite: &[Case], name: &str) -> Result<Case, BadInput> {
    let named = suite.iter().find(|case| case.name == name).cloned();
    let steady = || {
        let (x, y) = name.split_once('/')?;
        let case = Case::steady(x.parse().ok()?, y.parse().ok()?);
        case.force.iter().all(|force| force.abs() <= 500.0).then_some(case)
    };
    named.or_else(steady).ok_or_else(|| {
        let message = "is neither in the suite nor a pull f_x/f_y of at most 500 N";
        BadInput::new(format!("--case {name}: {message}"))
    })
}
