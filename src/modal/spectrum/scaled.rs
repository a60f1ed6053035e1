//! Complex numbers with an exponent of their own: products of hundreds of factors that neither overflow nor
//! vanish.

use super::lanes::{Complex, Complexes, Vector, WIDTH};
use faer::c64;

/// `mantissa · 2^exponent`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scaled {
    /// Mantissa; near one in modulus after each operation.
    pub mantissa: c64,
    /// Power of two.
    pub exponent: i64,
}

/// Modulus of a number whose square is in range; many times faster than where it may not be.
pub fn modulus(z: c64) -> f64 {
    z.norm_sqr().sqrt()
}

/// Binary exponent of a normal number.
fn exponent(value: f64) -> i64 {
    ((value.to_bits() >> 52) & 0x7ff) as i64 - 1023
}

/// `2^power`, zero or infinite outside the range of normal numbers.
fn power_of_two(power: i64) -> f64 {
    match power {
        ..-1022 => 0.0,
        1024.. => f64::INFINITY,
        _ => f64::from_bits(((power + 1023) as u64) << 52),
    }
}

impl Scaled {
    /// One.
    pub const ONE: Self = Self { mantissa: c64::new(1.0, 0.0), exponent: 0 };

    /// The number with its mantissa near one.
    fn normalised(self) -> Self {
        let size = self.mantissa.re.abs().max(self.mantissa.im.abs());
        if !(size > 0.0 && size.is_finite()) {
            return self;
        }
        let power = exponent(size);
        let factor = power_of_two(-power);
        if !(factor.is_finite() && factor > 0.0) {
            return self;
        }
        Self { mantissa: self.mantissa * factor, exponent: self.exponent + power }
    }

    /// Product with a number.
    pub fn times(self, factor: c64) -> Self {
        Self { mantissa: self.mantissa * factor, ..self }.normalised()
    }

    /// Quotient.
    pub fn over(self, other: Self) -> Self {
        let exponent = self.exponent - other.exponent;
        Self { mantissa: self.mantissa / other.mantissa, exponent }.normalised()
    }

    /// Times a power of two.
    pub fn shifted(self, exponent: i64) -> Self {
        Self { exponent: self.exponent + exponent, ..self }
    }

    /// The number itself, zero or infinite where it is out of range.
    pub fn value(self) -> c64 {
        self.mantissa * power_of_two(self.exponent)
    }
}

/// Eight products at once.
pub struct Product<V> {
    value: Complex<V>,
    exponent: V,
    /// Factors since the exponents were last taken out.
    factors: u32,
}

impl<V: Vector> Product<V> {
    /// Ones.
    #[inline(always)]
    pub fn new() -> Self {
        Self { value: Complex::splat(1.0, 0.0), exponent: V::splat(0.0), factors: 0 }
    }

    /// Product with factors between 1e-30 and 1e30 in modulus.
    #[inline(always)]
    pub fn times(&mut self, factor: Complex<V>) {
        self.value = self.value.mul(factor);
        self.factors += 1;
        if self.factors >= 8 {
            self.normalise();
        }
    }

    /// Product with two such factors: half the chain of roundings to wait for.
    #[inline(always)]
    pub fn times_both(&mut self, a: Complex<V>, b: Complex<V>) {
        self.value = self.value.mul(a.mul(b));
        self.factors += 2;
        if self.factors >= 8 {
            self.normalise();
        }
    }

    /// Product with such real factors.
    #[inline(always)]
    pub fn times_real(&mut self, factor: V) {
        self.value = self.value.scale(factor);
        self.factors += 1;
        if self.factors >= 8 {
            self.normalise();
        }
    }

    #[inline(always)]
    fn normalise(&mut self) {
        let (exponent, reciprocal) = self.value.re.abs().max(self.value.im.abs()).exponent();
        self.value = self.value.scale(reciprocal);
        self.exponent = self.exponent.add(exponent);
        self.factors = 0;
    }

    /// The products.
    #[inline(always)]
    pub fn finish(mut self) -> [Scaled; WIDTH] {
        self.normalise();
        let (mut value, mut exponent) = (Complexes::ZERO, [0.0; WIDTH]);
        self.value.store(&mut value);
        self.exponent.store(&mut exponent);
        std::array::from_fn(|lane| Scaled {
            mantissa: c64::new(value.re[lane], value.im[lane]),
            exponent: exponent[lane] as i64,
        })
    }
}
