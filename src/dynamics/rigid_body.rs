//! The rigid body: its inertia, and the states that are poles at the origin by construction.
//!
//! Attached masses add theirs in `engine` and `slosh`. The null chain: no force depends on where the
//! vehicle is, so every ξ is null, and its rate too unless the air is felt. A vehicle turned by θ
//! that accelerates along its turned thrust, `ξ̈ = −g0 × θ`, is in equilibrium; so θ acts on ξ alone and
//! is null as well, and its rate too unless flow or air damps it.

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

/// Writes the null states of the assembled model. `before` are the columns of θ from
/// [`attitude_columns`]: a rotation is null where nothing was added to its column since; `flow` is what
/// damps rotations.
///
/// No magnitude is compared: a state is null by the structure of the equations, or exactly unused.
pub fn find_null_states(layout: &Layout, before: &[Vec<f64>], flow: Flow, model: &mut Model) {
    if layout.rotation().is_empty() {
        return;
    }
    let second_order = layout.second_order();
    let undamped = |at: usize| model.damping.col(at).iter().all(|value| *value == 0.0);
    let mut positions = Vec::new();
    let mut rates = Vec::new();
    for at in layout.translation() {
        positions.push(at);
        if undamped(at) {
            rates.push(second_order + at);
        }
    }
    for (at, before) in layout.rotation().zip(before) {
        if model.stiffness.col(at).iter().zip(before).all(|(now, before)| now == before) {
            positions.push(at);
            if undamped(at) {
                rates.push(second_order + at);
            }
        }
    }
    // All rotations free and some damped: the rotation about a common direction of flow is not.
    let turning = layout.rotation().map(|at| second_order + at);
    let free = layout.rotation().all(|at| positions.contains(&at));
    if let (Flow::Along(axis), true) = (flow, free && turning.clone().all(|s| !rates.contains(&s)))
    {
        let most = axis.iamax();
        let state = second_order + layout.rotation().start + most;
        let others = [(most + 1) % 3, (most + 2) % 3].map(|other| {
            (second_order + layout.rotation().start + other, axis[other] / axis[most])
        });
        rates.push(state);
        rates.sort_unstable();
        model.null_motion = Some(NullMotion { state, others });
    }
    model.null_states.clear();
    model.null_states.extend(positions.into_iter().chain(rates));
}
