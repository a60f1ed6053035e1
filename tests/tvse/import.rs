//! Imports through the built program: round trips, real results, campaigns on imported modes.

use crate::study::{Study, columns, said};
use std::fs;
use std::path::{Path, PathBuf};
use tvse::dynamics::jet_damping::{Station, case_per_flow};
use tvse::io::package;
use tvse::vehicle::Modal;

#[path = "../../examples/stick_as_tables.rs"]
#[expect(dead_code, reason = "its main is the example's")]
mod stick_as_tables;

/// Greatest difference of any number of two packages, over the greatest of its kind; signs of
/// whole modes may differ.
fn apart(a: &Modal, b: &Modal) -> f64 {
    let mut greatest = 0.0_f64;
    for (s, t) in a.sets.iter().zip(&b.sets) {
        assert_eq!((s.modes.len(), s.grids.len()), (t.modes.len(), t.grids.len()));
        greatest = greatest
            .max((s.body.mass_kg / t.body.mass_kg - 1.0).abs())
            .max((s.body.cg_m - t.body.cg_m).norm() / s.body.cg_m.norm())
            .max(
                (s.body.inertia_kg_m2 - t.body.inertia_kg_m2).norm() / s.body.inertia_kg_m2.norm(),
            );
        for (g, h) in s.grids.iter().zip(&t.grids) {
            assert_eq!(g.name, h.name);
            greatest = greatest.max((g.position_m - h.position_m).norm() / 100.0);
        }
        for (m, n) in s.modes.iter().zip(&t.modes) {
            greatest = greatest.max((m.frequency_hz / n.frequency_hz - 1.0).abs());
            for (u, v) in [(&m.shape, &n.shape), (&m.slope, &n.slope)] {
                let scale = u.iter().map(|u| u.norm()).fold(0.0, f64::max);
                let differ = |sign: f64| {
                    u.iter().zip(v).map(|(u, v)| (u - v * sign).norm()).fold(0.0, f64::max)
                };
                greatest = greatest.max(differ(1.0).min(differ(-1.0)) / scale);
            }
        }
    }
    greatest
}

#[test]
fn a_stick_model_that_comes_back_by_tables_gives_the_same_campaign() {
    let study = Study::new();
    let original = package::read(&study.path("vehicles/sls-like/modes")).unwrap();
    // The campaign's flight time alone, so that labels are in order of frequency on both sides.
    let mut one = Modal { parents: Vec::new(), ..original };
    one.sets.retain(|set| set.flight_time_s == 110.0);
    let named = one.sets[0].mode("m006").unwrap();
    for (i, mode) in one.sets[0].modes.iter_mut().enumerate() {
        mode.label = format!("m{:03}", i + 1);
    }
    let label = one.sets[0].modes[named].label.clone();
    let dir = study.path("vehicles/sls-like/modes");
    let thresholds = tvse::structure::Thresholds::default();
    package::write(&dir, &one, &thresholds, true).unwrap();
    let vehicle = "vehicles/sls-like/vehicle.toml";
    study.edit(
        vehicle,
        "flight_times_s = [80.0, 95.0, 100.0, 105.0, 110.0, 112.0, 114.0]",
        "flight_times_s = [110.0]",
    );
    study.edit(vehicle, "time_s = 105.0", "time_s = 110.0");
    study.edit(vehicle, "band_time_s = 100.0", "band_time_s = 110.0");
    study.edit(vehicle, "labels = [\"m006\"]", &format!("labels = [\"{label}\"]"));
    study.run("before", &[]);

    stick_as_tables::write(&one, &study.path("fem")).unwrap();
    let imported = study.said(&["import", "fem/import.toml", "-o", "vehicles/sls-like/imported"]);
    assert_eq!((imported.code, imported.err.as_str()), (0, ""), "{}", imported.out);
    let back = package::read(&study.path("vehicles/sls-like/imported")).unwrap();
    // Round-off of a hundred metres in millimetres through least squares over the body.
    assert!(apart(&one, &back) < 1e-10, "{}", apart(&one, &back));
    study.edit(vehicle, "modal_package = \"modes\"", "modal_package = \"imported\"");
    study.run("after", &[]);
    let [before, after] =
        ["before", "after"].map(|run| columns(&study.path(&format!("{run}/tables/modes.parquet"))));
    assert_eq!(before.texts, after.texts);
    for key in ["pole_re_rad_s", "pole_im_rad_s"] {
        let pairs = before.numbers[key].iter().zip(&after.numbers[key]);
        for (a, b) in pairs {
            let (a, b) = (a.unwrap(), b.unwrap());
            // Poles near 35 rad/s, whose real parts are small differences.
            assert!((a - b).abs() < 1e-7, "{key}: {a} {b}");
        }
        assert_eq!(before.numbers[key].len(), 2 * 7);
    }
}

#[test]
fn no_path_of_a_description_leaves_its_folder_unless_a_flag_allows_it() {
    let study = Study::new();
    let original = package::read(&study.path("vehicles/sls-like/modes")).unwrap();
    let one = Modal { sets: original.sets[..1].to_vec(), parents: Vec::new(), ..original };
    stick_as_tables::write(&one, &study.path("fem")).unwrap();
    fs::rename(study.path("fem/nodes.csv"), study.path("nodes.csv")).unwrap();
    let import = |more: &[&str]| {
        study.said(&[&["import", "fem/import.toml", "-o", "made", "--force"], more].concat())
    };
    assert!(import(&[]).err.contains("results[0]: found \"nodes.csv\": No such file"));
    study.edit("fem/import.toml", "\"nodes.csv\"", "\"../nodes.csv\"");
    let outside = import(&[]);
    assert_eq!(outside.code, 2);
    assert!(outside.err.contains("\"../nodes.csv\", which leads outside"), "{}", outside.err);
    assert_eq!(import(&["--allow-outside"]).code, 0);
    let absolute = study.path("nodes.csv").display().to_string();
    study.edit("fem/import.toml", "../nodes.csv", &absolute);
    assert!(import(&[]).err.contains("which leads outside"));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink(study.path("nodes.csv"), study.path("fem/link.csv")).unwrap();
        study.edit("fem/import.toml", &absolute, "link.csv");
        assert!(import(&[]).err.contains("\"link.csv\", a link that leads outside"));
    }
}

#[test]
fn a_package_is_not_replaced_without_force_and_says_where_it_came_from() {
    let study = Study::new();
    let original = package::read(&study.path("vehicles/sls-like/modes")).unwrap();
    let one = Modal { sets: original.sets[..1].to_vec(), parents: Vec::new(), ..original };
    stick_as_tables::write(&one, &study.path("fem")).unwrap();
    assert_eq!(study.said(&["import", "fem/import.toml"]).code, 0);
    let again = study.said(&["import", "fem/import.toml"]);
    assert!(again.code == 2 && again.err.contains("--force"), "{}", again.err);
    let (header, sections) = package::read_import(&study.path("fem/modes")).unwrap().unwrap();
    assert_eq!(header.units, "mm-t-s");
    assert_eq!(
        header.inputs.keys().collect::<Vec<_>>(),
        ["import.toml", "modes_80.csv", "nodes.csv"]
    );
    assert!(header.rigid_body_mode.len() == 6 && sections.is_empty());
    assert!(header.roles["gimbal"].contains(&"booster.left.gimbal".to_owned()));
    let shown = study.said(&["modes", "--show", "fem/modes"]);
    assert!(shown.out.contains("gimbal booster.left.gimbal at 80 s"), "{}", shown.out);
    let damaged = study.path("fem/modes_80.csv");
    let text = fs::read_to_string(&damaged).unwrap();
    fs::write(&damaged, text.replacen("1001,", "1001,x", 1)).unwrap();
    let said = study.said(&["import", "fem/import.toml", "--force"]);
    assert!(said.code == 2 && said.err.contains("modes_80.csv"), "{}", said.err);
}

/// A file of real results: in the folder that `TVSE_FEM_DATA` names, else beside the repository.
fn real(name: &str) -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/fem");
    let path = std::env::var("TVSE_FEM_DATA").map_or(beside, PathBuf::from).join(name);
    if !path.exists() {
        eprintln!("skipped: no {} (set TVSE_FEM_DATA)", path.display());
        return None;
    }
    Some(path)
}

/// Grids at the aft end of the real model and of the engine on them, in its millimetres: four
/// corners of a truss, whose common motion is that of the thrust structure.
const REAL_IMPORT: &str = r#"
format = 1
source = "free-free truss of 49 grids, MSC Nastran"
units = "mm-kg-s"
frame = { origin = [0, 150, 150], aft = [1, 0, 0], y = [0, 1, 0] }
body = { kind = "reduced", engine = [{ name = "core.main", mass_kg = 0.2 }] }
modes = { normalisation = "mass", max_hz = 60 }

[[flight_time]]
time_s = 100
results = ["full.op2"]
mass = { from = "rigid-body-modes" }

[[grid]]
name = "gimbal"
role = "gimbal"
section = { nodes = [8, 16, 24, 32] }

[[grid]]
name = "rock"
role = "actuator"
node = 8

[[grid]]
name = "tilt"
role = "actuator"
node = 16

[[centreline]]
name = "case"
from_m = [0.6, 0, 0]
to_m = [2.1, 0, 0]
stations = 6
slice_m = 0.02
radius_m = [0.2, 0.22]
"#;

const REAL_VEHICLE: &str = r#"
name = "free-free truss with an engine"
modal_package = "modes"
flight_times_s = [100.0]
[structure]
damping_ratio = 0.005
band_time_s = 100.0
[[named_mode]]
name = "first"
labels = ["m001"]
[[motor]]
name = "motor"
specific_impulse_s = 250.0
time_s = [0.0, 200.0]
thrust_n = [50.0, 50.0]
mass_flow_kg_s = [0.02, 0.02]
[[engine]]
group = "core"
name = "main"
motor = "motor"
gimbal_grid = "gimbal"
thrust_direction = [-1.0, 0.0, 0.0]
case_stations = ["case.01", "case.02", "case.03", "case.04", "case.05"]
[engine.nozzle]
mass_kg = 0.2
cg_m = 0.05
inertia_kg_m2 = 0.002
axial_inertia_kg_m2 = 0.001
length_m = 0.2
[[engine.actuator]]
name = "rock"
attach_grid = "rock"
action_line = [1.0, 0.0, 0.0]
kind = "second-order"
frequency_hz = 20.0
damping_ratio = 0.5
[[engine.actuator]]
name = "tilt"
attach_grid = "tilt"
action_line = [1.0, 0.0, 0.0]
kind = "second-order"
frequency_hz = 20.0
damping_ratio = 0.5
"#;

const REAL_RUN: &str = r#"
vehicle = "vehicle.toml"
dispersion = "dispersion.toml"
cases = 20
seed = 1
flight_times_s = [100.0]
modes = ["first"]
gimballed = ["core.*"]
[[variant]]
name = "off"
case_jet_damping = false
nozzle_jet_damping = "off"
[[variant]]
name = "on"
case_jet_damping = true
nozzle_jet_damping = "equation-13"
"#;

const REAL_DISPERSION: &str = r#"
[[row]]
path = "core.*.thrust"
level = "engine"
apply = "scale"
law = { kind = "uniform", low = 0.9, high = 1.1 }
source = "a test"
"#;

#[test]
fn a_real_free_free_set_of_278_modes_becomes_a_package_and_runs_a_campaign() {
    let Some(op2) = real("pyyeti/full.op2") else { return };
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    fs::copy(op2, folder.join("full.op2")).unwrap();
    for (name, text) in [
        ("import.toml", REAL_IMPORT),
        ("vehicle.toml", REAL_VEHICLE),
        ("run.toml", REAL_RUN),
        ("dispersion.toml", REAL_DISPERSION),
    ] {
        fs::write(folder.join(name), text).unwrap();
    }
    let imported = said(folder, &["import", "import.toml"]);
    assert_eq!((imported.code, imported.err.as_str()), (0, ""));
    assert!(imported.out.contains("and 278 modes by"), "{}", imported.out);
    assert!(imported.out.contains("single precision (32 bits)"), "{}", imported.out);
    assert!(imported.out.contains("6 rigid-body modes"), "{}", imported.out);
    let modal = package::read(&folder.join("modes")).unwrap();
    let set = &modal.sets[0];
    for (mode, known) in set.modes.iter().zip([10.674, 11.105, 11.672, 21.486]) {
        // Known are circular frequencies, to three decimals.
        let found = std::f64::consts::TAU * mode.frequency_hz;
        assert!((found - known).abs() < 6e-4, "{found}");
    }
    // Printed by the grid point weight generator of the run: 3.345436 kg, cg at 633.3702 mm.
    // Six shapes in single precision over 2 m of grids give it to about 1e-6.
    assert!((set.body.mass_kg / 3.345_436 - 1.0).abs() < 1e-5, "{}", set.body.mass_kg);
    assert!((set.body.cg_m.x - 0.633_370_2).abs() < 1e-5, "{}", set.body.cg_m);
    let inertia = set.body.inertia_kg_m2.diagonal();
    for (found, printed) in inertia.iter().zip([0.392_837_9, 1.023_790, 1.354_959]) {
        assert!((found / printed - 1.0).abs() < 1e-4, "{inertia}");
    }
    let ran = said(folder, &["run", "run.toml", "-o", "made"]);
    assert_eq!((ran.code, ran.err.as_str()), (0, ""), "{}", ran.out);
    let table = columns(&folder.join("made/tables/modes.parquet"));
    let status = table.texts["status"].iter().flatten();
    assert!(
        status.clone().all(|s| s == "ok") && status.count() == 21 * 2,
        "{:?}",
        table.texts["status"]
    );
    let hz = table.numbers["frequency_hz"].iter().flatten();
    assert!(hz.clone().all(|f| (1.0..2.5).contains(f)), "{:?}", hz.collect::<Vec<_>>());
}

/// Free-free modes of unit length and mean square: squared wave numbers, φ(0) = 2, φ'(0).
const BEAM: [(f64, f64); 3] = [
    (4.730_040_744_862_7, -4.647_275_507),
    (7.853_204_624_095_8, -7.859_309_014),
    (10.995_607_838_002, -10.995_238_94),
];

#[test]
fn a_solid_beam_by_calculix_has_the_modes_slopes_and_jet_damping_of_its_beam() {
    let Ok(folder) = std::env::var("TVSE_CALCULIX") else {
        eprintln!("skipped: scripts/calculix runs CalculiX and this test (TVSE_CALCULIX)");
        return;
    };
    let place = tempfile::tempdir().unwrap();
    let place = place.path();
    fs::copy(Path::new(&folder).join("beam.frd"), place.join("beam.frd")).unwrap();
    let text = include_str!("../../docs/import/calculix/import.toml");
    fs::write(place.join("import.toml"), text).unwrap();
    let imported = said(place, &["import", "import.toml"]);
    assert_eq!((imported.code, imported.err.as_str()), (0, ""));
    assert!(imported.out.contains("text of 6 digits"), "{}", imported.out);
    let modal = package::read(&place.join("modes")).unwrap();
    let set = &modal.sets[0];
    let (length, side, young, density) = (10.0_f64, 0.2_f64, 200e9_f64, 7850.0_f64);
    let mass = density * length * side * side;
    // Six digits of shapes and of positions.
    assert!((set.body.mass_kg / mass - 1.0).abs() < 1e-4, "{}", set.body.mass_kg);
    assert!((set.body.cg_m.x - length / 2.0).abs() < 1e-4);
    assert_eq!(set.modes.len(), 6);
    let gyration = side / 12.0_f64.sqrt();
    let stations: Vec<usize> =
        (0..set.grids.len()).filter(|&i| set.grids[i].name.starts_with("case.")).collect();
    assert_eq!(stations.len(), 81);
    for (j, mode) in set.modes.iter().enumerate() {
        let (b, end_slope) = BEAM[j / 2];
        let axis = 1 + j % 2;
        let euler =
            b * b / (std::f64::consts::TAU * length * length) * (young / density).sqrt() * gyration;
        // What Timoshenko's beam loses to shear (E/κG = 2/(5/6) without Poisson's ratio) and rotary
        // inertia is of the order (b r/L)² (1 + E/κG); 80 quadratic bricks err by less than a
        // hundredth of it.
        let softer = (b * gyration / length).powi(2) * (1.0 + 2.4);
        let lower = 1.0 - mode.frequency_hz / euler;
        assert!(lower > 0.0 && lower < 1.2 * softer, "mode {j}: {lower} of {softer}");
        // Repeated modes come out as pure y, then pure z.
        let across = mode.shape.iter().map(|u| u[3 - axis].abs()).fold(0.0, f64::max);
        assert!(across * mass.sqrt() < 1e-4, "mode {j}: {across}");
        let [first, last] = [stations[0], stations[80]];
        for (end, slope_sign) in [(first, 1.0), (last, -1.0)] {
            let displacement = mode.shape[end][axis] * mass.sqrt();
            assert!((displacement.abs() / 2.0 - 1.0).abs() < softer, "mode {j}: {displacement}");
            // Rotation about z is +dv/dx, about y it is −dw/dx.
            let turn = mode.slope[end][3 - axis] * if axis == 1 { 1.0 } else { -1.0 };
            let slope = turn * mass.sqrt() * length / displacement;
            // The section turns less than the axis by the shear angle, none at the free end.
            assert!(
                (slope / (slope_sign * end_slope) - 1.0).abs() < 1.5 * softer,
                "mode {j}: {slope}"
            );
        }
    }
    // Jet damping of the case: 3 ṁ/M for every bending mode by the trapezoid of 81 stations, which
    // errs by 0.0032 for the first and by (b₂/b₁)² of it for the others; shear as above.
    let stations: Vec<Station> = (stations.iter())
        .map(|&i| Station {
            x_m: set.grids[i].position_m.x,
            shape: set.modes.iter().map(|m| m.shape[i]).collect(),
            slope: set.modes.iter().map(|m| m.slope[i]).collect(),
        })
        .collect();
    let matrix = case_per_flow(&stations);
    for (j, (b, _)) in (0..6).map(|j| (j, BEAM[j / 2])) {
        let damping = -matrix[j * 6 + j] * mass;
        let trapezoid = 0.0033 * (b / BEAM[0].0).powi(2);
        let softer = 3.0 * (b * gyration / length).powi(2) * (1.0 + 2.4);
        assert!((damping - 3.0).abs() < trapezoid + softer, "mode {j}: {damping}");
    }
    println!("case jet damping of mode 1: {} ṁ/M", -matrix[0] * mass);
}
