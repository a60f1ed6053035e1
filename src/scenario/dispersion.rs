//! A dispersion table from its text.
//!
//! What rows mean for a vehicle is decided in `dispersion::resolve`.

use super::table;
use crate::dispersion::{Dispersion, Table, resolve};
use crate::problem::Problems;
use crate::vehicle::Vehicle;

/// Reads the dispersion table `text` of the file called `file` for `vehicle`.
///
/// # Errors
/// All problems of the file at once, each with its key path.
pub fn read(file: &str, text: &str, vehicle: &Vehicle) -> Result<Dispersion, Problems> {
    let (raw, mut findings) = table::read::<Table>(file, text)?;
    let dispersion =
        resolve(&raw, vehicle, &mut |key, found, allowed| findings.push(key, found, allowed));
    findings.finish(Some(dispersion))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::fixture::{vehicle, vehicle_with_descendants};
    use crate::dispersion::{Draw, Role};
    use proptest::prelude::*;

    /// The reference table without the rows for autopilot and hydraulics, which the vehicle of these
    /// tests has not.
    fn reference() -> &'static str {
        let text = include_str!("../../dispersions/reference.toml");
        text.split("# --- Flight control").next().unwrap()
    }

    fn problems(text: &str) -> Vec<String> {
        let problems = read("d.toml", text, &vehicle()).unwrap_err();
        assert!(problems.0.iter().all(|p| p.file == "d.toml"));
        problems.0.into_iter().map(|p| p.key).collect()
    }

    #[test]
    fn the_reference_table_reads_and_states_its_sources() {
        for vehicle in [vehicle(), vehicle_with_descendants()] {
            let dispersion = read("reference.toml", reference(), &vehicle).unwrap();
            for Draw { key, source, worst, role, .. } in dispersion.draws() {
                let letter = source.split(':').next().unwrap();
                assert!(["F", "R", "E", "D"].contains(&letter), "{key}: {source}");
                assert_eq!(worst.is_some(), *role != Role::Common, "{key}");
            }
        }
    }

    #[test]
    fn only_the_worst_low_damping_of_the_reference_lies_outside_its_law() {
        let dispersion = read("reference.toml", reference(), &vehicle()).unwrap();
        for draw in dispersion.draws() {
            let Some([low, high]) = draw.worst else { continue };
            let damping = draw.key.starts_with("modes.") && draw.key.contains("damping");
            assert_eq!(draw.law.is_outside(low), damping, "{}", draw.key);
            assert!(!draw.law.is_outside(high), "{}", draw.key);
        }
    }

    #[test]
    fn the_reference_bands_give_every_mode_one_law() {
        let dispersion = read("reference.toml", reference(), &vehicle()).unwrap();
        // At three sigma 10, 15 and 20 per cent for the modes at 4, 5 and 10 Hz.
        for (label, high) in [("m001", 1.10), ("m002", 1.15), ("m003", 1.20)] {
            let index = dispersion.index(&format!("modes.{label}.frequency @ mode")).unwrap();
            let [_, found] = dispersion.draws()[index].law.range().unwrap();
            assert!((found - high).abs() < 1e-15, "{label}: {found}");
        }
    }

    #[test]
    fn every_problem_of_shape_and_of_meaning_is_named_at_once() {
        let keys = problems(
            "[[row]]\npaht = \"structure.damping\"\nlaw = { kind = \"unifrm\", low = 0, high = 1 }\n\
             apply = \"absolut\"\nlevel = \"vehicle\"\nsource = \"E\"\n\
             [[row]]\npath = \"structure.damping\"\nlaw = { kind = \"normal\", mean = nan, sigmaa = 1 }\n\
             apply = \"scale\"\nlevel = 3\nsource = \"E\"\n\
             [[row]]\npath = \"structure.dampng\"\nlaw = { kind = \"uniform\", low = 1, high = 0 }\n\
             apply = \"scale\"\nlevel = \"vehicle\"\n\
             [[row]]\npath = \"structure.dampng\"\nlaw = { kind = \"uniform\", low = 1, high = 0 }\n\
             apply = \"scale\"\nlevel = \"vehicle\"\nsource = \"E\"\nworst = [1]\n[[comon]]\n\
             [[row]]\npath = \"structure.dampng\"\nlaw = { kind = \"uniform\", low = 1, high = 0 }\n\
             apply = \"scale\"\nlevel = \"vehicle\"\nsource = \"E\"\n",
        );
        for key in [
            "comon",
            "row[0].paht",
            "row[0].law.kind",
            "row[0].apply",
            "row[1].law.mean",
            "row[1].law.sigmaa",
            "row[1].level",
            "row[2].source",
            "row[3].worst",
            "row[4].path",
            "row[4].law.high",
        ] {
            assert!(keys.iter().any(|k| k == key), "{key} is not among {keys:?}");
        }
    }

    #[test]
    fn infinities_and_wrong_types_are_refused_with_their_place() {
        let row = |law: &str| {
            format!(
                "[[row]]\npath = \"structure.damping\"\nlaw = {law}\napply = \"scale\"\n\
                 level = \"vehicle\"\nsource = \"E\"\n"
            )
        };
        let law = |law: &str| problems(&row(law));
        assert_eq!(law("{ kind = \"normal\", mean = 1, sigma = inf }"), ["row[0].law.sigma"]);
        assert_eq!(law("{ kind = \"fixed\", value = \"1\" }"), ["row[0].law.value"]);
        assert_eq!(law("{ kind = \"discrete\", values = [1, nan] }"), ["row[0].law.values[1]"]);
        assert_eq!(law("1"), ["row[0].law"]);
    }

    #[test]
    fn an_empty_table_disperses_nothing() {
        assert!(read("d.toml", "", &vehicle()).unwrap().draws().is_empty());
    }

    #[test]
    fn the_schema_describes_every_key_of_a_row() {
        let schema = schemars::schema_for!(Table).to_value();
        let row = schema.pointer("/$defs/Row/properties").unwrap().as_object().unwrap();
        for key in ["path", "law", "apply", "level", "id", "source", "unit", "band_hz", "worst"] {
            assert!(row[key].get("description").is_some(), "{key}");
        }
        assert_eq!(schema.pointer("/$defs/Row/additionalProperties").unwrap(), false);
    }

    /// Words a table is made of, so that random text comes close to one.
    const WORDS: &[&str] = &[
        "[[row]]\n",
        "[[common]]\n",
        "path = ",
        "level = ",
        "apply = ",
        "law = ",
        "source = ",
        "id = ",
        "unit = ",
        "band_hz = ",
        "common = ",
        "common_weight = ",
        "worst = ",
        "\n",
        "\"modes.*.frequency\"",
        "\"booster.*.thrust\"",
        "\"booster.left.nozzle.mass\"",
        "\"*.*.gimbal.*.shape\"",
        "\"...\"",
        "\"\"",
        "\"vehicle\"",
        "\"engine\"",
        "\"mode\"",
        "\"scale\"",
        "\"absolute\"",
        "\"offset\"",
        "\"f\"",
        "1.0",
        "-1e308",
        "nan",
        "inf",
        "0",
        "[0, 5]",
        "[5, 0]",
        "[1e308, -1e308]",
        "[]",
        "{ kind = \"uniform\", low = 0, high = 1 }",
        "{ kind = \"normal\", mean = 1, sigma = 1e308 }",
        "{ kind = \"discrete\", values = [] }",
        "{ kind = \"truncated_normal\", mean = 1, sigma = 1e-320, low = 1e308 }",
        "{ kind = \"empirical\", values = [1, 2], probabilities = [0] }",
        "{}",
        "=",
        "#",
    ];

    proptest! {
        #[test]
        fn no_text_makes_the_reader_panic(
            words in proptest::collection::vec(proptest::sample::select(WORDS), 0..60)
        ) {
            let _ = read("d.toml", &words.concat(), &vehicle());
        }

        #[test]
        fn no_row_makes_the_reader_panic(
            path in "(modes|booster|structure|\\*)(\\.(left|\\*|m001|nozzle|damping|mass|é| )){0,4}",
            level in "(vehicle|engine|booster|actuator|mode|x)",
            kind in proptest::sample::select(vec!["uniform", "normal", "fixed", "beta", "triangular"]),
            numbers in proptest::collection::vec(proptest::num::f64::ANY, 6),
            apply in proptest::sample::select(vec!["scale", "absolute", "offset"]),
        ) {
            let n: Vec<String> = numbers.iter().map(|x| toml::Value::Float(*x).to_string()).collect();
            let law = match kind {
                "uniform" => format!("low = {}, high = {}", n[0], n[1]),
                "normal" => format!("mean = {}, sigma = {}", n[0], n[1]),
                "fixed" => format!("value = {}", n[0]),
                "beta" => format!("alpha = 2, beta = 3, low = {}, high = {}", n[0], n[1]),
                _ => format!("low = {}, mode = {}, high = {}", n[0], n[1], n[2]),
            };
            let text = format!(
                "[[row]]\npath = \"{path}\"\nlevel = \"{level}\"\napply = \"{apply}\"\n\
                 law = {{ kind = \"{kind}\", {law} }}\nsource = \"E\"\n\
                 worst = [{}, {}]\nband_hz = [{}, {}]\n",
                n[2], n[3], n[4], n[5]
            );
            if let Ok(dispersion) = read("d.toml", &text, &vehicle()) {
                let sampler = crate::dispersion::Sampler::new(&dispersion, 1);
                let draws = sampler.cursor().draw(3, &[], true).clone();
                prop_assert!(draws.values.iter().flatten().all(|v| !v.is_nan()));
            }
        }
    }
}
