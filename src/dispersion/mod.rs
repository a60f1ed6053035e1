//! Dispersion: what is uncertain about a vehicle, and the draws of a case.
//!
//! A [`Table`] (text) meets a vehicle and becomes a [`Dispersion`]: draw keys, each with its
//! [`Law`] and the [`Parameters`] it acts on. A [`Sampler`] draws a case from it: an [`Affine`]
//! effect per parameter. A draw is a function of (seed, plan, draw key, case index) and nothing else;
//! [`stream`] says which for independent draws, [`plan`] and [`sobol`] for the other plans.

mod beta;
pub mod correlation;
pub mod draw;
pub mod factorial;
#[cfg(test)]
pub(crate) mod fixture;
pub mod gradient;
pub mod keyed;
pub mod law;
pub mod normal;
pub mod parameter;
pub mod plan;
pub mod resolve;
pub mod sampler;
pub mod scheme;
pub mod sobol;
pub mod strata;
pub mod stream;
pub mod table;

pub use correlation::Group;
pub use draw::{Dispersion, Draw, Role, Shared};
pub use gradient::{AffineGradient, Chain};
pub use law::{Bound, Law, Position};
pub use parameter::{Affine, Parameters, Place, Quantity};
pub use plan::{Listed, Plan};
pub use resolve::resolve;
pub use sampler::{Cursor, Draws, Sampler};
pub use scheme::{Levels, Refusal, Scheme};
pub use table::{Apply, Class, Table};
