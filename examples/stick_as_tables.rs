//! Writes the modes of a modal package as a finite element program would: plain tables in
//! millimetres and tonnes, in a frame with x forward, with the six rigid-body modes, and the import
//! description that brings them back. See docs/import/example.md.
//!
//!     cargo run --release --example stick_as_tables -- vehicles/sls-like/modes study/fem

#![expect(clippy::disallowed_methods, reason = "an example writes files")]

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use tvse::structure::effective::rigid_modes;
use tvse::vehicle::Modal;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [package, folder] = words.as_slice() else {
        return Err("usage: stick_as_tables PACKAGE FOLDER".into());
    };
    write(&tvse::io::package::read(Path::new(package))?, Path::new(folder))?;
    println!("written to {folder}; next: tvse import {folder}/import.toml");
    Ok(())
}

/// Millimetres from the origin of the program's frame to the nose, which lies ahead.
const NOSE_MM: f64 = 100_000.0;

/// The vehicle's x, y, z (aft, y, z) in a frame with x forward, y to the other side and z up.
fn turned(v: [f64; 3]) -> [f64; 3] {
    [-v[0], -v[1], v[2]]
}

/// Writes `nodes.csv`, a `modes_<time>.csv` for each flight time, and `import.toml`.
///
/// # Errors
/// A file that cannot be written.
pub fn write(modal: &Modal, folder: &Path) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(folder)?;
    let mut description = String::from(
        "# Made by the example stick_as_tables: modes of a stick model, written as those of a finite\n\
         # element model in millimetres and tonnes, come back as a modal package.\n\
         format = 1\n\
         source = \"stick model, by way of tables\"\n\
         units = \"mm-t-s\"\n\n\
         [frame] # the program's x points forward, its origin lies 100 m aft of the nose\n",
    );
    writeln!(description, "origin = [{NOSE_MM:?}, 0, 0]\naft = [-1, 0, 0]\ny = [0, -1, 0]\n")?;
    description.push_str("[body]\nkind = \"reduced\"\n\n[modes]\nnormalisation = \"maximum\"\n");
    let first = modal.sets.first().ok_or("a package without flight times")?;
    let mut nodes = String::from("node,x,y,z,label\n");
    for (i, grid) in first.grids.iter().enumerate() {
        let [x, y, z] = turned((grid.position_m * 1000.0).into());
        writeln!(nodes, "{},{:?},{y:?},{z:?},{}", 1001 + i, x + NOSE_MM, grid.name)?;
    }
    fs::write(folder.join("nodes.csv"), nodes)?;
    for set in &modal.sets {
        let mut modes = String::from("mode,frequency_hz,node,tx,ty,tz,rx,ry,rz,generalised_mass\n");
        let rigid = rigid_modes(set);
        for (j, mode) in rigid.iter().chain(&set.modes).enumerate() {
            let greatest = mode.shape.iter().map(nalgebra::Vector3::amax).fold(0.0, f64::max);
            let scale = 1.0 / greatest;
            for (i, (shape, slope)) in mode.shape.iter().zip(&mode.slope).enumerate() {
                let [tx, ty, tz] = turned((shape * scale).into());
                // A rotation for a translation of one millimetre.
                let [rx, ry, rz] = turned((slope * (scale / 1000.0)).into());
                writeln!(
                    modes,
                    "{},{:?},{},{tx:?},{ty:?},{tz:?},{rx:?},{ry:?},{rz:?},{:?}",
                    j + 1,
                    mode.frequency_hz,
                    1001 + i,
                    scale * scale / 1000.0
                )?;
            }
        }
        let time = set.flight_time_s;
        fs::write(folder.join(format!("modes_{time}.csv")), modes)?;
        write!(
            description,
            "\n[[flight_time]]\ntime_s = {time}\nresults = [\"nodes.csv\", \"modes_{time}.csv\"]\n\
             mass = {{ from = \"rigid-body-modes\" }}\n"
        )?;
    }
    for grid in &first.grids {
        let last = grid.name.rsplit('.').next().unwrap_or_default();
        let role = match last {
            "gimbal" => "role = \"gimbal\"\n",
            "rock" | "tilt" => "role = \"actuator\"\n",
            _ => "",
        };
        write!(description, "\n[[grid]]\nname = \"{0}\"\n{role}set = \"{0}\"\n", grid.name)?;
    }
    fs::write(folder.join("import.toml"), description)?;
    Ok(())
}
