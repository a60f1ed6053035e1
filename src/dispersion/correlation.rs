//! Correlation between draws: a Gaussian copula given by a matrix of correlations.
//!
//! A group of draws has the normal scores z = L w with independent standard normal w and L Lᵀ the
//! matrix; margins are untouched. Which draws form a group is read in `resolve`.

use nalgebra::Complex;
use schemars::JsonSchema;
use serde::Deserialize;
use std::f64::consts::PI;

/// What the numbers of a correlation matrix are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Rank correlations (Spearman) of the drawn values.
    Rank,
    /// Correlations of the normal scores z = Φ⁻¹(F(x)).
    NormalScore,
}

impl Kind {
    /// The correlation of normal scores that gives `stated`: for ranks 2 sin(π r/6), exact for the
    /// Gaussian copula (Pearson 1907).
    fn to_score(self, stated: f64) -> f64 {
        match self {
            Self::Rank => 2.0 * (PI * stated / 6.0).sin(),
            Self::NormalScore => stated,
        }
    }

    fn of_score(self, score: f64) -> f64 {
        match self {
            Self::Rank => 6.0 / PI * (score / 2.0).asin(),
            Self::NormalScore => score,
        }
    }
}

/// Correlated draws.
#[derive(Debug, Clone, PartialEq)]
pub struct Group {
    /// Indices of the draws, in the order of the matrix.
    pub draws: Vec<usize>,
    /// Rows of the lower triangular factor L of the matrix of normal-score correlations.
    factor: Vec<Vec<f64>>,
}

/// The pair whose correlation has to change least for the matrix to become positive definite.
#[derive(Debug, Clone, PartialEq)]
pub struct Offender {
    /// Places of the two keys.
    pub pair: [usize; 2],
    /// Least and greatest correlation allowed beside the others, as the matrix states them.
    pub allowed: [f64; 2],
    /// Places of the keys that cannot be together; without any one of them the rest can.
    pub together: Vec<usize>,
}

impl Group {
    /// The group of `draws` with the symmetric `matrix` of `kind`, ones on its diagonal and all else
    /// between −1 and 1.
    ///
    /// # Errors
    /// The nearest offending pair where the matrix of normal scores is not positive definite.
    pub fn new(draws: Vec<usize>, kind: Kind, matrix: &[Vec<f64>]) -> Result<Self, Offender> {
        let scores: Vec<Vec<f64>> = matrix
            .iter()
            .enumerate()
            .map(|(i, row)| {
                let entry = |(j, r): (usize, &f64)| if i == j { 1.0 } else { kind.to_score(*r) };
                row.iter().enumerate().map(entry).collect()
            })
            .collect();
        match factor(&scores) {
            Some(factor) => Ok(Self { draws, factor }),
            None => {
                let Offender { pair, allowed, together } = offender(&scores);
                Err(Offender { pair, allowed: allowed.map(|r| kind.of_score(r)), together })
            }
        }
    }

    /// Correlated scores z = L w of the group from independent ones, both in its order.
    pub fn correlate(&self, independent: &[f64], scores: &mut [f64]) {
        for (score, row) in scores.iter_mut().zip(&self.factor) {
            *score = row.iter().zip(independent).map(|(l, w)| l * w).sum();
        }
    }

    /// Independent scores of which correlated ones are made, the inverse of [`Group::correlate`].
    pub fn independent(&self, scores: &[f64]) -> Vec<f64> {
        let mut found: Vec<f64> = Vec::with_capacity(scores.len());
        for (i, (score, row)) in scores.iter().zip(&self.factor).enumerate() {
            let before: f64 = row.iter().zip(&found).map(|(l, w)| l * w).sum();
            found.push((score - before) / row[i]);
        }
        found
    }

    /// A gradient by the independent scores from that by the correlated ones, Lᵀ times it.
    pub fn pull(&self, by_score: &[Complex<f64>]) -> Vec<Complex<f64>> {
        let mut found = vec![Complex::ZERO; by_score.len()];
        for (by, row) in by_score.iter().zip(&self.factor) {
            for (found, l) in found.iter_mut().zip(row) {
                *found += by * *l;
            }
        }
        found
    }

    /// Correlation of the normal scores of two members, by their places.
    pub fn correlation(&self, i: usize, j: usize) -> f64 {
        self.factor[i].iter().zip(&self.factor[j]).map(|(a, b)| a * b).sum()
    }
}

/// The lower triangular factor of a positive definite matrix with unit diagonal (Cholesky), by rows;
/// `None` where a pivot is not beyond what rounding can make of zero.
fn factor(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let least = matrix.len() as f64 * f64::EPSILON;
    for (i, entries) in matrix.iter().enumerate() {
        let mut row = Vec::with_capacity(i + 1);
        for (other, entry) in rows.iter().zip(entries) {
            let sum: f64 = other.iter().zip(&row).map(|(a, b): (&f64, &f64)| a * b).sum();
            row.push((entry - sum) / other[row.len()]);
        }
        let pivot = 1.0 - row.iter().map(|l: &f64| l * l).sum::<f64>();
        if !(pivot > least) {
            return None;
        }
        row.push(pivot.sqrt());
        rows.push(row);
    }
    Some(rows)
}

fn part(matrix: &[Vec<f64>], places: &[usize]) -> Vec<Vec<f64>> {
    places.iter().map(|&i| places.iter().map(|&j| matrix[i][j]).collect()).collect()
}

/// The nearest offending pair of a matrix that is not positive definite: of a smallest part that is
/// not, the pair whose entry has to move least. With all others given, entry (i, j) may lie within
/// c ± √(R_i R_j), c and R the conditional covariance and variances of i and j given the rest.
fn offender(matrix: &[Vec<f64>]) -> Offender {
    let mut together: Vec<usize> = (0..matrix.len()).collect();
    for place in 0..matrix.len() {
        let without: Vec<usize> = together.iter().copied().filter(|p| *p != place).collect();
        if factor(&part(matrix, &without)).is_none() {
            together = without;
        }
    }
    let mut nearest: Option<(f64, Offender)> = None;
    for (at, &i) in together.iter().enumerate() {
        for &j in &together[at + 1..] {
            let rest: Vec<usize> =
                together.iter().copied().filter(|p| *p != i && *p != j).collect();
            let Some([low, high]) = interval(matrix, &rest, i, j) else { continue };
            let entry = matrix[i][j];
            let change = (low - entry).max(entry - high);
            if nearest.as_ref().is_none_or(|(least, _)| change < *least) {
                let found = Offender { pair: [i, j], allowed: [low, high], together: vec![] };
                nearest = Some((change, found));
            }
        }
    }
    // Every proper part of the smallest one is positive definite, so that every pair has its interval.
    let (_, found) = nearest.expect("a matrix that is not positive definite has two keys or more");
    Offender { together, ..found }
}

fn interval(matrix: &[Vec<f64>], rest: &[usize], i: usize, j: usize) -> Option<[f64; 2]> {
    let factor = factor(&part(matrix, rest))?;
    let solve = |k: usize| {
        let mut solution: Vec<f64> = Vec::new();
        for (row, &p) in factor.iter().zip(rest) {
            let sum: f64 = row.iter().zip(&solution).map(|(l, x)| l * x).sum();
            solution.push((matrix[k][p] - sum) / row[solution.len()]);
        }
        solution
    };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let (a, b) = (solve(i), solve(j));
    let centre = dot(&a, &b);
    let half = ((1.0 - dot(&a, &a)).max(0.0) * (1.0 - dot(&b, &b)).max(0.0)).sqrt();
    Some([centre - half, centre + half])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(upper: [f64; 3]) -> Vec<Vec<f64>> {
        let [ab, ac, bc] = upper;
        vec![vec![1.0, ab, ac], vec![ab, 1.0, bc], vec![ac, bc, 1.0]]
    }

    #[test]
    fn the_factor_gives_the_matrix_back() {
        let matrix = matrix([0.6, -0.3, 0.2]);
        let group = Group::new(vec![4, 5, 6], Kind::NormalScore, &matrix).unwrap();
        for (i, row) in matrix.iter().enumerate() {
            for (j, entry) in row.iter().enumerate() {
                // Three products of numbers below one: a few roundings.
                assert!((group.correlation(i, j) - entry).abs() < 4.0 * f64::EPSILON);
            }
        }
    }

    #[test]
    fn the_nearest_offending_pair_is_named_with_what_is_allowed() {
        // With 0.9 and −0.9 the third may lie within −0.81 ± 0.19; 0.2 is out by 0.82, each of the
        // others by less: 0.9 beside 0.2 and −0.9 may lie within −0.18 ± √(0.96 · 0.19) = 0.427.
        let found = Group::new(vec![0, 1, 2], Kind::NormalScore, &matrix([0.9, -0.9, 0.2]));
        let Err(Offender { pair, allowed, together }) = found else { panic!("{found:?}") };
        assert_eq!((pair, together), ([0, 1], vec![0, 1, 2]));
        let half = (0.96_f64 * 0.19).sqrt();
        assert!((allowed[0] - (-0.18 - half)).abs() < 1e-15, "{allowed:?}");
        assert!((allowed[1] - (-0.18 + half)).abs() < 1e-15, "{allowed:?}");
    }

    #[test]
    fn keys_that_have_nothing_to_do_with_it_are_not_named() {
        let mut wide = vec![vec![0.0; 4]; 4];
        for (i, row) in wide.iter_mut().enumerate() {
            row[i] = 1.0;
        }
        for (i, j, r) in [(1, 2, 0.9), (1, 3, 0.9), (2, 3, -0.9), (0, 1, 0.1)] {
            (wide[i][j], wide[j][i]) = (r, r);
        }
        let offender = Group::new(vec![0, 1, 2, 3], Kind::Rank, &wide).unwrap_err();
        assert_eq!(offender.together, [1, 2, 3]);
        // What it allows it does allow.
        let middle = (offender.allowed[0] + offender.allowed[1]) / 2.0;
        let [i, j] = offender.pair;
        (wide[i][j], wide[j][i]) = (middle, middle);
        assert!(Group::new(vec![0, 1, 2, 3], Kind::Rank, &wide).is_ok());
    }

    #[test]
    fn a_singular_matrix_is_not_positive_definite() {
        assert!(Group::new(vec![0, 1, 2], Kind::NormalScore, &matrix([0.8, 0.6, 0.0])).is_err());
    }

    #[test]
    fn ranks_and_scores_are_converted_there_and_back() {
        for r in [-0.99, -0.3, 0.0, 0.5, 0.999] {
            assert!((Kind::Rank.of_score(Kind::Rank.to_score(r)) - r).abs() < 1e-14);
        }
        assert!((Kind::Rank.to_score(0.5) - 0.517_638_090_205_041_5).abs() < 1e-15);
    }
}
