//! Import: from the results of a finite element program to the grids and modes of a modal package.
//!
//! Values in, values out: files are read in `fem` and `io`, what the user asks for is understood in
//! `scenario::import`.

pub mod made;
pub mod model;
pub mod normalise;
pub mod plausible;
pub mod rigid;
pub mod section;
pub mod systems;
pub mod units;

pub use made::{Chosen, Made, MadeTime, Moved};
pub use model::{Frame, Model};
pub use rigid::RigidBody;
pub use section::Section;
pub use units::{UnitSystem, Units};
