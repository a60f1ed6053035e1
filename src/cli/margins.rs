//! `tvse margins`: margins of a single loop given as a ratio of polynomials with a delay.

use super::{Error, PASS};
use crate::margins::loops::decibels;
use crate::margins::{Assessment, Margin, Rational, Settings, assess};
use crate::problem::Problems;
use nalgebra::{Complex, Matrix3, Vector3};
use std::f64::consts::TAU;
use std::io::Write;

/// Stability margins of a single loop: numerator, denominator and exact delay.
#[derive(clap::Args)]
#[command(after_help = "\
The loop is closed by negative feedback: -1 is the critical point. Prints one line a margin: name,
value, frequency in rad/s (0: the limit of low frequency; empty: nothing crosses, the value is the
limit up to which is searched). An unstable closed loop has no margin: all are 0.

Examples:
  tvse margins --numerator 25 --denominator 1,10,10,10
  tvse margins --numerator 2 --denominator 1,0 --delay 0.25
  tvse margins --numerator 25 --denominator 1,10,10,10 --curve > loop.csv")]
pub struct Args {
    /// Coefficients of the numerator, highest power of s first
    #[arg(long, value_name = "LIST", value_delimiter = ',', required = true)]
    #[arg(allow_negative_numbers = true)]
    numerator: Vec<f64>,
    /// Coefficients of the denominator, highest power of s first
    #[arg(long, value_name = "LIST", value_delimiter = ',', required = true)]
    #[arg(allow_negative_numbers = true)]
    denominator: Vec<f64>,
    /// Delay, s
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    delay: f64,
    /// Gain margin that is the height of the Nichols ellipse, dB
    #[arg(long, value_name = "DB", default_value_t = 6.0)]
    ellipse_gain: f64,
    /// Phase margin that is the half width of the Nichols ellipse, degrees
    #[arg(long, value_name = "DEG", default_value_t = 30.0)]
    ellipse_phase: f64,
    /// Prints the response as CSV instead: frequency, parts, magnitude and unwrapped phase
    #[arg(long)]
    curve: bool,
}

/// Runs the command.
///
/// # Errors
/// Coefficients that are no loop, loops that cannot be followed, and output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let refuse = |key: &str, found: String| {
        let allowed = "a ratio of finite coefficients, strictly proper or with a direct term below 0.5, whose \
                       closed loop can be followed";
        Problems::input("command line", key, found, allowed)
    };
    for (key, value) in
        [("--ellipse-gain", args.ellipse_gain), ("--ellipse-phase", args.ellipse_phase)]
    {
        if !(value > 0.0 && value.is_finite()) {
            let allowed = "a finite number above 0";
            return Err(Problems::input("command line", key, value.to_string(), allowed).into());
        }
    }
    let loops = Rational::new(&args.numerator, &args.denominator, args.delay)
        .map_err(|error| refuse("--numerator, --denominator, --delay", error.to_string()))?;
    let poles = loops.poles().map_err(|error| refuse("--denominator", error.to_string()))?;
    let [lowest, highest] =
        loops.frequencies_rad_s().map_err(|error| refuse("--numerator", error.to_string()))?;
    let defaults = Settings::default();
    let settings = Settings {
        lowest_hz: defaults.lowest_hz.min(lowest / TAU),
        highest_hz: defaults.highest_hz.max(highest / TAU),
        gain_margin_db: args.ellipse_gain,
        phase_margin_deg: args.ellipse_phase,
        ..defaults
    };
    let zero = Complex::default();
    let one = |s: &Complex<f64>| Matrix3::from_diagonal(&Vector3::new(loops.at(*s), zero, zero));
    let g = |points: &[Complex<f64>]| points.iter().map(one).collect();
    let found = assess(g, &poles, &[], &[], &settings)
        .map_err(|error| refuse("--numerator", error.to_string()))?;
    if args.curve {
        curve(&found, out)?
    } else {
        table(&found, out)?
    }
    Ok(PASS)
}

fn table(found: &Assessment, out: &mut dyn Write) -> std::io::Result<()> {
    let margins = &found.axes[0];
    writeln!(out, "name,value,omega_rad_s")?;
    writeln!(out, "unstable_poles,{},", found.unstable)?;
    let mut line = |name: &str, margin: Margin| {
        let omega = margin.omega_rad_s.map(|omega| omega.to_string()).unwrap_or_default();
        writeln!(out, "{name},{},{omega}", margin.value)
    };
    line("gain_margin_low_db", margins.gain_low_db)?;
    line("gain_margin_high_db", margins.gain_high_db)?;
    line("phase_margin_deg", margins.phase_deg)?;
    line("delay_margin_s", margins.delay_s)?;
    line("disk_margin", margins.disk)?;
    line("ellipse_distance", margins.ellipse)?;
    let [low, high] = margins.disk_gains();
    writeln!(out, "disk_gain_low,{low},")?;
    writeln!(out, "disk_gain_high,{high},")?;
    writeln!(out, "disk_phase_deg,{},", margins.disk_phase_deg())
}

fn curve(found: &Assessment, out: &mut dyn Write) -> std::io::Result<()> {
    writeln!(out, "frequency_hz,re,im,magnitude_db,phase_deg")?;
    for (sample, phase) in found.curve.samples.iter().zip(&found.curve.phase_deg) {
        let (omega, l) = (sample.omega_rad_s(), sample.broken[0]);
        if sample.place >= 1.0 {
            let (hz, db) = (omega / TAU, decibels(l));
            writeln!(out, "{hz},{},{},{db},{}", l.re, l.im, phase[0])?;
        }
    }
    Ok(())
}
