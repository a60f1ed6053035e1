//! The autopilot: from its tables in the vehicle file to validated values.
//!
//! Types and ranges of single values are checked before, by `table`.

use super::autopilot_file::{
    AllocationFile, AutopilotFile, AxisFile, FilterFile, PathFile, SensorKindFile,
};
use super::table::Findings;
use super::{names, pattern};
use crate::dynamics::interconnection::{Block, Interconnection};
use crate::spelling::allowed_instead;
use crate::vehicle::{
    Allocation, Autopilot, Axis, Engine, Filter, FilterKind, ModeSet, Path, Sensor, SensorKind,
    StateSpace, Tank, TransferFunction, autopilot,
};
use nalgebra::{Complex, DMatrix, Vector3};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Checks what the values of `file` mean together, with the engines and tanks of the vehicle (`None` where
/// one could not be resolved) and the modes at its flight times (none without modal data).
pub fn resolve(
    file: &AutopilotFile,
    body: Option<(&[Engine], &[Tank])>,
    sets: &[&ModeSet],
    findings: &mut Findings,
) -> Option<Autopilot> {
    let sensors = sensors(file, sets, findings);
    names::unique(findings, "autopilot.path", file.path.iter().map(|p| p.name.as_str()));
    let known: Vec<String> = (sensors.iter())
        .flat_map(|sensor| Axis::ALL.map(|axis| sensor.signal(axis)))
        .chain(file.path.iter().map(|path| format!("path.{}", path.name)))
        .collect();
    let paths: Vec<Option<Path>> = (file.path.iter().enumerate())
        .map(|(i, path)| self::path(file, &format!("autopilot.path[{i}]"), path, &known, findings))
        .collect();
    let paths: Option<Vec<Path>> = paths.into_iter().collect();
    if let Some(paths) = &paths {
        unread(paths, findings);
        if !algebraic_loops(paths, findings) {
            unstable_loops(paths, findings);
        }
    }
    let allocation = body.and_then(|body| allocation(&file.allocation, body, sets, findings));
    Some(Autopilot {
        delay_s: file.delay_s,
        delay_order: file.delay_order as usize,
        sensors,
        paths: paths?,
        allocation: allocation?,
    })
}

fn sensors(file: &AutopilotFile, sets: &[&ModeSet], findings: &mut Findings) -> Vec<Sensor> {
    names::unique(findings, "autopilot.sensor", file.sensor.iter().map(|s| s.name.as_str()));
    for (i, sensor) in file.sensor.iter().enumerate() {
        let key = format!("autopilot.sensor[{i}]");
        names::word(findings, &format!("{key}.name"), &sensor.name);
        names::grid(findings, &format!("{key}.grid"), &sensor.grid, sets);
    }
    let sensor = |s: &super::autopilot_file::SensorFile| Sensor {
        name: s.name.clone(),
        kind: match s.kind {
            SensorKindFile::RateGyro => SensorKind::RateGyro,
            SensorKindFile::Attitude => SensorKind::Attitude,
        },
        grid: s.grid.clone(),
        scale: s.scale,
    };
    file.sensor.iter().map(sensor).collect()
}

fn path(
    autopilot: &AutopilotFile,
    key: &str,
    file: &PathFile,
    known: &[String],
    findings: &mut Findings,
) -> Option<Path> {
    names::word(findings, &format!("{key}.name"), &file.name);
    if file.input.is_empty() {
        findings.push(
            format!("{key}.input"),
            "an empty table",
            "at least one signal and its weight",
        );
    }
    for signal in file.input.keys().filter(|signal| !known.contains(signal)) {
        let allowed = allowed_instead(signal, known.iter().map(String::as_str));
        findings.push(format!("{key}.input"), format!("signal \"{signal}\""), allowed);
    }
    let filters: Vec<Option<Filter>> = (file.filter.iter().enumerate())
        .map(|(i, filter)| {
            let key = format!("{key}.filter[{i}]");
            let (name, kind) = kind(filter, autopilot.delay_order as usize, &key, findings);
            let name = name.clone().unwrap_or_else(|| (i + 1).to_string());
            names::word(findings, &format!("{key}.name"), &name);
            Some(Filter { name, kind: kind? })
        })
        .collect();
    let filters: Vec<Filter> = filters.into_iter().collect::<Option<_>>()?;
    names::unique(findings, &format!("{key}.filter"), filters.iter().map(|f| f.name.as_str()));
    Some(Path {
        name: file.name.clone(),
        input: file.input.iter().map(|(signal, weight)| (signal.clone(), *weight)).collect(),
        gain: file.gain,
        axis: file.axis.map(|axis| match axis {
            AxisFile::Roll => Axis::Roll,
            AxisFile::Pitch => Axis::Pitch,
            AxisFile::Yaw => Axis::Yaw,
        }),
        filters,
    })
}

fn kind<'a>(
    file: &'a FilterFile,
    delay_order: usize,
    key: &str,
    findings: &mut Findings,
) -> (&'a Option<String>, Option<FilterKind>) {
    let mut rational = |numerator: &[f64], denominator: &[f64]| {
        let function = match TransferFunction::new(numerator, denominator) {
            Ok(function) => function,
            Err(refusal) => {
                let allowed = "a proper transfer function: no more zeros than poles";
                findings.push(key, refusal.to_string(), allowed);
                return None;
            }
        };
        let poles = function.poles().unwrap_or_default();
        let at_zero = poles.iter().filter(|p| p.norm() == 0.0).count();
        // Poles at the origin are exact; all others must be left of it. (NaN is not.)
        let unstable = poles.iter().find(|p| p.norm() != 0.0 && !(p.re < 0.0));
        if poles.len() != function.order() || at_zero > 1 || unstable.is_some() {
            let found = match unstable {
                Some(pole) => format!("a pole at {pole} rad/s"),
                None => format!("{at_zero} poles at zero"),
            };
            let allowed = "poles in the open left half plane, and at most one at zero";
            findings.push(format!("{key}.denominator"), found, allowed);
            return None;
        }
        Some(FilterKind::Rational(Arc::new(function)))
    };
    match file {
        FilterFile::Gain { name, value } => (name, Some(FilterKind::Gain(*value))),
        FilterFile::Lag { name, frequency_hz } => {
            (name, Some(FilterKind::Lag { omega_rad_s: TAU * frequency_hz }))
        }
        FilterFile::LeadLag { name, zero_hz, pole_hz } => {
            let (zero_rad_s, pole_rad_s) = (TAU * zero_hz, TAU * pole_hz);
            (name, Some(FilterKind::LeadLag { zero_rad_s, pole_rad_s }))
        }
        FilterFile::Notch { name, frequency_hz, zero_damping, pole_damping } => {
            let kind = FilterKind::Bending {
                zero_rad_s: TAU * frequency_hz,
                zero_damping: *zero_damping,
                pole_rad_s: TAU * frequency_hz,
                pole_damping: *pole_damping,
            };
            (name, Some(kind))
        }
        FilterFile::Bending { name, zero_hz, zero_damping, pole_hz, pole_damping } => {
            let kind = FilterKind::Bending {
                zero_rad_s: TAU * zero_hz,
                zero_damping: *zero_damping,
                pole_rad_s: TAU * pole_hz,
                pole_damping: *pole_damping,
            };
            (name, Some(kind))
        }
        FilterFile::LowPass { name, frequency_hz, damping } => {
            let kind = FilterKind::LowPass { omega_rad_s: TAU * frequency_hz, damping: *damping };
            (name, Some(kind))
        }
        FilterFile::Section { name, numerator, denominator } => {
            (name, rational(numerator, denominator))
        }
        FilterFile::TransferFunction { name, numerator, denominator } => {
            (name, rational(numerator, denominator))
        }
        FilterFile::Integrator { name } => (name, Some(FilterKind::Integrator)),
        FilterFile::Delay { name, delay_s, order } => {
            let order = order.map_or(delay_order, |order| order as usize);
            (name, Some(FilterKind::Delay { delay_s: *delay_s, order }))
        }
    }
}

/// Every path ends in an axis or in another path.
fn unread(paths: &[Path], findings: &mut Findings) {
    for (i, path) in paths.iter().enumerate() {
        let read = |p: &Path| p.input.iter().any(|(signal, _)| *signal == path.signal());
        if path.axis.is_none() && !paths.iter().any(read) {
            let found = format!("path \"{}\" without an axis, which no path reads", path.name);
            findings.push(format!("autopilot.path[{i}].axis"), found, "roll, pitch or yaw");
        }
    }
}

/// Paths that read each other, in groups; those alone are considered that `counts` says.
fn loops(paths: &[Path], counts: impl Fn(&Path) -> bool) -> Vec<Vec<usize>> {
    let counts: Vec<bool> = paths.iter().map(counts).collect();
    let reads = |i: usize, j: usize| {
        let mut inputs = paths[i].input.iter();
        counts[i] && counts[j] && inputs.any(|(signal, _)| *signal == paths[j].signal())
    };
    let all = 0..paths.len();
    // Which path depends on which, over any number of others.
    let mut depends: Vec<Vec<bool>> =
        all.clone().map(|i| all.clone().map(|j| reads(i, j)).collect()).collect();
    for over in all.clone() {
        for i in all.clone().filter(|&i| i != over) {
            if depends[i][over] {
                let (from, to) = (depends[over].clone(), &mut depends[i]);
                to.iter_mut().zip(from).for_each(|(to, from)| *to |= from);
            }
        }
    }
    let group = |first: usize| -> Vec<usize> {
        all.clone().filter(|&j| depends[first][j] && depends[j][first]).collect()
    };
    let groups = all.clone().filter(|&i| depends[i][i]).map(|first| (first, group(first)));
    groups.filter(|(first, group)| group[0] == *first).map(|(_, group)| group).collect()
}

fn signals(paths: &[Path], group: &[usize]) -> String {
    group.iter().map(|&i| paths[i].signal()).collect::<Vec<_>>().join(", ")
}

/// Paths that read themselves without a filter between that has no direct feedthrough; whether there
/// are any.
fn algebraic_loops(paths: &[Path], findings: &mut Findings) -> bool {
    let direct = |path: &Path| {
        path.filters.iter().all(|f| f.kind.state_space(&f.kind.nominal()).d[(0, 0)] != 0.0)
    };
    let groups = loops(paths, direct);
    for group in &groups {
        let found = format!("an algebraic loop through {}", signals(paths, group));
        let allowed = "paths without a loop, or with a filter in it of more poles than zeros";
        findings.push(format!("autopilot.path[{}].input", group[0]), found, allowed);
    }
    !groups.is_empty()
}

/// Loops of paths that are unstable with all sensors at zero: like an unstable filter they would give
/// commands of their own, whatever the vehicle does.
fn unstable_loops(paths: &[Path], findings: &mut Findings) {
    for group in loops(paths, |_| true) {
        let mut blocks = Vec::new();
        let mut systems = Vec::new();
        for path in group.iter().map(|&i| &paths[i]) {
            let inside = |signal: &String| group.iter().any(|&j| paths[j].signal() == *signal);
            let (inputs, weights): (Vec<_>, Vec<_>) =
                path.input.iter().filter(|(signal, _)| inside(signal)).cloned().unzip();
            let weights = DMatrix::from_row_slice(1, weights.len(), &weights) * path.gain;
            let system = path.filters.iter().fold(StateSpace::gain(weights), |system, filter| {
                system.then(&filter.kind.state_space(&filter.kind.nominal()))
            });
            blocks.push(Block {
                name: path.name.clone(),
                inputs,
                outputs: vec![path.signal()],
                states: vec![path.name.clone(); system.order()],
            });
            systems.push(system);
        }
        let connected = Interconnection::new(&blocks, Vec::new(), Vec::new());
        let whole = connected.expect("signals of the group").compose(&systems);
        let poles = whole.as_ref().ok().and_then(|whole| whole.poles().zip(Some(&whole.a)));
        let found = match poles {
            // Computed eigenvalues are those of a matrix within a few n ε ‖A‖ of this one.
            Some((poles, a)) => poles
                .into_iter()
                .find(|pole| !(pole.re <= 8.0 * a.nrows() as f64 * f64::EPSILON * a.norm())),
            None => Some(Complex::new(f64::NAN, 0.0)),
        };
        if let Some(pole) = found {
            let place = match pole.re.is_nan() {
                true => "poles that cannot be found".to_owned(),
                false => format!("a pole at {pole} rad/s"),
            };
            let found = format!("a loop through {} with {place}", signals(paths, &group));
            let allowed = "loops of paths that are stable by themselves, all sensors at zero";
            findings.push(format!("autopilot.path[{}].input", group[0]), found, allowed);
        }
    }
}

fn allocation(
    file: &AllocationFile,
    body: (&[Engine], &[Tank]),
    sets: &[&ModeSet],
    findings: &mut Findings,
) -> Option<Allocation> {
    let engines = body.0;
    let all: Vec<((usize, usize), String)> = (engines.iter().enumerate())
        .flat_map(|(e, engine)| {
            [0, 1].map(|a| ((e, a), format!("{}.{}", engine.path(), engine.actuators[a].name)))
        })
        .collect();
    let mut good = true;
    for (i, entry) in file.gimbals.iter().enumerate() {
        if !all.iter().any(|(_, name)| pattern::matches(entry, name)) {
            let found = format!("\"{entry}\", which matches no gimbal");
            let allowed = allowed_instead(entry, all.iter().map(|(_, name)| name.as_str()));
            findings.push(format!("autopilot.allocation.gimbals[{i}]"), found, allowed);
            good = false;
        }
        let before = &file.gimbals[..i];
        let twice = all.iter().find(|(_, name)| {
            pattern::matches(entry, name)
                && before.iter().any(|other| pattern::matches(other, name))
        });
        if let Some((_, name)) = twice {
            let found = format!("\"{entry}\", which names {name} again");
            findings.push(format!("autopilot.allocation.gimbals[{i}]"), found, "each gimbal once");
            good = false;
        }
    }
    let chosen = |name: &str| file.gimbals.iter().any(|entry| pattern::matches(entry, name));
    let gimbals: Vec<(usize, usize)> =
        all.iter().filter(|(_, name)| chosen(name)).map(|(place, _)| *place).collect();
    if !good {
        return None;
    }
    if let (Some(_), Some(time)) = (&file.matrix, file.time_s) {
        let found = format!("{time} s beside `matrix`, which does not depend on it");
        findings.push("autopilot.allocation.time_s", found, "one of both");
        return None;
    }
    let matrix = match &file.matrix {
        Some(matrix) if matrix.len() == gimbals.len() => matrix.clone(),
        Some(matrix) => {
            let found = format!("{} rows", matrix.len());
            let names: Vec<&str> =
                all.iter().filter(|(_, n)| chosen(n)).map(|(_, n)| n.as_str()).collect();
            let allowed = format!("{}, a row each for {}", gimbals.len(), names.join(", "));
            findings.push("autopilot.allocation.matrix", found, allowed);
            return None;
        }
        None => derived(file, &gimbals, body, sets, findings)?,
    };
    Some(Allocation { gimbals, matrix })
}

/// The allocation by least squares.
fn derived(
    file: &AllocationFile,
    gimbals: &[(usize, usize)],
    (engines, tanks): (&[Engine], &[Tank]),
    sets: &[&ModeSet],
    findings: &mut Findings,
) -> Option<Vec<[f64; 3]>> {
    let set = match file.time_s {
        None => *sets.first()?,
        Some(time) => {
            let found = sets.iter().find(|set| set.flight_time_s == time);
            if found.is_none() && !sets.is_empty() {
                let known: Vec<f64> = sets.iter().map(|set| set.flight_time_s).collect();
                let allowed = format!("a flight time of the vehicle, one of {known:?} s");
                findings.push("autopilot.allocation.time_s", format!("{time} s"), allowed);
            }
            found?
        }
    };
    let place = |grid: &str| set.grid(grid).map(|index| set.grids[index].position_m);
    let mut mass = set.body.mass_kg;
    let mut moment = set.body.cg_m * mass;
    for engine in engines.iter().filter(|engine| !engine.in_modes) {
        let cg = place(&engine.gimbal_grid)? - engine.thrust_direction * engine.nozzle.cg_m;
        mass += engine.nozzle.mass_kg;
        moment += cg * engine.nozzle.mass_kg;
    }
    for tank in tanks.iter().filter(|tank| !tank.in_modes) {
        let slosh = tank.mass_kg(set.flight_time_s);
        mass += slosh;
        moment += place(&tank.grid)? * slosh;
    }
    let cg = moment / mass;
    let moments: Vec<Vector3<f64>> = (gimbals.iter())
        .map(|&(e, axis)| {
            let engine = &engines[e];
            let turned = engine.axes.column(axis).cross(&engine.thrust_direction);
            let thrust = engine.motor.thrust_at(set.flight_time_s);
            Some((place(&engine.gimbal_grid)? - cg).cross(&(turned * thrust)))
        })
        .collect::<Option<_>>()?;
    let matrix = autopilot::least_squares(&moments);
    if matrix.is_none() {
        let found =
            format!("{} gimbals that do not turn the vehicle about three axes", gimbals.len());
        let allowed = "gimbals with authority in roll, pitch and yaw, or a `matrix`";
        findings.push("autopilot.allocation.gimbals", found, allowed);
    }
    matrix
}

#[cfg(test)]
mod tests;
