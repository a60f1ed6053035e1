//! Input and output: the only module that touches the disk.

pub mod files;
pub mod flat;
pub mod folder;
pub mod package;
pub mod scaffold;
pub mod scenario;
