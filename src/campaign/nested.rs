//! The outer draws of a nested plan, summed up one after the other as their cases pass by.
//!
//! What a row of the summary is, is decided in `summary`.

use super::sample::{CONFIDENCE, Sample, ends};
use super::summary::{Found, Group, SummaryRow, Tally};
use crate::stats::{
    Confidence, Drawing, Error, Probability, Sides, clopper_pearson, rejects_at_least,
    rejects_at_most,
};

/// Whether an outer draw meets the statement of its plan: that the share of unstable or failed
/// inner cases is at most the allowed one, at the consumer's risk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statement {
    /// Shown.
    Met,
    /// The contrary is shown.
    NotMet,
    /// Neither.
    Undecided,
}

impl Statement {
    /// Every one, in the order of declaration.
    pub const ALL: [Self; 3] = [Self::Met, Self::NotMet, Self::Undecided];

    /// The word stored in the `statement` column.
    pub fn name(self) -> &'static str {
        match self {
            Self::Met => "met",
            Self::NotMet => "not_met",
            Self::Undecided => "undecided",
        }
    }
}

/// What the outer draws of a nested plan show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OuterDraws {
    /// Outer draws that meet the statement.
    pub met: u64,
    /// Outer draws that do not.
    pub not_met: u64,
    /// Share of all outer draws that meet it.
    pub share_met: f64,
    /// Its exact binomial interval: outer draws are independent.
    pub share_met_interval: [f64; 2],
}

/// The outer draws of a nested plan.
#[derive(Debug, Clone)]
pub struct Nested {
    group: Group,
    /// Cases of an outer draw.
    inner: u64,
    allowed_share: f64,
    risk: f64,
    /// The outer draw whose cases pass by.
    open: Box<Tally>,
    rows: Vec<SummaryRow>,
    statements: Vec<Statement>,
    /// Means of damping ratio and of gain of each outer draw, and its share of bad cases.
    means: [Vec<Option<f64>>; 2],
    shares: Vec<f64>,
}

impl Nested {
    /// No outer draw yet: cases of each, share of bad ones allowed, and the risk of saying so.
    pub(super) fn new(group: Group, (inner, allowed_share, risk): (u64, f64, f64)) -> Self {
        Self {
            group,
            inner,
            allowed_share,
            risk,
            open: Self::open(group, 0),
            rows: Vec::new(),
            statements: Vec::new(),
            means: [Vec::new(), Vec::new()],
            shares: Vec::new(),
        }
    }

    /// Given what is known the inner cases are independent draws.
    fn open(group: Group, outer: u64) -> Box<Tally> {
        let group = Group { outer: Some(outer), ..group };
        Box::new(Tally::new(group, Sample::INDEPENDENT, usize::MAX))
    }

    /// Takes the next case.
    ///
    /// # Errors
    /// What `stats` says of it.
    pub(super) fn add(&mut self, found: &Found) -> Result<(), Error> {
        self.open.add(found)?;
        if self.open.cases() < self.inner {
            return Ok(());
        }
        let next = Self::open(self.group, self.shares.len() as u64 + 1);
        let mut full = std::mem::replace(&mut self.open, next);
        full.end_pass()?;
        let independent = Drawing::Independent.independent()?;
        let allowed = Probability::new(self.allowed_share)?;
        let risk = Confidence::from_risk(self.risk)?;
        let (bad, cases) = (full.bad(), full.cases());
        let statement = if rejects_at_least(bad, cases, allowed, risk, independent)? {
            Statement::Met
        } else if rejects_at_most(bad, cases, allowed, risk, independent)? {
            Statement::NotMet
        } else {
            Statement::Undecided
        };
        self.statements.push(statement);
        self.shares.push(bad as f64 / cases as f64);
        for (all, mean) in self.means.iter_mut().zip(full.means()) {
            all.push(mean);
        }
        if self.group.flight_time.is_none() {
            self.rows.push(SummaryRow { statement: Some(statement), ..full.row()? });
        }
        Ok(())
    }

    /// The means of the outer draws, of damping ratio (0) or gain (1); none if one has none.
    pub(super) fn means(&self, place: usize) -> Option<Vec<f64>> {
        self.means[place].iter().copied().collect()
    }

    /// The share of bad cases of each outer draw.
    pub(super) fn shares(&self) -> Vec<f64> {
        self.shares.clone()
    }

    /// A row for each outer draw.
    pub(super) fn rows(&self) -> &[SummaryRow] {
        &self.rows
    }

    /// How many outer draws meet the statement.
    ///
    /// # Errors
    /// No outer draw.
    pub(super) fn outer_draws(&self) -> Result<OuterDraws, Error> {
        let independent = Drawing::Independent.independent()?;
        let count = |wanted| self.statements.iter().filter(|s| **s == wanted).count() as u64;
        let (met, all) = (count(Statement::Met), self.statements.len() as u64);
        let confidence = Confidence::new(CONFIDENCE)?;
        let share = clopper_pearson(met, all, confidence, Sides::Two, independent)?;
        Ok(OuterDraws {
            met,
            not_met: count(Statement::NotMet),
            share_met: share.point(),
            share_met_interval: ends(share),
        })
    }
}
