//! A motor: thrust and mass flow in time, shared by the engines that name it.

use super::STANDARD_GRAVITY_M_S2;

/// Nominal thrust and mass flow of a motor in time; linear between the entries.
#[derive(Debug, Clone, PartialEq)]
pub struct Motor {
    /// Name by which engines refer to it.
    pub name: String,
    /// Vacuum specific impulse, s.
    pub specific_impulse_s: f64,
    /// Flight times of the tables, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Thrust at each time, N.
    pub thrust_n: Vec<f64>,
    /// Mass flow at each time, kg/s.
    pub mass_flow_kg_s: Vec<f64>,
    /// Burned propellant fraction b(t) at each time, −, 0 to 1; drives liner ablation.
    pub burned_fraction: Vec<f64>,
}

impl Motor {
    /// Thrust at `time_s`, N. The time must lie inside the table (checked by the scenario).
    pub fn thrust_at(&self, time_s: f64) -> f64 {
        interpolate(&self.time_s, &self.thrust_n, time_s)
    }

    /// Mass flow at `time_s`, kg/s.
    pub fn mass_flow_at(&self, time_s: f64) -> f64 {
        interpolate(&self.time_s, &self.mass_flow_kg_s, time_s)
    }

    /// Burned propellant fraction at `time_s`, −.
    pub fn burned_fraction_at(&self, time_s: f64) -> f64 {
        interpolate(&self.time_s, &self.burned_fraction, time_s)
    }

    /// Ratio of the tabulated mass flow to R/(Isp g) at `time_s`, −: the nominal flow profile. One where there is
    /// neither.
    pub fn flow_profile_at(&self, time_s: f64) -> f64 {
        let thrust_n = self.thrust_at(time_s);
        if thrust_n == 0.0 {
            return 1.0;
        }
        self.mass_flow_at(time_s) * self.specific_impulse_s * STANDARD_GRAVITY_M_S2 / thrust_n
    }
}

/// Linear interpolation in a table with increasing abscissae; holds the ends.
pub fn interpolate(x: &[f64], y: &[f64], at: f64) -> f64 {
    let upper = x.partition_point(|&v| v < at);
    if upper == 0 {
        return y[0];
    }
    if upper == x.len() {
        return y[y.len() - 1];
    }
    let weight = (at - x[upper - 1]) / (x[upper] - x[upper - 1]);
    y[upper - 1] + weight * (y[upper] - y[upper - 1])
}
