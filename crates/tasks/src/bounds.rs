//! What a setting may be.

use std::fmt::Display;

/// Checks that a setting is from `low` to `high`.
///
/// # Errors
/// Names it, with the value found and those allowed; no number is within no bounds.
pub fn within<T: Copy + PartialOrd + Display>(name: &str, value: T, low: T, high: T) -> Result<(), String> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(format!("{name} is {value}, must be from {low} to {high}"))
    }
}

/// Checks that a setting is a range in order, from `low` to `high`.
///
/// # Errors
/// Names it, with the values found and those allowed.
pub fn ordered_within(name: &str, [from, to]: [f32; 2], low: f32, high: f32) -> Result<(), String> {
    if low <= from && from <= to && to <= high {
        Ok(())
    } else {
        Err(format!("{name} is [{from}, {to}], must be an ordered range within [{low}, {high}]"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_belong_to_what_is_allowed_and_nan_does_not() {
        assert!(within("x", 0.0, 0.0, 1.0).is_ok() && within("x", 1.0, 0.0, 1.0).is_ok());
        assert_eq!(within("x", 1.5, 0.0, 1.0).unwrap_err(), "x is 1.5, must be from 0 to 1");
        assert!(within("x", f32::NAN, 0.0, 1.0).unwrap_err().contains("x is NaN"));
        assert!(ordered_within("x", [0.0, 1.0], 0.0, 1.0).is_ok());
        assert!(ordered_within("x", [0.5, 0.4], 0.0, 1.0).unwrap_err().contains("x is [0.5, 0.4], must be"));
        assert!(ordered_within("x", [f32::NAN, 0.4], 0.0, 1.0).is_err());
    }
}
