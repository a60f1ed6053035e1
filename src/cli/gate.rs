//! `tvse gate`: holds a finished run against its gates.

use super::Error;
use crate::gate::{self, Gate, Names, Report, Source};
use crate::io::pair::Pair;
use crate::io::{Run, files, offenders};
use crate::report::{annotations, gates as table, junit, markdown};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Gates on a finished run: a table with a verdict for each, and `gates.json` in the run's folder.
///
/// The cases that count against the gates go to `gate_offenders.parquet` beside it, each with the
/// command that replays it. With a baseline both names begin with `baseline_`, so that they stand beside
/// those of the run alone. Where GITHUB_STEP_SUMMARY is set the outcomes are added to that file as
/// Markdown, and with GITHUB_ACTIONS gates that do not pass are printed as annotations.
///
/// Exit codes: 0 every gate passes, 1 one fails, 2 wrong usage or input, 3 incomplete data or
/// nothing evaluated, 4 inconclusive: more cases are needed. A gate of severity `warning` is shown
/// but does not change the exit code.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  tvse gate runs/reference --gates runs/reference.gates.toml
  tvse gate runs/reference --gates runs/reference.gates.toml --junit gates.xml
  tvse gate runs/new --gates runs/regression.gates.toml --baseline runs/reference
  tvse run runs/reference.toml --gates runs/reference.gates.toml")]
pub struct Args {
    /// Folder of the run
    run: PathBuf,
    /// The gates
    #[arg(long, value_name = "FILE")]
    gates: PathBuf,
    /// Run with the same draws, for gates with `baseline_run = true`
    #[arg(long, value_name = "RUN")]
    baseline: Option<PathBuf>,
    #[command(flatten)]
    outputs: Outputs,
}

/// Where outcomes go beside the standard output.
#[derive(Debug, Default, clap::Args)]
pub struct Outputs {
    /// File for the outcomes of the gates (default: gates.json in the run's folder, or
    /// baseline_gates.json)
    #[arg(long, value_name = "FILE", requires = "gates")]
    json: Option<PathBuf>,
    /// File for the outcomes of the gates as JUnit XML, one test case a gate
    #[arg(long, value_name = "FILE", requires = "gates")]
    junit: Option<PathBuf>,
    /// File for the outcomes of the gates as Markdown
    #[arg(long, value_name = "FILE", requires = "gates")]
    markdown: Option<PathBuf>,
}

/// A run to be held against gates, and where the outcomes go.
#[derive(Debug, Clone, Copy)]
pub struct Judged<'a> {
    /// Folder of the run.
    pub folder: &'a Path,
    /// File of the gates.
    pub gates: &'a Path,
    /// Where the outcomes go.
    pub outputs: &'a Outputs,
    /// What the names of files in the run's folder begin with.
    pub prefix: &'static str,
}

/// What the names of files begin with where a baseline was compared with.
pub const BASELINE: &str = "baseline_";

/// Runs the command.
///
/// # Errors
/// No such run, damaged tables, a baseline with other draws, or all problems of the gate file.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let run = Run::open(&args.run)?;
    let prefix = args.baseline.as_ref().map_or("", |_| BASELINE);
    let judged = Judged { folder: &args.run, gates: &args.gates, outputs: &args.outputs, prefix };
    match &args.baseline {
        None => judge(&run, &judged, out),
        Some(folder) => {
            let baseline = Run::open(folder)?;
            judge_pair(&Pair { run: &run, baseline: &baseline }, folder, &judged, out)
        }
    }
}

/// The gates of a file, checked against what the run has, and the file's name.
///
/// # Errors
/// All problems of the gate file.
pub fn rules(path: &Path, run: &impl Names) -> Result<(Vec<Gate>, String), Error> {
    let name = files::name(path);
    let rules = gate::parse(&files::read_text(path)?, &name)?;
    gate::check(&rules, run, &name)?;
    Ok((rules, name))
}

/// As [`judge`], for a run and the `baseline` in another folder.
///
/// # Errors
/// As [`judge`], and runs whose draws are not common.
pub fn judge_pair(
    pair: &Pair<'_>,
    baseline: &Path,
    judged: &Judged<'_>,
    out: &mut dyn Write,
) -> Result<u8, Error> {
    let (rules, _) = rules(judged.gates, pair)?;
    let selections = rules.iter().map(|gate| &gate.selection).filter(|s| s.baseline_run);
    let mut populations: Vec<&str> = selections.map(|s| s.population.as_str()).collect();
    populations.sort_unstable();
    populations.dedup();
    for population in populations {
        pair.common(population, [&files::name(judged.folder), &files::name(baseline)])?;
    }
    judge(pair, judged, out)
}

/// Evaluates gates on a run, prints them, stores what they found and gives the exit code.
///
/// # Errors
/// All problems of the gate file, damaged tables, or a file that cannot be written.
pub fn judge(source: &impl Source, judged: &Judged<'_>, out: &mut dyn Write) -> Result<u8, Error> {
    let (rules, name) = rules(judged.gates, source)?;
    let report = Report::new(gate::evaluate(&rules, source, &name)?);
    let folder = files::name(judged.folder);
    let outputs = judged.outputs;
    let place = |name: &str| judged.folder.join(format!("{}{name}", judged.prefix));
    let json = outputs.json.clone().unwrap_or_else(|| place("gates.json"));
    let rows = place(offenders::FILE);
    files::write(&json, report.to_json().as_bytes())?;
    offenders::write(&report, &folder, &rows)?;
    write!(out, "{}", table::gates(&report, &folder))?;
    for path in [&json, &rows] {
        writeln!(out, "{}", path.display())?;
    }
    if let Some(path) = &outputs.junit {
        files::write(path, junit::text(&report, &folder).as_bytes())?;
    }
    let markdown = markdown::text(&report, &folder);
    if let Some(path) = &outputs.markdown {
        files::write(path, markdown.as_bytes())?;
    }
    let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty());
    if let Some(path) = set("GITHUB_STEP_SUMMARY") {
        files::append(Path::new(&path), &markdown::cut(&markdown))?;
    }
    if set("GITHUB_ACTIONS").is_some() {
        write!(out, "{}", annotations::text(&report, &folder, &name))?;
    }
    Ok(report.exit_code)
}
