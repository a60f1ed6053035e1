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
        let mut spectrum = Spectrum::with(level);
        let found = spectrum.solve(&nominal, &case).expect("certified");
        check(&found, &case);
        for pole in &found {
            assert!(pole.bound < 1e-10 * pole.root.norm(), "{level:?} {pole:?}");
        }
        assert!(spectrum.evaluations() <= 30, "{}", spectrum.evaluations());
    }
}

/// A model whose poles are known in closed form: oscillators `s² + d s + k` seen through an integer
/// congruence of determinant one, so that every entry is exact.
fn known(oscillators: &[(f64, f64)]) -> Model {
    let n = oscillators.len();
    let t = |i: usize, j: usize| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => 1.0,
        std::cmp::Ordering::Greater => f64::from(((3 * i + 5 * j) % 3) as u8) - 1.0,
    };
    let mut model = Model::zeros(n);
    for i in 0..n {
        for j in 0..n {
            for (at, (d, k)) in oscillators.iter().enumerate() {
                let weight = t(at, i) * t(at, j);
                model.mass[(i, j)] += weight;
                model.damping[(i, j)] += weight * d;
                model.stiffness[(i, j)] += weight * k;
            }
        }
    }
    model
}

/// The poles of oscillators, one of each pair.
fn roots(oscillators: &[(f64, f64)]) -> Vec<c64> {
    let of = |&(d, k): &(f64, f64)| {
        let discriminant = d * d / 4.0 - k;
        if discriminant < 0.0 {
            return vec![c64::new(-d / 2.0, (-discriminant).sqrt())];
        }
        let larger = -(d / 2.0 + discriminant.sqrt());
        vec![c64::new(larger, 0.0), c64::new(k / larger, 0.0)]
    };
    oscillators.iter().flat_map(of).collect()
}

/// Solves from the base of other oscillators and compares with the closed form; the largest bound over the
/// modulus.
fn known_from(base_of: &[(f64, f64)], oscillators: &[(f64, f64)]) -> f64 {
    let nominal = base(&known(base_of));
    let mut spectrum = Spectrum::new();
    let found = spectrum.solve(&nominal, &known(oscillators)).expect("certified");
    let mut exact = roots(oscillators);
    assert_eq!(found.len(), exact.len());
    for pole in &found {
        let distance = |k: &usize| (exact[*k] - pole.root).norm();
        let nearest = (0..exact.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap();
        let off = distance(&nearest);
        // The closed form itself is rounded.
        let rounding = 4.0 * f64::EPSILON * pole.root.norm();
        assert!(off <= pole.bound + rounding, "{pole:?} is off by {off:.2e}");
        exact.swap_remove(nearest);
    }
    found.iter().map(|pole| pole.bound / pole.root.norm()).fold(0.0, f64::max)
}

#[test]
fn poles_of_a_closed_form_are_within_bounds_below_1e_10() {
    let nominal: Vec<(f64, f64)> =
        (1..8).map(|i| (0.03125 * f64::from(i), f64::from(i * i))).collect();
    let case: Vec<(f64, f64)> = nominal
        .iter()
        .enumerate()
        .map(|(i, (d, k))| (d * 1.5, k + 0.25 * (i % 3) as f64))
        .collect();
    assert!(known_from(&nominal, &case) < 1e-10);
}

#[test]
fn modes_that_nothing_couples_to_are_their_own_poles() {
    let mut nominal = model(&[1.0, 1.5, 2.5, 3.0], 0.1, 0.2);
    let uncouple = |model: &mut Model| {
        for at in 4..6 {
            for matrix in [&mut model.mass, &mut model.damping, &mut model.stiffness] {
                (matrix[(1, at)], matrix[(at, 1)]) = (0.0, 0.0);
            }
        }
    };
    uncouple(&mut nominal);
    let mut case = model(&[1.02, 1.5, 2.4, 3.1], 0.1, 0.25);
    uncouple(&mut case);
    let found = Spectrum::new().solve(&base(&nominal), &case).expect("certified");
    check(&found, &case);
    let own = c64::new(-0.005 * 1.5, 1.5 * (1.0_f64 - 0.005 * 0.005).sqrt());
    assert!(found.iter().any(|pole| (pole.root - own).norm() <= pole.bound + 1e-15));
}

#[test]
fn repeated_poles_are_certified_as_a_cluster_with_their_multiplicity() {
    let nominal: Vec<(f64, f64)> = [1.0, 4.0, 4.0, 9.0, 16.0].map(|k| (0.0625, k)).into();
    let repeated: Vec<(f64, f64)> = [1.25, 4.5, 4.5, 4.5, 16.0].map(|k| (0.0625, k)).into();
    for oscillators in [&nominal, &repeated] {
        let found =
            Spectrum::new().solve(&base(&known(&nominal)), &known(oscillators)).expect("certified");
        let exact = roots(oscillators);
        for pole in &found {
            let near: Vec<_> =
                exact.iter().filter(|s| (*s - pole.root).norm() <= pole.bound).collect();
            assert_eq!(near.len(), pole.multiplicity, "{pole:?}");
            assert!(pole.bound < 1e-6 * pole.root.norm());
        }
        assert_eq!(found.len(), 5);
        assert!(found.iter().any(|pole| pole.multiplicity > 1));
    }
}

#[test]
fn close_modes_at_a_relative_gap_of_1e_6_are_told_apart() {
    let gap = 1.0 + 2.0_f64.powi(-19); // of k; half of it of the frequency: 0.95e-6
    let nominal: Vec<(f64, f64)> = [1.0, 4.0, 4.5, 9.0].map(|k| (0.0625, k)).into();
    let close: Vec<(f64, f64)> = [1.0, 4.0, 4.0 * gap, 9.0].map(|k| (0.0625, k)).into();
    assert!(known_from(&nominal, &close) < 1e-9);
}

#[test]
fn pairs_that_become_real_and_real_poles_that_become_pairs_are_followed() {
    let complex: Vec<(f64, f64)> = vec![(0.125, 1.0), (2.0, 1.5), (0.25, 9.0)];
    let real: Vec<(f64, f64)> = vec![(0.125, 1.0), (3.5, 1.5), (0.25, 9.0)];
    assert!(known_from(&complex, &real) < 1e-9);
    assert!(known_from(&real, &complex) < 1e-9);
}

#[test]
fn nearly_defective_pairs_have_bounds_that_hold() {
    // Near critical damping the two poles of an oscillator and their vectors nearly coincide.
    let nominal: Vec<(f64, f64)> = vec![(0.125, 1.0), (4.0, 4.5), (0.25, 9.0)];
    for excess in [2.0_f64.powi(-12), 2.0_f64.powi(-20)] {
        let case: Vec<(f64, f64)> = vec![(0.125, 1.0), (4.0, 4.0 + excess), (0.25, 9.0)];
        assert!(known_from(&nominal, &case) < 1e-6);
    }
}

#[test]
fn poles_at_the_origin_known_by_construction_are_divided_out() {
    // A free translation: its column of stiffness and damping is zero, and it is coupled by mass.
    let free = |stiffness: f64| {
        let mut model = known(&[(0.0625, 4.0), (0.125, stiffness), (0.25, 16.0)]);
        for i in 0..3 {
            for matrix in [&mut model.damping, &mut model.stiffness] {
                (matrix[(0, i)], matrix[(i, 0)]) = (0.0, 0.0);
            }
        }
        model.null_states = vec![0, 3];
        model
    };
    let case = free(9.5);
    let found = Spectrum::new().solve(&base(&free(9.0)), &case).expect("certified");
    assert_eq!(found.len(), 2);
    check(&found, &case);
}

#[test]
fn overflow_and_numbers_that_are_not_finite_are_never_certified() {
    let nominal = model(&[1.0, 2.0, 3.0], 0.1, 0.2);
    let nominal_base = base(&nominal);
    let mut spectrum = Spectrum::new();
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        for at in [(0, 1), (2, 2), (4, 0)] {
            let mut case = nominal.clone();
            case.stiffness[at] = bad;
            assert!(spectrum.solve(&nominal_base, &case).is_err(), "{bad} at {at:?}");
        }
    }
    let mut singular = nominal.clone();
    singular.mass[(0, 0)] = -1.0;
    assert_eq!(spectrum.solve(&nominal_base, &singular), Err(Uncertain::NonFinite));
    // What was solved before leaves nothing behind.
    check(&spectrum.solve(&nominal_base, &nominal).expect("certified"), &nominal);
}

#[test]
fn a_value_that_contradicts_the_roots_is_no_certificate() {
    // p = s² + 4; a third value of another polynomial.
    let mut secular = secular::Secular::default();
    secular.start([c64::new(0.01, 2.1)]);
    let value = |s: c64| {
        let p = s * s + c64::new(4.0, 0.0);
        scaled::Scaled::ONE.times(p)
    };
    for _ in 0..3 {
        let points: Vec<c64> = secular.pending().collect();
        for (index, point) in points.into_iter().enumerate() {
            secular.take(index, value(point), 1e-15);
        }
        secular.solve(Level::best()).expect("finite");
        secular.renew();
    }
    let beside = c64::new(0.3, 1.0);
    let good = secular.certify([(beside, value(beside), 1e-15)]).expect("certified");
    assert!((good[0].root - c64::new(0.0, 2.0)).norm() <= good[0].bound);
    let wrong = value(beside).times(c64::new(1.0 + 1e-9, 0.0));
    assert_eq!(secular.certify([(beside, wrong, 1e-15)]), Err(Uncertain::Contradicted));
}

#[test]
fn the_two_faster_instruction_sets_give_the_same_bits() {
    let frequencies: Vec<f64> = (0..9).map(|i| 1.0 + 0.5 * f64::from(i)).collect();
    let nominal = base(&model(&frequencies, 0.1, 0.2));
    let case = model(&frequencies, 0.11, 0.3);
    let levels = Level::all();
    let solve = |level: &Level| Spectrum::with(*level).solve(&nominal, &case).expect("certified");
    let found: Vec<_> = levels.iter().map(solve).collect();
    let fused = found.len() - 1;
    for pair in found[..fused].windows(2) {
        assert_eq!(pair[0], pair[1]);
    }
    for (a, b) in found[0].iter().zip(&found[fused]) {
        assert!((a.root - b.root).norm() <= a.bound + b.bound);
    }
}
