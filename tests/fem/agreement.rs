//! One model written in every format is the same model when it is read again.

use tvse::fem::{Point, Precision, Results, SystemKind};

use super::results;

/// The tables, which hold everything in full precision.
fn model() -> Results {
    let mut model = results("modes.csv");
    for part in ["nodes.csv", "systems.csv", "masses.csv"] {
        model.merge(results(part), part).unwrap();
    }
    model
}

/// Checks nodes, shapes and masses exactly and frequencies to the digits of the format.
fn agrees(found: &Results, frequency_tolerance: f64, with_mass: bool) {
    let model = model();
    assert_eq!(found.nodes, model.nodes);
    for (id, system) in &model.systems {
        assert_eq!(found.systems.get(id), Some(system));
    }
    assert_eq!(found.modes.len(), model.modes.len());
    for (found, expected) in found.modes.iter().zip(&model.modes) {
        assert_eq!(found.number, expected.number);
        let off = (found.frequency_hz / expected.frequency_hz - 1.0).abs();
        assert!(off <= frequency_tolerance, "{} Hz", found.frequency_hz);
        assert_eq!(found.generalised_mass, expected.generalised_mass.filter(|_| with_mass));
        assert_eq!(found.shape, expected.shape);
    }
    assert_eq!(found.complete("model"), Ok(()));
}

#[test]
fn plain_tables_hold_nodes_modes_systems_masses_and_labels() {
    let model = model();
    assert_eq!(model.precision, Precision::Text { digits: 6 });
    assert_eq!(model.nodes.len(), 6);
    assert_eq!(model.modes.len(), 3);
    assert_eq!(model.sets["gimbal"], [1]);
    assert_eq!(model.sets["sensor"], [3]);
    assert_eq!(model.systems[&10].kind, SystemKind::Cylindrical);
    let position = [2.0, 45.0, 1.0];
    assert_eq!(model.systems[&20].a, Point::Given { reference: 10, position });
    let mass = model.mass.unwrap();
    assert_eq!((mass[3].0, mass[3].1.mass, mass[3].1.inertia), (14, 7.0, [1.0, 2.0, 3.0]));
}

#[test]
fn every_word_length_and_byte_order_of_op2_is_the_same_model() {
    for (name, precision) in [
        ("model_little_32.op2", Precision::Single),
        ("model_big_32.op2", Precision::Single),
        ("model_little_64.op2", Precision::Double),
        ("model_big_64.op2", Precision::Double),
    ] {
        let found = results(name);
        assert_eq!(found.precision, precision);
        agrees(&found, 0.0, true);
        assert_eq!(found.systems[&30].a, Point::Node(1));
        assert_eq!(found.systems[&30].c, Point::Node(3));
        assert_eq!(found.warnings, ["3 values at scalar points are left out"], "{name}");
    }
    assert_eq!(results("model_little_32.op2").program, "Nastran OP2 OWN1.0");
    assert_eq!(results("model_big_32.op2").program, "Nastran OP2");
}

#[test]
fn hdf5_is_the_same_model() {
    let found = results("model.h5");
    assert_eq!(found.precision, Precision::Double);
    agrees(&found, 0.0, true);
    assert_eq!(found.systems[&30].b, Point::Node(2));
    assert_eq!(found.warnings, ["3 values at points that are no grids are left out"]);
}

#[test]
fn a_punch_file_and_its_deck_are_the_same_model() {
    let mut found = results("model.pch");
    assert!(found.nodes.is_empty());
    let missing = found.complete("model.pch").unwrap_err().to_string();
    assert!(missing.contains("eigenvectors without grids"), "{missing}");
    found.merge(results("model.bdf"), "model.bdf").unwrap();
    assert_eq!(found.precision, Precision::Text { digits: 7 });
    // Eigenvalues of eight digits: half a unit in the last, halved by the root.
    agrees(&found, 0.5 * 0.5e-7, false);
    assert_eq!(found.systems[&30].a, Point::Node(1));
}

#[test]
fn universal_files_old_and_new_are_the_same_model() {
    let model = model();
    for (name, digits) in [("model_55.unv", 6), ("model_2414.unv", 17)] {
        let found = results(name);
        assert_eq!(found.precision, Precision::Text { digits });
        assert_eq!(found.modes, model.modes, "{name}");
        assert!(found.units.is_some(), "{name}");
        assert_eq!(found.complete(name), Ok(()));
        assert_eq!(found.warnings.len(), 1, "the displacement systems are told");
        // Here the systems are placed in the basic one: by rounding the same place and axes.
        let c = std::f64::consts::FRAC_1_SQRT_2;
        let origin = [1.0 + 2.0 * c, 2.0 + 2.0 * c, 4.0];
        let on_z = [origin[0], origin[1], 5.0];
        let on_x = [origin[0] + c, origin[1] + c, 4.0];
        let nested = found.systems[&20];
        assert_eq!(nested.kind, SystemKind::Rectangular);
        for (point, expected) in [(nested.a, origin), (nested.b, on_z), (nested.c, on_x)] {
            let Point::Given { reference: 0, position } = point else { panic!("{point:?}") };
            for (found, expected) in position.iter().zip(expected) {
                // Six digits of numbers below ten.
                assert!((found - expected).abs() < 2e-5, "{position:?} {expected}");
            }
        }
        assert_eq!(found.systems[&10].kind, SystemKind::Cylindrical);
    }
    let old = results("model_55.unv");
    assert_eq!(old.nodes, model.nodes);
    let new = results("model_2414.unv");
    let displacement = |results: &Results| {
        results.nodes.iter().map(|n| (n.id, n.displacement_system)).collect::<Vec<_>>()
    };
    assert_eq!(displacement(&new), displacement(&model));
    assert!(new.nodes.iter().all(|node| node.position_system == 0));
    assert_eq!(new.sets["gimbal"], [1, 14]);
    assert!(new.units.unwrap().contains("SI: Meter (newton)"));
}

#[test]
fn calculix_results_hold_the_translations_as_text_or_binary() {
    let model = model();
    for (name, precision) in [
        ("model_0.frd", Precision::Text { digits: 6 }),
        ("model_1.frd", Precision::Text { digits: 6 }),
        ("model_3.frd", Precision::Single),
    ] {
        let found = results(name);
        assert_eq!(found.precision, precision, "{name}");
        let id = |id: i64| if name == "model_0.frd" { id % 1000 } else { id };
        let mut ids: Vec<i64> = model.nodes.iter().map(|node| id(node.id)).collect();
        ids.sort_unstable();
        assert_eq!(found.nodes.iter().map(|node| node.id).collect::<Vec<_>>(), ids);
        assert_eq!(found.modes.len(), 3, "the static step is no mode");
        for (found, expected) in found.modes.iter().zip(&model.modes) {
            // Generalised stiffness of seven digits, halved by the root.
            let off = (found.frequency_hz / expected.frequency_hz - 1.0).abs();
            assert!(off <= 0.5 * 0.5e-6, "{} Hz", found.frequency_hz);
            assert_eq!(found.generalised_mass, expected.generalised_mass);
            for shape in &expected.shape {
                let found = found.shape.iter().find(|s| s.node == id(shape.node)).unwrap();
                assert_eq!((found.translation, found.rotation), (shape.translation, None));
            }
        }
        assert_eq!(found.complete(name), Ok(()));
    }
}

#[test]
fn shapes_along_the_basic_axes_leave_no_displacement_systems() {
    let basic = results("basic.op2");
    assert!(basic.basic_shapes);
    assert!(basic.nodes.iter().all(|node| node.displacement_system == 0));
    assert!(
        basic.warnings.iter().any(|w| w.contains("after augmentation")),
        "{:?}",
        basic.warnings
    );
    let mut alone = basic.clone();
    alone.nodes.clear();
    alone.merge(results("model.bdf"), "model.bdf").unwrap();
    assert!(alone.nodes.iter().all(|node| node.displacement_system == 0));
}

#[test]
fn undamped_modes_of_a_complex_solution_are_real_modes() {
    for name in ["undamped.op2", "undamped.pch"] {
        let found = results(name);
        for (found, expected) in found.modes.iter().zip(&model().modes) {
            // Single precision or eight digits of the circular frequency.
            let off = (found.frequency_hz / expected.frequency_hz - 1.0).abs();
            assert!(off <= f64::from(f32::EPSILON), "{} Hz", found.frequency_hz);
            assert_eq!(found.shape, expected.shape);
        }
        assert!(found.warnings.iter().any(|w| w.contains("complex solution")));
    }
}

#[test]
fn parts_that_contradict_each_other_are_told() {
    let mut found = results("model.pch");
    found.merge(results("model.bdf"), "model.bdf").unwrap();
    // The same grids in single precision are no contradiction, and the exact ones stay.
    let mut geometry = results("model_little_32.op2");
    geometry.modes.clear();
    found.merge(geometry, "model.op2").unwrap();
    let again = found.clone().merge(results("modes.csv"), "modes.csv").unwrap_err().to_string();
    assert!(again.contains("modes.csv: modes"), "{again}");
    let mut moved = results("model.bdf");
    moved.nodes[1].position[2] = 2.1;
    let moved = found.merge(moved, "moved.bdf").unwrap_err().to_string();
    assert!(moved.starts_with("moved.bdf: node 2: found"), "{moved}");
}

#[test]
fn a_file_that_calculix_wrote_has_the_modes_of_its_printed_output() {
    // `ccx calculix` and the same with NODE OUTPUT; cycles as `calculix.dat` prints them.
    let cycles =
        [0.0, 0.0, 0.0, 6.178057e-06, 1.581917e-05, 2.274028e-05, 95.13967, 95.13967, 217.6212];
    let (text, binary) = (results("calculix.frd"), results("calculix_binary.frd"));
    for found in [&text, &binary] {
        assert_eq!((found.modes.len(), found.nodes.len()), (9, 12));
        for (mode, printed) in found.modes.iter().zip(cycles) {
            // Seven printed digits here and there; six modes are rigid.
            assert!((mode.frequency_hz - printed).abs() <= 1e-6 * printed, "{}", mode.frequency_hz);
            assert_eq!(mode.generalised_mass, Some(1.0));
            assert!(mode.shape.iter().all(|shape| shape.rotation.is_none()));
        }
    }
    assert_eq!(text.nodes, binary.nodes);
    for (a, b) in text.modes.iter().zip(&binary.modes) {
        for (a, b) in a.shape.iter().zip(&b.shape) {
            assert_eq!(a.node, b.node);
            for (a, b) in a.translation.into_iter().zip(b.translation) {
                // Six printed digits and single precision.
                assert!((a - b).abs() <= (0.5e-5 + f64::from(f32::EPSILON)) * b.abs(), "{a} {b}");
            }
        }
    }
}
