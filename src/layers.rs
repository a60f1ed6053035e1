//! The layers of the crate, kept by a test: each names only layers below it, and third parties stay
//! behind their walls.

#![expect(clippy::disallowed_methods, reason = "the test reads the sources")]

use std::fs;
use std::path::{Path, PathBuf};

/// Modules from the lowest layer up; those of one layer do not name each other.
const LAYERS: [&[&str]; 10] = [
    &["problem", "spelling", "stats"],
    &["vehicle"],
    &["dynamics", "dispersion", "structure", "fem"],
    &["modal", "import"],
    &["margins"],
    &["campaign"],
    &["gate"],
    &["scenario", "report"],
    &["io"],
    &["cli"],
];

/// Third parties and the modules that may name them.
const WALLS: [(&str, &[&str]); 11] = [
    ("faer::linalg", &["modal", "structure"]),
    ("arrow::", &["io"]),
    ("parquet::", &["io"]),
    ("hdf5_reader::", &["fem"]),
    ("clap::", &["cli"]),
    ("rayon::", &["campaign"]),
    ("rand::", &["dispersion"]),
    ("comfy_table::", &["report"]),
    ("quick_junit::", &["report"]),
    ("indicatif::", &["cli"]),
    ("resvg::", &["report"]),
];

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// Every source file as its module and the code outside tests.
fn code() -> Vec<(String, PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    sources(&root, &mut found);
    found.sort();
    let test_file = |path: &Path| {
        ["tests", "fixture", "synthetic", "closed_forms"]
            .iter()
            .any(|name| path.file_stem().is_some_and(|stem| stem == *name))
    };
    found.retain(|path| !test_file(path) && path.parent() != Some(root.as_path()));
    let module = |path: &Path| {
        let inside = path.strip_prefix(&root).unwrap();
        inside.components().next().unwrap().as_os_str().to_str().unwrap().to_owned()
    };
    let outside_tests = |path: &Path| {
        let text = fs::read_to_string(path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        code.lines()
            .filter(|line| !line.trim_start().starts_with("//"))
            .collect::<Vec<_>>()
            .join("\n")
    };
    found.into_iter().map(|path| (module(&path), path.clone(), outside_tests(&path))).collect()
}

#[test]
fn each_layer_names_only_layers_below_it() {
    let layer = |module: &str| LAYERS.iter().position(|layer| layer.contains(&module));
    for (module, path, code) in code() {
        let own = layer(&module).unwrap_or_else(|| panic!("{module} is in no layer"));
        assert!(
            module == "cli" || !code.contains("crate::{"),
            "{}: one path a use",
            path.display()
        );
        for named in code.split("crate::").skip(1) {
            let named: String =
                named.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            if let Some(other) = layer(&named) {
                assert!(
                    other < own || named == module,
                    "{} names crate::{named}, which is not below it",
                    path.display()
                );
            }
        }
    }
}

#[test]
fn third_parties_stay_behind_their_walls() {
    for (module, path, code) in code() {
        for (party, allowed) in WALLS {
            let named = code.match_indices(party).any(|(at, _)| {
                !code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':')
            });
            assert!(
                !named || allowed.contains(&module.as_str()),
                "{} names {party}",
                path.display()
            );
        }
    }
}
