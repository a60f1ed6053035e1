//! Input and output: the only module that touches the disk.

pub mod actuator;
mod assemble;
pub mod column;
mod envelope;
mod fault;
pub mod feedback;
pub mod files;
pub mod flat;
pub mod folder;
pub mod import;
pub mod inputs;
pub mod listed;
pub mod lock;
pub mod maker;
pub mod manifest;
pub mod model;
pub mod offenders;
pub mod package;
pub mod pair;
pub mod plan;
pub mod reference;
pub mod replay;
pub mod report;
pub mod response;
pub mod results;
pub mod run;
pub mod scaffold;
pub mod scenario;
pub mod schema;
mod scratch;
pub mod shard;
pub mod source;
pub mod store;
mod stored;
pub mod summarise;
#[cfg(test)]
mod synthetic;
pub mod table;
pub mod worst;

pub use results::{Finished, Opening, Results};
pub use run::Run;
