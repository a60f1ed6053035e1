//! Formats of result files: which one a file has, told by its content, and its reader.
//!
//! Each format has a file of its own.

mod deck;
mod frd;
mod hdf5;
mod lines;
mod op2;
mod op2_records;
mod punch;
pub mod table;
mod universal;

use super::residual;
use super::results::Results;
use crate::problem::Problems;

/// What [`read`] tries, for the message when nothing fits.
const TRIED: &str = "Nastran HDF5, OP2, punch file or bulk data deck; universal file; CalculiX \
                     frd; CSV tables of nodes, modes, systems or masses";

/// Reads one file of a finite element program, its format told by its content; `name` is used in
/// messages only.
///
/// The file may be one part of several: [`Results::merge`] puts them together and
/// [`Results::complete`] checks the whole.
///
/// # Errors
/// The format is not recognised, the file is damaged or truncated, or holds what cannot be used:
/// complex eigenvectors, results of superelements, several subcases.
pub fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let results = if hdf5::recognised(bytes) {
        hdf5::read(bytes, name)
    } else if frd::recognised(bytes) {
        frd::read(bytes, name)
    } else if universal::recognised(bytes) {
        universal::read(bytes, name)
    } else if op2::recognised(bytes) {
        op2::read(bytes, name)
    } else if punch::recognised(bytes) {
        punch::read(bytes, name)
    } else if table::recognised(bytes) {
        table::read(bytes, name)
    } else if deck::recognised(bytes) {
        deck::read(bytes, name)
    } else {
        return Err(Problems::input(name, "", unrecognised(bytes), TRIED));
    }?;
    let mut results = results.finish(name)?;
    results.warnings.extend(residual::warning(&results.modes));
    Ok(results)
}

/// What a file that no reader takes looks like.
fn unrecognised(bytes: &[u8]) -> &'static str {
    let start = &bytes[..bytes.len().min(4000)];
    let text = String::from_utf8_lossy(start);
    if bytes.is_empty() {
        "an empty file"
    } else if start.starts_with(b"\x1f\x8b") || start.starts_with(b"PK\x03\x04") {
        "a compressed file"
    } else if start.starts_with(b"PAR1") {
        "a Parquet file where none is read"
    } else if text.contains("N A S T R A N") || text.contains("R E A L   E I G E N V") {
        "printed output of Nastran (F06), which has too few digits"
    } else {
        "a format that is not recognised"
    }
}

/// Frequency in Hz of an eigenvalue in (rad/s)², negative for a negative one.
fn frequency_hz(eigenvalue: f64) -> f64 {
    eigenvalue.abs().sqrt().copysign(eigenvalue) / std::f64::consts::TAU
}

/// The refusal of complex eigenvectors.
fn complex(name: &str, key: &str) -> Problems {
    Problems::input(
        name,
        key,
        "complex eigenvectors",
        "real eigenvectors (normal modes without damping and gyroscopic terms)",
    )
}

/// Refuses titles that tell of a superelement other than the residual structure, 0.
fn refuse_superelement(title: &str, name: &str, key: &str) -> Result<(), Problems> {
    let upper = title.to_ascii_uppercase();
    let Some(at) = upper.find("SUPERELEMENT") else { return Ok(()) };
    let rest = upper[at + "SUPERELEMENT".len()..].trim_start_matches([' ', '=', ':', '\t']);
    let rest = rest.strip_prefix("ID").unwrap_or(rest).trim_start_matches([' ', '=', ':']);
    let number: String = rest.chars().take_while(char::is_ascii_digit).collect();
    match number.trim_start_matches('0') {
        "" => Ok(()),
        id => Err(superelement(name, key, id)),
    }
}

/// The refusal of results of a superelement.
fn superelement(name: &str, key: &str, id: impl std::fmt::Display) -> Problems {
    Problems::input(
        name,
        key,
        format!("results of superelement {id}"),
        "results of the residual structure, to which the modes of superelements are recovered",
    )
}

/// Value of Nastran's residual vector flag for an eigenvalue table after augmentation by residual
/// vectors; 0 is none and 1 before augmentation.
const AUGMENTED: i64 = 2;

/// The warning of an eigenvalue table with that flag.
fn augmented() -> String {
    "the eigenvalue table is the one after augmentation by residual vectors: the last modes are \
     residual vectors, no natural modes"
        .into()
}
