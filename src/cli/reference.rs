//! `tvse reference`: the reference pages, made from the registries.

use super::{Error, PASS};
use crate::campaign::summary::LEVELS;
use crate::gate;
use crate::io::{files, package, reference as columns};
use crate::report::reference;
use crate::scenario::schema::{FileKind, schema};
use serde_json::Value;
use std::io::Write;
use std::path::PathBuf;

/// Writes the reference pages as Markdown: every TOML key, every column, every statistic with what it assumes.
///
/// They are made from what the program itself reads and writes by, so that they cannot say anything else.
#[derive(clap::Args)]
#[command(after_help = "\
Example:
  tvse reference docs/reference")]
pub struct Args {
    /// Folder of the pages; pages of the same names are replaced
    folder: PathBuf,
}

/// Name, title and a word on every kind of TOML file.
const FILES: [(&str, &str, &str); 7] = [
    ("run", "Run files", "What a campaign is: `runs/*.toml`, read by `tvse check` and `tvse run`."),
    (
        "vehicle",
        "Vehicle files",
        "Engines, nozzles, actuators, motors, tanks, autopilot: `vehicles/*/vehicle.toml`.",
    ),
    ("dispersion", "Dispersion tables", "What is drawn, by which law: `dispersions/*.toml`."),
    ("gates", "Gate files", "What a run is held against: `tvse gate RUN --gates FILE`."),
    ("stick", "Stick models", "Beams from which `tvse modes` makes a modal package."),
    (
        "import",
        "Import descriptions",
        "How `tvse import` reads the results of a finite element program.",
    ),
    ("package", "Heads of modal packages", "`package.toml` in the folder of a modal package."),
];

fn value(name: &str) -> Value {
    let schema = match name {
        "run" => schema(FileKind::Run),
        "vehicle" => schema(FileKind::Vehicle),
        "dispersion" => schema(FileKind::Dispersion),
        "gates" => schema(FileKind::Gates),
        "stick" => schema(FileKind::Stick),
        "import" => schema(FileKind::Import),
        _ => package::schema(),
    };
    schema.as_value().clone()
}

/// Every page: its name and its text.
pub fn pages() -> Vec<(String, String)> {
    let mut pages: Vec<(String, String)> = FILES
        .into_iter()
        .map(|(name, title, about)| {
            (format!("{name}.md"), reference::keys(title, about, &value(name)))
        })
        .collect();
    let gates = gate::report_schema().as_value().clone();
    let about = "What `tvse gate` and `tvse run --gates` write: `gates.json` in the run's folder, `baseline_gates.json` where a \
                 baseline run was compared with.";
    pages.push(("outcomes.md".to_owned(), reference::keys("Outcomes of gates", about, &gates)));
    let all = columns::columns();
    let rows = all.iter().map(|c| [c.table, &c.name, c.type_name, &c.unit, &c.description]);
    pages.push(("columns.md".to_owned(), reference::columns(rows)));
    let said: Vec<(String, String)> = (value("gates")["$defs"]["RawStatistic"]["oneOf"].as_array())
        .into_iter()
        .flatten()
        .filter_map(|statistic| {
            let text = |key: &str| statistic[key].as_str().map(str::to_owned);
            Some((text("const")?, text("description")?))
        })
        .collect();
    pages.push(("statistics.md".to_owned(), reference::statistics(&said, &LEVELS)));
    pages
}

/// Runs the command.
///
/// # Errors
/// Pages that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    files::ensure_folder(&args.folder)?;
    for (name, text) in pages() {
        let target = args.folder.join(name);
        files::write(&target, text.as_bytes())?;
        writeln!(out, "{}", target.display())?;
    }
    Ok(PASS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::reference::GATES;

    #[test]
    fn the_pages_in_the_repository_are_what_the_registries_say() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/reference");
        for (name, text) in pages() {
            let stored = files::read_text(&folder.join(&name)).unwrap_or_default();
            assert!(stored == text, "{name} differs: run `tvse reference docs/reference`");
        }
    }

    #[test]
    fn every_statistic_of_gates_has_its_assumptions() {
        let gates = value("gates");
        let all = gates["$defs"]["RawStatistic"]["oneOf"].as_array().unwrap();
        let words: Vec<&str> = all.iter().map(|s| s["const"].as_str().unwrap()).collect();
        assert!(words.iter().all(|word| GATES.iter().any(|gate| gate.word == *word)), "{words:?}");
    }
}
