//! Readers of finite element results from outside: small files of every format, refusals, damaged
//! bytes, and real files where they are there.
//!
//! What single functions promise is tested beside them.

#![expect(clippy::disallowed_methods, reason = "the tests read files and the environment")]

mod agreement;
mod damage;
mod memory;
mod real;
mod refusals;

use std::path::PathBuf;

use tvse::fem::{Results, read};

/// Bytes of a fixture in `tests/data/fem`.
fn fixture(name: &str) -> Vec<u8> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/fem").join(name);
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn results(name: &str) -> Results {
    read(&fixture(name), name).unwrap_or_else(|problems| panic!("{problems}"))
}
