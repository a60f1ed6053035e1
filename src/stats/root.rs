//! The zero of an increasing function, by Newton steps inside a shrinking bracket.
//!
//! Only for the monotone distribution functions of this module.

/// Zero of an increasing function in (`lower`, `upper`); `f` returns value and slope.
///
/// Where the Newton step leaves the bracket, or value or slope is not finite, the bracket is halved.
pub(super) fn of_increasing(lower: f64, upper: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let (mut lower, mut upper) = (lower, upper);
    let mut x = 0.5 * (lower + upper);
    // Halving alone reaches the last bit of any double in the unit interval's useful range within
    // this count; Newton needs under ten.
    for _ in 0..200 {
        let (value, slope) = f(x);
        if value == 0.0 {
            return x;
        }
        if value > 0.0 {
            upper = x;
        } else {
            lower = x;
        }
        let newton = x - value / slope;
        let next = if newton > lower && newton < upper { newton } else { 0.5 * (lower + upper) };
        if (next - x).abs() <= f64::EPSILON * x.abs() {
            return next;
        }
        x = next;
    }
    x
}
