//! Unit systems of finite element models and their factors to SI.
//!
//! Conversion happens once, in `model`; whether numbers look like their units is judged in
//! `plausible`.

use schemars::JsonSchema;
use serde::Deserialize;

/// Metres of an inch, exact by definition.
const INCH_M: f64 = 0.0254;
/// Kilograms of a pound, exact by definition.
const POUND_KG: f64 = 0.453_592_37;
/// Standard gravity in inches: pounds of mass in one lbf·s²/in, 9.80665 m/s² over an inch.
pub const POUNDS_PER_SLINCH: f64 = 9.806_65 / INCH_M;
/// Departure of `wtmass` from 1/386.0886 that rounding in a deck explains: 386.4, 386.0 and 0.00259
/// are all in use.
const WTMASS_ROUNDING: f64 = 2e-3;

/// Units in which a finite element model is written. Time is in seconds, frequency in hertz.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(inline)]
pub enum UnitSystem {
    /// Metre, kilogram, newton.
    Si,
    /// Millimetre, tonne, newton.
    MmTS,
    /// Millimetre, kilogram, millinewton.
    MmKgS,
    /// Inch, pound-force; mass in lbf·s²/in.
    InLbf,
    /// Inch, pound-force; mass in pounds, brought to lbf·s²/in by `wtmass`.
    InLbm,
}

impl UnitSystem {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Si, Self::MmTS, Self::MmKgS, Self::InLbf, Self::InLbm];

    /// The word of the import description.
    pub fn word(self) -> &'static str {
        match self {
            Self::Si => "si",
            Self::MmTS => "mm-t-s",
            Self::MmKgS => "mm-kg-s",
            Self::InLbf => "in-lbf",
            Self::InLbm => "in-lbm",
        }
    }

    /// Factors to SI; `wtmass` belongs to [`UnitSystem::InLbm`] alone.
    ///
    /// # Errors
    /// What is wrong with `wtmass`: missing, not 1/386.1, or without a meaning here.
    pub fn units(self, wtmass: Option<f64>) -> Result<Units, (String, &'static str)> {
        let slinch_kg = POUND_KG * POUNDS_PER_SLINCH;
        let units = match self {
            Self::Si => Units { length_m: 1.0, mass_kg: 1.0, listed_kg: 1.0 },
            Self::MmTS => Units { length_m: 1e-3, mass_kg: 1e3, listed_kg: 1e3 },
            Self::MmKgS => Units { length_m: 1e-3, mass_kg: 1.0, listed_kg: 1.0 },
            Self::InLbf => Units { length_m: INCH_M, mass_kg: slinch_kg, listed_kg: slinch_kg },
            Self::InLbm => {
                let wtmass = wtmass.ok_or((
                    "nothing".to_owned(),
                    "the WTMASS parameter of the deck, 0.00259, with units = \"in-lbm\"",
                ))?;
                if !((wtmass * POUNDS_PER_SLINCH - 1.0).abs() <= WTMASS_ROUNDING) {
                    return Err((
                        format!("{wtmass}"),
                        "1/386.1 = 0.00259 within 0.2 %, by which pounds become lbf·s²/in: with any \
                         other value the frequencies of the model are wrong",
                    ));
                }
                // The deck's own factor made the matrix with which the modes were normalised.
                Units { length_m: INCH_M, mass_kg: POUND_KG / wtmass, listed_kg: POUND_KG }
            }
        };
        match (self, wtmass) {
            (Self::InLbm, _) | (_, None) => Ok(units),
            (_, Some(found)) => Err((format!("{found}"), "no `wtmass` unless units = \"in-lbm\"")),
        }
    }
}

/// Factors from the units of a model to SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Units {
    /// Metres of a unit of length.
    pub length_m: f64,
    /// Kilograms of a unit of generalised mass, that of the mass matrix.
    pub mass_kg: f64,
    /// Kilograms of a unit of the masses listed in files, before `WTMASS`.
    pub listed_kg: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_slinch_is_175_kilograms_with_either_way_of_inches_and_pounds() {
        let direct = UnitSystem::InLbf.units(None).unwrap();
        assert!((direct.mass_kg - 175.126_835).abs() < 1e-6);
        let by_wtmass = UnitSystem::InLbm.units(Some(1.0 / POUNDS_PER_SLINCH)).unwrap();
        assert!((by_wtmass.mass_kg / direct.mass_kg - 1.0).abs() < 1e-15);
        assert_eq!(by_wtmass.listed_kg, POUND_KG);
    }

    #[test]
    fn the_usual_roundings_of_wtmass_are_taken_and_one_is_not() {
        for wtmass in [0.00259, 0.002588, 1.0 / 386.4, 1.0 / 386.0] {
            assert!(UnitSystem::InLbm.units(Some(wtmass)).is_ok(), "{wtmass}");
        }
        assert!(UnitSystem::InLbm.units(Some(1.0)).is_err());
        assert!(UnitSystem::InLbm.units(Some(f64::NAN)).is_err());
        assert!(UnitSystem::InLbm.units(None).is_err());
        assert!(UnitSystem::Si.units(Some(0.00259)).is_err());
    }
}
