//! Assembly of the equations of motion (5) and (6) with jet damping (13) and (14).
//!
//! One `Plant` a flight time holds what no draw changes; `assemble` adds up one drawn vehicle.
//! Poles and vectors are found in `modal`.

use super::drawn::{DrawnEngine, DrawnVehicle};
use super::{Layout, Model};
use nalgebra::{Matrix3, Matrix3x2, Vector3};

/// How the nozzle flow enters as jet damping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NozzleJet {
    /// No nozzle jet damping.
    Off,
    /// Equation (13): the part linear in the nozzle length.
    Linear,
    /// Exact for a rigid nozzle with straight flow; also damps the nozzle's own rotation.
    RigidNozzle,
}

/// Which effects act, beside structure, inertia and actuators.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// Factor on thrust, mean acceleration and mass flow, − (1 in flight, 0 with thrust off;
    /// values between serve the continuation of poles).
    pub thrust: f64,
    /// Case jet damping (14).
    pub case_jet_damping: bool,
    /// Nozzle jet damping.
    pub nozzle_jet_damping: NozzleJet,
    /// Thrust that follows elastic rotation, `−Φ_gᵀ R u× Ψ_g η`.
    pub follower_thrust: bool,
}

/// How one engine is attached to the elastic body at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Attachment {
    /// Unit vector u of the thrust force on the vehicle.
    pub thrust_direction: Vector3<f64>,
    /// Gimbal axes T, orthonormal and normal to the thrust direction.
    pub axes: Matrix3x2<f64>,
    /// Nominal virtual gimbal shape Φ_g per mode, kg^-1/2.
    pub shape: Vec<Vector3<f64>>,
    /// Nominal virtual gimbal slope Ψ_g per mode, rad/m per kg^1/2.
    pub slope: Vec<Vector3<f64>>,
    /// Case jet damping per unit mass flow, k×k row-major, 1/kg; empty without a case.
    pub case_per_flow: Vec<f64>,
    /// Whether the modes already contain the engine's mass (integrated body).
    pub in_modes: bool,
    /// Number of its set of actuators, as in `Engine::sets`.
    pub actuators: usize,
}

/// What no draw changes, at one flight time.
#[derive(Debug, Clone, PartialEq)]
pub struct Plant {
    /// Coordinates.
    pub layout: Layout,
    /// Mass of the body whose modes these are, kg.
    pub body_mass_kg: f64,
    /// One attachment per engine of the vehicle.
    pub attachments: Vec<Attachment>,
}

/// Entry ranges of one engine while it is added: elastic columns, then its gimbal columns.
struct Columns {
    elastic: usize,
    gimbal: Option<usize>,
}

impl Columns {
    fn count(&self) -> usize {
        self.elastic + if self.gimbal.is_some() { 2 } else { 0 }
    }

    /// Coordinate of local column `local`.
    fn coordinate(&self, local: usize) -> usize {
        match self.gimbal {
            Some(first) if local >= self.elastic => first + local - self.elastic,
            _ => local,
        }
    }
}

impl Plant {
    /// Mean acceleration g0 = Σ R u / M_total over all engines, m/s².
    fn mean_acceleration(&self, drawn: &DrawnVehicle, factor: f64) -> Vector3<f64> {
        let mut force = Vector3::zeros();
        let mut mass = self.body_mass_kg;
        for (attachment, engine) in self.attachments.iter().zip(&drawn.engines) {
            force += attachment.thrust_direction * (factor * engine.thrust_n);
            if !attachment.in_modes {
                mass += engine.mass_kg;
            }
        }
        force / mass
    }

    /// Builds the model of `drawn` under `effects` into `model`, which has the layout's size.
    pub fn assemble(&self, drawn: &DrawnVehicle, effects: &Effects, model: &mut Model) {
        model.clear();
        for mode in self.layout.elastic() {
            let omega = drawn.body.frequency_rad_s[mode];
            model.mass[(mode, mode)] = 1.0;
            model.damping[(mode, mode)] = 2.0 * drawn.body.damping_ratio[mode] * omega;
            model.stiffness[(mode, mode)] = omega * omega;
        }
        let acceleration = self.mean_acceleration(drawn, effects.thrust);
        for (index, (attachment, engine)) in self.attachments.iter().zip(&drawn.engines).enumerate()
        {
            let columns =
                Columns { elastic: attachment.shape.len(), gimbal: self.layout.gimbal(index) };
            let motion = Motion::new(attachment, engine, &columns);
            motion.add_mass(attachment, engine, &columns, model);
            motion.add_thrust(attachment, engine, &columns, effects, model);
            motion.add_jet(attachment, engine, &columns, effects, model);
            if let Some(first) = columns.gimbal {
                // Tᵀ (m g0× r_e×) T = −m (g0 · r_e) 1, since T is normal to r_e.
                let cg = -attachment.thrust_direction * engine.cg_m;
                let gravity = -engine.mass_kg * acceleration.dot(&cg);
                for axis in 0..2 {
                    let at = (first + axis, first + axis);
                    let actuator = &engine.actuators[attachment.actuators][axis];
                    model.stiffness[at] += actuator.stiffness_n_m_rad + gravity;
                    model.damping[at] += actuator.damping_n_m_s_rad;
                }
            }
        }
    }
}

/// Motion of an engine per unit rate of each local column: gimbal point and rotations.
struct Motion {
    /// Translation of the gimbal point: Φ_g, then 0.
    gimbal: Vec<Vector3<f64>>,
    /// Rotation of the nozzle: Ψ_g, then T.
    rotation: Vec<Vector3<f64>>,
}

impl Motion {
    fn new(attachment: &Attachment, engine: &DrawnEngine, columns: &Columns) -> Self {
        let count = columns.count();
        let mut gimbal = vec![Vector3::zeros(); count];
        let mut rotation = vec![Vector3::zeros(); count];
        for mode in 0..columns.elastic {
            gimbal[mode] = attachment.shape[mode] * engine.shape_gain[mode];
            rotation[mode] = attachment.slope[mode] * engine.slope_gain[mode];
        }
        for (rotation, axis) in
            rotation[columns.elastic..].iter_mut().zip(attachment.axes.column_iter())
        {
            *rotation = axis.into_owned();
        }
        Self { gimbal, rotation }
    }

    /// Mass as a congruence `Bᵀ blkdiag(m 1₃, J_c) B` with `u_c = Φ_g η − r_e× (Ψ_g η + T Θ)` and
    /// `ρ_c = Ψ_g η + T Θ`. For an integrated body only the blocks with a Θ index.
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
                if attachment.in_modes && b < columns.elastic {
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

    /// Thrust on the modes: `Q_η = −Φ_gᵀ R u× T Θ`, and with follower thrust `−Φ_gᵀ R u× Ψ_g η`.
    fn add_thrust(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let thrust = attachment.thrust_direction * (effects.thrust * engine.thrust_n);
        let first = if effects.follower_thrust { 0 } else { columns.elastic };
        for local in first..columns.count() {
            let force = thrust.cross(&self.rotation[local]);
            for mode in 0..columns.elastic {
                model.stiffness[(mode, columns.coordinate(local))] += self.gimbal[mode].dot(&force);
            }
        }
    }

    /// Jet damping of the case (14) and of the nozzle: (13), or exactly
    /// `∫ 2ṁ (Φ_g − x î× ρ)ᵀ î× ρ̇ dx` over the nozzle with ρ its rotation.
    fn add_jet(
        &self,
        attachment: &Attachment,
        engine: &DrawnEngine,
        columns: &Columns,
        effects: &Effects,
        model: &mut Model,
    ) {
        let flow = effects.thrust * engine.mass_flow_kg_s;
        let modes = columns.elastic;
        if effects.case_jet_damping && !attachment.case_per_flow.is_empty() {
            for (row, entries) in attachment.case_per_flow.chunks_exact(modes).enumerate() {
                for (column, entry) in entries.iter().enumerate() {
                    model.damping[(row, column)] -= flow * entry;
                }
            }
        }
        if effects.nozzle_jet_damping == NozzleJet::Off {
            return;
        }
        let exhaust = -attachment.thrust_direction;
        let length = engine.length_m;
        let normal = Matrix3::identity() - exhaust * exhaust.transpose();
        for b in 0..columns.count() {
            let force = exhaust.cross(&self.rotation[b]) * (2.0 * flow * length);
            let column = columns.coordinate(b);
            for mode in 0..modes {
                model.damping[(mode, column)] -= self.gimbal[mode].dot(&force);
            }
            if effects.nozzle_jet_damping == NozzleJet::RigidNozzle {
                let moment = normal * self.rotation[b] * (flow * length * length);
                for a in 0..columns.count() {
                    model.damping[(columns.coordinate(a), column)] += self.rotation[a].dot(&moment);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{DrawnActuator, DrawnBody};
    use nalgebra::{DMatrix, Matrix3xX};

    /// Three modes and one canted engine, with no symmetry to hide a mistake.
    fn skewed() -> (Plant, DrawnVehicle) {
        let axis = Vector3::new(0.98, 0.15, -0.1).normalize();
        let first = axis.cross(&Vector3::new(0.1, 0.8, 0.5)).normalize();
        let second = axis.cross(&first);
        let shape = vec![
            Vector3::new(1e-4, 2.1e-3, -0.4e-3),
            Vector3::new(-0.2e-3, 0.3e-3, 2.8e-3),
            Vector3::new(0.5e-3, -1.7e-3, 0.9e-3),
        ];
        let slope = vec![
            Vector3::new(0.2e-4, -0.1e-3, 2.9e-4),
            Vector3::new(0.6e-4, -3.4e-4, 0.3e-4),
            Vector3::new(-0.5e-4, 1.1e-4, -2.2e-4),
        ];
        let plant = Plant {
            layout: Layout::new(
                ["m001", "m002", "m003"],
                [("booster.left".to_owned(), ["rock", "tilt"], true)],
            ),
            body_mass_kg: 4.0e5,
            attachments: vec![Attachment {
                thrust_direction: -axis,
                axes: Matrix3x2::from_columns(&[first, second]),
                shape,
                slope,
                case_per_flow: Vec::new(),
                in_modes: false,
                actuators: 0,
            }],
        };
        let drawn = DrawnVehicle {
            body: DrawnBody {
                frequency_rad_s: vec![11.0, 32.0, 39.0],
                damping_ratio: vec![0.005, 0.004, 0.006],
            },
            engines: vec![DrawnEngine {
                thrust_n: 1.2e7,
                mass_flow_kg_s: 4700.0,
                mass_kg: 7500.0,
                cg_m: 0.68,
                inertia_kg_m2: 2.2e4,
                axial_inertia_kg_m2: 1.5e4,
                length_m: 4.0,
                actuators: vec![[
                    DrawnActuator::spring(3.7e7, 5.6e5),
                    DrawnActuator::spring(3.9e7, 5.1e5),
                ]],
                shape_gain: vec![1.0, 1.1, 0.95],
                slope_gain: vec![0.9, 1.0, 1.2],
            }],
            ..DrawnVehicle::default()
        };
        (plant, drawn)
    }

    const NOTHING: Effects = Effects {
        thrust: 0.0,
        case_jet_damping: false,
        nozzle_jet_damping: NozzleJet::Off,
        follower_thrust: false,
    };

    fn assembled(plant: &Plant, drawn: &DrawnVehicle, effects: &Effects) -> Model {
        let mut model = Model::zeros(plant.layout.coordinates());
        plant.assemble(drawn, effects, &mut model);
        model
    }

    /// Φ_g, Ψ_g (3×k), r_e and J_G as the paper writes them.
    fn symbols(
        plant: &Plant,
        drawn: &DrawnVehicle,
    ) -> (Matrix3xX<f64>, Matrix3xX<f64>, Vector3<f64>, Matrix3<f64>) {
        let (at, engine) = (&plant.attachments[0], &drawn.engines[0]);
        let k = at.shape.len();
        let phi = Matrix3xX::from_fn(k, |i, j| at.shape[j][i] * engine.shape_gain[j]);
        let psi = Matrix3xX::from_fn(k, |i, j| at.slope[j][i] * engine.slope_gain[j]);
        let axis = -at.thrust_direction;
        let along = axis * axis.transpose();
        let j_g = along * engine.axial_inertia_kg_m2
            + (Matrix3::identity() - along) * engine.inertia_kg_m2;
        (phi, psi, axis * engine.cg_m, j_g)
    }

    fn block(
        matrix: &faer::Mat<f64>,
        rows: std::ops::Range<usize>,
        columns: std::ops::Range<usize>,
    ) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| {
            matrix[(rows.start + i, columns.start + j)]
        })
    }

    fn assert_close(a: &DMatrix<f64>, b: &DMatrix<f64>) {
        let scale = a.amax().max(b.amax());
        assert!((a - b).amax() <= 1e3 * f64::EPSILON * scale, "{a} differs from {b}");
    }

    #[test]
    fn the_mass_matrix_has_the_blocks_of_equations_5_and_6() {
        let (plant, drawn) = skewed();
        let model = assembled(&plant, &drawn, &NOTHING);
        let (phi, psi, r_e, j_g) = symbols(&plant, &drawn);
        let m = drawn.engines[0].mass_kg;
        let t = plant.attachments[0].axes;
        let cross = r_e.cross_matrix();
        let gamma = &phi - cross * &psi;
        let elastic = DMatrix::identity(3, 3)
            + gamma.transpose() * m * &gamma
            + psi.transpose() * (j_g + cross * cross * m) * &psi;
        assert_close(
            &block(&model.mass, 0..3, 0..3),
            &DMatrix::from_iterator(3, 3, elastic.iter().copied()),
        );
        let coupling = t.transpose() * (cross * &phi * m + j_g * &psi);
        assert_close(
            &block(&model.mass, 3..5, 0..3),
            &DMatrix::from_iterator(2, 3, coupling.iter().copied()),
        );
        let engine = t.transpose() * j_g * t;
        assert_close(
            &block(&model.mass, 3..5, 3..5),
            &DMatrix::from_iterator(2, 2, engine.iter().copied()),
        );
        assert_close(&block(&model.mass, 0..5, 0..5), &block(&model.mass, 0..5, 0..5).transpose());
    }

    #[test]
    fn the_stiffness_has_thrust_acceleration_and_follower_terms() {
        let (plant, drawn) = skewed();
        let on = Effects { thrust: 1.0, follower_thrust: true, ..NOTHING };
        let model = assembled(&plant, &drawn, &on);
        let (phi, psi, r_e, _) = symbols(&plant, &drawn);
        let (at, engine) = (&plant.attachments[0], &drawn.engines[0]);
        let force = (at.thrust_direction * engine.thrust_n).cross_matrix();
        let thrust = phi.transpose() * force * at.axes;
        assert_close(
            &block(&model.stiffness, 0..3, 3..5),
            &DMatrix::from_iterator(3, 2, thrust.iter().copied()),
        );
        let follower = phi.transpose() * force * &psi;
        let omega = DMatrix::from_fn(3, 3, |i, j| {
            if i == j { drawn.body.frequency_rad_s[i].powi(2) } else { 0.0 }
        });
        let follower = omega + DMatrix::from_iterator(3, 3, follower.iter().copied());
        assert_close(&block(&model.stiffness, 0..3, 0..3), &follower);
        let g0 = at.thrust_direction * (engine.thrust_n / (plant.body_mass_kg + engine.mass_kg));
        let gravity = at.axes.transpose()
            * (g0.cross_matrix() * r_e.cross_matrix() * engine.mass_kg)
            * at.axes;
        let mut expected = DMatrix::from_iterator(2, 2, gravity.iter().copied());
        for axis in 0..2 {
            assert!(expected[(axis, axis)] > 0.0, "an engine aft of its pivot is stiffened");
            expected[(axis, axis)] += engine.actuators[0][axis].stiffness_n_m_rad;
        }
        assert_close(&block(&model.stiffness, 3..5, 3..5), &expected);
        assert_eq!(block(&model.stiffness, 3..5, 0..3), DMatrix::zeros(2, 3));
    }

    #[test]
    fn nozzle_jet_damping_is_equation_13_and_its_exact_form_adds_the_square_of_the_length() {
        let (plant, drawn) = skewed();
        let (phi, psi, _, _) = symbols(&plant, &drawn);
        let (at, engine) = (&plant.attachments[0], &drawn.engines[0]);
        let exhaust = -at.thrust_direction;
        let rotation = {
            let mut all = Matrix3xX::zeros(5);
            all.columns_mut(0, 3).copy_from(&psi);
            all.columns_mut(3, 2).copy_from(&at.axes);
            all
        };
        let still = assembled(&plant, &drawn, &NOTHING);
        let flow = engine.mass_flow_kg_s;
        let linear =
            phi.transpose() * exhaust.cross_matrix() * &rotation * (2.0 * flow * engine.length_m);
        for (nozzle_jet_damping, exact) in [(NozzleJet::Linear, 0.0), (NozzleJet::RigidNozzle, 1.0)]
        {
            let effects = Effects { thrust: 1.0, nozzle_jet_damping, ..NOTHING };
            let model = assembled(&plant, &drawn, &effects);
            let added = block(&model.damping, 0..5, 0..5) - block(&still.damping, 0..5, 0..5);
            let normal = Matrix3::identity() - exhaust * exhaust.transpose();
            let mut expected = rotation.transpose()
                * normal
                * &rotation
                * (exact * flow * engine.length_m.powi(2));
            for row in 0..3 {
                for column in 0..5 {
                    expected[(row, column)] -= linear[(row, column)];
                }
            }
            assert_close(&added, &expected);
        }
    }

    #[test]
    fn the_planar_pair_is_the_model_of_one_engine_and_one_mode() {
        let (phi, psi) = (2.8e-3, 3.4e-4);
        let (mut plant, mut drawn) = skewed();
        plant.layout = Layout::new(["m001"], [("booster.left".to_owned(), ["pitch", "yaw"], true)]);
        let at = &mut plant.attachments[0];
        at.thrust_direction = -Vector3::x();
        at.axes = Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]);
        at.shape = vec![Vector3::y() * phi];
        at.slope = vec![Vector3::z() * psi];
        drawn.body = DrawnBody { frequency_rad_s: vec![32.0], damping_ratio: vec![0.005] };
        let engine = &mut drawn.engines[0];
        engine.shape_gain = vec![1.0];
        engine.slope_gain = vec![1.0];
        let effects =
            Effects { thrust: 1.0, nozzle_jet_damping: NozzleJet::RigidNozzle, ..NOTHING };
        let model = assembled(&plant, &drawn, &effects);
        let engine = &drawn.engines[0];
        let (j, s) = (engine.inertia_kg_m2, engine.mass_kg * engine.cg_m);
        let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-13 * b.abs(), "{a} is not {b}");
        close(
            model.mass[(0, 0)],
            1.0 + engine.mass_kg * phi * phi + 2.0 * s * phi * psi + j * psi * psi,
        );
        close(model.mass[(2, 0)], j * psi + s * phi);
        close(model.mass[(2, 2)], j);
        close(model.stiffness[(0, 2)], phi * engine.thrust_n);
        assert_eq!(model.stiffness[(0, 1)], 0.0);
        // Verification case 6: η row ṁ(2 L φ + L² ψ)(ψ η̇ + β̇), β row ṁ L² (ψ η̇ + β̇).
        let (flow, length) = (engine.mass_flow_kg_s, engine.length_m);
        let row = flow * (2.0 * length * phi + length * length * psi);
        close(model.damping[(0, 2)], row);
        close(model.damping[(0, 0)], 2.0 * 0.005 * 32.0 + row * psi);
        close(model.damping[(2, 0)], flow * length * length * psi);
        close(model.damping[(2, 2)], engine.actuators[0][1].damping_n_m_s_rad + flow * length * length);
    }

    #[test]
    fn a_locked_engine_keeps_its_mass_and_an_integrated_one_adds_none_to_the_modes() {
        let (mut plant, drawn) = skewed();
        let free = assembled(&plant, &drawn, &NOTHING);
        plant.layout = Layout::new(
            ["m001", "m002", "m003"],
            [("booster.left".to_owned(), ["rock", "tilt"], false)],
        );
        let locked = assembled(&plant, &drawn, &NOTHING);
        assert_eq!(locked.coordinates(), 3);
        assert_eq!(block(&locked.mass, 0..3, 0..3), block(&free.mass, 0..3, 0..3));
        let (mut plant, drawn) = skewed();
        plant.attachments[0].in_modes = true;
        let integrated = assembled(&plant, &drawn, &NOTHING);
        assert_eq!(block(&integrated.mass, 0..3, 0..3), DMatrix::identity(3, 3));
        assert_eq!(block(&integrated.mass, 3..5, 0..5), block(&free.mass, 3..5, 0..5));
    }

    #[test]
    fn without_thrust_damping_and_flow_every_pole_is_on_the_axis() {
        let (plant, mut drawn) = skewed();
        drawn.body.damping_ratio = vec![0.0; 3];
        drawn.engines[0].actuators[0].iter_mut().for_each(|a| a.damping_n_m_s_rad = 0.0);
        let model = assembled(&plant, &drawn, &NOTHING);
        let mut poles = Vec::new();
        crate::modal::Solver::new(5).poles(&model, &mut poles).expect("solved");
        assert_eq!(poles.len(), 5);
        for pole in poles {
            assert!(pole.re.abs() <= 1e-13 * pole.norm(), "{pole}");
        }
    }

    #[test]
    fn the_same_poles_come_from_the_reduced_and_the_integrated_body() {
        // The integrated body's modes are those of the reduced body with the engine locked to it.
        let (plant, mut drawn) = skewed();
        drawn.engines[0].shape_gain = vec![1.0; 3];
        drawn.engines[0].slope_gain = vec![1.0; 3];
        drawn.body.damping_ratio = vec![0.0; 3];
        let effects = Effects { thrust: 1.0, ..NOTHING };
        let mut reduced = Vec::new();
        let mut solver = crate::modal::Solver::new(5);
        solver.poles(&assembled(&plant, &drawn, &effects), &mut reduced).expect("solved");

        let mass = block(&assembled(&plant, &drawn, &NOTHING).mass, 0..3, 0..3);
        let omega = DMatrix::from_fn(3, 3, |i, j| {
            if i == j { drawn.body.frequency_rad_s[i].powi(2) } else { 0.0 }
        });
        let lower = mass.cholesky().expect("positive definite").l();
        let inverse = lower.clone().try_inverse().expect("regular");
        let eigen = (&inverse * omega * inverse.transpose()).symmetric_eigen();
        let basis = inverse.transpose() * &eigen.eigenvectors;
        let mut integrated = plant.clone();
        let at = &mut integrated.attachments[0];
        at.in_modes = true;
        let combine = |values: &[Vector3<f64>]| -> Vec<Vector3<f64>> {
            (0..3).map(|j| (0..3).map(|i| values[i] * basis[(i, j)]).sum()).collect()
        };
        at.shape = combine(&plant.attachments[0].shape);
        at.slope = combine(&plant.attachments[0].slope);
        integrated.body_mass_kg += drawn.engines[0].mass_kg;
        drawn.body.frequency_rad_s = eigen.eigenvalues.iter().map(|v| v.sqrt()).collect();
        let mut same = Vec::new();
        solver.poles(&assembled(&integrated, &drawn, &effects), &mut same).expect("solved");
        for (a, b) in reduced.iter().zip(&same) {
            assert!((a - b).norm() <= 1e-12 * a.norm(), "{a} is not {b}");
        }
    }
}
