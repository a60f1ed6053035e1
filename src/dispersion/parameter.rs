//! Parameters: the registry of quantities that can be dispersed, and their instances in a vehicle.
//!
//! The registry line of a quantity is all there is to say about it: its TOML path, unit, bounds,
//! Parquet column and report text derive from it. Laws and rows are not known here.

use crate::vehicle::{Law, Modal, Vehicle};

/// Physical values a quantity may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// Any finite number.
    Any,
    /// Zero or more.
    NonNegative,
    /// Above zero.
    Positive,
}

impl Domain {
    /// Whether a finite value is allowed.
    pub fn contains(self, value: f64) -> bool {
        match self {
            Self::Any => value.is_finite(),
            Self::NonNegative => value.is_finite() && value >= 0.0,
            Self::Positive => value.is_finite() && value > 0.0,
        }
    }

    /// The allowed values in words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Any => "any finite number",
            Self::NonNegative => "zero or more",
            Self::Positive => "a number above zero",
        }
    }
}

/// What a quantity belongs to: once a vehicle, or once per …
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// The vehicle.
    Vehicle,
    /// Modal label.
    Mode,
    /// Engine.
    Engine,
    /// Actuator of an engine.
    Actuator,
    /// Tank.
    Tank,
    /// Engine and modal label: the gimbal's part in a mode.
    Gimbal,
    /// Sensor of the autopilot.
    Sensor,
    /// Sensor and modal label.
    SensorMode,
    /// Path of the autopilot.
    Path,
    /// Filter of a path.
    Filter,
}

/// One instance of a scope. Indices: engines as in [`Vehicle::engines`], actuators as in
/// `Engine::actuator`, labels as in [`Modal::labels`], sensors, paths and filters as in the autopilot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// The vehicle.
    Vehicle,
    /// A modal label.
    Mode(usize),
    /// An engine.
    Engine(usize),
    /// Engine and actuator.
    Actuator(usize, usize),
    /// A tank.
    Tank(usize),
    /// Engine and modal label.
    Gimbal(usize, usize),
    /// A sensor.
    Sensor(usize),
    /// Sensor and modal label.
    SensorMode(usize, usize),
    /// A path.
    Path(usize),
    /// Path and filter.
    Filter(usize, usize),
}

/// What the registry says about a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Definition {
    /// Path template; segments in angle brackets vary.
    pub path: &'static str,
    /// Unit, SI symbols; `1` for a pure number.
    pub unit: &'static str,
    /// Values allowed.
    pub domain: Domain,
    /// What it belongs to.
    pub scope: Scope,
    /// Meaning, for reports, columns and documentation.
    pub description: &'static str,
}

macro_rules! registry {
    ($($name:ident, $scope:ident, $path:literal, $unit:literal, $domain:ident, $text:literal;)*) => {
        /// A quantity that can be dispersed.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum Quantity { $(#[doc = $text] $name,)* }

        impl Quantity {
            /// Every quantity, in registry order.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// Its registry line.
            pub fn definition(self) -> Definition {
                match self {
                    $(Self::$name => Definition {
                        path: $path,
                        unit: $unit,
                        domain: Domain::$domain,
                        scope: Scope::$scope,
                        description: $text,
                    },)*
                }
            }
        }
    };
}

registry! {
    StructuralDamping, Vehicle, "structure.damping", "1", NonNegative, "structural damping ratio of every mode that has no own one";
    ModeDamping, Mode, "modes.<label>.damping", "1", NonNegative, "structural damping ratio of a mode; nominal is the drawn structure.damping";
    ModeFrequency, Mode, "modes.<label>.frequency", "Hz", Positive, "natural frequency of a mode, table in flight time";
    Thrust, Engine, "<group>.<engine>.thrust", "N", NonNegative, "thrust R, table in flight time";
    SpecificImpulse, Engine, "<group>.<engine>.specific_impulse", "s", Positive, "vacuum specific impulse Isp";
    FlowProfile, Engine, "<group>.<engine>.flow_profile", "1", NonNegative, "ratio of the mass flow to R/(Isp g), table in flight time";
    MassFlow, Engine, "<group>.<engine>.mass_flow", "kg/s", NonNegative, "mass flow, table in flight time; nominal is the drawn R/(Isp g) times flow_profile";
    NozzleMass, Engine, "<group>.<engine>.nozzle.mass", "kg", Positive, "moving mass of the nozzle, unablated";
    NozzleCg, Engine, "<group>.<engine>.nozzle.cg", "m", Any, "distance of the nozzle's cg from the pivot, positive aft, unablated";
    NozzleInertia, Engine, "<group>.<engine>.nozzle.inertia", "kg m2", Positive, "transverse inertia of the nozzle about the pivot, unablated";
    NozzleAxialInertia, Engine, "<group>.<engine>.nozzle.axial_inertia", "kg m2", Positive, "inertia of the nozzle about its own axis";
    NozzleLength, Engine, "<group>.<engine>.nozzle.length", "m", NonNegative, "length from the pivot to the exit plane";
    NozzleAblation, Engine, "<group>.<engine>.nozzle.ablation", "1", NonNegative, "liner ablation factor a: the share of the loss given for full burn";
    BearingStiffness, Engine, "<group>.<engine>.bearing.stiffness", "N m/rad", NonNegative, "flex bearing stiffness of an actuator that does not include it";
    BearingDamping, Engine, "<group>.<engine>.bearing.damping", "N m s/rad", NonNegative, "flex bearing damping";
    ActuatorStiffness, Actuator, "<group>.<engine>.actuator.<actuator>.stiffness", "N m/rad", Positive, "stiffness K_a of a second-order actuator";
    ActuatorDamping, Actuator, "<group>.<engine>.actuator.<actuator>.damping", "1", NonNegative, "damping ratio of a second-order actuator at the reference inertia";
    ActuatorArm, Actuator, "<group>.<engine>.actuator.<actuator>.arm", "m", Positive, "moment arm of an electrohydraulic actuator";
    PistonArea, Actuator, "<group>.<engine>.actuator.<actuator>.piston_area", "m2", Positive, "piston area of an electrohydraulic actuator";
    LoadPathStiffness, Actuator, "<group>.<engine>.actuator.<actuator>.load_path_stiffness", "N/m", Positive, "load path stiffness of an electrohydraulic actuator";
    OilStiffness, Actuator, "<group>.<engine>.actuator.<actuator>.oil_stiffness", "N/m", Positive, "oil stiffness of an electrohydraulic actuator";
    Leakage, Actuator, "<group>.<engine>.actuator.<actuator>.leakage", "m3/(s Pa)", NonNegative, "leakage past the piston of an electrohydraulic actuator";
    ValveFlowGain, Actuator, "<group>.<engine>.actuator.<actuator>.valve_flow_gain", "m3/(s A)", Positive, "flow gain of the servo valve of an electrohydraulic actuator";
    ValvePressureGain, Actuator, "<group>.<engine>.actuator.<actuator>.valve_pressure_gain", "Pa/A", Positive, "pressure gain of the servo valve of an electrohydraulic actuator";
    PositionGain, Actuator, "<group>.<engine>.actuator.<actuator>.position_gain", "A/m", Positive, "position loop gain of an electrohydraulic actuator";
    PressureFeedback, Actuator, "<group>.<engine>.actuator.<actuator>.pressure_feedback", "A/Pa", NonNegative, "gain of the dynamic pressure feedback of an electrohydraulic actuator";
    PressureCorner, Actuator, "<group>.<engine>.actuator.<actuator>.pressure_corner", "Hz", Positive, "corner of the high pass in the pressure feedback of an electrohydraulic actuator";
    ActuatorGain, Actuator, "<group>.<engine>.actuator.<actuator>.gain", "1", Any, "gain on an actuator given by transfer functions or matrices, nominal 1";
    ActuatorTimeScale, Actuator, "<group>.<engine>.actuator.<actuator>.time_scale", "1", Positive, "factor on the time constants of an actuator given by transfer functions or matrices, nominal 1";
    GimbalShape, Gimbal, "<group>.<engine>.gimbal.<label>.shape", "1", Any, "gain on the gimbal translation of a mode, nominal 1";
    GimbalSlope, Gimbal, "<group>.<engine>.gimbal.<label>.slope", "1", Any, "gain on the gimbal rotation of a mode, nominal 1";
    LoopDelay, Vehicle, "autopilot.delay", "s", Positive, "loop delay of the autopilot";
    SensorScale, Sensor, "autopilot.sensor.<sensor>.scale", "1", Any, "scale factor of a sensor of the autopilot";
    SensorSlope, SensorMode, "autopilot.sensor.<sensor>.<label>.slope", "1", Any, "gain on the slope of a mode at the grid of a sensor, nominal 1";
    PathGain, Path, "autopilot.path.<path>.gain", "1", Any, "gain of a path of the autopilot";
    FilterGain, Filter, "autopilot.path.<path>.filter.<filter>.gain", "1", Any, "gain on a filter of the autopilot, nominal 1";
    FilterFrequency, Filter, "autopilot.path.<path>.filter.<filter>.frequency", "1", Positive, "factor on the frequencies of a filter of the autopilot, nominal 1";
    FilterDamping, Filter, "autopilot.path.<path>.filter.<filter>.damping", "1", NonNegative, "factor on the damping ratios of a filter of the autopilot, nominal 1";
    FilterDelay, Filter, "autopilot.path.<path>.filter.<filter>.delay", "s", Positive, "delay of a filter of the autopilot";
    SloshMass, Tank, "tank.<tank>.slosh.mass", "kg", NonNegative, "slosh mass of a tank, table in flight time";
    SloshFrequency, Tank, "tank.<tank>.slosh.frequency", "Hz", Positive, "slosh frequency of a tank under the nominal mean acceleration, table in flight time";
    SloshDamping, Tank, "tank.<tank>.slosh.damping", "1", NonNegative, "slosh damping ratio of a tank";
    RollInertia, Vehicle, "body.roll_inertia", "1", Positive, "gain on the inertia of the body about x, nominal 1";
    PitchInertia, Vehicle, "body.pitch_inertia", "1", Positive, "gain on the inertia of the body about y, nominal 1";
    YawInertia, Vehicle, "body.yaw_inertia", "1", Positive, "gain on the inertia of the body about z, nominal 1";
    DynamicPressure, Vehicle, "aerodynamics.dynamic_pressure", "Pa", NonNegative, "dynamic pressure, table in flight time";
    NormalForceSlope, Vehicle, "aerodynamics.normal_force_slope", "1/rad", Any, "slope of the normal force coefficient, table in flight time";
    CenterOfPressure, Vehicle, "aerodynamics.center_of_pressure", "m", Any, "station of the centre of pressure, table in flight time";
    AxialForce, Vehicle, "aerodynamics.axial_force", "1", NonNegative, "axial force coefficient, table in flight time";
    PitchDamping, Vehicle, "aerodynamics.pitch_damping", "1", Any, "damping coefficient in pitch and yaw, table in flight time";
    RollDamping, Vehicle, "aerodynamics.roll_damping", "1", Any, "damping coefficient in roll, table in flight time";
}

impl Quantity {
    /// Whether this instance exists: a nozzle without a liner has nothing to ablate, and each kind of
    /// actuator and filter has its own numbers.
    fn exists(self, vehicle: &Vehicle, place: Place) -> bool {
        match place {
            Place::Engine(e) if self == Self::NozzleAblation => {
                vehicle.engines[e].nozzle.ablation.is_some()
            }
            Place::Actuator(e, a) => self.is_of(&vehicle.engines[e].actuator(a).law),
            Place::Filter(p, f) => vehicle.autopilot.as_ref().is_some_and(|autopilot| {
                let kind = &autopilot.paths[p].filters[f].kind;
                match self {
                    Self::FilterFrequency => kind.has_frequency(),
                    Self::FilterDamping => kind.has_damping(),
                    Self::FilterDelay => kind.has_delay(),
                    _ => true,
                }
            }),
            Place::Vehicle => match self {
                Self::LoopDelay => vehicle.autopilot.as_ref().is_some_and(|a| a.delay_s > 0.0),
                Self::DynamicPressure
                | Self::NormalForceSlope
                | Self::CenterOfPressure
                | Self::AxialForce
                | Self::PitchDamping
                | Self::RollDamping => vehicle.aerodynamics.is_some(),
                _ => true,
            },
            _ => true,
        }
    }

    /// Whether a torque law has this quantity.
    fn is_of(self, law: &Law) -> bool {
        match law {
            Law::SecondOrder(_) => matches!(self, Self::ActuatorStiffness | Self::ActuatorDamping),
            Law::Electrohydraulic(law) => match self {
                Self::ValvePressureGain => law.valve_pressure_gain_pa_a.is_finite(),
                Self::PressureCorner => law.pressure_corner_rad_s > 0.0,
                Self::ActuatorArm
                | Self::PistonArea
                | Self::LoadPathStiffness
                | Self::OilStiffness
                | Self::Leakage
                | Self::ValveFlowGain
                | Self::PositionGain
                | Self::PressureFeedback => true,
                _ => false,
            },
            Law::TransferFunction(_) | Law::StateSpace(_) => {
                matches!(self, Self::ActuatorGain | Self::ActuatorTimeScale)
            }
        }
    }
}

/// What a drawn vehicle does to a nominal value, which may be a table in time:
/// `drawn(t) = scale · nominal(t) + offset`. An absolute value has scale 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Affine {
    /// Factor on the nominal value, −.
    pub scale: f64,
    /// Added to it, in the unit of the parameter.
    pub offset: f64,
}

impl Affine {
    /// Leaves the nominal value as it is, bit for bit.
    pub const IDENTITY: Self = Self { scale: 1.0, offset: 0.0 };

    /// The drawn value for the nominal one.
    pub fn apply(self, nominal: f64) -> f64 {
        // 0 · nominal could be NaN for an infinite table entry; the vehicle has none.
        self.scale * nominal + self.offset
    }
}

/// One instance of a quantity in a vehicle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Parameter {
    /// Quantity.
    pub quantity: Quantity,
    /// What it belongs to.
    pub place: Place,
    /// Instance path, for instance `booster.left.nozzle.mass`.
    pub path: String,
    /// Whether the vehicle has it (see [`Quantity`]); if not, no row can address it.
    pub exists: bool,
}

/// A modal label as dispersions see it.
#[derive(Debug, Clone, PartialEq)]
struct Label {
    name: String,
    /// Label under which it draws.
    draws_as: String,
    /// Nominal frequency that decides its band, Hz.
    band_frequency_hz: f64,
}

/// All parameters of a vehicle, numbered; the case loop finds one by arithmetic.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    engines: usize,
    /// Number of the first actuator of each engine, and of all.
    actuators: Vec<usize>,
    sensors: usize,
    /// Number of the first filter of each path, and of all.
    filters: Vec<usize>,
    tanks: usize,
    labels: Vec<Label>,
    /// Number of the first parameter of each quantity.
    first: Vec<usize>,
    all: Vec<Parameter>,
}

/// Number of the first member of each, and of all.
fn starts(counts: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut starts = vec![0];
    for count in counts {
        starts.push(starts[starts.len() - 1] + count);
    }
    starts
}

/// Every pair of an owner and one of its members, by the numbers of the first members.
fn members(starts: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let counts = starts.windows(2).map(|pair| pair[1] - pair[0]).enumerate();
    counts.flat_map(|(owner, count)| (0..count).map(move |member| (owner, member)))
}

impl Parameters {
    /// The parameters of `vehicle`, ordered by quantity, then engine, then actuator or label.
    pub fn of(vehicle: &Vehicle) -> Self {
        let labels: Vec<Label> = vehicle
            .modal
            .labels()
            .into_iter()
            .map(|name| {
                let draws_as = vehicle.modal.draw_label(name);
                Label {
                    name: name.into(),
                    draws_as: draws_as.into(),
                    band_frequency_hz: band_frequency_hz(
                        &vehicle.modal,
                        draws_as,
                        vehicle.band_time_s,
                    ),
                }
            })
            .collect();
        let autopilot = vehicle.autopilot.as_ref();
        let paths = autopilot.map_or(&[][..], |autopilot| &autopilot.paths);
        let mut parameters = Self {
            engines: vehicle.engines.len(),
            actuators: starts(vehicle.engines.iter().map(|engine| 2 * engine.sets().count())),
            sensors: autopilot.map_or(0, |autopilot| autopilot.sensors.len()),
            filters: starts(paths.iter().map(|path| path.filters.len())),
            tanks: vehicle.tanks.len(),
            labels,
            first: Vec::new(),
            all: Vec::new(),
        };
        for &quantity in Quantity::ALL {
            parameters.first.push(parameters.all.len());
            for place in parameters.places(quantity.definition().scope) {
                let path = parameters.path(vehicle, quantity, place);
                let exists = quantity.exists(vehicle, place);
                parameters.all.push(Parameter { quantity, place, path, exists });
            }
        }
        parameters
    }

    fn places(&self, scope: Scope) -> Vec<Place> {
        let engines = 0..self.engines;
        match scope {
            Scope::Vehicle => vec![Place::Vehicle],
            Scope::Mode => (0..self.labels.len()).map(Place::Mode).collect(),
            Scope::Engine => engines.map(Place::Engine).collect(),
            Scope::Actuator => {
                members(&self.actuators).map(|(e, a)| Place::Actuator(e, a)).collect()
            }
            Scope::Tank => (0..self.tanks).map(Place::Tank).collect(),
            Scope::Gimbal => engines
                .flat_map(|e| (0..self.labels.len()).map(move |l| Place::Gimbal(e, l)))
                .collect(),
            Scope::Sensor => (0..self.sensors).map(Place::Sensor).collect(),
            Scope::SensorMode => (0..self.sensors)
                .flat_map(|s| (0..self.labels.len()).map(move |l| Place::SensorMode(s, l)))
                .collect(),
            Scope::Path => (0..self.filters.len() - 1).map(Place::Path).collect(),
            Scope::Filter => members(&self.filters).map(|(p, f)| Place::Filter(p, f)).collect(),
        }
    }

    fn path(&self, vehicle: &Vehicle, quantity: Quantity, place: Place) -> String {
        let path = quantity.definition().path;
        let engine = |path: &str, e: usize| {
            let engine = &vehicle.engines[e];
            path.replace("<group>", &engine.group).replace("<engine>", &engine.name)
        };
        let autopilot = || vehicle.autopilot.as_ref().expect("only an autopilot has such places");
        match place {
            Place::Vehicle => path.into(),
            Place::Mode(l) => path.replace("<label>", &self.labels[l].name),
            Place::Engine(e) => engine(path, e),
            Place::Actuator(e, a) => {
                let name = &vehicle.engines[e].actuator(a).name;
                engine(path, e).replace("<actuator>", name)
            }
            Place::Tank(t) => path.replace("<tank>", &vehicle.tanks[t].name),
            Place::Gimbal(e, l) => engine(path, e).replace("<label>", &self.labels[l].name),
            Place::Sensor(s) => path.replace("<sensor>", &autopilot().sensors[s].name),
            Place::SensorMode(s, l) => path
                .replace("<sensor>", &autopilot().sensors[s].name)
                .replace("<label>", &self.labels[l].name),
            Place::Path(p) => path.replace("<path>", &autopilot().paths[p].name),
            Place::Filter(p, f) => {
                let owner = &autopilot().paths[p];
                path.replace("<path>", &owner.name).replace("<filter>", &owner.filters[f].name)
            }
        }
    }

    /// Number of a parameter. `place` must be of the quantity's scope and inside the vehicle.
    pub fn index(&self, quantity: Quantity, place: Place) -> usize {
        let (scope, offset) = match place {
            Place::Vehicle => (Scope::Vehicle, 0),
            Place::Mode(l) => (Scope::Mode, l),
            Place::Engine(e) => (Scope::Engine, e),
            Place::Actuator(e, a) => (Scope::Actuator, self.actuators[e] + a),
            Place::Tank(t) => (Scope::Tank, t),
            Place::Gimbal(e, l) => (Scope::Gimbal, e * self.labels.len() + l),
            Place::Sensor(s) => (Scope::Sensor, s),
            Place::SensorMode(s, l) => (Scope::SensorMode, s * self.labels.len() + l),
            Place::Path(p) => (Scope::Path, p),
            Place::Filter(p, f) => (Scope::Filter, self.filters[p] + f),
        };
        debug_assert_eq!(scope, quantity.definition().scope, "{quantity:?} at {place:?}");
        self.first[quantity as usize] + offset
    }

    /// The parameters by number.
    pub fn all(&self) -> &[Parameter] {
        &self.all
    }

    /// Number of parameters; the length of a case's effects.
    pub fn count(&self) -> usize {
        self.all.len()
    }

    /// Index of a modal label, as [`Place`] counts them.
    pub fn label(&self, name: &str) -> Option<usize> {
        self.labels.iter().position(|l| l.name == name)
    }

    /// The label under which label number `label` draws.
    pub fn draw_label(&self, label: usize) -> &str {
        &self.labels[label].draws_as
    }

    /// The nominal frequency that decides the band of label number `label`, Hz: at the band time,
    /// or at the nearest flight time (the earlier of two) where a label that shares its draws
    /// exists. Labels that share draws so share their band; where several exist at that time,
    /// the label they draw under counts, else the lowest frequency.
    pub fn band_frequency_hz(&self, label: usize) -> f64 {
        self.labels[label].band_frequency_hz
    }
}

impl Place {
    /// Index of the modal label, where the place has one.
    pub fn label(self) -> Option<usize> {
        match self {
            Self::Mode(l) | Self::Gimbal(_, l) | Self::SensorMode(_, l) => Some(l),
            Self::Vehicle
            | Self::Engine(_)
            | Self::Actuator(..)
            | Self::Tank(_)
            | Self::Sensor(_)
            | Self::Path(_)
            | Self::Filter(..) => None,
        }
    }
}

/// See [`Parameters::band_frequency_hz`]; NaN, which lies in no band, if no label draws so.
fn band_frequency_hz(modal: &Modal, draws_as: &str, band_time_s: f64) -> f64 {
    let distance = |time_s: f64| (time_s - band_time_s).abs();
    let mut nearest: Option<(f64, f64)> = None;
    for set in &modal.sets {
        let own = set.modes.iter().find(|m| m.label == draws_as);
        let heir = || set.modes.iter().find(|m| modal.draw_label(&m.label) == draws_as);
        let Some(mode) = own.or_else(heir) else { continue };
        if nearest.is_none_or(|(time_s, _)| distance(set.flight_time_s) < distance(time_s)) {
            nearest = Some((set.flight_time_s, mode.frequency_hz));
        }
    }
    nearest.map_or(f64::NAN, |(_, frequency_hz)| frequency_hz)
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{vehicle, vehicle_with_descendants};
    use super::*;

    #[test]
    fn every_parameter_is_found_under_its_own_number() {
        let parameters = Parameters::of(&vehicle());
        for (number, parameter) in parameters.all().iter().enumerate() {
            assert_eq!(parameters.index(parameter.quantity, parameter.place), number);
        }
    }

    #[test]
    fn every_path_is_unique() {
        let parameters = Parameters::of(&vehicle());
        let mut paths: Vec<&str> = parameters.all().iter().map(|p| p.path.as_str()).collect();
        paths.sort_unstable();
        paths.dedup();
        assert_eq!(paths.len(), parameters.count());
    }

    #[test]
    fn a_template_has_exactly_the_segments_of_its_scope() {
        for quantity in Quantity::ALL {
            let definition = quantity.definition();
            let variable: Vec<&str> =
                definition.path.split('.').filter(|s| s.starts_with('<')).collect();
            let expected: &[&str] = match definition.scope {
                Scope::Vehicle => &[],
                Scope::Mode => &["<label>"],
                Scope::Engine => &["<group>", "<engine>"],
                Scope::Actuator => &["<group>", "<engine>", "<actuator>"],
                Scope::Tank => &["<tank>"],
                Scope::Gimbal => &["<group>", "<engine>", "<label>"],
                Scope::Sensor => &["<sensor>"],
                Scope::SensorMode => &["<sensor>", "<label>"],
                Scope::Path => &["<path>"],
                Scope::Filter => &["<path>", "<filter>"],
            };
            assert_eq!(variable, expected, "{}", definition.path);
            assert!(!definition.description.is_empty() && !definition.unit.is_empty());
        }
    }

    #[test]
    fn instances_carry_the_names_of_the_vehicle() {
        let vehicle = vehicle();
        let parameters = Parameters::of(&vehicle);
        let label = parameters.label("m002").unwrap();
        let path = |q, p| parameters.all()[parameters.index(q, p)].path.as_str();
        assert_eq!(path(Quantity::StructuralDamping, Place::Vehicle), "structure.damping");
        assert_eq!(path(Quantity::ModeFrequency, Place::Mode(label)), "modes.m002.frequency");
        assert_eq!(path(Quantity::NozzleMass, Place::Engine(1)), "booster.right.nozzle.mass");
        assert_eq!(
            path(Quantity::ActuatorDamping, Place::Actuator(0, 1)),
            "booster.left.actuator.tilt.damping"
        );
        assert_eq!(
            path(Quantity::GimbalSlope, Place::Gimbal(1, label)),
            "booster.right.gimbal.m002.slope"
        );
    }

    #[test]
    fn the_identity_leaves_a_nominal_value_bit_for_bit() {
        for nominal in [0.1_f64, -3.7e9, 1e-300, 0.0] {
            assert_eq!(Affine::IDENTITY.apply(nominal), nominal);
        }
    }

    #[test]
    fn a_band_is_fixed_at_the_band_time_or_the_nearest_time_where_the_mode_exists() {
        let parameters = Parameters::of(&vehicle_with_descendants());
        let band = |name: &str| parameters.band_frequency_hz(parameters.label(name).unwrap());
        // m001 exists at the band time, 100 s.
        assert_eq!(band("m001"), 4.0);
        // m002 ends at 90 s; its heir m004 carries the mode at 100 s, for both.
        assert_eq!((band("m002"), band("m004")), (5.2, 5.2));
        // m003 ends at 90 s; m005 overlaps it by no more than a half and is a mode of its own.
        assert_eq!((band("m003"), band("m005")), (9.9, 10.0));
    }
}
