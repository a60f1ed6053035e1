//! Streams: the uniform number of a draw key in a case, a function of (seed, key, case) alone.
//!
//! # The mapping, version 1
//! 1. `secret` = BLAKE3 `derive_key` mode with the context `"tvse draw v1"` over the bytes: seed
//!    (u64, little-endian), length of the key in bytes (u64, little-endian), the key (UTF-8).
//! 2. The stream is ChaCha with 8 rounds, 256-bit key `secret`, nonce zero and a 64-bit block
//!    counter from zero (Bernstein's original layout); its output is a sequence of 32-bit words.
//! 3. Case `i` owns the words 2i and 2i + 1; they are the low and the high half of a 64-bit
//!    number, of which `j` is the upper 52 bits.
//! 4. u = (2j + 1) / 2^53: one of 2^52 numbers, the odd multiples of 2^-53, exactly
//!    representable as is 1 − u, symmetric about ½, never 0 or 1.
//!
//! The counter is random access, so a case costs the same wherever it lies. Cases run up to
//! 2^64 − 1: the last one lies in block 2^61, far inside the counter. Eight rounds are the
//! fastest ChaCha without a known distinguisher (attacks reach seven); draws need statistical
//! independence, not secrecy. Keys and seeds meet only in BLAKE3, so neighbouring ones share
//! nothing. What a key's numbers mean is not known here.
//!
//! Any change of this mapping changes every result: it needs a new context string, and the test
//! vectors below pin it.

use rand::rngs::ChaCha8Rng;
use rand::{Rng, SeedableRng};

/// BLAKE3 context of the mapping; its version is part of every result.
pub const CONTEXT: &str = "tvse draw v1";

/// The uniform numbers of one draw key under one seed, by case index.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stream {
    secret: [u8; 32],
}

impl Stream {
    /// The stream of the draw key `key` under `seed`.
    pub fn new(seed: u64, key: &str) -> Self {
        let mut hasher = blake3::Hasher::new_derive_key(CONTEXT);
        hasher.update(&seed.to_le_bytes());
        hasher.update(&(key.len() as u64).to_le_bytes());
        hasher.update(key.as_bytes());
        Self { secret: hasher.finalize().into() }
    }

    /// The uniform of `case`, in the open interval (0, 1).
    pub fn uniform(&self, case: u64) -> f64 {
        let mut u = [0.0];
        self.fill(case, &mut u);
        u[0]
    }

    /// The uniforms of the consecutive cases from `first_case`, as [`Stream::uniform`] gives them.
    pub fn fill(&self, first_case: u64, uniforms: &mut [f64]) {
        uniforms
            .iter_mut()
            .zip(self.words(first_case))
            .for_each(|(u, word)| *u = open_uniform(word));
    }

    /// The 64-bit numbers of the cases from `first_case` on.
    pub(super) fn words(&self, first_case: u64) -> impl Iterator<Item = u64> + use<> {
        let mut generator = ChaCha8Rng::from_seed(self.secret);
        generator.set_word_pos(2 * u128::from(first_case));
        std::iter::from_fn(move || Some(generator.next_u64()))
    }
}

/// (2j + 1)/2^53 with j the upper 52 bits of `word`.
pub(super) fn open_uniform(word: u64) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    // The odd integer is below 2^53, hence exact.
    ((word >> 12) << 1 | 1) as f64 * STEP
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ChaCha with 8 rounds written out from its specification, one block at a time.
    fn block(secret: &[u8; 32], counter: u64) -> [u32; 16] {
        let word = |i: usize| u32::from_le_bytes(secret[4 * i..4 * i + 4].try_into().unwrap());
        let mut start = [0_u32; 16];
        start[..4].copy_from_slice(&[0x6170_7865, 0x3320_646e, 0x7962_2d32, 0x6b20_6574]);
        (0..8).for_each(|i| start[4 + i] = word(i));
        start[12] = counter as u32;
        start[13] = (counter >> 32) as u32;
        let mut s = start;
        let mut quarter = |a: usize, b: usize, c: usize, d: usize| {
            for (left, right) in [(16, 12), (8, 7)] {
                s[a] = s[a].wrapping_add(s[b]);
                s[d] = (s[d] ^ s[a]).rotate_left(left);
                s[c] = s[c].wrapping_add(s[d]);
                s[b] = (s[b] ^ s[c]).rotate_left(right);
            }
        };
        for _ in 0..4 {
            (0..4).for_each(|i| quarter(i, 4 + i, 8 + i, 12 + i));
            (0..4).for_each(|i| quarter(i, 4 + (i + 1) % 4, 8 + (i + 2) % 4, 12 + (i + 3) % 4));
        }
        std::array::from_fn(|i| s[i].wrapping_add(start[i]))
    }

    fn by_the_book(seed: u64, key: &str, case: u64) -> f64 {
        let mut text = seed.to_le_bytes().to_vec();
        text.extend((key.len() as u64).to_le_bytes());
        text.extend(key.as_bytes());
        let secret = blake3::derive_key("tvse draw v1", &text);
        let words = block(&secret, case / 8);
        let i = 2 * (case % 8) as usize;
        let j = (u64::from(words[i]) | u64::from(words[i + 1]) << 32) >> 12;
        (2.0 * j as f64 + 1.0) / 2_f64.powi(53)
    }

    const KEY: &str = "booster.left.nozzle.mass @ engine";

    #[test]
    fn uniforms_are_those_of_the_published_mapping() {
        let around = [0, 1, 7, 8, 31, 32, 33, 1_999, 1 << 20];
        // Where the block counter needs more than 32 bits, and at the last case.
        let far = [8 << 32, (8 << 32) - 1, (8 << 32) + 25, u64::MAX - 1, u64::MAX];
        for (seed, key) in [(0, KEY), (1, KEY), (u64::MAX, "modes.m012.damping @ mode"), (5, "")] {
            let stream = Stream::new(seed, key);
            for case in around.into_iter().chain(far) {
                assert_eq!(stream.uniform(case), by_the_book(seed, key, case), "{key} {case}");
            }
        }
    }

    #[test]
    fn test_vectors_pin_the_mapping() {
        // Version 1. A change here changes what every seed yields.
        let found = VECTORS.map(|(seed, key, case, _)| Stream::new(seed, key).uniform(case));
        assert_eq!(found, VECTORS.map(|(_, _, _, u)| u));
    }

    const VECTORS: [(u64, &str, u64, f64); 5] = [
        (0, KEY, 0, 0.811_466_011_913_189_2),
        (1, KEY, 0, 0.903_520_520_201_730_8),
        (1, KEY, 1, 0.133_395_368_394_265_36),
        (1, KEY, 1_999, 0.103_138_991_798_002_68),
        (20_260_101, "common.frequency @ vehicle", u64::MAX, 0.902_590_025_639_963_4),
    ];

    #[test]
    fn a_filled_block_holds_the_uniforms_of_its_cases_wherever_it_starts() {
        let stream = Stream::new(42, KEY);
        for first in [0, 1, 5, 8, 31, 100, u64::MAX - 99] {
            let mut block = [0.0; 100];
            stream.fill(first, &mut block);
            for (i, &u) in block.iter().enumerate() {
                assert_eq!(u, stream.uniform(first + i as u64));
            }
        }
    }

    #[test]
    fn the_interval_is_open_and_symmetric() {
        let (least, most) = (open_uniform(0), open_uniform(u64::MAX));
        assert_eq!(least, 2_f64.powi(-53));
        assert_eq!(most, 1.0 - 2_f64.powi(-53));
        for word in [0, 1 << 12, 0x1234_5678_9abc_def0, 1 << 63, u64::MAX] {
            assert_eq!(open_uniform(word) + open_uniform(!word), 1.0);
        }
    }

    fn hundred_thousand(seed: u64, key: &str) -> Vec<f64> {
        let mut sample = vec![0.0; 100_000];
        Stream::new(seed, key).fill(0, &mut sample);
        sample
    }

    #[test]
    fn uniforms_are_uniform() {
        for (seed, key) in [(0, KEY), (1, KEY), (1, "structure.damping @ vehicle")] {
            let mut sample = hundred_thousand(seed, key);
            sample.sort_by(f64::total_cmp);
            let n = sample.len() as f64;
            let gap = sample.iter().enumerate().map(|(i, u)| (u - (i as f64 + 0.5) / n).abs());
            let distance = gap.fold(0.0, f64::max) * n.sqrt();
            // Kolmogorov-Smirnov: above 2.694 once in a million.
            assert!(distance < 2.694, "{distance}");
        }
    }

    #[test]
    fn neighbouring_keys_seeds_and_cases_share_nothing() {
        let base = hundred_thousand(1, KEY);
        let mut shifted = base.clone();
        shifted.rotate_left(1);
        let others = [
            hundred_thousand(0, KEY),
            hundred_thousand(2, KEY),
            hundred_thousand(1, "booster.right.nozzle.mass @ engine"),
            hundred_thousand(1, "booster.left.nozzle.mass @ engine # a"),
            shifted,
        ];
        for other in others {
            assert!(base.iter().zip(&other).all(|(a, b)| a != b));
            let product: f64 = base.iter().zip(&other).map(|(a, b)| (a - 0.5) * (b - 0.5)).sum();
            // Correlation times √n is standard normal: above 4.9 once in a million.
            let correlation = 12.0 * product / base.len() as f64;
            assert!(correlation.abs() * (base.len() as f64).sqrt() < 4.9, "{correlation}");
        }
    }
}
