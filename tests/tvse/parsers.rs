//! The parsers of everything that may come from somebody else, each a function of bytes that reads or
//! refuses them: shared by the fuzz targets and the test of their corpus.
#![allow(dead_code, reason = "each fuzz target takes one of them")]

use tvse::dispersion;
use tvse::gate;
use tvse::io::{flat, manifest, package, shard};
use tvse::scenario::{run_file::RunFile, table, vehicle_file::VehicleFile};

/// Scenario texts, gates, headers of modal packages, manifests.
pub fn texts(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let _ = table::read::<RunFile>("f", text);
    let _ = table::read::<VehicleFile>("f", text);
    let _ = table::read::<dispersion::Table>("f", text);
    let _ = gate::parse(text, "f");
    let _ = package::header(text, "f");
    let _ = serde_json::from_str::<manifest::Manifest>(text);
}

/// Tables of a modal package.
pub fn tables(bytes: &[u8]) {
    for layout in package::layouts() {
        let _ = flat::Table::from_bytes(layout, bytes.to_vec(), "f");
    }
}

/// Shards of a run.
pub fn shards(bytes: &[u8]) {
    let _ = shard::Header::parse(bytes);
}
