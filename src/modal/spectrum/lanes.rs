//! Eight numbers at a time: the one file that knows instruction sets.
//!
//! Kernels are written once over [`Vector`] and compiled for AVX-512, AVX2 with FMA and portable code; which one
//! runs is found out when the program runs. Lanes never mix. The portable form rounds products that the others do
//! not, and AVX-512 has reciprocals of its own: instruction sets agree within the error bounds.
//!
//! The crate's unsafe code is all here; `scripts/nightly` runs its tests under Miri and a sanitizer.
#![cfg_attr(
    target_arch = "x86_64",
    expect(unsafe_code, reason = "instructions that only some processors have")
)]

/// Number of lanes.
pub const WIDTH: usize = 8;

/// Bits of the exponent of a number; those of 2⁵², whose last bits count units; what gives the reciprocal of a power
/// of two.
const EXPONENT_BITS: u64 = 0x7ff0_0000_0000_0000;
const UNIT_BITS: u64 = 0x4330_0000_0000_0000;
const RECIPROCAL_BITS: u64 = 0x7fe0_0000_0000_0000;
/// 2⁵² and the bias of exponents.
const BIAS: f64 = 4_503_599_627_370_496.0 + 1023.0;

/// Eight complex numbers as they lie in memory.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C, align(64))]
pub struct Complexes {
    /// Real parts.
    pub re: [f64; WIDTH],
    /// Imaginary parts.
    pub im: [f64; WIDTH],
}

impl Complexes {
    /// Zeros.
    pub const ZERO: Self = Self { re: [0.0; WIDTH], im: [0.0; WIDTH] };
}

/// Eight real numbers in registers.
pub trait Vector: Copy {
    /// From memory.
    fn load(from: &[f64; WIDTH]) -> Self;
    /// To memory.
    fn store(self, to: &mut [f64; WIDTH]);
    /// One number in every lane.
    fn splat(value: f64) -> Self;
    /// Sum.
    fn add(self, other: Self) -> Self;
    /// Difference.
    fn sub(self, other: Self) -> Self;
    /// Product.
    fn mul(self, other: Self) -> Self;
    /// Quotient.
    fn div(self, other: Self) -> Self;
    /// `self · a + b`.
    fn mul_add(self, a: Self, b: Self) -> Self;
    /// `b − self · a`.
    fn negative_mul_add(self, a: Self, b: Self) -> Self;
    /// Greater of two; the other where one is NaN.
    fn max(self, other: Self) -> Self;
    /// Square root.
    fn sqrt(self) -> Self;
    /// `yes` where this is greater than `other`, else `no`.
    fn where_greater(self, other: Self, yes: Self, no: Self) -> Self;
    /// Whether any lane is greater than that of `other`.
    fn any_greater(self, other: Self) -> bool;
    /// 1/self to two units in the last place, of numbers between 1e-300 and 1e300 in modulus; not finite, or zero, beyond.
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self::splat(1.0).div(self)
    }
    /// The square root of a number that is not negative, or up to a thousandth more: what bounds need. At least 1e-154;
    /// NaN of NaN, NaN or infinite of what is infinite.
    #[inline(always)]
    fn root_above(self) -> Self {
        let least = Self::splat(f64::MIN_POSITIVE);
        least.where_greater(self, least, self).sqrt()
    }
    /// Binary exponent of positive normal numbers below 2¹⁰²³, and the reciprocal of their power of two.
    fn exponent(self) -> (Self, Self);
    /// Absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        self.max(Self::splat(0.0).sub(self))
    }
}

/// Complex numbers in registers.
#[derive(Clone, Copy)]
pub struct Complex<V> {
    /// Real parts.
    pub re: V,
    /// Imaginary parts.
    pub im: V,
}

#[expect(clippy::should_implement_trait, reason = "the names of `Vector`, all inlined")]
impl<V: Vector> Complex<V> {
    /// From memory.
    #[inline(always)]
    pub fn load(from: &Complexes) -> Self {
        Self { re: V::load(&from.re), im: V::load(&from.im) }
    }

    /// To memory.
    #[inline(always)]
    pub fn store(self, to: &mut Complexes) {
        self.re.store(&mut to.re);
        self.im.store(&mut to.im);
    }

    /// One number in every lane.
    #[inline(always)]
    pub fn splat(re: f64, im: f64) -> Self {
        Self { re: V::splat(re), im: V::splat(im) }
    }

    /// Sum.
    #[inline(always)]
    pub fn add(self, other: Self) -> Self {
        Self { re: self.re.add(other.re), im: self.im.add(other.im) }
    }

    /// Difference.
    #[inline(always)]
    pub fn sub(self, other: Self) -> Self {
        Self { re: self.re.sub(other.re), im: self.im.sub(other.im) }
    }

    /// Product.
    #[inline(always)]
    pub fn mul(self, other: Self) -> Self {
        Self {
            re: self.im.negative_mul_add(other.im, self.re.mul(other.re)),
            im: self.im.mul_add(other.re, self.re.mul(other.im)),
        }
    }

    /// `self − a · b`.
    #[inline(always)]
    pub fn subtract_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.mul_add(b.im, a.re.negative_mul_add(b.re, self.re)),
            im: a.im.negative_mul_add(b.re, a.re.negative_mul_add(b.im, self.im)),
        }
    }

    /// `self + a · b`.
    #[inline(always)]
    pub fn add_product(self, a: Self, b: Self) -> Self {
        Self {
            re: a.im.negative_mul_add(b.im, a.re.mul_add(b.re, self.re)),
            im: a.im.mul_add(b.re, a.re.mul_add(b.im, self.im)),
        }
    }

    /// `self + a · b` with real `a`.
    #[inline(always)]
    pub fn add_real_product(self, a: V, b: Self) -> Self {
        Self { re: a.mul_add(b.re, self.re), im: a.mul_add(b.im, self.im) }
    }

    /// Product with a real number.
    #[inline(always)]
    pub fn scale(self, factor: V) -> Self {
        Self { re: self.re.mul(factor), im: self.im.mul(factor) }
    }

    /// `yes` where `a` is greater than `b`, else `no`.
    #[inline(always)]
    pub fn where_greater(a: V, b: V, yes: Self, no: Self) -> Self {
        Self { re: a.where_greater(b, yes.re, no.re), im: a.where_greater(b, yes.im, no.im) }
    }

    /// Square of the modulus.
    #[inline(always)]
    pub fn square(self) -> V {
        self.im.mul_add(self.im, self.re.mul(self.re))
    }

    /// Reciprocal.
    #[inline(always)]
    pub fn reciprocal(self) -> Self {
        let factor = V::splat(1.0).div(self.square());
        Self { re: self.re.mul(factor), im: V::splat(0.0).sub(self.im.mul(factor)) }
    }
}

/// Portable lanes: plain arrays, products and sums each rounded.
#[derive(Clone, Copy)]
pub struct Portable([f64; WIDTH]);

impl Portable {
    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|lane| f(self.0[lane], other.0[lane])))
    }
}

impl Vector for Portable {
    #[inline(always)]
    fn load(from: &[f64; WIDTH]) -> Self {
        Self(*from)
    }
    #[inline(always)]
    fn store(self, to: &mut [f64; WIDTH]) {
        *to = self.0;
    }
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.with(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.with(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.with(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.with(other, |a, b| a / b)
    }
    #[inline(always)]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self.mul(a).add(b)
    }
    #[inline(always)]
    fn negative_mul_add(self, a: Self, b: Self) -> Self {
        b.sub(self.mul(a))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.with(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.with(self, |a, _| a.sqrt())
    }
    #[inline(always)]
    fn where_greater(self, other: Self, yes: Self, no: Self) -> Self {
        let of = |lane: usize| if self.0[lane] > other.0[lane] { yes.0[lane] } else { no.0[lane] };
        Self(std::array::from_fn(of))
    }
    #[inline(always)]
    fn any_greater(self, other: Self) -> bool {
        (0..WIDTH).any(|lane| self.0[lane] > other.0[lane])
    }
    #[inline(always)]
    fn exponent(self) -> (Self, Self) {
        let bits = self.0.map(|value| value.to_bits() & EXPONENT_BITS);
        let exponent = bits.map(|bits| f64::from_bits(bits >> 52 | UNIT_BITS) - BIAS);
        let reciprocal = bits.map(|bits| f64::from_bits(RECIPROCAL_BITS.wrapping_sub(bits)));
        (Self(exponent), Self(reciprocal))
    }
}

/// An instruction set that this machine has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    /// Plain Rust.
    Portable,
    /// AVX2 and FMA.
    #[cfg(target_arch = "x86_64")]
    Avx2(Found),
    /// AVX-512 F.
    #[cfg(target_arch = "x86_64")]
    Avx512(Found),
}

/// Proof that an instruction set was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Found(());

impl Level {
    /// Every level of this machine, the fastest first.
    pub fn all() -> Vec<Self> {
        let mut levels = Vec::new();
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if avx2 && is_x86_feature_detected!("avx512f") {
                levels.push(Self::Avx512(Found(())));
            }
            if avx2 {
                levels.push(Self::Avx2(Found(())));
            }
        }
        levels.push(Self::Portable);
        levels
    }

    /// The fastest level of this machine.
    pub fn best() -> Self {
        Self::all()[0]
    }
}

/// Work that is done in lanes.
pub trait Kernel {
    /// What comes out.
    type Output;
    /// The work; implementations are `#[inline(always)]`.
    fn run<V: Vector>(self) -> Self::Output;
}

impl Level {
    /// Runs a kernel compiled for this level.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        match self {
            Self::Portable => kernel.run::<Portable>(),
            // SAFETY: `Found` is made only where the processor was asked for the features.
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => unsafe { x86::avx2(kernel) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => unsafe { x86::avx512(kernel) },
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{BIAS, EXPONENT_BITS, Kernel, RECIPROCAL_BITS, UNIT_BITS, Vector, WIDTH};
    use std::arch::x86_64::*;

    /// # Safety
    /// The processor has AVX2 and FMA.
    #[target_feature(enable = "avx2,fma")]
    pub unsafe fn avx2<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx2>()
    }

    /// # Safety
    /// The processor has AVX-512 F, AVX2 and FMA.
    #[target_feature(enable = "avx512f,avx2,fma")]
    pub unsafe fn avx512<K: Kernel>(kernel: K) -> K::Output {
        kernel.run::<Avx512>()
    }

    /// Two registers of four; made only inside [`avx2`].
    #[derive(Clone, Copy)]
    pub struct Avx2(__m256d, __m256d);

    /// One register of eight; made only inside [`avx512`].
    #[derive(Clone, Copy)]
    pub struct Avx512(__m512d);

    // SAFETY of what follows: values of these types are made only by kernels that run inside the two
    // functions above, whose processor has the instructions. Loads and stores are unaligned ones within an array of
    // eight.
    impl Vector for Avx2 {
        #[inline(always)]
        fn load(from: &[f64; WIDTH]) -> Self {
            unsafe { Self(_mm256_loadu_pd(from.as_ptr()), _mm256_loadu_pd(from[4..].as_ptr())) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64; WIDTH]) {
            let (low, high) = to.split_at_mut(4);
            unsafe {
                _mm256_storeu_pd(low.as_mut_ptr(), self.0);
                _mm256_storeu_pd(high.as_mut_ptr(), self.1);
            }
        }
        #[inline(always)]
        fn splat(value: f64) -> Self {
            unsafe { Self(_mm256_set1_pd(value), _mm256_set1_pd(value)) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Self(_mm256_add_pd(self.0, other.0), _mm256_add_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Self(_mm256_sub_pd(self.0, other.0), _mm256_sub_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Self(_mm256_mul_pd(self.0, other.0), _mm256_mul_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { Self(_mm256_div_pd(self.0, other.0), _mm256_div_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm256_fmadd_pd(self.0, a.0, b.0), _mm256_fmadd_pd(self.1, a.1, b.1)) }
        }
        #[inline(always)]
        fn negative_mul_add(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm256_fnmadd_pd(self.0, a.0, b.0), _mm256_fnmadd_pd(self.1, a.1, b.1)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Self(_mm256_max_pd(self.0, other.0), _mm256_max_pd(self.1, other.1)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { Self(_mm256_sqrt_pd(self.0), _mm256_sqrt_pd(self.1)) }
        }
        #[inline(always)]
        fn exponent(self) -> (Self, Self) {
            let (low, high) = (exponent_of_four(self.0), exponent_of_four(self.1));
            (Self(low.0, high.0), Self(low.1, high.1))
        }
        #[inline(always)]
        fn where_greater(self, other: Self, yes: Self, no: Self) -> Self {
            unsafe {
                let low = _mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0);
                let high = _mm256_cmp_pd::<_CMP_GT_OQ>(self.1, other.1);
                Self(_mm256_blendv_pd(no.0, yes.0, low), _mm256_blendv_pd(no.1, yes.1, high))
            }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe {
                let sign = _mm256_set1_pd(-0.0);
                Self(_mm256_andnot_pd(sign, self.0), _mm256_andnot_pd(sign, self.1))
            }
        }
        #[inline(always)]
        fn any_greater(self, other: Self) -> bool {
            unsafe {
                let low = _mm256_cmp_pd::<_CMP_GT_OQ>(self.0, other.0);
                let high = _mm256_cmp_pd::<_CMP_GT_OQ>(self.1, other.1);
                _mm256_movemask_pd(_mm256_or_pd(low, high)) != 0
            }
        }
    }

    #[inline(always)]
    fn exponent_of_four(value: __m256d) -> (__m256d, __m256d) {
        unsafe {
            let of = |bits: u64| _mm256_set1_epi64x(bits as i64);
            let bits = _mm256_and_si256(_mm256_castpd_si256(value), of(EXPONENT_BITS));
            let units = _mm256_or_si256(_mm256_srli_epi64::<52>(bits), of(UNIT_BITS));
            let exponent = _mm256_sub_pd(_mm256_castsi256_pd(units), _mm256_set1_pd(BIAS));
            (exponent, _mm256_castsi256_pd(_mm256_sub_epi64(of(RECIPROCAL_BITS), bits)))
        }
    }

    impl Vector for Avx512 {
        #[inline(always)]
        fn load(from: &[f64; WIDTH]) -> Self {
            unsafe { Self(_mm512_loadu_pd(from.as_ptr())) }
        }
        #[inline(always)]
        fn store(self, to: &mut [f64; WIDTH]) {
            unsafe { _mm512_storeu_pd(to.as_mut_ptr(), self.0) }
        }
        #[inline(always)]
        fn splat(value: f64) -> Self {
            unsafe { Self(_mm512_set1_pd(value)) }
        }
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            unsafe { Self(_mm512_add_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            unsafe { Self(_mm512_sub_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            unsafe { Self(_mm512_mul_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            unsafe { Self(_mm512_div_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn mul_add(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fmadd_pd(self.0, a.0, b.0)) }
        }
        #[inline(always)]
        fn negative_mul_add(self, a: Self, b: Self) -> Self {
            unsafe { Self(_mm512_fnmadd_pd(self.0, a.0, b.0)) }
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            unsafe { Self(_mm512_max_pd(self.0, other.0)) }
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            unsafe { Self(_mm512_sqrt_pd(self.0)) }
        }
        #[inline(always)]
        fn exponent(self) -> (Self, Self) {
            unsafe {
                let of = |bits: u64| _mm512_set1_epi64(bits as i64);
                let bits = _mm512_and_si512(_mm512_castpd_si512(self.0), of(EXPONENT_BITS));
                let units = _mm512_or_si512(_mm512_srli_epi64::<52>(bits), of(UNIT_BITS));
                let exponent = _mm512_sub_pd(_mm512_castsi512_pd(units), _mm512_set1_pd(BIAS));
                let reciprocal = _mm512_sub_epi64(of(RECIPROCAL_BITS), bits);
                (Self(exponent), Self(_mm512_castsi512_pd(reciprocal)))
            }
        }
        #[inline(always)]
        fn where_greater(self, other: Self, yes: Self, no: Self) -> Self {
            unsafe {
                let greater = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0);
                Self(_mm512_mask_blend_pd(greater, no.0, yes.0))
            }
        }
        #[inline(always)]
        fn any_greater(self, other: Self) -> bool {
            unsafe { _mm512_cmp_pd_mask::<_CMP_GT_OQ>(self.0, other.0) != 0 }
        }
        #[inline(always)]
        fn abs(self) -> Self {
            unsafe { Self(_mm512_abs_pd(self.0)) }
        }
        /// Newton's iteration twice, from 14 bits.
        #[inline(always)]
        fn reciprocal(self) -> Self {
            unsafe {
                let one = _mm512_set1_pd(1.0);
                let mut reciprocal = _mm512_rcp14_pd(self.0);
                for _ in 0..2 {
                    let lacking = _mm512_fnmadd_pd(self.0, reciprocal, one);
                    reciprocal = _mm512_fmadd_pd(reciprocal, lacking, reciprocal);
                }
                Self(reciprocal)
            }
        }
        /// From 14 bits of the reciprocal root.
        #[inline(always)]
        fn root_above(self) -> Self {
            unsafe {
                // The second operand where one is NaN.
                let value = _mm512_max_pd(_mm512_set1_pd(f64::MIN_POSITIVE), self.0);
                let root = _mm512_mul_pd(value, _mm512_rsqrt14_pd(value));
                Self(_mm512_mul_pd(root, _mm512_set1_pd(1.0 + 1.0 / 8192.0)))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use faer::c64;
    use std::array::from_fn;

    /// Numbers whose sums, products and comparisons meet every special case.
    const NUMBERS: [f64; 16] = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        1.0 + f64::EPSILON,
        1.0 - f64::EPSILON,
        0.1,
        -3.7,
        1e-160,
        -1e160,
        f64::MIN_POSITIVE,
        -5e-324,
        f64::MAX,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::NAN,
    ];

    /// All triples of them, eight at a time; some where an interpreter runs this.
    fn triples() -> impl Iterator<Item = [[f64; WIDTH]; 3]> {
        let groups = (0..NUMBERS.len().pow(3) / WIDTH).step_by(if cfg!(miri) { 31 } else { 1 });
        let number = |triple: usize, operand: u32| NUMBERS[triple / 16_usize.pow(operand) % 16];
        let of =
            move |group| [0, 1, 2].map(|operand| from_fn(|i| number(group * WIDTH + i, operand)));
        groups.map(of)
    }

    #[inline(always)]
    fn stored<V: Vector>(value: V) -> [f64; WIDTH] {
        let mut to = [0.0; WIDTH];
        value.store(&mut to);
        to
    }

    /// The same bits, or no number both.
    fn same(a: f64, b: f64) -> bool {
        a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
    }

    /// Levels whose comparisons run here: Miri has those of AVX2, not of AVX-512.
    fn comparing() -> impl Iterator<Item = Level> {
        let all = Level::all().into_iter();
        #[cfg(all(miri, target_arch = "x86_64"))]
        let all = all.filter(|level| !matches!(level, Level::Avx512(_)));
        all
    }

    struct Arithmetic([[f64; WIDTH]; 3]);

    impl Kernel for Arithmetic {
        type Output = [[f64; WIDTH]; 8];

        #[inline(always)]
        fn run<V: Vector>(self) -> Self::Output {
            let [a, b, c] = self.0.each_ref().map(V::load);
            [
                V::splat(self.0[0][0]),
                a.add(b),
                a.sub(b),
                a.mul(b),
                a.div(b),
                a.sqrt(),
                a.mul_add(b, c),
                a.negative_mul_add(b, c),
            ]
            .map(stored)
        }
    }

    #[test]
    fn arithmetic_in_lanes_has_the_bits_of_plain_arithmetic_on_every_level() {
        for level in Level::all() {
            let fused = level != Level::Portable;
            for triple in triples() {
                let found = level.run(Arithmetic(triple));
                for lane in 0..WIDTH {
                    let [a, b, c] = triple.map(|operand| operand[lane]);
                    let expected = [
                        triple[0][0],
                        a + b,
                        a - b,
                        a * b,
                        a / b,
                        a.sqrt(),
                        if fused { a.mul_add(b, c) } else { a * b + c },
                        if fused { (-a).mul_add(b, c) } else { c - a * b },
                    ];
                    for (method, expected) in expected.into_iter().enumerate() {
                        let found = found[method][lane];
                        assert!(
                            same(found, expected),
                            "{level:?}, method {method} of {a:e}, {b:e}, {c:e}: {found:e}, not {expected:e}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn products_within_sums_are_rounded_by_the_portable_level_alone() {
        // (1 + ε)(1 − ε) = 1 − ε².
        let triple = [1.0 + f64::EPSILON, 1.0 - f64::EPSILON, -1.0].map(|value| [value; WIDTH]);
        for level in Level::all() {
            let left = if level == Level::Portable { 0.0 } else { -f64::EPSILON * f64::EPSILON };
            let [.., sum, _] = level.run(Arithmetic(triple));
            assert_eq!(sum, [left; WIDTH], "{level:?}");
            let [.., difference] = level.run(Arithmetic([triple[0], triple[1], [1.0; WIDTH]]));
            assert_eq!(difference, [-left; WIDTH], "{level:?}");
        }
    }

    struct Comparison([[f64; WIDTH]; 3]);

    impl Kernel for Comparison {
        type Output = [[f64; WIDTH]; 4];

        #[inline(always)]
        fn run<V: Vector>(self) -> Self::Output {
            let [a, b, c] = self.0.each_ref().map(V::load);
            let (yes, no) = (Complex { re: c, im: a }, Complex { re: b, im: c });
            let chosen = Complex::where_greater(a, b, yes, no);
            [a.max(b), a.abs(), chosen.re, chosen.im].map(stored)
        }
    }

    #[test]
    fn comparisons_take_the_other_number_where_one_is_none_on_every_level() {
        for level in comparing() {
            for triple in triples() {
                let found = level.run(Comparison(triple));
                for lane in 0..WIDTH {
                    let [a, b, c] = triple.map(|operand| operand[lane]);
                    let (most, chosen) = if a > b { (a, [c, a]) } else { (b, [b, c]) };
                    let expected = [most, a.abs(), chosen[0], chosen[1]];
                    for (method, expected) in expected.into_iter().enumerate() {
                        let found = found[method][lane];
                        assert!(
                            same(found, expected),
                            "{level:?}, method {method} of {a:e}, {b:e}, {c:e}: {found:e}, not {expected:e}"
                        );
                    }
                }
            }
        }
    }

    struct Estimates([[f64; WIDTH]; 2]);

    impl Kernel for Estimates {
        type Output = ([[f64; WIDTH]; 2], bool);

        #[inline(always)]
        fn run<V: Vector>(self) -> Self::Output {
            let [a, b] = self.0.each_ref().map(V::load);
            ([a.reciprocal(), a.root_above()].map(stored), a.any_greater(b))
        }
    }

    #[test]
    fn reciprocals_and_roots_above_are_what_they_promise_on_every_level() {
        for level in comparing() {
            for exponent in (-300..=300).step_by(if cfg!(miri) { 60 } else { 1 }) {
                let power = 10_f64.powi(exponent);
                let values = from_fn(|i| power * (1.0 + 0.37 * i as f64));
                let ([reciprocals, roots], _) = level.run(Estimates([values; 2]));
                for lane in 0..WIDTH {
                    let error = reciprocals[lane].mul_add(values[lane], -1.0);
                    assert!(error.abs() <= 2.0 * f64::EPSILON, "{level:?} {:e}", values[lane]);
                    let ratio = roots[lane] / values[lane].sqrt();
                    assert!((1.0..1.001).contains(&ratio), "{level:?} {:e}", values[lane]);
                }
            }
            let special = [0.0, 1e-320, f64::NAN, f64::INFINITY, 1.0, 4.0, 9.0, 16.0];
            let ([reciprocals, roots], _) = level.run(Estimates([special; 2]));
            assert!(roots[..2].iter().all(|root| *root > 0.0 && *root < 1e-150), "{level:?}");
            assert!(!roots[2].is_finite() && !roots[3].is_finite(), "{level:?}");
            assert!(!reciprocals[0].is_finite() && !reciprocals[2].is_finite(), "{level:?}");
        }
    }

    #[test]
    fn one_greater_lane_is_found_wherever_it_is() {
        for level in comparing() {
            let of = |a, b| level.run(Estimates([a, b])).1;
            assert!(!of([1.0; WIDTH], [1.0; WIDTH]) && !of([f64::NAN; WIDTH], [1.0; WIDTH]));
            for lane in 0..WIDTH {
                let mut one = [1.0; WIDTH];
                one[lane] = 2.0;
                assert!(of(one, [1.0; WIDTH]) && !of([1.0; WIDTH], one), "{level:?} {lane}");
            }
        }
    }

    struct Exponent([f64; WIDTH]);

    impl Kernel for Exponent {
        type Output = [[f64; WIDTH]; 2];

        #[inline(always)]
        fn run<V: Vector>(self) -> Self::Output {
            let (exponent, reciprocal) = V::load(&self.0).exponent();
            [stored(exponent), stored(reciprocal)]
        }
    }

    #[test]
    fn exponents_and_reciprocal_powers_of_two_are_exact_on_every_level() {
        let power = |exponent: i64| f64::from_bits(((exponent + 1023) as u64) << 52);
        let mantissas: [f64; WIDTH] =
            from_fn(|i| 1.0 + i as f64 / 8.0 + f64::EPSILON * (i % 2) as f64);
        for level in Level::all() {
            for exponent in (-1022..1023).step_by(if cfg!(miri) { 146 } else { 1 }) {
                let values = mantissas.map(|mantissa| mantissa * power(exponent));
                let expected = [[exponent as f64; WIDTH], [power(-exponent); WIDTH]];
                assert_eq!(level.run(Exponent(values)), expected, "{level:?} {exponent}");
            }
        }
    }

    fn pack(values: [c64; WIDTH]) -> Complexes {
        Complexes { re: values.map(|z| z.re), im: values.map(|z| z.im) }
    }

    struct ComplexArithmetic([Complexes; 3]);

    impl Kernel for ComplexArithmetic {
        type Output = [Complexes; 10];

        #[inline(always)]
        fn run<V: Vector>(self) -> Self::Output {
            let [a, b, c] = self.0.each_ref().map(Complex::<V>::load);
            let results = [
                Complex::splat(2.0, -3.0),
                a.add(b),
                a.sub(b),
                a.mul(b),
                c.subtract_product(a, b),
                c.add_product(a, b),
                c.add_real_product(a.re, b),
                a.scale(b.im),
                Complex { re: a.square(), im: a.im },
                a.reciprocal(),
            ];
            results.map(|result| {
                let mut to = Complexes::ZERO;
                result.store(&mut to);
                to
            })
        }
    }

    #[test]
    fn complex_numbers_without_rounding_are_those_of_plain_arithmetic_on_every_level() {
        // Squares are powers of two, so that reciprocals are exact too.
        let a = [(1, 0), (0, -1), (1, 1), (-1, 1), (2, 2), (0, 4), (-4, 0), (2, -2)];
        let a = a.map(|(re, im)| c64::new(f64::from(re), f64::from(im)));
        let b: [c64; WIDTH] = from_fn(|i| c64::new(i as f64 - 3.0, 2.0 * i as f64 + 1.0));
        let c: [c64; WIDTH] = from_fn(|i| c64::new(5.0 - i as f64, 7.0 * i as f64));
        for level in Level::all() {
            let found = level.run(ComplexArithmetic([a, b, c].map(pack)));
            let each = |f: &dyn Fn(c64, c64, c64) -> c64| pack(from_fn(|i| f(a[i], b[i], c[i])));
            let expected = [
                each(&|_, _, _| c64::new(2.0, -3.0)),
                each(&|a, b, _| a + b),
                each(&|a, b, _| a - b),
                each(&|a, b, _| a * b),
                each(&|a, b, c| c - a * b),
                each(&|a, b, c| c + a * b),
                each(&|a, b, c| c + a.re * b),
                each(&|a, b, _| a * b.im),
                each(&|a, _, _| c64::new(a.norm_sqr(), a.im)),
                each(&|a, _, _| a.inv()),
            ];
            assert_eq!(found, expected, "{level:?}");
        }
    }

    struct Copied<'a>(&'a [f64; WIDTH], &'a mut [f64; WIDTH]);

    impl Kernel for Copied<'_> {
        type Output = ();

        #[inline(always)]
        fn run<V: Vector>(self) {
            V::load(self.0).store(self.1);
        }
    }

    #[test]
    fn arrays_at_any_address_are_copied_and_their_neighbours_left_alone() {
        let from: Vec<f64> = (0..24).map(f64::from).collect();
        for level in Level::all() {
            for first in 0..=16 {
                let mut to = vec![-1.0; 24];
                let here = first..first + WIDTH;
                let source = from[here.clone()].try_into().expect("eight numbers");
                let target = (&mut to[here.clone()]).try_into().expect("eight numbers");
                level.run(Copied(source, target));
                for (at, value) in to.into_iter().enumerate() {
                    let expected = if here.contains(&at) { from[at] } else { -1.0 };
                    assert_eq!(value, expected, "{level:?} {first} {at}");
                }
            }
        }
    }

    #[test]
    fn every_machine_has_the_portable_level_and_none_is_faster_than_the_first() {
        let levels = Level::all();
        assert_eq!(levels.last(), Some(&Level::Portable));
        assert_eq!(levels[0], Level::best());
        #[cfg(target_arch = "x86_64")]
        {
            let avx512 = levels.iter().position(|level| matches!(level, Level::Avx512(_)));
            let avx2 = levels.iter().position(|level| matches!(level, Level::Avx2(_)));
            assert!(avx512.is_none_or(|at| at == 0 && avx2 == Some(1)));
        }
    }
}
