//! The tables of a report: summary, worst cases with the commands that rebuild them, failures, provenance.

use super::contents::Contents;
use super::{Section, number, percent};
use crate::campaign::summary::{LEVELS, WorstRow};
use crate::report::chart::escaped;

/// Draws named for a worst case.
const DRAWS: usize = 4;

/// The story of the run in numbers.
pub fn summary(contents: &Contents) -> Section {
    let mut section = Section::new("summary", "Summary");
    let definition = &contents.outline.definition;
    let population = &definition.populations[contents.population];
    section.text = format!(
        "<p>{}{} cases ({}) of the population <em>{}</em>, seed {}. Failed cases count as unstable.</p>",
        contents.vehicle.as_ref().map_or(String::new(), |name| format!("{}. ", escaped(name))),
        population.cases,
        escaped(population.drawing().describe()),
        escaped(&population.name),
        definition.seed
    );
    let median = LEVELS.iter().position(|(level, _)| *level == 0.5).unwrap_or(0);
    for (mode, name) in definition.modes.iter().enumerate() {
        let mut table = format!(
            "<table><caption>Mode {}</caption><thead><tr><th>variant</th><th>flight time, s</th><th>nominal ζ, %</th>\
             <th>median ζ, %</th><th>least ζ, %</th><th>unstable, %</th><th>95 % interval</th>\
             <th>shortest time to double, s</th><th>failed</th></tr></thead><tbody>",
            escaped(name)
        );
        for (variant, v) in definition.variants.iter().enumerate() {
            let times = (0..definition.flight_times_s.len()).map(Some).chain([None]);
            for time in times {
                let Some(row) = contents.row(variant, mode, time) else { continue };
                let spread = row.damping_ratio.as_ref();
                let nominal = contents.nominal(variant, mode, time);
                let nominal = nominal.and_then(|row| row.damping_ratio.as_ref()).map(|s| s.mean);
                let cell = |value: Option<f64>| value.map_or("–".to_owned(), |v| percent(v, 3));
                let (class, when) = match time {
                    Some(time) => ("", definition.flight_times_s[time].to_string()),
                    None => (" class=\"worst\"", "worst".to_owned()),
                };
                let interval =
                    row.share_unstable_interval.map_or("–".to_owned(), |[low, high]| {
                        format!("{} – {}", percent(low, 1), percent(high, 1))
                    });
                table += &format!(
                    "<tr{class}><td>{}</td><td class=\"n\">{when}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
                     <td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{interval}</td><td class=\"n\">{}</td>\
                     <td class=\"n\">{}</td></tr>",
                    escaped(&v.name),
                    cell(nominal),
                    cell(spread.map(|s| s.quantiles[median])),
                    cell(spread.map(|s| s.smallest)),
                    row.share_unstable.map_or("–".to_owned(), |share| percent(share, 1)),
                    row.time_to_double_min_s.map_or("–".to_owned(), |t| format!("{t:.1}")),
                    row.failures
                );
            }
        }
        section.tables += &(table + "</tbody></table>");
    }
    section
}

/// The worst cases, each with the command that rebuilds it.
pub fn worst(contents: &Contents) -> Option<Section> {
    let mut section = Section::new("worst", "Worst cases");
    let definition = &contents.outline.definition;
    let (folder, table) = if contents.beside {
        (
            "to which the case number links",
            "<a href=\"tables/worst.parquet\">tables/worst.parquet</a>",
        )
    } else {
        ("<code>replay/</code> of the run", "tables/worst.parquet")
    };
    section.text = format!(
        "<p>The command of a row rebuilds the case from its seed, compares it with the stored rows bit for bit, and writes matrices, \
         poles and vectors to the folder {folder}. All draws of these cases are in {table} of the run's folder.</p>"
    );
    for (mode, name) in definition.modes.iter().enumerate() {
        for (variant, v) in definition.variants.iter().enumerate() {
            let of = |row: &&WorstRow| {
                (row.population, row.mode, row.variant) == (contents.population, mode, variant)
            };
            let rows: Vec<&WorstRow> = contents.worst.iter().filter(of).collect();
            if rows.is_empty() {
                continue;
            }
            let mut table = format!(
                "<table><caption>{}, {}</caption><thead><tr><th>case</th><th>flight time, s</th><th>ζ, %</th>\
                 <th>time to double, s</th><th>farthest draws (normal score)</th><th>command</th></tr></thead><tbody>",
                escaped(name),
                escaped(&v.name)
            );
            let ranks = rows.iter().map(|row| row.rank).max().unwrap_or(0);
            for rank in 1..=ranks {
                let of_rank: Vec<&&WorstRow> = rows.iter().filter(|row| row.rank == rank).collect();
                if let Some(first) = of_rank.first() {
                    table += &row(contents, first, &of_rank);
                }
            }
            section.tables += &(table + "</tbody></table>");
        }
    }
    section.tables += &searched(contents);
    (!section.tables.is_empty()).then_some(section)
}

/// Cases that `tvse worst` searched for.
fn searched(contents: &Contents) -> String {
    let definition = &contents.outline.definition;
    let mut rows = String::new();
    for (aim, cases) in &contents.searched {
        for case in cases {
            rows += &format!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td>\
                 <td class=\"n\">{:.1}</td><td class=\"n\">{:.1}</td><td><code>{}</code></td></tr>",
                escaped(case.method.name()),
                escaped(&definition.modes[aim.mode]),
                escaped(&definition.variants[aim.variant].name),
                definition.flight_times_s[case.flight_time],
                number(case.objective),
                percent(-case.pole[0] / case.pole[0].hypot(case.pole[1]), 3),
                case.distance(),
                case.farthest(),
                escaped(&format!("tvse replay {} --worst {}", quoted(&contents.folder), case.name)),
            );
        }
    }
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<table><caption>Worst on worst: searched for (<code>tvse worst</code>), no sample of any population</caption><thead><tr>\
         <th>method</th><th>mode</th><th>variant</th><th>flight time, s</th><th>objective</th><th>ζ, %</th>\
         <th>distance, σ</th><th>farthest key, σ</th><th>command</th></tr></thead><tbody>{rows}</tbody></table>"
    )
}

fn row(contents: &Contents, first: &WorstRow, rows: &[&&WorstRow]) -> String {
    let population = &contents.outline.definition.populations[first.population];
    let draws = rows.iter().filter_map(|row| {
        let draw = contents.outline.draws.get(row.draw?)?;
        let value = row.value?;
        Some(match row.score {
            Some(score) => {
                format!("{} {}", draw.key, format!("{score:+.1}").replace('-', "\u{2212}"))
            }
            None => format!("{} {} {}", draw.key, number(value), draw.unit),
        })
    });
    let draws: Vec<String> = draws.take(DRAWS).map(|text| escaped(&text)).collect();
    let number_of = |value: Option<f64>, digits: usize| {
        value.map_or("–".to_owned(), |value| format!("{value:.digits$}"))
    };
    let case = first.case;
    let link = if contents.beside {
        format!("<a href=\"replay/{}-{case}/\">{case}</a>", escaped(&population.name))
    } else {
        case.to_string()
    };
    format!(
        "<tr id=\"case-{case}-{v}-{m}\"><td class=\"n\">{link}</td><td class=\"n\">{}</td>\
         <td class=\"n\">{}</td><td class=\"n\">{}</td><td>{}</td><td><code>{}</code></td></tr>",
        first.flight_time_s.map_or("–".to_owned(), |time| time.to_string()),
        percent(first.damping_ratio, 3),
        number_of(first.time_to_double_s, 1),
        draws.join("<br>"),
        escaped(&replay(contents, &population.name, case)),
        v = first.variant,
        m = first.mode,
    )
}

/// The command that rebuilds a case.
fn replay(contents: &Contents, population: &str, case: u64) -> String {
    let population = if population == "dispersed" {
        String::new()
    } else {
        format!(" --population {population}")
    };
    format!("tvse replay {}{population} --case {case}", quoted(&contents.folder))
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=:,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// Cases without a result.
pub fn failures(contents: &Contents) -> Section {
    let mut section = Section::new("failures", "Failures");
    let failures = &contents.failures;
    let cases = contents.outline.definition.populations[contents.population].cases;
    section.text = format!(
        "<p>{} of {cases} cases failed. An unstable pole is a result, no failure.</p>",
        failures.count
    );
    if failures.count > 0 {
        let kinds = failures.kinds.iter();
        let kinds = kinds.map(|(kind, count)| {
            format!("<tr><td>{}</td><td class=\"n\">{count}</td></tr>", escaped(kind))
        });
        section.tables = format!(
            "<table><thead><tr><th>kind</th><th>cases</th></tr></thead><tbody>{}</tbody></table>",
            kinds.collect::<String>()
        );
        let first = failures.first.iter();
        let first = first.map(|(case, message)| {
            format!("<tr><td class=\"n\">{case}</td><td>{}</td></tr>", escaped(message))
        });
        section.tables += &format!(
            "<table><caption>The first {}</caption><thead><tr><th>case</th><th>message</th></tr></thead><tbody>{}</tbody></table>",
            failures.first.len(),
            first.collect::<String>()
        );
    }
    section
}

/// Where the numbers come from.
pub fn provenance(contents: &Contents) -> Section {
    let mut section = Section::new("provenance", "Provenance");
    section.tables = provenance_table(&contents.provenance, "");
    if let Some(other) = &contents.comparison {
        section.tables += &provenance_table(&other.provenance, &other.folder);
    }
    section
}

fn provenance_table(rows: &[(String, String)], title: &str) -> String {
    let caption = if title.is_empty() {
        String::new()
    } else {
        format!("<caption>{}</caption>", escaped(title))
    };
    let rows = rows.iter().map(|(name, value)| {
        format!("<tr><td>{}</td><td class=\"code\">{}</td></tr>", escaped(name), escaped(value))
    });
    format!("<table>{caption}<tbody>{}</tbody></table>", rows.collect::<String>())
}
