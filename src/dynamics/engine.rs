//! An engine on the body: inertia, thrust, acceleration stiffness and jet damping of (5), (6), (13)
//! and (14).
//!
//! Actuators and the autopilot act on its gimbal rotations elsewhere.

use super::attached::Columns;
use super::drawn::DrawnEngine;
use super::gradient::{Attached, C, C3, Vectors, complex};
use super::{Effects, Layout, Model, NozzleJet};
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// How one engine is attached to the body at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Unit vector u of the thrust force on the vehicle.
    pub thrust_direction: Vector3<f64>,
    /// Gimbal axes T, orthonormal and normal to the thrust direction.
    pub axes: Matrix3x2<f64>,
    /// Translation of the gimbal per body coordinate: rigid columns where the rigid body is free
    /// (m/m and m/rad), then the nominal virtual gimbal shape Φ_g per mode, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Rotation of the gimbal per body coordinate: rigid columns, then the nominal virtual gimbal
    /// slope Ψ_g per mode, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
    /// Case jet damping per unit mass flow over the body coordinates, square, row-major (1/kg between
    /// modes); empty without a case.
    pub case_per_flow: Vec<f64>,
    /// Whether the modes already contain the engine's mass (integrated body).
    pub in_modes: bool,
    /// Number of the pair of actuators that moves it, as in `Engine::sets`.
    pub actuators: usize,
}

impl Attachment {
    /// Adds one drawn engine to the model.
    pub fn add(
        &self,
        engine: &DrawnEngine,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        effects: &Effects,
        model: &mut Model,
    ) {
        let motion = Motion::new(self, engine, columns);
        motion.add_mass(self, engine, columns, model);
        motion.add_thrust(self, engine, columns, effects, model);
        motion.add_jet(self, engine, columns, effects, model);
        motion.add_acceleration_stiffness(self, engine, columns, acceleration, model);
        for motion in [&motion.gimbal, &motion.rotation] {
            model.interface.add_motion(&motion[columns.rigid..columns.body]);
        }
    }

    /// Adds the jet damping of the case (14) for a mass flow, kg/s, `−ṁ C` over the body coordinates.
    pub fn add_case(&self, flow_kg_s: f64, layout: &Layout, model: &mut Model) {
        let body = layout.body().end;
        for (row, entries) in self.case_per_flow.chunks_exact(body).enumerate() {
            for (column, entry) in entries.iter().enumerate() {
                model.damping[(row, column)] -= flow_kg_s * entry;
                model.interface.add_full(0, [row, column], -flow_kg_s * entry);
            }
        }
    }
}

/// Motion of an engine per unit rate of each local column: gimbal point and rotations.
struct Motion {
    /// Translation of the gimbal point: rigid body, Φ_g, then 0.
    gimbal: Vec<Vector3<f64>>,
    /// Rotation of the nozzle: rigid body, Ψ_g, then T.
    rotation: Vec<Vector3<f64>>,
}

impl Motion {
    fn new(attachment: &Attachment, engine: &DrawnEngine, columns: &Columns) -> Self {
        let mut gimbal = attachment.shape.clone();
        let mut rotation = attachment.slope.clone();
        gimbal.resize(columns.count(), Vector3::zeros());
        let modes = columns.rigid..columns.body;
        for (mode, local) in modes.enumerate() {
            gimbal[local] *= engine.shape_gain[mode];
            rotation[local] *= engine.slope_gain[mode];
        }
        if columns.count() > columns.body {
            rotation.extend(attachment.axes.column_iter().map(|axis| axis.into_owned()));
        }
        Self { gimbal, rotation }
    }

    /// Mass as a congruence `Bᵀ blkdiag(m 1₃, J_c) B` with `u_c = ξ − (r_g + r_e)× θ + Φ_g η −
    /// r_e× (Ψ_g η + T Θ)` and `ρ_c = θ + Ψ_g η + T Θ`. For an integrated body only the blocks with a
    /// Θ index.
    fn add_mass(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        model: &mut Model,
    ) {
        let axis = -attachment.thrust_direction;
        let cg = axis * engine.cg_m;
        let inertia = engine.central_inertia_tensor(&axis);
        for b in 0..columns.count() {
            let momentum = (self.gimbal[b] + self.rotation[b].cross(&cg)) * engine.mass_kg;
            let angular = inertia * self.rotation[b];
            // Moment of momentum about the gimbal, so that each row needs its gimbal motion only.
            let angular = angular + cg.cross(&momentum);
            for a in 0..=b {
                if attachment.in_modes && b < columns.body {
                    continue;
                }
                let value = self.gimbal[a].dot(&momentum) + self.rotation[a].dot(&angular);
                let (row, column) = (columns.coordinate(a), columns.coordinate(b));
                model.mass[(row, column)] += value;
                if row != column {
                    model.mass[(column, row)] += value;
                }
            }
        }
    }

    /// Thrust on the body: `−R u× T Θ` at the displaced gimbal, with follower thrust `−R u× Ψ_g η`
    /// besides. Of the rigid body: `−R u× θ` on the translation, `−R u× Φ_g η` as a moment, and none
    /// from θ on the rotation, since gimbal and thrust turn together.
    fn add_thrust(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let thrust = attachment.thrust_direction * (effects.thrust * engine.thrust_n);
        let first = if effects.follower_thrust { columns.rigid } else { columns.body };
        for local in first..columns.count() {
            let force = thrust.cross(&self.rotation[local]);
            for body in 0..columns.body {
                model.stiffness[(body, columns.coordinate(local))] += self.gimbal[body].dot(&force);
            }
        }
        for (axis, rotation) in columns.rotation.clone().enumerate() {
            let force = thrust.cross(&Vector3::ith(axis, 1.0));
            for translation in 0..3 {
                model.stiffness[(translation, rotation)] += force[translation];
            }
            for mode in columns.rigid..columns.body {
                model.stiffness[(rotation, mode)] += thrust.cross(&self.gimbal[mode])[axis];
            }
        }
    }

    /// Jet damping of the nozzle: (13), or exactly `∫ 2ṁ (Φ_g − x î× ρ)ᵀ î× ρ̇ dx` over the nozzle with ρ its rotation.
    fn add_jet(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let flow = effects.thrust * engine.mass_flow_kg_s;
        let body = columns.body;
        if effects.nozzle_jet_damping == NozzleJet::Off {
            return;
        }
        let exhaust = -attachment.thrust_direction;
        let length = engine.length_m;
        let normal = Matrix3::identity() - exhaust * exhaust.transpose();
        for b in 0..columns.count() {
            let force = exhaust.cross(&self.rotation[b]) * (2.0 * flow * length);
            let column = columns.coordinate(b);
            for row in 0..body {
                model.damping[(row, column)] -= self.gimbal[row].dot(&force);
            }
            if effects.nozzle_jet_damping == NozzleJet::RigidNozzle {
                let moment = normal * self.rotation[b] * (flow * length * length);
                for a in 0..columns.count() {
                    model.damping[(columns.coordinate(a), column)] += self.rotation[a].dot(&moment);
                }
            }
        }
    }

    /// Stiffness of `V = m g0 · (second-order displacement of the cg)`: `Tᵀ m g0× r_e× T` on the gimbal
    /// rotations, and with the rigid body free `K_ηΘ = m Ψ_gᵀ g0× r_e× T` and the terms of θ.
    fn add_acceleration_stiffness(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        model: &mut Model,
    ) {
        let cg = -attachment.thrust_direction * engine.cg_m;
        for local in columns.body..columns.count() {
            // Tᵀ (m g0× r_e×) T = −m (g0 · r_e) 1, since T is normal to r_e.
            let at = columns.coordinate(local);
            model.stiffness[(at, at)] += -engine.mass_kg * acceleration.dot(&cg);
        }
        if columns.rigid == 0 {
            return;
        }
        for local in columns.body..columns.count() {
            let moment = acceleration.cross(&cg.cross(&self.rotation[local])) * engine.mass_kg;
            let column = columns.coordinate(local);
            for mode in columns.rigid..columns.body {
                let value = self.rotation[mode].dot(&moment);
                model.stiffness[(mode, column)] += value;
                model.stiffness[(column, mode)] += value;
            }
        }
        let displacement: Vec<Vector3<f64>> = (self.gimbal.iter().zip(&self.rotation))
            .map(|(gimbal, rotation)| gimbal + rotation.cross(&cg))
            .collect();
        columns.add_rotation_stiffness(
            &displacement,
            engine.mass_kg,
            acceleration,
            attachment.in_modes,
            model,
        );
    }
}

/// What an engine sees of a vector: motion of the gimbal and rotation of the nozzle, by what causes them.
struct Side {
    /// Translation of the gimbal by rigid translation.
    moved: C3,
    /// … by rigid rotation.
    turned: C3,
    /// … by the modes.
    elastic: C3,
    /// Rotation of the nozzle by rigid rotation.
    rigid: C3,
    /// … by the modes.
    slope: C3,
    /// … by the gimbal rotations.
    own: C3,
    /// The rigid translation itself.
    translation: C3,
    /// The rigid rotation itself.
    rotation: C3,
}

impl Side {
    fn new(attachment: &Attachment, engine: &DrawnEngine, columns: &Columns, z: &[C]) -> Self {
        let (turning, rigid, body) = (columns.rotation.clone(), columns.rigid, columns.body);
        let sum = |of: &[Vector3<f64>], locals: std::ops::Range<usize>| {
            locals.map(|local| complex(&of[local]) * z[local]).sum::<C3>()
        };
        let gained = |of: &[Vector3<f64>], gains: &[f64]| {
            let modes = (rigid..body).zip(gains);
            modes.map(|(local, gain)| complex(&of[local]) * (z[local] * *gain)).sum::<C3>()
        };
        let own = (body..columns.count()).zip(attachment.axes.column_iter());
        Self {
            moved: sum(&attachment.shape, 0..turning.start),
            turned: sum(&attachment.shape, turning.clone()),
            elastic: gained(&attachment.shape, &engine.shape_gain),
            rigid: sum(&attachment.slope, 0..rigid),
            slope: gained(&attachment.slope, &engine.slope_gain),
            own: own.map(|(k, axis)| complex(&axis.into_owned()) * z[columns.coordinate(k)]).sum(),
            translation: if rigid > 0 { C3::new(z[0], z[1], z[2]) } else { C3::zeros() },
            rotation: columns.rotation_of(z),
        }
    }

    /// Translation of the gimbal.
    fn gimbal(&self) -> C3 {
        self.moved + self.turned + self.elastic
    }

    /// Rotation of the nozzle.
    fn nozzle(&self) -> C3 {
        self.rigid + self.slope + self.own
    }

    /// Translation of a point `arm` from the gimbal, and rotation, by the body alone or with the gimbal.
    fn cg(&self, arm: &C3, with_own: bool) -> (C3, C3) {
        let rotation = if with_own { self.nozzle() } else { self.rigid + self.slope };
        (self.gimbal() + rotation.cross(arm), rotation)
    }

    /// Displacement at `arm` on which a turning vehicle's acceleration acts, as translation of the gimbal
    /// and rotation.
    fn carried(&self, turning: bool, in_modes: bool) -> (C3, C3) {
        match (in_modes, turning) {
            (true, _) => (C3::zeros(), self.own),
            (false, true) => (self.turned + self.elastic, self.nozzle()),
            (false, false) => (self.elastic, self.slope + self.own),
        }
    }
}

/// Gradient by the numbers of the same names in [`DrawnEngine`].
#[derive(Debug, Clone, Default)]
pub struct EngineGradient {
    /// By the thrust.
    pub thrust_n: C,
    /// By the mass flow.
    pub mass_flow_kg_s: C,
    /// By the moving mass.
    pub mass_kg: C,
    /// By the distance of the cg.
    pub cg_m: C,
    /// By the transverse inertia about the gimbal.
    pub inertia_kg_m2: C,
    /// By the inertia about the nozzle axis.
    pub axial_inertia_kg_m2: C,
    /// By the nozzle length.
    pub length_m: C,
    /// By the gain on each gimbal shape.
    pub shape_gain: Vec<C>,
    /// By the gain on each gimbal slope.
    pub slope_gain: Vec<C>,
    /// By a stiffness on each gimbal rotation; none for a locked engine.
    pub gimbal: Option<[C; 2]>,
}

impl Attachment {
    /// The part of one drawn engine in the form of [`super::gradient`] (without actuators), and its
    /// gradient with the mean acceleration held.
    ///
    /// Term by term as it is added to the model; by the projections of a `Side` the form is of at most
    /// the second degree in each number.
    pub fn form(
        &self,
        engine: &DrawnEngine,
        columns: &Columns,
        acceleration: &Vector3<f64>,
        effects: &Effects,
        vectors: &Vectors<'_>,
    ) -> (Attached, EngineGradient) {
        let s = vectors.s;
        let real = C::from;
        let [y, x] = [vectors.left, vectors.right].map(|z| Side::new(self, engine, columns, z));
        let mut to = EngineGradient::default();
        let mut value = real(0.0);
        // Gradients by the elastic translation and rotation of the gimbal in either vector.
        let mut by_shape = [C3::zeros(); 2];
        let mut by_slope = [C3::zeros(); 2];

        // Inertia: s² (m D·D + ρ·J_c ρ), for an integrated body less the same of the body alone.
        let exhaust = complex(&-self.thrust_direction);
        let arm = exhaust * real(engine.cg_m);
        let mass = real(engine.mass_kg);
        let square = s * s;
        let axial = |r: &C3| exhaust * exhaust.dot(r);
        let transverse = |r: &C3| r - axial(r);
        let (j_c, j_a) = (real(engine.central_inertia_kg_m2()), real(engine.axial_inertia_kg_m2));
        let parts: &[(bool, f64)] =
            if self.in_modes { &[(true, 1.0), (false, -1.0)] } else { &[(true, 1.0)] };
        for &(with_own, sign) in parts {
            let weight = square * sign;
            let ((d_y, r_y), (d_x, r_x)) = (y.cg(&arm, with_own), x.cg(&arm, with_own));
            let across = r_y.dot(&transverse(&r_x));
            let along = r_y.dot(&axial(&r_x));
            let moved = d_y.dot(&d_x);
            value += weight * (mass * moved + j_c * across + j_a * along);
            // J_c = J_G − m r².
            to.mass_kg += weight * (moved - across * engine.cg_m * engine.cg_m);
            let lever = r_y.cross(&exhaust).dot(&d_x) + d_y.dot(&r_x.cross(&exhaust));
            to.cg_m += weight * mass * (lever - across * (2.0 * engine.cg_m));
            to.inertia_kg_m2 += weight * across;
            to.axial_inertia_kg_m2 += weight * along;
            for (side, (d, r)) in [(d_x, r_x), (d_y, r_y)].into_iter().enumerate() {
                let momentum = d * mass;
                let angular = transverse(&r) * j_c + axial(&r) * j_a;
                by_shape[side] += momentum * weight;
                by_slope[side] += (arm.cross(&momentum) + angular) * weight;
            }
        }

        // Thrust.
        let unit = complex(&(self.thrust_direction * effects.thrust));
        let thrust = unit * real(engine.thrust_n);
        let turned = if effects.follower_thrust { x.own + x.slope } else { x.own };
        let per_thrust = y.gimbal().dot(&unit.cross(&turned))
            + y.translation.dot(&unit.cross(&x.rotation))
            + y.rotation.dot(&unit.cross(&x.elastic));
        value += per_thrust * engine.thrust_n;
        to.thrust_n = per_thrust;
        by_shape[0] += thrust.cross(&turned);
        by_shape[1] += y.rotation.cross(&thrust);
        if effects.follower_thrust {
            by_slope[1] += y.gimbal().cross(&thrust);
        }

        // Jet damping.
        let mut per_flow = real(0.0);
        if effects.case_jet_damping && !self.case_per_flow.is_empty() {
            // Row by row onto the columns, whose sums do not wait for each other.
            let mut sums = vec![[0.0; 2]; columns.body];
            for (left, entries) in
                vectors.left.iter().zip(self.case_per_flow.chunks_exact(columns.body))
            {
                for ([re, im], entry) in sums.iter_mut().zip(entries) {
                    *re += left.re * entry;
                    *im += left.im * entry;
                }
            }
            let sums = sums.iter().zip(vectors.right);
            per_flow -= s * sums.map(|([re, im], x)| C::new(*re, *im) * x).sum::<C>();
        }
        let (flow, length) = (effects.thrust * engine.mass_flow_kg_s, engine.length_m);
        if effects.nozzle_jet_damping != NozzleJet::Off {
            let bend = s * y.gimbal().dot(&exhaust.cross(&x.nozzle())) * -2.0;
            per_flow += bend * length;
            to.length_m += bend * flow;
            let weight = s * (-2.0 * flow * length);
            by_shape[0] += exhaust.cross(&x.nozzle()) * weight;
            by_slope[1] += y.gimbal().cross(&exhaust) * weight;
            if effects.nozzle_jet_damping == NozzleJet::RigidNozzle {
                let across = s * y.nozzle().dot(&transverse(&x.nozzle()));
                per_flow += across * (length * length);
                to.length_m += across * (2.0 * flow * length);
                let weight = s * (flow * length * length);
                by_slope[0] += transverse(&x.nozzle()) * weight;
                by_slope[1] += transverse(&y.nozzle()) * weight;
            }
        }
        value += per_flow * flow;
        to.mass_flow_kg_s = per_flow * effects.thrust;

        // Acceleration stiffness: m g0 · (translation part + cg × rotation part), linear in g0 and r_e.
        let g0 = complex(acceleration);
        let own: C =
            (columns.body..columns.count()).map(|k| vectors.product(columns.coordinate(k))).sum();
        let mut by_g0 = -arm * own;
        let mut per_cg = -exhaust.dot(&g0) * own;
        if columns.rigid > 0 {
            for (side, (a, b)) in [(&y, &x), (&x, &y)].into_iter().enumerate() {
                // Ψᵀ g0× (r_e × T Θ), either way.
                by_g0 += arm.cross(&b.own).cross(&a.slope);
                per_cg += a.slope.dot(&g0.cross(&exhaust.cross(&b.own)));
                by_slope[side] += g0.cross(&arm.cross(&b.own)) * mass;
                // −d · (θ × g0), the rigid translation of d left out, and from θ on itself but once.
                let (translation, rotation) = a.carried(side == 0, self.in_modes);
                let carried = translation + rotation.cross(&arm);
                by_g0 -= carried.cross(&b.rotation);
                let force = b.rotation.cross(&g0);
                per_cg -= rotation.cross(&exhaust).dot(&force);
                if !self.in_modes {
                    by_shape[side] -= force * mass;
                    by_slope[side] -= arm.cross(&force) * mass;
                }
            }
        }
        let per_mass = by_g0.dot(&g0);
        value += per_mass * mass;
        to.mass_kg += per_mass;
        to.cg_m += per_cg * mass;

        to.shape_gain.reserve_exact(columns.body - columns.rigid);
        to.slope_gain.reserve_exact(columns.body - columns.rigid);
        for (local, (shape, slope)) in
            self.shape.iter().zip(&self.slope).enumerate().skip(columns.rigid)
        {
            let gain = |nominal: &Vector3<f64>, by: &[C3; 2]| {
                let nominal = complex(nominal);
                nominal.dot(&by[0]) * vectors.left[local]
                    + nominal.dot(&by[1]) * vectors.right[local]
            };
            to.shape_gain.push(gain(shape, &by_shape));
            to.slope_gain.push(gain(slope, &by_slope));
        }
        (Attached { value, acceleration: by_g0 * mass }, to)
    }
}
