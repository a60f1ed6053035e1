//! Zeros and maxima of a function of one variable inside a bracket.
//!
//! Each evaluation is a frequency response: both methods count on few. Neither knows a loop.

/// Most evaluations of a search: twice what halving the bracket to the last bit would need.
const EVALUATIONS: usize = 120;

/// A zero of `f` between `a` and `b`, where `f` has the values `fa` and `fb` of opposite sign, to
/// `tolerance`: by inverse quadratic interpolation, or halving where that is not trustworthy
/// (Chandrupatla, Advances in Engineering Software 28, 1997). An error of `f` is passed on.
pub(super) fn zero<E>(
    [mut a, mut b]: [f64; 2],
    [mut fa, mut fb]: [f64; 2],
    tolerance: f64,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let mut fraction = 0.5;
    for _ in 0..EVALUATIONS {
        if fa == 0.0 {
            return Ok(a);
        }
        if fb == 0.0 || !((b - a).abs() > tolerance) {
            return Ok(b);
        }
        let x = a + fraction * (b - a);
        let fx = f(x)?;
        // The zero lies between x and the end of the other sign; c is the end left out.
        let (c, fc);
        if (fx > 0.0) == (fa > 0.0) {
            (c, fc) = (a, fa);
        } else {
            (c, fc) = (b, fb);
            (b, fb) = (a, fa);
        }
        (a, fa) = (x, fx);
        let (xi, phi) = ((a - b) / (c - b), (fa - fb) / (fc - fb));
        fraction = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        let least = (0.5 * tolerance / (b - a).abs()).min(0.5);
        fraction = fraction.clamp(least, 1.0 - least);
    }
    Ok(if fa.abs() < fb.abs() { a } else { b })
}

/// The place in (`a`, `b`) of a local maximum of `f`, and the value there, from a start inside that
/// is no less than the ends, to `tolerance`: by parabolas, or golden sections where these do not
/// shrink (Brent, "Algorithms for Minimization without Derivatives", 1973, chapter 5).
pub(super) fn maximum<E>(
    [mut a, mut b]: [f64; 2],
    (start, value): (f64, f64),
    tolerance: f64,
    mut f: impl FnMut(f64) -> Result<f64, E>,
) -> Result<(f64, f64), E> {
    const GOLDEN: f64 = 0.381_966_011_250_105;
    // Best, second best, and the second best before.
    let [mut x, mut w, mut v] = [start; 3];
    let [mut fx, mut fw, mut fv] = [value; 3];
    let (mut step, mut before) = (0.0_f64, 0.0_f64);
    for _ in 0..EVALUATIONS {
        let middle = 0.5 * (a + b);
        if !((x - middle).abs() > 2.0 * tolerance - 0.5 * (b - a)) {
            break;
        }
        let r = (x - w) * (fx - fv);
        let q = (x - v) * (fx - fw);
        let (p, q) = ((x - v) * q - (x - w) * r, 2.0 * (q - r));
        let parabola = if q > 0.0 { -p } else { p } / q.abs();
        let trusted = parabola.is_finite()
            && parabola.abs() < 0.5 * before.abs()
            && x + parabola > a + tolerance
            && x + parabola < b - tolerance;
        before = step;
        if trusted {
            step = parabola;
        } else {
            before = if x < middle { b - x } else { a - x };
            step = GOLDEN * before;
        }
        let u = x + if step.abs() < tolerance { tolerance.copysign(step) } else { step };
        let fu = f(u)?;
        if fu >= fx {
            if u < x {
                b = x
            } else {
                a = x
            }
            (v, w, x) = (w, x, u);
            (fv, fw, fx) = (fw, fx, fu);
        } else {
            if u < x {
                a = u
            } else {
                b = u
            }
            if fu >= fw || w == x {
                (v, w) = (w, u);
                (fv, fw) = (fw, fu);
            } else if fu >= fv || v == x || v == w {
                (v, fv) = (u, fu);
            }
        }
    }
    Ok((x, fx))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    fn counted(
        f: impl Fn(f64) -> f64,
        count: &mut usize,
    ) -> impl FnMut(f64) -> Result<f64, Infallible> {
        move |x| {
            *count += 1;
            Ok(f(x))
        }
    }

    #[test]
    fn a_zero_is_found_with_few_evaluations() {
        for (f, bracket, expected) in [
            ((|x| x * x - 2.0) as fn(f64) -> f64, [0.0, 2.0], std::f64::consts::SQRT_2),
            (|x| 2.0 - x * x, [0.0, 2.0], std::f64::consts::SQRT_2),
            (|x| x.exp() - 1e-6, [-30.0, 5.0], -13.815_510_557_964_274),
            (|x| (x - 1.0).powi(3), [0.0, 2.5], 1.0),
        ] {
            let mut count = 0;
            let ends = [f(bracket[0]), f(bracket[1])];
            let Ok(found) = zero(bracket, ends, 1e-12, counted(f, &mut count));
            assert!((found - expected).abs() < 2e-12 || f(found) == 0.0, "{found}");
            assert!(count <= 60, "{count}");
        }
        let mut count = 0;
        let smooth = |x: f64| x.cos();
        let Ok(_) =
            zero([1.0, 2.0], [smooth(1.0), smooth(2.0)], 1e-12, counted(smooth, &mut count));
        assert!(count <= 9, "{count}");
    }

    #[test]
    fn a_maximum_is_found_with_few_evaluations() {
        let lorentzian = |x: f64| 1.0 / (1e-6 + (x - 0.3).powi(2));
        let mut count = 0;
        let start = (0.3004, lorentzian(0.3004));
        let Ok((at, value)) = maximum([0.299, 0.301], start, 1e-9, counted(lorentzian, &mut count));
        assert!((at - 0.3).abs() < 1e-8 && (value / 1e6 - 1.0).abs() < 1e-9, "{at} {value}");
        assert!(count <= 40, "{count}");
        // At the edge of the bracket.
        let Ok((at, _)) = maximum([0.0, 1.0], (0.5, 0.5), 1e-9, Ok::<_, Infallible>);
        assert!(at > 1.0 - 1e-8);
    }
}
