//! The registry of scalar loop metrics: each reduces a case to one number per assessed variant and axis.
//!
//! A metric is one line of `LINES`; its column, unit and description derive from it. What the
//! margins are is decided in `margins`.

use super::definition::Definition;
use super::loops::Loops;
use super::metric::{LONGEST_NAME, word};
use super::record::Record;
use crate::margins::{AXES, AxisMargins, Stabilised};

/// One line of the registry.
struct Line {
    stem: &'static str,
    suffix: &'static str,
    unit: &'static str,
    description: &'static str,
    value: fn(&[&Loops], usize) -> f64,
}

fn least(loops: &[&Loops], axis: usize, of: fn(&AxisMargins) -> f64) -> f64 {
    loops.iter().map(|loops| of(&loops.axes[axis])).fold(f64::INFINITY, f64::min)
}

const LINES: [Line; 8] = [
    Line {
        stem: "gain_margin_low_min",
        suffix: "_db",
        unit: "dB",
        description: "Smallest low gain margin over the flight times: loss of gain to instability",
        value: |loops, axis| least(loops, axis, |m| m.gain_low_db.value),
    },
    Line {
        stem: "gain_margin_high_min",
        suffix: "_db",
        unit: "dB",
        description: "Smallest high gain margin over the flight times: gain to instability",
        value: |loops, axis| least(loops, axis, |m| m.gain_high_db.value),
    },
    Line {
        stem: "phase_margin_min",
        suffix: "_deg",
        unit: "deg",
        description: "Smallest phase margin over the flight times",
        value: |loops, axis| least(loops, axis, |m| m.phase_deg.value),
    },
    Line {
        stem: "delay_margin_min",
        suffix: "_s",
        unit: "s",
        description: "Smallest delay margin over the flight times",
        value: |loops, axis| least(loops, axis, |m| m.delay_s.value),
    },
    Line {
        stem: "disk_margin_min",
        suffix: "",
        unit: "1",
        description: "Smallest disk margin (S − T, skew 0) over the flight times",
        value: |loops, axis| least(loops, axis, |m| m.disk.value),
    },
    Line {
        stem: "ellipse_distance_min",
        suffix: "",
        unit: "1",
        description: "Smallest distance from the Nichols ellipse over the flight times, 1 touches it",
        value: |loops, axis| least(loops, axis, |m| m.ellipse.value),
    },
    Line {
        stem: "modes_not_stabilised",
        suffix: "",
        unit: "1",
        description: "Largest number, over the flight times, of resonances neither gain- nor \
                      phase-stabilised",
        value: |loops, axis| {
            let count = |loops: &&Loops| {
                let of_axis = loops.peaks.iter().filter(|named| named.peak.axis == axis);
                of_axis.filter(|named| named.peak.stabilised == Stabilised::Neither).count()
            };
            loops.iter().map(count).max().unwrap_or_default() as f64
        },
    },
    Line {
        stem: "loops_unstable_times",
        suffix: "",
        unit: "1",
        description: "Number of flight times at which the loops, all closed, are unstable",
        value: |loops, _| loops.iter().filter(|loops| loops.unstable != 0).count() as f64,
    },
];

/// A metric of one variant and axis.
#[derive(Debug, Clone)]
pub struct LoopMetric {
    /// Index of the variant.
    pub variant: usize,
    /// Index of the axis.
    pub axis: usize,
    /// Column name in the `cases` table.
    pub name: String,
    /// Unit.
    pub unit: &'static str,
    /// Description.
    pub description: String,
    value: fn(&[&Loops], usize) -> f64,
}

/// Every loop metric of a run, by variant, axis and line of the registry.
pub fn loop_metrics(definition: &Definition) -> Vec<LoopMetric> {
    let plan = definition.margins.iter();
    let mut metrics = Vec::new();
    for (variant, axis) in
        plan.flat_map(|plan| &plan.variants).flat_map(|&v| (0..AXES.len()).map(move |a| (v, a)))
    {
        let named = &definition.variants[variant].name;
        for line in &LINES {
            let full = format!("{}_{}_{}{}", line.stem, word(named), AXES[axis], line.suffix);
            let name = if full.len() <= LONGEST_NAME {
                full
            } else {
                format!("{}_variant_{variant}_{}{}", line.stem, AXES[axis], line.suffix)
            };
            let description = format!(
                "{}; variant {named}, {} loop broken, others closed",
                line.description, AXES[axis]
            );
            let Line { unit, value, .. } = *line;
            metrics.push(LoopMetric { variant, axis, name, unit, description, value });
        }
    }
    metrics
}

/// The values of every loop metric of a case, in the order of [`loop_metrics`]; none where an evaluation
/// of the variant failed.
pub fn values(definition: &Definition, record: &Record) -> Vec<Option<f64>> {
    let value = |metric: LoopMetric| {
        let of_variant = record.evaluations.iter().filter(|e| e.variant == metric.variant);
        let loops: Vec<&Loops> =
            of_variant.map(|e| e.loops.as_ref()?.as_ref().ok()).collect::<Option<_>>()?;
        (loops.len() == definition.flight_times_s.len())
            .then(|| (metric.value)(&loops, metric.axis))
    };
    loop_metrics(definition).into_iter().map(value).collect()
}
