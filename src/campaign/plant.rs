//! From a vehicle to its plant at one flight time: layout, attachments and case jet damping.
//!
//! What a draw changes enters later, in `draw`.

use super::definition::Slope;
use crate::dynamics::jet_damping::{Station, case_per_flow};
use crate::dynamics::virtual_grid::{Geometry, VirtualGrid};
use crate::dynamics::{Attachment, Layout, Plant};
use crate::vehicle::{Engine, ModeSet, Vehicle};
use nalgebra::{Matrix3x2, Vector3};

/// Why a vehicle has no plant at a flight time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A grid that an engine names is not in the modal package at this time.
    #[error("{engine}: grid `{grid}` is not in the modal package at {time_s} s")]
    MissingGrid {
        /// Path of the engine.
        engine: String,
        /// Name of the grid.
        grid: String,
        /// Flight time, s.
        time_s: f64,
    },
    /// The actuators of an engine span no plane.
    #[error("{engine}: no virtual grid: {source}")]
    Degenerate {
        /// Path of the engine.
        engine: String,
        /// Why.
        source: crate::dynamics::virtual_grid::Degenerate,
    },
}

/// The plant of `vehicle` with the modes of `set`; `gimballed` says per engine whether it moves.
///
/// # Errors
/// See [`Error`].
pub fn plant(
    vehicle: &Vehicle,
    set: &ModeSet,
    gimballed: &[bool],
    slope: Slope,
) -> Result<Plant, Error> {
    let engines = vehicle.engines.iter().zip(gimballed).map(|(engine, &gimballed)| {
        let [first, second] = &engine.actuators;
        (engine.path(), [first.name.as_str(), second.name.as_str()], gimballed)
    });
    let layout = Layout::new(set.modes.iter().map(|mode| mode.label.as_str()), engines);
    let attachments = vehicle
        .engines
        .iter()
        .map(|engine| attachment(engine, set, slope))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Plant { layout, body_mass_kg: set.body.mass_kg, attachments })
}

fn attachment(engine: &Engine, set: &ModeSet, slope: Slope) -> Result<Attachment, Error> {
    let grid = |name: &str| {
        set.grid(name).ok_or_else(|| Error::MissingGrid {
            engine: engine.path(),
            grid: name.to_owned(),
            time_s: set.flight_time_s,
        })
    };
    let gimbal = grid(&engine.gimbal_grid)?;
    let shape: Vec<Vector3<f64>> = set.modes.iter().map(|mode| mode.shape[gimbal]).collect();
    let slope = match slope {
        Slope::SingleGrid => set.modes.iter().map(|mode| mode.slope[gimbal]).collect(),
        Slope::VirtualGrid => {
            let [first, second] = &engine.actuators;
            let virtual_grid = VirtualGrid::new(&Geometry {
                attach_m: Matrix3x2::from_columns(&[first.attach_m, second.attach_m]),
                action_line: Matrix3x2::from_columns(&[first.action_line, second.action_line]),
            })
            .map_err(|source| Error::Degenerate { engine: engine.path(), source })?;
            let at = [grid(&first.attach_grid)?, grid(&second.attach_grid)?];
            let slope_of = |mode: &crate::vehicle::Mode| {
                virtual_grid.slope(&mode.shape[gimbal], [&mode.shape[at[0]], &mode.shape[at[1]]])
            };
            set.modes.iter().map(slope_of).collect()
        }
    };
    Ok(Attachment {
        thrust_direction: engine.thrust_direction,
        axes: engine.axes,
        shape,
        slope,
        case_per_flow: case(engine, set, grid)?,
        in_modes: engine.in_modes,
        actuators: 0,
    })
}

/// Case jet damping per unit flow over the engine's centreline stations; empty without a case.
fn case(
    engine: &Engine,
    set: &ModeSet,
    grid: impl Fn(&str) -> Result<usize, Error>,
) -> Result<Vec<f64>, Error> {
    let at: Vec<usize> =
        engine.case_stations.iter().map(|name| grid(name)).collect::<Result<_, _>>()?;
    let Some(&head) = at.first() else {
        return Ok(Vec::new());
    };
    let stations: Vec<Station> = at
        .iter()
        .map(|&station| Station {
            x_m: set.grids[station].position_m.x - set.grids[head].position_m.x,
            shape: set.modes.iter().map(|mode| mode.shape[station]).collect(),
            slope: set.modes.iter().map(|mode| mode.slope[station]).collect(),
        })
        .collect();
    Ok(case_per_flow(&stations))
}
