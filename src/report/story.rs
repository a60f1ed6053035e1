//! The story of a run as a text table: what each variant does to the damping of a named mode.
//!
//! It is the story of the paper's Figure 6 (poles without and with jet damping, nominal and
//! dispersed). Only text is made here; who prints it is decided in `cli`.

use super::significant;
use crate::campaign::summary::{Group, LEVELS, SummaryRow, WorstRow};
use crate::campaign::{Definition, Outline, Population, Sample};
use crate::dispersion::Scheme;
use comfy_table::{CellAlignment, Table, presets};
use std::fmt::Write;

/// Draws named in the line of a worst case.
const DRAWS: usize = 3;

/// The story: a table for every population and named mode, with its worst cases below.
pub fn story(outline: &Outline, summary: &[SummaryRow], worst: &[WorstRow]) -> String {
    let definition = &outline.definition;
    let mut text = String::new();
    for (population, p) in definition.populations.iter().enumerate() {
        // The nominal case has its column in every table.
        if population == 0 && definition.populations.len() > 1 && p.cases == 1 {
            continue;
        }
        for (mode, name) in definition.modes.iter().enumerate() {
            // Around a corner the worst over the flight times says what it is there to say.
            let corner = !p.fixed.is_empty();
            let rows = || {
                let of = move |group: &Group| {
                    (group.population, group.mode) == (population, mode)
                        && group.outer.is_none()
                        && (!corner || group.flight_time.is_none())
                };
                summary.iter().filter(move |row| of(&row.group))
            };
            let failures = rows().filter(|row| row.group.flight_time.is_none());
            let failures = failures.map(|row| row.failures).max().unwrap_or(0);
            let failed = if failures > 0 {
                format!(", {failures} failed, counted as unstable")
            } else {
                String::new()
            };
            let scheme = if p.scheme.is_monte_carlo() {
                String::new()
            } else {
                format!(" ({})", p.scheme.describe())
            };
            line(&mut text, format_args!("{name}, {}: {} cases{scheme}{failed}", p.name, p.cases));
            if corner {
                let beyond =
                    |(draw, value): &&(usize, f64)| outline.draws[*draw].outside_law(*value);
                let beyond = p.fixed.iter().filter(beyond).count();
                line(
                    &mut text,
                    format_args!(
                        "{} draws held at their worst values, {beyond} of them outside their law \
                         (see the table `worst`)",
                        p.fixed.len()
                    ),
                );
            }
            line(&mut text, format_args!("{}", table(outline, summary, rows())));
            line(&mut text, format_args!("{}\n", claims(definition, p, rows())));
            for (variant, v) in definition.variants.iter().enumerate() {
                let of_variant = |row: &&WorstRow| {
                    (row.population, row.mode, row.variant, row.rank)
                        == (population, mode, variant, 1)
                };
                let rows: Vec<&WorstRow> = worst.iter().filter(of_variant).collect();
                if let Some(sentence) = worst_case(outline, &rows) {
                    line(&mut text, format_args!("worst case, {}: {sentence}", v.name));
                }
            }
            text.push('\n');
        }
    }
    text
}

/// How many claims the table makes at once, or why none; and what outer draws show.
fn claims<'a>(
    definition: &Definition,
    population: &Population,
    rows: impl Iterator<Item = &'a SummaryRow> + Clone,
) -> String {
    let intervals = rows.clone().filter(|row| row.share_unstable_interval.is_some()).count();
    let mut text = if intervals > 0 {
        format!(
            "{intervals} intervals of 95 % at once: {} of them miss on average; all hold together with \
             95 % if each is taken at {} % (Bonferroni). Failed cases count as unstable.",
            significant(0.05 * intervals as f64),
            significant(100.0 - 5.0 / intervals as f64)
        )
    } else {
        let without = Sample::of(population).without_intervals(population.cases as usize);
        without.unwrap_or_else(|| "no intervals: no case has a result".into())
    };
    for row in rows.filter(|row| row.group.flight_time.is_none()) {
        let (Some(outer), Scheme::Nested { inner, allowed_share, risk, .. }) =
            (row.outer, &population.scheme)
        else {
            continue;
        };
        let [low, high] = outer.share_met_interval.map(|end| percent(Some(end), 1));
        write!(
            text,
            "\nvariant {}: {} of {} outer draws are shown to have at most {} % of unstable or failed cases \
             (risk {} %), {} not to; {} % meet it, 95 % interval {low} – {high}",
            definition.variants[row.group.variant].name,
            outer.met,
            population.cases / inner,
            significant(100.0 * allowed_share),
            significant(100.0 * risk),
            outer.not_met,
            percent(Some(outer.share_met), 1),
        )
        .expect("a string takes any text");
    }
    text
}

fn line(text: &mut String, arguments: std::fmt::Arguments<'_>) {
    writeln!(text, "{arguments}").expect("a string takes any text");
}

fn table<'a>(
    outline: &Outline,
    summary: &[SummaryRow],
    rows: impl Iterator<Item = &'a SummaryRow>,
) -> Table {
    let definition = &outline.definition;
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header([
        "variant",
        "flight time, s",
        "nominal ζ, %",
        "median ζ, %",
        "least ζ, %",
        "unstable, %",
        "95 % interval",
        "shortest time to double, s",
    ]);
    let mut last = None;
    for row in rows {
        let variant = row.group.variant;
        let name = &definition.variants[variant].name;
        let nominal = summary.iter().find(|r| r.group == Group { population: 0, ..row.group });
        let nominal = nominal.filter(|r| r.cases == 1).and_then(|r| r.damping_ratio.as_ref());
        let median = LEVELS.iter().position(|(level, _)| *level == 0.5).expect("a level");
        let spread = row.damping_ratio.as_ref();
        table.add_row([
            if last == Some(variant) { String::new() } else { name.clone() },
            row.group
                .flight_time
                .map_or_else(|| "worst".to_owned(), |t| definition.flight_times_s[t].to_string()),
            percent(nominal.map(|spread| spread.mean), 3),
            percent(spread.map(|spread| spread.quantiles[median]), 3),
            percent(spread.map(|spread| spread.smallest), 3),
            percent(row.share_unstable, 1),
            row.share_unstable_interval.map_or_else(
                || "–".to_owned(),
                |[low, high]| format!("{} – {}", percent(Some(low), 1), percent(Some(high), 1)),
            ),
            row.time_to_double_min_s.map_or_else(|| "–".to_owned(), |t| format!("{t:.1}")),
        ]);
        last = Some(variant);
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn percent(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "–".to_owned(), |value| format!("{:.digits$}", 100.0 * value))
}

/// The sentence about a worst case from its rows, one for each draw.
fn worst_case(outline: &Outline, rows: &[&WorstRow]) -> Option<String> {
    let case = rows.first()?;
    let mut sentence = format!("case {}", case.case);
    if let Some(time) = case.flight_time_s {
        write!(sentence, " at {time} s").expect("a string takes any text");
    }
    write!(sentence, ", ζ {} %", percent(Some(case.damping_ratio), 3)).expect("a string");
    if let Some(time) = case.time_to_double_s {
        write!(sentence, ", time to double {time:.1} s").expect("a string takes any text");
    }
    let population = &outline.definition.populations[case.population];
    let draws = rows.iter().filter(|_| population.drawn).filter_map(|row| {
        if population.fixed.iter().any(|(fixed, _)| Some(*fixed) == row.draw) {
            return None;
        }
        let draw = &outline.draws[row.draw?];
        let value = row.value?;
        Some(match row.score {
            Some(score) => format!("{} z {score:+.1}", draw.key),
            None if draw.outside_law(value) => {
                format!("{} {value} {} (outside its law)", draw.key, draw.unit)
            }
            None => format!("{} {value} {}", draw.key, draw.unit),
        })
    });
    let draws: Vec<String> = draws.take(DRAWS).collect();
    if !draws.is_empty() {
        write!(sentence, "; largest draws {}", draws.join(", ")).expect("a string takes any text");
    }
    Some(sentence)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::Sample;
    use crate::campaign::summary::{Found, groups, summarise};
    use crate::campaign::{StoredPoles, synthetic};

    fn summary(outline: &Outline) -> Vec<SummaryRow> {
        let mut rows = Vec::new();
        for (population, p) in outline.definition.populations.iter().enumerate() {
            for group in groups(&outline.definition, population) {
                let mut cases = vec![Found::NOTHING; p.cases as usize];
                for (case, found) in cases.iter_mut().enumerate().skip(1) {
                    let damping = 0.001 * case as f64 - 0.0025;
                    found.add(damping, 5.0, -30.0 * damping);
                }
                rows.push(summarise(group, Sample::of(p), &cases).unwrap());
            }
        }
        rows
    }

    #[test]
    fn the_story_has_a_line_for_every_variant_and_time_and_names_failures() {
        let outline = synthetic::outline(&[1, 6], StoredPoles::Named);
        let text = story(&outline, &summary(&outline), &[]);
        assert!(
            text.starts_with("tvse, dispersed: 6 cases, 1 failed, counted as unstable\n"),
            "{text}"
        );
        let values: Vec<Vec<&str>> = text
            .lines()
            .filter(|line| line.starts_with('|') && !line.starts_with("|-"))
            .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
            .collect();
        // Two modes, each with a heading and two variants at two times and their worst.
        assert_eq!(values.len(), 2 * (1 + 2 * 3));
        // Cases 1 to 5 lie at −0.15 to 0.25 %, two of them unstable; log 2/0.045 is 15.4.
        assert_eq!(values[1][0], "no_jet");
        assert_eq!(values[1][3..6], ["0.050", "-0.150", "50.0"]);
        assert_eq!(values[1][7], "15.4");
        assert_eq!(values[3][..2], ["", "worst"]);
        // R: binom.test(3, 6)$conf.int: two unstable cases and one that failed.
        assert_eq!(values[1][6], "11.8 – 88.2");
    }

    #[test]
    fn a_worst_case_is_told_with_its_farthest_draws() {
        let outline = synthetic::outline(&[1, 6], StoredPoles::Named);
        let row = |draw: usize, value: f64, score: Option<f64>| WorstRow {
            population: 1,
            variant: 0,
            mode: 0,
            rank: 1,
            case: 4,
            flight_time_s: Some(110.0),
            damping_ratio: -0.0071,
            time_to_double_s: Some(3.04),
            draw: Some(draw),
            value: Some(value),
            score,
        };
        let worst = [row(1, 0.0025, None), row(0, 1.03, Some(2.96))];
        let text = story(&outline, &summary(&outline), &worst);
        let expected = "worst case, no_jet: case 4 at 110 s, ζ -0.710 %, time to double 3.0 s; largest draws \
                        structure.damping @ mode 0.0025 1 (outside its law), \
                        booster.left.thrust @ engine z +3.0\n";
        assert!(text.contains(expected), "{text}");
    }
}
