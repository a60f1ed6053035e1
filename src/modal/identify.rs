//! Identity of modes: which pole of a model is the named mode of another.
//!
//! Two models are compared by two-sided overlaps, never by order of frequency. Labels of the
//! package become nominal poles by continuation; nominal poles become poles of a case by overlap,
//! or by homotopy where two poles compete.

use super::eigen::{Error, Pair, Solver};
use crate::dynamics::{Layout, Model};
use faer::c64;

/// A pole followed so far, with what is needed to find it again in another model.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// The pole with its vectors.
    pub pair: Pair,
    /// `yᴴ M`.
    left_mass: Vec<c64>,
    /// `yᴴ D`.
    left_damping: Vec<c64>,
    /// `yᴴ L'(s) x`, the scale of overlaps.
    derivative: c64,
}

/// A model with its poles; the vectors of each are found once, however many modes look at it.
#[derive(Debug, Clone)]
pub struct Solved<'a> {
    model: &'a Model,
    poles: &'a [c64],
    /// Whether these are all poles.
    complete: bool,
    seen: Vec<Reference>,
    /// Right and left vectors known beforehand, `yᵀ L = 0`.
    known: Vec<(c64, [Vec<c64>; 2])>,
}

impl<'a> Solved<'a> {
    /// A model and all its poles.
    pub fn new(model: &'a Model, poles: &'a [c64]) -> Self {
        Self { model, poles, complete: true, seen: Vec::new(), known: Vec::new() }
    }

    /// A model and some of its poles.
    pub fn in_part(model: &'a Model, poles: &'a [c64]) -> Self {
        Self { complete: false, ..Self::new(model, poles) }
    }

    /// The model.
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// Its poles, all or those known.
    pub fn poles(&self) -> &'a [c64] {
        self.poles
    }

    /// Takes right and left vectors of poles, `yᵀ L = 0`, so that they need not be found again.
    pub fn offer(&mut self, vectors: Vec<(c64, [Vec<c64>; 2])>) {
        self.known.extend(vectors);
    }

    /// Whether a pole's vectors were offered.
    pub fn has_offer(&self, pole: c64) -> bool {
        self.known.iter().any(|(known, _)| *known == pole)
    }

    /// Whether the vectors of a pole are known.
    pub fn has_seen(&self, pole: c64) -> bool {
        self.seen.iter().any(|known| known.pair.pole == pole)
    }

    /// A pole of the model with its vectors.
    pub fn reference(&mut self, solver: &mut Solver, pole: c64) -> &Reference {
        let known = self.seen.iter().position(|known| known.pair.pole == pole);
        let index = known.unwrap_or_else(|| {
            let offered = self.known.iter().find(|(known, _)| *known == pole);
            let pair = offered.map(|(_, vectors)| solver.judge(self.model, pole, vectors));
            // Where vectors found elsewhere are not as good as rounding allows, a whole factorisation gives them.
            let allowed = OFFERED * self.model.coordinates() as f64 * f64::EPSILON;
            let pair = pair.filter(|pair| pair.residual <= allowed);
            let pair = pair.unwrap_or_else(|| solver.pair(self.model, pole));
            self.seen.push(Reference::new(self.model, pair));
            self.seen.len() - 1
        });
        &self.seen[index]
    }
}

/// A pole of a model that overlaps with a reference.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The pole with its vectors.
    pub reference: Reference,
    /// Two-sided overlap `(w₀ᴴ v)(wᴴ v₀) / ((w₀ᴴ v₀)(wᴴ v))` of the state-space vectors, −; over
    /// all poles of a model, conjugates included, the overlaps add up to one.
    pub overlap: c64,
}

/// The poles of a case that carry a named mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Identity {
    /// The pole identified as the mode.
    pub primary: Candidate,
    /// The pole with which it exchanges character, where the best two overlaps are comparable.
    pub partner: Option<Candidate>,
}

/// Why a mode could not be followed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Lost {
    /// A solve on the way failed.
    #[error("{0}")]
    Solve(#[from] Error),
    /// No pole overlaps enough with the reference.
    #[error("the best overlap {best:.3} is below {least}")]
    Overlap {
        /// Modulus of the best overlap found.
        best: f64,
        /// Least modulus allowed.
        least: f64,
    },
    /// The poles known do not account for the mode, and are not all.
    #[error("the poles known account for all but {rest:.3} of it")]
    Beyond {
        /// Modulus of one less the sum of overlaps.
        rest: f64,
    },
}

/// Overlap below which a pole is not taken for the mode: below it more than two others share it.
const LEAST_OVERLAP: f64 = 0.2;
/// A homotopy step is accepted when the best overlap is at least this …
pub const STEP_OVERLAP: f64 = 0.9;
/// … and else halved, down to this fraction of the whole way; there the best is taken.
const LEAST_STEP: f64 = 1.0 / 256.0;
/// Largest relative residual of vectors offered, in units of n ε; that of the pole itself is in it.
const OFFERED: f64 = 100.0;
/// Candidates are drawn in until the overlaps found leave no more than this unaccounted for.
const UNACCOUNTED: f64 = 0.05;

impl Reference {
    /// The reference of a pole of `model`.
    pub fn new(model: &Model, pair: Pair) -> Self {
        let n = model.coordinates();
        let mut left_mass = vec![c64::new(0.0, 0.0); n];
        let mut left_damping = left_mass.clone();
        let mut derivative = c64::new(0.0, 0.0);
        for (column, right) in pair.right.iter().enumerate() {
            let (mut mass, mut damping) = (c64::new(0.0, 0.0), c64::new(0.0, 0.0));
            for (left, [m, d, _]) in pair.left.iter().zip(model.column(column)) {
                let left = left.conj();
                mass += left * m;
                damping += left * d;
            }
            derivative += (2.0 * pair.pole * mass + damping) * right;
            (left_mass[column], left_damping[column]) = (mass, damping);
        }
        Self { pair, left_mass, left_damping, derivative }
    }

    /// Right and left eigenvectors of the state matrix A of `model` at the pole, its null states left
    /// out: v = [q, s q, x_a] with unit x, and w with `wᴴ A = s wᴴ`, `wᴴ v = 1` (unscaled where the
    /// pole is defective).
    pub fn state_vectors(&self, model: &Model) -> (Vec<c64>, Vec<c64>) {
        let (s, n) = (self.pair.pole, model.second_order);
        let scale = self.derivative.inv();
        let scale = if scale.is_finite() { scale } else { c64::new(1.0, 0.0) };
        let states =
            (0..n + model.coordinates()).filter(|state| !model.null_states.contains(state));
        states
            .map(|state| {
                // wᴴ = [s yᴴM + yᴴD, yᴴM, y_aᴴ] over [q, q̇, x_a].
                let (at, rate) =
                    if state < n { (state, false) } else { (state - n, state < 2 * n) };
                let right = self.pair.right[at];
                let (mass, damping) = (self.left_mass[at], self.left_damping[at]);
                let (mut right, left) =
                    if rate { (s * right, mass) } else { (right, s * mass + damping) };
                if let Some(motion) = &model.null_motion {
                    let ratio = motion.others.iter().find(|(other, _)| *other == state);
                    let left_out = match motion.state.checked_sub(n) {
                        Some(at) => s * self.pair.right[at],
                        None => self.pair.right[motion.state],
                    };
                    right -= ratio.map_or(0.0, |(_, ratio)| *ratio) * left_out;
                }
                (right, (left * scale).conj())
            })
            .unzip()
    }

    /// `w₀ᴴ v` for a state-space vector v = [x, s x]: `y₀ᴴ [(s₀ + s) M₀ + D₀] x`.
    fn project(&self, pair: &Pair) -> c64 {
        let sum = self.pair.pole + pair.pole;
        (self.left_mass.iter().zip(&self.left_damping).zip(&pair.right))
            .map(|((mass, damping), right)| (sum * mass + damping) * right)
            .sum()
    }

    /// Participation factors (state-space, w_i* v_i / wᴴv, real part) summed over the
    /// `coordinates` and their rates, −; all coordinates together give one.
    pub fn participation(&self, coordinates: impl IntoIterator<Item = usize>) -> f64 {
        coordinates
            .into_iter()
            .map(|i| {
                let weight = 2.0 * self.pair.pole * self.left_mass[i] + self.left_damping[i];
                (weight * self.pair.right[i] / self.derivative).re
            })
            .sum()
    }

    /// `yᴴ L'(s) x`, the scale of eigenvalue derivatives.
    pub fn derivative(&self) -> c64 {
        self.derivative
    }

    /// Two-sided overlap of this reference with a pole of another model, see [`Candidate::overlap`].
    pub fn overlap(&self, other: &Reference) -> c64 {
        self.project(&other.pair) * other.project(&self.pair) / (self.derivative * other.derivative)
    }

    /// First guess of the same pole in `model`: the root nearest s₀ of `y₀ᴴ L(s) x₀ = 0`.
    pub fn predict(&self, model: &Model) -> c64 {
        let mut form = [c64::new(0.0, 0.0); 3];
        for (column, right) in self.pair.right.iter().enumerate() {
            let mut sums = [c64::new(0.0, 0.0); 3];
            for (left, [m, d, k]) in self.pair.left.iter().zip(model.column(column)) {
                let left = left.conj();
                sums = [sums[0] + left * k, sums[1] + left * d, sums[2] + left * m];
            }
            for (form, sum) in form.iter_mut().zip(sums) {
                *form += sum * right;
            }
        }
        let root = (form[1] * form[1] - 4.0 * form[2] * form[0]).sqrt();
        let roots = [(-form[1] + root) / (2.0 * form[2]), (-form[1] - root) / (2.0 * form[2])];
        let distance = |s: &c64| (s - self.pair.pole).norm();
        let best = if distance(&roots[0]) <= distance(&roots[1]) { roots[0] } else { roots[1] };
        if best.re.is_finite() && best.im.is_finite() { best } else { self.pair.pole }
    }
}

/// The poles of a model that overlap with `reference`, best first; none if there is no pole.
///
/// Poles are tried from the nearest to the predicted one outwards until the overlaps account for
/// all but a small rest.
///
/// # Errors
/// [`Lost::Beyond`] where poles that are not known account for more.
fn candidates(
    solver: &mut Solver,
    solved: &mut Solved<'_>,
    reference: &Reference,
) -> Result<Vec<Candidate>, Lost> {
    let guess = reference.predict(solved.model);
    let mut order: Vec<c64> = solved.poles.to_vec();
    order.sort_by(|a, b| (a - guess).norm_sqr().total_cmp(&(b - guess).norm_sqr()));
    let mut found: Vec<Candidate> = Vec::new();
    let mut rest = c64::new(1.0, 0.0);
    let mut accounted = false;
    for pole in order {
        let other = solved.reference(solver, pole);
        let overlap = reference.overlap(other);
        rest -= overlap;
        if overlap.norm().is_finite() {
            found.push(Candidate { reference: other.clone(), overlap });
        }
        accounted = found.len() >= 2 && rest.norm() <= UNACCOUNTED;
        if accounted {
            break;
        }
    }
    if !(accounted || solved.complete) {
        return Err(Lost::Beyond { rest: rest.norm() });
    }
    found.sort_by(|a, b| b.overlap.norm().total_cmp(&a.overlap.norm()));
    Ok(found)
}

/// Follows `reference` from one model to another along a path of models.
///
/// `path(t)` fills a model for t in (0, 1]; a step is accepted when one pole keeps at least
/// `STEP_OVERLAP`, else it is halved, down to `LEAST_STEP`, where the best is taken: a mode
/// crosses others by its vectors, not by its frequency. `at_end` has the poles at t = 1, where they are known.
///
/// # Errors
/// [`Lost`] where a solve fails or no pole overlaps.
pub fn follow(
    solver: &mut Solver,
    mut reference: Reference,
    model: &mut Model,
    at_end: Option<&Solved<'_>>,
    mut path: impl FnMut(f64, &mut Model),
) -> Result<Reference, Lost> {
    let (mut done, mut step) = (0.0_f64, 1.0_f64);
    let mut poles = Vec::new();
    while done < 1.0 {
        let next = (done + step).min(1.0);
        path(next, model);
        let mut solved = match at_end.filter(|_| next == 1.0) {
            Some(end) => Solved { complete: end.complete, ..Solved::new(model, end.poles) },
            None => {
                solver.poles(model, &mut poles)?;
                Solved::new(model, &poles)
            }
        };
        let found = candidates(solver, &mut solved, &reference)?.into_iter().next();
        let best = found.ok_or(Lost::Overlap { best: 0.0, least: LEAST_OVERLAP })?;
        let overlap = best.overlap.norm();
        if overlap >= STEP_OVERLAP || step <= LEAST_STEP {
            if !(overlap >= LEAST_OVERLAP) {
                return Err(Lost::Overlap { best: overlap, least: LEAST_OVERLAP });
            }
            reference = best.reference;
            done = next;
            step *= 2.0;
        } else {
            step /= 2.0;
        }
    }
    Ok(reference)
}

/// Identifies the named mode `reference` of the model `nominal` among the poles of `case`.
///
/// Where the second-best overlap reaches `exchange_ratio` of the best, the mode is followed by
/// homotopy from `nominal` to `case` and the other of the two is its partner. `scratch` has the
/// size of the models.
///
/// # Errors
/// [`Lost`] where no pole overlaps enough, a solve on the way fails, or poles that are not known may carry the mode.
pub fn identify(
    solver: &mut Solver,
    reference: &Reference,
    nominal: &Model,
    case: &mut Solved<'_>,
    exchange_ratio: f64,
    scratch: &mut Model,
) -> Result<Identity, Lost> {
    let mut found = candidates(solver, case, reference)?.into_iter();
    let best = found.next().ok_or(Lost::Overlap { best: 0.0, least: LEAST_OVERLAP })?;
    let most = best.overlap.norm();
    if !(most >= LEAST_OVERLAP) {
        return Err(Lost::Overlap { best: most, least: LEAST_OVERLAP });
    }
    let rival = found.next().filter(|rival| rival.overlap.norm() >= exchange_ratio * most);
    let Some(rival) = rival else {
        return Ok(Identity { primary: best, partner: None });
    };
    let start = reference.clone();
    let blend = |t: f64, model: &mut Model| model.blend(nominal, case.model, t);
    let end = follow(solver, start, scratch, Some(case), blend)?;
    // The path ends in the case itself, so that its last pole is one of the case's, bit for bit.
    let at_end = |candidate: &Candidate| candidate.reference.pair.pole == end.pair.pole;
    if at_end(&best) {
        return Ok(Identity { primary: best, partner: Some(rival) });
    }
    let primary = if at_end(&rival) {
        rival
    } else {
        Candidate { overlap: reference.overlap(&end), reference: end }
    };
    Ok(Identity { primary, partner: Some(best) })
}

/// The nominal pole of the elastic coordinate `label`: continuation of a factor 0→1 on the mass
/// coupling of everything attached, without thrust, flow, air and feedback, then of a factor 0→1 on these.
///
/// `model_at(f, model)` fills the nominal model with the factor f on thrust, flow, air and feedback.
///
/// # Errors
/// [`Lost`] where a solve fails or the mode cannot be followed.
pub fn nominal(
    solver: &mut Solver,
    layout: &Layout,
    coordinate: usize,
    mut model_at: impl FnMut(f64, &mut Model),
) -> Result<Reference, Lost> {
    let size = layout.coordinates();
    let mut coupled = Model::zeros(size);
    model_at(0.0, &mut coupled);
    let mut uncoupled = coupled.clone();
    let modes = layout.elastic();
    for column in 0..size {
        for row in 0..size {
            if modes.contains(&row) || modes.contains(&column) {
                let unit = if row == column { 1.0 } else { 0.0 };
                uncoupled.mass[(row, column)] = unit;
            }
        }
    }
    let (damping, stiffness) = (
        uncoupled.damping[(coordinate, coordinate)],
        uncoupled.stiffness[(coordinate, coordinate)],
    );
    // s² + d s + k = 0 of the mode alone.
    let root = c64::new(damping * damping / 4.0 - stiffness, 0.0).sqrt();
    let pole = c64::new(-damping / 2.0, 0.0) + root;
    let mut unit = vec![c64::new(0.0, 0.0); size];
    unit[coordinate] = c64::new(1.0, 0.0);
    let pair = Pair { pole, right: unit.clone(), left: unit, residual: 0.0, bound: 0.0 };
    let start = Reference::new(&uncoupled, pair);
    let mut scratch = Model::zeros(size);
    let with_mass =
        follow(solver, start, &mut scratch, None, |t, model| model.blend(&uncoupled, &coupled, t))?;
    follow(solver, with_mass, &mut scratch, None, |t, model| model_at(t, model))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two modes and one actuator-like coordinate with a coupling in mass and thrust.
    fn model(frequencies: [f64; 2], coupling: f64, thrust: f64) -> Model {
        let mut model = Model::zeros(3);
        for (i, w) in frequencies.into_iter().enumerate() {
            model.mass[(i, i)] = 1.0;
            model.damping[(i, i)] = 2.0 * 0.005 * w;
            model.stiffness[(i, i)] = w * w;
            let sign = if i == 0 { 1.0 } else { 0.4 };
            model.mass[(i, 2)] = coupling * sign;
            model.mass[(2, i)] = coupling * sign;
            model.stiffness[(i, 2)] = thrust * sign;
        }
        model.mass[(2, 2)] = 1.0;
        model.damping[(2, 2)] = 2.0 * 0.3 * 1.3;
        model.stiffness[(2, 2)] = 1.3 * 1.3;
        model
    }

    fn reference(model: &Model, near: c64) -> Reference {
        let mut solver = Solver::new(model.coordinates());
        let mut poles = Vec::new();
        solver.poles(model, &mut poles).expect("solved");
        let pole = *poles
            .iter()
            .min_by(|a, b| (*a - near).norm().total_cmp(&(*b - near).norm()))
            .expect("a pole");
        let pair = solver.pair(model, pole);
        Reference::new(model, pair)
    }

    #[test]
    fn eigenpairs_have_residuals_of_rounding() {
        let model = model([1.0, 1.02], 0.1, 0.2);
        let mut solver = Solver::new(3);
        let mut poles = Vec::new();
        solver.poles(&model, &mut poles).expect("solved");
        for pole in poles {
            assert!(solver.pair(&model, pole).residual < 1e2 * f64::EPSILON);
        }
    }

    #[test]
    fn overlaps_of_all_poles_and_conjugates_add_up_to_one() {
        let (a, b) = (model([1.0, 1.02], 0.1, 0.2), model([1.03, 0.99], 0.12, 0.25));
        let start = reference(&a, c64::new(0.0, 1.0));
        let mut solver = Solver::new(3);
        let mut poles = Vec::new();
        solver.poles(&b, &mut poles).expect("solved");
        let both = poles.iter().flat_map(|s| [*s, s.conj()]);
        let sum: c64 = both.map(|s| start.overlap(&Reference::new(&b, solver.pair(&b, s)))).sum();
        assert!((sum - c64::new(1.0, 0.0)).norm() < 1e-12, "{sum}");
    }

    #[test]
    fn participation_of_all_coordinates_is_one() {
        let start = reference(&model([1.0, 1.02], 0.1, 0.2), c64::new(0.0, 1.0));
        assert!((start.participation(0..3) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_mode_that_crosses_another_keeps_its_name() {
        let nominal = model([1.0, 1.05], 1e-3, 0.0);
        let crossed = model([1.1, 1.05], 1e-3, 0.0);
        let start = reference(&nominal, c64::new(0.0, 1.0));
        let mut solver = Solver::new(3);
        let mut poles = Vec::new();
        solver.poles(&crossed, &mut poles).expect("solved");
        let mut scratch = Model::zeros(3);
        let mut case = Solved::new(&crossed, &poles);
        let identity =
            identify(&mut solver, &start, &nominal, &mut case, 0.5, &mut scratch).expect("found");
        assert!((identity.primary.reference.pair.pole.im - 1.1).abs() < 1e-3);
        assert!(identity.primary.overlap.norm() > 0.99);
        assert!(identity.partner.is_none());
    }

    #[test]
    fn modes_that_exchange_character_are_both_kept() {
        let nominal = model([1.0, 1.2], 0.1, 0.1);
        let veering = model([1.0, 1.0], 0.1, 0.1);
        let start = reference(&nominal, c64::new(0.0, 1.0));
        let mut solver = Solver::new(3);
        let mut poles = Vec::new();
        solver.poles(&veering, &mut poles).expect("solved");
        let mut scratch = Model::zeros(3);
        let mut case = Solved::new(&veering, &poles);
        let identity =
            identify(&mut solver, &start, &nominal, &mut case, 0.05, &mut scratch).expect("found");
        assert!(identity.partner.is_some());
    }

    #[test]
    fn the_nominal_pole_of_a_label_is_reached_by_continuation() {
        let layout = Layout::new(["m001", "m002"], [("e.one".to_owned(), ["a", "b"], true)]);
        // Four coordinates: a second, uncoupled gimbal axis.
        let fill = |factor: f64, out: &mut Model| {
            let three = model([1.0, 1.05], 0.2, 0.2 * factor);
            out.clear(4);
            for (to, from) in [
                (&mut out.mass, &three.mass),
                (&mut out.damping, &three.damping),
                (&mut out.stiffness, &three.stiffness),
            ] {
                for i in 0..3 {
                    for j in 0..3 {
                        to[(i, j)] = from[(i, j)];
                    }
                }
            }
            out.mass[(3, 3)] = 1.0;
            out.damping[(3, 3)] = 0.7;
            out.stiffness[(3, 3)] = 2.0;
        };
        let mut solver = Solver::new(4);
        let found = nominal(&mut solver, &layout, 0, fill).expect("followed");
        assert!(found.participation(0..1) > 0.5);
        assert!(
            (found.participation(layout.elastic()) + found.participation(layout.gimbals()) - 1.0)
                .abs()
                < 1e-12
        );
    }

    #[test]
    fn bad_models_are_refused_without_hanging() {
        let mut solver = Solver::new(3);
        let mut poles = Vec::new();
        let mut nan = model([1.0, 1.1], 0.1, 0.1);
        nan.stiffness[(0, 1)] = f64::NAN;
        assert_eq!(solver.poles(&nan, &mut poles), Err(Error::NonFinite("the model")));
        let singular = model([1.0, 1.1], 1.5, 0.1);
        assert!(matches!(solver.poles(&singular, &mut poles), Err(Error::SingularMass { .. })));
        // Its square overflows, over which balancing would never end.
        let mut huge = model([1.0, 1.1], 0.1, 0.1);
        huge.stiffness[(2, 2)] = 1e300;
        let overflow = Error::NonFinite("the square of the state matrix");
        assert_eq!(solver.poles(&huge, &mut poles), Err(overflow));
        // The poles near 1 rad/s are below the rounding of the greatest.
        huge.stiffness[(2, 2)] = 1e40;
        assert!(matches!(solver.poles(&huge, &mut poles), Err(Error::Spread { .. })));
        huge.stiffness[(2, 2)] = 1e12;
        assert_eq!(solver.poles(&huge, &mut poles), Ok(()));
        // A pole at the origin is one only where the equations may have it.
        let mut free = model([1.0, 1.1], 0.0, 0.0);
        free.stiffness[(1, 1)] = 0.0;
        assert!(matches!(solver.poles(&free, &mut poles), Err(Error::Spread { .. })));
        free.at_origin = 1;
        assert_eq!(solver.poles(&free, &mut poles), Ok(()));
        assert_eq!(poles.len(), 3);
    }
}
