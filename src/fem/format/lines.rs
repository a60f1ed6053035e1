//! Lines, columns and decimal numbers of text files as Fortran programs write them.
//!
//! Not the formats themselves.

use std::borrow::Cow;

/// The lines of a file, each with its number from 1; bytes that are not text become `�`.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    bytes.split(|byte| *byte == b'\n').enumerate().map(|(index, line)| {
        let line = line.strip_suffix(b"\r").unwrap_or(line);
        (index + 1, String::from_utf8_lossy(line))
    })
}

/// The trimmed text in columns `from..to`, counted from 0; empty beyond the end of the line.
pub(super) fn columns(line: &str, from: usize, to: usize) -> &str {
    line.get(from..to.min(line.len())).unwrap_or("").trim()
}

/// A decimal number with exponent letter E, D or none (`1.5D+03`, `1.5+3`).
pub(super) fn real(text: &str) -> Option<f64> {
    let text = text.trim();
    if text.len() > 40 || !text.bytes().any(|b| b.is_ascii_digit()) {
        return None;
    }
    if !text.bytes().all(|b| b.is_ascii_digit() || b"+-.eEdD".contains(&b)) {
        return None;
    }
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    let mut plain = text.replace(['d', 'D'], "E");
    if !plain.contains(['e', 'E']) {
        let sign = plain.rfind(['+', '-']).filter(|at| *at > 0)?;
        plain.insert(sign, 'E');
    }
    plain.parse().ok()
}

/// All numbers of a line between blanks; nothing if one of them is none.
pub(super) fn reals(line: &str) -> Option<Vec<f64>> {
    line.split_ascii_whitespace().map(real).collect()
}

/// All integers of a line between blanks; nothing if one of them is none.
pub(super) fn integers(line: &str) -> Option<Vec<i64>> {
    line.split_ascii_whitespace().map(|token| token.parse().ok()).collect()
}

/// Significant digits of the mantissa as written: `-1.250E-03` has four.
pub(super) fn digits(text: &str) -> u8 {
    let mantissa = text.trim().trim_start_matches(['+', '-']);
    let mantissa = mantissa.split(['e', 'E', 'd', 'D', '+', '-']).next().unwrap_or("");
    let counted = mantissa.bytes().filter(u8::is_ascii_digit).skip_while(|digit| *digit == b'0');
    u8::try_from(counted.count()).unwrap_or(u8::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_fortran_and_nastran_write_them() {
        for (text, value) in [
            ("1.0", 1.0),
            (" -.5 ", -0.5),
            ("7.", 7.0),
            ("1.5D+03", 1500.0),
            ("1.5d3", 1500.0),
            ("1.5+3", 1500.0),
            ("-1.5-3", -0.0015),
            ("+2.5E-1", 0.25),
            ("1.000000-100", 1e-100),
            ("12", 12.0),
        ] {
            assert_eq!(real(text), Some(value), "{text}");
        }
        for text in ["", " ", "nan", "inf", "1.0.0", "0x10", "E5", "-", "1+", "1e5e5", "1.0 2.0"] {
            assert_eq!(real(text), None, "{text}");
        }
    }

    #[test]
    fn significant_digits_are_those_of_the_mantissa() {
        assert_eq!(digits("-1.250E-03"), 4);
        assert_eq!(digits(" 0.12345D+00"), 5);
        assert_eq!(digits("1.5-3"), 2);
        assert_eq!(digits("0.000000E+00"), 0);
    }

    #[test]
    fn columns_beyond_the_line_or_inside_a_letter_are_empty() {
        assert_eq!(columns("abc", 1, 10), "bc");
        assert_eq!(columns("abc", 5, 10), "");
        assert_eq!(columns("aéb", 2, 4), "");
    }
}
