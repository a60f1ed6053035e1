//! Peaks of single modes in the loops, and how each is stabilised: by gain or by phase.
//!
//! What mode a pole belongs to is not known here.

use super::Settings;
use super::assess::{CROSSING, EXTREME, is_away};
use super::contour::{Curve, Error};
use super::loops::{Sample, decibels, from_critical};
use super::search::{self, Search};
use nalgebra::Complex;
use serde::{Deserialize, Serialize};

/// Half width of the window about a resonance, in units of −Re s: a lone resonance has fallen by
/// 12 dB at its ends.
const WINDOW: f64 = 4.0;

/// Peaks below this are not searched between samples, dB: at the five samples of a lone resonance the
/// highest is the peak itself.
const SEARCHED_DB: f64 = -40.0;

/// How a mode is kept from destabilising a loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stabilised {
    /// |L| stays below minus the gain margin in the whole window of the mode.
    Gain,
    /// The closed loop is stable, and in the lobe of the mode, the frequencies about its peak at which |L|
    /// is above minus the gain margin, L is at least the phase margin away from −180° wherever |L| is
    /// within the gain margin of 0 dB. (An unstable mode must cross −180° above.)
    Phase,
    /// Neither.
    Neither,
}

impl Stabilised {
    /// The word stored in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Gain => "gain",
            Self::Phase => "phase",
            Self::Neither => "neither",
        }
    }
}

/// The peak of one lightly damped pole of the broken loops in one loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// The pole, rad/s.
    pub pole: Complex<f64>,
    /// Axis.
    pub axis: usize,
    /// Largest |L| in the window, dB; −∞ for a loop of nothing.
    pub peak_db: f64,
    /// Where, rad/s.
    pub omega_rad_s: f64,
    /// Angle of L from −180° there, degrees, in (−180, 180].
    pub from_critical_deg: f64,
    /// How it is stabilised.
    pub stabilised: Stabilised,
}

/// The highest point of a loop about a pole: a sample, then what was found between samples.
struct Top {
    pole: Complex<f64>,
    axis: usize,
    index: usize,
    highest: Sample,
}

/// The peaks of every lightly damped pole beyond the contour's arc, in each axis; none where the window is
/// beyond the curve.
pub(super) fn peaks(
    curve: &Curve,
    poles: &[Complex<f64>],
    stable: bool,
    settings: &Settings,
    at: &mut impl FnMut(&[f64]) -> Result<Vec<Sample>, Error>,
) -> Result<Vec<Peak>, Error> {
    let radius = curve.contour.radius_rad_s;
    let samples = &curve.samples;
    let (mut tops, mut searches, mut searched) = (Vec::new(), Vec::new(), Vec::new());
    for &pole in poles {
        let light = pole.im > radius && pole.re.abs() <= settings.light_damping_ratio * pole.norm();
        if !light {
            continue;
        }
        let half = WINDOW * pole.re.abs();
        let lowest = (pole.im - half).max(radius);
        let place = |omega: f64| curve.contour.place(omega);
        let from = samples.partition_point(|sample| sample.place < place(lowest));
        let to = samples.partition_point(|sample| sample.place <= place(pole.im + half));
        for axis in 0..3 {
            let size = |index: usize| samples[index].broken[axis].norm_sqr();
            let Some(index) = (from..to).max_by(|&a, &b| size(a).total_cmp(&size(b))) else {
                continue;
            };
            let highest = samples[index];
            let value = decibels(highest.broken[axis]);
            if index > from && index + 1 < to && value > SEARCHED_DB {
                let bracket = [samples[index - 1].place, samples[index + 1].place];
                searches.push(Search::maximum(bracket, (highest.place, value), EXTREME));
                searched.push(tops.len());
            }
            tops.push(Top { pole, axis, index, highest });
        }
    }
    let found = search::run(&mut searches, &mut *at, |search, sample: &Sample| {
        decibels(sample.broken[tops[searched[search]].axis])
    })?;
    for (top, sample) in searched.into_iter().zip(found) {
        tops[top].highest = sample;
    }
    let keep_away = if stable { keep_away(samples, &tops, settings, at)? } else { Vec::new() };
    let peaks = tops.iter().enumerate().map(|(number, top)| {
        let l = top.highest.broken[top.axis];
        let stabilised = if decibels(l) < -settings.gain_margin_db {
            Stabilised::Gain
        } else if keep_away.get(number).copied().unwrap_or(false) {
            Stabilised::Phase
        } else {
            Stabilised::Neither
        };
        Peak {
            pole: top.pole,
            axis: top.axis,
            peak_db: decibels(l),
            omega_rad_s: top.highest.omega_rad_s(),
            from_critical_deg: from_critical(l).to_degrees(),
            stabilised,
        }
    });
    Ok(peaks.collect())
}

/// Per top above minus the gain margin, whether its loop keeps its phase margin in the lobe around it: at the
/// samples whose gain is within the gain margin of 0 dB, and where it enters and leaves that band between them.
fn keep_away(
    samples: &[Sample],
    tops: &[Top],
    settings: &Settings,
    at: &mut impl FnMut(&[f64]) -> Result<Vec<Sample>, Error>,
) -> Result<Vec<bool>, Error> {
    let most = settings.gain_margin_db;
    let away =
        |sample: &Sample, axis: usize| is_away(sample.broken[axis], settings.phase_margin_deg);
    let (mut searches, mut sought) = (Vec::new(), Vec::new());
    let mut keep_away = vec![false; tops.len()];
    for (number, &Top { axis, index: top, highest, .. }) in tops.iter().enumerate() {
        let gain = |sample: &Sample| decibels(sample.broken[axis]);
        if gain(&highest) < -most {
            continue;
        }
        let up = samples[top..].iter().take_while(|sample| gain(sample) >= -most).count();
        let down = samples[..top].iter().rev().take_while(|sample| gain(sample) >= -most).count();
        // With the neighbours outside, where there are any.
        let lobe = &samples[(top - down).saturating_sub(1)..(top + up + 1).min(samples.len())];
        keep_away[number] =
            lobe.iter().all(|sample| gain(sample).abs() > most || away(sample, axis));
        if !keep_away[number] {
            continue;
        }
        for pair in lobe.windows(2).filter(|pair| pair[0].place >= 1.0) {
            for level in [-most, most] {
                let ends = [gain(&pair[0]) - level, gain(&pair[1]) - level];
                if (ends[0] < 0.0) != (ends[1] < 0.0) {
                    let between = [pair[0].place, pair[1].place];
                    searches.push(Search::zero(between, ends, CROSSING));
                    sought.push((number, axis, level));
                }
            }
        }
    }
    let found = search::run(&mut searches, at, |search, sample: &Sample| {
        let (_, axis, level) = sought[search];
        decibels(sample.broken[axis]) - level
    })?;
    for ((number, axis, _), sample) in sought.into_iter().zip(found) {
        keep_away[number] &= away(&sample, axis);
    }
    Ok(keep_away)
}

#[cfg(test)]
mod tests {
    use super::super::assess;
    use super::*;
    use crate::margins::assess::tests::each;
    use nalgebra::{Matrix3, Vector3};

    const OMEGA: f64 = 31.4;
    const ZETA: f64 = 0.005;

    /// A mode seen by a rate gyro, its peak turned by `angle` from the positive real axis.
    fn found(gain: f64, angle_deg: f64) -> Peak {
        let turn = Complex::from_polar(gain, angle_deg.to_radians());
        let g = move |s: Complex<f64>| {
            let mode = 2.0 * ZETA * OMEGA * s / (s * s + 2.0 * ZETA * OMEGA * s + OMEGA * OMEGA);
            // Real on the real axis, where the contour starts.
            let turn = if s.im == 0.0 { Complex::new(turn.re, 0.0) } else { turn };
            let zero = Complex::default();
            Matrix3::from_diagonal(&Vector3::new(mode * turn, zero, zero))
        };
        let pole = Complex::new(-ZETA * OMEGA, OMEGA * (1.0 - ZETA * ZETA).sqrt());
        let found = assess(each(g), &[pole], &[], &[], &Settings::default()).expect("scanned");
        found.peaks[0]
    }

    #[test]
    fn the_peak_of_a_mode_is_its_gain_at_resonance() {
        let peak = found(0.4, 20.0);
        assert!((peak.peak_db - 20.0 * 0.4_f64.log10()).abs() < 1e-9);
        assert!((peak.omega_rad_s / OMEGA - 1.0).abs() < 1e-6);
        assert!((peak.from_critical_deg - (20.0 - 180.0)).abs() < 1e-3);
        assert_eq!(peak.stabilised, Stabilised::Gain);
    }

    #[test]
    fn a_mode_above_the_gain_margin_needs_its_phase() {
        // Over the half circle above −6 dB a peak of 0 dB turns by ±60° about its angle.
        assert_eq!(found(1.0, 0.0).stabilised, Stabilised::Phase);
        assert_eq!(found(1.0, 85.0).stabilised, Stabilised::Phase);
        assert_eq!(found(1.0, 100.0).stabilised, Stabilised::Neither);
        assert_eq!(found(0.9, 180.0).stabilised, Stabilised::Neither);
        // Unstable.
        assert_eq!(found(1.1, 180.0).stabilised, Stabilised::Neither);
    }

    #[test]
    fn an_unstable_mode_is_phase_stabilised_where_it_crosses_with_gain_to_spare() {
        // Negative damping: its circle stands on the left, and feedback of 2.5 times adds more.
        let unstable = |gain: f64| {
            let g = move |s: Complex<f64>| {
                let damping = 2.0 * ZETA * OMEGA * s;
                let mode = damping / (s * s - damping + OMEGA * OMEGA);
                let zero = Complex::default();
                Matrix3::from_diagonal(&Vector3::new(gain * mode, zero, zero))
            };
            let pole = Complex::new(ZETA * OMEGA, OMEGA * (1.0 - ZETA * ZETA).sqrt());
            let found = assess(each(g), &[pole], &[], &[], &Settings::default()).expect("scanned");
            (found.unstable, found.peaks[0].stabilised)
        };
        assert_eq!(unstable(0.9), (2, Stabilised::Neither));
        assert_eq!(unstable(1.1), (0, Stabilised::Neither));
        assert_eq!(unstable(2.5), (0, Stabilised::Phase));
    }
}
