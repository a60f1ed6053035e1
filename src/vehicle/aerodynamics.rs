//! Aerodynamics of the vehicle along its trajectory, as nominal data in flight time.

/// A generalised aerodynamic matrix at one flight time, per unit dynamic pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Generalised {
    /// Flight time, s.
    pub flight_time_s: f64,
    /// Coordinates of rows and columns: modal labels, or rigid coordinates `xi.y`, `theta.z`, ….
    pub coordinates: Vec<String>,
    /// Generalised force per displacement and pressure, one row per coordinate.
    pub stiffness: Vec<Vec<f64>>,
    /// Generalised force per rate and pressure, one row per coordinate.
    pub damping: Vec<Vec<f64>>,
}

/// Rigid-body coefficients at flight conditions, and generalised matrices.
#[derive(Debug, Clone, PartialEq)]
pub struct Aerodynamics {
    /// Reference area S, m².
    pub area_m2: f64,
    /// Reference length D, m.
    pub length_m: f64,
    /// Flight times of the tables, s, strictly increasing.
    pub time_s: Vec<f64>,
    /// Dynamic pressure q, Pa.
    pub dynamic_pressure_pa: Vec<f64>,
    /// Speed V, m/s.
    pub speed_m_s: Vec<f64>,
    /// Slope of the normal force coefficient C_Nα, 1/rad.
    pub normal_force_slope_1_rad: Vec<f64>,
    /// Station of the centre of pressure, structural frame, m.
    pub center_of_pressure_x_m: Vec<f64>,
    /// Axial force coefficient C_A, −.
    pub axial_force: Vec<f64>,
    /// Damping coefficient in pitch and yaw C_mq (per q D/2V), −, negative where it damps.
    pub pitch_damping: Vec<f64>,
    /// Damping coefficient in roll C_lp (per p D/2V), −, negative where it damps.
    pub roll_damping: Vec<f64>,
    /// Generalised matrices, at most one a flight time.
    pub generalised: Vec<Generalised>,
}
