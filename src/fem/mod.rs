//! Results of finite element programs: what they wrote, in the file's own units and frames.
//!
//! Reading takes bytes, not files; which grids matter, units and frames are not decided here.

pub mod format;
mod residual;
pub mod results;

pub use format::read;
pub use results::{
    Node, NodeMass, NodeShape, Point, Precision, RawMode, Results, System, SystemKind,
};
