//! Why a command stopped, and the exit code that says so.

use crate::problem::{Kind, Problems};

/// Why a command stopped.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// Problems of input files (exit code 2) or damaged data (exit code 3).
    #[error("{0}")]
    Problems(#[from] Problems),
    /// The output or another file could not be read or written (exit code 2).
    #[error("{path}: {source}")]
    File {
        /// The file as the user named it.
        path: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// Writing to the standard output failed (exit code 2).
    #[error("standard output: {0}")]
    Output(#[from] std::io::Error),
    /// Wrong usage (exit code 2).
    #[error("{0}")]
    Usage(String),
    /// A signal asked the command to stop (exit code 128 and the signal's number).
    #[error("{message}")]
    Stopped {
        /// How far the command came, and what is left of it.
        message: String,
        /// The exit code.
        code: u8,
    },
    /// Incomplete data or nothing evaluated (exit code 3).
    #[error("{0}")]
    Incomplete(String),
}

impl Error {
    /// The exit code of the process.
    pub fn code(&self) -> u8 {
        match self {
            Self::Problems(problems) => match problems.kind() {
                Kind::Input => super::USAGE,
                Kind::Damage => super::INCOMPLETE,
            },
            Self::File { .. } | Self::Output(_) | Self::Usage(_) => super::USAGE,
            Self::Incomplete(_) => super::INCOMPLETE,
            Self::Stopped { code, .. } => *code,
        }
    }
}
