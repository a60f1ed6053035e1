//! The binomial law: exact tails to full relative precision, and their inverse in p.
//!
//! Everything exact in this module (Clopper–Pearson, Wilks, order statistics) is one of these tails.
//! An own evaluation because those at hand through the incomplete beta function lose digits with
//! n: ln Γ(n) is subtracted from itself, and the continued fraction is cut off.

use super::root;

/// ln n! − ln(√(2πn) (n/e)ⁿ): Stirling's error, by its series above 15 and directly below.
fn stirling_error(n: f64) -> f64 {
    if n < 16.0 {
        let factorial: f64 = (1..=n as u32).map(f64::from).product();
        return factorial.ln() - (n + 0.5) * n.ln() + n - 0.5 * std::f64::consts::TAU.ln();
    }
    let square = n * n;
    // First term left out: 691/360360 n⁻¹¹, under 1.1e-16 at n = 16.
    (1.0 / 12.0
        - (1.0 / 360.0 - (1.0 / 1260.0 - (1.0 / 1680.0 - 1.0 / 1188.0 / square) / square) / square)
            / square)
        / n
}

/// x ln(x/m) + m − x without cancellation: with v = (x−m)/(x+m) it is (x−m)v + 2x Σ v²ʲ⁺¹/(2j+1).
fn deviance(x: f64, m: f64) -> f64 {
    let difference = x - m;
    if difference.abs() > 0.1 * (x + m) {
        return x * (x / m).ln() - difference;
    }
    let v = difference / (x + m);
    let mut sum = difference * v;
    let mut power = 2.0 * x * v;
    let mut j = 1.0;
    loop {
        power *= v * v;
        let next = sum + power / (2.0 * j + 1.0);
        if next == sum {
            return sum;
        }
        sum = next;
        j += 1.0;
    }
}

/// P(X = k), X binomial of n trials with probability p in (0, 1).
///
/// Saddle-point form (C. Loader, "Fast and accurate computation of binomial probabilities", 2000).
fn mass(k: u64, n: u64, p: f64) -> f64 {
    let (x, y, n) = (k as f64, (n - k) as f64, n as f64);
    if x == 0.0 {
        return (n * (-p).ln_1p()).exp();
    }
    if y == 0.0 {
        return (n * p.ln()).exp();
    }
    let exponent = stirling_error(n)
        - stirling_error(x)
        - stirling_error(y)
        - deviance(x, n * p)
        - deviance(y, n * (1.0 - p));
    (n / (std::f64::consts::TAU * x * y)).sqrt() * exponent.exp()
}

/// P(X = k) + P(X = k−1) + …, where the terms decline (k at or below the mode).
fn sum_down(k: u64, n: u64, p: f64) -> f64 {
    let odds = (1.0 - p) / p;
    let mut term = mass(k, n, p);
    let mut sum = term;
    for j in (1..=k).rev() {
        term *= odds * j as f64 / (n - j + 1) as f64;
        let next = sum + term;
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

/// P(X = k) + P(X = k+1) + …, where the terms decline (k at or above the mode).
fn sum_up(k: u64, n: u64, p: f64) -> f64 {
    let odds = p / (1.0 - p);
    let mut term = mass(k, n, p);
    let mut sum = term;
    for j in k..n {
        term *= odds * (n - j) as f64 / (j + 1) as f64;
        let next = sum + term;
        if next == sum {
            break;
        }
        sum = next;
    }
    sum
}

/// P(X ≤ k) of n trials with probability p in (0, 1).
pub(super) fn at_most(k: u64, n: u64, p: f64) -> f64 {
    if k >= n {
        1.0
    } else if k as f64 <= n as f64 * p {
        sum_down(k, n, p)
    } else {
        1.0 - sum_up(k + 1, n, p)
    }
}

/// P(X ≥ k) of n trials with probability p in (0, 1).
pub(super) fn at_least(k: u64, n: u64, p: f64) -> f64 {
    if k == 0 {
        1.0
    } else if k > n {
        0.0
    } else if k as f64 >= n as f64 * p {
        sum_up(k, n, p)
    } else {
        1.0 - sum_down(k - 1, n, p)
    }
}

/// The p with P(X ≤ k) = `tail`; 1 for k = n.
pub(super) fn p_of_at_most(k: u64, n: u64, tail: f64) -> f64 {
    if k >= n {
        return 1.0;
    }
    if k == 0 {
        return -(tail.ln() / n as f64).exp_m1();
    }
    // d/dp P(X ≤ k) = −(n−k)/(1−p) P(X = k); the logarithm makes Newton's method nearly straight.
    root::of_increasing(0.0, 1.0, |p| {
        let probability = at_most(k, n, p);
        let slope = (n - k) as f64 / (1.0 - p) * mass(k, n, p) / probability;
        (tail.ln() - probability.ln(), slope)
    })
}

/// The p with P(X ≥ k) = `tail`; 0 for k = 0.
pub(super) fn p_of_at_least(k: u64, n: u64, tail: f64) -> f64 {
    if k == 0 {
        return 0.0;
    }
    if k == n {
        return (tail.ln() / n as f64).exp();
    }
    // d/dp P(X ≥ k) = k/p P(X = k).
    root::of_increasing(0.0, 1.0, |p| {
        let probability = at_least(k, n, p);
        (probability.ln() - tail.ln(), k as f64 / p * mass(k, n, p) / probability)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    // Exact rational arithmetic (Python's fractions), rounded to 17 digits.
    const EXACT: [(u64, u64, f64, f64, f64); 8] = [
        // k, n, p, P(X ≤ k), P(X ≥ k)
        (0, 10, 0.1, 0.3486784401, 1.0),
        (3, 10, 0.3, 0.6496107184000001, 0.6172172135999999),
        (9, 10, 0.9, 0.6513215599, 0.7360989291000001),
        (20, 50, 0.25, 0.993737092752389, 0.013917608678660666),
        (2, 2000, 0.0027, 0.09445549106898372, 0.9712386690879725),
        (87, 2000, 0.05, 0.09793077587028569, 0.9193322580166735),
        (13, 2000, 0.01, 0.0651777236686629, 0.9616923223885256),
        (1400, 2000, 0.7, 0.5084347203514868, 0.5110286186358133),
    ];

    #[test]
    fn tails_equal_exact_rational_sums() {
        for (k, n, p, lower, upper) in EXACT {
            // Up to a few √n terms are added, each off by its accumulated rounding.
            let tolerance = 8.0 * f64::EPSILON * (n as f64).sqrt().max(10.0);
            let (got_lower, got_upper) = (at_most(k, n, p), at_least(k, n, p));
            assert!((got_lower / lower - 1.0).abs() <= tolerance, "{k} {n} {p}: {got_lower:e}");
            assert!((got_upper / upper - 1.0).abs() <= tolerance, "{k} {n} {p}: {got_upper:e}");
        }
    }

    #[test]
    fn tails_agree_with_the_incomplete_beta_function_of_statrs() {
        use statrs::function::beta::beta_reg;
        for n in [1_u64, 2, 7, 40, 300, 1000] {
            for k in (0..n).step_by((n as usize / 7).max(1)) {
                for p in [1e-6, 0.0027, 0.05, 0.3, 0.5, 0.83, 0.99] {
                    let beta = beta_reg((n - k) as f64, k as f64 + 1.0, 1.0 - p);
                    // Its front factor subtracts ln Γ of size n ln n, each good to some 1e-14.
                    let tolerance = 1e-15 * (50.0 + n as f64 * (n as f64 + 1.0).ln());
                    assert!((at_most(k, n, p) - beta).abs() <= tolerance, "{k} {n} {p}");
                }
            }
        }
    }

    #[test]
    fn tails_at_most_and_at_least_complement_each_other() {
        for (k, n, p) in [(3, 10, 0.3), (499, 1000, 0.5), (2, 2000, 0.0027), (69_000, 100_000, 0.7)]
        {
            let sum = at_most(k, n, p) + at_least(k + 1, n, p);
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        }
    }

    #[test]
    fn the_inverse_gives_back_the_tail() {
        for (k, n) in [(1, 2), (3, 7), (87, 2000), (1999, 2000), (690_000, 1_000_000)] {
            for tail in [1e-12, 1e-3, 0.025, 0.5, 0.975] {
                // Rounding p to ε moves the tail by at most n ε, relative to the tail n ε/tail.
                let tolerance = 2.0 * f64::EPSILON * n as f64 / tail + 1e-13;
                let upper = at_most(k, n, p_of_at_most(k, n, tail));
                let lower = at_least(k, n, p_of_at_least(k, n, tail));
                assert!((upper / tail - 1.0).abs() <= tolerance, "{k} {n} {tail}: {upper:e}");
                assert!((lower / tail - 1.0).abs() <= tolerance, "{k} {n} {tail}: {lower:e}");
            }
        }
    }
}
