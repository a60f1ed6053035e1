//! `tvse planar`: the planar pair of one nozzle and one bending mode.

use super::campaign::{self, Campaign, Options};
use super::interrupt::Interrupt;
use super::{Error, PASS};
use crate::campaign::definition::MOST_CASES;
use crate::campaign::planar::{PlanarCampaign, Scatter};
use crate::dynamics::NozzleJet;
use crate::dynamics::planar::{CriticalThrust, Parameters, Planar, Verdict};
use crate::io::Results;
use crate::io::inputs::Inputs;
use nalgebra::Complex;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Poles, Routh array and critical thrust of the planar pair (one nozzle, one bending mode), or a
/// campaign of it.
#[derive(clap::Args)]
#[command(after_help = "\
Any consistent set of units will do; SI is named. The coupling is either given or made from the
slope and the first moment: Υ = J ψ + S φ.

Examples:
  tvse planar --inertia 1 --zeta-n 0.3 --omega-n 1.2 --zeta-b 0.005 --omega-b 1 \\
              --upsilon 0.2 --phi 1 --thrust 0.2
  tvse planar --inertia 24000 --zeta-n 0.3 --omega-n 39.6 --zeta-b 0.005 --omega-b 32.7 \\
              --phi 2.8e-3 --psi 3.4e-4 --first-moment 5670 --thrust 1.2e7 \\
              --mass-flow 4700 --nozzle-length 4 --nozzle-jet equation-13
  tvse planar --inertia 1 --zeta-n 0.3 --omega-n 1.2 --zeta-b 0.005 --omega-b 1 \\
              --upsilon 0.2 --phi 1 --sweep 0:1:101 > poles.csv
  tvse planar --inertia 1 --zeta-n 0.3 --omega-n 1.2 --zeta-b 0.005 --omega-b 1 \\
              --upsilon 0.2 --phi 1 --cases 100000 --output pair \\
              --scatter thrust=0:0.4 --scatter zeta_b=0.0035:0.0075")]
pub struct Args {
    /// Nozzle inertia about the pivot J, kg·m²
    #[arg(long, value_name = "J")]
    inertia: f64,
    /// Damping ratio of the actuator ζ_n
    #[arg(long, value_name = "ZETA")]
    zeta_n: f64,
    /// Natural frequency of the actuator ω_n, rad/s
    #[arg(long, value_name = "OMEGA")]
    omega_n: f64,
    /// Damping ratio of the bending mode ζ_b
    #[arg(long, value_name = "ZETA")]
    zeta_b: f64,
    /// Natural frequency of the bending mode ω_b, rad/s
    #[arg(long, value_name = "OMEGA")]
    omega_b: f64,
    /// Inertial coupling Υ, kg^1/2·m
    #[arg(long, value_name = "UPSILON", allow_negative_numbers = true)]
    #[arg(required_unless_present = "first_moment", conflicts_with = "first_moment")]
    upsilon: Option<f64>,
    /// First moment of the nozzle about the pivot S = m r, kg·m; makes Υ = J ψ + S φ
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    first_moment: Option<f64>,
    /// Gimbal shape φ, kg^-1/2
    #[arg(long, value_name = "PHI", allow_negative_numbers = true)]
    phi: f64,
    /// Gimbal slope ψ, rad/m per kg^1/2
    #[arg(long, value_name = "PSI", default_value_t = 0.0, allow_negative_numbers = true)]
    psi: f64,
    /// Thrust R, N
    #[arg(long, value_name = "R", default_value_t = 0.0)]
    thrust: f64,
    /// Mass flow, kg/s
    #[arg(long, value_name = "FLOW", default_value_t = 0.0)]
    mass_flow: f64,
    /// Nozzle length from the pivot to the exit L_n, m
    #[arg(long, value_name = "L", default_value_t = 0.0)]
    nozzle_length: f64,
    /// Jet damping of the nozzle
    #[arg(long, value_enum, default_value_t = Jet::Off)]
    nozzle_jet: Jet,
    /// Prints the poles at COUNT thrusts from FROM to TO as CSV instead
    #[arg(long, value_name = "FROM:TO:COUNT", allow_hyphen_values = true)]
    sweep: Option<String>,
    /// Runs a campaign of so many cases around the pair instead
    #[arg(long, value_name = "N", requires = "output", conflicts_with = "sweep",
        value_parser = clap::value_parser!(u64).range(1..=MOST_CASES))]
    cases: Option<u64>,
    /// Scatters a parameter evenly between two values in every case; may be repeated
    #[arg(long, value_name = "NAME=LOW:HIGH", requires = "cases", value_parser = scatter)]
    scatter: Vec<Scatter>,
    /// Seed of the campaign
    #[arg(long, value_name = "N", requires = "cases", default_value_t = 1)]
    seed: u64,
    /// Folder of the campaign's results; it must not exist unless the run goes on
    #[arg(long, short, value_name = "DIR", requires = "cases")]
    output: Option<PathBuf>,
    /// Gates to hold the campaign against; the exit code is theirs
    #[arg(long, value_name = "FILE", requires = "cases")]
    gates: Option<PathBuf>,
    #[command(flatten)]
    outputs: super::gate::Outputs,
    #[command(flatten)]
    options: Options,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Jet {
    /// None
    Off,
    /// Equation (13), linear in the nozzle length
    #[value(name = "equation-13")]
    Equation13,
    /// Exact for a rigid nozzle with straight flow
    RigidNozzle,
}

/// Runs the command.
///
/// # Errors
/// Parameters that are not allowed; output that cannot be written.
pub fn run(args: &Args, out: &mut dyn Write) -> Result<u8, Error> {
    let coupling = match (args.upsilon, args.first_moment) {
        (Some(upsilon), _) => upsilon,
        (None, moment) => args.inertia * args.psi + moment.unwrap_or(0.0) * args.phi,
    };
    let parameters = Parameters {
        inertia_kg_m2: args.inertia,
        actuator_damping_ratio: args.zeta_n,
        actuator_omega_rad_s: args.omega_n,
        mode_damping_ratio: args.zeta_b,
        mode_omega_rad_s: args.omega_b,
        coupling,
        shape: args.phi,
        slope: args.psi,
        thrust_n: args.thrust,
        nozzle_jet: match args.nozzle_jet {
            Jet::Off => NozzleJet::Off,
            Jet::Equation13 => NozzleJet::Linear,
            Jet::RigidNozzle => NozzleJet::RigidNozzle,
        },
        mass_flow_kg_s: args.mass_flow,
        nozzle_length_m: args.nozzle_length,
    };
    let planar = Planar::new(parameters).map_err(|e| Error::Usage(e.to_string()))?;
    if let (Some(cases), Some(folder)) = (args.cases, &args.output) {
        return run_campaign(args, parameters, cases, folder, out);
    }
    match &args.sweep {
        Some(range) => sweep(&planar, range, out)?,
        None => print(&planar, out)?,
    }
    Ok(PASS)
}

/// Reads `NAME=LOW:HIGH`.
fn scatter(text: &str) -> Result<Scatter, String> {
    let parts = text.split_once('=').and_then(|(name, range)| {
        let (low, high) = range.split_once(':')?;
        Some((name, low.trim().parse().ok()?, high.trim().parse().ok()?))
    });
    let (name, low, high) = parts.ok_or("allowed: NAME=LOW:HIGH, for instance thrust=0:0.4")?;
    Scatter::new(&name.replace('-', "_"), low, high)
}

fn run_campaign(
    args: &Args,
    parameters: Parameters,
    cases: u64,
    folder: &Path,
    out: &mut dyn Write,
) -> Result<u8, Error> {
    let (opening, access) = args.options.opening(folder, true)?;
    let (pool, jobs) = args.options.pool()?;
    let pool = pool.of_small_cases();
    let interrupt = Interrupt::listen().map_err(|e| Error::Usage(format!("signals: {e}")))?;
    let pair = PlanarCampaign::new(parameters, &args.scatter, args.seed);
    let inputs = Inputs::of_text("planar.txt", &format!("{parameters:#?}\n"));
    let outline = pair.outline(args.seed, cases, inputs.digests());
    campaign::check_gates(args.gates.as_deref(), &outline)?;
    let results = Results::open(folder, outline, Some(&inputs), opening, access)?;
    let gates = args.gates.as_deref().map(|gates| (gates, &args.outputs));
    let campaign = Campaign { access, title: "planar pair", gates };
    let case = |population, case| pair.evaluate(population, case);
    campaign::carry_out(&campaign, &args.options, (&pool, jobs), &interrupt, results, case, out)
}

fn poles(planar: &Planar) -> Result<[Complex<f64>; 4], Error> {
    let message = "the poles of the quartic were not found: its coefficients are too far apart";
    planar.poles().ok_or_else(|| Error::Usage(message.into()))
}

fn print(planar: &Planar, out: &mut dyn Write) -> Result<(), Error> {
    let poles = poles(planar)?;
    let [a0, a1, a2, a3, a4] = planar.quartic().map(number);
    writeln!(out, "quartic a4 … a0                {a4}  {a3}  {a2}  {a1}  {a0}")?;
    let column = match planar.routh_column() {
        Some(column) => column.map(number).join("  "),
        None => "ends early with a zero".into(),
    };
    writeln!(out, "Routh array, first column      {column}")?;
    let verdict = match planar.verdict() {
        Verdict::Stable => "stable".into(),
        Verdict::Unstable(count) => format!("unstable, {count} poles in the right half plane"),
        Verdict::Marginal => "marginal".into(),
    };
    writeln!(out, "verdict                        {verdict}")?;
    let or = |value: Option<f64>, unit: &str, none: &str| match value {
        Some(value) => format!("{} {unit}", number(value)),
        None => none.into(),
    };
    let critical = match planar.critical_thrust() {
        CriticalThrust::At(thrust) => format!("{} N", number(thrust)),
        CriticalThrust::Never => "none: no thrust destabilises".into(),
        CriticalThrust::UnstableWithoutThrust => "none: not stable without thrust".into(),
    };
    let never = "none: Υφ ≤ 0";
    writeln!(out, "critical thrust (exact)        {critical}")?;
    writeln!(out, "bound (4), necessary only      {}", or(planar.necessary_bound_n(), "N", never))?;
    writeln!(out, "limit Υ ω_b²/φ as ζ_b → 0      {}", or(planar.undamped_bound_n(), "N", never))?;
    let dog = or(planar.tail_wags_dog_rad_s(), "rad/s", "none: Rφ/Υ is not positive");
    writeln!(out, "tail-wags-dog frequency        {dog}")?;
    let added =
        or(planar.first_order_added_damping(), "", "none: an undamped actuator in resonance");
    writeln!(out, "damping ratio added, 1st order {}, without jet damping", added.trim_end())?;
    writeln!(
        out,
        "\n{:>20}{:>20}{:>20}{:>20}",
        "Re s, rad/s", "Im s, rad/s", "|Im s|/2π, Hz", "damping ratio"
    )?;
    for pole in poles {
        let hertz = pole.im.abs() / std::f64::consts::TAU;
        let cells = [pole.re, pole.im, hertz, -pole.re / pole.norm()].map(number);
        writeln!(out, "{:>20}{:>20}{:>20}{:>20}", cells[0], cells[1], cells[2], cells[3])?;
    }
    Ok(())
}

fn sweep(planar: &Planar, range: &str, out: &mut dyn Write) -> Result<(), Error> {
    let usage = || {
        Error::Usage(format!(
            "--sweep: found \"{range}\"; allowed: FROM:TO:COUNT, for instance 0:1:101"
        ))
    };
    let parts: Vec<&str> = range.split(':').collect();
    let [from, to, count] = parts.as_slice() else { return Err(usage()) };
    let from: f64 = from.trim().parse().map_err(|_| usage())?;
    let to: f64 = to.trim().parse().map_err(|_| usage())?;
    let count: u32 = count.trim().parse().map_err(|_| usage())?;
    if !(from.is_finite() && to.is_finite() && count > 0) {
        return Err(usage());
    }
    write!(out, "thrust_n,stable")?;
    for i in 1..=4 {
        write!(out, ",pole_{i}_re_rad_s,pole_{i}_im_rad_s")?;
    }
    writeln!(out)?;
    for i in 0..count {
        // The last point is TO itself.
        let share = if count > 1 { f64::from(i) / f64::from(count - 1) } else { 0.0 };
        let thrust = from * (1.0 - share) + to * share;
        let planar = planar.with_thrust(thrust).map_err(|e| Error::Usage(e.to_string()))?;
        write!(out, "{thrust},{}", planar.verdict() == Verdict::Stable)?;
        for pole in poles(&planar)? {
            write!(out, ",{},{}", pole.re, pole.im)?;
        }
        writeln!(out)?;
    }
    Ok(())
}

/// Ten decimals where that shows at least eight digits, ten digits with an exponent elsewhere.
fn number(x: f64) -> String {
    if x == 0.0 || (0.01..1e6).contains(&x.abs()) { format!("{x:.10}") } else { format!("{x:.9e}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(clap::Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    const PAIR: [&str; 16] = [
        "planar",
        "--inertia",
        "1",
        "--zeta-n",
        "0.3",
        "--omega-n",
        "1.2",
        "--zeta-b",
        "0.005",
        "--omega-b",
        "1",
        "--phi",
        "1",
        "--upsilon",
        "0.2",
        "--thrust=0.2",
    ];

    fn output(arguments: &[&str]) -> Result<String, Error> {
        let command =
            Command::try_parse_from(arguments).map_err(|e| Error::Usage(e.to_string()))?;
        let mut out = Vec::new();
        run(&command.args, &mut out)?;
        Ok(String::from_utf8(out).unwrap())
    }

    #[test]
    fn the_reference_pair_is_printed_with_the_stated_digits() {
        let text = output(&PAIR).unwrap();
        for expected in [
            "0.2502057481 N",
            "12.2360000000 N",
            "-4.866973955e-3",
            "0.9997954647",
            "verdict                        stable",
        ] {
            assert!(text.contains(expected), "{expected} in\n{text}");
        }
    }

    #[test]
    fn a_sweep_is_a_table_of_comma_separated_values() {
        let text = output(&[&PAIR[..], &["--sweep", "0:1:3"]].concat()).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(rows.len(), 4);
        assert!(rows.iter().all(|row| row.len() == 10));
        assert_eq!((rows[1][0], rows[1][1]), ("0", "true"));
        assert_eq!((rows[3][0], rows[3][1]), ("1", "false"));
        assert!(output(&[&PAIR[..], &["--sweep", "0:1"]].concat()).is_err());
    }

    #[test]
    fn poles_that_numbers_cannot_hold_are_wrong_usage_and_nothing_is_printed() {
        for (place, value) in [(15, "--thrust=1e300"), (2, "1e308"), (6, "1e200")] {
            let mut arguments = PAIR;
            arguments[place] = value;
            let command = Command::try_parse_from(arguments).unwrap();
            let mut out = Vec::new();
            match run(&command.args, &mut out) {
                Err(error) => {
                    assert_eq!(error.code(), crate::cli::USAGE, "{value}");
                    assert!(out.is_empty(), "{value}");
                }
                // The thrust alone can be told apart from the rest: poles ±√(Rφ/(…)) and two small ones.
                Ok(_) => {
                    let text = String::from_utf8(out).unwrap();
                    assert!(place == 15 && !text.contains("NaN"), "{value}: {text}");
                    let row =
                        |line: &&str| line.trim_start().starts_with("0.0000000000        0.0");
                    assert!(!text.lines().any(|line| row(&line)), "{text}");
                }
            }
        }
    }

    #[test]
    fn a_pair_that_cannot_exist_is_wrong_usage() {
        let mut arguments = PAIR;
        arguments[14] = "1.5";
        let error = output(&arguments).unwrap_err();
        assert_eq!(error.code(), crate::cli::USAGE);
        assert!(error.to_string().contains("not positive definite"), "{error}");
    }
}
