//! Dynamics: from one drawn vehicle to one linear model.
//!
//! Coordinates are the rigid translation ξ and rotation θ of the trajectory-relative frame (optional),
//! the elastic coordinates η of the reduced body (engines and slosh masses removed, mass-normalised),
//! two gimbal rotations Θ per gimballed engine, relative to the thrust structure, and two slosh
//! displacements δ per tank (optional); then the first-order states of actuators and autopilot. Rotations are
//! small rotation vectors: a point carried by a body that rotates by ρ about p moves by ρ × (x − p).
//! `u` is the unit vector of the thrust force on the vehicle (nominally −x); generalised forces stand
//! on the right-hand side, so that they enter stiffness and damping with a minus.
//!
//! Numbers in parentheses are the equations of the paper. Where its printed form and Lagrange's
//! equations differ, the latter are implemented:
//! - (2): the inertial coupling on its right-hand side multiplies β̈, as in the paper's own (3);
//! - (6): `Γᵀ m Γ` and `Γᵀ m v̇`, with Γ = Φ_g − r_e× Ψ_g; the mass matrix is built as a congruence, so
//!   that the terms printed with two equal levers never arise;
//! - (4): only necessary (one coefficient of the quartic positive) and very loose: `planar` gives
//!   the exact critical thrust beside it;
//! - (13): the part of the exact nozzle term that is linear in the nozzle length; both are offered.

pub mod aerodynamics;
pub mod assemble;
pub mod attached;
pub mod control_law;
pub mod drawn;
pub mod engine;
pub mod gradient;
pub mod interconnection;
pub mod interface;
pub mod jet_damping;
pub mod layout;
pub mod load_response;
pub mod model;
pub mod planar;
pub mod rigid_body;
pub mod servo;
pub mod slosh;
pub mod virtual_grid;

pub use assemble::{Effects, NozzleJet, Plant};
pub use control_law::ControlLaw;
pub use drawn::{
    DrawnActuator, DrawnAerodynamics, DrawnAutopilot, DrawnBody, DrawnEngine, DrawnPath,
    DrawnSensor, DrawnTank, DrawnVehicle,
};
pub use engine::Attachment;
pub use gradient::{Gradient, Vectors};
pub use interface::Interface;
pub use layout::{Layout, Part};
pub use model::{Model, NullMotion};
pub use servo::{Feedback, Servo};
pub use slosh::TankAttachment;
