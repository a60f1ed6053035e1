//! The examples of plans and searches in `runs` do what their first comment says.

use crate::study::said;
use std::fs;
use std::path::Path;

/// Examples that end within seconds.
const EXAMPLES: [&str; 5] = ["latin-hypercube", "sobol", "saltelli", "nested", "worst-on-worst"];

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy(&path, &target);
        } else {
            fs::copy(&path, &target).unwrap();
        }
    }
}

#[test]
fn every_command_in_the_comment_of_an_example_succeeds() {
    let place = tempfile::tempdir().unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for folder in ["vehicles", "dispersions"] {
        copy(&root.join(folder), &place.path().join(folder));
    }
    fs::create_dir(place.path().join("runs")).unwrap();
    for entry in fs::read_dir(root.join("runs")).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            fs::copy(&path, place.path().join("runs").join(path.file_name().unwrap())).unwrap();
        }
    }
    for name in EXAMPLES {
        let text = fs::read_to_string(root.join(format!("runs/{name}.toml"))).unwrap();
        let commands: Vec<&str> =
            text.lines().filter_map(|line| line.strip_prefix("#     tvse ")).collect();
        assert!(commands[0].starts_with(&format!("run runs/{name}.toml")), "{commands:?}");
        for command in commands {
            let words: Vec<&str> = command.split_whitespace().collect();
            let said = said(place.path(), &words);
            assert_eq!(said.code, 0, "{command}: {said:?}");
        }
    }
    // The gates of the examples are warnings that fail: what they find is in their outcomes.
    for (name, statistic) in [("nested", "outer draws"), ("worst-on-worst", "worst on worst")] {
        let gates =
            fs::read_to_string(place.path().join(format!("runs/{name}/gates.json"))).unwrap();
        assert!(gates.contains(statistic) && gates.contains("\"fail\""), "{gates}");
    }
}
