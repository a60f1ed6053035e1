//! Reports: from values to text for people.

pub mod modes;
