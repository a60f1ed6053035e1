//! `tvse` from outside: the built program and the public library on the shipped vehicle.
//!
//! What single modules promise is tested beside them; here only what shows when they work together.

#![expect(clippy::disallowed_methods, reason = "the tests make, damage and read files")]

mod answers;
mod bad_input;
mod commands;
mod corpus;
mod damage;
mod derivatives;
mod examples;
mod failures;
mod gates;
mod import;
mod outside;
mod parsers;
mod repeatability;
mod report;
mod schema;
mod servo;
mod stopping;
mod study;
