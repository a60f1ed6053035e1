//! `tvse`: a Monte Carlo dispersion engine for thrust vector servoelastic coupling.
//!
//! A **scenario** (text) becomes a **vehicle** and a **dispersion** table; each **case** draws one
//! dispersed vehicle from (seed, index), turns it into **dynamics** (a linear model), solves its
//! **modes**, and yields one **record**; records become **statistics**, statistics meet
//! **gates**, gates become an exit code.
//!
//! One structural frame: `x` along the centreline, positive aft, `y`, `z` lateral,
//! right-handed; SI units; small rotation vectors.
//!
//! No unsafe code but in `modal::spectrum::lanes`.

#![deny(unsafe_code)]

pub mod campaign;
pub mod cli;
pub mod dispersion;
pub mod dynamics;
pub mod fem;
pub mod gate;
pub mod import;
pub mod io;
pub mod margins;
pub mod modal;
pub mod problem;
pub mod report;
pub mod scenario;
pub mod spelling;
pub mod stats;
pub mod structure;
pub mod vehicle;

#[cfg(test)]
mod layers;
