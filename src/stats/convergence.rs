//! The running estimate: the same statistic of growing first parts of a campaign.
//!
//! Meaningful where the first cases are themselves a sample, as with independent draws.

/// Numbers of cases 10, 20, 50, 100, … below `cases`, and `cases` itself.
pub fn checkpoints(cases: usize) -> Vec<usize> {
    let mut points: Vec<usize> = (1..)
        .map_while(|power| 10_usize.checked_pow(power))
        .take_while(|&decade| decade < cases)
        .flat_map(|decade| [1, 2, 5].map(|step| decade.saturating_mul(step)))
        .take_while(|&point| point < cases)
        .collect();
    if cases > 0 {
        points.push(cases);
    }
    points
}

/// The estimate of the first n cases for each of the checkpoints n.
pub fn running<T, E>(
    cases: usize,
    estimate: impl Fn(usize) -> Result<T, E>,
) -> Result<Vec<(usize, T)>, E> {
    checkpoints(cases).into_iter().map(|n| Ok((n, estimate(n)?))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stats::{Confidence, Drawing, Moments, Sides};

    #[test]
    fn checkpoints_grow_by_one_two_five_and_end_with_the_whole() {
        assert_eq!(checkpoints(0), Vec::<usize>::new());
        assert_eq!(checkpoints(7), [7]);
        assert_eq!(checkpoints(20), [10, 20]);
        assert_eq!(checkpoints(2000), [10, 20, 50, 100, 200, 500, 1000, 2000]);
        assert!(checkpoints(usize::MAX).is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn the_running_interval_narrows_about_the_mean() {
        let witness = Drawing::Independent.independent().unwrap();
        let confidence = Confidence::new(0.95).unwrap();
        let values: Vec<f64> = (0..1000).map(|i| f64::from(i % 10)).collect();
        let run = running(values.len(), |n| {
            Moments::of(&values[..n])?.mean_interval(confidence, Sides::Two, witness)
        })
        .unwrap();
        assert!(run.iter().all(|(_, e)| (e.point() - 4.5).abs() < 1e-12));
        let widths: Vec<f64> = run.iter().map(|(_, e)| e.upper() - e.lower()).collect();
        assert!(widths.is_sorted_by(|a, b| a > b));
    }
}
