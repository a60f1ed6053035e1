//! Actuators against closed forms.

use super::*;
use crate::vehicle::TransferFunction;
use nalgebra::{Complex, DMatrix};
use std::sync::Arc;

/// The actuator of verification 8 with `a = K_L (K_v/K_s + K_c)`: K_c is a static pressure feedback.
fn hydraulic(a: f64) -> Electrohydraulic {
    let (k_h, k_s, k_v) = (2.4e8, 1e8, 20.0);
    let k_l = 1.0 / (1.0 / k_h + 1.0 / k_s);
    let k_c = a / k_l - k_v / k_s;
    let (area, flow) = (0.02, 0.05);
    Electrohydraulic {
        arm_m: 1.79,
        piston_area_m2: area,
        load_path_stiffness_n_m: k_s,
        oil_stiffness_n_m: k_h,
        leakage_m3_s_pa: 0.25 * k_c * area * area,
        valve_flow_gain_m3_s_a: flow,
        valve_pressure_gain_pa_a: flow / (0.25 * k_c * area * area),
        position_gain_a_m: k_v * area / flow,
        pressure_feedback_a_pa: 0.5 * k_c * area * area / flow,
        pressure_corner_rad_s: 0.0,
    }
}

/// Poles of a nozzle J Θ̈ + K_b Θ = τ on the actuator.
fn poles(law: &Law, inertia: f64, bearing: f64) -> Vec<Complex<f64>> {
    let torque = law.state_space();
    let n = torque.order();
    let mut a = DMatrix::zeros(n + 2, n + 2);
    a[(0, 1)] = 1.0;
    a[(1, 0)] = (torque.d[(0, 1)] - bearing) / inertia;
    a[(1, 1)] = torque.d[(0, 2)] / inertia;
    for state in 0..n {
        a[(1, 2 + state)] = torque.c[(0, state)] / inertia;
        a[(2 + state, 0)] = torque.b[(state, 1)];
        a[(2 + state, 1)] = torque.b[(state, 2)];
        for other in 0..n {
            a[(2 + state, 2 + other)] = torque.a[(state, other)];
        }
    }
    let whole = StateSpace { a, ..StateSpace::gain(DMatrix::zeros(0, 0)) };
    let whole = StateSpace { b: DMatrix::zeros(n + 2, 0), c: DMatrix::zeros(0, n + 2), ..whole };
    let mut poles = whole.poles().unwrap();
    poles.retain(|p| p.im >= 0.0);
    poles.sort_by(|a, b| a.im.total_cmp(&b.im));
    poles
}

#[test]
fn the_massless_piston_with_pressure_feedback_has_the_stated_poles() {
    for (a, real, pair) in [
        (80.0, -23.8955, Complex::new(-28.0522, 85.9045)),
        (160.0, -51.4597, Complex::new(-54.2701, 31.2483)),
    ] {
        let found = poles(&Law::Electrohydraulic(hydraulic(a)), 2.4e4, 2e6);
        assert_eq!(found.len(), 2);
        assert!((found[0].re - real).abs() < 5.1e-5, "{found:?}");
        assert!((found[1].re - pair.re).abs() < 5.1e-5, "{found:?}");
        assert!((found[1].im - pair.im).abs() < 5.1e-5, "{found:?}");
    }
    let undamped = poles(&Law::Electrohydraulic(hydraulic(20.0)), 2.4e4, 2e6);
    assert!(undamped[1].re.abs() < 1e-9 * undamped[1].im, "{undamped:?}");
}

#[test]
fn the_oil_and_the_load_path_are_in_series_above_every_corner() {
    let law = hydraulic(80.0);
    let high = law.state_space().response(Complex::new(0.0, 1e7)).unwrap();
    // Against Θ the torque is that of a spring: Θ̇ = s Θ.
    let spring = -(high[(0, 1)] + high[(0, 2)] * Complex::new(0.0, 1e7));
    let k_l = spring.re / (1.79 * 1.79);
    assert!((k_l / 7.0588e7 - 1.0).abs() < 1e-5, "{k_l}");
    assert!(((spring.re / 2.4e4).sqrt() / std::f64::consts::TAU - 15.450).abs() < 5.1e-4);
}

#[test]
fn a_high_pass_gives_back_the_stiffness_that_static_pressure_feedback_costs() {
    let mut law = hydraulic(80.0);
    (law.leakage_m3_s_pa, law.valve_pressure_gain_pa_a) = (0.0, f64::INFINITY);
    let at_rest = |law: &Electrohydraulic| {
        let system = law.state_space();
        system.response(Complex::new(0.0, 0.0)).unwrap()[(0, 0)].re
    };
    let soft = at_rest(&law);
    law.pressure_corner_rad_s = 3.0;
    // Without leakage the position loop holds the piston: only the load path gives way.
    let stiff = at_rest(&law);
    assert!((stiff / (1e8 * 1.79 * 1.79) - 1.0).abs() < 1e-12, "{stiff}");
    assert!(soft < 0.7 * stiff);
    // Far above the corner both are the same.
    let s = Complex::new(0.0, 3e4);
    let dynamic = law.state_space().response(s).unwrap()[(0, 0)];
    law.pressure_corner_rad_s = 0.0;
    let still = law.state_space().response(s).unwrap()[(0, 0)];
    assert!((dynamic - still).norm() < 1e-3 * still.norm());
}

#[test]
fn transfer_functions_and_matrices_can_say_what_the_hydraulic_actuator_says() {
    let law = hydraulic(80.0);
    let (k_l, k_v, a) = (1.0 / (1.0 / 2.4e8 + 1.0 / 1e8), 20.0, 80.0);
    let k = k_l * 1.79 * 1.79;
    // Z = r_a² K_L (s + K_v)/(s + a), G = r_a² K_L K_v/(s + a).
    let function = |n: &[f64], d: &[f64]| Arc::new(TransferFunction::new(n, d).unwrap());
    let transfer = Law::TransferFunction(TransferActuator {
        command: Some(function(&[k * k_v], &[1.0, a])),
        stiffness: function(&[k, k * k_v], &[1.0, a]),
        damping_n_m_s_rad: 0.0,
        gain: 1.0,
        time_scale: 1.0,
    });
    let matrices = Law::StateSpace(StateSpaceActuator {
        system: Arc::new(law.state_space()),
        gain: 1.0,
        time_scale: 1.0,
    });
    let same = Law::Electrohydraulic(law);
    for omega in [0.0, 2.0, 30.0, 500.0] {
        let s = Complex::new(0.0, omega);
        let of = |law: &Law| {
            let response = law.state_space().response(s).unwrap();
            [response[(0, 0)], response[(0, 1)] + response[(0, 2)] * s]
        };
        let expected = of(&same);
        for other in [&transfer, &matrices] {
            for (found, expected) in of(other).iter().zip(expected) {
                assert!((found - expected).norm() < 1e-12 * k, "{omega}");
            }
        }
    }
}

#[test]
fn a_command_may_share_the_dynamic_stiffness() {
    let function = Arc::new(TransferFunction::new(&[3.0e7, 4.0e8], &[1.0, 50.0]).unwrap());
    let law = TransferActuator {
        command: None,
        stiffness: function.clone(),
        damping_n_m_s_rad: 1e4,
        gain: 2.0,
        time_scale: 0.5,
    };
    let s = Complex::new(0.0, 11.0);
    let response = law.state_space().response(s).unwrap();
    let expected = function.response(s * 0.5) * 2.0;
    assert!((response[(0, 0)] - expected).norm() < 1e-7);
    assert!((response[(0, 1)] + expected).norm() < 1e-7);
    assert!((response[(0, 2)] + 2e4).norm() < 1e-7);
}
