//! The registry of the results tables: every column is declared here, once.
//!
//! Schemas, data dictionary and documentation derive from it; how rows are gathered and stored is
//! decided in `column` and `table`.

use super::column::Column;
use crate::campaign::Population;
use crate::campaign::Sensitivity;
use crate::campaign::definition::Solver;
use crate::campaign::loop_metric::loop_metrics;
use crate::campaign::metric::metrics;
use crate::campaign::nested::Statement;
use crate::campaign::outline::{Outline, StoredPoles};
use crate::campaign::record::{Branch, Certificate, Failure, FailureKind, Pole};
use crate::campaign::row::{CaseRow, CurveRow, LoopRow, MarginRow, ModeRow, PeakRow};
use crate::campaign::sample::Intervals;
use crate::campaign::summary::{LEVELS, Spread, SummaryRow, WorstRow};
use crate::dynamics::Part;
use crate::margins::envelope::{self, EnvelopeRow};
use crate::margins::{AXES, AxisMargins, Margin, Peak, Stabilised};
use arrow::datatypes::Field;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Version of the tables' columns and metadata; a change of either raises it.
pub const VERSION: u32 = 2;

/// Most cases in a block.
const MOST_BLOCK_CASES: u64 = 4096;
/// Cells of a block are kept near this number: so many are in memory while a table is written.
const BLOCK_CELLS: u64 = 1 << 19;
/// Blocks of a row group: many, since the footer that tells of row groups is held in memory, and is
/// what grows with the cases. Their pages are not, see `scratch`.
const GROUP_BLOCKS: u64 = 64;
/// Poles of an evaluation reckoned with where all are stored.
const ALL_POLES: usize = 128;

/// Resonances reckoned with in a loop.
const RESONANCES: usize = 16;

/// A results table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum TableName {
    /// One row per case: draws, scalar metrics, status.
    Cases,
    /// One row per stored pole of every evaluation.
    Modes,
    /// One row per population, variant, flight time and named mode.
    Summary,
    /// The worst cases with their draws.
    Worst,
    /// The data dictionary.
    Columns,
    /// One row per assessed evaluation and axis; this and the tables below only where a run asks for
    /// margins.
    Margins,
    /// One row per assessed evaluation, axis and resonance.
    LoopModes,
    /// One row per assessed evaluation, axis and frequency of the envelopes.
    LoopCurves,
    /// One row per population, assessed variant, flight time, axis and frequency.
    Envelopes,
}

impl TableName {
    /// Every table, in the order of writing.
    pub const ALL: [Self; 9] = [
        Self::Cases,
        Self::Modes,
        Self::Summary,
        Self::Worst,
        Self::Columns,
        Self::Margins,
        Self::LoopModes,
        Self::LoopCurves,
        Self::Envelopes,
    ];

    /// The tables of a run.
    pub fn of_run(outline: &Outline) -> Vec<Self> {
        let margins = outline.definition.margins.as_ref();
        let held = |table: &Self| match table {
            Self::Margins | Self::LoopModes => margins.is_some(),
            Self::LoopCurves | Self::Envelopes => {
                margins.is_some_and(|plan| !plan.envelope_hz.is_empty())
            }
            _ => true,
        };
        Self::ALL.into_iter().filter(held).collect()
    }

    /// The tables of a run that follow its cases, case by case; the others are made from them.
    pub fn of_cases(outline: &Outline) -> Vec<Self> {
        let held = |table: &Self| {
            !matches!(table, Self::Summary | Self::Worst | Self::Columns | Self::Envelopes)
        };
        Self::of_run(outline).into_iter().filter(held).collect()
    }

    /// The word in file names.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cases => "cases",
            Self::Modes => "modes",
            Self::Summary => "summary",
            Self::Worst => "worst",
            Self::Columns => "columns",
            Self::Margins => "margins",
            Self::LoopModes => "loop_modes",
            Self::LoopCurves => "loop_curves",
            Self::Envelopes => "envelopes",
        }
    }

    /// File of the table inside the run's folder.
    pub fn file(self) -> String {
        format!("tables/{}.parquet", self.name())
    }

    /// The fields of the table's schema.
    pub fn fields(self, outline: &Outline) -> Vec<Field> {
        fn fields<R>(columns: &[Column<R>]) -> Vec<Field> {
            columns.iter().map(Column::field).collect()
        }
        match self {
            Self::Cases => fields(&cases(outline)),
            Self::Modes => fields(&modes(outline)),
            Self::Summary => fields(&summary(outline)),
            Self::Worst => fields(&worst(outline)),
            Self::Columns => fields(&columns()),
            Self::Margins => fields(&margins(outline)),
            Self::LoopModes => fields(&loop_modes(outline)),
            Self::LoopCurves => fields(&loop_curves(outline)),
            Self::Envelopes => fields(&envelopes(outline)),
        }
    }

    /// Cases in a full row group, where the table follows the cases: so many blocks. Fixed by the
    /// outline, and a power of two, so that boundaries of all tables coincide.
    pub fn group_cases(self, outline: &Outline) -> u64 {
        GROUP_BLOCKS * self.block_cases(outline)
    }

    /// Cases in a full block, of which all pages of a row group are made in turn, where the table
    /// follows the cases; a power of two. Fixed by the outline.
    pub fn block_cases(self, outline: &Outline) -> u64 {
        let definition = &outline.definition;
        let times = definition.flight_times_s.len();
        let plan = definition.margins.as_ref();
        let loops = plan.map_or(0, |plan| plan.variants.len()) * AXES.len() * times;
        let rows = match self {
            Self::Modes => {
                let poles = match outline.poles {
                    StoredPoles::Named => definition.modes.len(),
                    StoredPoles::All => ALL_POLES,
                };
                definition.variants.len() * times * poles
            }
            Self::Margins => loops,
            Self::LoopModes => loops * RESONANCES,
            Self::LoopCurves => loops * plan.map_or(0, |plan| plan.envelope_hz.len()),
            _ => 1,
        };
        let cells = (rows * self.fields(outline).len()).max(1) as u64;
        1 << (BLOCK_CELLS / cells).clamp(1, MOST_BLOCK_CASES).ilog2()
    }
}

/// Whether NULL in a row that did not fail says that the quantity does not arise, which is good:
/// the time to double of a stable pole.
pub fn null_is_good(column: &str) -> bool {
    column.starts_with("time_to_double")
}

/// Words of the `status` columns: `ok`, then the failures.
pub fn statuses() -> impl Iterator<Item = &'static str> {
    std::iter::once("ok").chain(FailureKind::ALL.map(FailureKind::name))
}

/// Words of the `branch` column.
pub const BRANCHES: [Branch; 3] = [Branch::Primary, Branch::Partner, Branch::Other];

fn status(failure: Option<&Failure>) -> usize {
    let kind = |failure: &Failure| FailureKind::ALL.iter().position(|kind| *kind == failure.kind);
    failure.map_or(0, |failure| 1 + kind(failure).expect("ALL holds every kind"))
}

fn population<R>(outline: &Outline, get: impl Fn(&R) -> usize + Send + 'static) -> Column<R> {
    let names = outline.definition.populations.iter().map(|p| p.name.clone());
    Column::word("population", "Set of cases the row belongs to", names, move |r| Some(get(r)))
}

fn variant<R>(outline: &Outline, get: impl Fn(&R) -> usize + Send + 'static) -> Column<R> {
    let names = outline.definition.variants.iter().map(|v| v.name.clone());
    Column::word("variant", "Way of evaluating the draws", names, move |r| Some(get(r)))
}

fn mode<R>(
    outline: &Outline,
    description: &str,
    get: impl Fn(&R) -> Option<usize> + Send + 'static,
) -> Column<R> {
    Column::word("mode", description, outline.definition.modes.clone(), get)
}

/// Columns of a table of draws alone: which case, drawn values, normal scores.
pub fn plan(outline: &Outline) -> Vec<Column<CaseRow>> {
    identity(outline).into_iter().chain(structure(outline)).chain(draws(outline)).collect()
}

/// Which outer draw or replicate a case belongs to, where a plan has them.
fn structure(outline: &Outline) -> Vec<Column<CaseRow>> {
    type Of = fn(&Population, u64) -> Option<u64>;
    let columns: [(&str, &str, Of); 2] = [
        ("outer", "Outer draw of a nested plan; NULL for other populations", Population::outer),
        ("replicate", "Replicate of the plan; NULL for other populations", Population::replicate),
    ];
    let there = |of: Of| outline.definition.populations.iter().any(|p| of(p, 0).is_some());
    let columns = columns.into_iter().filter(|(_, _, of)| there(*of));
    columns
        .map(|(name, description, of)| {
            let populations = outline.definition.populations.clone();
            Column::count(name, description, move |r: &CaseRow| {
                Some(of(populations.get(r.population)?, r.case)? as i64)
            })
        })
        .collect()
}

fn identity(outline: &Outline) -> [Column<CaseRow>; 2] {
    [
        population(outline, |r: &CaseRow| r.population),
        Column::count("case", "Case index inside the population", |r: &CaseRow| {
            Some(r.case as i64)
        }),
    ]
}

/// Columns of the `cases` table.
pub fn cases(outline: &Outline) -> Vec<Column<CaseRow>> {
    let mut columns = Vec::from(identity(outline));
    columns.extend(structure(outline));
    columns.extend([
        Column::word(
            "status",
            "ok, or the kind of the first failure",
            statuses(),
            |r: &CaseRow| Some(status(r.failure.as_ref())),
        ),
        Column::text("failure_message", "What the first failure says", |r: &CaseRow| {
            r.failure.as_ref().map(|f| f.message.as_str())
        }),
    ]);
    for (index, metric) in loop_metrics(&outline.definition).into_iter().enumerate() {
        let description = format!("{}; NULL if an evaluation failed", metric.description);
        columns.push(Column::number(metric.name, metric.unit, description, move |r: &CaseRow| {
            r.loops.get(index).copied().flatten()
        }));
    }
    for metric in metrics(&outline.definition) {
        let (name, unit, description) = (metric.name.clone(), metric.unit, &metric.description);
        let description = format!("{description}; NULL if an evaluation failed");
        columns.push(if metric.counts() {
            Column::count(name, description, move |r: &CaseRow| {
                metric.value(&r.reduced).map(|value| value as i64)
            })
        } else {
            Column::number(name, unit, description, move |r: &CaseRow| metric.value(&r.reduced))
        });
    }
    columns.extend(draws(outline));
    columns
}

/// Drawn value and normal score of every draw key.
fn draws(outline: &Outline) -> Vec<Column<CaseRow>> {
    let mut columns = Vec::new();
    for (index, draw) in outline.draws.iter().enumerate() {
        let description = format!("{}; key {}; NULL if nominal", draw.description, draw.key);
        let value = move |r: &CaseRow| r.values.get(index).copied().flatten();
        columns.push(Column::number(&draw.column, &draw.unit, description, value));
    }
    for (index, draw) in outline.draws.iter().enumerate() {
        let description =
            format!("Normal score of {}; NULL if nominal or beyond its law", draw.column);
        let score = move |r: &CaseRow| r.scores.get(index).copied().flatten();
        columns.push(Column::number(draw.score_column(), "sigma", description, score));
    }
    columns
}

/// The column of the `modes` table with the participation of a part.
pub fn participation_name(part: Part) -> &'static str {
    match part {
        Part::RigidBody => "participation_rigid_body",
        Part::Structure => "participation_structure",
        Part::Nozzle => "participation_nozzle",
        Part::Slosh => "participation_slosh",
        Part::Servo => "participation_servo",
    }
}

/// Columns of the `modes` table.
pub fn modes(outline: &Outline) -> Vec<Column<ModeRow>> {
    let times = outline.definition.flight_times_s.clone();
    let number = |name: &str, unit: &str, description: &str, get: fn(&Pole) -> Option<f64>| {
        Column::number(name, unit, description, move |r: &ModeRow| {
            r.outcome.as_ref().ok().and_then(get)
        })
    };
    let mut columns = vec![
        population(outline, |r: &ModeRow| r.population),
        Column::count("case", "Case index inside the population", |r: &ModeRow| {
            Some(r.case as i64)
        }),
        variant(outline, |r: &ModeRow| r.variant),
        Column::number("flight_time_s", "s", "Flight time", move |r: &ModeRow| {
            times.get(r.flight_time).copied()
        }),
        mode(outline, "Named mode; NULL for a pole of no named mode", |r: &ModeRow| r.mode),
        Column::word(
            "branch",
            "primary: the pole identified as the named mode; partner: the pole it exchanges \
             character with; other: a pole of no named mode; NULL if failed",
            BRANCHES.map(Branch::name),
            |r: &ModeRow| {
                let branch = r.outcome.as_ref().ok()?.branch;
                BRANCHES.iter().position(|other| *other == branch)
            },
        ),
        Column::count(
            "null_poles",
            "Poles at the origin of this model, as many as its equations may have, left out of the poles",
            |r: &ModeRow| Some(r.null_poles as i64),
        ),
        Column::text(
            "label",
            "Modal label the pole carries; for other poles the mode, rigid motion (axial, roll, pitch, \
             yaw), nozzle, tank or servo with more than half of the participation, if any",
            |r: &ModeRow| r.outcome.as_ref().ok()?.label.as_deref(),
        ),
        number("pole_re_rad_s", "rad/s", "Real part of the pole; NULL if failed", |p| {
            Some(p.value.re)
        }),
        number("pole_im_rad_s", "rad/s", "Imaginary part of the pole; NULL if failed", |p| {
            Some(p.value.im)
        }),
        number("frequency_hz", "Hz", "Frequency, |Im s|/2π; NULL if failed", |p| {
            Some(p.frequency_hz())
        }),
        number("damping_ratio", "1", "Damping ratio, −Re s/|s|; NULL if failed", |p| {
            Some(p.damping_ratio())
        }),
        number(
            "time_to_double_s",
            "s",
            "Time to double, ln 2/Re s; NULL if stable or failed",
            Pole::time_to_double_s,
        ),
        number(
            "identity_confidence",
            "1",
            "Modulus of the two-sided overlap with the nominal pole of the same name, not bounded by \
             1; where two poles exchange character the path decides, not this number",
            |p| p.identity_confidence,
        ),
    ];
    for (index, part) in Part::ALL.into_iter().enumerate() {
        columns.push(Column::number(
            participation_name(part),
            "1",
            "Real part of the sum of the participation factors of the states of this part; may leave 0 to 1",
            move |r: &ModeRow| Some(r.outcome.as_ref().ok()?.participation?[index]),
        ));
    }
    columns.extend([
        number("residual", "1", "Relative residual of the eigenpair", |p| p.residual),
        number(
            "pole_error_bound_rad_s",
            "rad/s",
            "Bound of the distance of the pole from an exact one: by discs with rounding estimated, to first order from the \
             residual where the certificate is residual or near; NULL if there is none",
            |p| p.error_bound,
        ),
        Column::word(
            "solver",
            "Solver that gave the poles of the evaluation; NULL if failed",
            Solver::ALL.map(Solver::name),
            |r: &ModeRow| Some(r.solution?.solver as usize),
        ),
        Column::word(
            "certificate",
            "What proves the poles of the evaluation: discs, one pole in each; clusters, discs of which some \
             hold several poles; residual, residuals of the pairs and sums of poles against traces, of a dense solve or, \
             structured with a full jet damping matrix, with discs of the residuals that do not meet; near, such residuals \
             and discs of the poles near the modes of interest alone, where the others are not written",
            Certificate::ALL.map(Certificate::name),
            |r: &ModeRow| Some(r.solution?.certificate as usize),
        ),
        Column::count(
            "determinants",
            "Effort: determinants evaluated for the evaluation; 0 where none was tried",
            |r: &ModeRow| Some(r.solution?.determinants as i64),
        ),
        Column::word("status", "ok, or the kind of failure", statuses(), |r: &ModeRow| {
            Some(status(r.outcome.as_ref().err()))
        }),
        Column::text("failure_message", "What the failure says", |r: &ModeRow| {
            r.outcome.as_ref().err().map(|f| f.message.as_str())
        }),
    ]);
    columns.extend(sensitivity(outline));
    columns
}

/// Words of the `sensitivity` column.
pub const SENSITIVITIES: [&str; 2] = ["ok", "veering"];

/// Columns of derivatives, where the run stores them.
fn sensitivity(outline: &Outline) -> Vec<Column<ModeRow>> {
    if outline.definition.sensitivity.is_none() {
        return Vec::new();
    }
    fn of(row: &ModeRow) -> Option<&Sensitivity> {
        row.outcome.as_ref().ok()?.sensitivity.as_deref()
    }
    let mut columns = vec![
        Column::word(
            "sensitivity",
            "ok, or veering: the derivatives are right but the nearest pole bends what a change of one \
             sigma does by more than a tenth; NULL where none are stored",
            SENSITIVITIES,
            |r: &ModeRow| of(r).map(|s| usize::from(s.is_veering())),
        ),
        Column::number(
            "sensitivity_curvature",
            "1",
            "Second-order change of the pole by the nearest other pole for one sigma of each key, over \
             the first-order change (root sums of squares over the keys)",
            |r: &ModeRow| of(r)?.curvature,
        ),
    ];
    for (index, draw) in outline.draws.iter().enumerate() {
        let description = format!(
            "Change of the damping ratio per sigma of the independent normal score of {}; NULL where \
             its value has no slope",
            draw.key
        );
        columns.push(Column::number(
            draw.damping_column(),
            "1",
            description,
            move |r: &ModeRow| of(r)?.damping_ratio.get(index).copied().flatten(),
        ));
    }
    for (index, draw) in outline.draws.iter().enumerate() {
        let description = format!(
            "Change of the real part of the pole per sigma of the independent normal score of {}",
            draw.key
        );
        columns.push(Column::number(
            draw.real_column(),
            "rad/s",
            description,
            move |r: &ModeRow| of(r)?.real_part_rad_s.get(index).copied().flatten(),
        ));
    }
    columns
}

/// Columns of the `summary` table.
pub fn summary(outline: &Outline) -> Vec<Column<SummaryRow>> {
    let times = outline.definition.flight_times_s.clone();
    let count = |name: &str, description: &str, get: fn(&SummaryRow) -> u64| {
        Column::count(name, description, move |r: &SummaryRow| Some(get(r) as i64))
    };
    let mut columns = vec![
        population(outline, |r: &SummaryRow| r.group.population),
        variant(outline, |r: &SummaryRow| r.group.variant),
        Column::number(
            "flight_time_s",
            "s",
            "Flight time; NULL for the row in which each case is reduced to its worst over the \
             flight times",
            move |r: &SummaryRow| times.get(r.group.flight_time?).copied(),
        ),
        mode(outline, "Named mode", |r: &SummaryRow| Some(r.group.mode)),
        count("cases", "Cases of the population", |r| r.cases),
        count("failures", "Cases without a result", |r| r.failures),
        count("unstable", "Cases with an unstable pole", |r| r.unstable),
        Column::number(
            "share_unstable",
            "1",
            "Share of the cases that are unstable or failed",
            |r: &SummaryRow| r.share_unstable,
        ),
        Column::number(
            "share_unstable_low",
            "1",
            "Lower end of its 95 % interval (Clopper and Pearson; over replicates where `intervals` \
             says so); NULL where no interval follows from the cases",
            |r: &SummaryRow| r.share_unstable_interval.map(|[low, _]| low),
        ),
        Column::number(
            "share_unstable_high",
            "1",
            "Upper end of that interval",
            |r: &SummaryRow| r.share_unstable_interval.map(|[_, high]| high),
        ),
        Column::word(
            "intervals",
            "independent_cases: exact binomial, Student's t and order statistics of independent \
             draws; replicates: Student's t over independent replicates or outer draws; none",
            Intervals::ALL.map(Intervals::name),
            |r: &SummaryRow| Intervals::ALL.iter().position(|i| *i == r.intervals),
        ),
    ];
    if outline.definition.populations.iter().any(|p| p.outer(0).is_some()) {
        columns.extend(nested());
    }
    type Pick = Box<dyn Fn(&Spread) -> Option<f64> + Send>;
    let mut spread: Vec<(String, String, Pick)> = Vec::new();
    let location: Vec<(&str, String, Pick)> = vec![
        ("mean", "Mean".to_owned(), Box::new(|s| Some(s.mean))),
        (
            "mean_low",
            "Lower end of the 95 % interval of the mean".to_owned(),
            Box::new(|s| s.mean_interval.map(|[low, _]| low)),
        ),
        (
            "mean_high",
            "Upper end of the 95 % interval of the mean".to_owned(),
            Box::new(|s| s.mean_interval.map(|[_, high]| high)),
        ),
        ("sd", "Sample standard deviation".to_owned(), Box::new(|s| s.standard_deviation)),
        ("min", "Least value".to_owned(), Box::new(|s| Some(s.smallest))),
    ];
    spread.extend(location.into_iter().map(|(name, text, pick)| (name.to_owned(), text, pick)));
    for (index, (level, name)) in LEVELS.into_iter().enumerate() {
        let description = format!("Quantile at {level} (linear between order statistics)");
        spread.push((name.to_owned(), description, Box::new(move |s| Some(s.quantiles[index]))));
        for (end, words, side) in [("low", "Lower", 0), ("high", "Upper", 1)] {
            let description = format!(
                "{words} end of the 95 % interval of the quantile at {level}, failed cases taken for \
                 the worst on that side; NULL where the cases are too few or give none; value"
            );
            let pick: Pick = Box::new(move |s| s.quantile_intervals[index].map(|ends| ends[side]));
            spread.push((format!("{name}_{end}"), description, pick));
        }
    }
    spread.push(("max".to_owned(), "Greatest value".to_owned(), Box::new(|s| Some(s.largest))));
    columns.extend(spread.into_iter().map(|(name, description, pick)| {
        Column::number(
            format!("damping_ratio_{name}"),
            "1",
            format!("{description} of the damping ratio of the less stable pole"),
            move |r: &SummaryRow| r.damping_ratio.as_ref().and_then(&pick),
        )
    }));
    columns.extend([
        Column::number(
            "frequency_mean_hz",
            "Hz",
            "Mean frequency of the less stable pole",
            |r: &SummaryRow| r.frequency_hz_mean,
        ),
        Column::number(
            "time_to_double_min_s",
            "s",
            "Shortest time to double; NULL if no case is unstable",
            |r: &SummaryRow| r.time_to_double_min_s,
        ),
        Column::number(
            "damping_ratio_gain_min",
            "1",
            "Least gain of damping ratio over the first variant on the same draws and flight \
             time; NULL for that variant",
            |r: &SummaryRow| r.damping_ratio_gain.map(|[least, _]| least),
        ),
        Column::number(
            "damping_ratio_gain_mean",
            "1",
            "Mean of that gain (of each case's least over the flight times, where reduced)",
            |r: &SummaryRow| r.damping_ratio_gain.map(|[_, mean]| mean),
        ),
        Column::number(
            "damping_ratio_gain_mean_low",
            "1",
            "Lower end of the 95 % interval of the mean gain (paired differences)",
            |r: &SummaryRow| r.gain_mean_interval.map(|[low, _]| low),
        ),
        Column::number(
            "damping_ratio_gain_mean_high",
            "1",
            "Upper end of that interval",
            |r: &SummaryRow| r.gain_mean_interval.map(|[_, high]| high),
        ),
    ]);
    columns
}

/// Columns of the `summary` table that only a nested plan has.
fn nested() -> Vec<Column<SummaryRow>> {
    let count = |name: &str, description: &str, get: fn(&SummaryRow) -> Option<u64>| {
        Column::count(name, description, move |r: &SummaryRow| get(r).map(|n| n as i64))
    };
    let number = |name: &str, description: &str, get: fn(&SummaryRow) -> Option<f64>| {
        Column::number(name, "1", description, get)
    };
    vec![
        count("outer", "Outer draw; NULL for all cases of the population", |r| r.group.outer),
        Column::word(
            "statement",
            "Whether the outer draw meets the plan's statement; NULL for all cases",
            Statement::ALL.map(Statement::name),
            |r: &SummaryRow| Statement::ALL.iter().position(|s| Some(*s) == r.statement),
        ),
        count("outer_met", "Outer draws that meet it", |r| r.outer.map(|o| o.met)),
        count("outer_not_met", "Outer draws that do not", |r| r.outer.map(|o| o.not_met)),
        number("outer_share_met", "Share of the outer draws that meet it", |r| {
            r.outer.map(|o| o.share_met)
        }),
        number("outer_share_met_low", "Lower end of its exact 95 % interval", |r| {
            r.outer.map(|o| o.share_met_interval[0])
        }),
        number("outer_share_met_high", "Upper end of that interval", |r| {
            r.outer.map(|o| o.share_met_interval[1])
        }),
    ]
}

/// Columns of the `worst` table.
pub fn worst(outline: &Outline) -> Vec<Column<WorstRow>> {
    let keys = outline.draws.iter().map(|draw| draw.key.clone());
    let draws: Arc<[_]> = outline.draws.clone().into();
    let of_draw = move |r: &WorstRow| draws.get(r.draw?).cloned().zip(r.value);
    let (fraction, outside) = (of_draw.clone(), of_draw);
    vec![
        population(outline, |r: &WorstRow| r.population),
        variant(outline, |r: &WorstRow| r.variant),
        mode(outline, "Named mode", |r: &WorstRow| Some(r.mode)),
        Column::count("rank", "1 for the case of smallest damping ratio", |r: &WorstRow| {
            Some(r.rank as i64)
        }),
        Column::count("case", "Case index inside the population", |r: &WorstRow| {
            Some(r.case as i64)
        }),
        Column::number(
            "flight_time_s",
            "s",
            "Flight time of the smallest damping ratio",
            |r: &WorstRow| r.flight_time_s,
        ),
        Column::number(
            "damping_ratio",
            "1",
            "Smallest damping ratio over the flight times",
            |r: &WorstRow| Some(r.damping_ratio),
        ),
        Column::number(
            "time_to_double_s",
            "s",
            "Shortest time to double over the flight times; NULL if stable",
            |r: &WorstRow| r.time_to_double_s,
        ),
        Column::word("draw", "Draw key, the farthest from nominal first", keys, |r: &WorstRow| {
            r.draw
        }),
        Column::number(
            "value",
            "",
            "Drawn value, in the unit of its column; NULL if nominal",
            |r: &WorstRow| r.value,
        ),
        Column::number(
            "score_sigma",
            "sigma",
            "Normal score of the value; NULL if nominal or beyond its law",
            |r: &WorstRow| r.score,
        ),
        Column::number(
            "fraction_of_range",
            "1",
            "Position in the range of a bounded law, 0 at its low and 1 at its high end",
            move |r: &WorstRow| fraction(r).and_then(|(draw, value)| draw.fraction_of_range(value)),
        ),
        Column::flag(
            "outside_law",
            "Whether it is an adverse value that the law cannot give",
            move |r: &WorstRow| outside(r).map(|(draw, value)| draw.outside_law(value)),
        ),
    ]
}

/// The columns with which every table of loops begins.
fn loop_identity<T: 'static>(outline: &Outline) -> Vec<Column<LoopRow<T>>> {
    let times = outline.definition.flight_times_s.clone();
    vec![
        population(outline, |r: &LoopRow<T>| r.population),
        Column::count("case", "Case index inside the population", |r: &LoopRow<T>| {
            Some(r.case as i64)
        }),
        variant(outline, |r: &LoopRow<T>| r.variant),
        Column::number("flight_time_s", "s", "Flight time", move |r: &LoopRow<T>| {
            times.get(r.flight_time).copied()
        }),
        axis(|r: &LoopRow<T>| r.axis),
    ]
}

fn axis<R>(get: impl Fn(&R) -> usize + Send + 'static) -> Column<R> {
    let description = "Axis at whose command the loop is broken, the others closed";
    Column::word("axis", description, AXES, move |r| Some(get(r)))
}

/// Columns of the `margins` table.
pub fn margins(outline: &Outline) -> Vec<Column<MarginRow>> {
    type Pick = fn(&AxisMargins) -> Margin;
    let picks: [(&str, &str, &str, &str, Pick); 6] = [
        (
            "gain_margin_low",
            "_db",
            "dB",
            "Low gain margin: loss of gain to instability, at most 40",
            |m| m.gain_low_db,
        ),
        (
            "gain_margin_high",
            "_db",
            "dB",
            "High gain margin: gain to instability, at most 40",
            |m| m.gain_high_db,
        ),
        ("phase_margin", "_deg", "deg", "Phase margin in either direction, at most 180", |m| {
            m.phase_deg
        }),
        (
            "delay_margin",
            "_s",
            "s",
            "Delay margin: additional delay to instability, at most 10",
            |m| m.delay_s,
        ),
        ("disk_margin", "", "1", "Disk margin α = 2/max|S − T| (skew 0), at most 2", |m| m.disk),
        (
            "ellipse_distance",
            "",
            "1",
            "Distance from the Nichols ellipse of the run's gain and phase margin, 1 touches it, at \
             most 10",
            |m| m.ellipse,
        ),
    ];
    let mut columns = loop_identity(outline);
    columns.push(Column::count(
        "unstable_poles",
        "Closed-loop poles in the right half plane by Nyquist's count; all margins are 0 where \
         there are any; NULL if failed",
        |r: &MarginRow| r.fact.as_ref().ok().map(|(_, unstable)| *unstable),
    ));
    for (stem, suffix, unit, description, pick) in picks {
        columns.push(Column::number(
            format!("{stem}{suffix}"),
            unit,
            format!("{description}; NULL if failed"),
            move |r: &MarginRow| r.fact.as_ref().ok().map(|(axis, _)| pick(axis).value),
        ));
        columns.push(Column::number(
            format!("{stem}_frequency_hz"),
            "Hz",
            "Frequency where it is tightest, 0 for the limit of low frequency; NULL if nothing crosses",
            move |r: &MarginRow| {
                let (axis, _) = r.fact.as_ref().ok()?;
                pick(axis).omega_rad_s.map(|omega| omega / TAU)
            },
        ));
    }
    columns.extend([
        Column::word("status", "ok, or the kind of failure", statuses(), |r: &MarginRow| {
            Some(status(r.fact.as_ref().err()))
        }),
        Column::text("failure_message", "What the failure says", |r: &MarginRow| {
            r.fact.as_ref().err().map(|f| f.message.as_str())
        }),
    ]);
    columns
}

/// Words of the `stabilised` column.
const STABILISED: [Stabilised; 3] = [Stabilised::Gain, Stabilised::Phase, Stabilised::Neither];

/// Columns of the `loop_modes` table.
pub fn loop_modes(outline: &Outline) -> Vec<Column<PeakRow>> {
    let number = |name: &str, unit: &str, description: &str, get: fn(&Peak) -> f64| {
        Column::number(name, unit, description, move |r: &PeakRow| {
            r.fact.as_ref().map(|named| get(&named.peak))
        })
    };
    let mut columns = loop_identity(outline);
    columns.extend([
        Column::text(
            "motion",
            "Modal label, rigid motion (axial, roll, pitch, yaw), nozzle, tank or servo with the largest \
             participation in the pole; NULL, as all that follows, for an axis without a resonance \
             above -60 dB or a failed evaluation",
            |r: &PeakRow| r.fact.as_ref().map(|named| named.motion.as_str()),
        ),
        number("pole_re_rad_s", "rad/s", "Real part of the pole, loops open", |p| p.pole.re),
        number("pole_im_rad_s", "rad/s", "Imaginary part of the pole, loops open", |p| p.pole.im),
        number("peak_db", "dB", "Largest magnitude of the loop near the resonance", |p| p.peak_db),
        number("peak_frequency_hz", "Hz", "Its frequency", |p| p.omega_rad_s / TAU),
        number("from_critical_deg", "deg", "Angle of the loop from -180 degrees there", |p| {
            p.from_critical_deg
        }),
        Column::word(
            "stabilised",
            "gain: the peak is below minus the gain margin; phase: the closed loop is stable, and about the \
             peak the loop is at least the phase margin away from -180 degrees wherever it is within the \
             gain margin of 0 dB; neither",
            STABILISED.map(Stabilised::name),
            |r: &PeakRow| {
                let how = r.fact.as_ref()?.peak.stabilised;
                STABILISED.iter().position(|other| *other == how)
            },
        ),
    ]);
    columns
}

/// Columns of the `loop_curves` table.
pub fn loop_curves(outline: &Outline) -> Vec<Column<CurveRow>> {
    let plan = outline.definition.margins.iter();
    let grid: Vec<f64> = plan.flat_map(|plan| plan.envelope_hz.clone()).collect();
    let mut columns = loop_identity(outline);
    columns.extend([
        Column::number("frequency_hz", "Hz", "Frequency; NULL if failed", move |r: &CurveRow| {
            r.fact.and_then(|(index, _)| grid.get(index).copied())
        }),
        Column::number(
            "magnitude_db",
            "dB",
            "Magnitude; NULL for a loop of nothing",
            |r: &CurveRow| r.fact.map(|(_, point)| point.magnitude_db),
        ),
        Column::number(
            "phase_deg",
            "deg",
            "Phase, unwrapped from low frequency",
            |r: &CurveRow| r.fact.map(|(_, point)| point.phase_deg),
        ),
    ]);
    columns
}

/// Columns of the `envelopes` table.
pub fn envelopes(outline: &Outline) -> Vec<Column<EnvelopeRow>> {
    let times = outline.definition.flight_times_s.clone();
    let mut columns = vec![
        population(outline, |r: &EnvelopeRow| r.population),
        variant(outline, |r: &EnvelopeRow| r.variant),
        Column::number("flight_time_s", "s", "Flight time", move |r: &EnvelopeRow| {
            times.get(r.flight_time).copied()
        }),
        axis(|r: &EnvelopeRow| r.axis),
        Column::number("frequency_hz", "Hz", "Frequency", |r: &EnvelopeRow| Some(r.frequency_hz)),
        Column::count("cases", "Cases with a curve", |r: &EnvelopeRow| Some(r.cases as i64)),
    ];
    type Quantity = fn(&EnvelopeRow) -> Option<&envelope::Spread>;
    let quantities: [(&str, &str, &str, &str, Quantity); 2] = [
        ("magnitude", "_db", "dB", "magnitude", |r| r.magnitude_db.as_ref()),
        ("phase", "_deg", "deg", "phase, brought within half a turn of the nominal case's", |r| {
            r.phase_deg.as_ref()
        }),
    ];
    for (stem, suffix, unit, what, of) in quantities {
        let mut push = |name: &str,
                        description: String,
                        pick: Box<dyn Fn(&envelope::Spread) -> f64 + Send>| {
            columns.push(Column::number(
                format!("{stem}_{name}{suffix}"),
                unit,
                description,
                move |r| of(r).map(&pick),
            ));
        };
        push("min", format!("Least {what}"), Box::new(|s| s.smallest));
        for (index, level) in envelope::LEVELS.into_iter().enumerate() {
            let description =
                format!("Quantile at {level} of the {what} (linear between order statistics)");
            push(
                &format!("p{:02.0}", 100.0 * level),
                description,
                Box::new(move |s| s.quantiles[index]),
            );
        }
        push("max", format!("Greatest {what}"), Box::new(|s| s.largest));
    }
    columns
}

/// One row of the data dictionary.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Described {
    /// Table.
    pub table: TableName,
    /// Column.
    pub column: String,
    /// Type.
    pub type_name: &'static str,
    /// Unit.
    pub unit: String,
    /// Description.
    pub description: String,
}

/// Columns of the data dictionary.
pub fn columns() -> Vec<Column<Described>> {
    vec![
        Column::word("table", "Table", TableName::ALL.map(TableName::name), |r: &Described| {
            TableName::ALL.iter().position(|table| *table == r.table)
        }),
        Column::text("column", "Column", |r: &Described| Some(&r.column)),
        Column::text("type", "Type", |r: &Described| Some(r.type_name)),
        Column::text("unit", "Unit; 1 for a pure number, NULL for text", |r: &Described| {
            (!r.unit.is_empty()).then_some(r.unit.as_str())
        }),
        Column::text("description", "Description", |r: &Described| Some(&r.description)),
    ]
}

/// The data dictionary: every column of every table.
pub fn dictionary(outline: &Outline) -> Vec<Described> {
    fn describe<R>(table: TableName, columns: &[Column<R>]) -> Vec<Described> {
        let describe = |column: &Column<R>| Described {
            table,
            column: column.name.clone(),
            type_name: column.type_name(),
            unit: column.unit.clone(),
            description: column.description.clone(),
        };
        columns.iter().map(describe).collect()
    }
    let mut all = describe(TableName::Cases, &cases(outline));
    all.extend(describe(TableName::Modes, &modes(outline)));
    all.extend(describe(TableName::Summary, &summary(outline)));
    all.extend(describe(TableName::Worst, &worst(outline)));
    all.extend(describe(TableName::Columns, &columns()));
    let tables = TableName::of_run(outline);
    if tables.contains(&TableName::Margins) {
        all.extend(describe(TableName::Margins, &margins(outline)));
        all.extend(describe(TableName::LoopModes, &loop_modes(outline)));
    }
    if tables.contains(&TableName::LoopCurves) {
        all.extend(describe(TableName::LoopCurves, &loop_curves(outline)));
        all.extend(describe(TableName::Envelopes, &envelopes(outline)));
    }
    all
}
