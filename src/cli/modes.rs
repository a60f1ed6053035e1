//! `tvse modes`: a modal package from a stick model, or the table of a package.
//!
//! Modes are found in `structure`, packages are written in `io::package`.

use super::{Error, PASS};
use crate::io::{files, package};
use crate::report;
use crate::structure::{self, Selection, Stick, Thresholds};
use std::io::Write;
use std::path::PathBuf;

/// Make a modal package from a stick model, or show the modes of a package.
#[derive(clap::Args)]
#[command(after_help = "Examples:
  tvse modes vehicles/sls-like/stick.toml -o modes --times 95,100,105 --max-hz 20
  tvse modes --show vehicles/sls-like/modes

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
}

/// Runs the command.
///
/// # Errors
/// Problems of the stick model or package, a model without free-free modes, an output that
/// cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let (stick, output) = match (&args.show, &args.stick, &args.output) {
        (Some(dir), ..) => {
            out.write_all(report::modes::modes(&package::read(dir)?).as_bytes())?;
            return Ok(PASS);
        }
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
        let shown = run_line(&["modes", "--show", dir]).unwrap();
        assert!(made.starts_with(&shown), "{made}\n{shown}");
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
        let none = run_line(&["modes", "no-such.toml", "-o", "never"]).unwrap_err();
        assert_eq!(none.code(), crate::cli::USAGE);
        assert!(!std::path::Path::new("never").exists());
    }
}
