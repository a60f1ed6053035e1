//! Tests of the modal package: round trip, every bad input by name, and the package of the
//! reference vehicle.

use super::check::REPORTED;
use super::*;
use crate::structure::{Selection, Stick, solve};
use crate::vehicle::{Grid, MassProperties, Mode, ModeSet, Parent};
use nalgebra::{Matrix3, Vector3};
use proptest::prelude::*;

/// Two flight times, two modes, three grids; normalised on the masses of the grids.
fn modal() -> Modal {
    let grid = |(i, name): (usize, &&str)| Grid {
        name: (*name).to_owned(),
        position_m: Vector3::new(i as f64, 0.5, -0.25),
        mass_kg: Vector3::repeat(2.0),
        inertia_kg_m2: Vector3::repeat(1.0),
    };
    let mode = |label: &str, hz: f64, at: usize| Mode {
        label: label.to_owned(),
        frequency_hz: hz,
        shape: (0..3).map(|i| Vector3::y() * if i == at { 0.6 } else { 0.0 }).collect(),
        slope: (0..3).map(|i| Vector3::x() * if i == at { 0.28_f64.sqrt() } else { 0.0 }).collect(),
    };
    let set = |time: f64, labels: [&str; 2]| ModeSet {
        flight_time_s: time,
        body: MassProperties {
            mass_kg: 6.0,
            cg_m: Vector3::new(1.0, 0.5, -0.25),
            inertia_kg_m2: Matrix3::new(3.0, 0.1, 0.0, 0.1, 7.0, 0.2, 0.0, 0.2, 7.0),
        },
        grids: ["nose", "mitte ü", "tail"].iter().enumerate().map(grid).collect(),
        modes: vec![mode(labels[0], 1.0 / 3.0, 0), mode(labels[1], 2.5, 2)],
    };
    Modal {
        source: "a trial with \"quotes\"".to_owned(),
        contains_engines: vec!["booster.left".to_owned()],
        contains_tanks: Vec::new(),
        sets: vec![set(95.0, ["m001", "m002"]), set(100.5, ["m001", "m003"])],
        parents: vec![Parent {
            flight_time_s: 100.5,
            label: "m003".to_owned(),
            parent: "m002".to_owned(),
            overlap: 0.7,
        }],
    }
}

/// Writes a package whose header and tables a test has changed, without digests.
fn written(
    place: &Path,
    modal: &Modal,
    change: impl FnOnce(&mut Header, &mut [Table; 5]),
) -> PathBuf {
    let dir = place.join("modes");
    write(&dir, modal, &Thresholds::default(), true).unwrap();
    let text = files::read_text(&dir.join(HEADER)).unwrap();
    let mut header: Header = toml::from_str(&text).unwrap();
    header.blake3.clear();
    let mut tables = tables(modal);
    change(&mut header, &mut tables);
    files::write(&dir.join(HEADER), toml::to_string(&header).unwrap().as_bytes()).unwrap();
    for (layout, table) in LAYOUTS.into_iter().zip(&tables) {
        let bytes = table.to_bytes(layout).unwrap();
        files::write(&dir.join(table_path(layout)), &bytes).unwrap();
    }
    dir
}

fn refused(change: impl FnOnce(&mut Header, &mut [Table; 5])) -> Problems {
    refused_of(&modal(), change)
}

fn refused_of(modal: &Modal, change: impl FnOnce(&mut Header, &mut [Table; 5])) -> Problems {
    let place = tempfile::tempdir().unwrap();
    read(&written(place.path(), modal, change)).unwrap_err()
}

fn tells(problems: &Problems, kind: Kind, parts: &[&str]) {
    let told = problems.to_string();
    for part in parts {
        assert!(told.contains(part), "{part} is missing in\n{told}");
    }
    assert_eq!(problems.kind(), kind, "{told}");
}

#[test]
fn a_package_comes_back_bit_for_bit_and_its_bytes_repeat() {
    let place = tempfile::tempdir().unwrap();
    let (one, two) = (place.path().join("one"), place.path().join("two"));
    for dir in [&one, &two] {
        write(dir, &modal(), &Thresholds::default(), false).unwrap();
    }
    assert_eq!(read(&one).unwrap(), modal());
    let mut files = LAYOUTS.map(table_path).to_vec();
    files.push(HEADER.into());
    for file in files {
        let digest = |dir: &Path| blake3::hash(&bytes(&dir.join(&file), None).unwrap());
        assert_eq!(digest(&one), digest(&two), "{}", file.display());
    }
    let problems = write(&one, &modal(), &Thresholds::default(), false).unwrap_err();
    tells(&problems, Kind::Input, &["one: found something that exists", "--force"]);
    write(&one, &modal(), &Thresholds::default(), true).unwrap();
}

#[test]
fn a_truncated_a_swapped_and_a_missing_table_are_damage() {
    let place = tempfile::tempdir().unwrap();
    let dir = place.path().join("modes");
    write(&dir, &modal(), &Thresholds::default(), false).unwrap();
    let path = |layout| dir.join(table_path(layout));
    let shapes = bytes(&path(&SHAPES), None).unwrap();
    files::write(&path(&SHAPES), &shapes[..shapes.len() / 2]).unwrap();
    tells(&read(&dir).unwrap_err(), Kind::Damage, &["shapes.parquet", "other bytes"]);
    let grids = bytes(&path(&GRIDS), None).unwrap();
    files::write(&path(&SHAPES), &grids).unwrap();
    tells(&read(&dir).unwrap_err(), Kind::Damage, &["shapes.parquet", "other bytes"]);
    files::write(&dir.join(HEADER), b"").unwrap();
    tells(&read(&dir).unwrap_err(), Kind::Input, &[HEADER, "missing field"]);
    let place = tempfile::tempdir().unwrap();
    let header = toml::to_string(&Header {
        format: 1,
        source: String::new(),
        units: "SI".to_owned(),
        frame: FRAME.to_owned(),
        normalisation: "mass".to_owned(),
        contains_engines: Vec::new(),
        contains_tanks: Vec::new(),
        labels: None,
        blake3: BTreeMap::new(),
        import: None,
    });
    files::write(&place.path().join(HEADER), header.unwrap().as_bytes()).unwrap();
    let problems = read(place.path()).unwrap_err();
    assert_eq!(problems.0.len(), 5);
    tells(&problems, Kind::Damage, &["grids.parquet", "mass.parquet", "parents.parquet"]);
}

#[test]
fn a_truncated_table_is_damage_without_a_digest_too() {
    let place = tempfile::tempdir().unwrap();
    let dir = written(place.path(), &modal(), |_, _| {});
    let path = dir.join(table_path(&MODES));
    let whole = bytes(&path, None).unwrap();
    files::write(&path, &whole[..whole.len() - 9]).unwrap();
    tells(&read(&dir).unwrap_err(), Kind::Damage, &["modes.parquet", "a whole Parquet file"]);
}

#[test]
fn all_problems_of_a_header_are_told_at_once() {
    let problems = refused(|header, _| {
        header.format = 3;
        header.units = "inch".to_owned();
        header.frame = "z up".to_owned();
        header.normalisation = "maximum".to_owned();
        header.contains_engines = vec!["a.b".to_owned(), "a.b".to_owned()];
        header.contains_tanks = vec!["lox".to_owned(), "lox".to_owned()];
        header.blake3.insert("shape".to_owned(), String::new());
    });
    assert_eq!(problems.0.len(), 7);
    let parts = ["format: found `3`", "`SI`", "`z up`", "`maximum`", "contains_tanks", "`shape`"];
    tells(&problems, Kind::Input, &parts);
}

#[test]
fn an_unknown_key_of_the_header_is_told_with_its_line() {
    let text = "format = 1\nsource = \"\"\nunit = \"SI\"\n";
    let told = header(text, "package.toml").unwrap_err().to_string();
    assert!(told.contains("line 3") && told.contains("`unit`"), "{told}");
}

#[test]
fn a_missing_column_and_a_value_that_is_not_finite_are_told() {
    let place = tempfile::tempdir().unwrap();
    let dir = written(place.path(), &modal(), |_, tables| {
        tables[2].push(&["m001", "nose"], &[95.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0]);
    });
    const FEWER: Layout =
        Layout { name: "mass", columns: &[TIME, Column("mass_kg", Holds::Text, "")] };
    let mut few = Table::new(&FEWER);
    few.push(&["heavy"], &[95.0]);
    let bytes = few.to_bytes(&FEWER).unwrap();
    files::write(&dir.join(table_path(&MASS)), &bytes).unwrap();
    let parts = [
        "mass_kg: found Utf8; allowed: double-precision",
        "ixy_kg_m2: found no such column",
        "phi_x_per_sqrt_kg: found inf in row 12",
    ];
    tells(&read(&dir).unwrap_err(), Kind::Input, &parts);
}

#[test]
fn missing_extra_and_repeated_rows_of_shapes_are_told_by_mode_and_grid() {
    let problems = refused(|_, tables| {
        let mut shapes = Table::new(&SHAPES);
        for set in &modal().sets {
            for mode in &set.modes {
                for grid in ["nose", "nose", "bow"] {
                    let row = [set.flight_time_s, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
                    shapes.push(&[&mode.label, grid], &row);
                }
            }
        }
        tables[2] = shapes;
    });
    let parts = [
        "mode `m001` at grid `nose`, 95 s again",
        "mode `m003` at grid `bow`, 100.5 s",
        "no row for mode `m002` at grid `tail`, 95 s",
    ];
    tells(&problems, Kind::Damage, &parts);
}

#[test]
fn a_wrong_normalisation_is_told_by_the_generalised_mass_and_by_the_masses_of_the_grids() {
    let problems = refused(|_, tables| {
        tables[1] = Table::new(&MODES);
        for set in &modal().sets {
            for (mode, mass) in set.modes.iter().zip([1.0, 250.0]) {
                let row = [set.flight_time_s, mode.frequency_hz, mass];
                tables[1].push(&[&mode.label], &row);
            }
        }
    });
    tells(&problems, Kind::Input, &["generalised_mass_kg: found 250 for mode `m002` at 95 s"]);
    let mut scaled = modal();
    for vector in &mut scaled.sets[1].modes[1].shape {
        *vector *= 2.0;
    }
    let problems = refused_of(&scaled, |_, _| {});
    tells(&problems, Kind::Input, &["3.1600 kg", "mode `m003` at 100.5 s"]);
    // Where the grids do not carry the whole mass, they cannot tell.
    for set in &mut scaled.sets {
        set.body.mass_kg = 7.0;
    }
    let place = tempfile::tempdir().unwrap();
    read(&written(place.path(), &scaled, |_, _| {})).unwrap();
}

#[test]
fn repeated_labels_and_grids_unsorted_and_unknown_times_are_told() {
    let problems = refused(|_, tables| {
        tables[0].push(&["nose"], &[95.0; 10]);
        tables[1].push(&["m001"], &[100.5, 9.0, 1.0]);
        tables[1].push(&["m009"], &[96.0, 9.0, 1.0]);
    });
    let parts = [
        "grid: found `nose` again at 95 s",
        "grids.parquet: flight_time_s: found an earlier time in row 6",
        "mode `m001` at 100.5 s again",
        "modes.parquet: flight_time_s: found 96",
    ];
    tells(&problems, Kind::Damage, &parts);
    let mut turned = modal();
    turned.sets.reverse();
    let problems = refused_of(&turned, |_, _| {});
    tells(&problems, Kind::Input, &["mass.parquet: flight_time_s: found [100.5, 95.0]"]);
}

#[test]
fn frequencies_masses_and_inertias_that_cannot_be_are_told() {
    let mut wrong = modal();
    wrong.sets[0].modes[0].frequency_hz = -1.0;
    wrong.sets[1].modes[1].frequency_hz = 0.1;
    wrong.sets[0].body.mass_kg = 0.0;
    wrong.sets[1].body.inertia_kg_m2.m11 = -3.0;
    wrong.sets[1].grids[1].mass_kg.z = -1.0;
    let parts = [
        "frequency_hz: found -1 for mode `m001`",
        "frequency_hz: found 0.1 for mode `m003`",
        "mass_kg: found 0;",
        "ixx_kg_m2",
        "a negative mass or inertia at `mitte ü`",
    ];
    tells(&refused_of(&wrong, |_, _| {}), Kind::Input, &parts);
}

#[test]
fn parents_that_do_not_exist_are_told() {
    let problems = refused(|_, tables| {
        tables[4].push(&["m003", "m009"], &[100.5, 0.2]);
        tables[4].push(&["m001", "m002"], &[100.5, 0.2]);
        tables[4].push(&["m002", "m001"], &[95.0, 1.5]);
    });
    let parts = [
        "parent: found `m003` at 100.5 s with the parent `m009`",
        "label: found `m001` at 100.5 s",
        "parent: found `m002` at 95 s",
        "overlap: found 1.5",
    ];
    tells(&problems, Kind::Damage, &parts);
}

#[test]
fn many_problems_of_a_kind_are_cut_short() {
    let problems = refused(|_, tables| {
        for _ in 0..1000 {
            tables[2].push(&["m001", "stern"], &[100.5; 7]);
        }
    });
    assert_eq!(problems.0.len(), REPORTED + 1);
    assert!(problems.to_string().ends_with("a grid of the grids table"));
}

#[test]
fn the_package_of_the_reference_vehicle_is_made_by_its_stick_model() {
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicles/sls-like");
    let stored = read(&place.join("modes")).unwrap();
    let text = files::read_text(&place.join("stick.toml")).unwrap();
    let stick = Stick::parse(&text, "stick.toml").unwrap();
    let thresholds = Thresholds::default();
    let (made, rigid) =
        solve(&stick, &stick.flight_times_s, Selection::UpTo(20.0), &thresholds).unwrap();
    assert!(rigid.iter().all(|r| r.count == 6));
    assert_eq!(stored.source, made.source);
    assert_eq!(stored.labels(), made.labels());
    assert_eq!(stored.parents.len(), made.parents.len());
    let freedoms = 6.0 * stick.nodes.len() as f64;
    for (a, b) in stored.sets.iter().zip(&made.sets) {
        assert_eq!(a.flight_time_s, b.flight_time_s);
        assert!((a.body.mass_kg / b.body.mass_kg - 1.0).abs() <= 1e-12);
        let mu: Vec<f64> = b.modes.iter().map(|m| m.frequency_hz.powi(-2)).collect();
        for (j, (p, q)) in a.modes.iter().zip(&b.modes).enumerate() {
            assert_eq!(p.label, q.label);
            assert!((p.frequency_hz / q.frequency_hz - 1.0).abs() <= 1e-9);
            // A vector turns by the round-off of the flexibility, n ε μ₁, over the distance to
            // the next eigenvalue; the last one's other neighbour is not in the package.
            let apart = [j.checked_sub(1), Some(j + 1)].into_iter().flatten();
            let gap = (apart.filter_map(|i| mu.get(i)).map(|other| (other - mu[j]).abs()))
                .fold(1e-3 * mu[j], f64::min);
            let bound = freedoms * f64::EPSILON * mu[0] / gap;
            let mut off = 0.0;
            for (i, grid) in b.grids.iter().enumerate() {
                let (u, v) = (p.shape[i] - q.shape[i], p.slope[i] - q.slope[i]);
                off += grid.mass_kg.dot(&u.component_mul(&u));
                off += grid.inertia_kg_m2.dot(&v.component_mul(&v));
            }
            assert!(off.sqrt() <= bound, "{} {:e} {bound:e}", p.label, off.sqrt());
        }
        assert_eq!(a.modes.len(), b.modes.len());
    }
}

#[test]
fn the_antisymmetric_booster_bending_mode_of_the_reference_vehicle_keeps_one_label() {
    let place = Path::new(env!("CARGO_MANIFEST_DIR")).join("vehicles/sls-like/modes");
    let modal = read(&place).unwrap();
    let mut before = 0.0;
    for set in &modal.sets {
        let [left, right] =
            ["left", "right"].map(|side| set.grid(&format!("booster.{side}.gimbal")).unwrap());
        let z = |mode: &Mode| [mode.shape[left].z, mode.shape[right].z];
        let antisymmetric = set.modes.iter().filter(|mode| z(mode)[0] * z(mode)[1] < 0.0);
        let strongest = antisymmetric
            .filter(|mode| mode.frequency_hz < 7.0)
            .max_by(|a, b| z(a)[0].abs().total_cmp(&z(b)[0].abs()))
            .unwrap();
        assert_eq!(strongest.label, "m006", "at {} s", set.flight_time_s);
        // Symmetry is exact but for round-off in the solver.
        assert!((z(strongest)[0] + z(strongest)[1]).abs() <= 1e-9 * z(strongest)[0].abs());
        // It rises as propellant burns.
        assert!(strongest.frequency_hz > before);
        before = strongest.frequency_hz;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn altered_tables_are_read_or_refused(
        which in 0..5_usize, at in 0..1_000_000_usize, to in any::<u8>(), cut in any::<bool>(),
    ) {
        let place = tempfile::tempdir().unwrap();
        let dir = written(place.path(), &modal(), |_, _| {});
        let path = dir.join(table_path(LAYOUTS[which]));
        let mut content = bytes(&path, None).unwrap();
        let at = at % content.len();
        if cut {
            content.truncate(at);
        } else {
            content[at] = to;
        }
        files::write(&path, &content).unwrap();
        prop_assert!(!cut || read(&dir).is_err());
        let _ = read(&dir);
    }

    #[test]
    fn any_header_is_read_or_refused(text in "[a-z_=.\"0-9\\[\\]\n -]{0,200}") {
        let _ = header(&text, "package.toml");
    }
}
