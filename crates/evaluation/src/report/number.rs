//! Numbers as a reader wants them: fixed digits, a true minus, a dash where there is no value.

/// Stands where a value is missing or not a number.
const MISSING: &str = "–";

/// Values beyond this are as good as infinite: drawn nowhere, and without digits.
const LARGEST: f64 = 1e12;

/// Whether a value has a place in a figure.
pub(super) fn is_drawable(value: f64) -> bool {
    value.abs() < LARGEST
}

/// `value` with so many decimals and U+2212 for minus; never "−0.00".
pub(super) fn fixed(value: f64, decimals: usize) -> String {
    if !is_drawable(value) {
        return MISSING.into();
    }
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(size) if size.contains(|digit: char| ('1'..='9').contains(&digit)) => format!("−{size}"),
        Some(size) => size.into(),
        None => text,
    }
}

/// A share in percent with one decimal; only a true one is "100.0", and only a true zero "0.0".
pub(super) fn percentage(share: f64) -> String {
    match fixed(100.0 * share, 1).as_str() {
        "0.0" if share > 0.0 => "<0.1".into(),
        "100.0" if share < 1.0 => ">99.9".into(),
        text => text.into(),
    }
}

/// The same with its sign, and without a useless zero: "98.5 %", "100 %".
pub(super) fn percent(share: f64) -> String {
    match percentage(share) {
        text if text == MISSING => text,
        text => format!("{}\u{a0}%", text.strip_suffix(".0").unwrap_or(&text)),
    }
}

/// A coordinate in an attribute: at most two decimals, and zero for what is not a number.
pub(super) fn coordinate(value: f64) -> String {
    if !is_drawable(value) {
        return "0".into();
    }
    let text = format!("{value:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.into() }
}

/// "1 episode", "3 episodes".
pub(super) fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_fixed_digits_and_a_true_minus() {
        assert_eq!(fixed(0.6149, 2), "0.61");
        assert_eq!(fixed(-1.25, 1), "−1.2");
        assert_eq!(fixed(-0.004, 2), "0.00");
        assert_eq!(fixed(f64::NAN, 2), "–");
        assert_eq!(fixed(f64::NEG_INFINITY, 2), "–");
    }

    #[test]
    fn percentages_drop_a_useless_zero() {
        assert_eq!(percent(1.0), "100\u{a0}%");
        assert_eq!(percent(0.985), "98.5\u{a0}%");
        assert_eq!(percent(0.0), "0\u{a0}%");
        assert_eq!(percent(f64::INFINITY), "–");
    }

    #[test]
    fn percentages_round_neither_to_all_nor_to_nothing() {
        assert_eq!([0.9994, 0.9996, 1.0].map(percentage), ["99.9", ">99.9", "100.0"]);
        assert_eq!([0.0, 0.0004, 0.0006].map(percentage), ["0.0", "<0.1", "0.1"]);
    }

    #[test]
    fn coordinates_are_always_numbers() {
        assert_eq!(coordinate(12.340), "12.34");
        assert_eq!(coordinate(-0.001), "0");
        assert_eq!(coordinate(100.0), "100");
        for bad in [f64::NAN, f64::INFINITY, f64::MIN] {
            assert_eq!(coordinate(bad), "0");
        }
    }
}
