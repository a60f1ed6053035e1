//! The commands of the README, small, and what every command has in common.

use crate::study::{Study, said};
use std::path::Path;

const COMMANDS: [&str; 29] = [
    "init",
    "check",
    "plan",
    "modes",
    "import",
    "nominal",
    "run",
    "merge",
    "status",
    "submit",
    "retry",
    "summary",
    "statistics",
    "sensitivity",
    "compare",
    "gate",
    "report",
    "replay",
    "worst",
    "influence",
    "response",
    "how-many",
    "planar",
    "margins",
    "actuator",
    "model",
    "schema",
    "reference",
    "completions",
];

#[test]
fn the_help_of_every_command_shows_an_example_of_it() {
    let here = Path::new(".");
    let overview = said(here, &["--help"]).out;
    let readme = include_str!("../../README.md");
    for command in COMMANDS {
        assert!(overview.lines().any(|line| line.trim().starts_with(command)), "{command}");
        assert!(readme.contains(&format!("`tvse {command}")), "{command} is not in the README");
        let help = said(here, &[command, "--help"]);
        assert_eq!(help.code, 0);
        let (_, example) = help.out.split_once("Example").unwrap_or_else(|| panic!("{command}"));
        assert!(example.contains(&format!("tvse {command}")), "{command}: {example}");
    }
    let known = overview.lines().skip_while(|line| !line.starts_with("Commands:")).skip(1);
    let known = known.take_while(|line| !line.is_empty()).count();
    // And `help` itself.
    assert_eq!(known, COMMANDS.len() + 1, "{overview}");
}

#[test]
fn completions_of_every_shell_know_the_commands() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let said = said(Path::new("."), &["completions", shell]);
        assert_eq!(said.code, 0);
        assert!(COMMANDS.iter().all(|command| said.out.contains(command)), "{shell}");
    }
}

#[test]
fn a_new_user_gets_from_init_to_gate_and_replay() {
    let place = tempfile::tempdir().unwrap();
    let ok = |folder: &Path, words: &[&str]| {
        let said = said(folder, words);
        assert_eq!((said.code, said.err.as_str()), (0, ""), "{words:?}: {said:?}");
        said.out
    };
    let made = ok(place.path(), &["init", "study"]);
    assert!(made.contains("runs/smoke.toml") && made.contains("synthetic"));
    let study = place.path().join("study");
    for run in ["runs/smoke.toml", "runs/reference.toml", "runs/all-engines.toml"] {
        assert!(ok(&study, &["check", run]).contains("tvse is m006"));
    }
    assert!(ok(&study, &["plan", "runs/smoke.toml"]).contains("draw keys"));
    assert!(ok(&study, &["nominal", "runs/smoke.toml"]).contains("m006"));
    let story = ok(&study, &["run", "runs/smoke.toml", "--cases", "5", "--jobs", "2"]);
    // The vehicle is never taken for the real one.
    assert!(story.contains("SLS-like, synthetic") && story.contains("5 cases"));
    let again = ok(&study, &["summary", "runs/smoke"]);
    assert!(again.lines().all(|line| story.contains(line)), "{again}\n{story}");
    let gates = "[[gate]]\nid = \"a\"\nmetric = \"damping_ratio\"\nvariant = \"jet_damping\"\n\
                 mode = \"tvse\"\nstatistic = \"minimum\"\nat_least_1 = -1.0\nmin_cases = 5\n\
                 rationale = \"holds for every pole\"\n";
    std::fs::write(study.join("easy.toml"), gates).unwrap();
    assert!(ok(&study, &["gate", "runs/smoke", "--gates", "easy.toml"]).contains("pass"));
    std::fs::write(study.join("hard.toml"), gates.replace("-1.0", "0.99")).unwrap();
    assert_eq!(said(&study, &["gate", "runs/smoke", "--gates", "hard.toml"]).code, 1);
    let words = ["run", "runs/smoke.toml", "--cases", "5", "-o", "out", "--gates", "hard.toml"];
    assert_eq!(said(&study, &words).code, 1);
    assert!(ok(&study, &["replay", "runs/smoke", "--case", "4"]).contains("bit for bit"));
    let stick = "vehicles/sls-like/stick.toml";
    ok(&study, &["modes", stick, "-o", "modes", "--times", "110", "--count", "8"]);
    assert!(ok(&study, &["modes", "--show", "modes"]).contains("m006"));
    assert!(ok(&study, &["actuator", "vehicles/sls-like"]).contains("booster.left"));
    assert!(ok(&study, &["how-many", "--coverage", "0.9973", "--risk", "0.1"]).contains("852"));
}

#[cfg(unix)]
#[test]
fn a_reader_that_leaves_early_changes_no_exit_code() {
    use std::process::Stdio;
    let study = Study::new();
    study.run("result", &[]);
    let text = "[[gate]]\nid = \"a\"\nmetric = \"damping_ratio\"\nvariant = \"jet_damping\"\n\
                mode = \"tvse\"\nstatistic = \"minimum\"\nat_least_1 = 0.99\nrationale = \"no\"\n";
    std::fs::write(study.path("hard.toml"), text).unwrap();
    let mut command =
        crate::study::tvse(&study.path(""), &["gate", "result", "--gates", "hard.toml"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_eq!((output.status.code(), output.stderr.len()), (Some(1), 0), "{output:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn an_output_that_cannot_be_written_is_told() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command =
        crate::study::tvse(Path::new("."), &["how-many", "--coverage", "0.95", "--risk", "0.05"]);
    let output = command.stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8(output.stderr).unwrap().contains("standard output"));
}
