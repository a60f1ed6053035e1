//! From a vehicle to its plant at one flight time: layout, attached masses and case jet damping.
//!
//! What a draw changes enters later, in `draw`.

use super::definition::{Slope, Variant};
use crate::dynamics::aerodynamics::{AerodynamicPlant, Entry};
use crate::dynamics::attached::rigid_motion;
use crate::dynamics::jet_damping::{Station, case_per_flow};
use crate::dynamics::virtual_grid::{Geometry, VirtualGrid};
use crate::dynamics::{Attachment, Feedback, Layout, Plant, Servo, TankAttachment, servo};
use crate::vehicle::motor::interpolate;
use crate::vehicle::{Aerodynamics, Engine, Mode, ModeSet, Tank, Vehicle};
use nalgebra::{Matrix3x2, Vector3};

/// Why a vehicle has no plant at a flight time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A grid that an engine or tank names is not in the modal package at this time.
    #[error("{part}: grid `{grid}` is not in the modal package at {time_s} s")]
    MissingGrid {
        /// Path of the engine, or name of the tank.
        part: String,
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
    /// Actuators and autopilot cannot be connected.
    #[error("{0}")]
    Servo(#[from] servo::Error),
}

/// What of a vehicle is free to move and acts, as far as it decides the coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent<'a> {
    /// Gimbal slope.
    pub slope: Slope,
    /// Rigid translation and rotation.
    pub rigid_body: bool,
    /// Slosh masses.
    pub slosh: bool,
    /// Aerodynamic forces.
    pub aerodynamics: bool,
    /// What the autopilot does.
    pub feedback: Feedback,
    /// Set of actuators in the place of the engines' own.
    pub actuators: Option<&'a str>,
}

impl<'a> Extent<'a> {
    /// The extent of a variant.
    pub fn of(variant: &'a Variant) -> Self {
        let Variant { slope, rigid_body, slosh, aerodynamics, feedback, .. } = *variant;
        let actuators = variant.actuators.as_deref();
        Self { slope, rigid_body, slosh, aerodynamics, feedback, actuators }
    }
}

/// The plant of `vehicle` with the modes of `set`; `gimballed` says per engine whether it moves.
///
/// # Errors
/// See [`Error`].
pub fn plant(
    vehicle: &Vehicle,
    set: &ModeSet,
    gimballed: &[bool],
    extent: Extent<'_>,
) -> Result<Plant, Error> {
    let engines = vehicle.engines.iter().zip(gimballed).map(|(engine, &gimballed)| {
        let [first, second] = &engine.actuators;
        (engine.path(), [first.name.as_str(), second.name.as_str()], gimballed)
    });
    let mut layout = Layout::new(set.modes.iter().map(|mode| mode.label.as_str()), engines)
        .with_tanks(vehicle.tanks.iter().map(|tank| (tank.name.as_str(), extent.slosh)));
    if extent.rigid_body {
        layout = layout.with_rigid_body();
    }
    let attachments = (vehicle.engines.iter())
        .map(|engine| attachment(engine, set, extent))
        .collect::<Result<Vec<_>, _>>()?;
    let tanks = (vehicle.tanks.iter())
        .map(|tank| tank_attachment(tank, set, extent))
        .collect::<Result<Vec<_>, _>>()?;
    let air = vehicle.aerodynamics.as_ref().filter(|_| extent.aerodynamics);
    let aerodynamics = air.map(|air| aerodynamic_plant(air, set, &layout));
    let servo = Servo::new(vehicle, set, gimballed, extent.feedback, extent.actuators)?;
    let layout =
        layout.with_states(if servo.is_active() { servo.states().to_vec() } else { Vec::new() });
    Ok(Plant { layout, body: set.body, attachments, tanks, aerodynamics, servo: Some(servo) })
}

/// Translation and rotation of a point of the body per body coordinate: the rigid columns where the
/// rigid body is free, then those of each mode.
fn body_motion<'a>(
    set: &'a ModeSet,
    rigid_body: bool,
    position_m: &Vector3<f64>,
    of_mode: impl Fn(&'a Mode) -> (Vector3<f64>, Vector3<f64>),
) -> (Vec<Vector3<f64>>, Vec<Vector3<f64>>) {
    let rigid = rigid_motion(&(position_m - set.body.cg_m));
    let rigid = rigid.into_iter().filter(|_| rigid_body);
    rigid.chain(set.modes.iter().map(of_mode)).unzip()
}

fn tank_attachment(
    tank: &Tank,
    set: &ModeSet,
    extent: Extent<'_>,
) -> Result<TankAttachment, Error> {
    let grid = set.grid(&tank.grid).ok_or_else(|| Error::MissingGrid {
        part: format!("tank {}", tank.name),
        grid: tank.grid.clone(),
        time_s: set.flight_time_s,
    })?;
    let position = &set.grids[grid].position_m;
    let (shape, slope) =
        body_motion(set, extent.rigid_body, position, |mode| (mode.shape[grid], mode.slope[grid]));
    Ok(TankAttachment { axes: tank.axes, shape, slope, in_modes: tank.in_modes })
}

/// Aerodynamics at the flight time of `set`; coordinates of the generalised matrices that the layout
/// does not have (the rigid body being off) are left out.
fn aerodynamic_plant(air: &Aerodynamics, set: &ModeSet, layout: &Layout) -> AerodynamicPlant {
    let time_s = set.flight_time_s;
    let at = |name: &String| layout.position(name).or_else(|| layout.find(name));
    let given = air.generalised.iter().filter(|matrix| matrix.flight_time_s == time_s);
    let entries = given.flat_map(|matrix| {
        let names = || matrix.coordinates.iter().enumerate();
        names().flat_map(move |(i, row)| {
            names().filter_map(move |(j, column)| {
                Some(Entry {
                    row: at(row)?,
                    column: at(column)?,
                    stiffness: matrix.stiffness[i][j],
                    damping: matrix.damping[i][j],
                })
            })
        })
    });
    AerodynamicPlant {
        reference_m: set.body.cg_m,
        area_m2: air.area_m2,
        length_m: air.length_m,
        speed_m_s: interpolate(&air.time_s, &air.speed_m_s, time_s),
        entries: entries.collect(),
    }
}

fn attachment(engine: &Engine, set: &ModeSet, extent: Extent<'_>) -> Result<Attachment, Error> {
    let grid = |name: &str| {
        set.grid(name).ok_or_else(|| Error::MissingGrid {
            part: engine.path(),
            grid: name.to_owned(),
            time_s: set.flight_time_s,
        })
    };
    let gimbal = grid(&engine.gimbal_grid)?;
    let virtual_grid = match extent.slope {
        Slope::SingleGrid => None,
        Slope::VirtualGrid => {
            let [first, second] = &engine.actuators;
            let virtual_grid = VirtualGrid::new(&Geometry {
                attach_m: Matrix3x2::from_columns(&[first.attach_m, second.attach_m]),
                action_line: Matrix3x2::from_columns(&[first.action_line, second.action_line]),
            })
            .map_err(|source| Error::Degenerate { engine: engine.path(), source })?;
            Some((virtual_grid, [grid(&first.attach_grid)?, grid(&second.attach_grid)?]))
        }
    };
    let position = &set.grids[gimbal].position_m;
    let (shape, slope) = body_motion(set, extent.rigid_body, position, |mode| {
        let slope = match &virtual_grid {
            None => mode.slope[gimbal],
            Some((grid, at)) => grid.slope(&mode.shape[gimbal], at.map(|at| &mode.shape[at])),
        };
        (mode.shape[gimbal], slope)
    });
    Ok(Attachment {
        thrust_direction: engine.thrust_direction,
        axes: engine.axes,
        shape,
        slope,
        case_per_flow: case(engine, set, extent.rigid_body, grid)?,
        in_modes: engine.in_modes,
        actuators: engine.set(extent.actuators),
    })
}

/// Case jet damping per unit flow over the engine's centreline stations; empty without a case.
fn case(
    engine: &Engine,
    set: &ModeSet,
    rigid_body: bool,
    grid: impl Fn(&str) -> Result<usize, Error>,
) -> Result<Vec<f64>, Error> {
    let at: Vec<usize> =
        engine.case_stations.iter().map(|name| grid(name)).collect::<Result<_, _>>()?;
    let Some(&head) = at.first() else {
        return Ok(Vec::new());
    };
    let stations: Vec<Station> = at
        .iter()
        .map(|&station| {
            let position = set.grids[station].position_m;
            let (shape, slope) = body_motion(set, rigid_body, &position, |mode| {
                (mode.shape[station], mode.slope[station])
            });
            Station { x_m: position.x - set.grids[head].position_m.x, shape, slope }
        })
        .collect();
    Ok(case_per_flow(&stations))
}
