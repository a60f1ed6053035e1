//! Sobol sequences with Owen's scrambling: the uniform of a dimension at any index, 2³² and beyond.
//!
//! Which draw key has which dimension is said by the plan. Direction numbers: S. Joe and F. Y. Kuo,
//! "Constructing Sobol sequences with better two-dimensional projections", SIAM J. Sci. Comput. 30
//! (2008), set D(6), dimensions 1 to 4096; their licence lies beside the table.
//!
//! # The mapping, version 1
//! 1. Point i of a dimension is the exclusive or of the direction numbers v_k of the digits k that
//!    are set in i ⊕ ⌊i/2⌋ (Antonov and Saleev), in 64 binary digits.
//! 2. Its first 54 digits are scrambled (A. B. Owen, 1995): each digit is flipped or not by a coin of
//!    its own for every combination of the digits above it. The coins of six digits are 63 bits of the
//!    keyed hash of the digits above these six (see `keyed`).
//! 3. u = (2j + 1)/2⁵³ with j the first 52 digits, as for independent draws.

use super::keyed::Key;
use super::stream;

/// Most dimensions, hence draw keys.
pub const MOST_DIMENSIONS: usize = 4096;

/// BLAKE3 context of the scrambling; its version is part of every result.
pub const CONTEXT: &str = "tvse sobol v1";

/// Dimensions 2 to 4096, packed as `scripts/direction-numbers` says.
const TABLE: &[u8] = include_bytes!("sobol/joe_kuo_6.bin");

/// Primitive polynomials of each degree from 1, φ(2^s − 1)/s: as many dimensions have this degree.
const POLYNOMIALS: [usize; 16] = [1, 1, 2, 2, 6, 6, 18, 16, 48, 60, 176, 144, 630, 756, 1800, 2048];

/// Direction numbers of one dimension: v_k at k − 1, its first digit the highest bit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Directions([u64; 64]);

impl Directions {
    /// The first `count` dimensions, at most [`MOST_DIMENSIONS`].
    pub fn first(count: usize) -> Vec<Self> {
        let degrees = POLYNOMIALS.iter().enumerate();
        let mut degrees = degrees.flat_map(|(i, &count)| std::iter::repeat_n(i + 1, count));
        let mut next = 0;
        let mut bits = |count: usize| {
            let all = next..next + count;
            next = all.end;
            all.fold(0, |word, at| word << 1 | u64::from(TABLE[at / 8] >> (7 - at % 8) & 1))
        };
        let mut all = vec![Self(std::array::from_fn(|k| 1 << (63 - k)))];
        while all.len() < count {
            let degree = degrees.next().expect("as many degrees as dimensions");
            let polynomial = bits(degree - 1);
            let mut v = [0_u64; 64];
            for (i, v) in v.iter_mut().enumerate().take(degree) {
                *v = (bits(i) << 1 | 1) << (63 - i);
            }
            for k in degree..64 {
                v[k] = v[k - degree] ^ (v[k - degree] >> degree);
                for i in 1..degree {
                    v[k] ^= (polynomial >> (degree - 1 - i) & 1) * v[k - i];
                }
            }
            all.push(Self(v));
        }
        all.truncate(count);
        all
    }

    /// Point `index` before scrambling.
    pub fn point(&self, index: u64) -> u64 {
        let mut digits = index ^ (index >> 1);
        let mut point = 0;
        while digits != 0 {
            point ^= self.0[digits.trailing_zeros() as usize];
            digits &= digits - 1;
        }
        point
    }

    /// The uniform of point `index`, scrambled under `key`.
    pub fn uniform(&self, index: u64, key: &Key) -> f64 {
        stream::open_uniform(scramble(self.point(index), key))
    }
}

/// Digits whose coins one hash holds: a tree of six levels has 63 nodes.
const LEVELS: u32 = 6;
/// Hashes for the 52 digits that are used.
const BLOCKS: u32 = 9;

/// The nested uniform scramble of the first 54 digits; the others become zero.
fn scramble(point: u64, key: &Key) -> u64 {
    let mut scrambled = 0;
    for block in 0..BLOCKS {
        let above = block * LEVELS;
        let prefix = point.checked_shr(u64::BITS - above).unwrap_or(0);
        // Unlike for every node: prefixes of different blocks differ in the lowest digits.
        let coins = key.hash(prefix << 4 | u64::from(block));
        let place = u64::BITS - LEVELS - above;
        let digits = point >> place & 63;
        let (mut node, mut flips) = (1, 0);
        for level in (0..LEVELS).rev() {
            flips = flips << 1 | (coins >> node & 1);
            node = node << 1 | (digits >> level & 1);
        }
        scrambled |= (digits ^ flips) << place;
    }
    scrambled
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(name: &str) -> Key {
        Key::new(CONTEXT, 7, 0, name)
    }

    #[test]
    fn the_first_points_are_the_published_ones() {
        // Joe and Kuo's own example: the first ten points of three dimensions.
        let expected = [
            [0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25],
            [0.25, 0.75, 0.75],
            [0.375, 0.375, 0.625],
            [0.875, 0.875, 0.125],
            [0.625, 0.125, 0.875],
            [0.125, 0.625, 0.375],
            [0.1875, 0.3125, 0.9375],
            [0.6875, 0.8125, 0.4375],
        ];
        let dimensions = Directions::first(3);
        for (index, point) in expected.iter().enumerate() {
            for (dimension, expected) in dimensions.iter().zip(point) {
                assert_eq!(dimension.point(index as u64) as f64 / 2_f64.powi(64), *expected);
            }
        }
    }

    #[test]
    fn the_table_is_used_up_by_its_dimensions() {
        let bits = |degree: usize| degree - 1 + degree * (degree - 1) / 2;
        let used: usize = POLYNOMIALS.iter().enumerate().map(|(i, n)| n * bits(i + 1)).sum();
        let dimensions: usize = 1 + POLYNOMIALS.iter().sum::<usize>();
        let beyond = dimensions - MOST_DIMENSIONS;
        assert_eq!(TABLE.len(), (used - beyond * bits(POLYNOMIALS.len())).div_ceil(8));
        assert_eq!(Directions::first(MOST_DIMENSIONS).len(), MOST_DIMENSIONS);
    }

    /// Numbers of points in each of `count` equal intervals.
    fn strata(uniforms: impl Iterator<Item = f64>, count: usize) -> Vec<usize> {
        let mut strata = vec![0; count];
        uniforms.for_each(|u| strata[(u * count as f64) as usize] += 1);
        strata
    }

    #[test]
    fn every_dimension_stays_balanced_under_scrambling_at_any_aligned_place() {
        for (number, dimension) in Directions::first(300).iter().enumerate() {
            for first in [0, 1 << 20, 3 << 40] {
                let key = key(&number.to_string());
                let uniforms = (first..first + 64).map(|i| dimension.uniform(i, &key));
                assert_eq!(strata(uniforms, 64), [1; 64]);
            }
        }
    }

    #[test]
    fn pairs_of_the_first_dimensions_stay_a_net_under_scrambling() {
        // Dimensions 1 and 2 are a (0, m, 2)-net: every dyadic box of area 2⁻¹⁰ has its point.
        let pair = Directions::first(2);
        let keys = [key("x"), key("y")];
        for wide in 0..=10 {
            let columns = 1_usize << wide;
            let rows = 1024 / columns;
            let mut boxes = vec![0; 1024];
            for index in 0..1024 {
                let [x, y] = [0, 1].map(|d| pair[d].uniform(index, &keys[d]));
                boxes[(x * columns as f64) as usize * rows + (y * rows as f64) as usize] += 1;
            }
            assert!(boxes.iter().all(|count| *count == 1), "{columns} × {rows}");
        }
    }

    #[test]
    fn a_scrambled_point_is_uniform_over_the_keys_and_two_points_are_as_owen_has_them() {
        // Over 20 000 keys: the first point uniform in 32 intervals (χ², 31 degrees of freedom, beyond
        // 77 once in a hundred thousand correct programs); points 0 and 1 always in different halves,
        // their distance from the other's mirror uncorrelated beyond: 6 deviations, 1/√20000 each.
        let keys = 20_000;
        let dimension = &Directions::first(1)[0];
        let pairs: Vec<[f64; 2]> = (0..keys)
            .map(|k| [0, 1].map(|i| dimension.uniform(i, &key(&format!("k{k}")))))
            .collect();
        let expected = f64::from(keys) / 32.0;
        let counts = strata(pairs.iter().map(|p| p[0]), 32);
        let chi: f64 = counts.iter().map(|n| (*n as f64 - expected).powi(2) / expected).sum();
        assert!(chi < 77.0, "{chi}");
        assert!(pairs.iter().all(|[a, b]| (*a < 0.5) != (*b < 0.5)));
        let inside = |u: f64| (2.0 * u).fract() - 0.5;
        let correlation: f64 = pairs.iter().map(|[a, b]| 12.0 * inside(*a) * inside(*b)).sum();
        assert!(correlation.abs() < 6.0 * f64::from(keys).sqrt(), "{correlation}");
    }

    #[test]
    fn the_last_of_52_digits_is_scrambled_too() {
        let words: Vec<u64> =
            (0..64).map(|k| scramble(0, &key(&k.to_string())) >> 12 & 1).collect();
        // All 64 coins alike once in 2⁶³ correct programs.
        assert!(words.contains(&0) && words.contains(&1));
        let low: Vec<u64> = (0..64).map(|bit| scramble(1 << 12, &key(&bit.to_string()))).collect();
        let same: Vec<u64> = (0..64).map(|bit| scramble(0, &key(&bit.to_string()))).collect();
        assert!(low.iter().zip(same).all(|(a, b)| (a ^ b) >> 12 == 1));
    }

    #[test]
    fn indices_beyond_two_to_the_32_are_points_of_their_own() {
        let dimension = &Directions::first(5)[4];
        let far: Vec<u64> = (0..40).map(|bit| dimension.point(1 << (bit + 20))).collect();
        let mut sorted = far.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), far.len());
    }

    #[test]
    fn the_mapping_is_pinned() {
        let all = Directions::first(MOST_DIMENSIONS);
        let found = [(0, 0), (0, 5), (194, 12_345), (4095, (1 << 40) + 3)]
            .map(|(d, i): (usize, u64)| all[d].uniform(i, &key("pin")).to_bits());
        assert_eq!(found, PINNED, "{found:#x?}");
    }

    const PINNED: [u64; 4] = [
        0x3fa2_fd1f_2b73_4d50,
        0x3fee_0ebd_843f_5a55,
        0x3fcc_6cd3_26d3_a634,
        0x3fe4_1088_5ff0_3637,
    ];
}
