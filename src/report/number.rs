//! Numbers for people: four significant digits, no trailing zeros; levels in full.

/// A number with four significant digits; a power of ten where it would be long.
pub fn significant(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let exponential = format!("{value:.3e}");
    let exponent: i32 =
        exponential.split_once('e').and_then(|(_, digits)| digits.parse().ok()).unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        return exponential;
    }
    let text = format!("{value:.*}", usize::try_from(3 - exponent).unwrap_or(0));
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_string()
    } else {
        text
    }
}

/// A level such as a coverage or confidence in percent, to a millionth of one: 0.99865 → 99.865.
pub fn percent(level: f64) -> String {
    let text = format!("{:.6}", 100.0 * level);
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits_are_kept_and_zeros_are_not() {
        for (value, text) in [
            (0.0, "0"),
            (-0.0, "0"),
            (5.0, "5"),
            (70.712_345, "70.71"),
            (-0.001_234_56, "-0.001235"),
            (99.996, "100"),
            (123_456.7, "123457"),
            (1.5e7, "1.500e7"),
            (-2e-9, "-2.000e-9"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(significant(value), text);
        }
    }

    #[test]
    fn a_level_keeps_its_digits() {
        for (level, text) in [(0.99865, "99.865"), (0.1, "10"), (0.9973, "99.73"), (1.0, "100")] {
            assert_eq!(percent(level), text);
        }
    }
}
