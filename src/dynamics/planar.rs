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
        let mut companion = Matrix4::zeros();
        for i in 0..4 {
            companion[(i, 3)] = -monic[i];
            if i > 0 {
                companion[(i, i - 1)] = 1.0;
            }
        }
        let start = Schur::try_new(companion, f64::EPSILON, 1000)?.complex_eigenvalues();
        let mut poles: [Complex<f64>; 4] = std::array::from_fn(|i| {
            let polished = polish(&monic, Complex::new(start[i].re, start[i].im.abs()));
            let above = start[i].im >= 0.0;
            if above { polished * sigma } else { polished.conj() * sigma }
        });
        let key = |p: &Complex<f64>| (p.im.abs(), p.re, -p.im);
        poles.sort_by(|x, y| {
            let ((x0, x1, x2), (y0, y1, y2)) = (key(x), key(y));
            x0.total_cmp(&y0).then(x1.total_cmp(&y1)).then(x2.total_cmp(&y2))
        });
        Some(poles)
    }
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
        if !(p.norm() < residual.norm()) {
            break;
        }
        (root, residual, slope) = (next, p, d);
    }
    root
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::{
        Attachment, DrawnBody, DrawnEngine, DrawnVehicle, Effects, Layout, Model, Plant,
    };
    use nalgebra::{Matrix3x2, Vector3};
    use proptest::prelude::*;

    /// The pair of verification case 4.
    fn reference(thrust_n: f64) -> Parameters {
        Parameters {
            inertia_kg_m2: 1.0,
            actuator_damping_ratio: 0.3,
            actuator_omega_rad_s: 1.2,
            mode_damping_ratio: 0.005,
            mode_omega_rad_s: 1.0,
            coupling: 0.2,
            shape: 1.0,
            slope: 0.0,
            thrust_n,
            nozzle_jet: NozzleJet::Off,
            mass_flow_kg_s: 0.0,
            nozzle_length_m: 0.0,
        }
    }

    fn critical(planar: &Planar) -> f64 {
        match planar.critical_thrust() {
            CriticalThrust::At(thrust) => thrust,
            other => panic!("{other:?}"),
        }
    }

    /// The pole above the axis nearest to `near`.
    fn pole(planar: &Planar, near: Complex<f64>) -> Complex<f64> {
        let poles = planar.poles().expect("poles");
        poles.into_iter().min_by(|a, b| (a - near).norm().total_cmp(&(b - near).norm())).unwrap()
    }

    #[test]
    fn the_reference_pair_has_the_stated_bound_and_critical_thrust() {
        let planar = Planar::new(reference(0.0)).unwrap();
        assert!((planar.necessary_bound_n().unwrap() - 12.236).abs() < 1e-12);
        assert!((critical(&planar) - 0.250_205_748_1).abs() < 5e-11);
    }

    #[test]
    fn the_reference_pair_has_the_stated_poles_to_ten_digits() {
        let r_crit = critical(&Planar::new(reference(0.0)).unwrap());
        let cases = [
            (0.0, -0.023_303_280_0, 0.985_032_522_2),
            (0.0, -0.356_905_053_3, 1.190_665_823_6),
            (0.2, -0.004_866_974_0, 0.999_795_464_7),
            (r_crit, 0.0, 1.003_009_171_1),
            (r_crit, -0.380_208_333_3, 1.160_368_344_6),
            (1.0, 0.072_456_015_1, 1.031_622_177_7),
        ];
        for (thrust, re, im) in cases {
            let planar = Planar::new(reference(thrust)).unwrap();
            let found = pole(&planar, Complex::new(re, im));
            assert!((found.re - re).abs() < 5.1e-11 && (found.im - im).abs() < 5.1e-11, "{found}");
        }
    }

    #[test]
    fn at_the_critical_thrust_the_pole_lies_on_the_axis_to_round_off() {
        let planar = Planar::new(reference(0.0)).unwrap();
        let planar = planar.with_thrust(critical(&planar)).unwrap();
        assert!(pole(&planar, Complex::new(0.0, 1.003)).re.abs() < 1e-14);
    }

    #[test]
    fn as_mode_damping_vanishes_the_critical_thrust_is_the_tail_wags_dog_thrust() {
        for (zeta_n, omega_n) in [(0.3, 1.2), (0.05, 3.0), (0.9, 0.4)] {
            let parameters = Parameters {
                actuator_damping_ratio: zeta_n,
                actuator_omega_rad_s: omega_n,
                mode_damping_ratio: 1e-12,
                ..reference(0.0)
            };
            let planar = Planar::new(parameters).unwrap();
            let limit = planar.undamped_bound_n().unwrap();
            assert!((limit - 0.2).abs() < 1e-15);
            assert!((critical(&planar) - limit).abs() < 1e-8);
            let there = planar.with_thrust(limit).unwrap();
            assert!((there.tail_wags_dog_rad_s().unwrap() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn thrust_that_pushes_with_the_motion_never_destabilises() {
        for (coupling, shape) in [(-0.2, 1.0), (0.2, -1.0), (0.0, 1.0), (0.2, 0.0)] {
            let planar = Planar::new(Parameters { coupling, shape, ..reference(1e3) }).unwrap();
            assert_eq!(planar.critical_thrust(), CriticalThrust::Never);
            assert_eq!(planar.verdict(), Verdict::Stable);
            assert_eq!(planar.necessary_bound_n(), None);
        }
        let planar = Planar::new(Parameters { coupling: 0.0, ..reference(1.0) }).unwrap();
        assert_eq!(planar.tail_wags_dog_rad_s(), None);
    }

    #[test]
    fn a_mass_matrix_that_is_not_positive_definite_is_refused() {
        for coupling in [1.0, -1.0, 2.0] {
            let result = Planar::new(Parameters { coupling, ..reference(0.0) });
            assert!(matches!(result, Err(Refusal::Mass { .. })), "{result:?}");
        }
        let result = Planar::new(Parameters { thrust_n: f64::NAN, ..reference(0.0) });
        assert!(matches!(result, Err(Refusal::Value { name: "thrust R", .. })), "{result:?}");
    }

    #[test]
    fn an_undamped_pair_is_marginal_and_has_no_critical_thrust() {
        let parameters =
            Parameters { actuator_damping_ratio: 0.0, mode_damping_ratio: 0.0, ..reference(0.0) };
        let planar = Planar::new(parameters).unwrap();
        assert_eq!(planar.verdict(), Verdict::Marginal);
        assert_eq!(planar.critical_thrust(), CriticalThrust::UnstableWithoutThrust);
        for pole in planar.poles().unwrap() {
            assert!(pole.re.abs() < 1e-14, "{pole}");
        }
    }

    #[test]
    fn the_first_order_added_damping_is_met_to_second_order_in_the_coupling() {
        // The neglected terms are of the order of the fourth power of a coupling of φ and Υ.
        let mut errors = Vec::new();
        for scale in [0.04, 0.02, 0.01] {
            let parameters = Parameters {
                coupling: 0.2 * scale,
                shape: scale,
                mode_damping_ratio: 0.0,
                ..reference(0.5)
            };
            let planar = Planar::new(parameters).unwrap();
            let found = pole(&planar, Complex::new(0.0, 1.0));
            let added = planar.first_order_added_damping().unwrap();
            errors.push((-found.re / found.norm() - added).abs() / added.abs());
        }
        // Each halving of the coupling makes the relative error four times smaller.
        for pair in errors.windows(2) {
            assert!((pair[0] / pair[1] - 4.0).abs() < 0.1, "{errors:?}");
        }
    }

    #[test]
    fn equation_13_is_the_part_of_the_rigid_nozzle_linear_in_its_length() {
        let with = |nozzle_jet, nozzle_length_m| {
            let parameters = Parameters {
                slope: 0.12,
                mass_flow_kg_s: 0.01,
                nozzle_length_m,
                nozzle_jet,
                ..reference(0.1)
            };
            Planar::new(parameters).unwrap().damping()
        };
        let none = with(NozzleJet::Off, 4.0);
        let rest = |length: f64| {
            let (exact, linear) =
                (with(NozzleJet::RigidNozzle, length), with(NozzleJet::Linear, length));
            let square = 0.01 * length * length;
            let expected = [[square, square * 0.12], [square * 0.12, square * 0.12 * 0.12]];
            for i in 0..2 {
                for j in 0..2 {
                    assert!((exact[i][j] - linear[i][j] - expected[i][j]).abs() < 1e-15);
                }
            }
            linear
        };
        let (short, long) = (rest(2.0), rest(4.0));
        for i in 0..2 {
            for j in 0..2 {
                let (one, two) = (short[i][j] - none[i][j], long[i][j] - none[i][j]);
                assert!((two - 2.0 * one).abs() < 1e-15);
            }
        }
        assert!((long[1][0] - 0.08).abs() < 1e-15 && long[0][1] == 0.0);
    }

    #[test]
    fn with_a_rigid_nozzle_jet_the_critical_thrust_still_puts_a_pole_on_the_axis() {
        for nozzle_jet in [NozzleJet::Linear, NozzleJet::RigidNozzle] {
            let parameters = Parameters {
                slope: 0.12,
                mass_flow_kg_s: 0.02,
                nozzle_length_m: 1.5,
                nozzle_jet,
                ..reference(0.0)
            };
            let planar = Planar::new(parameters).unwrap();
            let thrust = critical(&planar);
            let least = |thrust| {
                let poles = planar.with_thrust(thrust).unwrap().poles().unwrap();
                poles.iter().map(|p| p.re).max_by(f64::total_cmp).unwrap()
            };
            assert!(least(thrust).abs() < 1e-14);
            assert!(least(0.99 * thrust) < 0.0 && least(1.01 * thrust) > 0.0);
        }
    }

    #[test]
    fn the_poles_of_an_uncoupled_pair_are_those_of_its_parts() {
        let parameters = Parameters {
            coupling: 0.0,
            actuator_damping_ratio: 1.5,
            actuator_omega_rad_s: 40.0,
            ..reference(0.3)
        };
        let poles = Planar::new(parameters).unwrap().poles().unwrap();
        // Overdamped actuator: −ω(ζ ± √(ζ² − 1)).
        let root = 40.0 * 1.25_f64.sqrt();
        assert!((poles[0].re - (-60.0 - root)).abs() < 1e-11 && poles[0].im == 0.0);
        assert!((poles[1].re - (-60.0 + root)).abs() < 1e-12 && poles[1].im == 0.0);
        assert!((poles[2].re + 0.005).abs() < 1e-14 && poles[2].im > 0.0);
        assert_eq!(poles[3], poles[2].conj());
    }

    /// The three-dimensional model of one engine and one mode, the modal mass
    /// `1 + m φ² + 2 S φψ + J ψ²` replaced by 1, has the same characteristic polynomial.
    #[test]
    fn the_pair_is_the_three_dimensional_model_of_one_engine_and_one_mode() {
        let (m, r, j, phi, psi) = (8100.0, 0.7, 24_000.0, 2.8e-3, 3.4e-4);
        let (thrust, flow, length, omega) = (1.2e7, 4700.0, 4.0, 32.7);
        let (k, c, zeta) = (3.76e7, 5.7e5, 0.005);
        let body_mass = 4.0e5;
        // Rotation about +y moves a point aft of the pivot towards −z, so φ lies along −z.
        let axes = Matrix3x2::from_columns(&[Vector3::y(), Vector3::z()]);
        let plant = Plant {
            layout: Layout::new(["m001"], [("one.engine".to_owned(), ["rock", "tilt"], true)]),
            body_mass_kg: body_mass,
            attachments: vec![Attachment {
                thrust_direction: -Vector3::x(),
                axes,
                shape: vec![-Vector3::z() * phi],
                slope: vec![Vector3::y() * psi],
                case_per_flow: Vec::new(),
                in_modes: false,
            }],
        };
        let drawn = DrawnVehicle {
            body: DrawnBody { frequency_rad_s: vec![omega], damping_ratio: vec![zeta] },
            engines: vec![DrawnEngine {
                thrust_n: thrust,
                mass_flow_kg_s: flow,
                mass_kg: m,
                cg_m: r,
                inertia_kg_m2: j,
                axial_inertia_kg_m2: 1.5e4,
                length_m: length,
                gimbal_stiffness_n_m_rad: [k; 2],
                gimbal_damping_n_m_s_rad: [c; 2],
                shape_gain: vec![1.0],
                slope_gain: vec![1.0],
            }],
        };
        // The mean acceleration stiffens the gimbal by m g0 r, g0 = R/M.
        let stiffness = k + m * r * thrust / (body_mass + m);
        let omega_n = (stiffness / j).sqrt();
        for nozzle_jet in [NozzleJet::Off, NozzleJet::Linear, NozzleJet::RigidNozzle] {
            let effects = Effects {
                thrust: 1.0,
                case_jet_damping: false,
                nozzle_jet_damping: nozzle_jet,
                follower_thrust: false,
            };
            let mut model = Model::zeros(plant.layout.coordinates());
            plant.assemble(&drawn, &effects, &mut model);
            let planar = Planar::new(Parameters {
                inertia_kg_m2: j,
                actuator_damping_ratio: c / (2.0 * j * omega_n),
                actuator_omega_rad_s: omega_n,
                mode_damping_ratio: zeta,
                mode_omega_rad_s: omega,
                coupling: j * psi + m * r * phi,
                shape: phi,
                slope: psi,
                thrust_n: thrust,
                nozzle_jet,
                mass_flow_kg_s: flow,
                nozzle_length_m: length,
            })
            .unwrap();
            for s in [Complex::new(-0.3, 33.0), Complex::new(2.0, 20.0), Complex::new(-9.0, 0.0)] {
                let entry = |a: usize, b: usize| {
                    let mass = if (a, b) == (0, 0) { 1.0 } else { model.mass[(a, b)] };
                    s * s * mass + s * model.damping[(a, b)] + model.stiffness[(a, b)]
                };
                // The mode does not move the second gimbal axis.
                assert!(entry(0, 2).norm() < 1e-9 * entry(0, 1).norm());
                let full = entry(0, 0) * entry(1, 1) - entry(0, 1) * entry(1, 0);
                let quartic =
                    planar.quartic().iter().rev().fold(Complex::<f64>::ZERO, |p, a| p * s + a);
                // Sums of a dozen products of a few rounded factors each, which nearly cancel.
                let terms = planar.quartic().into_iter().zip(0..);
                let size: f64 = terms.map(|(a, i)| a.abs() * s.norm().powi(i)).sum();
                let error = (full - quartic).norm() / size;
                assert!(error < 64.0 * f64::EPSILON, "{nozzle_jet:?} {s}: {error}");
            }
        }
    }

    proptest! {
        #[test]
        fn the_routh_verdict_agrees_with_the_poles_and_the_critical_thrust(
            zeta_n in 0.001..1.2_f64, omega_n in 0.2..5.0_f64, zeta_b in 0.0001..0.1_f64,
            coupling in -0.95..0.95_f64, shape in -1.0..1.0_f64, slope in -0.3..0.3_f64,
            thrust_n in 0.0..5.0_f64, flow in 0.0..0.2_f64, rigid: bool,
        ) {
            let planar = Planar::new(Parameters {
                actuator_damping_ratio: zeta_n, actuator_omega_rad_s: omega_n,
                mode_damping_ratio: zeta_b, coupling, shape, slope,
                mass_flow_kg_s: flow, nozzle_length_m: 2.0,
                nozzle_jet: if rigid { NozzleJet::RigidNozzle } else { NozzleJet::Linear },
                ..reference(thrust_n)
            }).unwrap();
            let poles = planar.poles().unwrap();
            // Vieta: the sum and the product of the roots.
            let [a0, _, _, a3, a4] = planar.quartic();
            let sum: Complex<f64> = poles.iter().sum();
            let product: Complex<f64> = poles.iter().product();
            let size: f64 = poles.iter().map(|p| p.norm()).sum();
            prop_assert!((sum.re + a3 / a4).abs() < 1e-12 * size && sum.im.abs() < 1e-14 * size);
            prop_assert!((product.re * a4 / a0 - 1.0).abs() < 1e-11);
            // A pole nearer to the axis than its rounding has no sign.
            if poles.iter().all(|p| p.re.abs() > 1e-9) {
                let unstable = poles.iter().filter(|p| p.re > 0.0).count();
                let expected = if unstable == 0 { Verdict::Stable } else { Verdict::Unstable(unstable) };
                prop_assert_eq!(planar.verdict(), expected);
                match planar.critical_thrust() {
                    CriticalThrust::Never => prop_assert_eq!(unstable, 0),
                    CriticalThrust::At(r) if thrust_n < r => prop_assert_eq!(unstable, 0),
                    _ => {}
                }
            }
        }
    }
}
