//! Tests of the planar pair: stated cases, limits, and the three-dimensional model.

use super::*;
use crate::dynamics::{
    Attachment, DrawnActuator, DrawnBody, DrawnEngine, DrawnVehicle, Effects, Layout, Model, Plant,
};
use crate::vehicle::MassProperties;
use nalgebra::{Matrix3, Matrix3x2, Vector3};
use proptest::prelude::*;

/// The pair of verification case 4.
fn reference(thrust_n: f64) -> Parameters {
    Parameters {
        inertia_kg_m2: 1.0,
        actuator_damping_ratio: 0.3,
        actuator_omega_rad_s: 1.2,
        mode_damping_ratio: 0.005,
        mode_omega_rad_s: 1.0,
        coupling: 0.2,
        shape: 1.0,
        slope: 0.0,
        thrust_n,
        nozzle_jet: NozzleJet::Off,
        mass_flow_kg_s: 0.0,
        nozzle_length_m: 0.0,
    }
}

fn critical(planar: &Planar) -> f64 {
    match planar.critical_thrust() {
        CriticalThrust::At(thrust) => thrust,
        other => panic!("{other:?}"),
    }
}

/// The pole above the axis nearest to `near`.
fn pole(planar: &Planar, near: Complex<f64>) -> Complex<f64> {
    let poles = planar.poles().expect("poles");
    poles.into_iter().min_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm())).unwrap()
}

#[test]
fn the_reference_pair_has_the_stated_bound_and_critical_thrust() {
    let planar = Planar::new(reference(0.0)).unwrap();
    assert!((planar.necessary_bound_n().unwrap() - 12.236).abs() < 1e-12);
    assert!((critical(&planar) - 0.250_205_748_1).abs() < 5e-11);
}

#[test]
fn the_reference_pair_has_the_stated_poles_to_ten_digits() {
    let r_crit = critical(&Planar::new(reference(0.0)).unwrap());
    let cases = [
        (0.0, -0.023_303_280_0, 0.985_032_522_2),
        (0.0, -0.356_905_053_3, 1.190_665_823_6),
        (0.2, -0.004_866_974_0, 0.999_795_464_7),
        (r_crit, 0.0, 1.003_009_171_1),
        (r_crit, -0.380_208_333_3, 1.160_368_344_6),
        (1.0, 0.072_456_015_1, 1.031_622_177_7),
    ];
    for (thrust, re, im) in cases {
        let planar = Planar::new(reference(thrust)).unwrap();
        let found = pole(&planar, Complex::new(re, im));
        assert!((found.re - re).abs() < 5.1e-11 && (found.im - im).abs() < 5.1e-11, "{found}");
    }
}

#[test]
fn at_the_critical_thrust_the_pole_lies_on_the_axis_to_round_off() {
    let planar = Planar::new(reference(0.0)).unwrap();
    let planar = planar.with_thrust(critical(&planar)).unwrap();
    assert!(pole(&planar, Complex::new(0.0, 1.003)).re.abs() < 1e-14);
}

#[test]
fn as_mode_damping_vanishes_the_critical_thrust_is_the_tail_wags_dog_thrust() {
    for (zeta_n, omega_n) in [(0.3, 1.2), (0.05, 3.0), (0.9, 0.4)] {
        let parameters = Parameters {
            actuator_damping_ratio: zeta_n,
            actuator_omega_rad_s: omega_n,
            mode_damping_ratio: 1e-12,
            ..reference(0.0)
        };
        let planar = Planar::new(parameters).unwrap();
        let limit = planar.undamped_bound_n().unwrap();
        assert!((limit - 0.2).abs() < 1e-15);
        assert!((critical(&planar) - limit).abs() < 1e-8);
        let there = planar.with_thrust(limit).unwrap();
        assert!((there.tail_wags_dog_rad_s().unwrap() - 1.0).abs() < 1e-15);
    }
}

#[test]
fn thrust_that_pushes_with_the_motion_never_destabilises() {
    for (coupling, shape) in [(-0.2, 1.0), (0.2, -1.0), (0.0, 1.0), (0.2, 0.0)] {
        let planar = Planar::new(Parameters { coupling, shape, ..reference(1e3) }).unwrap();
        assert_eq!(planar.critical_thrust(), CriticalThrust::Never);
        assert_eq!(planar.verdict(), Verdict::Stable);
        assert_eq!(planar.necessary_bound_n(), None);
    }
    let planar = Planar::new(Parameters { coupling: 0.0, ..reference(1.0) }).unwrap();
    assert_eq!(planar.tail_wags_dog_rad_s(), None);
}

#[test]
fn a_mass_matrix_that_is_not_positive_definite_is_refused() {
    for coupling in [1.0, -1.0, 2.0] {
        let result = Planar::new(Parameters { coupling, ..reference(0.0) });
        assert!(matches!(result, Err(Refusal::Mass { .. })), "{result:?}");
    }
    let result = Planar::new(Parameters { thrust_n: f64::NAN, ..reference(0.0) });
    assert!(matches!(result, Err(Refusal::Value { name: "thrust R", .. })), "{result:?}");
}

#[test]
fn an_undamped_pair_is_marginal_and_has_no_critical_thrust() {
    let parameters =
        Parameters { actuator_damping_ratio: 0.0, mode_damping_ratio: 0.0, ..reference(0.0) };
    let planar = Planar::new(parameters).unwrap();
    assert_eq!(planar.verdict(), Verdict::Marginal);
    assert_eq!(planar.critical_thrust(), CriticalThrust::UnstableWithoutThrust);
    for pole in planar.poles().unwrap() {
        assert!(pole.re.abs() < 1e-14, "{pole}");
    }
}

#[test]
fn the_first_order_added_damping_is_met_to_second_order_in_the_coupling() {
    // The neglected terms are of the order of the fourth power of a coupling of φ and Υ.
    let mut errors = Vec::new();
    for scale in [0.04, 0.02, 0.01] {
        let parameters = Parameters {
            coupling: 0.2 * scale,
            shape: scale,
            mode_damping_ratio: 0.0,
            ..reference(0.5)
        };
        let planar = Planar::new(parameters).unwrap();
        let found = pole(&planar, Complex::new(0.0, 1.0));
        let added = planar.first_order_added_damping().unwrap();
        errors.push((-found.re / found.norm() - added).abs() / added.abs());
    }
    // Each halving of the coupling makes the relative error four times smaller.
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 4.0).abs() < 0.1, "{errors:?}");
    }
}

#[test]
fn equation_13_is_the_part_of_the_rigid_nozzle_linear_in_its_length() {
    let with = |nozzle_jet, nozzle_length_m| {
        let parameters = Parameters {
            slope: 0.12,
            mass_flow_kg_s: 0.01,
            nozzle_length_m,
            nozzle_jet,
            ..reference(0.1)
        };
        Planar::new(parameters).unwrap().damping()
    };
    let none = with(NozzleJet::Off, 4.0);
    let rest = |length: f64| {
        let (exact, linear) =
            (with(NozzleJet::RigidNozzle, length), with(NozzleJet::Linear, length));
        let square = 0.01 * length * length;
        let expected = [[square, square * 0.12], [square * 0.12, square * 0.12 * 0.12]];
        for i in 0..2 {
            for j in 0..2 {
                assert!((exact[i][j] - linear[i][j] - expected[i][j]).abs() < 1e-15);
            }
        }
        linear
    };
    let (short, long) = (rest(2.0), rest(4.0));
    for i in 0..2 {
        for j in 0..2 {
            let (one, two) = (short[i][j] - none[i][j], long[i][j] - none[i][j]);
            assert!((two - 2.0 * one).abs() < 1e-15);
        }
    }
    assert!((long[1][0] - 0.08).abs() < 1e-15 && long[0][1] == 0.0);
}

#[test]
fn with_a_rigid_nozzle_jet_the_critical_thrust_still_puts_a_pole_on_the_axis() {
    for nozzle_jet in [NozzleJet::Linear, NozzleJet::RigidNozzle] {
        let parameters = Parameters {
            slope: 0.12,
            mass_flow_kg_s: 0.02,
            nozzle_length_m: 1.5,
            nozzle_jet,
            ..reference(0.0)
        };
        let planar = Planar::new(parameters).unwrap();
        let thrust = critical(&planar);
        let least = |thrust| {
            let poles = planar.with_thrust(thrust).unwrap().poles().unwrap();
            poles.iter().map(|p| p.re).max_by(f64::total_cmp).unwrap()
        };
        assert!(least(thrust).abs() < 1e-14);
        assert!(least(0.99 * thrust) < 0.0 && least(1.01 * thrust) > 0.0);
    }
}

#[test]
fn the_poles_of_an_uncoupled_pair_are_those_of_its_parts() {
    let parameters = Parameters {
        coupling: 0.0,
        actuator_damping_ratio: 1.5,
        actuator_omega_rad_s: 40.0,
        ..reference(0.3)
    };
    let poles = Planar::new(parameters).unwrap().poles().unwrap();
    // Overdamped actuator: −ω(ζ ± √(ζ² − 1)).
    let root = 40.0 * 1.25_f64.sqrt();
    assert!((poles[0].re - (-60.0 - root)).abs() < 1e-11 && poles[0].im == 0.0);
    assert!((poles[1].re - (-60.0 + root)).abs() < 1e-12 && poles[1].im == 0.0);
    assert!((poles[2].re + 0.005).abs() < 1e-14 && poles[2].im > 0.0);
    assert_eq!(poles[3], poles[2].conj());
}

/// The three-dimensional model of one engine and one mode, the modal mass
/// `1 + m φ² + 2 S φψ + J ψ²` replaced by 1, has the same characteristic polynomial.
#[test]
fn the_pair_is_the_three_dimensional_model_of_one_engine_and_one_mode() {
    let (m, r, j, phi, psi) = (8100.0, 0.7, 24_000.0, 2.8e-3, 3.4e-4);
    let (thrust, flow, length, omega) = (1.2e7, 4700.0, 4.0, 32.7);
    let (k, c, zeta) = (3.76e7, 5.7e5, 0.005);
    let body_mass = 4.0e5;
    // Rotation about +y moves a point aft of the pivot towards −z, so φ lies along −z.
    let axes = Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]);
    let plant = Plant {
        layout: Layout::new(["m001"], [("one.engine".to_owned(), ["rock", "tilt"], true)]),
        body: MassProperties {
            mass_kg: body_mass,
            cg_m: Vector3::zeros(),
            inertia_kg_m2: Matrix3::zeros(),
        },
        attachments: vec![Attachment {
            thrust_direction: -Vector3::x(),
            axes,
            shape: vec![-Vector3::z() * phi],
            slope: vec![Vector3::y() * psi],
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
            frequency_rad_s: vec![omega],
            damping_ratio: vec![zeta],
            ..DrawnBody::default()
        },
        engines: vec![DrawnEngine {
            thrust_n: thrust,
            mass_flow_kg_s: flow,
            mass_kg: m,
            cg_m: r,
            inertia_kg_m2: j,
            axial_inertia_kg_m2: 1.5e4,
            length_m: length,
            actuators: vec![[DrawnActuator::spring(k, c), DrawnActuator::spring(k, c)]],
            shape_gain: vec![1.0],
            slope_gain: vec![1.0],
        }],
        ..DrawnVehicle::default()
    };
    // The mean acceleration stiffens the gimbal by m g0 r, g0 = R/M.
    let stiffness = k + m * r * thrust / (body_mass + m);
    let omega_n = (stiffness / j).sqrt();
    for nozzle_jet in [NozzleJet::Off, NozzleJet::Linear, NozzleJet::RigidNozzle] {
        let effects = Effects {
            thrust: 1.0,
            case_jet_damping: false,
            nozzle_jet_damping: nozzle_jet,
            follower_thrust: false,
            aerodynamics: 0.0,
            feedback: 0.0,
        };
        let mut model = Model::zeros(plant.layout.coordinates());
        plant.assemble(&drawn, &effects, &mut model);
        let planar = Planar::new(Parameters {
            inertia_kg_m2: j,
            actuator_damping_ratio: c / (2.0 * j * omega_n),
            actuator_omega_rad_s: omega_n,
            mode_damping_ratio: zeta,
            mode_omega_rad_s: omega,
            coupling: j * psi + m * r * phi,
            shape: phi,
            slope: psi,
            thrust_n: thrust,
            nozzle_jet,
            mass_flow_kg_s: flow,
            nozzle_length_m: length,
        })
        .unwrap();
        for s in [Complex::new(-0.3, 33.0), Complex::new(2.0, 20.0), Complex::new(-9.0, 0.0)] {
            let entry = |a: usize, b: usize| {
                let mass = if (a, b) == (0, 0) { 1.0 } else { model.mass[(a, b)] };
                s * s * mass + s * model.damping[(a, b)] + model.stiffness[(a, b)]
            };
            // The mode does not move the second gimbal axis.
            assert!(entry(0, 2).norm() < 1e-9 * entry(0, 1).norm());
            let full = entry(0, 0) * entry(1, 1) - entry(0, 1) * entry(1, 0);
            let quartic =
                planar.quartic().iter().rev().fold(Complex::<f64>::ZERO, |p, a| p * s + a);
            // Sums of a dozen products of a few rounded factors each, which nearly cancel.
            let terms = planar.quartic().into_iter().zip(0..);
            let size: f64 = terms.map(|(a, i)| a.abs() * s.norm().powi(i)).sum();
            let error = (full - quartic).norm() / size;
            assert!(error < 64.0 * f64::EPSILON, "{nozzle_jet:?} {s}: {error}");
        }
    }
}

#[test]
fn the_factors_of_a_quartic_multiply_to_it_or_are_refused() {
    let product =
        |[b, c]: [f64; 2], [d, e]: [f64; 2]| [c * e, b * e + d * c, c + e + b * d, b + d, 1.0];
    // Complex with complex, real with complex, real with real, unstable; from a tenth beside.
    let pairs = [
        ([0.01, 1.0], [0.7, 1.4]),
        ([3.0, 0.5], [0.02, 2.0]),
        ([3.0, 0.5], [5.0, 0.8]),
        ([-0.1, 1.0], [0.4, 1.0]),
    ];
    for (first, second) in pairs {
        let monic = product(first, second);
        let found = factors(&monic, [first.map(|x| 1.1 * x), second.map(|x| 0.9 * x)]).unwrap();
        for (found, expected) in found.into_iter().zip([first, second]) {
            // The resultants are of the order of one.
            assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-13), "{found:?}");
        }
        for root in found.map(roots).into_iter().flatten() {
            let value = monic.iter().rev().fold(Complex::<f64>::ZERO, |p, a| p * root + a);
            assert!(value.norm() < 1e-13 * (1.0 + root.norm()).powi(4), "{root}");
        }
    }
    // Where both factors are the same the steps have no direction.
    assert_eq!(factors(&product([0.1, 1.0], [0.3, 1.2]), [[0.2, 1.0]; 2]), None);
    assert_eq!(factors(&[f64::NAN; 5], [[0.2, 1.0], [0.1, 2.0]]), None);
}

proptest! {
    #[test]
    fn the_poles_are_the_eigenvalues_of_the_companion_matrix(
        zeta_n in 0.0..1.5_f64, omega_n in 0.2..5.0_f64, zeta_b in 0.0..0.1_f64,
        coupling in -0.95..0.95_f64, shape in -1.0..1.0_f64, thrust_n in 0.0..5.0_f64,
    ) {
        let planar = Planar::new(Parameters {
            actuator_damping_ratio: zeta_n, actuator_omega_rad_s: omega_n,
            mode_damping_ratio: zeta_b, coupling, shape, ..reference(thrust_n)
        }).unwrap();
        let a = planar.quartic();
        let monic = a.map(|x| x / a[4]);
        let expected = eigenvalues(&monic).unwrap();
        let size = expected.iter().map(|p| p.norm()).fold(1.0, f64::max);
        for pole in planar.poles().unwrap() {
            let nearest = expected.iter().map(|p| (p - pole).norm()).fold(f64::MAX, f64::min);
            // A double root moves by the square root of the rounding.
            prop_assert!(nearest < 1e-6 * size, "{}", pole);
            let value = monic.iter().rev().fold(Complex::<f64>::ZERO, |p, a| p * pole + a);
            let terms = monic.iter().zip(0..).map(|(a, i)| a.abs() * pole.norm().powi(i));
            prop_assert!(value.norm() < 32.0 * f64::EPSILON * terms.sum::<f64>());
        }
    }

    #[test]
    fn the_routh_verdict_agrees_with_the_poles_and_the_critical_thrust(
        zeta_n in 0.001..1.2_f64, omega_n in 0.2..5.0_f64, zeta_b in 0.0001..0.1_f64,
        coupling in -0.95..0.95_f64, shape in -1.0..1.0_f64, slope in -0.3..0.3_f64,
        thrust_n in 0.0..5.0_f64, flow in 0.0..0.2_f64, rigid: bool,
    ) {
        let planar = Planar::new(Parameters {
            actuator_damping_ratio: zeta_n, actuator_omega_rad_s: omega_n,
            mode_damping_ratio: zeta_b, coupling, shape, slope,
            mass_flow_kg_s: flow, nozzle_length_m: 2.0,
            nozzle_jet: if rigid { NozzleJet::RigidNozzle } else { NozzleJet::Linear },
            ..reference(thrust_n)
        }).unwrap();
        let poles = planar.poles().unwrap();
        // Vieta: the sum and the product of the roots.
        let [a0, _, _, a3, a4] = planar.quartic();
        let sum: Complex<f64> = poles.iter().sum();
        let product: Complex<f64> = poles.iter().product();
        let size: f64 = poles.iter().map(|p| p.norm()).sum();
        prop_assert!((sum.re + a3 / a4).abs() < 1e-12 * size && sum.im.abs() < 1e-14 * size);
        prop_assert!((product.re * a4 / a0 - 1.0).abs() < 1e-11);
        // A pole nearer to the axis than its rounding has no sign.
        if poles.iter().all(|p| p.re.abs() > 1e-9) {
            let unstable = poles.iter().filter(|p| p.re > 0.0).count();
            let expected = if unstable == 0 { Verdict::Stable } else { Verdict::Unstable(unstable) };
            prop_assert_eq!(planar.verdict(), expected);
            match planar.critical_thrust() {
                CriticalThrust::Never => prop_assert_eq!(unstable, 0),
                CriticalThrust::At(r) if thrust_n < r => prop_assert_eq!(unstable, 0),
                _ => {}
            }
        }
    }
}
