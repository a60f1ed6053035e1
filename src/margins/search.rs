//! Zeros and maxima of functions of one variable inside brackets, many searches side by side.
//!
//! Each evaluation is a frequency response, and several cost little more than one: all searches ask for their
//! next place together. Neither knows a loop.

/// Most evaluations of a search: twice what halving the bracket to the last bit would need.
const EVALUATIONS: usize = 120;

/// A search in progress.
#[derive(Debug, Clone)]
pub(super) enum Search {
    /// For a zero.
    Zero(Zero),
    /// For a maximum.
    Maximum(Maximum),
}

impl Search {
    /// For a zero between the ends of the bracket, whose values are of opposite sign, to `tolerance`.
    pub(super) fn zero([a, b]: [f64; 2], [fa, fb]: [f64; 2], tolerance: f64) -> Self {
        Self::Zero(Zero { a, b, fa, fb, fraction: 0.5, tolerance })
    }

    /// For a local maximum inside the bracket, from a start inside that is no less than the ends, to
    /// `tolerance`.
    pub(super) fn maximum([a, b]: [f64; 2], (x, fx): (f64, f64), tolerance: f64) -> Self {
        let at = [(x, fx); 3];
        Self::Maximum(Maximum { a, b, best: at, step: 0.0, before: 0.0, u: x, tolerance })
    }

    /// The next place at which the function is wanted; none at the end.
    fn ask(&mut self) -> Option<f64> {
        match self {
            Self::Zero(zero) => zero.ask(),
            Self::Maximum(maximum) => maximum.ask(),
        }
    }

    /// Takes the value at the place asked for.
    fn tell(&mut self, value: f64) {
        match self {
            Self::Zero(zero) => zero.tell(value),
            Self::Maximum(maximum) => maximum.tell(value),
        }
    }

    /// The place found.
    fn found(&self) -> f64 {
        match self {
            Self::Zero(zero) => zero.found(),
            Self::Maximum(maximum) => maximum.best[0].0,
        }
    }
}

/// Runs all searches and gives what is at the places found. `at` is asked for several places at a time; `value` is the
/// function of each search, by its number. An error of `at` is passed on.
pub(super) fn run<T: Clone, E>(
    searches: &mut [Search],
    mut at: impl FnMut(&[f64]) -> Result<Vec<T>, E>,
    value: impl Fn(usize, &T) -> f64,
) -> Result<Vec<T>, E> {
    for _ in 0..EVALUATIONS {
        let asked: Vec<(usize, f64)> = (searches.iter_mut().enumerate())
            .filter_map(|(index, search)| Some((index, search.ask()?)))
            .collect();
        if asked.is_empty() {
            break;
        }
        let places: Vec<f64> = asked.iter().map(|(_, place)| *place).collect();
        for ((index, _), found) in asked.iter().zip(at(&places)?) {
            searches[*index].tell(value(*index, &found));
        }
    }
    at(&searches.iter().map(Search::found).collect::<Vec<f64>>())
}

/// A zero by inverse quadratic interpolation, or halving where that is not trustworthy (Chandrupatla,
/// Advances in Engineering Software 28, 1997).
#[derive(Debug, Clone)]
pub(super) struct Zero {
    a: f64,
    b: f64,
    fa: f64,
    fb: f64,
    fraction: f64,
    tolerance: f64,
}

impl Zero {
    fn ask(&self) -> Option<f64> {
        let at_end = self.fa == 0.0 || self.fb == 0.0;
        let narrow = !((self.b - self.a).abs() > self.tolerance);
        (!at_end && !narrow).then_some(self.a + self.fraction * (self.b - self.a))
    }

    fn tell(&mut self, fx: f64) {
        let x = self.a + self.fraction * (self.b - self.a);
        // The zero lies between x and the end of the other sign; c is the end left out.
        let (c, fc);
        if (fx > 0.0) == (self.fa > 0.0) {
            (c, fc) = (self.a, self.fa);
        } else {
            (c, fc) = (self.b, self.fb);
            (self.b, self.fb) = (self.a, self.fa);
        }
        (self.a, self.fa) = (x, fx);
        let Self { a, b, fa, fb, tolerance, .. } = *self;
        let (xi, phi) = ((a - b) / (c - b), (fa - fb) / (fc - fb));
        let fraction = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        } else {
            0.5
        };
        let least = (0.5 * tolerance / (b - a).abs()).min(0.5);
        self.fraction = fraction.clamp(least, 1.0 - least);
    }

    fn found(&self) -> f64 {
        let Self { a, b, fa, fb, .. } = *self;
        let narrow = !((b - a).abs() > self.tolerance);
        if fa == 0.0 || (fb != 0.0 && !narrow && fa.abs() < fb.abs()) { a } else { b }
    }
}

/// A maximum by parabolas, or golden sections where these do not shrink (Brent, "Algorithms for Minimization
/// without Derivatives", 1973, chapter 5).
#[derive(Debug, Clone)]
pub(super) struct Maximum {
    a: f64,
    b: f64,
    /// Best, second best, and the second best before, with their values.
    best: [(f64, f64); 3],
    step: f64,
    before: f64,
    /// The place asked for.
    u: f64,
    tolerance: f64,
}

impl Maximum {
    fn ask(&mut self) -> Option<f64> {
        const GOLDEN: f64 = 0.381_966_011_250_105;
        let Self { a, b, tolerance, .. } = *self;
        let [(x, fx), (w, fw), (v, fv)] = self.best;
        let middle = 0.5 * (a + b);
        if !((x - middle).abs() > 2.0 * tolerance - 0.5 * (b - a)) {
            return None;
        }
        let r = (x - w) * (fx - fv);
        let q = (x - v) * (fx - fw);
        let (p, q) = ((x - v) * q - (x - w) * r, 2.0 * (q - r));
        let parabola = if q > 0.0 { -p } else { p } / q.abs();
        let trusted = parabola.is_finite()
            && parabola.abs() < 0.5 * self.before.abs()
            && x + parabola > a + tolerance
            && x + parabola < b - tolerance;
        self.before = self.step;
        if trusted {
            self.step = parabola;
        } else {
            self.before = if x < middle { b - x } else { a - x };
            self.step = GOLDEN * self.before;
        }
        let least = tolerance.copysign(self.step);
        self.u = x + if self.step.abs() < tolerance { least } else { self.step };
        Some(self.u)
    }

    fn tell(&mut self, fu: f64) {
        let u = self.u;
        let [(x, fx), (w, fw), (v, fv)] = self.best;
        // Of x and u the lesser one becomes an end.
        match (fu >= fx, u < x) {
            (true, true) => self.b = x,
            (true, false) => self.a = x,
            (false, true) => self.a = u,
            (false, false) => self.b = u,
        }
        if fu >= fx {
            self.best = [(u, fu), (x, fx), (w, fw)];
        } else if fu >= fw || w == x {
            self.best = [(x, fx), (u, fu), (w, fw)];
        } else if fu >= fv || v == x || v == w {
            self.best[2] = (u, fu);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    /// The place found and the value there, with the evaluations it took.
    fn found(search: Search, f: impl Fn(f64) -> f64, count: &mut usize) -> (f64, f64) {
        let at = |places: &[f64]| {
            *count += places.len();
            Ok::<_, Infallible>(places.iter().map(|x| (*x, f(*x))).collect())
        };
        let Ok(found) = run(&mut [search], at, |_, (_, value)| *value);
        found[0]
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
            let (found, _) = found(Search::zero(bracket, ends, 1e-12), f, &mut count);
            assert!((found - expected).abs() < 2e-12 || f(found) == 0.0, "{found}");
            assert!(count <= 60, "{count}");
        }
        let mut count = 0;
        let smooth = |x: f64| x.cos();
        let search = Search::zero([1.0, 2.0], [smooth(1.0), smooth(2.0)], 1e-12);
        found(search, smooth, &mut count);
        // The last one is what is at the place found.
        assert!(count <= 10, "{count}");
    }

    #[test]
    fn a_maximum_is_found_with_few_evaluations() {
        let lorentzian = |x: f64| 1.0 / (1e-6 + (x - 0.3).powi(2));
        let mut count = 0;
        let start = (0.3004, lorentzian(0.3004));
        let search = Search::maximum([0.299, 0.301], start, 1e-9);
        let (at, value) = found(search, lorentzian, &mut count);
        assert!((at - 0.3).abs() < 1e-8 && (value / 1e6 - 1.0).abs() < 1e-9, "{at} {value}");
        assert!(count <= 40, "{count}");
        // At the edge of the bracket.
        let (at, _) = found(Search::maximum([0.0, 1.0], (0.5, 0.5), 1e-9), |x| x, &mut count);
        assert!(at > 1.0 - 1e-8);
    }

    #[test]
    fn searches_side_by_side_find_what_each_finds_alone() {
        let f = [|x: f64| x * x - 2.0, |x: f64| -(x - 0.7) * (x - 0.7), |x: f64| 1.5 - x];
        let searches = [
            Search::zero([0.0, 2.0], [f[0](0.0), f[0](2.0)], 1e-12),
            Search::maximum([0.0, 2.0], (1.0, f[1](1.0)), 1e-9),
            Search::zero([0.0, 2.0], [f[2](0.0), f[2](2.0)], 1e-12),
        ];
        let at = |places: &[f64]| Ok::<_, Infallible>(places.to_vec());
        let Ok(together) = run(&mut searches.clone(), at, |index, x| f[index](*x));
        for (index, search) in searches.into_iter().enumerate() {
            assert_eq!(found(search, f[index], &mut 0).0, together[index]);
        }
    }
}
