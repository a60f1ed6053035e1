//! Worst cases on disk: a folder below the run's `worst` with what a search found, and the sample's own
//! objectives read from the run's tables.
//!
//! How they are found is decided in `campaign::worst`.

use super::run::Run;
use super::schema::TableName;
use super::stored::POLE_COLUMNS;
use super::{files, folder};
use crate::campaign::worst::{Aim, Method, Quantity, WorstCase};
use crate::gate::{self, Query, Searched};
use crate::problem::{Kind, Problems};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Folder inside the run's; each search has its own inside that.
pub const FOLDER: &str = "worst";
/// File with all that a search found.
const FILE: &str = "worst.json";

/// What a search found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// Identity of the run's outline.
    pub run: String,
    /// What was made least.
    pub aim: Aim,
    /// Indices of the flight times that were searched, in ascending order.
    pub flight_times: Vec<usize>,
    /// Half width of the box, σ.
    pub box_sigma: f64,
    /// Radius of the ellipsoid, σ.
    pub radius_sigma: f64,
    /// The cases.
    pub cases: Vec<WorstCase>,
}

/// Writes a search into the folder `target`, with `texts` (names and contents) beside it; an older one is
/// replaced.
///
/// # Errors
/// Input: the folder holds anything else, or cannot be written.
pub fn write(
    target: &Path,
    found: &Found,
    texts: Vec<(&str, String)>,
) -> Result<Vec<PathBuf>, Problems> {
    let json = serde_json::to_string_pretty(found).expect("numbers and names");
    let mut all = vec![(PathBuf::from(FILE), (json + "\n").into_bytes())];
    all.extend(texts.into_iter().map(|(name, text)| (PathBuf::from(name), text.into_bytes())));
    folder::write(target, &all, Some(FILE).filter(|_| target.exists()), &[])?;
    Ok(all.into_iter().map(|(name, _)| target.join(name)).collect())
}

/// Every search below the folder of a run.
///
/// # Errors
/// Damage: a file that cannot be understood or belongs to another run.
pub fn read(run: &Path, identity: &str) -> Result<Vec<Found>, Problems> {
    let folder = run.join(FOLDER);
    let mut all = Vec::new();
    if !folder.is_dir() {
        return Ok(all);
    }
    for name in files::names(&folder)? {
        let path = folder.join(name).join(FILE);
        if !path.is_file() {
            continue;
        }
        let mut problems = Problems::default();
        let place = files::name(&path);
        match serde_json::from_str::<Found>(&files::read_text(&path)?) {
            Ok(found) if found.run == identity => all.push(found),
            Ok(found) => problems.push(Kind::Damage, place, "run", found.run, identity),
            Err(error) => {
                problems.push(Kind::Damage, place, "", error.to_string(), "what tvse worst wrote");
            }
        }
        problems.into_result(())?;
    }
    Ok(all)
}

/// The worst case that the searches of a run found for a gate: in a region of `sigma`, in the variant, over the
/// baseline and for the modes of the query, at just its flight times. `None` where one is not there.
///
/// # Errors
/// Damage: a file that cannot be understood or belongs to another run.
pub fn searched(
    run: &Run,
    query: &Query<'_>,
    region: gate::Region,
    sigma: f64,
) -> Result<Option<Searched>, Problems> {
    let outline = run.outline();
    let definition = &outline.definition;
    let variant =
        |name: Option<&str>| definition.variants.iter().position(|v| Some(v.name.as_str()) == name);
    let times = definition.flight_times_s.iter().enumerate();
    let chosen =
        times.filter(|(_, time)| query.flight_times_s.is_none_or(|all| all.contains(time)));
    let flight_times: Vec<usize> = chosen.map(|(index, _)| index).collect();
    let quantity = match query.metric.name.as_str() {
        "damping_ratio" => Quantity::DampingRatio,
        _ => Quantity::Decay,
    };
    let in_region = |method: Method| match region {
        gate::Region::Box => matches!(method, Method::Vertex | Method::Corners | Method::Box),
        gate::Region::Ellipsoid => method == Method::Ellipsoid,
    };
    // Of a decay −Re s the metric is the time to double, which grows with it below zero.
    let metric = |objective: f64| match quantity {
        Quantity::DampingRatio => Some(objective),
        Quantity::Decay => (objective < 0.0).then(|| std::f64::consts::LN_2 / -objective),
    };
    let all = read(run.folder(), &outline.identity())?;
    let mut cases: Vec<&WorstCase> = Vec::new();
    for (mode, name) in definition.modes.iter().enumerate() {
        if query.mode.is_some_and(|wanted| wanted != name) {
            continue;
        }
        let (here, baseline) = (variant(query.variant), variant(query.baseline));
        let aim = here.map(|variant| Aim { variant, baseline, mode, quantity });
        let size = |found: &Found| match region {
            gate::Region::Box => found.box_sigma,
            gate::Region::Ellipsoid => found.radius_sigma,
        };
        let search = all.iter().find(|found| {
            Some(found.aim) == aim && found.flight_times == flight_times && size(found) == sigma
        });
        let Some(search) = search else { return Ok(None) };
        let before = cases.len();
        cases.extend(search.cases.iter().filter(|case| in_region(case.method)));
        if cases.len() == before {
            return Ok(None);
        }
    }
    let least = |of: &dyn Fn(&WorstCase) -> f64| {
        cases
            .iter()
            .min_by(|a, b| of(a).total_cmp(&of(b)))
            .map(|case| (case.name.clone(), of(case)))
    };
    let Some((name, worst)) = least(&|case| case.objective) else { return Ok(None) };
    let left = least(&|case| case.objective - case.gap.unwrap_or(0.0));
    Ok(Some(Searched {
        name,
        value: metric(worst),
        at_worst: metric(left.map_or(worst, |(_, left)| left)),
        cases: cases.len() as u64,
    }))
}

/// A case of the sample, reduced to its worst flight time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleCase {
    /// Case index.
    pub case: u64,
    /// Index of the flight time.
    pub flight_time: usize,
    /// The objective.
    pub value: f64,
    /// The less stable pole there, rad/s.
    pub pole: Complex<f64>,
}

/// The objective of every case of a population at its worst of some flight times, worst first; a case
/// without a result at one of them is left out.
///
/// # Errors
/// Damage in the tables.
pub fn sample(
    run: &Run,
    population: usize,
    aim: &Aim,
    flight_times: &[usize],
) -> Result<Vec<SampleCase>, Problems> {
    let definition = &run.outline().definition;
    let cases = definition.populations[population].cases;
    let sides = [Some(aim.variant), aim.baseline];
    let of = |pole: Complex<f64>| aim.quantity.of(pole);
    // Less stable pole at each flight time, in the variant and in the baseline.
    type Poles = Vec<[Option<Complex<f64>>; 2]>;
    let empty: Poles = vec![[None; 2]; definition.flight_times_s.len()];
    let mut found = Vec::new();
    let mut finish = |case: u64, poles: &Poles| {
        let at = |&time: &usize| {
            let [pole, baseline] = poles[time];
            let over = if aim.baseline.is_some() { of(baseline?) } else { 0.0 };
            Some(SampleCase { case, flight_time: time, value: of(pole?) - over, pole: pole? })
        };
        let all: Option<Vec<SampleCase>> = flight_times.iter().map(at).collect();
        let worst = all.into_iter().flatten().min_by(|a, b| a.value.total_cmp(&b.value));
        found.extend(worst.filter(|worst| worst.value.is_finite()));
    };
    let mut now: Option<(u64, Poles)> = None;
    let chosen = |name: &str| POLE_COLUMNS.contains(&name);
    run.batches(TableName::Modes, chosen, population, &(0..cases), |batch| {
        for row in run.pole_rows(batch)? {
            if now.as_ref().is_none_or(|(case, _)| *case != row.case)
                && let Some((case, poles)) = now.replace((row.case, empty.clone()))
            {
                finish(case, &poles);
            }
            let Some((_, poles)) = &mut now else { continue };
            let Some(pole) = row.pole.filter(|_| row.mode == aim.mode) else { continue };
            for (side, variant) in sides.iter().enumerate() {
                if *variant == Some(row.variant) {
                    let least = &mut poles[row.flight_time][side];
                    if least.is_none_or(|least| of(pole) < of(least)) {
                        *least = Some(pole);
                    }
                }
            }
        }
        Ok(())
    })?;
    if let Some((case, poles)) = now {
        finish(case, &poles);
    }
    found.sort_by(|a, b| a.value.total_cmp(&b.value).then(a.case.cmp(&b.case)));
    Ok(found)
}
