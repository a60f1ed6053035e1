use super::*;
use crate::dynamics::servo::Row;
use crate::modal::Response;
use nalgebra::DMatrix;

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
fn real_roots_are_found_from_pairs_far_from_the_axis() {
    // Roots ±2i and two real ones; a pair is guessed for these, and wanders.
    for real in [[-1.0, -3.0], [-0.01, -8.0], [1.0, -2.0], [-1.9, -2.1]] {
        for guess in [c64::new(-2.0, 3.8), c64::new(0.5, 6.0), c64::new(-0.1, 1.9)] {
            let mut secular = secular::Secular::default();
            secular.start([c64::new(0.01, 2.1), guess]);
            let value = |s: c64| {
                let p = (s * s + 4.0) * (s - real[0]) * (s - real[1]);
                scaled::Scaled::ONE.times(p)
            };
            for _ in 0..5 {
                let points: Vec<c64> = secular.pending().collect();
                for (index, point) in points.into_iter().enumerate() {
                    secular.take(index, value(point), 1e-15);
                }
                secular.solve(Level::best()).expect("finite");
                secular.renew();
            }
            let found = secular.certify([]).expect("certified");
            let roots: Vec<c64> = found.iter().map(|found| found.root).collect();
            assert_eq!(roots.len(), 3, "{real:?} from {guess}: {roots:?}");
            for root in real.map(|x| c64::new(x, 0.0)).into_iter().chain([c64::new(0.0, 2.0)]) {
                let near = |x: &c64| (x - root).norm() < 1e-9;
                assert!(roots.iter().any(near), "{real:?} from {guess}: {roots:?}");
            }
        }
    }
}

#[test]
fn instruction_sets_agree_within_the_bounds() {
    let frequencies: Vec<f64> = (0..9).map(|i| 1.0 + 0.5 * f64::from(i)).collect();
    let nominal = base(&model(&frequencies, 0.1, 0.2));
    let case = model(&frequencies, 0.11, 0.3);
    let levels = Level::all();
    let solve = |level: &Level| Spectrum::with(*level).solve(&nominal, &case).expect("certified");
    let found: Vec<_> = levels.iter().map(solve).collect();
    for other in &found[1..] {
        for (a, b) in found[0].iter().zip(other) {
            assert!((a.root - b.root).norm() <= a.bound + b.bound);
        }
    }
}

/// Modes that a few motions couple, with two gimbal-like coordinates and a first-order state: declared as a plant does.
fn attached(modes: usize, spread: f64, full: bool) -> Model {
    let (n, size) = (modes + 2, modes + 3);
    let shape = |motion: usize, mode: usize| {
        (1.3 * (mode as f64 + 1.0) * (motion as f64 + 1.0) + spread).sin() / (modes as f64).sqrt()
    };
    let mut model = Model::zeros(size);
    model.clear(n);
    let motions = 3;
    // Z of mass and damping between motions, a and β.
    let mass = [[0.4, 0.1, 0.0], [0.1, 0.3, 0.05], [0.0, 0.05, 0.2]];
    let damping = [[0.02, 0.01, 0.0], [-0.01, 0.03, 0.0], [0.0, 0.004, 0.01]];
    for p in 0..modes {
        for q in 0..modes {
            for i in 0..motions {
                for j in 0..motions {
                    let weight = shape(i, p) * shape(j, q);
                    model.mass[(p, q)] += mass[i][j] * weight;
                    model.damping[(p, q)] += damping[i][j] * weight;
                }
            }
        }
        for axis in 0..2 {
            let coupling = 0.2 * shape(axis, p);
            model.mass[(p, modes + axis)] = coupling;
            model.mass[(modes + axis, p)] = coupling;
            model.stiffness[(p, modes + axis)] = 9.0 * shape(axis, p);
        }
        // A sensor of the third motion drives the state.
        model.stiffness[(n, p)] = -0.3 * shape(2, p);
    }
    for axis in 0..2 {
        let (at, w) = (modes + axis, 5.0 + axis as f64);
        model.mass[(at, at)] = 0.5;
        model.damping[(at, at)] = 0.3 * w;
        model.stiffness[(at, at)] = 0.5 * w * w;
        model.stiffness[(at, n)] = 0.4;
    }
    model.stiffness[(n, n)] = 7.0;
    model.interface.elastic = 0..modes;
    for motion in 0..motions {
        model.interface.motions.extend((0..modes).map(|mode| shape(motion, mode)));
    }
    for mode in 0..modes {
        let at = (mode, mode);
        let omega = (1.0 + 0.45 * mode as f64) * (1.0 + 0.03 * (spread * mode as f64).sin());
        let matrices = [&mut model.mass, &mut model.damping, &mut model.stiffness];
        let own = [1.0, 0.01 * omega, omega * omega];
        model.interface.attached.push(matrices.each_ref().map(|matrix| matrix[at]));
        model.interface.own.push(own);
        matrices.into_iter().zip(own).for_each(|(matrix, own)| matrix[at] += own);
    }
    if full {
        for p in 0..modes {
            for q in 0..modes {
                let value =
                    0.02 / (1.0 + (p as f64 - q as f64).powi(2)) * ((p + 2 * q) as f64).cos();
                model.damping[(p, q)] += value;
                model.interface.add_full(0, [p, q], value);
            }
        }
    }
    model
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn modes_seen_through_few_motions_are_eliminated_in_closed_form_on_every_instruction_set() {
    let nominal = base(&attached(60, 0.0, false));
    let case = attached(60, 0.2, false);
    for level in Level::all() {
        let mut spectrum = Spectrum::with(level);
        let found = spectrum.solve(&nominal, &case).expect("certified");
        assert_eq!(spectrum.reduced(), [60, 3]);
        assert!(!spectrum.is_refined());
        check(&found, &case);
        for pole in &found {
            assert!(pole.bound < 1e-10 * pole.root.norm(), "{level:?} {pole:?}");
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn the_reduced_form_and_the_whole_matrix_have_the_same_poles() {
    let nominal = base(&attached(40, 0.0, false));
    let case = attached(40, 0.3, false);
    let mut plain = case.clone();
    plain.interface.clear();
    let (mut spectrum, mut whole) = (Spectrum::new(), Spectrum::new());
    let found = spectrum.solve(&nominal, &case).expect("certified");
    let expected = whole.solve(&nominal, &plain).expect("certified");
    assert_eq!([spectrum.reduced(), whole.reduced()], [[40, 3], [0, 0]]);
    for (a, b) in found.iter().zip(&expected) {
        assert!((a.root - b.root).norm() <= a.bound + b.bound, "{a:?} {b:?}");
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn a_coupling_that_no_motion_gives_is_found_and_the_whole_matrix_taken() {
    let mut case = attached(40, 0.1, false);
    for (row, column) in [(3, 17), (17, 3)] {
        case.stiffness[(row, column)] += 1e-3;
    }
    let nominal = base(&case);
    let mut spectrum = Spectrum::new();
    let found = spectrum.solve(&nominal, &case).expect("certified");
    assert_eq!(spectrum.reduced(), [0, 0]);
    check(&found, &case);
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn a_full_damping_matrix_is_added_with_residual_bounds_and_the_trace() {
    let nominal = base(&attached(60, 0.0, true));
    let case = attached(60, 0.2, true);
    for level in Level::all() {
        let mut spectrum = Spectrum::with(level);
        let found = spectrum.solve(&nominal, &case).expect("certified");
        assert!(spectrum.is_refined());
        check(&found, &case);
        for pole in &found {
            assert!(pole.bound < 1e-9 * pole.root.norm(), "{level:?} {pole:?}");
        }
        let trace: f64 =
            found.iter().map(|p| if p.root.im > 0.0 { 2.0 * p.root.re } else { p.root.re }).sum();
        let state = Solver::new(63).state_matrix(&case).expect("regular").trace();
        assert!((trace - state).abs() < 1e-11 * state.abs(), "{trace} {state}");
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn poles_sought_near_guesses_are_those_of_all() {
    let nominal = base(&attached(60, 0.0, true));
    let case = attached(60, 0.2, true);
    let mut spectrum = Spectrum::new();
    let all = spectrum.solve(&nominal, &case).expect("certified");
    let degree = spectrum.degree();
    assert_eq!(degree, all.iter().map(Bounded::conjugates).sum::<usize>());
    for guesses in [&[all[5].root][..], &[all[5].root, all[6].root, all[40].root]] {
        let near = spectrum.solve_near(&nominal, &case, guesses, 3).expect("certified");
        assert_eq!(spectrum.degree(), degree);
        // Whole groups, of which the nearest are three for each guess.
        assert_eq!(near.len(), 8);
        for guess in guesses {
            let mut order = all.clone();
            let distance = |pole: &Bounded| (pole.root - guess).norm();
            order.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            for pole in &order[..3] {
                assert!(near.iter().any(|other| other.meets(pole)), "{pole:?}");
            }
        }
        assert!(near.iter().all(|pole| all.iter().filter(|a| a.meets(pole)).count() == 1));
        let poles: Vec<c64> = near.iter().map(|pole| pole.root).collect();
        assert_eq!(spectrum.vectors(&case, &poles).len(), 8);
    }
    let guesses: Vec<c64> = all.iter().map(|pole| pole.root).collect();
    assert_eq!(spectrum.solve_near(&nominal, &case, &guesses, 1).as_ref(), Ok(&all));
    // Without a full part all are found.
    let (nominal, case) = (base(&attached(60, 0.0, false)), attached(60, 0.2, false));
    let near = spectrum.solve_near(&nominal, &case, &guesses[..1], 1).expect("certified");
    check(&near, &case);
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn vectors_of_the_reduced_form_are_those_of_the_whole_matrix() {
    for full in [false, true] {
        let nominal = base(&attached(60, 0.0, full));
        let case = attached(60, 0.2, full);
        let mut spectrum = Spectrum::new();
        let found = spectrum.solve(&nominal, &case).expect("certified");
        let poles: Vec<c64> = found.iter().map(|pole| pole.root).collect();
        let mut solver = Solver::new(63);
        let vectors = spectrum.vectors(&case, &poles);
        assert_eq!(vectors.len(), poles.len());
        for (pole, vectors) in vectors {
            let pair = solver.judge(&case, pole, &vectors);
            let dense = solver.pair(&case, pole);
            // Both see the error of the pole itself; steps end where the pole is known to 2e-11.
            let allowed = 1.1 * dense.residual + 1e-12;
            assert!(pair.residual < allowed, "{pole}: {:.1e}", pair.residual);
            for (a, b) in [(&pair.right, &dense.right), (&pair.left, &dense.left)] {
                let product: c64 = a.iter().zip(b).map(|(a, b)| a.conj() * b).sum();
                assert!((product.norm() - 1.0).abs() < 1e-9, "{pole}: {}", product.norm());
            }
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn a_full_part_as_strong_as_the_distance_of_poles_is_not_certified_wrongly() {
    let mut case = attached(60, 0.2, true);
    for factor in [10.0, 100.0] {
        let full: Vec<f64> = case.interface.full[0].clone();
        for (at, value) in full.iter().enumerate() {
            let more = value * (factor - 1.0);
            case.damping[(at / 60, at % 60)] += more;
            case.interface.full[0][at] += more;
        }
        let nominal = base(&case);
        if let Ok(found) = Spectrum::new().solve(&nominal, &case) {
            check(&found, &case);
        }
        let mut exact = Vec::new();
        Solver::new(63).poles(&case, &mut exact).expect("solved");
        let guesses: Vec<c64> = exact.iter().step_by(7).copied().collect();
        if let Ok(found) = Spectrum::new().solve_near(&nominal, &case, &guesses, 2) {
            for pole in found {
                let off = exact.iter().map(|s| (s - pole.root).norm()).fold(f64::MAX, f64::min);
                assert!(off <= pole.bound + 1e-11 * pole.root.norm(), "{pole:?} {off:.1e}");
            }
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn poles_that_a_full_part_makes_coalesce_keep_their_bounds() {
    let plain = attached(60, 0.2, false);
    let omega = |mode: usize| plain.stiffness[(mode, mode)].sqrt();
    let gap = (omega(31) - omega(30)).abs();
    let mut certified = 0;
    for step in 0..=60 {
        // Where damping couples two oscillators by their distance, their poles meet.
        let coupling = gap * (0.4 + 0.02 * f64::from(step));
        let mut case = plain.clone();
        for at in [[30, 31], [31, 30]] {
            case.damping[(at[0], at[1])] += coupling;
            case.interface.add_full(0, at, coupling);
        }
        let mut spectrum = Spectrum::new();
        let Ok(found) = spectrum.solve(&base(&case), &case) else { continue };
        assert!(spectrum.is_refined());
        certified += 1;
        let mut solver = Solver::new(63);
        let exact: Vec<(c64, f64)> =
            dense(&case).into_iter().map(|s| (s, solver.pair(&case, s).bound)).collect();
        assert_eq!(found.len(), exact.len());
        for pole in found {
            let apart = |(s, bound): &(c64, f64)| (s - pole.root).norm() - 2.0 * bound;
            let off = exact.iter().map(apart).fold(f64::INFINITY, f64::min);
            assert!(off <= pole.bound + 1e-12 * pole.root.norm(), "{step}: {pole:?} {off:.1e}");
        }
    }
    assert!(certified > 20, "{certified}");
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn numbers_that_are_not_finite_are_never_certified_in_reduced_models() {
    for full in [false, true] {
        let nominal = base(&attached(40, 0.0, full));
        for value in [f64::NAN, f64::INFINITY, 1e300] {
            for (row, column) in [(3, 17), (17, 17), (3, 40), (42, 5)] {
                let mut case = attached(40, 0.1, full);
                case.stiffness[(row, column)] = value;
                assert!(
                    Spectrum::new().solve(&nominal, &case).is_err(),
                    "{value} at {row}, {column}"
                );
                let mut case = attached(40, 0.1, full);
                case.interface.own[row.min(39)][2] = value;
                if let Ok(found) = Spectrum::new().solve(&nominal, &case) {
                    check(&found, &case);
                }
            }
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "hours under Miri")]
fn the_response_through_the_interface_is_that_of_the_state_space() {
    let model = attached(60, 0.2, false);
    // Forces on both gimbals and into the state; signals of many modes, of a gimbal and of the state.
    let mut inputs = DMatrix::zeros(63, 3);
    for (input, at) in [60, 61, 62].into_iter().enumerate() {
        inputs[(at, input)] = 1.0 + input as f64;
    }
    let modes = |phase: f64| (0..60).map(move |mode| (mode, (0.7 * mode as f64 + phase).sin()));
    let mut rows: Vec<Row> = [(0.0, false), (1.0, true), (2.0, true)]
        .map(|(phase, rate)| Row { entries: modes(phase).collect(), rate })
        .to_vec();
    rows.push(Row { entries: vec![(60, 2.0), (3, -1.0)], rate: true });
    let mut transfer = Transfer::new(&model, &inputs, &rows).expect("reduced");
    let space = Solver::new(63).state_space(&model, &inputs, &rows).expect("regular");
    let mut response = Response::new(&space.a, &space.b, &space.c, &space.d).expect("finite");
    let points: Vec<c64> = (0..203)
        .map(|i| c64::new(if i % 7 == 0 { 0.1 } else { 0.0 }, 0.01 * 1.05_f64.powi(i)))
        .chain([c64::new(0.5, 0.0), c64::new(0.3, -2.0)])
        .collect();
    for ((s, found), expected) in points.iter().zip(transfer.at(&points)).zip(response.at(&points))
    {
        let off = (&found - &expected).norm();
        assert!(off <= 1e-11 * expected.norm(), "{s}: {off:.1e} of {:.1e}", expected.norm());
        assert_eq!(found, transfer.at(&[*s])[0]);
    }
    // With a full part there is no interface to go through.
    assert!(Transfer::new(&attached(60, 0.2, true), &inputs, &rows).is_none());
    assert!(Transfer::new(&attached(12, 0.2, false), &inputs, &rows).is_none());
}
