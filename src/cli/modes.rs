//! `tvse modes`: a modal package from a stick model, or the table of a package.
//!
//! Modes are found in `structure`, packages are written in `io::package`.

use super::{Error, PASS};
use crate::io::{files, package};
use crate::report;
use crate::spelling::allowed_instead;
use crate::structure::{self, Selection, Stick, Thresholds};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Make a modal package from a stick model, or show the modes of a package.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  tvse modes vehicles/sls-like/stick.toml -o modes --times 95,100,105 --max-hz 20
  tvse modes --show vehicles/sls-like/modes
  tvse modes --show vehicles/sls-like/modes --time 110 --figure m006.svg --mode m006

The modes are those of the free-free body, normalised to unit generalised mass. A label follows a
mode through the flight times while the squared mass-weighted overlap of its shapes exceeds
--keep-overlap; labels that split or merge are new and list their parents.")]
pub struct Args {
    /// Stick model (TOML).
    #[arg(required_unless_present = "show", requires = "output")]
    stick: Option<PathBuf>,
    /// Folder of the package to make.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Flight times, s [default: those of the stick model].
    #[arg(long, value_delimiter = ',', value_name = "S,S,…")]
    times: Vec<f64>,
    /// Keep the elastic modes up to this frequency, Hz.
    #[arg(long, default_value_t = 20.0, value_name = "HZ", conflicts_with = "count")]
    max_hz: f64,
    /// Keep this many of the lowest elastic modes instead.
    #[arg(long, value_name = "N")]
    count: Option<usize>,
    /// Overlap above which a label is kept, 0.5 to 1.
    #[arg(long, default_value_t = Thresholds::default().keep, value_name = "MAC")]
    keep_overlap: f64,
    /// Replace an existing package.
    #[arg(long)]
    force: bool,
    /// Show the modes of an existing package.
    #[arg(long, value_name = "DIR", conflicts_with_all = ["stick", "output", "times", "force"])]
    show: Option<PathBuf>,
    /// Flight time whose rigid and elastic modes are shown with the motion of the gimbals, s
    /// [default: the first].
    #[arg(long, value_name = "S", requires = "show")]
    time: Option<f64>,
    /// Grid shown as a gimbal [default: those with this role, or called so].
    #[arg(long, value_name = "GRID", requires = "show")]
    gimbal: Vec<String>,
    /// Write a figure of the mode given by --mode (SVG); an existing file is replaced.
    #[arg(long, value_name = "FILE", requires = "show", requires = "mode")]
    figure: Option<PathBuf>,
    /// Label of the mode in the figure.
    #[arg(long, value_name = "LABEL", requires = "figure")]
    mode: Option<String>,
}

/// Runs the command.
///
/// # Errors
/// Problems of the stick model or package, a model without free-free modes, an output that
/// cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let (stick, output) = match (&args.show, &args.stick, &args.output) {
        (Some(dir), ..) => return show(args, dir, out),
        (None, Some(stick), Some(output)) => (stick, output),
        _ => return Err(Error::Usage("a stick model and -o DIR, or --show DIR".to_owned())),
    };
    let file = files::name(stick);
    let model = Stick::parse(&files::read_text(stick)?, &file)?;
    let selection = match args.count {
        Some(count) => Selection::Count(count),
        None => Selection::UpTo(args.max_hz),
    };
    if !(0.5..=1.0).contains(&args.keep_overlap) {
        return Err(Error::Usage("--keep-overlap must be from 0.5 to 1".to_owned()));
    }
    if !(args.max_hz > 0.0) {
        return Err(Error::Usage("--max-hz must be above zero".to_owned()));
    }
    let thresholds = Thresholds { keep: args.keep_overlap, ..Thresholds::default() };
    let times = if args.times.is_empty() { &model.flight_times_s } else { &args.times };
    let (modal, rigid) = structure::solve(&model, times, selection, &thresholds)
        .map_err(|e| Error::Usage(format!("{file}: {e}")))?;
    package::write(output, &modal, &thresholds, args.force)?;
    out.write_all(report::modes::modes(&modal).as_bytes())?;
    let greatest = |of: fn(&structure::Rigid) -> f64| rigid.iter().map(of).fold(0.0, f64::max);
    writeln!(
        out,
        "6 rigid-body modes at each time: strain energy at most {:.0e} of its parts, overlap with \
         elastic modes at most {:.0e}",
        greatest(|r| r.strain),
        greatest(|r| r.overlap)
    )?;
    writeln!(out, "written to {}", output.display())?;
    Ok(PASS)
}

fn show(args: &Args, dir: &Path, out: &mut dyn Write) -> Result<u8, Error> {
    let modal = package::read(dir)?;
    let (import, sections) = package::read_import(dir)?.unzip();
    let time = args.time.unwrap_or(modal.sets[0].flight_time_s);
    let Some(set) = modal.at(time) else {
        let known: Vec<f64> = modal.sets.iter().map(|s| s.flight_time_s).collect();
        return Err(Error::Usage(format!("no modes at {time} s; allowed: one of {known:?}")));
    };
    let known = || set.grids.iter().map(|g| g.name.as_str());
    if let Some(unknown) = args.gimbal.iter().find(|g| set.grid(g).is_none()) {
        let allowed = allowed_instead(unknown, known());
        return Err(Error::Usage(format!("no grid `{unknown}`; allowed: {allowed}")));
    }
    let given = match (&import, args.gimbal.as_slice()) {
        (Some(import), []) => import.roles.get("gimbal").cloned().unwrap_or_default(),
        (_, given) => given.to_vec(),
    };
    let is_gimbal = |name: &str| match given.as_slice() {
        [] => name.rsplit('.').next() == Some("gimbal"),
        given => given.iter().any(|g| g == name),
    };
    let gimbals: Vec<&str> = known().filter(|name| is_gimbal(name)).collect();
    out.write_all(report::modes::modes(&modal).as_bytes())?;
    let details = report::modes::details(set, &gimbals, sections.as_deref().unwrap_or_default());
    out.write_all(details.as_bytes())?;
    for warning in import.iter().flat_map(|i| &i.warnings) {
        writeln!(out, "warning at the import: {}", warning.escape_debug())?;
    }
    if let (Some(figure), Some(label)) = (&args.figure, &args.mode) {
        let Some(mode) = set.mode(label) else {
            let labels = set.modes.iter().map(|m| m.label.as_str());
            let allowed = allowed_instead(label, labels);
            return Err(Error::Usage(format!("no mode `{label}` at {time} s; allowed: {allowed}")));
        };
        let drawn = report::figure::mode(&modal.source, set, &set.modes[mode]);
        files::write(figure, drawn.as_bytes())?;
        writeln!(out, "figure of {label} at {time} s written to {}", figure.display())?;
    }
    Ok(PASS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: Args,
    }

    fn run_line(words: &[&str]) -> Result<String, Error> {
        let line = Line::try_parse_from(words).unwrap_or_else(|e| panic!("{e}"));
        let mut out = Vec::new();
        run(&line.args, &mut out).map(|code| {
            assert_eq!(code, PASS);
            String::from_utf8(out).unwrap()
        })
    }

    #[test]
    fn a_package_is_made_once_and_shown_as_it_was_made() {
        let stick = concat!(env!("CARGO_MANIFEST_DIR"), "/vehicles/sls-like/stick.toml");
        let place = tempfile::tempdir().unwrap();
        let dir = place.path().join("modes");
        let dir = dir.to_str().unwrap();
        let words = ["modes", stick, "-o", dir, "--times", "95,100", "--count", "6"];
        let made = run_line(&words).unwrap();
        let figure = place.path().join("m006.svg");
        let figure = figure.to_str().unwrap();
        let show = ["modes", "--show", dir, "--time", "100", "--figure", figure, "--mode", "m006"];
        let shown = run_line(&show).unwrap();
        let table = made.split("6 rigid-body modes").next().unwrap();
        assert!(shown.starts_with(table), "{made}\n{shown}");
        assert!(shown.contains("gimbal booster.left.gimbal at 100 s"), "{shown}");
        let drawn = files::read_text(std::path::Path::new(figure)).unwrap();
        assert!(drawn.contains("mode m006") && drawn.contains("at 100 s</title>"), "{drawn}");
        let other = run_line(&["modes", "--show", dir, "--time", "7"]).unwrap_err();
        assert!(other.to_string().contains("no modes at 7 s"), "{other}");
        let other = run_line(&["modes", "--show", dir, "--gimbal", "tail"]).unwrap_err();
        assert!(other.to_string().contains("no grid `tail`"), "{other}");
        assert!(shown.contains("SLS-like, synthetic") && shown.contains("m006"), "{shown}");
        assert_eq!(run_line(&words).unwrap_err().code(), crate::cli::USAGE);
        run_line(&[&words[..], &["--force"]].concat()).unwrap();
    }

    #[test]
    fn a_time_outside_the_tables_and_a_missing_file_are_wrong_usage() {
        let stick = concat!(env!("CARGO_MANIFEST_DIR"), "/vehicles/sls-like/stick.toml");
        let late = run_line(&["modes", stick, "-o", "never", "--times", "900"]).unwrap_err();
        assert!(late.to_string().contains("900 s"), "{late}");
        assert_eq!(late.code(), crate::cli::USAGE);
        let words = ["modes", stick, "-o", "never", "--max-hz", "0.1"];
        assert!(run_line(&words).unwrap_err().to_string().contains("no elastic mode"));
        let below = run_line(&["modes", stick, "-o", "never", "--max-hz=-3"]).unwrap_err();
        assert!(below.to_string().contains("above zero"), "{below}");
        let none = run_line(&["modes", "no-such.toml", "-o", "never"]).unwrap_err();
        assert_eq!(none.code(), crate::cli::USAGE);
        assert!(!std::path::Path::new("never").exists());
    }
}
