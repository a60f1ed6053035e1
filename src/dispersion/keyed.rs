//! A keyed hash of whole numbers and the keyed permutation made from it: random access, no state.
//!
//! For the structure of plans (which stratum, which digit is flipped). Numbers of independent draws
//! come from `stream`.

/// A 256-bit key; every key and every number gives 64 bits that look independent of all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Key([u64; 4]);

impl Key {
    /// The key of a draw key `name` under `seed` for a purpose (a BLAKE3 context) and a replicate:
    /// BLAKE3 `derive_key` over seed, replicate and length of the name (u64, little-endian) and the
    /// name, read as four u64.
    pub fn new(context: &str, seed: u64, replicate: u64, name: &str) -> Self {
        let mut hasher = blake3::Hasher::new_derive_key(context);
        for number in [seed, replicate, name.len() as u64] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(name.as_bytes());
        let bytes: [u8; 32] = hasher.finalize().into();
        let (words, _) = bytes.as_chunks::<8>();
        Self(std::array::from_fn(|i| u64::from_le_bytes(words[i])))
    }

    /// A key of its own for each `number`.
    pub fn child(&self, number: u64) -> Self {
        Self(std::array::from_fn(|i| self.hash(number).wrapping_add(finish(self.0[i]))).map(finish))
    }

    /// 64 bits that look random for each `number`: the key is added before each of four rounds of
    /// SplitMix64's bijection (Steele, Lea and Flood 2014).
    pub fn hash(&self, number: u64) -> u64 {
        self.0.iter().fold(number, |word, key| finish(word.wrapping_add(*key)))
    }
}

fn finish(mut word: u64) -> u64 {
    word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^ (word >> 31)
}

/// Rounds of the Feistel network: four make it pseudorandom (Luby and Rackoff 1988); twice as many,
/// since its halves may have a single bit.
const ROUNDS: u64 = 8;

/// A permutation of 0 … count − 1, evaluated at single places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Permutation {
    key: Key,
    count: u64,
    /// Bits of half a word of the Feistel network.
    half: u32,
}

impl Permutation {
    /// The permutation of `count` numbers, 1 to 2⁶², that belongs to `key`.
    pub fn new(key: Key, count: u64) -> Self {
        debug_assert!((1..=1 << 62).contains(&count));
        let bits = u64::BITS - (count - 1).leading_zeros();
        Self { key, count, half: bits.div_ceil(2).max(1) }
    }

    /// Where `place`, below the count, goes.
    ///
    /// A Feistel network permutes 4^half numbers, at most four times too many (and at least four);
    /// it is walked until it comes back below the count (Black and Rogaway 2002).
    pub fn at(&self, place: u64) -> u64 {
        debug_assert!(place < self.count);
        let mask = (1 << self.half) - 1;
        let mut word = place;
        loop {
            let (mut left, mut right) = (word >> self.half, word & mask);
            for round in 0..ROUNDS {
                let next = left ^ (self.key.hash(right << 3 | round) & mask);
                (left, right) = (right, next);
            }
            word = left << self.half | right;
            if word < self.count {
                return word;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn permutation(number: u64, count: u64) -> Permutation {
        Permutation::new(Key::new("test", 1, 0, "a").child(number), count)
    }

    #[test]
    fn every_place_goes_to_a_place_of_its_own() {
        for count in (1..70).chain([255, 256, 257, 1000, 4097]) {
            let permutation = permutation(count, count);
            let mut seen = vec![false; count as usize];
            (0..count).for_each(|place| seen[permutation.at(place) as usize] = true);
            assert!(seen.iter().all(|seen| *seen), "{count}");
        }
    }

    #[test]
    fn pairs_of_places_go_anywhere_equally_often() {
        // χ² over the 20 pairs of images of (0, 1) of five places: 19 degrees of freedom, beyond 58
        // once in a hundred thousand correct programs.
        let keys = 20_000;
        let mut counts = [[0_u32; 5]; 5];
        for key in 0..keys {
            let permutation = permutation(key, 5);
            counts[permutation.at(0) as usize][permutation.at(1) as usize] += 1;
        }
        let expected = keys as f64 / 20.0;
        let off = |a: usize, b: usize| (f64::from(counts[a][b]) - expected).powi(2) / expected;
        let pairs = (0..5).flat_map(|a| (0..5).map(move |b| (a, b)));
        let chi: f64 = pairs.filter(|(a, b)| a != b).map(|(a, b)| off(a, b)).sum();
        assert!(chi < 58.0, "{chi}");
        assert!((0..5).all(|a| counts[a][a] == 0));
    }

    #[test]
    fn the_last_place_of_a_great_permutation_is_reached_at_once() {
        let permutation = permutation(0, 1 << 62);
        assert!(permutation.at((1 << 62) - 1) < 1 << 62);
    }

    #[test]
    fn keys_differ_in_every_argument() {
        let keys = [
            Key::new("a", 1, 0, "k"),
            Key::new("b", 1, 0, "k"),
            Key::new("a", 2, 0, "k"),
            Key::new("a", 1, 1, "k"),
            Key::new("a", 1, 0, "l"),
            Key::new("a", 1, 0, "k").child(0),
            Key::new("a", 1, 0, "k").child(1),
        ];
        for (i, one) in keys.iter().enumerate() {
            assert!(keys[..i].iter().all(|other| one.hash(0) != other.hash(0)));
        }
    }
}
