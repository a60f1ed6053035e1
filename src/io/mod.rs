//! Input and output: the only module that touches the disk.

pub mod files;
