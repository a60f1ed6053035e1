//! Input and output: the only module that touches the disk.

pub mod column;
pub mod files;
pub mod flat;
pub mod folder;
pub mod inputs;
pub mod listed;
pub mod manifest;
pub mod package;
pub mod plan;
pub mod replay;
pub mod results;
pub mod run;
pub mod scaffold;
pub mod scenario;
pub mod schema;
pub mod source;
mod stored;
pub mod summarise;
#[cfg(test)]
mod synthetic;
pub mod table;

pub use results::{Finished, Results};
pub use run::Run;
