//! The evaluator of cases: everything that no draw changes is prepared once, then each case is a
//! function of its population and index alone.
//!
//! It stores nothing and knows no files; `pool` runs it in parallel.

use super::definition;
use super::derivative::Place;
use super::draw::Slots;
use super::loops::{Loops, OpenLoop};
use super::plant::Extent;
use super::record::{Certificate, Solution};
use super::{
    Branch, Definition, Evaluation, Failure, FailureKind, Pole, Population, Record, Variant,
};
use crate::dispersion::{Affine, Chain, Cursor, Dispersion, Draws, Sampler};
use crate::dynamics::{DrawnVehicle, Effects, Model, Part, Plant};
use crate::margins::Assessment;
use crate::modal::identify::{self, Solved};
use crate::modal::spectrum::{Base, Bounded, Spectrum};
use crate::modal::{self, Reference, Solver, eigen};
use crate::vehicle::Vehicle;
use nalgebra::Complex;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// Largest relative residual of an eigenpair, in units of n ε: elimination with partial pivoting is
/// backward stable to n ε times the growth of its pivots, for which this leaves room. (The reference
/// run stays below 1e-3: see the column `residual`.)
const RESIDUAL_FACTOR: f64 = 1e3;

/// Why an evaluator could not be prepared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// The sampler has another scheme than a population of the run.
    #[error("the cases of population `{0}` come from another plan than the sampler's")]
    Unplanned(String),
    /// A flight time of the run is not in the modal package.
    #[error("the modal package has no flight time {0} s")]
    MissingTime(f64),
    /// A mode of interest has no label at a flight time.
    #[error("mode `{mode}` has no label at {time_s} s")]
    MissingMode {
        /// Name of the mode.
        mode: String,
        /// Flight time, s.
        time_s: f64,
    },
    /// The geometry of an engine is not usable.
    #[error("{0}")]
    Plant(#[from] super::plant::Error),
    /// The nominal vehicle is impossible.
    #[error("the nominal vehicle at {time_s} s: {failure}")]
    Nominal {
        /// Flight time, s.
        time_s: f64,
        /// Why.
        failure: Failure,
    },
    /// The nominal pole of a mode could not be reached by continuation.
    #[error("mode `{mode}` at {time_s} s, variant `{variant}`: {lost}")]
    Lost {
        /// Name of the mode.
        mode: String,
        /// Flight time, s.
        time_s: f64,
        /// Name of the variant.
        variant: String,
        /// Why.
        lost: identify::Lost,
    },
}

/// One variant at one flight time.
pub struct AtVariant {
    /// Index of the plant among those of the flight time.
    plant: usize,
    /// What acts.
    effects: Effects,
    /// Model of the nominal vehicle.
    pub nominal: Model,
    /// Nominal pole of every mode of interest.
    pub references: Vec<Reference>,
    /// Every nominal pole, from which those of cases are found.
    base: Option<Base>,
    /// The flight control loops, where they are assessed.
    loops: Option<OpenLoop>,
}

/// What is prepared at one flight time.
pub struct AtTime {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// One plant per kind of gimbal slope in use.
    plants: Vec<Plant>,
    /// From draws to the drawn vehicle.
    slots: Slots,
    /// The nominal vehicle.
    nominal: DrawnVehicle,
    /// Label of every mode of interest.
    pub labels: Vec<String>,
    /// Variants, in the order of the definition.
    pub variants: Vec<AtVariant>,
}

impl AtTime {
    /// The plant that a variant uses.
    pub fn plant(&self, variant: usize) -> &Plant {
        &self.plants[self.variants[variant].plant]
    }
}

/// Buffers of one worker.
struct Workspace<'a> {
    buffers: Vec<Buffers>,
    cursor: Cursor<'a>,
    vehicle: DrawnVehicle,
    poles: Vec<Complex<f64>>,
}

/// Buffers for models of one size.
pub(super) struct Buffers {
    pub(super) model: Model,
    scratch: Model,
    pub(super) solver: Solver,
    spectrum: Spectrum,
    /// Proven bounds of the poles, rad/s; none where they were solved densely.
    bounds: Vec<f64>,
    /// Number of poles of the model, conjugates included, whether all were asked for or not.
    degree: usize,
    /// Guesses of the poles of the modes of interest.
    guesses: Vec<Complex<f64>>,
}

impl Buffers {
    /// The buffers for models of `size` coordinates, made when first needed.
    fn of(all: &mut Vec<Self>, size: usize) -> &mut Self {
        let known = all.iter().position(|buffers| buffers.model.coordinates() == size);
        let index = known.unwrap_or_else(|| {
            let (model, scratch) = (Model::zeros(size), Model::zeros(size));
            let (solver, spectrum) = (Solver::new(size), Spectrum::new());
            all.push(Self {
                model,
                scratch,
                solver,
                spectrum,
                bounds: Vec::new(),
                degree: 0,
                guesses: Vec::new(),
            });
            all.len() - 1
        });
        &mut all[index]
    }
}

/// A pole of a mode at chosen values, see [`Evaluator::follow`].
#[derive(Debug, Clone)]
pub struct Followed {
    /// The pole as a record has it.
    pub pole: Pole,
    /// The pole with its vectors.
    pub reference: Reference,
    /// Its derivative by the independent score of every draw, rad/s; empty where not asked for.
    pub by_score: Vec<Option<Complex<f64>>>,
}

/// One evaluation as it is made: the model and what was found in it.
pub struct View<'a> {
    /// Plant of the evaluation.
    pub plant: &'a Plant,
    /// The drawn vehicle; meaningless where the draw failed.
    pub drawn: &'a DrawnVehicle,
    /// Model of the evaluation; meaningless where the draw failed.
    pub model: &'a Model,
    /// What was found.
    pub evaluation: &'a Evaluation,
}

/// Evaluates the cases of one run.
pub struct Evaluator<'a> {
    definition: &'a Definition,
    sampler: &'a Sampler<'a>,
    vehicle: &'a Vehicle,
    /// Flight times, in the order of the definition.
    pub times: Vec<AtTime>,
    all_poles: bool,
    /// Per parameter, whether a draw acts on it.
    acts: Vec<bool>,
    /// Per engine, whether a draw acts on one of its parameters.
    acts_on_engine: Vec<bool>,
    workspaces: Mutex<Vec<Workspace<'a>>>,
}

impl<'a> Evaluator<'a> {
    /// Prepares the evaluation of `definition` on `vehicle` with the draws of `dispersion`: plants,
    /// nominal models, and the nominal pole of every mode of interest by continuation.
    ///
    /// With `all_poles`, records hold every pole, not only those of the modes of interest.
    ///
    /// # Errors
    /// See [`Error`].
    pub fn new(
        vehicle: &'a Vehicle,
        sampler: &'a Sampler<'a>,
        definition: &'a Definition,
        all_poles: bool,
    ) -> Result<Self, Error> {
        let planned = |p: &&Population| !p.scheme.is_monte_carlo() && p.scheme != *sampler.scheme();
        if let Some(population) = definition.populations.iter().find(planned) {
            return Err(Error::Unplanned(population.name.clone()));
        }
        let times = definition
            .flight_times_s
            .par_iter()
            .map(|&time_s| at_time(vehicle, sampler.dispersion(), definition, time_s))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            definition,
            sampler,
            vehicle,
            times,
            all_poles,
            acts: sampler.dispersion().acts(),
            acts_on_engine: sampler.dispersion().acts_on_engines(vehicle.engines.len()),
            workspaces: Mutex::new(Vec::new()),
        })
    }

    /// The record of one case; a function of the population and the index alone.
    pub fn evaluate(&self, population: usize, case: u64) -> Record {
        self.visit(population, case, |_| ())
    }

    /// Like [`Evaluator::evaluate`], showing every evaluation with its model to `look`.
    pub fn visit(&self, population: usize, case: u64, mut look: impl FnMut(&View<'_>)) -> Record {
        let mut workspace = self.take();
        let Workspace { buffers: all_buffers, cursor, vehicle, poles } = &mut workspace;
        let draws = self.draws(cursor, population, case);
        let fixed = &self.definition.populations[population].fixed;
        let sensitivity = self.definition.sensitivity.as_ref();
        let sensitivity = sensitivity.filter(|rule| rule.cases.is_none_or(|cases| case < cases));
        let chain = sensitivity.map(|_| self.sampler.dispersion().chain(draws, fixed));
        let chain = chain.unwrap_or_default();
        let mut evaluations = Vec::new();
        for (flight_time, at) in self.times.iter().enumerate() {
            let parameters = self.sampler.dispersion().parameters();
            let drawn = at.slots.draw(self.vehicle, parameters, &draws.effects, vehicle);
            for variant in 0..at.variants.len() {
                let plant = at.plant(variant);
                let buffers = Buffers::of(all_buffers, plant.layout.coordinates());
                let sensitive =
                    sensitivity.is_some_and(|rule| rule.covers(variant, flight_time, case));
                let place = self.place(at, variant, draws, &chain, vehicle);
                let mut solution = None;
                let mut at_origin = 0;
                let outcome = drawn.clone().and_then(|()| {
                    let (rows, found) =
                        self.solve(at, &place, (variant, sensitive), buffers, poles)?;
                    solution = Some(found);
                    at_origin = buffers.model.states() - buffers.degree;
                    Ok(rows)
                });
                let null_poles = buffers.model.null_states.len() + at_origin;
                let loops = None;
                let mut evaluation =
                    Evaluation { variant, flight_time, null_poles, solution, outcome, loops };
                let model = &buffers.model;
                look(&View { plant, drawn: vehicle, model, evaluation: &evaluation });
                evaluation.loops = self.loops(at, variant, &drawn, vehicle, all_buffers, poles);
                evaluations.push(evaluation);
            }
        }
        let (values, scores) = (draws.values.clone(), draws.scores.clone());
        self.workspaces.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
        Record { population, case, values, scores, evaluations }
    }

    /// The draws of a case.
    fn draws<'b>(&self, cursor: &'b mut Cursor<'_>, population: usize, case: u64) -> &'b Draws {
        let rule = &self.definition.populations[population];
        if rule.scheme.is_monte_carlo() {
            cursor.draw(case, &rule.fixed, rule.drawn)
        } else {
            cursor.draw_planned(case)
        }
    }

    /// The loops of a drawn vehicle in a variant, where they are assessed; `poles` are those of the
    /// variant, if it was solved.
    fn loops(
        &self,
        at: &AtTime,
        variant: usize,
        drawn: &Result<(), Failure>,
        vehicle: &DrawnVehicle,
        buffers: &mut Vec<Buffers>,
        poles: &[Complex<f64>],
    ) -> Option<Result<Loops, Failure>> {
        let (open, plan) =
            (at.variants[variant].loops.as_ref()?, self.definition.margins.as_ref()?);
        let buffers = Buffers::of(buffers, open.coordinates());
        let found = drawn
            .clone()
            .and_then(|()| open.assess(vehicle, buffers, poles, plan, &plan.envelope_hz));
        Some(found.map(|found| open.store(&found, buffers, plan)))
    }

    /// Assesses the loops of one case at a flight time and in a variant (indices of the definition), with
    /// its whole curve; none where the run does not assess them.
    ///
    /// # Errors
    /// An impossible draw, or loops that cannot be followed.
    pub fn assess(
        &self,
        population: usize,
        case: u64,
        flight_time: usize,
        variant: usize,
    ) -> Result<Option<Assessment>, Failure> {
        let at = &self.times[flight_time];
        let (Some(open), Some(plan)) = (&at.variants[variant].loops, &self.definition.margins)
        else {
            return Ok(None);
        };
        let mut workspace = self.take();
        let Workspace { buffers, cursor, vehicle, poles } = &mut workspace;
        let draws = self.draws(cursor, population, case);
        let parameters = self.sampler.dispersion().parameters();
        at.slots.draw(self.vehicle, parameters, &draws.effects, vehicle)?;
        // The poles about which the grid is refined, as in the run.
        let closed = Buffers::of(buffers, at.plant(variant).layout.coordinates());
        let chain = Chain::default();
        let place = self.place(at, variant, draws, &chain, vehicle);
        if self.solve(at, &place, (variant, false), closed, poles).is_err() {
            poles.clear();
        }
        let buffers = Buffers::of(buffers, open.coordinates());
        open.assess(vehicle, buffers, poles, plan, &plan.envelope_hz).map(Some)
    }

    /// Builds the model of the nominal vehicle at a flight time and in a variant (indices of the
    /// definition) into `model`, which has the size of its plant.
    pub fn assemble(&self, flight_time: usize, variant: usize, model: &mut Model) {
        let at = &self.times[flight_time];
        at.plant(variant).assemble(&at.nominal, &at.variants[variant].effects, model);
    }

    /// Where derivatives of a case are taken.
    fn place<'p>(
        &'p self,
        at: &'p AtTime,
        variant: usize,
        draws: &'p Draws,
        chain: &'p Chain<'p>,
        drawn: &'p DrawnVehicle,
    ) -> Place<'p> {
        Place {
            vehicle: self.vehicle,
            parameters: self.sampler.dispersion().parameters(),
            acts: &self.acts,
            engines: &self.acts_on_engine,
            slots: &at.slots,
            plant: at.plant(variant),
            effects: &at.variants[variant].effects,
            draws: &draws.effects,
            chain,
            drawn,
        }
    }

    /// The poles of a mode of interest (its index) with draws at `values` (index and value; all others
    /// nominal), at a flight time and in a variant (indices of the definition): the primary one, and the
    /// partner if there is one, each with its derivative by the independent score of every draw if asked
    /// for. Values do not hold a key against its common score: all move with their scores.
    ///
    /// # Errors
    /// As an evaluation fails.
    pub fn follow(
        &self,
        values: &[(usize, f64)],
        [flight_time, variant, mode]: [usize; 3],
        derivatives: bool,
    ) -> Result<Vec<Followed>, Failure> {
        let mut workspace = self.take();
        let Workspace { buffers, cursor, vehicle, poles } = &mut workspace;
        let draws = cursor.draw(0, values, false);
        let at = &self.times[flight_time];
        let parameters = self.sampler.dispersion().parameters();
        let drawn = at.slots.draw(self.vehicle, parameters, &draws.effects, vehicle);
        let found = drawn.and_then(|()| {
            let chain = derivatives.then(|| self.sampler.dispersion().chain(draws, &[]));
            let chain = chain.unwrap_or_default();
            let place = self.place(at, variant, draws, &chain, vehicle);
            let buffers = Buffers::of(buffers, place.plant.layout.coordinates());
            place.plant.assemble(vehicle, place.effects, &mut buffers.model);
            find_poles(at.variants[variant].base.as_ref(), buffers, Sought::All, poles)?;
            let Buffers { model, scratch, solver, .. } = buffers;
            let mut solved = Solved::new(model, poles);
            let found = self.identify(at, [variant, mode], &mut solved, solver, scratch);
            let found = found.map_err(|lost| self.lost(mode, lost))?;
            let row = |(branch, candidate): (Branch, modal::Candidate)| {
                let label = &at.labels[mode];
                let pole = named_pole(place.plant, mode, branch, label, &candidate)?;
                let reference = candidate.reference;
                let by_score = if derivatives { place.by_score(&reference) } else { Vec::new() };
                Ok(Followed { pole, reference, by_score })
            };
            found.into_iter().map(row).collect()
        });
        self.workspaces.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
        found
    }

    /// The pole of a mode in a model, and its partner if there is one.
    fn identify(
        &self,
        at: &AtTime,
        [variant, mode]: [usize; 2],
        solved: &mut Solved<'_>,
        solver: &mut Solver,
        scratch: &mut Model,
    ) -> Result<Vec<(Branch, modal::Candidate)>, identify::Lost> {
        let AtVariant { nominal, references, .. } = &at.variants[variant];
        let ratio = self.definition.exchange_ratio;
        let identity =
            identify::identify(solver, &references[mode], nominal, solved, ratio, scratch)?;
        let partner = identity.partner.map(|partner| (Branch::Partner, partner));
        Ok(std::iter::once((Branch::Primary, identity.primary)).chain(partner).collect())
    }

    fn take(&self) -> Workspace<'a> {
        let idle = self.workspaces.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.unwrap_or_else(|| Workspace {
            buffers: Vec::new(),
            cursor: self.sampler.cursor(),
            vehicle: DrawnVehicle::default(),
            poles: Vec::new(),
        })
    }

    /// Solves one variant of the drawn vehicle of `place`; its model stays in `buffers`, and in `poles` those found: of a
    /// model with a full part only some, where nothing asks for all.
    fn solve(
        &self,
        at: &AtTime,
        place: &Place<'_>,
        (variant, sensitive): (usize, bool),
        buffers: &mut Buffers,
        poles: &mut Vec<Complex<f64>>,
    ) -> Result<(Vec<Pole>, Solution), Failure> {
        let AtVariant { references, base, loops, .. } = &at.variants[variant];
        place.plant.assemble(place.drawn, place.effects, &mut buffers.model);
        let Buffers { model, guesses, .. } = &mut *buffers;
        guesses.clear();
        guesses.extend(references.iter().map(|mode| mode.predict(model)));
        let some = !self.all_poles && !sensitive && loops.is_none();
        let sought = if some { Sought::Near } else { Sought::All };
        let which = (variant, sensitive);
        let solution = find_poles(base.as_ref(), buffers, sought, poles)?;
        if let Some(rows) = self.rows(at, place, which, solution, buffers, poles)? {
            return Ok((rows, solution));
        }
        let mut all = find_poles(base.as_ref(), buffers, Sought::All, poles)?;
        all.determinants += solution.determinants;
        let rows = self.rows(at, place, which, all, buffers, poles)?;
        Ok((rows.expect("all poles are known"), all))
    }

    /// The rows of the poles found, with what is asked of them; none where the poles found are some, and others may carry a
    /// mode.
    fn rows(
        &self,
        at: &AtTime,
        place: &Place<'_>,
        (variant, sensitive): (usize, bool),
        solution: Solution,
        buffers: &mut Buffers,
        poles: &[Complex<f64>],
    ) -> Result<Option<Vec<Pole>>, Failure> {
        let plant = place.plant;
        let Buffers { model, scratch, solver, spectrum, bounds, guesses, .. } = buffers;
        let mut solved = match solution.certificate {
            Certificate::Near => Solved::in_part(model, poles),
            _ => Solved::new(model, poles),
        };
        let mut rows = Vec::new();
        let structured = solution.solver == definition::Solver::Structured;
        for (mode, &guess) in guesses.iter().enumerate() {
            if structured {
                offer_near(guess, &mut solved, spectrum);
            }
            let found = match self.identify(at, [variant, mode], &mut solved, solver, scratch) {
                Err(identify::Lost::Beyond { .. }) => return Ok(None),
                found => found.map_err(|lost| self.lost(mode, lost))?,
            };
            for (branch, found) in found {
                let mut row = named_pole(plant, mode, branch, &at.labels[mode], &found)?;
                if sensitive {
                    let near = neighbours(&solved, row.value);
                    let near = near.map(|near| solved.reference(solver, near).clone());
                    let sensitivity = place.sensitivity(&found.reference, near);
                    row.sensitivity = Some(Box::new(sensitivity));
                }
                rows.push(row);
            }
        }
        if self.all_poles {
            let named: Vec<Complex<f64>> = rows.iter().map(|row: &Pole| row.value).collect();
            if structured {
                offer(poles.to_vec(), &mut solved, spectrum);
            }
            for &pole in poles.iter().filter(|pole| !named.contains(pole)) {
                rows.push(other_pole(plant, solved.reference(solver, pole)));
            }
        }
        for row in &mut rows {
            let proven = poles.iter().zip(&*bounds).find(|(pole, _)| **pole == row.value);
            row.error_bound = proven.map(|(_, bound)| *bound).or(row.error_bound);
        }
        Ok(Some(rows))
    }

    fn lost(&self, mode: usize, lost: identify::Lost) -> Failure {
        match lost {
            identify::Lost::Solve(error) => Failure::from(&error),
            identify::Lost::Overlap { .. } | identify::Lost::Beyond { .. } => Failure::new(
                FailureKind::IdentityLost,
                format!("mode {}: {lost}", self.definition.modes[mode]),
            ),
        }
    }
}

/// Poles of a model with a full part that are found for each mode of interest at the least.
const NEAR: usize = 4;

/// Which poles are asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sought {
    /// All.
    All,
    /// At least those near the guesses of the modes of interest.
    Near,
}

/// The poles sought of the model in `buffers`: by its base where there is one and they can be certified, else all densely.
pub(super) fn find_poles(
    base: Option<&Base>,
    buffers: &mut Buffers,
    sought: Sought,
    poles: &mut Vec<Complex<f64>>,
) -> Result<Solution, Failure> {
    let Buffers { model, solver, spectrum, bounds, degree, guesses, .. } = buffers;
    bounds.clear();
    let certified = base.map(|base| match sought {
        Sought::Near => spectrum.solve_near(base, model, guesses, NEAR),
        Sought::All => spectrum.solve(base, model),
    });
    let determinants = base.map_or(0, |_| spectrum.evaluations());
    if let Some(Ok(certified)) = certified {
        poles.clear();
        poles.extend(certified.iter().map(|pole| pole.root));
        bounds.extend(certified.iter().map(|pole| pole.bound));
        *degree = spectrum.degree();
        let all = certified.iter().map(Bounded::conjugates).sum::<usize>() == *degree;
        let single = certified.iter().all(|pole| pole.multiplicity == 1);
        let certificate = match (spectrum.is_refined(), single) {
            (true, _) if all => Certificate::Residual,
            (true, _) => Certificate::Near,
            (false, true) => Certificate::Discs,
            (false, false) => Certificate::Clusters,
        };
        let solver = definition::Solver::Structured;
        return Ok(Solution { solver, certificate, determinants });
    }
    solver.poles(model, poles).map_err(|error| Failure::from(&error))?;
    *degree = poles.iter().map(|s| if s.im > 0.0 { 2 } else { 1 }).sum();
    let (solver, certificate) = (definition::Solver::Dense, Certificate::Residual);
    Ok(Solution { solver, certificate, determinants })
}

/// Poles whose vectors are found at once.
const AT_ONCE: usize = 8;

/// Finds the vectors of the poles nearest to a guess by the structure of the model, where it has one.
fn offer_near(guess: Complex<f64>, solved: &mut Solved<'_>, spectrum: &mut Spectrum) {
    let mut near = solved.poles().to_vec();
    near.sort_by(|a, b| (a - guess).norm_sqr().total_cmp(&(b - guess).norm_sqr()));
    near.truncate(AT_ONCE);
    offer(near, solved, spectrum);
}

/// Finds the vectors of poles by the structure of the model, where it has one.
fn offer(mut poles: Vec<Complex<f64>>, solved: &mut Solved<'_>, spectrum: &mut Spectrum) {
    poles.retain(|pole| !solved.has_offer(*pole) && !solved.has_seen(*pole));
    solved.offer(spectrum.vectors(solved.model(), &poles));
}

/// The other poles that are asked for the second-order change of one: the nearest, and the nearest that identity
/// looked at or, where that is the same, the next. Not one alone, since of a symmetric vehicle the nearest may be of
/// the other symmetry and not coupled at all.
fn neighbours(
    solved: &Solved<'_>,
    pole: Complex<f64>,
) -> impl Iterator<Item = Complex<f64>> + use<> {
    let mut others: Vec<_> =
        solved.poles().iter().copied().filter(|other| *other != pole).collect();
    others.sort_by(|a, b| (a - pole).norm_sqr().total_cmp(&(b - pole).norm_sqr()));
    let (nearest, farther) = others.split_first().map_or((None, &[][..]), |(a, b)| (Some(*a), b));
    let seen = farther.iter().find(|other| solved.has_seen(**other));
    let seen = seen.filter(|_| nearest.is_some_and(|nearest| !solved.has_seen(nearest)));
    let second = seen.or(farther.first()).copied();
    nearest.into_iter().chain(second)
}

/// The row of an identified pole.
fn named_pole(
    plant: &Plant,
    mode: usize,
    branch: Branch,
    label: &str,
    found: &modal::Candidate,
) -> Result<Pole, Failure> {
    let (pair, layout) = (&found.reference.pair, &plant.layout);
    let bound = RESIDUAL_FACTOR * layout.coordinates() as f64 * f64::EPSILON;
    if !(pair.residual <= bound) {
        let message =
            format!("residual of pole {} is {:.2e}, allowed {bound:.2e}", pair.pole, pair.residual);
        return Err(Failure::new(FailureKind::Residual, message));
    }
    Ok(Pole {
        mode: Some(mode),
        branch,
        label: Some(label.to_owned()),
        value: pair.pole,
        identity_confidence: Some(found.overlap.norm()),
        participation: Some(participation(plant, &found.reference)),
        residual: Some(pair.residual),
        error_bound: Some(pair.bound).filter(|bound| bound.is_finite()),
        sensitivity: None,
    })
}

/// Participation of the states of each part.
fn participation(plant: &Plant, reference: &Reference) -> [f64; Part::ALL.len()] {
    Part::ALL.map(|part| reference.participation(plant.layout.part(part)))
}

/// The row of a pole that belongs to no named mode; it carries the name of the motion with more than
/// half of the participation, if any.
fn other_pole(plant: &Plant, reference: &Reference) -> Pole {
    let motions = plant.layout.motions().into_iter();
    let shares = motions.map(|(name, members)| (name, reference.participation(members)));
    let dominant = shares.max_by(|(_, a), (_, b)| a.total_cmp(b));
    Pole {
        mode: None,
        branch: Branch::Other,
        label: dominant.filter(|(_, share)| *share > 0.5).map(|(name, _)| name),
        value: reference.pair.pole,
        identity_confidence: None,
        participation: Some(participation(plant, reference)),
        residual: Some(reference.pair.residual),
        error_bound: Some(reference.pair.bound).filter(|bound| bound.is_finite()),
        sensitivity: None,
    }
}

impl From<&eigen::Error> for Failure {
    fn from(error: &eigen::Error) -> Self {
        let kind = match error {
            eigen::Error::NonFinite(_) => FailureKind::NonFinite,
            eigen::Error::SingularMass { .. } => FailureKind::SingularMass,
            eigen::Error::NoConvergence => FailureKind::NoConvergence,
            eigen::Error::Trace { .. } | eigen::Error::Spread { .. } => FailureKind::Residual,
        };
        Self::new(kind, error.to_string())
    }
}

/// Prepares one flight time.
fn at_time(
    vehicle: &Vehicle,
    dispersion: &Dispersion,
    definition: &Definition,
    time_s: f64,
) -> Result<AtTime, Error> {
    let set = vehicle.modal.at(time_s).ok_or(Error::MissingTime(time_s))?;
    let labels = definition
        .modes
        .iter()
        .map(|mode| {
            let named = vehicle.named_modes.iter().find(|named| named.name == *mode);
            let label = named.and_then(|n| n.labels.iter().find(|l| set.mode(l).is_some()));
            label.cloned().ok_or_else(|| Error::MissingMode { mode: mode.clone(), time_s })
        })
        .collect::<Result<Vec<_>, _>>()?;
    let mut extents = Vec::new();
    let mut plants = Vec::new();
    for variant in &definition.variants {
        let extent = Extent::of(variant);
        if !extents.contains(&extent) {
            extents.push(extent);
            plants.push(super::plant::plant(vehicle, set, &definition.gimballed, extent)?);
        }
    }
    let parameters = dispersion.parameters();
    let slots = Slots::new(vehicle, set, parameters);
    let mut nominal = DrawnVehicle::default();
    slots
        .draw(vehicle, parameters, &vec![Affine::IDENTITY; parameters.count()], &mut nominal)
        .map_err(|failure| Error::Nominal { time_s, failure })?;
    let variants = definition
        .variants
        .iter()
        .enumerate()
        .map(|(index, variant)| {
            let extent = Extent::of(variant);
            let plant = extents.iter().position(|e| *e == extent).unwrap_or_default();
            let structured = definition.solver == definition::Solver::Structured;
            let mut prepared = at_variant(&plants[plant], plant, &nominal, variant, &labels)
                .map_err(|(mode, lost)| Error::Lost {
                    mode: definition.modes[mode].clone(),
                    time_s,
                    variant: variant.name.clone(),
                    lost,
                })?;
            if structured {
                let mut solver = Solver::new(prepared.nominal.coordinates());
                prepared.base = Base::proven(&prepared.nominal, &mut solver);
            }
            if definition.margins.as_ref().is_some_and(|plan| plan.holds(index)) {
                let effects = prepared.effects;
                let mut open = OpenLoop::new(vehicle, set, definition, variant, effects)?;
                if structured {
                    open.prove(&nominal);
                }
                prepared.loops = Some(open);
            }
            Ok::<_, Error>(prepared)
        })
        .collect::<Result<Vec<_>, _>>()?;
    Ok(AtTime { flight_time_s: time_s, plants, slots, nominal, labels, variants })
}

/// Prepares one variant: nominal model and nominal poles; an error names the mode by index.
fn at_variant(
    plant: &Plant,
    plant_index: usize,
    nominal: &DrawnVehicle,
    variant: &Variant,
    labels: &[String],
) -> Result<AtVariant, (usize, identify::Lost)> {
    let effects = Effects {
        thrust: if variant.thrust { 1.0 } else { 0.0 },
        case_jet_damping: variant.case_jet_damping,
        nozzle_jet_damping: variant.nozzle_jet_damping,
        follower_thrust: variant.follower_thrust,
        aerodynamics: if variant.aerodynamics { 1.0 } else { 0.0 },
        feedback: 1.0,
    };
    let size = plant.layout.coordinates();
    let mut solver = Solver::new(size);
    let mut references = Vec::new();
    for (mode, label) in labels.iter().enumerate() {
        let coordinate = plant.layout.position(label).expect("labels are taken from the mode set");
        let model_at = |factor: f64, model: &mut Model| {
            plant.assemble(nominal, &effects.scaled(factor), model);
        };
        let reference = identify::nominal(&mut solver, &plant.layout, coordinate, model_at)
            .map_err(|lost| (mode, lost))?;
        references.push(reference);
    }
    let mut model = Model::zeros(size);
    plant.assemble(nominal, &effects, &mut model);
    Ok(AtVariant {
        plant: plant_index,
        effects,
        nominal: model,
        references,
        base: None,
        loops: None,
    })
}
