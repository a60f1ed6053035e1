//! Residual vectors among the modes: static shapes that a solver appends to the natural modes.
//!
//! They are told to the user, not removed.

use super::results::RawMode;

/// A frequency so much above the one before it that it looks like a residual vector's.
///
/// Neighbouring modes differ by less: of a uniform cantilever the second frequency is 6.3 times the
/// first, and every further one is closer to the one before it.
const JUMP: f64 = 10.0;

/// A warning with the numbers of the modes that look like residual vectors: those without
/// generalised mass, and those from a jump in frequency onwards if the jump is in the upper half.
pub(super) fn warning(modes: &[RawMode]) -> Option<String> {
    let massless = |mode: &RawMode| mode.generalised_mass.is_some_and(|mass| !(mass > 0.0));
    let mut suspects: Vec<i64> =
        modes.iter().filter(|mode| massless(mode)).map(|mode| mode.number).collect();
    let others: Vec<&RawMode> = modes.iter().filter(|mode| !massless(mode)).collect();
    let elastic = others.iter().position(|mode| mode.frequency_hz > 0.0).unwrap_or(0);
    // Rigid-body modes have frequencies of rounding size, which jump too: hence the upper half.
    let upper = (others.len() / 2).max(elastic) + 1;
    let jump = (upper..others.len())
        .find(|k| others[*k].frequency_hz > JUMP * others[k - 1].frequency_hz.abs());
    suspects.extend(jump.into_iter().flat_map(|k| others[k..].iter().map(|mode| mode.number)));
    suspects.sort_unstable();
    if suspects.is_empty() {
        return None;
    }
    let list = suspects.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
    Some(format!(
        "modes {list} look like residual vectors (no generalised mass, or far above the mode \
         before): they are no natural modes"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn modes(given: &[(f64, f64)]) -> Vec<RawMode> {
        (1..)
            .zip(given)
            .map(|(number, (frequency_hz, mass))| RawMode {
                number,
                frequency_hz: *frequency_hz,
                generalised_mass: Some(*mass),
                shape: Vec::new(),
            })
            .collect()
    }

    #[test]
    fn modes_without_mass_and_modes_after_a_jump_are_named() {
        let given = [(1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (4.0, 0.0), (90.0, 1.0), (95.0, 1.0)];
        let told = warning(&modes(&given)).unwrap();
        assert!(told.starts_with("modes 4, 5, 6 look like"), "{told}");
    }

    #[test]
    fn rigid_modes_and_a_cantilever_are_no_residual_vectors() {
        let free = [(1e-6, 1.0), (-2e-5, 1.0), (3e-5, 1.0), (10.0, 1.0), (11.0, 1.0), (30.0, 1.0)];
        assert_eq!(warning(&modes(&free)), None);
        // Roots of cosh x cos x = -1 squared: 3.516, 22.03, 61.70.
        let cantilever = [(3.516, 1.0), (22.03, 1.0), (61.70, 1.0)];
        assert_eq!(warning(&modes(&cantilever)), None);
    }
}
