//! The assembled model against the blocks of the paper, closed forms and identities.

use super::*;
use crate::dynamics::DrawnBody;
use crate::dynamics::attached::rigid_motion;
use crate::dynamics::{DrawnActuator, DrawnAerodynamics, DrawnEngine, DrawnTank};
use crate::modal::spectrum::{Base, Spectrum};
use crate::modal::{Reference, Solver};
use nalgebra::{DMatrix, Matrix3, Matrix3x2, Matrix3xX};

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
        body: MassProperties {
            mass_kg: 4.0e5,
            cg_m: Vector3::new(60.0, 0.0, 0.0),
            inertia_kg_m2: Matrix3::new(2e7, 1e6, -2e6, 1e6, 3e8, 3e6, -2e6, 3e6, 3.1e8),
        },
        attachments: vec![Attachment {
            thrust_direction: -axis,
            axes: Matrix3x2::from_columns(&[first, second]),
            shape,
            slope,
            case_per_flow: Vec::new(),
            in_modes: false,
            actuators: 0,
        }],
        tanks: Vec::new(),
        aerodynamics: None,
        servo: None,
    };
    let drawn = DrawnVehicle {
        body: DrawnBody {
            frequency_rad_s: vec![11.0, 32.0, 39.0],
            damping_ratio: vec![0.005, 0.004, 0.006],
            inertia_gain: [1.0; 3],
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
    aerodynamics: 0.0,
    feedback: 0.0,
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
    let j_g =
        along * engine.axial_inertia_kg_m2 + (Matrix3::identity() - along) * engine.inertia_kg_m2;
    (phi, psi, axis * engine.cg_m, j_g)
}

fn block(
    matrix: &faer::Mat<f64>,
    rows: std::ops::Range<usize>,
    columns: std::ops::Range<usize>,
) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows.start + i, columns.start + j)])
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
    let omega =
        DMatrix::from_fn(
            3,
            3,
            |i, j| {
                if i == j { drawn.body.frequency_rad_s[i].powi(2) } else { 0.0 }
            },
        );
    let follower = omega + DMatrix::from_iterator(3, 3, follower.iter().copied());
    assert_close(&block(&model.stiffness, 0..3, 0..3), &follower);
    let g0 = at.thrust_direction * (engine.thrust_n / (plant.body.mass_kg + engine.mass_kg));
    let gravity =
        at.axes.transpose() * (g0.cross_matrix() * r_e.cross_matrix() * engine.mass_kg) * at.axes;
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
    for (nozzle_jet_damping, exact) in [(NozzleJet::Linear, 0.0), (NozzleJet::RigidNozzle, 1.0)] {
        let effects = Effects { thrust: 1.0, nozzle_jet_damping, ..NOTHING };
        let model = assembled(&plant, &drawn, &effects);
        let added = block(&model.damping, 0..5, 0..5) - block(&still.damping, 0..5, 0..5);
        let normal = Matrix3::identity() - exhaust * exhaust.transpose();
        let mut expected =
            rotation.transpose() * normal * &rotation * (exact * flow * engine.length_m.powi(2));
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
    drawn.body = DrawnBody {
        frequency_rad_s: vec![32.0],
        damping_ratio: vec![0.005],
        ..DrawnBody::default()
    };
    let engine = &mut drawn.engines[0];
    engine.shape_gain = vec![1.0];
    engine.slope_gain = vec![1.0];
    let effects = Effects { thrust: 1.0, nozzle_jet_damping: NozzleJet::RigidNozzle, ..NOTHING };
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
    let omega =
        DMatrix::from_fn(
            3,
            3,
            |i, j| {
                if i == j { drawn.body.frequency_rad_s[i].powi(2) } else { 0.0 }
            },
        );
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
    integrated.body.mass_kg += drawn.engines[0].mass_kg;
    drawn.body.frequency_rad_s = eigen.eigenvalues.iter().map(|v| v.sqrt()).collect();
    let mut same = Vec::new();
    solver.poles(&assembled(&integrated, &drawn, &effects), &mut same).expect("solved");
    for (a, b) in reduced.iter().zip(&same) {
        assert!((a - b).norm() <= 1e-12 * a.norm(), "{a} is not {b}");
    }
}

/// The skewed plant with rigid body and a tank, its reference away from the origin.
fn free() -> (Plant, DrawnVehicle) {
    let (mut plant, mut drawn) = skewed();
    let engines = [("booster.left".to_owned(), ["rock", "tilt"], true)];
    plant.layout = Layout::new(["m001", "m002", "m003"], engines)
        .with_rigid_body()
        .with_tanks([("lox", true)]);
    let rigid = |at: &Vector3<f64>| rigid_motion(at);
    let gimbal = Vector3::new(30.0, -6.35, 0.4);
    let at = &mut plant.attachments[0];
    let (shape, slope): (Vec<_>, Vec<_>) = rigid(&gimbal).into_iter().unzip();
    at.shape.splice(0..0, shape);
    at.slope.splice(0..0, slope);
    let (mut shape, mut slope): (Vec<_>, Vec<_>) =
        rigid(&Vector3::new(-15.0, 0.7, -0.2)).into_iter().unzip();
    for mode in 6..9 {
        shape.push(at.shape[mode] * -0.4 + Vector3::new(1e-4, 2e-4, -3e-4));
        slope.push(at.slope[mode] * 0.3);
    }
    let axis = Vector3::new(0.99, 0.1, 0.05).normalize();
    let first = axis.cross(&Vector3::z()).normalize();
    plant.tanks.push(TankAttachment {
        axes: Matrix3x2::from_columns(&[first, axis.cross(&first)]),
        shape,
        slope,
        in_modes: false,
    });
    drawn.tanks.push(DrawnTank { mass_kg: 1.2e5, frequency_rad_s: 3.4, damping_ratio: 0.01 });
    (plant, drawn)
}

#[test]
fn a_rigid_vehicle_has_its_total_mass_and_inertia() {
    let (mut plant, drawn) = free();
    let engines = [("booster.left".to_owned(), ["rock", "tilt"], false)];
    plant.layout = Layout::new(["m001", "m002", "m003"], engines)
        .with_rigid_body()
        .with_tanks([("lox", false)]);
    let model = assembled(&plant, &drawn, &NOTHING);
    let engine = &drawn.engines[0];
    let axis = -plant.attachments[0].thrust_direction;
    let masses = [
        (engine.mass_kg, Vector3::new(30.0, -6.35, 0.4) + axis * engine.cg_m),
        (drawn.tanks[0].mass_kg, Vector3::new(-15.0, 0.7, -0.2)),
    ];
    let mut inertia = plant.body.inertia_kg_m2 + engine.central_inertia_tensor(&axis);
    let mut total = plant.body.mass_kg;
    let mut moment = Vector3::zeros();
    for (mass, at) in masses {
        let cross = at.cross_matrix();
        inertia -= cross * cross * mass;
        total += mass;
        moment += at * mass;
    }
    let translation = DMatrix::identity(3, 3) * total;
    assert_close(&block(&model.mass, 0..3, 0..3), &translation);
    let expected = DMatrix::from_iterator(3, 3, inertia.iter().copied());
    assert_close(&block(&model.mass, 3..6, 3..6), &expected);
    let coupling = DMatrix::from_iterator(3, 3, (-moment.cross_matrix()).iter().copied());
    assert_close(&block(&model.mass, 0..3, 3..6), &coupling);
}

#[test]
fn a_turned_vehicle_that_accelerates_along_its_turned_thrust_is_in_equilibrium() {
    let (plant, drawn) = free();
    for follower_thrust in [false, true] {
        let effects = Effects { thrust: 1.0, follower_thrust, ..NOTHING };
        let model = assembled(&plant, &drawn, &effects);
        let acceleration = plant.mean_acceleration(&drawn, &effects);
        for axis in 0..3 {
            let turned = -acceleration.cross(&Vector3::ith(axis, 1.0));
            for row in 0..model.coordinates() {
                let inertia: Vec<f64> = (0..3).map(|i| model.mass[(row, i)] * turned[i]).collect();
                let stiffness = model.stiffness[(row, 3 + axis)];
                let residual = inertia.iter().sum::<f64>() + stiffness;
                let scale = inertia.iter().map(|v| v.abs()).sum::<f64>() + stiffness.abs();
                let name = plant.layout.name(row);
                assert!(
                    residual.abs() <= 1e2 * f64::EPSILON * scale,
                    "{name}: {residual} of {scale}"
                );
            }
        }
    }
}

/// The vectors of all poles are those of the state matrix less its null states and motion.
fn assert_vectors(model: &Model, solver: &mut Solver, poles: &[faer::c64]) {
    for &pole in poles {
        let reference = Reference::new(model, solver.pair(model, pole));
        let (right, left) = reference.state_vectors(model);
        let state = solver.state_matrix(model).expect("built");
        for row in 0..state.nrows() {
            let image: faer::c64 = (0..state.nrows()).map(|j| right[j] * state[(row, j)]).sum();
            let scale: f64 = (0..state.nrows()).map(|j| (right[j] * state[(row, j)]).norm()).sum();
            assert!((image - pole * right[row]).norm() <= 1e-9 * scale.max(1e-9), "row {row}");
        }
        let product: faer::c64 = left.iter().zip(&right).map(|(l, r)| l.conj() * r).sum();
        assert!((product - 1.0).norm() < 1e-6, "{product}");
    }
}

/// The vehicle of [`free`] in the air, its thrust off the centreline.
fn in_the_air() -> (Plant, DrawnVehicle) {
    let (mut plant, mut drawn) = free();
    plant.aerodynamics = Some(AerodynamicPlant {
        reference_m: plant.body.cg_m,
        area_m2: 50.0,
        length_m: 8.0,
        speed_m_s: 900.0,
        entries: Vec::new(),
    });
    drawn.aerodynamics = Some(DrawnAerodynamics {
        dynamic_pressure_pa: 2.5e4,
        normal_force_slope_1_rad: 4.0,
        center_of_pressure_x_m: 40.0,
        axial_force: 0.6,
        pitch_damping: -30.0,
        roll_damping: -0.5,
    });
    (plant, drawn)
}

const AIR: Effects = Effects { thrust: 1.0, aerodynamics: 1.0, ..NOTHING };

#[test]
fn a_turn_about_the_mean_acceleration_at_a_constant_angle_of_attack_costs_nothing() {
    let (plant, drawn) = in_the_air();
    let model = assembled(&plant, &drawn, &AIR);
    // Translations, the velocity along x, and this motion.
    assert_eq!(model.null_states, [0, 1, 2, 3, model.second_order]);
    let motion = model.null_motion.clone().expect("thrust off the centreline");
    assert_eq!((motion.state, motion.others.len()), (3, 4));
    let all = || std::iter::once((motion.state, 1.0)).chain(motion.others.iter().copied());
    for row in 0..model.coordinates() {
        let term = |(state, part): (usize, f64)| match state.checked_sub(model.second_order) {
            Some(rate) => model.damping[(row, rate)] * part,
            None => model.stiffness[(row, state)] * part,
        };
        let (sum, scale) = all().map(term).fold((0.0, 0.0), |(a, b), x| (a + x, b + f64::abs(x)));
        assert!(sum.abs() <= 1e2 * f64::EPSILON * scale, "row {row}: {sum} of {scale}");
    }
}

#[test]
fn poles_under_thrust_off_the_centreline_in_the_air_are_those_of_the_whole_state_matrix() {
    let (plant, drawn) = in_the_air();
    let mut model = assembled(&plant, &drawn, &AIR);
    let size = model.coordinates();
    let (mut solver, mut poles) = (Solver::new(size), Vec::new());
    solver.poles(&model, &mut poles).expect("solved");
    for &pole in &poles {
        let residual = solver.pair(&model, pole).residual;
        assert!(residual <= 1e2 * size as f64 * f64::EPSILON, "{pole}: {residual}");
    }
    assert_vectors(&model, &mut solver, &poles);
    let base = Base::of(&model, &mut solver).expect("solved");
    let certified = Spectrum::new().solve(&base, &model).expect("certified");
    assert_eq!(certified.len(), poles.len());
    for found in certified {
        let nearest = poles.iter().map(|s| (s - found.root).norm()).fold(f64::INFINITY, f64::min);
        // Beside the bound, the rounding of the dense solver.
        assert!(nearest <= found.bound + 1e-11 * found.root.norm().max(1.0), "{found:?} {nearest}");
    }
    // All but the motion, whose pole the whole matrix has near the origin.
    let solved: usize = poles.iter().map(|s| if s.im > 0.0 { 2 } else { 1 }).sum();
    assert_eq!(solved, 2 * size - 5);
    (model.null_states, model.null_motion) = (vec![0, 1, 2, model.second_order], None);
    let whole = solver.state_matrix(&model).expect("built").clone();
    let all = whole.complex_eigenvalues();
    for pole in &poles {
        let nearest = all.iter().map(|s| (s - pole).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-9 * pole.norm().max(1.0), "{pole}: {nearest}");
    }
    let least = all.iter().map(|s| s.norm()).fold(f64::INFINITY, f64::min);
    assert!(least < 1e-9, "{least}");
}

#[test]
fn between_two_vehicles_each_with_its_own_turn_there_is_a_model_that_is_solved() {
    let (plant, drawn) = in_the_air();
    let nominal = assembled(&plant, &drawn, &AIR);
    let mut other = drawn.clone();
    other.engines[0].thrust_n *= 1.1;
    other.aerodynamics.as_mut().expect("in the air").axial_force = 0.2;
    let case = assembled(&plant, &other, &AIR);
    assert_ne!(nominal.null_motion, case.null_motion);
    let mut between = Model::zeros(nominal.coordinates());
    for t in [0.0, 0.3, 1.0] {
        between.blend(&nominal, &case, t);
        let mut poles = Vec::new();
        Solver::new(between.coordinates()).poles(&between, &mut poles).expect("solved");
    }
}

#[test]
fn a_rigid_vehicle_in_the_air_has_its_textbook_short_period() {
    let (mut plant, mut drawn) = rigid_with_slosh(0.0);
    plant.layout = Layout::new([], [("booster.left".to_owned(), ["rock", "tilt"], false)]);
    plant.layout = plant.layout.with_rigid_body();
    (plant.tanks, drawn.tanks) = (Vec::new(), Vec::new());
    let (air, in_air) = in_the_air();
    let (mut air, mut in_air) = (air.aerodynamics.unwrap(), in_air.aerodynamics.unwrap());
    air.reference_m = Vector3::zeros();
    (in_air.center_of_pressure_x_m, in_air.axial_force) = (-7.0, 0.0);
    let [force, damping] = [in_air.normal_force_slope_1_rad, in_air.pitch_damping]
        .map(|coefficient| in_air.dynamic_pressure_pa * air.area_m2 * coefficient);
    let (speed, arm) = (air.speed_m_s, in_air.center_of_pressure_x_m);
    let damping = damping * air.length_m.powi(2) / (2.0 * speed);
    (plant.aerodynamics, drawn.aerodynamics) = (Some(air), Some(in_air));
    let model = assembled(&plant, &drawn, &Effects { aerodynamics: 1.0, ..NOTHING });
    let mut poles = Vec::new();
    Solver::new(6).poles(&model, &mut poles).expect("solved");
    // α̇ = q − N α/(m V), I q̇ = −N x_cp α + M_q q: forward of the cg it diverges.
    let (m, i) = (plant.body.mass_kg, plant.body.inertia_kg_m2[(2, 2)]);
    let (a, b) =
        (force / (m * speed) - damping / i, force * arm / i - force * damping / (m * speed * i));
    let root = (a * a / 4.0 - b).sqrt();
    for expected in [-a / 2.0 + root, -a / 2.0 - root] {
        let near = poles.iter().filter(|pole| (*pole - expected).norm() < 1e-9 * expected.abs());
        assert_eq!(near.count(), 2, "{expected} in pitch and yaw: {poles:?}");
    }
    // Beside these, roll; every heading and its velocity are at the origin.
    assert_eq!((poles.len(), model.null_states.len()), (5, 5));
}

#[test]
fn twelve_rigid_poles_are_null_by_construction_and_flow_leaves_those_it_does_not_damp() {
    let (plant, drawn) = free();
    let thrust = Effects { thrust: 1.0, ..NOTHING };
    let model = assembled(&plant, &drawn, &thrust);
    assert_eq!(model.null_states.len(), 12);
    let mut poles = Vec::new();
    crate::modal::Solver::new(model.coordinates()).poles(&model, &mut poles).expect("solved");
    // Three modes, two gimbal rotations, two slosh displacements.
    assert_eq!(poles.len(), 7);
    assert!(poles.iter().all(|pole| pole.norm() > 1.0));
    // The flow of one canted nozzle damps every rotation but that about the flow …
    let jet = Effects { nozzle_jet_damping: NozzleJet::Linear, ..thrust };
    let model = assembled(&plant, &drawn, &jet);
    assert_eq!(model.null_states.len(), 10);
    let mut solver = crate::modal::Solver::new(model.coordinates());
    solver.poles(&model, &mut poles).expect("solved");
    assert_eq!(poles.len(), 7 + 2);
    assert_vectors(&model, &mut solver, &poles);
    // … and two nozzles canted differently damp them all.
    let (mut two, mut pair) = (plant.clone(), drawn.clone());
    let mut other = two.attachments[0].clone();
    other.thrust_direction = Vector3::new(-0.98, 0.15, -0.1).normalize();
    other.axes.set_column(0, &other.thrust_direction.cross(&Vector3::z()).normalize());
    let second = other.thrust_direction.cross(&other.axes.column(0).into_owned());
    other.axes.set_column(1, &second);
    let opposite = rigid_motion(&Vector3::new(30.0, 6.35, 0.4));
    for (column, (shape, _)) in opposite.into_iter().enumerate() {
        other.shape[column] = shape;
    }
    two.attachments.push(other);
    pair.engines.push(DrawnEngine { mass_flow_kg_s: 5200.0, ..drawn.engines[0].clone() });
    let engines = ["left", "right"].map(|n| (format!("booster.{n}"), ["rock", "tilt"], true));
    two.layout = Layout::new(["m001", "m002", "m003"], engines)
        .with_rigid_body()
        .with_tanks([("lox", true)]);
    let model = assembled(&two, &pair, &jet);
    assert_eq!(model.null_states.len(), 9);
    crate::modal::Solver::new(model.coordinates()).poles(&model, &mut poles).expect("solved");
    assert_eq!(poles.len(), 9 + 3);
}

#[test]
fn the_null_states_are_the_zero_poles_of_the_whole_state_matrix() {
    // A dense solve of all states returns the null chain as |s| of order ε^¼.
    let (plant, drawn) = free();
    let mut model = assembled(&plant, &drawn, &Effects { thrust: 1.0, ..NOTHING });
    let mut deflated = Vec::new();
    let mut solver = crate::modal::Solver::new(model.coordinates());
    solver.poles(&model, &mut deflated).expect("solved");
    model.null_states.clear();
    let whole = solver.state_matrix(&model).expect("built").clone();
    let all = whole.complex_eigenvalues();
    let zeros = all.iter().filter(|s| s.norm() < 0.1).count();
    assert_eq!(zeros, 12);
    for pole in &deflated {
        let nearest = all.iter().map(|s| (s - pole).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-7 * pole.norm(), "{pole}: {nearest}");
    }
}

#[test]
fn energy_is_conserved_with_rigid_body_and_slosh() {
    let (plant, mut drawn) = free();
    drawn.body.damping_ratio = vec![0.0; 3];
    drawn.engines[0].actuators[0].iter_mut().for_each(|a| a.damping_n_m_s_rad = 0.0);
    drawn.tanks[0].damping_ratio = 0.0;
    let model = assembled(&plant, &drawn, &NOTHING);
    let n = model.coordinates();
    let mass = block(&model.mass, 0..n, 0..n);
    let stiffness = block(&model.stiffness, 0..n, 0..n);
    assert_close(&mass, &mass.transpose());
    assert_close(&stiffness, &stiffness.transpose());
    assert!(mass.cholesky().is_some());
    let mut poles = Vec::new();
    crate::modal::Solver::new(n).poles(&model, &mut poles).expect("solved");
    for pole in poles {
        assert!(pole.re.abs() <= 1e-12 * pole.norm(), "{pole}");
    }
}

#[test]
fn a_locked_slosh_mass_is_that_of_a_stiff_spring() {
    let (plant, mut drawn) = free();
    let solve = |plant: &Plant, drawn: &DrawnVehicle| {
        let model = assembled(plant, drawn, &Effects { thrust: 1.0, ..NOTHING });
        let mut poles = Vec::new();
        crate::modal::Solver::new(model.coordinates()).poles(&model, &mut poles).expect("solved");
        poles
    };
    drawn.tanks[0].frequency_rad_s = 1e5;
    let stiff = solve(&plant, &drawn);
    let mut locked = plant.clone();
    let engines = [("booster.left".to_owned(), ["rock", "tilt"], true)];
    locked.layout = Layout::new(["m001", "m002", "m003"], engines)
        .with_rigid_body()
        .with_tanks([("lox", false)]);
    let locked = solve(&locked, &drawn);
    assert_eq!(stiff.len(), locked.len() + 2);
    for (a, b) in locked.iter().zip(&stiff) {
        // The spring gives by the order of (ω/ω_s)².
        assert!((a - b).norm() <= 1e-5 * a.norm(), "{a} is not {b}");
    }
}

/// A rigid vehicle on the x axis with one slosh mass and one engine whose nozzle has no arm.
fn rigid_with_slosh(slosh_x_m: f64) -> (Plant, DrawnVehicle) {
    let (mut plant, mut drawn) = skewed();
    plant.layout = Layout::new([], [("booster.left".to_owned(), ["rock", "tilt"], false)])
        .with_rigid_body()
        .with_tanks([("lox", true)]);
    plant.body = MassProperties {
        mass_kg: 1.0e6,
        cg_m: Vector3::zeros(),
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(1e7, 4e8, 4e8)),
    };
    let (shape, slope): (Vec<_>, Vec<_>) =
        rigid_motion(&Vector3::new(40.0, 0.0, 0.0)).into_iter().unzip();
    plant.attachments[0] = Attachment {
        thrust_direction: -Vector3::x(),
        axes: Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]),
        shape,
        slope,
        case_per_flow: Vec::new(),
        in_modes: true,
        actuators: 0,
    };
    let (shape, slope) = rigid_motion(&Vector3::new(slosh_x_m, 0.0, 0.0)).into_iter().unzip();
    plant.tanks = vec![TankAttachment {
        axes: Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]),
        shape,
        slope,
        in_modes: false,
    }];
    drawn.body = DrawnBody::default();
    drawn.engines[0].shape_gain.clear();
    drawn.engines[0].slope_gain.clear();
    drawn.tanks = vec![DrawnTank { mass_kg: 1.2e5, frequency_rad_s: 3.4, damping_ratio: 0.0 }];
    (plant, drawn)
}

#[test]
fn a_rigid_vehicle_with_one_slosh_mass_has_its_textbook_poles() {
    // Coasting: the slosh mass on its spring against the vehicle, reduced mass
    // 1/μ = 1/m_s + 1/m + x²/I; ω² = m_s ω_s²/μ.
    for x in [0.0, -12.0, 25.0] {
        let (plant, drawn) = rigid_with_slosh(x);
        let tank = &drawn.tanks[0];
        let model = assembled(&plant, &drawn, &NOTHING);
        let mut poles = Vec::new();
        crate::modal::Solver::new(model.coordinates()).poles(&model, &mut poles).expect("solved");
        let body = &plant.body;
        let inverse = 1.0 / tank.mass_kg + 1.0 / body.mass_kg + x * x / body.inertia_kg_m2[(1, 1)];
        let expected = tank.frequency_rad_s * (tank.mass_kg * inverse).sqrt();
        assert_eq!(poles.len(), 2);
        for pole in poles {
            assert!((pole.im - expected).abs() < 1e-9 * expected, "{pole} at {x} m");
            assert!(pole.re.abs() < 1e-9);
        }
    }
}

#[test]
fn under_thrust_a_slosh_mass_moves_on_the_turning_vehicle() {
    let x = -12.0;
    let (plant, drawn) = rigid_with_slosh(x);
    let thrust = Effects { thrust: 1.0, ..NOTHING };
    let model = assembled(&plant, &drawn, &thrust);
    let (m, i) = (plant.body.mass_kg, plant.body.inertia_kg_m2[(2, 2)]);
    let (m_s, w_s) = (drawn.tanks[0].mass_kg, drawn.tanks[0].frequency_rad_s);
    let force = drawn.engines[0].thrust_n;
    let g = force / (m + m_s);
    // In axes that turn with the vehicle: the mass feels m_s (δ̈ + ẅ + x θ̈) = −k δ, with ẅ the acceleration
    // of the body's cg across its own axis; the body feels the spring, m ẅ = k δ, and with it the
    // axial force m_s g that pushes the mass, whose reaction stands off the axis by δ:
    // I θ̈ = x k δ − m_s g δ.
    let k = m_s * w_s * w_s;
    let expected = (k * (1.0 / m_s + 1.0 / m) + x * (x * k - m_s * g) / i).sqrt();
    let mut poles = Vec::new();
    crate::modal::Solver::new(model.coordinates()).poles(&model, &mut poles).expect("solved");
    assert_eq!((poles.len(), model.null_states.len()), (2, 12));
    for pole in poles {
        assert!((pole.im - expected).abs() < 1e-9 * expected, "{pole}, expected {expected}");
    }
}
