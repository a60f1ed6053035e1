//! Peaks of single modes in the loops, and how each is stabilised: by gain or by phase.
//!
//! What mode a pole belongs to is not known here.

use super::Settings;
use super::assess::{CROSSING, EXTREME, is_away};
use super::contour::{Curve, Error};
use super::loops::{Sample, decibels, from_critical};
use super::search;
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

/// The peaks of every lightly damped pole beyond the contour's arc, in each axis.
pub(super) fn peaks(
    curve: &Curve,
    poles: &[Complex<f64>],
    stable: bool,
    settings: &Settings,
    at: &mut impl FnMut(f64) -> Result<Sample, Error>,
) -> Result<Vec<Peak>, Error> {
    let radius = curve.contour.radius_rad_s;
    let mut peaks = Vec::new();
    for &pole in poles {
        let light = pole.im > radius && pole.re.abs() <= settings.light_damping_ratio * pole.norm();
        if !light {
            continue;
        }
        let half = WINDOW * pole.re.abs();
        let lowest = (pole.im - half).max(radius);
        let place = |omega: f64| curve.contour.place(omega);
        let from = curve.samples.partition_point(|sample| sample.place < place(lowest));
        let to = curve.samples.partition_point(|sample| sample.place <= place(pole.im + half));
        for axis in 0..3 {
            peaks.extend(peak(curve, from..to, pole, axis, stable, settings, at)?);
        }
    }
    Ok(peaks)
}

/// The peak of one axis among the samples of a window; none where the window is beyond the curve.
fn peak(
    curve: &Curve,
    window: std::ops::Range<usize>,
    pole: Complex<f64>,
    axis: usize,
    stable: bool,
    settings: &Settings,
    at: &mut impl FnMut(f64) -> Result<Sample, Error>,
) -> Result<Option<Peak>, Error> {
    let size = |index: usize| curve.samples[index].broken[axis].norm_sqr();
    let Some(top) = window.clone().max_by(|&a, &b| size(a).total_cmp(&size(b))) else {
        return Ok(None);
    };
    let mut highest = curve.samples[top];
    let inside = top > window.start && top + 1 < window.end;
    if inside && decibels(highest.broken[axis]) > SEARCHED_DB {
        let bracket = [curve.samples[top - 1].place, curve.samples[top + 1].place];
        let start = (highest.place, decibels(highest.broken[axis]));
        let (place, _) =
            search::maximum(bracket, start, EXTREME, |t| Ok(decibels(at(t)?.broken[axis])))?;
        highest = at(place)?;
    }
    let l = highest.broken[axis];
    let stabilised = if decibels(l) < -settings.gain_margin_db {
        Stabilised::Gain
    } else if stable && keeps_away(&curve.samples, top, axis, settings, at)? {
        Stabilised::Phase
    } else {
        Stabilised::Neither
    };
    Ok(Some(Peak {
        pole,
        axis,
        peak_db: decibels(l),
        omega_rad_s: highest.omega_rad_s(),
        from_critical_deg: from_critical(l).to_degrees(),
        stabilised,
    }))
}

/// Whether a loop keeps its phase margin in the lobe around the sample `top`: at the samples whose gain
/// is within the gain margin of 0 dB, and where it enters and leaves that band between them.
fn keeps_away(
    samples: &[Sample],
    top: usize,
    axis: usize,
    settings: &Settings,
    at: &mut impl FnMut(f64) -> Result<Sample, Error>,
) -> Result<bool, Error> {
    let gain = |sample: &Sample| decibels(sample.broken[axis]);
    let most = settings.gain_margin_db;
    let safe = |sample: &Sample| {
        gain(sample).abs() > most || is_away(sample.broken[axis], settings.phase_margin_deg)
    };
    let up = samples[top..].iter().take_while(|sample| gain(sample) >= -most).count();
    let down = samples[..top].iter().rev().take_while(|sample| gain(sample) >= -most).count();
    // With the neighbours outside, where there are any.
    let lobe = &samples[(top - down).saturating_sub(1)..(top + up + 1).min(samples.len())];
    if !lobe.iter().all(safe) {
        return Ok(false);
    }
    for pair in lobe.windows(2).filter(|pair| pair[0].place >= 1.0) {
        for level in [-most, most] {
            let ends = [gain(&pair[0]) - level, gain(&pair[1]) - level];
            if (ends[0] < 0.0) != (ends[1] < 0.0) {
                let between = [pair[0].place, pair[1].place];
                let place = search::zero(between, ends, CROSSING, |t| Ok(gain(&at(t)?) - level))?;
                if !is_away(at(place)?.broken[axis], settings.phase_margin_deg) {
                    return Ok(false);
                }
            }
        }
    }
    Ok(true)
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
