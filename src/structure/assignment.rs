//! Optimal one-to-one assignment between two sets (Hungarian method, shortest augmenting paths).
//!
//! Numbers in, pairs out; what is assigned and what a score means is the caller's.

/// The partner of each row in the assignment with the greatest sum of scores, `None` for a row
/// left over. `score(row, column)` must be finite. Ties go to the lower column.
///
/// Every row of the smaller side gets a partner, whatever the score; cost is cubic in the larger
/// side. Method: H. W. Kuhn (1955), in the form with potentials and one augmenting path a row.
pub fn assign(
    rows: usize,
    columns: usize,
    score: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    if rows <= columns {
        return place(rows, columns, score);
    }
    let mut partner = vec![None; rows];
    for (column, row) in place(columns, rows, |c, r| score(r, c)).into_iter().enumerate() {
        if let Some(row) = row {
            partner[row] = Some(column);
        }
    }
    partner
}

/// [`assign`] for at most as many rows as columns.
fn place(rows: usize, columns: usize, score: impl Fn(usize, usize) -> f64) -> Vec<Option<usize>> {
    // Column 0 is a fictitious one that holds the row being placed; real columns count from 1.
    let mut row_potential = vec![0.0; rows];
    let mut column_potential = vec![0.0; columns + 1];
    let mut holder: Vec<Option<usize>> = vec![None; columns + 1];
    for row in 0..rows {
        let mut slack = vec![f64::INFINITY; columns + 1];
        let mut previous = vec![0; columns + 1];
        let mut visited = vec![false; columns + 1];
        holder[0] = Some(row);
        let mut column = 0;
        while let Some(at) = holder[column] {
            visited[column] = true;
            let (mut step, mut nearest) = (f64::INFINITY, None);
            for c in (1..=columns).filter(|&c| !visited[c]) {
                let reduced = -score(at, c - 1) - row_potential[at] - column_potential[c];
                if reduced < slack[c] {
                    (slack[c], previous[c]) = (reduced, column);
                }
                if slack[c] < step {
                    (step, nearest) = (slack[c], Some(c));
                }
            }
            // Only a score that is not finite leaves no column to go to.
            let Some(nearest) = nearest else { return vec![None; rows] };
            for c in 0..=columns {
                match holder[c] {
                    Some(r) if visited[c] => {
                        row_potential[r] += step;
                        column_potential[c] -= step;
                    }
                    _ => slack[c] -= step,
                }
            }
            column = nearest;
        }
        while column != 0 {
            holder[column] = holder[previous[column]];
            column = previous[column];
        }
    }
    let mut partner = vec![None; rows];
    for (c, row) in holder.iter().enumerate().skip(1) {
        if let Some(row) = row {
            partner[*row] = Some(c - 1);
        }
    }
    partner
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Greatest sum over all injections of rows into columns, by trying them.
    fn by_trial(scores: &[Vec<f64>], row: usize, taken: &mut Vec<bool>) -> f64 {
        if row == scores.len() {
            return 0.0;
        }
        let mut best = f64::NEG_INFINITY;
        for c in 0..taken.len() {
            if !taken[c] {
                taken[c] = true;
                best = best.max(scores[row][c] + by_trial(scores, row + 1, taken));
                taken[c] = false;
            }
        }
        best
    }

    #[test]
    fn the_best_pairing_may_refuse_the_greatest_score() {
        let scores = [[0.9, 0.8], [0.8, 0.1]];
        assert_eq!(assign(2, 2, |r, c| scores[r][c]), [Some(1), Some(0)]);
    }

    #[test]
    fn surplus_rows_stay_alone_and_no_rows_give_nothing() {
        let scores = [[0.1], [0.9], [0.3]];
        assert_eq!(assign(3, 1, |r, c| scores[r][c]), [None, Some(0), None]);
        assert!(assign(0, 4, |_, _| 0.0).is_empty());
        assert_eq!(assign(2, 0, |_, _| 0.0), [None, None]);
    }

    proptest! {
        #[test]
        fn the_sum_is_that_of_an_exhaustive_search(
            scores in (1..5usize, 0..3usize).prop_flat_map(|(rows, more)| {
                proptest::collection::vec(
                    proptest::collection::vec((0..5u8).prop_map(|v| f64::from(v) / 4.0), rows + more),
                    rows,
                )
            })
        ) {
            let columns = scores[0].len();
            let partner = assign(scores.len(), columns, |r, c| scores[r][c]);
            let mut seen = vec![false; columns];
            let mut sum = 0.0;
            for (r, c) in partner.iter().enumerate() {
                let c = c.unwrap();
                prop_assert!(!seen[c]);
                seen[c] = true;
                sum += scores[r][c];
            }
            let best = by_trial(&scores, 0, &mut vec![false; columns]);
            // Sums of quarters are exact.
            prop_assert_eq!(sum, best);
            // The transposed problem has the same optimum.
            let turned = assign(columns, scores.len(), |c, r| scores[r][c]);
            let turned: f64 =
                turned.iter().enumerate().filter_map(|(c, r)| r.map(|r| scores[r][c])).sum();
            prop_assert_eq!(turned, best);
        }
    }
}
