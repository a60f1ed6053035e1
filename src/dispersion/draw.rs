//! A dispersion: the draw keys of a vehicle, each with its law and the parameters it acts on.
//!
//! It is made from a table by `resolve`; numbers are drawn from it by `sampler`.

use super::correlation::Group;
use super::law::Law;
use super::parameter::Parameters;
use super::table::{Apply, Class};
use std::collections::BTreeMap;

/// The common score in which a draw takes part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shared {
    /// Index of the common score among the draws.
    pub draw: usize,
    /// Its weight w in z = w·z_common + √(1 − w²)·z_individual.
    pub weight: f64,
}

/// What a draw is for.
#[derive(Debug, Clone, PartialEq)]
pub enum Role {
    /// A standard normal score in which other draws take part.
    Common,
    /// A value that acts on parameters.
    Value {
        /// How it acts.
        apply: Apply,
        /// The common score in which it takes part.
        common: Option<Shared>,
        /// Numbers of the parameters on which it acts.
        targets: Vec<usize>,
    },
}

/// One draw key with everything that belongs to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// Draw key, `instance path @ level # id`.
    pub key: String,
    /// Name of its Parquet column, unique in the dispersion.
    pub column: String,
    /// Unit of its value.
    pub unit: &'static str,
    /// What its value means.
    pub description: &'static str,
    /// Source of its numbers.
    pub source: String,
    /// Law of its value.
    pub law: Law,
    /// Adverse low and high value, in the units of the law; may lie outside the law.
    pub worst: Option<[f64; 2]>,
    /// When its value is known.
    pub class: Class,
    /// Its dimension in a Sobol sequence: its place in the order of the table, the common scores
    /// first, the keys of one row in the order of their text.
    pub dimension: usize,
    /// What it is for.
    pub role: Role,
}

/// How the values of draws combine on one parameter.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Combination {
    /// Number of the parameter.
    pub parameter: usize,
    /// The draw that replaces its nominal value.
    pub absolute: Option<usize>,
    /// The draws that scale it, in key order.
    pub scales: Vec<usize>,
    /// The draws that are added, in key order.
    pub offsets: Vec<usize>,
}

/// All draws of a vehicle, ordered by the text of their keys.
#[derive(Debug, Clone, PartialEq)]
pub struct Dispersion {
    parameters: Parameters,
    draws: Vec<Draw>,
    groups: Vec<Group>,
    combinations: Vec<Combination>,
}

impl Dispersion {
    /// `draws` ordered by key; on each parameter an absolute value acts first, then scales, then
    /// offsets, so that neither the order of rows nor other parameters matter.
    pub(super) fn new(parameters: Parameters, draws: Vec<Draw>, groups: Vec<Group>) -> Self {
        let mut combinations: BTreeMap<usize, Combination> = BTreeMap::new();
        for (index, draw) in draws.iter().enumerate() {
            let Role::Value { apply, targets, .. } = &draw.role else { continue };
            for &parameter in targets {
                let combination = combinations.entry(parameter).or_insert(Combination {
                    parameter,
                    absolute: None,
                    scales: Vec::new(),
                    offsets: Vec::new(),
                });
                match apply {
                    Apply::Absolute => combination.absolute = Some(index),
                    Apply::Scale => combination.scales.push(index),
                    Apply::Offset => combination.offsets.push(index),
                }
            }
        }
        Self { parameters, draws, groups, combinations: combinations.into_values().collect() }
    }

    /// The parameters of the vehicle, by whose numbers effects are ordered.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The draws, ordered by key.
    pub fn draws(&self) -> &[Draw] {
        &self.draws
    }

    /// The groups of correlated draws.
    pub fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// Index of the draw with the key `key`.
    pub fn index(&self, key: &str) -> Option<usize> {
        self.draws.binary_search_by(|d| d.key.as_str().cmp(key)).ok()
    }

    pub(super) fn combinations(&self) -> &[Combination] {
        &self.combinations
    }
}

/// Longest name of a Parquet column that every reader takes (MATLAB's limit).
const COLUMN_LENGTH: usize = 63;

/// Gives every draw its column name: `draw_`, the path, the id, and the unit of the value
/// (`scale` for a factor). Names that are too long, or equal although the keys differ, end in a
/// digest of the key instead.
pub(super) fn name_columns(draws: &mut [Draw]) {
    let mut uses: BTreeMap<String, usize> = BTreeMap::new();
    for draw in draws.iter_mut() {
        draw.column = column(draw);
        *uses.entry(draw.column.clone()).or_default() += 1;
    }
    for draw in draws {
        if draw.column.len() > COLUMN_LENGTH || uses[&draw.column] > 1 {
            let digest = blake3::hash(draw.key.as_bytes()).to_hex();
            let suffix = format!("_{}", &digest[..12]);
            draw.column.truncate(COLUMN_LENGTH - suffix.len());
            draw.column += &suffix;
        }
    }
}

fn column(draw: &Draw) -> String {
    let (path, rest) = draw.key.split_once(" @ ").unwrap_or((&draw.key, ""));
    let id = rest.split_once(" # ").map_or("", |(_, id)| id);
    let unit = if draw.unit == "1" { "" } else { draw.unit };
    let kind = match &draw.role {
        Role::Common => "score",
        Role::Value { apply: Apply::Scale, .. } => "scale",
        Role::Value { apply: Apply::Offset, .. } => "offset",
        Role::Value { apply: Apply::Absolute, .. } => "",
    };
    let parts = ["draw", &path.replace('*', "all"), id, kind, unit];
    let name = parts.iter().filter(|p| !p.is_empty()).copied().collect::<Vec<_>>().join("_");
    name.chars()
        .map(|c| if c.is_ascii_alphanumeric() { c.to_ascii_lowercase() } else { '_' })
        .collect()
}
