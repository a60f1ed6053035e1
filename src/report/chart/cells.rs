//! Decimation of a cloud of points that never loses an extreme: one point for each small cell.
//!
//! Each cell that holds a point keeps the one with the least score, so that the outline of the cloud stays
//! to within a cell and the point of least score of all is always there. The number of cells bounds the
//! memory, whatever the number of points.

use std::collections::BTreeMap;

/// A point and its case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dot {
    /// To the right.
    pub x: f64,
    /// Upwards.
    pub y: f64,
    /// Case index.
    pub case: u64,
}

/// The cells of a rectangle.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    low: [f64; 2],
    size: [f64; 2],
    kept: BTreeMap<(i32, i32), (f64, Dot)>,
    seen: u64,
}

impl Cells {
    /// So many cells across and up over the ranges of x and y.
    pub fn new(x: [f64; 2], y: [f64; 2], count: [u32; 2]) -> Self {
        let size = |[low, high]: [f64; 2], count: u32| {
            let size = (high - low) / f64::from(count.max(1));
            if size > 0.0 { size } else { 1.0 }
        };
        Self {
            low: [x[0], y[0]],
            size: [size(x, count[0]), size(y, count[1])],
            kept: BTreeMap::new(),
            seen: 0,
        }
    }

    /// Takes in a point; of a cell that with the least score stays, of equal ones the first. Points that are
    /// not finite are left out.
    pub fn push(&mut self, dot: Dot, score: f64) {
        if !(dot.x.is_finite() && dot.y.is_finite() && score.is_finite()) {
            return;
        }
        self.seen += 1;
        let cell = |value: f64, k: usize| ((value - self.low[k]) / self.size[k]).floor() as i32;
        let kept = self.kept.entry((cell(dot.x, 0), cell(dot.y, 1))).or_insert((score, dot));
        if score < kept.0 {
            *kept = (score, dot);
        }
    }

    /// Points taken in.
    pub fn seen(&self) -> u64 {
        self.seen
    }

    /// The points kept, in a fixed order.
    pub fn dots(&self) -> Vec<Dot> {
        self.kept.values().map(|(_, dot)| *dot).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn extremes_survive_and_the_number_is_bounded(
            points in proptest::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 1..2000)
        ) {
            let mut cells = Cells::new([0.0, 1.0], [0.0, 1.0], [20, 10]);
            for (case, &(x, y)) in points.iter().enumerate() {
                cells.push(Dot { x, y, case: case as u64 }, x);
            }
            let kept = cells.dots();
            prop_assert!(kept.len() <= points.len().min(21 * 11));
            prop_assert_eq!(cells.seen(), points.len() as u64);
            let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, f64::min);
            let all_x = least(&mut points.iter().map(|p| p.0));
            let kept_x = least(&mut kept.iter().map(|d| d.x));
            prop_assert_eq!(all_x, kept_x);
            // The greatest of y stays to within a cell.
            let all_y = -least(&mut points.iter().map(|p| -p.1));
            let kept_y = -least(&mut kept.iter().map(|d| -d.y));
            prop_assert!(all_y - kept_y <= 0.1);
            for dot in kept {
                let (x, y) = points[dot.case as usize];
                prop_assert_eq!((dot.x, dot.y), (x, y));
            }
        }
    }
}
