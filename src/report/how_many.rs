//! How many cases a claim needs and what a number of cases can claim, as text tables.
//!
//! The numbers are those of `stats`.

use super::{percent, significant};
use crate::campaign::Outline;
use crate::campaign::summary::SummaryRow;
use crate::stats::{
    Confidence, Error, Probability, Sides, Tails, clopper_pearson, consumers_risk, least_cases,
    most_exceedances,
};
use comfy_table::{CellAlignment, Table, presets};

/// A claim: a share of the population, a risk, and whether it is bounded or enclosed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Claim {
    /// Share of the population.
    pub coverage: Probability,
    /// Confidence, one minus the consumer's risk.
    pub confidence: Confidence,
    /// One bound, or two that enclose.
    pub tails: Tails,
}

impl Claim {
    fn words(&self) -> String {
        let share = percent(self.coverage.get());
        let risk = percent(self.confidence.risk());
        let bounds = match self.tails {
            Tails::One => "One bound for",
            Tails::Two => "Two bounds that enclose",
        };
        format!("{bounds} {share} % of the population, consumer's risk {risk} %")
    }

    fn exceedances(&self) -> &'static str {
        match self.tails {
            Tails::One => "exceedances",
            Tails::Two => "exceedances on each side",
        }
    }
}

const INDEPENDENT: &str = "Holds for independent draws and any law.\n";

fn table<const N: usize>(
    header: [String; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header);
    for row in rows {
        table.add_row(row);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!("{table}\n")
}

/// Least number of cases for each number of exceedances.
pub fn cases_needed(
    claim: &Claim,
    exceedances: impl IntoIterator<Item = u64>,
) -> Result<String, Error> {
    let mut rows = Vec::new();
    for k in exceedances {
        let cases = least_cases(k, claim.coverage, claim.confidence, claim.tails)?;
        let risk = consumers_risk(k, cases, claim.coverage, claim.tails)?;
        rows.push([k.to_string(), cases.to_string(), significant(100.0 * risk)]);
    }
    let header = [claim.exceedances().into(), "least cases".into(), "actual risk, %".into()];
    Ok(format!("{}\n\n{}\n{INDEPENDENT}", claim.words(), table(header, rows)))
}

/// Greatest number of exceedances that a number of cases may show, and the risk around it.
pub fn exceedances_allowed(claim: &Claim, cases: u64, asked: Option<u64>) -> Result<String, Error> {
    let most = most_exceedances(cases, claim.coverage, claim.confidence, claim.tails);
    let shown = match (asked, most) {
        (Some(k), _) => k..=k,
        (None, Some(k)) => k.saturating_sub(2)..=k + 1,
        (None, None) => 0..=1,
    };
    let mut rows = Vec::new();
    for k in shown {
        let risk = consumers_risk(k, cases, claim.coverage, claim.tails)?;
        let holds = most.is_some_and(|most| k <= most);
        let holds = if holds { "yes" } else { "no" };
        rows.push([k.to_string(), significant(100.0 * risk), holds.into()]);
    }
    let answer = match most {
        Some(most) => format!("{cases} cases: at most {most} {}", claim.exceedances()),
        None => {
            let least = least_cases(0, claim.coverage, claim.confidence, claim.tails)?;
            format!("{cases} cases are too few for this claim: at least {least} are needed")
        }
    };
    let header = [claim.exceedances().into(), "actual risk, %".into(), "claim holds".into()];
    Ok(format!("{}\n{answer}\n\n{}\n{INDEPENDENT}", claim.words(), table(header, rows)))
}

/// What a finished run can claim: of each population, variant and mode the bad cases (unstable or failed at
/// some flight time), whether as many may be bad, and the greatest share of the population that can be
/// claimed at the risk; and why nothing can be claimed of other populations.
pub fn finished(claim: &Claim, outline: &Outline, summary: &[SummaryRow]) -> Result<String, Error> {
    let definition = &outline.definition;
    let mut rows = Vec::new();
    let mut refused = String::new();
    for (index, population) in definition.populations.iter().enumerate() {
        let independent = match population.drawing().independent() {
            Ok(independent) => independent,
            Err(error) => {
                refused += &format!("{}: no claim: {error}\n", population.name);
                continue;
            }
        };
        let most = most_exceedances(population.cases, claim.coverage, claim.confidence, Tails::One);
        let reduced = |row: &&SummaryRow| {
            row.group.population == index
                && row.group.flight_time.is_none()
                && row.group.outer.is_none()
        };
        for row in summary.iter().filter(reduced) {
            let bad = row.unstable + row.failures;
            let upper =
                clopper_pearson(bad, row.cases, claim.confidence, Sides::Upper, independent)?;
            rows.push([
                population.name.clone(),
                definition.variants[row.group.variant].name.clone(),
                definition.modes[row.group.mode].clone(),
                row.cases.to_string(),
                bad.to_string(),
                most.map_or_else(|| "none".into(), |most| most.to_string()),
                if most.is_some_and(|most| bad <= most) { "yes" } else { "no" }.to_owned(),
                significant(100.0 * (1.0 - upper.upper())),
            ]);
        }
    }
    let claims = rows.len();
    let header = [
        "population",
        "variant",
        "mode",
        "cases",
        "unstable or failed",
        "allowed",
        "claim holds",
        "share that can be claimed, %",
    ];
    Ok(format!(
        "{}: no unstable pole at any flight time\n\n{}\n{claims} claims at once, each at this risk; a case \
         counts once, with its worst flight time.\n{refused}{INDEPENDENT}",
        claim.words(),
        table(header.map(str::to_owned), rows)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn claim(coverage: f64, risk: f64, tails: Tails) -> Claim {
        Claim {
            coverage: Probability::new(coverage).unwrap(),
            confidence: Confidence::from_risk(risk).unwrap(),
            tails,
        }
    }

    #[test]
    fn the_tables_hold_the_published_numbers() {
        let text = cases_needed(&claim(0.9973, 0.1, Tails::One), 0..=3).unwrap();
        for number in ["852", "1440", "1970", "2473", "99.73 %", "10 %"] {
            assert!(text.contains(number), "{text}");
        }
        let text = cases_needed(&claim(0.95, 0.05, Tails::Two), [0]).unwrap();
        assert!(text.contains("93") && text.contains("each side"), "{text}");
    }

    #[test]
    fn a_campaign_learns_what_it_can_claim() {
        let one = claim(0.9973, 0.1, Tails::One);
        let text = exceedances_allowed(&one, 2000, None).unwrap();
        assert!(text.contains("at most 2 exceedances"), "{text}");
        assert!(text.contains("9.446") && text.contains("21.29"), "{text}");
        let text = exceedances_allowed(&one, 100, None).unwrap();
        assert!(text.contains("at least 852 are needed"), "{text}");
    }
}
