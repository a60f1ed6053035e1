//! Margins: what the frequency response of the flight control loops says about their stability.
//!
//! Pure functions of a 3×3 loop matrix; what the plant and the filters are is decided in `dynamics`, and
//! how cases are summed up in `campaign`.
//!
//! **Sign.** `G(s) = F(s) P(s)`: P from the three axis commands (all loops broken, servo loops closed)
//! to the sensor outputs, F the autopilot from the sensor outputs to what it *takes away*
//! from the commands (`command = −F y`). The closed loop is `det(1 + G) = 0`, and −1 is the critical
//! point of each loop.
//!
//! **Broken loop.** The loop of axis a with the others closed is the Schur complement
//! `L_a = G_aa − G_ab (1 + G_bb)⁻¹ G_ba`, b the other two axes, so that
//! `1 + L_a = det(1 + G)/det(1 + G_bb)`. Delays are exact, `e^{−sτ}`.
//!
//! **Contour.** Half of Nyquist's: from `s = ε` on the real axis along a quarter circle to jε (which leaves
//! poles at zero, rigid ones and integrators, on its left), then up the imaginary axis to where
//! the loops have died out. The number of closed-loop poles in the right half plane is that of
//! the broken loops less `Δarg det(1 + G)/π` over that half.
//!
//! **Limits.** Gain margins and the ellipse distance end at [`GAIN_CAP_DB`] and [`DISTANCE_CAP`], phase
//! margins at 180°, delay margins at [`DELAY_CAP_S`], disk margins at 2: a loop that never crosses has
//! the limit. An unstable closed loop has no margin: all are zero.

pub mod assess;
pub mod contour;
pub mod envelope;
pub mod loops;
pub mod peak;
pub mod rational;
mod search;

pub use assess::{Assessment, AxisMargins, Margin, assess};
pub use contour::{Curve, Error, scan};
pub use loops::{AXES, Sample};
pub use peak::{Peak, Stabilised};
pub use rational::Rational;

/// Largest gain margin reported, dB: beyond it |L| is not followed from crossing to crossing.
pub const GAIN_CAP_DB: f64 = 40.0;

/// Largest delay margin reported, s.
pub const DELAY_CAP_S: f64 = 10.0;

/// Largest distance from the Nichols ellipse reported, in units of the ellipse.
pub const DISTANCE_CAP: f64 = 10.0;

/// What is asked of the loops, and where they are looked at.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Settings {
    /// Gain margin of a rigid body and the height of the Nichols ellipse, dB.
    pub gain_margin_db: f64,
    /// Phase margin of a rigid body and the half width of the Nichols ellipse, degrees.
    pub phase_margin_deg: f64,
    /// Radius ε of the contour about zero, Hz; it shrinks to a tenth of the least pole that is not zero.
    pub lowest_hz: f64,
    /// Upper end of the frequencies, Hz; it grows to twice the highest lightly damped pole, and to
    /// where the loops have died out.
    pub highest_hz: f64,
    /// Frequencies a decade before refinement.
    pub points_per_decade: u32,
    /// Damping ratio below which a pole is a resonance, −.
    pub light_damping_ratio: f64,
}

impl Default for Settings {
    /// 6 dB and 30°, 1 mHz to 100 Hz by 40 a decade, resonances below a damping ratio of 0.1.
    fn default() -> Self {
        Self {
            gain_margin_db: 6.0,
            phase_margin_deg: 30.0,
            lowest_hz: 1e-3,
            highest_hz: 100.0,
            points_per_decade: 40,
            light_damping_ratio: 0.1,
        }
    }
}
