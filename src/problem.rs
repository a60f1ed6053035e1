//! A problem of an input file: where it is, what was found there and what is allowed.
//!
//! Readers collect every problem of a file before they give up, so that a user mends a file in
//! one go. How a problem is printed and which exit code it leads to is decided in `cli`.

use std::fmt;

/// Whether the user's input is wrong (exit code 2) or a data file is damaged (exit code 3).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The text or the values of an input are not allowed.
    Input,
    /// A binary data file is truncated, corrupted or contradicts itself.
    Damage,
}

/// One thing that is wrong with one place of one input file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Wrong input or damaged data.
    pub kind: Kind,
    /// The file as the user named it.
    pub file: String,
    /// Key path inside the file, for instance `engine[0].nozzle.mass_kg`; empty for the whole file.
    pub key: String,
    /// What stands there.
    pub found: String,
    /// What is allowed there.
    pub allowed: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, key, found, allowed, .. } = self;
        let key = if key.is_empty() { String::new() } else { format!("{key}: ") };
        // What stands in a file must not steer the terminal on which it is shown.
        for c in format!("{file}: {key}found {found}; allowed: {allowed}").chars() {
            if c.is_control() && c != '\n' {
                write!(f, "{}", c.escape_default())?;
            } else {
                write!(f, "{c}")?;
            }
        }
        Ok(())
    }
}

/// Every problem found in one reading; an error when it is not empty.
#[derive(Debug, Clone, Default, PartialEq, Eq, thiserror::Error)]
#[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct Problems(pub Vec<Problem>);

impl Problems {
    /// A single problem with the input.
    pub fn input(
        file: impl Into<String>,
        key: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        let mut problems = Self::default();
        problems.push(Kind::Input, file, key, found, allowed);
        problems
    }

    /// A single problem with a damaged data file.
    pub fn damage(
        file: impl Into<String>,
        key: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) -> Self {
        let mut problems = Self::default();
        problems.push(Kind::Damage, file, key, found, allowed);
        problems
    }

    /// Adds one problem.
    pub fn push(
        &mut self,
        kind: Kind,
        file: impl Into<String>,
        key: impl Into<String>,
        found: impl Into<String>,
        allowed: impl Into<String>,
    ) {
        self.0.push(Problem {
            kind,
            file: file.into(),
            key: key.into(),
            found: found.into(),
            allowed: allowed.into(),
        });
    }

    /// Adds all problems of another reading.
    pub fn extend(&mut self, other: Problems) {
        self.0.extend(other.0);
    }

    /// `value` if there is no problem, else all problems.
    pub fn into_result<T>(self, value: T) -> Result<T, Problems> {
        if self.0.is_empty() { Ok(value) } else { Err(self) }
    }

    /// The graver of the kinds present: damage before input.
    pub fn kind(&self) -> Kind {
        self.0.iter().map(|p| p.kind).max().unwrap_or(Kind::Input)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_shown_and_not_obeyed() {
        let problems = Problems::input("é.toml", "a\u{7}", "\"\u{1b}[31m\0\"", "b\nc");
        let told = "é.toml: a\\u{7}: found \"\\u{1b}[31m\\u{0}\"; allowed: b\nc";
        assert_eq!(problems.to_string(), told);
        let whole = Problems::damage("f", "", "x", "y").to_string();
        assert_eq!(whole, "f: found x; allowed: y");
    }
}
