//! Dynamics: from one drawn vehicle to one linear model.

pub mod assemble;
pub mod drawn;
pub mod jet_damping;
pub mod layout;
pub mod load_response;
pub mod model;
pub mod planar;
pub mod virtual_grid;

pub use assemble::{Attachment, Effects, NozzleJet, Plant};
pub use drawn::{DrawnBody, DrawnEngine, DrawnVehicle};
pub use layout::Layout;
pub use model::Model;
