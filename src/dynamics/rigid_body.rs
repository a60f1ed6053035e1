//! The rigid body: its inertia, and the states that are poles at the origin by construction.
//!
//! Attached masses add theirs in `engine` and `slosh`. The null chain: no force depends on where the
//! vehicle is, so every ξ is null, and its rate too unless the air is felt. A vehicle turned by θ
//! that accelerates along its turned thrust, `ξ̈ = −g0 × θ`, is in equilibrium; so θ acts on ξ alone and
//! is null as well, and its rate too unless flow or air damps it. Where the air is felt, only a turn about
//! g0 needs no acceleration, and costs nothing with the velocity that keeps the angle of attack.

use super::gradient::{C, Vectors};
use super::{DrawnBody, Layout, Model, NullMotion};
use crate::vehicle::MassProperties;
use nalgebra::{Matrix3, Vector3};

/// Inertia of the body as drawn, kg·m².
fn inertia(body: &MassProperties, drawn: &DrawnBody) -> Matrix3<f64> {
    let gain = Matrix3::from_diagonal(&drawn.inertia_gain.map(f64::sqrt).into());
    gain * body.inertia_kg_m2 * gain
}

/// Adds mass and inertia of the body about its cg, roll, pitch and yaw inertia scaled as drawn
/// (products of inertia by the geometric mean, so that the tensor stays positive definite).
pub fn add(body: &MassProperties, drawn: &DrawnBody, layout: &Layout, model: &mut Model) {
    for at in layout.translation() {
        model.mass[(at, at)] += body.mass_kg;
    }
    let inertia = inertia(body, drawn);
    for (row, a) in layout.rotation().enumerate() {
        for (column, b) in layout.rotation().enumerate() {
            model.mass[(a, b)] += inertia[(row, column)];
        }
    }
}

/// The part of the body's mass and inertia in the form of [`super::gradient`], and its gradient by the
/// inertia gains.
pub fn form(
    body: &MassProperties,
    drawn: &DrawnBody,
    layout: &Layout,
    vectors: &Vectors<'_>,
) -> (C, [C; 3]) {
    let square = vectors.s * vectors.s;
    let translation = layout.translation().map(|at| vectors.product(at) * body.mass_kg);
    let mut value = translation.sum::<C>() * square;
    let mut gradient = [C::new(0.0, 0.0); 3];
    let inertia = inertia(body, drawn);
    for (row, a) in layout.rotation().enumerate() {
        for (column, b) in layout.rotation().enumerate() {
            let part = square * vectors.left[a] * vectors.right[b] * inertia[(row, column)];
            value += part;
            // √(g_row g_column), so that each gain has half of the part.
            for axis in [row, column] {
                gradient[axis] += part * (0.5 / drawn.inertia_gain[axis]);
            }
        }
    }
    (value, gradient)
}

/// Directions of the flow that damps the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flow {
    /// No flow damps.
    None,
    /// All that damps runs along this axis: a turn about it costs nothing.
    Along(Vector3<f64>),
    /// Flows of several directions.
    Several,
}

impl Flow {
    /// With one more flow along `axis` (either sense).
    pub fn with(self, axis: Vector3<f64>) -> Self {
        match self {
            Self::None => Self::Along(axis),
            Self::Along(known) if known == axis || known == -axis => self,
            _ => Self::Several,
        }
    }
}

/// The columns of the stiffness matrix that belong to θ, as they stand before anything that senses
/// attitude or angle of attack is added.
pub fn attitude_columns(layout: &Layout, model: &Model) -> Vec<Vec<f64>> {
    let column = |at: usize| model.stiffness.col(at).iter().copied().collect();
    layout.rotation().map(column).collect()
}

/// Whether each rotation is sensed: something was added to its column since `before`, see
/// [`attitude_columns`].
pub fn sensed(layout: &Layout, before: &[Vec<f64>], model: &Model) -> Vec<bool> {
    let differs = |at: usize, before: &[f64]| {
        model.stiffness.col(at).iter().zip(before).any(|(now, before)| now != before)
    };
    layout.rotation().zip(before).map(|(at, before)| differs(at, before)).collect()
}

/// What decides which turns of the vehicle cost nothing.
#[derive(Debug, Clone, Copy)]
pub struct Steady<'a> {
    /// Columns of θ from [`attitude_columns`].
    pub before: &'a [Vec<f64>],
    /// Which rotations the autopilot senses, from [`sensed`].
    pub sensed: &'a [bool],
    /// What damps rotations.
    pub flow: Flow,
    /// Mean acceleration g0, m/s².
    pub acceleration: Vector3<f64>,
    /// Speed at which the air feels the angle of attack and nothing else, m/s.
    pub speed_m_s: Option<f64>,
}

/// Writes the null states of the assembled model: a rotation is null where nothing was added to its
/// column, and where the air feels ξ̇ only about g0. There the turn r ∥ g0 needs no acceleration, and with
/// `ξ̇ = −V r × x̂` the angle of attack stays: one motion for the poles, see [`Model::null_motion`].
///
/// No magnitude is compared: a state is null by the structure of the equations, or exactly unused.
pub fn find_null_states(layout: &Layout, steady: &Steady<'_>, model: &mut Model) {
    if layout.rotation().is_empty() {
        return;
    }
    let (second_order, g0) = (layout.second_order(), steady.acceleration);
    let undamped = |at: usize| model.damping.col(at).iter().all(|value| *value == 0.0);
    let mut positions = Vec::new();
    let mut rates = Vec::new();
    for at in layout.translation() {
        positions.push(at);
        if undamped(at) {
            rates.push(second_order + at);
        }
    }
    let felt = rates.len() < layout.translation().len();
    let used = sensed(layout, steady.before, model);
    for (axis, at) in layout.rotation().enumerate() {
        let alone = g0.cross(&Vector3::ith(axis, 1.0)) == Vector3::zeros();
        if !used[axis] && (!felt || alone) {
            positions.push(at);
            if undamped(at) {
                rates.push(second_order + at);
            }
        }
    }
    let most = g0.iamax();
    let state = layout.rotation().start + most;
    let about = (0..3).all(|axis| g0[axis] == 0.0 || !steady.sensed[axis]);
    let wind = steady.speed_m_s.filter(|_| felt && about && g0[most] != 0.0);
    if let (Some(speed), false) = (wind, positions.contains(&state)) {
        let turn = g0 / g0[most];
        let drift = turn.cross(&Vector3::x()) * -speed;
        let turns = layout.rotation().zip(turn.iter().copied()).filter(|(at, _)| *at != state);
        let drifts = layout.translation().map(|at| second_order + at).zip(drift.iter().copied());
        let others = turns.chain(drifts).filter(|(_, part)| *part != 0.0).collect();
        positions.push(state);
        model.null_motion = Some(NullMotion { state, others });
    }
    // All rotations free and some damped: the rotation about a common direction of flow is not.
    let turning = layout.rotation().map(|at| second_order + at);
    let free = layout.rotation().all(|at| positions.contains(&at));
    let damped = turning.clone().all(|state| !rates.contains(&state));
    if let (Flow::Along(axis), true) = (steady.flow, free && damped) {
        let most = axis.iamax();
        let state = second_order + layout.rotation().start + most;
        let others = [(most + 1) % 3, (most + 2) % 3].map(|other| {
            (second_order + layout.rotation().start + other, axis[other] / axis[most])
        });
        rates.push(state);
        rates.sort_unstable();
        model.null_motion = Some(NullMotion { state, others: others.to_vec() });
    }
    // A turn and its rate are at the origin as well where what senses it moves nothing, or nothing turns the
    // vehicle back: those not left out may be.
    let turns = layout.rotation().filter(|at| positions.contains(at)).count();
    let left_out = turns + turning.filter(|state| rates.contains(state)).count();
    model.at_origin += 2 * layout.rotation().len() - left_out;
    positions.sort_unstable();
    model.null_states.clear();
    model.null_states.extend(positions.into_iter().chain(rates));
}
