//! The contour of the loops, and the scan along it: where the loops are evaluated.
//!
//! Frequencies start from a logarithmic grid and the resonances, and are refined where the loops
//! turn; what the samples say is decided in `assess`.

use super::loops::{Sample, from_critical};
use super::{GAIN_CAP_DB, Settings};
use nalgebra::{Complex, Matrix3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Why loops could not be scanned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Error {
    /// A loop is not finite.
    #[error("a loop is not finite at {0} rad/s")]
    NonFinite(Complex<f64>),
    /// A loop or det(1 + G) jumps: a pole of the open or the closed loop on the imaginary axis.
    #[error("a pole of the open or the closed loop is on the imaginary axis at {0} rad/s")]
    OnAxis(f64),
    /// The loops turn more often than is followed.
    #[error("more than {MOST_SAMPLES} frequencies would be needed")]
    Effort,
    /// The loops are still large at the highest frequency.
    #[error("det(1 + G) is {0} at the highest frequency: the loops do not die out")]
    Large(Complex<f64>),
}

/// Most samples of a scan: hundreds of resonances and delays of hundreds of turns.
const MOST_SAMPLES: usize = 100_000;

/// Largest turn of a loop between neighbours, rad: a crossing of −180° has its neighbours in the
/// left half plane, and a resonance (a circle) is met by at least six of them.
const LOOP_TURN: f64 = PI / 6.0;

/// Largest turn of det(1 + G) between neighbours, rad: far from the half turn that would be
/// taken for its opposite.
const DIFFERENCE_TURN: f64 = PI / 3.0;

/// Places of one resonance by the angle on its circle: on the frequency `ω + σ tan φ` of a pole −σ + jω.
/// Three of the five lie inside the half-power band |φ| ≤ 45°.
const RESONANCE_ANGLES_DEG: [f64; 5] = [-70.0, -35.0, 0.0, 35.0, 70.0];

/// Least half width of a resonance, relative to its frequency.
const LEAST_DAMPING: f64 = 1e-6;

/// Smallest interval that is halved: relative difference of two frequencies.
const SMALLEST: f64 = 1e-10;

/// Decades beyond the highest frequency in which loops may still die out.
const MOST_DECADES_BEYOND: u32 = 6;

/// Distance of det(1 + G) from 1 at which it no longer circles zero.
const DEAD: f64 = 0.5;

/// The half contour: places 0 to 1 are the quarter circle of radius ε, place `1 + ln(ω/ε)` is jω.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contour {
    /// Radius ε, rad/s.
    pub radius_rad_s: f64,
}

impl Contour {
    /// The complex frequency at a place, rad/s; the start is real.
    pub fn at(&self, place: f64) -> Complex<f64> {
        if place >= 1.0 {
            return Complex::new(0.0, self.radius_rad_s * (place - 1.0).exp());
        }
        if place == 0.0 {
            return Complex::new(self.radius_rad_s, 0.0);
        }
        Complex::from_polar(self.radius_rad_s, FRAC_PI_2 * place)
    }

    /// The place of jω.
    pub fn place(&self, omega_rad_s: f64) -> f64 {
        1.0 + (omega_rad_s / self.radius_rad_s).ln()
    }
}

/// The loops along the contour, in its order.
#[derive(Debug, Clone)]
pub struct Curve {
    /// The contour.
    pub contour: Contour,
    /// Samples from the real axis to the highest frequency.
    pub samples: Vec<Sample>,
    /// Phase of each axis at each sample, degrees, unwrapped along the contour from 0° or −180° on the
    /// real axis.
    pub phase_deg: Vec<[f64; 3]>,
}

impl Curve {
    /// Turn of det(1 + G) over the half contour, in units of π: a whole number.
    pub fn half_turns(&self) -> i64 {
        let turn = |pair: &[Sample]| (pair[1].difference / pair[0].difference).arg();
        let along: f64 = self.samples.windows(2).map(turn).sum();
        let rest = -self.samples.last().map_or(0.0, |sample| sample.difference.arg());
        ((along + rest) / PI).round() as i64
    }
}

/// Scans the loop matrix `g`, given at several frequencies at once, along the contour.
///
/// `poles` are poles of the open and, where known, the closed loop (one of each complex pair): the
/// grid is refined about the lightly damped ones. `wanted_rad_s` are frequencies at which a sample is wanted.
///
/// Intervals are halved until no loop between −40 and 40 dB turns by more than 30° or changes by more than 6 dB, and
/// det(1 + G) turns by no more than 60°.
///
/// # Errors
/// See [`Error`].
pub fn scan(
    g: &mut impl FnMut(&[Complex<f64>]) -> Vec<Matrix3<Complex<f64>>>,
    poles: &[Complex<f64>],
    wanted_rad_s: &[f64],
    settings: &Settings,
) -> Result<Curve, Error> {
    let (contour, places) = places(poles, wanted_rad_s, settings);
    let mut samples = contour.samples(g, &places)?;
    let mut fine = vec![false; samples.len()];
    refine(&contour, g, &mut samples, &mut fine)?;
    // Upwards as far as needed for the loops to die out, within reason.
    let step = std::f64::consts::LN_10 / f64::from(settings.points_per_decade);
    let end = places[places.len() - 1];
    let dead = |sample: &Sample| (sample.difference - 1.0).norm() < DEAD;
    for decade in 0..MOST_DECADES_BEYOND {
        if samples.last().is_some_and(dead) {
            break;
        }
        let points = 1..=settings.points_per_decade;
        let of = |i: u32| end + step * f64::from(decade * settings.points_per_decade + i);
        let mut more = contour.samples(g, &points.map(of).collect::<Vec<f64>>())?;
        let needed = more.iter().position(dead).map_or(more.len(), |first| first + 1);
        more.truncate(needed);
        samples.extend(more);
        fine.resize(samples.len(), false);
        refine(&contour, g, &mut samples, &mut fine)?;
    }
    let end = samples[samples.len() - 1].difference;
    if !((end - 1.0).norm() < DEAD) {
        return Err(Error::Large(end));
    }
    let phase_deg = phases(&samples);
    Ok(Curve { contour, samples, phase_deg })
}

impl Contour {
    /// The loops at several places.
    ///
    /// # Errors
    /// A loop that is not finite.
    pub(super) fn samples(
        &self,
        g: &mut impl FnMut(&[Complex<f64>]) -> Vec<Matrix3<Complex<f64>>>,
        places: &[f64],
    ) -> Result<Vec<Sample>, Error> {
        let points: Vec<Complex<f64>> = places.iter().map(|place| self.at(*place)).collect();
        let found = g(&points).into_iter().zip(places.iter().zip(points));
        found
            .map(|(g, (&place, s))| {
                let sample = Sample::new(place, s, &g);
                if sample.is_finite() { Ok(sample) } else { Err(Error::NonFinite(s)) }
            })
            .collect()
    }
}

/// Halves intervals, all coarse ones at a time, until none is; `fine` tells those known to be fine by their ends.
fn refine(
    contour: &Contour,
    g: &mut impl FnMut(&[Complex<f64>]) -> Vec<Matrix3<Complex<f64>>>,
    samples: &mut Vec<Sample>,
    fine: &mut Vec<bool>,
) -> Result<(), Error> {
    loop {
        let mut middles = Vec::new();
        for (pair, fine) in samples.windows(2).zip(&mut fine[1..]).filter(|(_, fine)| !**fine) {
            *fine = !is_coarse(&pair[0], &pair[1]);
            if !*fine {
                if !(pair[1].place - pair[0].place > SMALLEST) {
                    return Err(Error::OnAxis(pair[1].omega_rad_s()));
                }
                middles.push(0.5 * (pair[0].place + pair[1].place));
            }
        }
        if middles.is_empty() {
            return Ok(());
        }
        if samples.len() + middles.len() > MOST_SAMPLES {
            return Err(Error::Effort);
        }
        samples.extend(contour.samples(g, &middles)?);
        fine.resize(samples.len(), false);
        let mut order: Vec<usize> = (0..samples.len()).collect();
        order.sort_by(|a, b| samples[*a].place.total_cmp(&samples[*b].place));
        *samples = order.iter().map(|i| samples[*i]).collect();
        // An interval that was halved is two new ones.
        *fine = order.iter().map(|i| fine[*i]).collect();
    }
}

/// The contour and the places to start from, ascending.
fn places(
    poles: &[Complex<f64>],
    wanted_rad_s: &[f64],
    settings: &Settings,
) -> (Contour, Vec<f64>) {
    let moduli = poles.iter().map(|pole| pole.norm()).filter(|modulus| *modulus > 0.0);
    let radius = moduli.fold(TAU * settings.lowest_hz, |least, modulus| least.min(0.1 * modulus));
    let is_light =
        |pole: &&Complex<f64>| pole.re.abs() <= settings.light_damping_ratio * pole.norm();
    let light = poles.iter().filter(is_light).filter(|pole| pole.norm() > 0.0);
    let top =
        (light.clone().map(|pole| 2.0 * pole.norm())).fold(TAU * settings.highest_hz, f64::max);
    let contour = Contour { radius_rad_s: radius };
    let end = contour.place(top);
    let steps = (f64::from(settings.points_per_decade) * (top / radius).log10()).ceil().max(1.0);
    let mut places = vec![0.0, 1.0 / 3.0, 2.0 / 3.0];
    places.extend((0..=steps as u32).map(|i| 1.0 + (end - 1.0) * f64::from(i) / steps));
    for pole in light {
        let half_width = pole.re.abs().max(LEAST_DAMPING * pole.norm());
        for angle in RESONANCE_ANGLES_DEG {
            let omega = pole.im.abs() + half_width * angle.to_radians().tan();
            if omega > radius {
                places.push(contour.place(omega));
            }
        }
    }
    places.extend(wanted_rad_s.iter().filter(|w| **w >= radius).map(|&w| contour.place(w)));
    places.sort_by(f64::total_cmp);
    places.dedup();
    (contour, places)
}

/// Whether more must be known between two neighbours.
fn is_coarse(a: &Sample, b: &Sample) -> bool {
    // Written so that what is not a number is coarse.
    let turns = |x: Complex<f64>, y: Complex<f64>, most: f64| !((y / x).arg().abs() <= most);
    let cap = 10.0_f64.powf(GAIN_CAP_DB / 20.0);
    turns(a.difference, b.difference, DIFFERENCE_TURN)
        || a.broken.iter().zip(&b.broken).any(|(x, y)| {
            let (low, high) = (x.norm().min(y.norm()), x.norm().max(y.norm()));
            let matters = high > 1.0 / cap && low < cap;
            matters && (turns(*x, *y, LOOP_TURN) || !(high <= 2.0 * low))
        })
}

/// Phases along the samples, degrees, each the nearest to that before.
fn phases(samples: &[Sample]) -> Vec<[f64; 3]> {
    let mut phase = [0.0; 3];
    let mut before: Option<&Sample> = None;
    let mut phases = Vec::with_capacity(samples.len());
    for sample in samples {
        for (axis, phase) in phase.iter_mut().enumerate() {
            let here = sample.broken[axis];
            *phase += match before.map(|before| before.broken[axis]) {
                // On the real axis a loop is positive, 0°, or negative, −180°.
                None if here.re < 0.0 => from_critical(here) - PI,
                None => here.arg(),
                Some(before) if before.norm() > 0.0 && here.norm() > 0.0 => (here / before).arg(),
                Some(_) => 0.0,
            };
        }
        before = Some(sample);
        phases.push(phase.map(f64::to_degrees));
    }
    phases
}
