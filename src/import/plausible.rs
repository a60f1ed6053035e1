//! Whether the numbers of a model look like the units that were declared.
//!
//! It judges and suggests; it converts nothing.

use super::units::UnitSystem;

/// A quantity and its ranges: outside the inner one, which holds launchers and laboratory models
/// alike, a value is doubtful, outside the outer one refused.
struct Range {
    what: &'static str,
    unit: &'static str,
    inner: (f64, f64),
    outer: (f64, f64),
}

/// Largest extent: from a laboratory beam to thrice the tallest launcher.
const LENGTH: Range =
    Range { what: "the grids extend over", unit: "m", inner: (0.3, 400.0), outer: (0.01, 4000.0) };

/// First elastic frequency times length. A slender free beam has 3.56 c r/L with the speed of
/// sound c, 5000 m/s in metals, and a radius of gyration r from a thousandth of the length, with
/// liquids and light shells still a tenth of it, to a quarter.
const SPEED: Range = Range {
    what: "first elastic frequency times extent is",
    unit: "Hz·m",
    inner: (1.0, 2e4),
    outer: (0.03, 6e5),
};

/// Mass over the cube of the length: a launcher has about 1 kg/m³, a slender rod 10⁻², a compact
/// piece of steel 8000.
const DENSITY: Range = Range {
    what: "mass over extent cubed is",
    unit: "kg/m³",
    inner: (1e-3, 2e4),
    outer: (1e-6, 1e6),
};

/// What the model looks like in SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Largest extent of the grids, m.
    pub extent_m: f64,
    /// First elastic frequency, Hz.
    pub first_hz: f64,
    /// Mass by the rigid-body modes or the lumped masses, kg, where the file tells one.
    pub mass_kg: Option<f64>,
}

/// The judgement on a model.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Judgement {
    /// Doubtful values, one sentence each.
    pub doubtful: Vec<String>,
    /// Impossible values, one sentence each.
    pub refused: Vec<String>,
}

impl Look {
    fn values(&self) -> impl Iterator<Item = (&'static Range, f64)> {
        let speed = self.first_hz * self.extent_m;
        let density = self.mass_kg.map(|m| (&DENSITY, m / self.extent_m.powi(3)));
        [(&LENGTH, self.extent_m), (&SPEED, speed)].into_iter().chain(density)
    }

    fn fits(&self) -> bool {
        self.values().all(|(range, value)| range.inner.0 <= value && value <= range.inner.1)
    }

    /// The same model had its numbers been in `other` instead of `declared`.
    fn instead(
        &self,
        declared: UnitSystem,
        other: UnitSystem,
        wtmass: Option<f64>,
    ) -> Option<Self> {
        let usual = |system| match system {
            UnitSystem::InLbm => wtmass.or(Some(0.00259)),
            _ => None,
        };
        let from = declared.units(usual(declared)).ok()?;
        let to = other.units(usual(other)).ok()?;
        Some(Self {
            extent_m: self.extent_m / from.length_m * to.length_m,
            first_hz: self.first_hz,
            mass_kg: self.mass_kg.map(|m| m / from.mass_kg * to.mass_kg),
        })
    }

    /// What does not look like `declared`, and which systems it looks like.
    pub fn judge(&self, declared: UnitSystem, wtmass: Option<f64>) -> Judgement {
        let mut judgement = Judgement::default();
        let others: Vec<&str> = (UnitSystem::ALL.into_iter())
            .filter(|&other| other != declared)
            .filter(|&other| self.instead(declared, other, wtmass).is_some_and(|look| look.fits()))
            .map(UnitSystem::word)
            .collect();
        let hint = match others.as_slice() {
            [] => String::new(),
            others => format!("; the numbers would look right in {}", others.join(" or ")),
        };
        for (range, value) in self.values() {
            let inside = |(low, high): (f64, f64)| low <= value && value <= high;
            let said = format!(
                "{} {value:.4e} {} with units = \"{}\"{hint}",
                range.what,
                range.unit,
                declared.word()
            );
            if !inside(range.outer) {
                judgement.refused.push(said);
            } else if !inside(range.inner) {
                judgement.doubtful.push(said);
            }
        }
        judgement
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A heavy launcher.
    const LAUNCHER: Look = Look { extent_m: 94.0, first_hz: 1.2, mass_kg: Some(1.9e6) };

    #[test]
    fn a_launcher_and_a_laboratory_beam_look_right_in_their_own_units() {
        let beam = Look { extent_m: 1.0, first_hz: 51.0, mass_kg: Some(0.785) };
        for look in [LAUNCHER, beam] {
            assert_eq!(look.judge(UnitSystem::Si, None), Judgement::default());
        }
    }

    #[test]
    fn millimetres_and_tonnes_taken_for_si_are_refused_with_what_would_fit() {
        let raw = Look { extent_m: 94_000.0, first_hz: 1.2, mass_kg: Some(1900.0) };
        let judgement = raw.judge(UnitSystem::Si, None);
        assert!(!judgement.refused.is_empty());
        assert!(judgement.refused.iter().all(|s| s.contains("mm-t-s")), "{judgement:?}");
    }

    #[test]
    fn metres_taken_for_millimetres_are_refused() {
        let read = Look { extent_m: 0.094, first_hz: 1.2, mass_kg: Some(1.9e9) };
        let judgement = read.judge(UnitSystem::MmTS, None);
        assert!(judgement.refused.iter().any(|s| s.contains("kg/m³")), "{judgement:?}");
    }

    #[test]
    fn what_is_not_a_number_is_refused() {
        let judgement = Look { extent_m: f64::NAN, ..LAUNCHER }.judge(UnitSystem::Si, None);
        assert_eq!(judgement.refused.len(), 3);
    }
}
