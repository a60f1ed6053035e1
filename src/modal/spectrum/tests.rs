use super::*;

/// Modes and gimbal-like coordinates with coupling in mass and thrust.
fn model(frequencies: &[f64], coupling: f64, thrust: f64) -> Model {
    let k = frequencies.len();
    let mut model = Model::zeros(k + 2);
    for (i, w) in frequencies.iter().enumerate() {
        model.mass[(i, i)] = 1.0;
        model.damping[(i, i)] = 2.0 * 0.005 * w;
        model.stiffness[(i, i)] = w * w;
        for axis in 0..2 {
            let shape = (1.0 + (i + 3 * axis) as f64).sin();
            model.mass[(i, k + axis)] = coupling * shape;
            model.mass[(k + axis, i)] = coupling * shape;
            model.stiffness[(i, k + axis)] = thrust * shape;
        }
    }
    for axis in 0..2 {
        let w = 4.0 + axis as f64;
        model.mass[(k + axis, k + axis)] = 1.0;
        model.damping[(k + axis, k + axis)] = 2.0 * 0.3 * w;
        model.stiffness[(k + axis, k + axis)] = w * w;
    }
    model
}

fn base(model: &Model) -> Base {
    Base::of(model, &mut Solver::new(model.coordinates())).expect("solved")
}

fn dense(model: &Model) -> Vec<c64> {
    let mut poles = Vec::new();
    Solver::new(model.coordinates()).poles(model, &mut poles).expect("solved");
    poles
}

fn check(found: &[Bounded], model: &Model) {
    let expected = dense(model);
    assert_eq!(found.len(), expected.len());
    for pole in found {
        let nearest = expected.iter().map(|s| (s - pole.root).norm()).fold(f64::INFINITY, f64::min);
        let allowed = pole.bound + 1e-12 * pole.root.norm();
        assert!(nearest <= allowed, "{}: {nearest:.2e} > {allowed:.2e}", pole.root);
    }
}

#[test]
fn the_poles_are_those_of_the_dense_solver_on_every_instruction_set() {
    let frequencies: Vec<f64> = (0..12).map(|i| 1.0 + 0.7 * f64::from(i)).collect();
    let nominal = base(&model(&frequencies, 0.1, 0.2));
    let moved: Vec<f64> =
        frequencies.iter().enumerate().map(|(i, w)| w * (1.0 + 0.03 * (i as f64).cos())).collect();
    let case = model(&moved, 0.12, 0.25);
    for level in Level::all() {
        let mut spectrum = Spectrum::with(14, level);
        let found = spectrum.solve(&nominal, &case).expect("certified");
        check(&found, &case);
        for pole in &found {
            assert!(pole.bound < 1e-10 * pole.root.norm(), "{level:?} {pole:?}");
        }
        assert!(spectrum.evaluations() <= 30, "{}", spectrum.evaluations());
    }
}
