//! Statistics, paired differences and rankings of draws as text tables and as CSV.
//!
//! The numbers are those of `campaign::statistics` and `campaign::sensitivity`.

use super::significant;
use crate::campaign::sample::Intervals;
use crate::campaign::sensitivity::{Index, Ranking};
use crate::campaign::statistics::Line;
use comfy_table::{CellAlignment, Table, presets};

/// A table of texts with a heading, to be shown or written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Rows {
    head: Vec<&'static str>,
    rows: Vec<Vec<String>>,
}

impl Rows {
    /// An empty table with this heading.
    pub fn new(head: &[&'static str]) -> Self {
        Self { head: head.to_vec(), rows: Vec::new() }
    }

    /// Adds a row.
    pub fn push(&mut self, row: Vec<String>) {
        self.rows.push(row);
    }

    /// As a text table; numbers with four digits.
    pub fn text(&self) -> String {
        let mut table = Table::new();
        table.load_style(presets::ASCII_MARKDOWN).set_header(&self.head);
        for row in &self.rows {
            table.add_row(row.iter().map(|cell| match cell.parse::<f64>() {
                Ok(_) if cell.parse::<i64>().is_ok() => cell.clone(),
                Ok(number) => significant(number),
                Err(_) if cell.is_empty() => "–".to_owned(),
                Err(_) => cell.clone(),
            }));
        }
        for column in table.column_iter_mut().skip(2) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        format!("{table}\n")
    }

    /// As comma-separated values; an empty cell is no value.
    pub fn csv(&self) -> String {
        let line = |cells: &mut dyn Iterator<Item = &str>| {
            let cells: Vec<String> = cells
                .map(|cell| match cell.contains([',', '"', '\n']) {
                    true => format!("\"{}\"", cell.replace('"', "\"\"")),
                    false => cell.to_owned(),
                })
                .collect();
            cells.join(",") + "\n"
        };
        let mut text = line(&mut self.head.iter().copied());
        for row in &self.rows {
            text += &line(&mut row.iter().map(String::as_str));
        }
        text
    }
}

/// A number as a cell; an empty one where there is none.
pub fn number(value: Option<f64>) -> String {
    value.filter(|value| value.is_finite()).map_or_else(String::new, |value| value.to_string())
}

/// Statistics of metrics, each with its lines.
pub fn lines<'a>(all: impl IntoIterator<Item = (&'a str, &'a [Line])>) -> Rows {
    let mut rows =
        Rows::new(&["metric", "statistic", "cases", "value", "low", "high", "interval by"]);
    for (metric, lines) in all {
        rows.rows.extend(lines.iter().map(|line| {
            vec![
                metric.to_owned(),
                line.statistic.clone(),
                line.cases.to_string(),
                number(line.value),
                number(line.interval.map(|[low, _]| low)),
                number(line.interval.map(|[_, high]| high)),
                line.method.to_owned(),
            ]
        }));
    }
    rows
}

/// Rankings of draws, each of a metric, with the data of a tornado chart.
pub fn rankings<'a>(all: impl IntoIterator<Item = (&'a str, &'a Ranking)>) -> Rows {
    let mut rows = Rows::new(&[
        "metric",
        "rank",
        "key",
        "src",
        "src_low",
        "src_high",
        "prcc",
        "prcc_low",
        "prcc_high",
        "first_order",
        "first_order_low",
        "first_order_high",
        "total",
        "total_low",
        "total_high",
        "change_per_sigma",
        "at_low",
        "at_high",
        "intervals",
    ]);
    for (metric, ranking) in all {
        for (rank, effect) in ranking.effects.iter().enumerate() {
            let mut row = vec![metric.to_owned(), (rank + 1).to_string(), effect.key.clone()];
            for of in [effect.regression, effect.partial_rank, effect.first_order, effect.total] {
                let interval = of.and_then(|of| of.interval);
                row.push(number(of.map(|of| of.value)));
                row.push(number(interval.map(|[low, _]| low)));
                row.push(number(interval.map(|[_, high]| high)));
            }
            let deviation = ranking.standard_deviation;
            row.push(number(effect.regression.and_then(|src| Some(src.value * deviation?))));
            row.push(number(effect.tornado.map(|[low, _]| low)));
            row.push(number(effect.tornado.map(|[_, high]| high)));
            row.push(ranking.intervals.map_or("", Intervals::name).to_owned());
            rows.rows.push(row);
        }
    }
    rows
}

/// The first `most` draws of a ranking for the terminal: indices with their intervals in one cell.
pub fn ranking_text(all: &Ranking, most: usize) -> String {
    let mut rows = Rows::new(&[
        "draw key",
        "rank",
        "SRC",
        "PRCC",
        "first order",
        "total",
        "at low",
        "at high",
    ]);
    let cell = |of: Option<Index>| {
        let text = |of: Index| match of.interval {
            None => significant(of.value),
            Some(interval) => {
                let [low, high] = interval.map(significant);
                format!("{} ({low} – {high})", significant(of.value))
            }
        };
        of.map_or_else(String::new, text)
    };
    for (rank, effect) in all.effects.iter().take(most).enumerate() {
        rows.rows.push(vec![
            effect.key.clone(),
            (rank + 1).to_string(),
            cell(effect.regression),
            cell(effect.partial_rank),
            cell(effect.first_order),
            cell(effect.total),
            number(effect.tornado.map(|[low, _]| low)),
            number(effect.tornado.map(|[_, high]| high)),
        ]);
    }
    let mut text = rows.text();
    if all.intervals == Some(Intervals::Replicates) {
        text += "95 % intervals: Student's t over the indices of the plan's replicates\n";
    }
    if let Some(explained) = all.explained {
        text += &format!("the linear model explains {} of the variance\n", significant(explained));
    }
    if all.left_out > 0 {
        text +=
            &format!("{} cases left out because they failed, or with their row\n", all.left_out);
    }
    for note in &all.notes {
        text += &format!("{note}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(value: f64, interval: Option<[f64; 2]>) -> Line {
        Line { statistic: "mean".into(), cases: 30, value: Some(value), interval, method: "none" }
    }

    #[test]
    fn csv_keeps_every_digit_and_leaves_what_is_unknown_empty() {
        let all = [line(0.1 + 0.2, Some([f64::NEG_INFINITY, 1.0])), line(2.0, None)];
        let rows = lines([("a,b", &all[..])]);
        assert_eq!(
            rows.csv(),
            "metric,statistic,cases,value,low,high,interval by\n\
             \"a,b\",mean,30,0.30000000000000004,,1,none\n\"a,b\",mean,30,2,,,none\n"
        );
        let text = rows.text();
        assert!(text.contains("0.3 ") && text.contains('–') && !text.contains("0.3000"), "{text}");
    }
}
