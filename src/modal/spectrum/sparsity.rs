//! Which elements of a matrix and of its factors are not zero by structure.

/// A bit for each element of a matrix, row by row.
#[derive(Clone, Default, PartialEq)]
pub struct Pattern {
    words: usize,
    bits: Vec<u64>,
}

impl Pattern {
    /// None of a square matrix.
    pub fn new(size: usize) -> Self {
        let words = size.div_ceil(64);
        Self { words, bits: vec![0; size * words] }
    }

    /// Takes the elements of another matrix of this size.
    pub fn copy_from(&mut self, other: &Self) {
        self.bits.copy_from_slice(&other.bits);
    }

    /// Takes no element.
    pub fn clear(&mut self) {
        self.bits.fill(0);
    }

    #[inline(always)]
    fn row(&self, row: usize) -> &[u64] {
        &self.bits[row * self.words..][..self.words]
    }

    /// Whether it has an element.
    #[inline(always)]
    pub fn has(&self, row: usize, column: usize) -> bool {
        self.bits[row * self.words + column / 64] >> (column % 64) & 1 == 1
    }

    /// Sets an element.
    #[inline(always)]
    pub fn set(&mut self, row: usize, column: usize) {
        self.bits[row * self.words + column / 64] |= 1 << (column % 64);
    }

    /// Sets the columns from `first` on and before `end`.
    #[inline(always)]
    pub fn set_from(&mut self, row: usize, first: usize, end: usize) {
        for word in first / 64..self.words {
            let low = u64::MAX << first.saturating_sub(64 * word);
            let count = end - 64 * word;
            let high = if count < 64 { (1 << count) - 1 } else { u64::MAX };
            self.bits[row * self.words + word] |= low & high;
        }
    }

    /// Gives a row the columns of another from `first` on, and says which it had not.
    #[inline(always)]
    pub fn add_row(
        &mut self,
        row: usize,
        other: usize,
        first: usize,
        mut added: impl FnMut(usize),
    ) {
        for word in first / 64..self.words {
            let low = first.saturating_sub(64 * word);
            let theirs = self.bits[other * self.words + word] & (u64::MAX << low);
            let mut missing = theirs & !self.bits[row * self.words + word];
            self.bits[row * self.words + word] |= theirs;
            while missing != 0 {
                added(64 * word + missing.trailing_zeros() as usize);
                missing &= missing - 1;
            }
        }
    }

    /// The columns of a row from `first` on and before `end`.
    #[inline(always)]
    pub fn columns(&self, row: usize, first: usize, end: usize) -> impl Iterator<Item = usize> {
        let (mut word, end) = (first / 64, end.min(64 * self.words));
        let words = self.row(row);
        let mut left = words.get(word).map_or(0, |start| start & (u64::MAX << (first % 64)));
        std::iter::from_fn(move || {
            while left == 0 {
                word += 1;
                left = *words.get(word)?;
            }
            let column = 64 * word + left.trailing_zeros() as usize;
            left &= left - 1;
            (column < end).then_some(column)
        })
    }
}

/// Columns of factors that are not zero by structure: for each row those of sparse columns on the left of its
/// diagonal, and for each sparse row those on the right.
#[derive(Clone, Default)]
pub struct Lists {
    /// Of each row.
    pub lower: Ragged,
    /// Of each sparse row.
    pub upper: Ragged,
}

/// Lists one after the other.
#[derive(Clone, Default)]
pub struct Ragged {
    ranges: Vec<[usize; 2]>,
    items: Vec<usize>,
}

impl Ragged {
    /// As many empty lists.
    pub fn clear(&mut self, count: usize) {
        self.ranges.clear();
        self.ranges.resize(count, [0; 2]);
        self.items.clear();
    }

    /// Sets a list that is empty.
    pub fn set(&mut self, index: usize, items: impl Iterator<Item = usize>) {
        let first = self.items.len();
        self.items.extend(items);
        self.ranges[index] = [first, self.items.len()];
    }

    /// A list.
    #[inline(always)]
    pub fn get(&self, index: usize) -> &[usize] {
        let [first, last] = self.ranges[index];
        &self.items[first..last]
    }
}

impl Lists {
    /// Those of a pattern whose rows are at these places.
    pub fn take(&mut self, pattern: &Pattern, rows: &[usize], sparse: usize) {
        let n = rows.len();
        self.lower.clear(n);
        self.upper.clear(n);
        for (place, &row) in rows.iter().enumerate() {
            self.lower.set(row, pattern.columns(row, 0, place.min(sparse)));
            if place < sparse {
                self.upper.set(row, pattern.columns(row, place + 1, n));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_longer_than_a_word_keep_their_columns() {
        let mut pattern = Pattern::new(150);
        let columns = [0, 1, 63, 64, 100, 127, 128, 149];
        columns.iter().for_each(|column| pattern.set(3, *column));
        let all: Vec<usize> = pattern.columns(3, 0, 150).collect();
        assert_eq!(all, columns);
        let some: Vec<usize> = pattern.columns(3, 64, 128).collect();
        assert_eq!(some, [64, 100, 127]);
        assert_eq!(pattern.columns(4, 0, 150).count(), 0);
        pattern.set(4, 100);
        let mut added = Vec::new();
        pattern.add_row(4, 3, 63, |column| added.push(column));
        assert_eq!(added, [63, 64, 127, 128, 149]);
        assert_eq!(pattern.columns(4, 0, 150).count(), 6);
        pattern.set_from(5, 62, 150);
        assert_eq!(pattern.columns(5, 0, 150).collect::<Vec<_>>(), (62..150).collect::<Vec<_>>());
    }

    #[test]
    fn lists_are_those_of_sparse_rows_and_columns() {
        // Two sparse rows, the second at the first place.
        let mut pattern = Pattern::new(4);
        for (row, column) in [(0, 1), (0, 3), (1, 0), (1, 1), (1, 2), (2, 0), (2, 2), (3, 1)] {
            pattern.set(row, column);
        }
        let mut lists = Lists::default();
        lists.take(&pattern, &[1, 0, 2, 3], 2);
        assert_eq!(lists.upper.get(1), [1, 2]);
        assert_eq!(lists.upper.get(0), [3]);
        assert_eq!([0, 1, 2, 3].map(|row| lists.lower.get(row).len()), [0, 0, 1, 1]);
    }
}
