//! Known answers and identities on the whole reference vehicle, through the public library.

use crate::study::{Study, columns};
use nalgebra::{Complex, DMatrix, Matrix3xX, Vector3};
use std::path::Path;
use tvse::campaign::{Definition, Evaluator, Population, Variant};
use tvse::dispersion::{Dispersion, Sampler};
use tvse::dynamics::jet_damping::{Station, case_per_flow};
use tvse::dynamics::{Layout, Model};
use tvse::io::scenario::{self, Loaded};
use tvse::scenario::dispersion;
use tvse::structure::Thresholds;
use tvse::vehicle::{Law, Modal, Mode, ModeSet, Vehicle};

const RUN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/runs/smoke.toml");
/// As the solver's own check of its poles: n ε times the greatest pole, times a modest factor.
const BACKWARD: f64 = 1e4;

fn loaded() -> Loaded {
    scenario::load(Path::new(RUN), scenario::Reach::Study).unwrap()
}

/// No structural and no actuator damping.
fn undamped(mut vehicle: Vehicle) -> Vehicle {
    vehicle.structural_damping = 0.0;
    for engine in &mut vehicle.engines {
        engine.bearing_damping_n_m_s_rad = 0.0;
        for actuator in &mut engine.actuators {
            let Law::SecondOrder(law) = &mut actuator.law else { panic!("another kind") };
            law.damping_ratio = 0.0;
        }
    }
    vehicle
}

/// The nominal case of `definition` with the one `variant`, every engine that `gimballed` names.
fn nominal(definition: &Definition, variant: Variant, gimballed: &str) -> Definition {
    let nominal = Population {
        name: "nominal".into(),
        cases: 1,
        fixed: vec![],
        drawn: false,
        scheme: Default::default(),
    };
    let engines = definition.gimballed.len();
    let gimballed = match gimballed {
        "none" => vec![false; engines],
        "all" => vec![true; engines],
        _ => definition.gimballed.clone(),
    };
    let (populations, variants) = (vec![nominal], vec![variant]);
    Definition { populations, variants, gimballed, ..definition.clone() }
}

/// Model, layout and all poles of the nominal case, those of the named modes first.
fn solved(vehicle: &Vehicle, definition: &Definition) -> (Model, Layout, Vec<Complex<f64>>) {
    let dispersion: Dispersion = dispersion::read("none", "", vehicle).unwrap();
    let sampler = Sampler::new(&dispersion, definition.seed);
    let evaluator = Evaluator::new(vehicle, &sampler, definition, true).unwrap();
    let mut seen = None;
    let record = evaluator.visit(0, 0, |view| {
        seen = Some((view.model.clone(), view.plant.layout.clone()));
    });
    let (model, layout) = seen.unwrap();
    let poles = record.evaluations[0].outcome.as_ref().unwrap().iter().map(|p| p.value).collect();
    (model, layout, poles)
}

fn thrust_off(variant: &Variant) -> Variant {
    Variant { thrust: false, ..variant.clone() }
}

fn bound(poles: &[Complex<f64>]) -> f64 {
    let greatest = poles.iter().map(|s| s.norm()).fold(0.0, f64::max);
    BACKWARD * 2.0 * poles.len() as f64 * f64::EPSILON * greatest
}

#[test]
fn the_whole_vehicle_without_thrust_and_damping_is_conservative() {
    let loaded = loaded();
    let vehicle = undamped(loaded.vehicle.vehicle);
    for gimballed in ["boosters", "all", "none"] {
        let variant = thrust_off(&loaded.definition.variants[0]);
        let definition = nominal(&loaded.definition, variant, gimballed);
        let (model, layout, poles) = solved(&vehicle, &definition);
        assert!(poles.len() >= layout.coordinates());
        for pole in &poles {
            assert!(pole.re.abs() <= bound(&poles), "{gimballed}: {pole}");
        }
        for i in 0..layout.coordinates() {
            for j in 0..layout.coordinates() {
                assert_eq!(model.mass[(i, j)].to_bits(), model.mass[(j, i)].to_bits());
                assert_eq!(model.damping[(i, j)], 0.0);
            }
        }
    }
}

#[test]
fn six_equal_engines_that_are_gimballed_are_no_failure_and_every_pole_is_found() {
    let study = Study::new();
    study.edit("runs/smoke.toml", "[\"booster.*\"]", "[\"*.*\"]");
    study.edit("runs/smoke.toml", "../dispersions/reference.toml", "none.toml");
    std::fs::write(study.path("runs/none.toml"), "").unwrap();
    study.run("result", &["--poles", "all"]);
    let cases = columns(&study.path("result/tables/cases.parquet"));
    assert!(cases.texts["status"].iter().all(|status| status.as_deref() == Some("ok")));
    // Undispersed: every case is the nominal, bit for bit.
    let modes = columns(&study.path("result/tables/modes.parquet"));
    let re = &modes.numbers["pole_re_rad_s"];
    let evaluation = re.len() / 7;
    assert!(re.chunks(evaluation).all(|case| case == &re[..evaluation]));
    // The four core engines on a symmetric core: poles that agree in all but the last digits.
    let im = &modes.numbers["pole_im_rad_s"];
    let poles: Vec<_> =
        re[..evaluation].iter().zip(im).map(|(r, i)| (r.unwrap(), i.unwrap())).collect();
    let close =
        |a: &(f64, f64), b: &(f64, f64)| (a.0 - b.0).hypot(a.1 - b.1) < 1e-6 * a.0.hypot(a.1);
    let repeated = (1..poles.len()).any(|i| poles[..i].iter().any(|p| close(p, &poles[i])));
    assert!(repeated, "{poles:?}");
}

#[test]
fn without_thrust_every_pole_is_stable_in_every_case() {
    let study = Study::new();
    study.append(
        "runs/smoke.toml",
        "[[variant]]\nname = \"thrust_off\"\nthrust = false\ncase_jet_damping = true\n\
         nozzle_jet_damping = \"rigid-nozzle\"\n\
         [[variant]]\nname = \"off_again\"\nthrust = false\ncase_jet_damping = false\n\
         nozzle_jet_damping = \"off\"\n",
    );
    study.edit("runs/smoke.toml", "[110.0]", "[80.0, 114.0]");
    study.run("result", &["--poles", "all"]);
    let modes = columns(&study.path("result/tables/modes.parquet"));
    let off = |name: &str| {
        let rows = modes.texts["variant"].iter().zip(&modes.numbers["pole_re_rad_s"]);
        let rows = rows.filter(|(variant, _)| variant.as_deref() == Some(name));
        rows.map(|(_, re)| re.unwrap().to_bits()).collect::<Vec<_>>()
    };
    let poles = off("thrust_off");
    assert!(poles.len() >= 7 * 2 * 28);
    assert!(poles.iter().all(|re| f64::from_bits(*re) < 0.0));
    // Thrust off sets the flow to zero: jet damping has nothing to act through.
    assert_eq!(poles, off("off_again"));
}

/// Whether a mode is symmetric (+1) or antisymmetric (−1) about the plane y = 0.
fn parity(set: &ModeSet, mode: &Mode) -> f64 {
    let [left, right] =
        ["left", "right"].map(|side| set.grid(&format!("booster.{side}.gimbal")).unwrap());
    let mirrored = |v: &Vector3<f64>| Vector3::new(v.x, -v.y, v.z);
    // Rotations mirror as axial vectors.
    let turned = |v: &Vector3<f64>| Vector3::new(-v.x, v.y, -v.z);
    let both = mirrored(&mode.shape[left]).dot(&mode.shape[right])
        + turned(&mode.slope[left]).dot(&mode.slope[right]);
    both.signum()
}

#[test]
fn with_equal_boosters_modes_couple_to_nozzle_motions_of_their_own_symmetry_only() {
    let loaded = loaded();
    let vehicle = &loaded.vehicle.vehicle;
    let set = vehicle.modal.at(110.0).unwrap();
    let definition = nominal(&loaded.definition, loaded.definition.variants[1].clone(), "boosters");
    let (model, layout, _) = solved(vehicle, &definition);
    let [left, right] = ["left", "right"].map(|side| {
        vehicle
            .engines
            .iter()
            .position(|engine| engine.path() == format!("booster.{side}"))
            .unwrap()
    });
    let axes = |engine: usize| vehicle.engines[engine].axes;
    // The gimbal rotations of the right nozzle that mirror those of the left one.
    let turned = Matrix3xX::from_fn(2, |i, j| [-1.0, 1.0, -1.0][i] * axes(left)[(i, j)]);
    let image = axes(right).transpose() * turned;
    let first = |engine: usize| layout.gimbal(engine).unwrap();
    let matrices = [("M", &model.mass), ("D", &model.damping), ("K", &model.stiffness)];
    let mut parities = Vec::new();
    for (j, mode) in set.modes.iter().enumerate() {
        let parity = parity(set, mode);
        parities.push(parity);
        for (name, matrix) in matrices {
            for axis in 0..2 {
                // The nozzle motion of the other symmetry, as columns and as rows.
                let column = matrix[(j, first(left) + axis)]
                    - parity
                        * (0..2)
                            .map(|b| image[(b, axis)] * matrix[(j, first(right) + b)])
                            .sum::<f64>();
                let row = matrix[(first(left) + axis, j)]
                    - parity
                        * (0..2)
                            .map(|b| image[(b, axis)] * matrix[(first(right) + b, j)])
                            .sum::<f64>();
                let scale = (0..layout.coordinates())
                    .flat_map(|i| (0..2).map(move |b| (i, b)))
                    .map(|(i, b)| {
                        matrix[(j, first(left) + b)].abs().max(matrix[(i, first(left) + b)].abs())
                    })
                    .fold(0.0, f64::max);
                // Shapes of the package are symmetric to the 1e-9 that its own test allows.
                assert!(column.abs() <= 1e-8 * scale, "{name} {} {column:e} {scale:e}", mode.label);
                assert!(row.abs() <= 1e-8 * scale, "{name} {} {row:e} {scale:e}", mode.label);
            }
        }
        for (name, matrix) in matrices {
            for (i, other) in set.modes.iter().enumerate().take(j) {
                if parities[i] != parity {
                    let cross = matrix[(i, j)].abs().max(matrix[(j, i)].abs());
                    let scale = (matrix[(i, i)] * matrix[(j, j)]).abs().sqrt();
                    assert!(
                        cross <= 1e-8 * scale,
                        "{name} {} {} {cross:e}",
                        mode.label,
                        other.label
                    );
                }
            }
        }
    }
    assert!(parities.contains(&1.0) && parities.contains(&-1.0));
}

/// The modal package of the body with all engines locked to it, by the full basis of the reduced
/// body's modes, at 110 s; and the label of the mode that is nearest to the named one.
fn integrated(vehicle: &Vehicle, definition: &Definition) -> (Modal, String) {
    let locked = nominal(definition, thrust_off(&definition.variants[0]), "none");
    let (model, layout, _) = solved(vehicle, &locked);
    let size = layout.coordinates();
    let set = vehicle.modal.at(110.0).unwrap();
    assert_eq!(size, set.modes.len());
    let dense = |m: &faer::Mat<f64>| DMatrix::from_fn(size, size, |i, j| m[(i, j)]);
    let factor = dense(&model.mass).cholesky().unwrap().l();
    let inverse = factor.try_inverse().unwrap();
    let eigen = (&inverse * dense(&model.stiffness) * inverse.transpose()).symmetric_eigen();
    let basis = inverse.transpose() * &eigen.eigenvectors;
    let mut order: Vec<usize> = (0..size).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let combined = |j: usize, of: fn(&Mode) -> &Vec<Vector3<f64>>| {
        let at = |grid: usize| (0..size).map(|i| of(&set.modes[i])[grid] * basis[(i, j)]).sum();
        (0..set.grids.len()).map(at).collect()
    };
    let label = |n: usize| format!("m{:03}", n + 1);
    let modes = order.iter().enumerate().map(|(n, &j)| Mode {
        label: label(n),
        frequency_hz: eigen.eigenvalues[j].sqrt() / std::f64::consts::TAU,
        shape: combined(j, |mode| &mode.shape),
        slope: combined(j, |mode| &mode.slope),
    });
    let named = layout.position("m006").unwrap();
    let nearest = (0..size)
        .max_by(|a, b| basis[(named, order[*a])].abs().total_cmp(&basis[(named, order[*b])].abs()))
        .unwrap();
    let mut body = set.body;
    for engine in &vehicle.engines {
        let burned = engine.motor.burned_fraction_at(110.0);
        let share = engine.nozzle.ablation.map_or(0.0, |ablation| ablation.factor * burned);
        body.mass_kg += engine.nozzle.ablated(share).mass_kg;
    }
    // The locked slosh masses are in these modes too.
    body.mass_kg += vehicle.tanks.iter().map(|tank| tank.mass_kg(110.0)).sum::<f64>();
    let sets = vec![ModeSet { body, modes: modes.collect(), ..set.clone() }];
    let contains_engines = vehicle.engines.iter().map(|engine| engine.path()).collect();
    let contains_tanks = vehicle.tanks.iter().map(|tank| tank.name.clone()).collect();
    let source = "integrated body".to_owned();
    (Modal { source, contains_engines, contains_tanks, sets, parents: Vec::new() }, label(nearest))
}

/// A study whose vehicle has the integrated body of the reference vehicle at 110 s, undamped.
pub fn integrated_study() -> Study {
    let study = Study::new();
    study.edit("vehicles/sls-like/vehicle.toml", "damping_ratio = 0.005", "damping_ratio = 0.0");
    let loaded = scenario::load(&study.path("runs/smoke.toml"), scenario::Reach::Study).unwrap();
    let (modal, label) = integrated(&loaded.vehicle.vehicle, &loaded.definition);
    let folder = study.path("vehicles/sls-like/integrated");
    tvse::io::package::write(&folder, &modal, &Thresholds::default(), false).unwrap();
    let vehicle = "vehicles/sls-like/vehicle.toml";
    study.edit(vehicle, "modal_package = \"modes\"", "modal_package = \"integrated\"");
    study.edit(vehicle, "labels = [\"m006\"]", &format!("labels = [\"{label}\"]"));
    study.edit(vehicle, "[80.0, 95.0, 100.0, 105.0, 110.0, 112.0, 114.0]", "[110.0]");
    study.edit(vehicle, "time_s = 105.0", "time_s = 110.0");
    study
}

#[test]
fn the_reduced_and_the_integrated_reference_vehicle_have_the_same_poles() {
    let study = integrated_study();
    let integrated =
        scenario::load(&study.path("runs/smoke.toml"), scenario::Reach::Study).unwrap();
    assert!(integrated.vehicle.vehicle.engines.iter().all(|engine| engine.in_modes));
    let reduced = loaded();
    let mut vehicle = reduced.vehicle.vehicle;
    vehicle.structural_damping = 0.0;
    for gimballed in ["boosters", "all"] {
        for variant in &reduced.definition.variants {
            let of = |vehicle: &Vehicle, definition: &Definition| {
                let (_, _, poles) =
                    solved(vehicle, &nominal(definition, variant.clone(), gimballed));
                (poles[0], poles)
            };
            let (named, mut one) = of(&vehicle, &reduced.definition);
            let (same, mut other) = of(&integrated.vehicle.vehicle, &integrated.definition);
            let bound = bound(&one);
            assert!((named - same).norm() <= bound, "{named} is not {same}");
            assert_eq!(one.len(), other.len());
            // Near-repeated poles move by the root of the error, so pairs are sought, not sorted.
            one.sort_by(|a, b| a.im.total_cmp(&b.im));
            for pole in one {
                let distance = |other: &Complex<f64>| (other - pole).norm();
                let at = (0..other.len())
                    .min_by(|a, b| distance(&other[*a]).total_cmp(&distance(&other[*b])))
                    .unwrap();
                let found = other.swap_remove(at);
                assert!(distance(&found) <= 1e-7 * pole.norm(), "{pole} is not {found}");
            }
        }
    }
}

#[test]
fn jet_damping_of_any_convex_flow_profile_obeys_the_identity_by_parts() {
    // 2∫ṁ φ φ' dx = [ṁ φ²] − ∫ṁ' φ² dx. A ramp that begins at station k is what the function gives
    // for the stations from k on; a sum of ramps is any convex piecewise linear profile from zero.
    let count = 4001;
    let at = |j: usize| j as f64 / (count - 1) as f64;
    let phi = |x: f64| (1.7 * x).cos() - 0.6 * (7.0 * x).sin() + 0.3 * x * x;
    let slope = |x: f64| -1.7 * (1.7 * x).sin() - 4.2 * (7.0 * x).cos() + 0.6 * x;
    let stations: Vec<Station> = (0..count)
        .map(|j| Station {
            x_m: at(j),
            shape: vec![Vector3::new(0.0, phi(at(j)), 0.0)],
            slope: vec![Vector3::new(0.0, 0.0, slope(at(j)))],
        })
        .collect();
    let mut left = 0.0;
    let mut right = 0.0;
    for (from, rise) in [(0, 0.4), (1000, 0.9), (2600, 0.25), (3600, 1.3)] {
        // Damping is minus the force.
        left -= rise * case_per_flow(&stations[from..])[0];
        let length = 1.0 - at(from);
        let h = at(1);
        let squares: Vec<f64> = (from..count).map(|j| phi(at(j)).powi(2)).collect();
        let ends = 0.5 * (squares[0] + squares[squares.len() - 1]);
        let integral = h * (squares.iter().sum::<f64>() - ends);
        right += rise * (phi(1.0).powi(2) - integral / length);
    }
    // Both trapezoids err by h²/12 times a second derivative of order 10² at most.
    assert!((left - right).abs() < 1e-4 && right.abs() > 0.1, "{left} {right}");
}
