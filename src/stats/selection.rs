//! Exact order statistics of a sample that is too large to hold: the values pass by several times.
//!
//! Nothing is approximated: a first pass counts values by the leading bits of their order, further
//! ones by the next bits where the ranks asked for lie, until what is left can be held and sorted.

/// Bits by which values are counted at once.
const BITS: u32 = 12;

/// Ranks of a sample, found in passes over its values.
#[derive(Debug, Clone)]
pub struct Selection {
    /// Values that may be held.
    most: usize,
    count: u64,
    first: bool,
    done: bool,
    ranks: Vec<u64>,
    /// Ranges of the order in which a rank lies, ascending and disjoint.
    ranges: Vec<Range>,
}

/// The values whose order begins with some bits.
#[derive(Debug, Clone)]
struct Range {
    /// The bits, and how many.
    prefix: u64,
    bits: u32,
    /// Values before the range.
    before: u64,
    content: Content,
}

#[derive(Debug, Clone)]
enum Content {
    /// The values of the range, sorted at the end of the pass.
    Held(Vec<u64>),
    /// Number of values by their next bits.
    Counted(Vec<u64>),
    /// All bits are known: that many equal values.
    Equal(u64),
}

impl Selection {
    /// A selection that holds about `most` values at once.
    pub fn new(most: usize) -> Self {
        let whole = Range { prefix: 0, bits: 0, before: 0, content: Content::Held(Vec::new()) };
        let (ranks, ranges) = (Vec::new(), vec![whole]);
        Self { most, count: 0, first: true, done: false, ranks, ranges }
    }

    /// Takes a value of the sample, which is no NaN; every pass takes the same values. Once all
    /// ranks are found nothing is taken any more.
    pub fn push(&mut self, value: f64) {
        if self.done {
            return;
        }
        let key = key(value);
        if self.first {
            self.count += 1;
            let whole = &mut self.ranges[0];
            if let Content::Held(held) = &whole.content
                && held.len() >= self.most
            {
                let mut counts = vec![0; 1 << BITS];
                held.iter().for_each(|key| counts[digit(*key, 0)] += 1);
                whole.content = Content::Counted(counts);
            }
        }
        let at = self.ranges.partition_point(|range| range.last() < key);
        let Some(range) = self.ranges.get_mut(at).filter(|range| range.holds(key)) else { return };
        match &mut range.content {
            Content::Held(held) => held.push(key),
            Content::Counted(counts) => counts[digit(key, range.bits)] += 1,
            Content::Equal(_) => {}
        }
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Ends a pass; `ranks` (from 0, below the count, the same after every pass) are asked for.
    /// Whether all are found; if not, the values have to pass again.
    pub fn end_pass(&mut self, ranks: &[u64]) -> bool {
        if self.done {
            return true;
        }
        self.first = false;
        self.ranks = ranks.to_vec();
        let mut next = Vec::new();
        for range in std::mem::take(&mut self.ranges) {
            range.narrow(ranks, &mut next);
        }
        self.ranges = next;
        let open = |range: &Range| matches!(range.content, Content::Counted(_));
        // What is left of the ranges that are still open is held in the next pass if it fits.
        let left: u64 = self.ranges.iter().filter(|r| open(r)).map(Range::count).sum();
        let fits = left <= self.most as u64;
        self.done = true;
        for range in self.ranges.iter_mut().filter(|range| open(range)) {
            self.done = false;
            range.content = if fits {
                Content::Held(Vec::with_capacity(range.count() as usize))
            } else {
                Content::Counted(vec![0; 1 << BITS.min(u64::BITS - range.bits)])
            };
        }
        self.done
    }

    /// The value at a rank that was asked for.
    ///
    /// # Panics
    /// If it was not, or a further pass was due.
    pub fn value(&self, rank: u64) -> f64 {
        assert!(self.ranks.contains(&rank), "a rank that was asked for");
        let at = self.ranges.partition_point(|range| range.before <= rank) - 1;
        let range = &self.ranges[at];
        match &range.content {
            Content::Held(held) => value(held[(rank - range.before) as usize]),
            Content::Equal(_) => value(range.prefix),
            Content::Counted(_) => unreachable!("a further pass was due"),
        }
    }
}

impl Range {
    /// Last key of the range.
    fn last(&self) -> u64 {
        let rest = u64::BITS - self.bits;
        let ones = if rest == 0 { 0 } else { u64::MAX >> self.bits };
        let start = if self.bits == 0 { 0 } else { self.prefix << rest };
        start | ones
    }

    fn holds(&self, key: u64) -> bool {
        self.bits == 0 || key >> (u64::BITS - self.bits) == self.prefix
    }

    fn count(&self) -> u64 {
        match &self.content {
            Content::Held(held) => held.len() as u64,
            // One count alone before the range is refined: see `narrow`.
            Content::Counted(counts) => counts.iter().sum(),
            Content::Equal(count) => *count,
        }
    }

    /// The parts of the range in which a rank lies. A part that has to be looked at again carries its
    /// number of values as its only count.
    fn narrow(mut self, ranks: &[u64], next: &mut Vec<Self>) {
        let counts = match &mut self.content {
            Content::Held(held) => {
                held.sort_unstable();
                return next.push(self);
            }
            Content::Equal(_) => return next.push(self),
            Content::Counted(counts) => std::mem::take(counts),
        };
        let bits = BITS.min(u64::BITS - self.bits);
        let mut before = self.before;
        for (digit, count) in (0..).zip(counts) {
            if ranks.iter().any(|rank| (before..before + count).contains(rank)) {
                let prefix = if self.bits == 0 { 0 } else { self.prefix << bits } | digit;
                let bits = self.bits + bits;
                let content = if bits == u64::BITS {
                    Content::Equal(count)
                } else {
                    Content::Counted(vec![count])
                };
                next.push(Self { prefix, bits, before, content });
            }
            before += count;
        }
    }
}

/// The bits behind the first `bits`.
fn digit(key: u64, bits: u32) -> usize {
    let width = BITS.min(u64::BITS - bits);
    ((key << bits) >> (u64::BITS - width)) as usize
}

/// A number whose order is that of [`f64::total_cmp`].
fn key(value: f64) -> u64 {
    let bits = value.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

fn value(key: u64) -> f64 {
    f64::from_bits(if key >> 63 == 1 { key & !(1 << 63) } else { !key })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn select(values: &[f64], ranks: &[u64], most: usize) -> (Vec<f64>, usize) {
        let mut selection = Selection::new(most);
        for pass in 1.. {
            values.iter().for_each(|value| selection.push(*value));
            assert_eq!(selection.count(), values.len() as u64);
            if selection.end_pass(ranks) {
                return (ranks.iter().map(|rank| selection.value(*rank)).collect(), pass);
            }
            assert!(pass < 8, "a pass finds {BITS} bits");
        }
        unreachable!()
    }

    fn sample(count: u32) -> Vec<f64> {
        // Both signs, many magnitudes, ties, both zeros and infinities.
        let mut values: Vec<f64> = (0..count)
            .map(|i| {
                let x = f64::from(i.wrapping_mul(2_654_435_761)) / f64::from(u32::MAX) - 0.4;
                if i % 7 == 0 { x.signum() * 0.25 } else { x.powi(5) }
            })
            .collect();
        values.extend([0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, f64::MIN_POSITIVE, 5e-324]);
        values
    }

    #[test]
    fn every_rank_is_that_of_the_sorted_sample_however_few_values_are_held() {
        let values = sample(3000);
        let mut sorted = values.clone();
        sorted.sort_by(f64::total_cmp);
        let last = sorted.len() as u64 - 1;
        let ranks = [0, 1, 7, 800, 1500, 1501, 2999, last];
        let expected: Vec<u64> = ranks.iter().map(|r| sorted[*r as usize].to_bits()).collect();
        let mut passes = Vec::new();
        for most in [0, 1, 10, 300, 2000, 100_000] {
            let (found, pass) = select(&values, &ranks, most);
            let found: Vec<u64> = found.into_iter().map(f64::to_bits).collect();
            assert_eq!(found, expected, "{most}");
            passes.push(pass);
        }
        // All bits are looked at where nothing is held, and one pass where everything is.
        assert_eq!((passes[0], passes[5]), (6, 1));
        assert!(passes.is_sorted_by(|a, b| a >= b), "{passes:?}");
    }

    #[test]
    fn equal_values_need_not_be_held() {
        let (found, passes) = select(&[0.03; 1000], &[0, 500, 999], 10);
        assert_eq!((found, passes), (vec![0.03; 3], 6));
    }

    #[test]
    fn every_rank_of_a_small_sample_is_found() {
        let values = [3.0, -1.0, 2.0, -1.0, 0.0];
        for most in [0, 2, 5] {
            let (found, _) = select(&values, &[0, 1, 2, 3, 4], most);
            assert_eq!(found, [-1.0, -1.0, 0.0, 2.0, 3.0]);
        }
    }
}
