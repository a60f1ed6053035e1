//! Margins of each axis from a scanned curve: gain, phase, delay and disk margins, distance from the
//! Nichols ellipse, and the closed loop's unstable poles by Nyquist's count.
//!
//! Crossings and extremes are searched on the exact response between the samples that bracket
//! them; what single modes do is in `peak`.

use super::contour::{self, Curve, Error};
use super::loops::{Sample, decibels, from_critical};
use super::peak::{self, Peak};
use super::search::{self, Search};
use super::{DELAY_CAP_S, DISTANCE_CAP, GAIN_CAP_DB, Settings};
use nalgebra::{Complex, Matrix3};
use std::f64::consts::{PI, TAU};

/// To which a crossing or an extreme is searched: relative error of its frequency.
pub(super) const CROSSING: f64 = 1e-12;
/// As [`CROSSING`], for extremes: near them a value changes with the square of the error.
pub(super) const EXTREME: f64 = 1e-9;

/// A margin and where it is tightest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margin {
    /// The margin, in the unit of its name; zero for an unstable closed loop.
    pub value: f64,
    /// Angular frequency where it is tightest, rad/s; zero is the limit of low frequency, `None` where
    /// the margin is at its limit because nothing crosses.
    pub omega_rad_s: Option<f64>,
}

impl Margin {
    /// The limit of a margin that nothing reaches.
    fn cap(value: f64) -> Self {
        Self { value, omega_rad_s: None }
    }

    /// The smaller of two margins.
    fn tighten(&mut self, value: f64, omega_rad_s: f64) {
        if value < self.value {
            *self = Self { value, omega_rad_s: Some(omega_rad_s) };
        }
    }
}

/// The margins of one loop, broken at its axis command with the other loops closed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AxisMargins {
    /// Loss of gain to the nearest crossing of −180° with |L| ≥ 1, dB, 0 to [`GAIN_CAP_DB`].
    pub gain_low_db: Margin,
    /// Gain to the nearest crossing of −180° with |L| < 1, dB, 0 to [`GAIN_CAP_DB`].
    pub gain_high_db: Margin,
    /// Least angle between −180° and L where |L| = 1, in either direction, degrees, 0 to 180.
    pub phase_deg: Margin,
    /// Least additional delay that brings L to −1, s, 0 to [`DELAY_CAP_S`].
    pub delay_s: Margin,
    /// Disk margin α = 2/max|S − T| (skew 0), −, 0 to 2.
    pub disk: Margin,
    /// Distance from the Nichols ellipse, −, 0 to [`DISTANCE_CAP`]: least
    /// `√((φ/phase margin)² + (dB/gain margin)²)`, φ the angle from −180°; 1 touches the ellipse.
    pub ellipse: Margin,
}

impl AxisMargins {
    /// Margins of a loop that never comes near −1.
    const CAPS: [f64; 6] = [GAIN_CAP_DB, GAIN_CAP_DB, 180.0, DELAY_CAP_S, 2.0, DISTANCE_CAP];

    fn each(values: [Margin; 6]) -> Self {
        let [gain_low_db, gain_high_db, phase_deg, delay_s, disk, ellipse] = values;
        Self { gain_low_db, gain_high_db, phase_deg, delay_s, disk, ellipse }
    }

    /// No margin.
    fn none() -> Self {
        Self::each([Margin::cap(0.0); 6])
    }

    /// Gains by which the loop may be multiplied, together with the phase of
    /// [`AxisMargins::disk_phase_deg`]: (2 − α)/(2 + α) and its inverse, infinite for α = 2.
    pub fn disk_gains(&self) -> [f64; 2] {
        let alpha = self.disk.value;
        [(2.0 - alpha) / (2.0 + alpha), (2.0 + alpha) / (2.0 - alpha)]
    }

    /// Phase by which the loop may turn at unchanged gain, degrees: 2 atan(α/2).
    pub fn disk_phase_deg(&self) -> f64 {
        2.0 * (self.disk.value / 2.0).atan().to_degrees()
    }
}

/// What the loops of one model say.
#[derive(Debug, Clone)]
pub struct Assessment {
    /// Margins of roll, pitch and yaw.
    pub axes: [AxisMargins; 3],
    /// Peaks by resonance and axis; the axis changes fastest.
    pub peaks: Vec<Peak>,
    /// Closed-loop poles in the right half plane (beyond ε of zero), by Nyquist's count.
    pub unstable: i64,
    /// The curve.
    pub curve: Curve,
}

impl Assessment {
    /// Whether all loops closed are stable. A count below zero would contradict the poles given.
    pub fn is_stable(&self) -> bool {
        self.unstable == 0
    }
}

/// Assesses the loop matrix `g` (see the module's sign convention).
///
/// `poles` are all poles of the broken loops (one of each complex pair; filters must be stable and
/// may be left out), `also` further poles about which to look closely, for instance those of the closed
/// loop; `wanted_rad_s` are frequencies at which the curve shall have a sample.
///
/// # Errors
/// See [`Error`].
pub fn assess(
    mut g: impl FnMut(&[Complex<f64>]) -> Vec<Matrix3<Complex<f64>>>,
    poles: &[Complex<f64>],
    also: &[Complex<f64>],
    wanted_rad_s: &[f64],
    settings: &Settings,
) -> Result<Assessment, Error> {
    let all: Vec<_> = poles.iter().chain(also).copied().collect();
    let curve = contour::scan(&mut g, &all, wanted_rad_s, settings)?;
    let beyond = |pole: &&Complex<f64>| pole.re > 0.0 && pole.norm() > curve.contour.radius_rad_s;
    let open: i64 =
        poles.iter().filter(beyond).map(|pole| if pole.im == 0.0 { 1 } else { 2 }).sum();
    let unstable = open - curve.half_turns();
    let contour = curve.contour;
    let mut at = |places: &[f64]| contour.samples(&mut g, places);
    let axes =
        if unstable == 0 { margins(&curve, settings, &mut at)? } else { [AxisMargins::none(); 3] };
    let peaks = peak::peaks(&curve, poles, unstable == 0, settings, &mut at)?;
    Ok(Assessment { axes, peaks, unstable, curve })
}

/// What is searched for in a loop.
#[derive(Debug, Clone, Copy)]
enum Sought {
    /// |L| = 1.
    GainCrossing,
    /// The negative real axis.
    PhaseCrossing,
    /// The greatest radius of the disks.
    Disk,
    /// The least distance from the ellipse.
    Ellipse,
}

impl Sought {
    /// The function whose zero or maximum it is.
    fn of(self, l: Complex<f64>, settings: &Settings) -> f64 {
        match self {
            Self::GainCrossing => l.norm_sqr().ln(),
            Self::PhaseCrossing => from_critical(l),
            Self::Disk => ((1.0 - l) / (1.0 + l)).norm(),
            Self::Ellipse => -distance(l, settings),
        }
    }
}

/// The margins of the axes of a stable closed loop.
fn margins(
    curve: &Curve,
    settings: &Settings,
    at: &mut impl FnMut(&[f64]) -> Result<Vec<Sample>, Error>,
) -> Result<[AxisMargins; 3], Error> {
    let mut margins = [AxisMargins::each(AxisMargins::CAPS.map(Margin::cap)); 3];
    let on_axis = curve.samples.partition_point(|sample| sample.place < 1.0);
    let samples = &curve.samples[on_axis..];
    let (mut searches, mut sought) = (Vec::new(), Vec::new());
    for (axis, margins) in margins.iter_mut().enumerate() {
        // The limit of low frequency: a loop that ends on the negative real axis crosses −180° there. The
        // real part at jε is nearer to the limit than the value at ε.
        let end = samples[0].broken[axis].re;
        if curve.samples[0].broken[axis].re < 0.0 && end < 0.0 {
            let limit = Complex::new(end, 0.0);
            margins.take_phase_crossing(limit, 0.0);
            margins.disk.tighten(2.0 / Sought::Disk.of(limit, settings), 0.0);
            margins.ellipse.tighten(distance(limit, settings), 0.0);
        }
        for pair in samples.windows(2) {
            let [la, lb] = [pair[0].broken[axis], pair[1].broken[axis]];
            let mut cross = |what: Sought| {
                let ends = [la, lb].map(|l| what.of(l, settings));
                searches.push(Search::zero([pair[0].place, pair[1].place], ends, CROSSING));
                sought.push((axis, what));
            };
            if (la.norm() < 1.0) != (lb.norm() < 1.0) {
                cross(Sought::GainCrossing);
            }
            if (la.im < 0.0) != (lb.im < 0.0) && la.re < 0.0 && lb.re < 0.0 {
                cross(Sought::PhaseCrossing);
            }
        }
        for what in [Sought::Disk, Sought::Ellipse] {
            let values: Vec<f64> =
                samples.iter().map(|sample| what.of(sample.broken[axis], settings)).collect();
            for (value, sample) in values.iter().zip(samples) {
                margins.take_extreme(what, *value, sample.omega_rad_s());
            }
            for index in maxima(&values) {
                let bracket = [samples[index - 1].place, samples[index + 1].place];
                let start = (samples[index].place, values[index]);
                searches.push(Search::maximum(bracket, start, EXTREME));
                sought.push((axis, what));
            }
        }
    }
    let found = search::run(&mut searches, at, |index, sample: &Sample| {
        let (axis, what) = sought[index];
        what.of(sample.broken[axis], settings)
    })?;
    for ((axis, what), sample) in sought.into_iter().zip(found) {
        let (l, omega, margins) = (sample.broken[axis], sample.omega_rad_s(), &mut margins[axis]);
        match what {
            Sought::GainCrossing => margins.take_gain_crossing(l, omega),
            Sought::PhaseCrossing => margins.take_phase_crossing(l, omega),
            _ => margins.take_extreme(what, what.of(l, settings), omega),
        }
    }
    Ok(margins)
}

/// The local maxima of values along a curve that can be its greatest.
fn maxima(values: &[f64]) -> impl Iterator<Item = usize> + '_ {
    let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (1..values.len().saturating_sub(1)).filter(move |&index| {
        let [before, here, after] = [values[index - 1], values[index], values[index + 1]];
        // Between samples a smooth maximum rises by no more than to its neighbours it falls.
        before <= here && here >= after && here + (here - before).max(here - after) > greatest
    })
}

/// Distance from −1 on the Nichols chart in units of the ellipse.
fn distance(l: Complex<f64>, settings: &Settings) -> f64 {
    let phase = from_critical(l).to_degrees() / settings.phase_margin_deg;
    let gain = decibels(l) / settings.gain_margin_db;
    // A loop of exactly zero is infinitely far.
    phase.hypot(gain)
}

impl AxisMargins {
    fn take_phase_crossing(&mut self, l: Complex<f64>, omega_rad_s: f64) {
        let gain_db = decibels(l);
        if gain_db >= 0.0 {
            self.gain_low_db.tighten(gain_db, omega_rad_s);
        } else {
            self.gain_high_db.tighten(-gain_db, omega_rad_s);
        }
    }

    fn take_extreme(&mut self, what: Sought, value: f64, omega_rad_s: f64) {
        match what {
            Sought::Ellipse => self.ellipse.tighten(-value, omega_rad_s),
            _ => self.disk.tighten(2.0 / value, omega_rad_s),
        }
    }

    fn take_gain_crossing(&mut self, l: Complex<f64>, omega_rad_s: f64) {
        let angle = from_critical(l);
        self.phase_deg.tighten(angle.abs().to_degrees(), omega_rad_s);
        // A delay turns L clockwise: from above −180° at once, from below it after a whole turn.
        let turn = if angle < 0.0 { angle + TAU } else { angle };
        self.delay_s.tighten(turn / omega_rad_s, omega_rad_s);
    }
}

/// Whether an angle is at least `margin` away from −180°, degrees.
pub(super) fn is_away(l: Complex<f64>, margin_deg: f64) -> bool {
    from_critical(l).abs() >= margin_deg * PI / 180.0
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A loop matrix given one frequency at a time.
    pub(in crate::margins) fn each(
        mut g: impl FnMut(Complex<f64>) -> Matrix3<Complex<f64>>,
    ) -> impl FnMut(&[Complex<f64>]) -> Vec<Matrix3<Complex<f64>>> {
        move |points| points.iter().map(|s| g(*s)).collect()
    }
    use nalgebra::Vector3;

    fn s(re: f64, im: f64) -> Complex<f64> {
        Complex::new(re, im)
    }

    /// One loop on the roll axis, the others open.
    fn single(
        l: impl Fn(Complex<f64>) -> Complex<f64>,
    ) -> impl FnMut(Complex<f64>) -> Matrix3<Complex<f64>> {
        move |s| Matrix3::from_diagonal(&Vector3::new(l(s), Complex::default(), Complex::default()))
    }

    fn roll(l: impl Fn(Complex<f64>) -> Complex<f64>, poles: &[Complex<f64>]) -> AxisMargins {
        let found =
            assess(each(single(l)), poles, &[], &[], &Settings::default()).expect("scanned");
        assert!(found.is_stable());
        found.axes[0]
    }

    #[test]
    fn the_disk_margin_is_that_of_the_published_example() {
        let margins = roll(|s| 25.0 / (s * s * s + 10.0 * s * s + 10.0 * s + 10.0), &[]);
        // Published: 0.458 at 1.95 rad/s; a search in numpy on 2 million frequencies gives the digits.
        assert!((margins.disk.value - 0.458_092_547_7).abs() < 1e-9);
        assert!((margins.disk.omega_rad_s.unwrap() - 1.955_027).abs() < 1e-5);
        let [low, high] = margins.disk_gains();
        assert!((low - 0.627).abs() < 5e-4 && (high - 1.594).abs() < 5e-4);
        // On s = j√10 the loop is −25/90.
        assert!((margins.gain_high_db.value - 20.0 * (90.0_f64 / 25.0).log10()).abs() < 1e-9);
        assert!((margins.gain_high_db.omega_rad_s.unwrap() - 10.0_f64.sqrt()).abs() < 1e-9);
        assert_eq!(margins.gain_low_db, Margin::cap(GAIN_CAP_DB));
    }

    #[test]
    fn the_margins_of_a_delayed_integrator_are_closed_forms() {
        // L = ω_c e^{−sτ}/s: |L| = 1 at ω_c, −180° at ω τ = π/2, 5π/2, …
        let (crossover, delay) = (2.0_f64, 0.25);
        let margins = roll(|s| crossover * (-s * delay).exp() / s, &[]);
        let phase = 90.0 - (crossover * delay).to_degrees();
        assert!((margins.phase_deg.value - phase).abs() < 1e-9);
        assert!((margins.delay_s.value - phase.to_radians() / crossover).abs() < 1e-10);
        let gain = PI / (2.0 * delay * crossover);
        assert!((margins.gain_high_db.value - 20.0 * gain.log10()).abs() < 1e-9);
        assert_eq!(margins.gain_low_db, Margin::cap(GAIN_CAP_DB));
    }

    #[test]
    fn a_loop_that_must_not_lose_gain_has_a_low_gain_margin() {
        // An unstable pole at 1, closed by a gain of 3: the loop is −3 at zero frequency.
        let margins = roll(|s| 3.0 / (s - 1.0), &[s(1.0, 0.0)]);
        assert!((margins.gain_low_db.value - 20.0 * 3.0_f64.log10()).abs() < 1e-3);
        assert_eq!(margins.gain_low_db.omega_rad_s, Some(0.0));
        assert_eq!(margins.gain_high_db, Margin::cap(GAIN_CAP_DB));
        // |L| = 1 at √8, where the angle from −180° is atan √8.
        assert!((margins.phase_deg.value - 8.0_f64.sqrt().atan().to_degrees()).abs() < 1e-9);
    }

    #[test]
    fn a_loop_of_nothing_has_every_margin_at_its_limit() {
        let margins = roll(|_| Complex::default(), &[s(-1.0, 2.0)]);
        assert_eq!(margins, AxisMargins::each(AxisMargins::CAPS.map(Margin::cap)));
    }

    #[test]
    fn an_unstable_closed_loop_has_no_margin_and_as_many_unstable_poles_as_it_has() {
        // s³ + 10 s² + 10 s + 10 + k: stable up to k = 90.
        let l = |k: f64| move |s: Complex<f64>| k / (s * s * s + 10.0 * s * s + 10.0 * s + 10.0);
        let count = |k: f64| {
            let found =
                assess(each(single(l(k))), &[], &[], &[], &Settings::default()).expect("scanned");
            (found.unstable, found.axes[0] == AxisMargins::none())
        };
        assert_eq!(count(89.9), (0, false));
        assert_eq!(count(90.1), (2, true));
        assert_eq!(count(-9.9), (0, false));
        // One real pole crosses at zero.
        assert_eq!(count(-10.1), (1, true));
    }

    #[test]
    fn open_loop_instability_is_counted_from_the_poles_given() {
        // 1/(s − 1) with a gain below 1 stays unstable, and so it does without any feedback.
        for gain in [0.0, 0.9] {
            let l = single(move |s| gain / (s - 1.0));
            let found =
                assess(each(l), &[s(1.0, 0.0)], &[], &[], &Settings::default()).expect("scanned");
            assert_eq!(found.unstable, 1);
        }
    }

    #[test]
    fn poles_at_zero_are_left_to_the_left() {
        // A double integrator with rate and attitude feedback, and one with the wrong sign of rate.
        let pd = |rate: f64| single(move |s: Complex<f64>| (rate * s + 1.0) / (s * s));
        let count = |rate: f64| {
            assess(each(pd(rate)), &[], &[], &[], &Settings::default()).expect("scanned").unstable
        };
        assert_eq!(count(1.4), 0);
        assert_eq!(count(-1.4), 2);
        // With an integrator as well: s³ + 1.4 s² + s + i.
        let pid = |i: f64| single(move |s: Complex<f64>| (1.4 + 1.0 / s + i / (s * s)) / s);
        let count = |i: f64| {
            assess(each(pid(i)), &[], &[], &[], &Settings::default()).expect("scanned").unstable
        };
        assert_eq!(count(1.3), 0);
        assert_eq!(count(1.5), 2);
    }

    #[test]
    fn a_resonance_narrower_than_the_grid_is_not_missed() {
        // A light mode whose circle passes −1 on the inside or not at all.
        let mode =
            |gain: f64, s: Complex<f64>| gain * s / (s * s + 2.0 * 1e-5 * 31.4 * s + 31.4 * 31.4);
        let pole = s(-1e-5 * 31.4, 31.4 * (1.0_f64 - 1e-10).sqrt());
        let count = |gain: f64| {
            let l = single(move |s| mode(gain, s));
            let found = assess(each(l), &[pole], &[], &[], &Settings::default()).expect("scanned");
            (found.unstable, found.axes[0].gain_high_db)
        };
        assert_eq!(count(1e-3).0, 0);
        let (unstable, margin) = count(-0.5e-3);
        // −0.5e-3/(2·1e-5·31.4) = −0.796 at the resonance.
        assert_eq!(unstable, 0);
        assert!((margin.value + 20.0 * (0.5e-3 / (2e-5 * 31.4_f64)).log10()).abs() < 1e-6);
        assert_eq!(count(-1e-3).0, 2);
    }

    #[test]
    fn closing_the_other_axes_can_take_the_margin_of_one_away() {
        // Two integrators that feed each other: det = (1 + 1/s)² − c²/s², zeros −1 ± c.
        let coupled = |c: f64| {
            move |s: Complex<f64>| {
                let mut g = Matrix3::zeros();
                (g[(0, 0)], g[(1, 1)]) = (1.0 / s, 1.0 / s);
                (g[(0, 1)], g[(1, 0)]) = (c / s, c / s);
                g
            }
        };
        let found =
            |c| assess(each(coupled(c)), &[], &[], &[], &Settings::default()).expect("scanned");
        let half = found(0.5);
        assert_eq!(half.unstable, 0);
        // L = 1/s − c²/(s(s + 1)) = (s + 1 − c²)/(s (s + 1)): no crossing of −180°.
        assert_eq!(half.axes[0].gain_high_db, Margin::cap(GAIN_CAP_DB));
        assert_eq!(found(1.5).unstable, 1);
    }

    #[test]
    fn the_effort_of_a_simple_loop_is_small() {
        let mut count = 0;
        let g = |s: Complex<f64>| {
            count += 1;
            let l = 25.0 / (s * s * s + 10.0 * s * s + 10.0 * s + 10.0);
            Matrix3::from_diagonal(&Vector3::new(l, Complex::default(), Complex::default()))
        };
        assess(each(g), &[], &[], &[], &Settings::default()).expect("scanned");
        assert!(count < 300, "{count}");
    }

    #[test]
    fn what_cannot_be_followed_is_an_error() {
        let settings = Settings::default();
        let nan = assess(each(single(|_| s(f64::NAN, 0.0))), &[], &[], &[], &settings);
        assert!(matches!(nan, Err(Error::NonFinite(_))));
        let undamped =
            assess(each(single(|s| s / (s * s + 4.0))), &[s(0.0, 2.0)], &[], &[], &settings);
        assert!(matches!(undamped, Err(Error::OnAxis(_) | Error::NonFinite(_))), "{undamped:?}");
        let large = assess(each(single(|_| s(3.0, 0.0))), &[], &[], &[], &settings);
        assert!(matches!(large, Err(Error::Large(_))));
    }
}
