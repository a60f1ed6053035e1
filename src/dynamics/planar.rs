//! The planar pair (1)–(4): one gimballed nozzle on a second-order actuator and one bending mode.
//!
//! It stands alone: nothing here is drawn, and the three-dimensional model does not use it.

use super::NozzleJet;
use nalgebra::linalg::Schur;
use nalgebra::{Complex, Matrix4};

/// The numbers of the planar pair as a user gives them; SI units, `φ` and `ψ` mass-normalised.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Nozzle inertia about the pivot J, kg·m².
    pub inertia_kg_m2: f64,
    /// Damping ratio of the actuator ζ_n, −.
    pub actuator_damping_ratio: f64,
    /// Natural frequency of the actuator ω_n, rad/s.
    pub actuator_omega_rad_s: f64,
    /// Damping ratio of the bending mode ζ_b, −.
    pub mode_damping_ratio: f64,
    /// Natural frequency of the bending mode ω_b, rad/s.
    pub mode_omega_rad_s: f64,
    /// Inertial coupling Υ = J ψ + S φ, kg^1/2·m.
    pub coupling: f64,
    /// Gimbal shape φ, kg^-1/2.
    pub shape: f64,
    /// Gimbal slope ψ, rad/m per kg^1/2; it only matters with jet damping.
    pub slope: f64,
    /// Thrust R, N.
    pub thrust_n: f64,
    /// Nozzle jet damping.
    pub nozzle_jet: NozzleJet,
    /// Mass flow ṁ, kg/s.
    pub mass_flow_kg_s: f64,
    /// Nozzle length L_n, m.
    pub nozzle_length_m: f64,
}

/// Why parameters are no planar pair.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Refusal {
    /// A parameter is not finite or outside its range.
    #[error("{name}: found {found}; allowed: {allowed}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// What was given.
        found: f64,
        /// What is allowed.
        allowed: &'static str,
    },
    /// The mass matrix [[J, Υ], [Υ, 1]] is not positive definite: no such pair exists.
    #[error(
        "the mass matrix is not positive definite: J − Υ² = {determinant}; allowed: above zero, \
         that is |Υ| < √J"
    )]
    Mass {
        /// Determinant J − Υ².
        determinant: f64,
    },
}

/// Where thrust makes the pair unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CriticalThrust {
    /// Stable below this thrust and unstable just above it, N.
    At(f64),
    /// Stable at every thrust.
    Never,
    /// Not asymptotically stable even without thrust.
    UnstableWithoutThrust,
}

/// What the first column of the Routh array says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every entry is positive: all poles lie in the open left half plane.
    Stable,
    /// The sign changes so many times: so many poles lie in the right half plane.
    Unstable(usize),
    /// An entry is zero: poles lie on the imaginary axis or mirrored about it.
    Marginal,
}

/// A validated planar pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planar(Parameters);

impl Planar {
    /// Checks the parameters.
    ///
    /// # Errors
    /// Values that are not finite or not physical, a mass matrix that is not positive definite.
    pub fn new(parameters: Parameters) -> Result<Self, Refusal> {
        let p = &parameters;
        let positive = [
            ("inertia J", p.inertia_kg_m2),
            ("actuator frequency ω_n", p.actuator_omega_rad_s),
            ("mode frequency ω_b", p.mode_omega_rad_s),
        ];
        let not_negative = [
            ("actuator damping ratio ζ_n", p.actuator_damping_ratio),
            ("mode damping ratio ζ_b", p.mode_damping_ratio),
            ("thrust R", p.thrust_n),
            ("mass flow", p.mass_flow_kg_s),
            ("nozzle length", p.nozzle_length_m),
        ];
        let any = [("coupling Υ", p.coupling), ("shape φ", p.shape), ("slope ψ", p.slope)];
        let check = |values: &[(&'static str, f64)], holds: fn(f64) -> bool, allowed| match values
            .iter()
            .find(|(_, x)| !(x.is_finite() && holds(*x)))
        {
            Some(&(name, found)) => Err(Refusal::Value { name, found, allowed }),
            None => Ok(()),
        };
        check(&positive, |x| x > 0.0, "a finite number > 0")?;
        check(&not_negative, |x| x >= 0.0, "a finite number ≥ 0")?;
        check(&any, |_| true, "a finite number")?;
        let determinant = p.inertia_kg_m2 - p.coupling * p.coupling;
        if !(determinant > 0.0) {
            return Err(Refusal::Mass { determinant });
        }
        Ok(Self(parameters))
    }

    /// The same pair at another thrust, N.
    ///
    /// # Errors
    /// A thrust that is not finite or negative.
    pub fn with_thrust(&self, thrust_n: f64) -> Result<Self, Refusal> {
        Self::new(Parameters { thrust_n, ..self.0 })
    }

    /// Actuator stiffness K = J ω_n², N·m/rad.
    pub fn stiffness_n_m_rad(&self) -> f64 {
        self.0.inertia_kg_m2 * self.0.actuator_omega_rad_s.powi(2)
    }

    /// Actuator damping C = 2 ζ_n ω_n J, N·m·s/rad.
    pub fn damping_n_m_s_rad(&self) -> f64 {
        2.0 * self.0.actuator_damping_ratio * self.0.actuator_omega_rad_s * self.0.inertia_kg_m2
    }

    /// Damping matrix of the coordinates (β, η), nozzle jet damping included.
    ///
    /// Jet damping exact for a rigid nozzle with straight flow adds, on the right-hand side,
    /// `−ṁ(2 L_n φ + L_n² ψ)(ψ η̇ + β̇)` to the η row and `−ṁ L_n² (ψ η̇ + β̇)` to the β row;
    /// equation (13) is its part linear in L_n.
    fn damping(&self) -> [[f64; 2]; 2] {
        let p = &self.0;
        let (flow, length) = (p.mass_flow_kg_s, p.nozzle_length_m);
        let (beta_row, eta_row) = match p.nozzle_jet {
            NozzleJet::Off => (0.0, 0.0),
            NozzleJet::Linear => (0.0, flow * 2.0 * length * p.shape),
            NozzleJet::RigidNozzle => (
                flow * length * length,
                flow * (2.0 * length * p.shape + length * length * p.slope),
            ),
        };
        [
            [self.damping_n_m_s_rad() + beta_row, beta_row * p.slope],
            [eta_row, 2.0 * p.mode_damping_ratio * p.mode_omega_rad_s + eta_row * p.slope],
        ]
    }

    /// Coefficients a_0 … a_4 of the characteristic quartic
    /// `det [[J s² + C s + K, Υ s²], [Υ s² + φ R, s² + 2ζ_b ω_b s + ω_b²]]`, with the jet damping
    /// entries where they are on.
    pub fn quartic(&self) -> [f64; 5] {
        let p = &self.0;
        let [[c11, c12], [c21, c22]] = self.damping();
        let (j, k) = (p.inertia_kg_m2, self.stiffness_n_m_rad());
        let (y, w2) = (p.coupling, p.mode_omega_rad_s.powi(2));
        let push = p.shape * p.thrust_n;
        [
            k * w2,
            c11 * w2 + k * c22 - c12 * push,
            j * w2 + c11 * c22 + k - y * push - c12 * c21,
            c11 + j * c22 - y * (c12 + c21),
            j - y * y,
        ]
    }

    /// First column of the Routh array, from a_4 to a_0; `None` where a zero ends it early.
    pub fn routh_column(&self) -> Option<[f64; 5]> {
        let [a0, a1, a2, a3, a4] = self.quartic();
        let b1 = a2 - a4 * a1 / a3;
        let c1 = a1 - a3 * a0 / b1;
        let column = [a4, a3, b1, c1, a0];
        column.iter().all(|x| x.is_finite() && *x != 0.0).then_some(column)
    }

    /// What the Routh array says about stability.
    pub fn verdict(&self) -> Verdict {
        match self.routh_column() {
            None => Verdict::Marginal,
            Some(column) => match column.windows(2).filter(|w| w[0] * w[1] < 0.0).count() {
                0 => Verdict::Stable,
                changes => Verdict::Unstable(changes),
            },
        }
    }

    /// Bound (4) on the thrust, `J (ω_n² + (2ζ_n ω_n)(2ζ_b ω_b) + ω_b²) / (Υ φ)`, N; `None` where
    /// Υφ ≤ 0. Necessary only (a_2 > 0 of the pair without jet damping), and very loose.
    pub fn necessary_bound_n(&self) -> Option<f64> {
        let p = &self.0;
        let destabilising = p.coupling * p.shape;
        let mode = 2.0 * p.mode_damping_ratio * p.mode_omega_rad_s;
        (destabilising > 0.0).then(|| {
            (self.stiffness_n_m_rad()
                + self.damping_n_m_s_rad() * mode
                + p.inertia_kg_m2 * p.mode_omega_rad_s.powi(2))
                / destabilising
        })
    }

    /// Limit of the critical thrust as ζ_b → 0 without jet damping, `Υ ω_b²/φ`, N, whatever the
    /// actuator; `None` where Υφ ≤ 0.
    pub fn undamped_bound_n(&self) -> Option<f64> {
        let p = &self.0;
        (p.coupling * p.shape > 0.0).then(|| p.coupling * p.mode_omega_rad_s.powi(2) / p.shape)
    }

    /// Critical thrust from the whole Routh array: necessary and sufficient.
    ///
    /// With a_1 and a_2 linear in R the pair is stable where a_3, a_1 and
    /// `a_1 (a_2 a_3 − a_1 a_4) − a_3² a_0` are positive, so it is lost at the least positive
    /// root of the last (where a_1 = 0 it is negative already); without jet damping that is
    /// `[J ω_b² + 2ζ_b ω_b C + K − a_4 a_1/a_3 − a_3 a_0/a_1] / (Υ φ)`.
    pub fn critical_thrust(&self) -> CriticalThrust {
        let at = |thrust_n| Self(Parameters { thrust_n, ..self.0 });
        let still = at(0.0);
        if still.verdict() != Verdict::Stable {
            return CriticalThrust::UnstableWithoutThrust;
        }
        let [a0, a1, a2, a3, a4] = still.quartic();
        let slope_1 = self.damping()[0][1] * self.0.shape;
        let slope_2 = self.0.coupling * self.0.shape;
        // (a1 − s1 R)((a2 − s2 R) a3 − (a1 − s1 R) a4) − a3² a0 = c − b R + a R².
        let c = a1 * (a2 * a3 - a1 * a4) - a3 * a3 * a0;
        let b = a1 * (slope_2 * a3 - slope_1 * a4) + slope_1 * (a2 * a3 - a1 * a4);
        let a = slope_1 * (slope_2 * a3 - slope_1 * a4);
        // Both roots as c over a sum without cancellation of the smaller one.
        let discriminant = b * b - 4.0 * a * c;
        let root = discriminant.sqrt();
        let candidates = [2.0 * c / (b + root), 2.0 * c / (b - root)];
        candidates
            .into_iter()
            .filter(|r| r.is_finite() && *r > 0.0)
            .min_by(f64::total_cmp)
            .map_or(CriticalThrust::Never, CriticalThrust::At)
    }

    /// Tail-wags-dog frequency `√(R φ / Υ)`, rad/s, where thrust and inertia of the nozzle cancel:
    /// thrust destabilises a mode below it. `None` where Rφ/Υ is not positive.
    pub fn tail_wags_dog_rad_s(&self) -> Option<f64> {
        let square = self.0.thrust_n * self.0.shape / self.0.coupling;
        (square.is_finite() && square > 0.0).then(|| square.sqrt())
    }

    /// First-order damping ratio added to the mode by the coupling,
    /// `C Υ ω_b (Υ ω_b² − φR) / (2[(K − J ω_b²)² + C² ω_b²])`, without jet damping; good where the
    /// coupling is weak. `None` for an undamped actuator in resonance with the mode.
    pub fn first_order_added_damping(&self) -> Option<f64> {
        let p = &self.0;
        let (c, w) = (self.damping_n_m_s_rad(), p.mode_omega_rad_s);
        let detuning = self.stiffness_n_m_rad() - p.inertia_kg_m2 * w * w;
        let added = c * p.coupling * w * (p.coupling * w * w - p.shape * p.thrust_n)
            / (2.0 * (detuning * detuning + c * c * w * w));
        added.is_finite().then_some(added)
    }

    /// The four poles, rad/s, by ascending |Im s| and then Re s; conjugate pairs have the pole
    /// above the axis first. `None` if the iteration does not converge.
    pub fn poles(&self) -> Option<[Complex<f64>; 4]> {
        let a = self.quartic();
        // In t = s/σ the product of the roots is one: a companion matrix without large entries.
        let sigma = (a[0] / a[4]).sqrt().sqrt();
        let monic: [f64; 5] = std::array::from_fn(|i| a[i] / a[4] / sigma.powi(4 - i as i32));
        if !monic.iter().all(|x| x.is_finite()) {
            return None;
        }
        let p = &self.0;
        let omegas = [p.actuator_omega_rad_s / sigma, p.mode_omega_rad_s / sigma];
        let zetas = [p.actuator_damping_ratio, p.mode_damping_ratio];
        // Without coupling these are the factors themselves.
        let apart = std::array::from_fn(|i| [2.0 * zetas[i] * omegas[i], omegas[i] * omegas[i]]);
        let start = match factors(&monic, apart) {
            Some(factors) => {
                let [[a, b], [c, d]] = factors.map(roots);
                [a, b, c, d]
            }
            None => eigenvalues(&monic)?,
        };
        let mut poles = start;
        for i in 0..4 {
            poles[i] = if i > 0 && start[i] == start[i - 1].conj() {
                poles[i - 1].conj()
            } else {
                polish(&monic, start[i]) * sigma
            };
        }
        let key = |p: &Complex<f64>| (p.im.abs(), p.re, -p.im);
        poles.sort_by(|x, y| {
            let ((x0, x1, x2), (y0, y1, y2)) = (key(x), key(y));
            x0.total_cmp(&y0).then(x1.total_cmp(&y1)).then(x2.total_cmp(&y2))
        });
        Some(poles)
    }
}

/// The quadratics `t² + b t + c` whose product is a monic quartic, as `[b, c]`, from others near
/// them: Newton's steps on the coefficients of the product.
///
/// They are taken only if their product has the quartic's coefficients to rounding, so that their
/// roots are those of a quartic as near as any computed eigenvalues'; `None` where the steps do not
/// get there, as they may not where the quadratics share a root.
fn factors(monic: &[f64; 5], apart: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    // Each coefficient is a sum of at most three rounded products or terms, and rounded itself.
    const ROUNDING: f64 = 4.0 * f64::EPSILON;
    // Quadratic convergence: what is not found by then is not on its way.
    const STEPS: usize = 20;
    let [[mut b, mut c], [mut d, mut e]] = apart;
    for _ in 0..STEPS {
        let product = [c * e, b * e + d * c, c + e + b * d, b + d];
        let [bs, cs, ds, es] = [b, c, d, e].map(f64::abs);
        let size = [cs * es, bs * es + ds * cs, cs + es + bs * ds, bs + ds];
        let left: [f64; 4] = std::array::from_fn(|i| monic[i] - product[i]);
        if (0..4).all(|i| left[i].abs() <= ROUNDING * size[i]) {
            return Some([[b, c], [d, e]]);
        }
        // db + dd = left₃, dc + de + d db + b dd = left₂, e db + b de + c dd + d dc = left₁,
        // e dc + c de = left₀, with dd and de eliminated; the determinant is the resultant.
        let rest = left[2] - b * left[3];
        let (h, g) = (b - d, e - c);
        let (r1, r0) = (left[1] - b * rest - c * left[3], left[0] - c * rest);
        let determinant = (g + b * h) * g + c * h * h;
        let db = (r1 * g + r0 * h) / determinant;
        let dc = ((g + b * h) * r0 - c * h * r1) / determinant;
        let dd = left[3] - db;
        let de = rest - dc + h * db;
        (b, c, d, e) = (b + db, c + dc, d + dd, e + de);
    }
    None
}

/// The roots of `t² + b t + c`, of a conjugate pair the one above the axis first.
fn roots([b, c]: [f64; 2]) -> [Complex<f64>; 2] {
    let half = b / 2.0;
    let under = half * half - c;
    if under < 0.0 {
        let above = Complex::new(-half, (-under).sqrt());
        return [above, above.conj()];
    }
    // The farther root is a sum of equal signs; the product of both is c.
    let far = -(half + under.sqrt().copysign(half));
    let near = if far == 0.0 { 0.0 } else { c / far };
    [far, near].map(Complex::from)
}

/// The roots of a monic quartic as the eigenvalues of its companion matrix; `None` if the iteration
/// does not converge.
fn eigenvalues(monic: &[f64; 5]) -> Option<[Complex<f64>; 4]> {
    let mut companion = Matrix4::zeros();
    for i in 0..4 {
        companion[(i, 3)] = -monic[i];
        if i > 0 {
            companion[(i, i - 1)] = 1.0;
        }
    }
    let found = Schur::try_new(companion, f64::EPSILON, 1000)?.complex_eigenvalues();
    Some(std::array::from_fn(|i| found[i]))
}

/// Newton's steps on a monic quartic as long as they make the residual smaller.
fn polish(monic: &[f64; 5], mut root: Complex<f64>) -> Complex<f64> {
    let value = |s: Complex<f64>| {
        monic
            .iter()
            .rev()
            .fold((Complex::<f64>::ZERO, Complex::<f64>::ZERO), |(p, d), &a| (p * s + a, d * s + p))
    };
    let (mut residual, mut slope) = value(root);
    // From an eigenvalue, good to half the digits or better, two steps reach the last one.
    for _ in 0..4 {
        let next = root - residual / slope;
        let (p, d) = value(next);
        if !(p.norm_sqr() < residual.norm_sqr()) {
            break;
        }
        (root, residual, slope) = (next, p, d);
    }
    root
}

#[cfg(test)]
mod tests;
