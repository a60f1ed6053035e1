//! Filters of an autopilot: kinds, exact frequency response, realisation with states.
//!
//! Which signals pass a filter is known to the autopilot.

use super::{StateSpace, TransferFunction, delay};
use nalgebra::{Complex, DMatrix};
use std::sync::Arc;

/// What a filter does; gains are one at zero frequency unless said otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum FilterKind {
    /// A factor, −.
    Gain(f64),
    /// `1/(1 + s/ω)`.
    Lag {
        /// ω, rad/s.
        omega_rad_s: f64,
    },
    /// `(1 + s/ω_z)/(1 + s/ω_p)`.
    LeadLag {
        /// ω_z, rad/s.
        zero_rad_s: f64,
        /// ω_p, rad/s.
        pole_rad_s: f64,
    },
    /// `(s²/ω_z² + 2ζ_z s/ω_z + 1)/(s²/ω_p² + 2ζ_p s/ω_p + 1)`: a notch where ω_z = ω_p.
    Bending {
        /// ω_z, rad/s.
        zero_rad_s: f64,
        /// ζ_z, −.
        zero_damping: f64,
        /// ω_p, rad/s.
        pole_rad_s: f64,
        /// ζ_p, −.
        pole_damping: f64,
    },
    /// `1/(s²/ω² + 2ζ s/ω + 1)`.
    LowPass {
        /// ω, rad/s.
        omega_rad_s: f64,
        /// ζ, −.
        damping: f64,
    },
    /// Any proper ratio.
    Rational(Arc<TransferFunction>),
    /// `1/s`.
    Integrator,
    /// `e^(−sτ)`; with states its Padé approximation [n/n].
    Delay {
        /// τ, s.
        delay_s: f64,
        /// n.
        order: usize,
    },
}

/// A filter by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    /// Name inside its path.
    pub name: String,
    /// What it does.
    pub kind: FilterKind,
}

/// What a draw makes of a filter: `gain · G(s/frequency)` with all damping ratios times `damping`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterDraw {
    /// Factor on the filter, −.
    pub gain: f64,
    /// Factor on its frequencies, −.
    pub frequency: f64,
    /// Factor on its damping ratios, −.
    pub damping: f64,
    /// τ of a delay, s.
    pub delay_s: f64,
}

impl FilterKind {
    /// The draw that leaves the filter as it is.
    pub fn nominal(&self) -> FilterDraw {
        let delay_s = match self {
            Self::Delay { delay_s, .. } => *delay_s,
            _ => 0.0,
        };
        FilterDraw { gain: 1.0, frequency: 1.0, damping: 1.0, delay_s }
    }

    /// Whether it has frequencies.
    pub fn has_frequency(&self) -> bool {
        !matches!(self, Self::Gain(_) | Self::Delay { .. })
    }

    /// Whether it has damping ratios.
    pub fn has_damping(&self) -> bool {
        matches!(self, Self::Bending { .. } | Self::LowPass { .. })
    }

    /// Whether it is a delay with states.
    pub fn has_delay(&self) -> bool {
        matches!(self, Self::Delay { delay_s, .. } if *delay_s != 0.0)
    }

    /// Number of states; the same for every draw.
    pub fn order(&self) -> usize {
        match self {
            Self::Gain(_) => 0,
            Self::Lag { .. } | Self::LeadLag { .. } | Self::Integrator => 1,
            Self::Bending { .. } | Self::LowPass { .. } => 2,
            Self::Rational(function) => function.order(),
            Self::Delay { order, .. } => {
                if self.has_delay() {
                    *order
                } else {
                    0
                }
            }
        }
    }

    /// Number of poles at exactly zero; the same for every draw.
    pub fn poles_at_origin(&self) -> usize {
        match self {
            Self::Integrator => 1,
            Self::Rational(function) => function.poles_at_origin(),
            _ => 0,
        }
    }

    /// Exact response at the complex frequency s, rad/s.
    pub fn response(&self, draw: &FilterDraw, s: Complex<f64>) -> Complex<f64> {
        let p = s / draw.frequency;
        let quadratic = |omega: f64, zeta: f64| {
            let x = p / omega;
            x * (x + 2.0 * zeta * draw.damping) + 1.0
        };
        let one = Complex::new(1.0, 0.0);
        draw.gain
            * match self {
                Self::Gain(value) => one * *value,
                Self::Lag { omega_rad_s } => one / (p / omega_rad_s + 1.0),
                Self::LeadLag { zero_rad_s, pole_rad_s } => {
                    (p / zero_rad_s + 1.0) / (p / pole_rad_s + 1.0)
                }
                Self::Bending { zero_rad_s, zero_damping, pole_rad_s, pole_damping } => {
                    quadratic(*zero_rad_s, *zero_damping) / quadratic(*pole_rad_s, *pole_damping)
                }
                Self::LowPass { omega_rad_s, damping } => one / quadratic(*omega_rad_s, *damping),
                Self::Rational(function) => function.response(p),
                Self::Integrator => one / p,
                Self::Delay { .. } => delay::response(draw.delay_s, s),
            }
    }

    /// A realisation with [`FilterKind::order`] states.
    pub fn state_space(&self, draw: &FilterDraw) -> StateSpace {
        let ratio = |numerator: &[f64], denominator: &[f64]| {
            TransferFunction::new(numerator, denominator)
                .expect("filters are proper and their numbers finite")
                .state_space()
        };
        let quadratic =
            |omega: f64, zeta: f64| [1.0 / (omega * omega), 2.0 * zeta * draw.damping / omega, 1.0];
        let system = match self {
            Self::Gain(value) => StateSpace::gain(DMatrix::from_element(1, 1, *value)),
            Self::Lag { omega_rad_s } => ratio(&[1.0], &[1.0 / omega_rad_s, 1.0]),
            Self::LeadLag { zero_rad_s, pole_rad_s } => {
                ratio(&[1.0 / zero_rad_s, 1.0], &[1.0 / pole_rad_s, 1.0])
            }
            Self::Bending { zero_rad_s, zero_damping, pole_rad_s, pole_damping } => {
                let zero = quadratic(*zero_rad_s, *zero_damping);
                ratio(&zero, &quadratic(*pole_rad_s, *pole_damping))
            }
            Self::LowPass { omega_rad_s, damping } => {
                ratio(&[1.0], &quadratic(*omega_rad_s, *damping))
            }
            Self::Rational(function) => function.state_space(),
            Self::Integrator => ratio(&[1.0], &[1.0, 0.0]),
            Self::Delay { order, .. } => delay::pade(draw.delay_s, *order),
        };
        let time_scale = if self.has_frequency() { 1.0 / draw.frequency } else { 1.0 };
        system.scaled(draw.gain, time_scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kinds() -> Vec<FilterKind> {
        let function = TransferFunction::new(&[2.0, 1.0], &[0.01, 0.3, 1.0]).unwrap();
        vec![
            FilterKind::Gain(0.7),
            FilterKind::Lag { omega_rad_s: 20.0 },
            FilterKind::LeadLag { zero_rad_s: 5.0, pole_rad_s: 60.0 },
            FilterKind::Bending {
                zero_rad_s: 32.0,
                zero_damping: 0.02,
                pole_rad_s: 40.0,
                pole_damping: 0.5,
            },
            FilterKind::LowPass { omega_rad_s: 50.0, damping: 0.7 },
            FilterKind::Rational(Arc::new(function)),
            FilterKind::Integrator,
            FilterKind::Delay { delay_s: 0.02, order: 8 },
        ]
    }

    #[test]
    fn a_realisation_has_the_exact_response_of_its_filter() {
        for kind in kinds() {
            let nominal = kind.nominal();
            let drawn = FilterDraw { gain: 1.3, frequency: 0.8, damping: 1.5, ..nominal };
            for draw in [nominal, drawn] {
                let system = kind.state_space(&draw);
                assert_eq!(system.order(), kind.order(), "{kind:?}");
                for omega in [0.3, 4.0, 33.0, 150.0] {
                    let s = Complex::new(0.0, omega);
                    let expected = kind.response(&draw, s);
                    let found = system.response(s).unwrap()[(0, 0)];
                    // The Padé approximation [8/8] is off by (ωτ)^17 (8!)²/(16! 17!) = 3e-11 at ωτ = 3.
                    assert!(
                        (found - expected).norm() < 1e-10 * expected.norm().max(1.0),
                        "{kind:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn a_drawn_filter_is_the_filter_with_drawn_numbers() {
        let kind = FilterKind::LowPass { omega_rad_s: 50.0, damping: 0.7 };
        let same = FilterKind::LowPass { omega_rad_s: 40.0, damping: 0.77 };
        let draw = FilterDraw { frequency: 0.8, damping: 1.1, ..kind.nominal() };
        let s = Complex::new(0.0, 37.0);
        let difference = kind.response(&draw, s) - same.response(&same.nominal(), s);
        assert!(difference.norm() < 1e-15);
    }

    #[test]
    fn a_notch_is_deep_where_its_frequencies_agree() {
        let kind = FilterKind::Bending {
            zero_rad_s: 32.0,
            zero_damping: 0.05,
            pole_rad_s: 32.0,
            pole_damping: 0.5,
        };
        let depth = kind.response(&kind.nominal(), Complex::new(0.0, 32.0));
        assert!((depth - Complex::new(0.1, 0.0)).norm() < 1e-15);
    }
}
