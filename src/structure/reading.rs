//! Reading of `stick.toml`: from its text to a validated stick model, with every problem of it.
//!
//! The keys are declared in `raw`, the values in `stick`.

use super::raw;
use super::stick::{
    Element, History, LineMass, MAX_ELEMENTS, Node, Point, PointMass, Properties, Section, Spring,
    Stick,
};
use crate::problem::{Kind, Problems};
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;

impl Stick {
    /// Reads and checks the text of a stick model; `file` is how the user named it.
    ///
    /// # Errors
    /// Every problem of the text at once; if it is no TOML of the right types, the first of those.
    pub fn parse(text: &str, file: &str) -> Result<Self, Problems> {
        let raw: raw::Stick = toml::from_str(text).map_err(|e| {
            let line = e.span().map_or(String::new(), |s| {
                format!("line {}", 1 + text[..s.start].matches('\n').count())
            });
            Problems::input(file, line, e.message().trim(), "see `tvse schema stick`")
        })?;
        Reading { file, problems: Problems::default(), nodes: BTreeMap::new() }.stick(raw)
    }
}

/// A reading in progress: the problems so far and the nodes by name.
struct Reading<'a> {
    file: &'a str,
    problems: Problems,
    nodes: BTreeMap<String, usize>,
}

impl Reading<'_> {
    fn refuse(&mut self, key: impl Into<String>, found: impl Into<String>, allowed: &str) {
        self.problems.push(Kind::Input, self.file, key, found, allowed);
    }

    fn finite(&mut self, key: impl Into<String>, value: f64) {
        if !value.is_finite() {
            self.refuse(key, value.to_string(), "a finite number");
        }
    }

    fn positive(&mut self, key: impl Into<String>, value: f64) {
        if !(value > 0.0 && value.is_finite()) {
            self.refuse(key, value.to_string(), "a finite number above 0");
        }
    }

    fn not_negative(&mut self, key: impl Into<String>, value: f64) {
        if !(value >= 0.0 && value.is_finite()) {
            self.refuse(key, value.to_string(), "a finite number, 0 or above");
        }
    }

    fn vector(&mut self, key: &str, value: [f64; 3]) -> Vector3<f64> {
        for v in value {
            self.finite(key, v);
        }
        Vector3::from(value)
    }

    fn increasing(&mut self, key: &str, values: &[f64]) {
        if !values.iter().all(|v| v.is_finite()) || !values.windows(2).all(|w| w[0] < w[1]) {
            self.refuse(key, format!("{values:?}"), "finite, strictly increasing times");
        }
    }

    fn history(&mut self, key: &str, time_s: Vec<f64>, value: Vec<f64>) -> History {
        self.increasing(&format!("{key}.time_s"), &time_s);
        if value.len() != time_s.len().max(1) {
            self.refuse(
                format!("{key}.mass_kg"),
                format!("{} values", value.len()),
                "one value, or one for each of time_s",
            );
        }
        for &v in &value {
            self.not_negative(format!("{key}.mass_kg"), v);
        }
        History { time_s, value }
    }

    fn node(&mut self, key: &str, name: &str) -> usize {
        self.nodes.get(name).copied().unwrap_or_else(|| {
            self.refuse(key, format!("`{name}`"), "the name of a beam grid");
            0
        })
    }

    fn section(&mut self, key: &str, raw: &raw::Section) -> Section {
        let mut read = |name: &str, value: Option<f64>| {
            let value = value.unwrap_or_default();
            self.positive(format!("{key}.{name}"), value);
            value
        };
        match raw {
            raw::Section {
                radius_m,
                thickness_m,
                area_m2: None,
                inertia_y_m4: None,
                inertia_z_m4: None,
                torsion_m4: None,
            } => {
                let radius_m = read("radius_m", *radius_m);
                let thickness_m = read("thickness_m", *thickness_m);
                if !(thickness_m <= 2.0 * radius_m) {
                    self.refuse(
                        format!("{key}.thickness_m"),
                        thickness_m.to_string(),
                        "at most twice the mean radius",
                    );
                }
                Section::Tube { radius_m, thickness_m }
            }
            raw::Section { radius_m: None, thickness_m: None, .. } => {
                Section::General(Properties {
                    area_m2: read("area_m2", raw.area_m2),
                    inertia_y_m4: read("inertia_y_m4", raw.inertia_y_m4),
                    inertia_z_m4: read("inertia_z_m4", raw.inertia_z_m4),
                    torsion_m4: read("torsion_m4", raw.torsion_m4),
                })
            }
            _ => {
                self.refuse(
                    key,
                    "a mixture of both forms",
                    "either radius_m and thickness_m, or area_m2, inertia_y_m4, inertia_z_m4 and \
                     torsion_m4",
                );
                Section::Tube { radius_m: 1.0, thickness_m: 1.0 }
            }
        }
    }

    fn stick(mut self, raw: raw::Stick) -> Result<Stick, Problems> {
        if raw.format != 1 {
            self.refuse("format", raw.format.to_string(), "1");
        }
        if raw.name.trim().is_empty() {
            self.refuse("name", "an empty text", "a name");
        }
        if raw.flight_times_s.is_empty() {
            self.refuse("flight_times_s", "no time", "at least one time");
        }
        self.increasing("flight_times_s", &raw.flight_times_s);
        let elements: usize =
            raw.beam.iter().flat_map(|b| &b.piece).fold(0, |n, p| n.saturating_add(p.elements));
        if raw.beam.is_empty() || elements > MAX_ELEMENTS {
            self.refuse(
                "beam",
                format!("{} beams with {elements} elements", raw.beam.len()),
                "at least one beam, at most 1000 elements in all",
            );
            return Err(self.problems);
        }
        let materials = self.materials(&raw.material);
        let mut stick = Stick {
            name: raw.name,
            flight_times_s: raw.flight_times_s,
            slosh_in_body: raw.slosh_in_body,
            nodes: Vec::new(),
            elements: Vec::new(),
            line_masses: Vec::new(),
            point_masses: Vec::new(),
            springs: Vec::new(),
            points: Vec::new(),
        };
        for (i, beam) in raw.beam.into_iter().enumerate() {
            self.beam(&mut stick, &materials, i, beam);
        }
        for (i, node) in stick.nodes.iter().enumerate() {
            if self.nodes.insert(node.name.clone(), i).is_some() {
                self.refuse("beam.piece.grids", format!("two grids `{}`", node.name), "one");
            }
        }
        for (i, p) in raw.point_mass.into_iter().enumerate() {
            let key = format!("point_mass[{i}]");
            let (node, position_m) = self.link(&stick, &key, &p.grid, p.position_m);
            for v in p.inertia_kg_m2 {
                self.not_negative(format!("{key}.inertia_kg_m2"), v);
            }
            stick.point_masses.push(PointMass {
                name: p.name,
                node,
                position_m,
                mass_kg: self.history(&key, p.time_s, p.mass_kg),
                inertia_kg_m2: p.inertia_kg_m2.into(),
            });
        }
        for (i, p) in raw.point.into_iter().enumerate() {
            let (node, position_m) =
                self.link(&stick, &format!("point[{i}]"), &p.grid, p.position_m);
            stick.points.push(Point { name: p.name, node, position_m });
        }
        for (i, s) in raw.spring.into_iter().enumerate() {
            let key = format!("spring[{i}]");
            for v in s.translation_n_m {
                self.not_negative(format!("{key}.translation_n_m"), v);
            }
            for v in s.rotation_n_m_rad {
                self.not_negative(format!("{key}.rotation_n_m_rad"), v);
            }
            let grids_key = format!("{key}.grids");
            stick.springs.push(Spring {
                nodes: [self.node(&grids_key, &s.grids[0]), self.node(&grids_key, &s.grids[1])],
                position_m: self.vector(&format!("{key}.position_m"), s.position_m),
                translation_n_m: s.translation_n_m.into(),
                rotation_n_m_rad: s.rotation_n_m_rad.into(),
            });
        }
        self.grid_names(&stick);
        self.problems.into_result(stick)
    }

    fn materials(&mut self, raw: &[raw::Material]) -> BTreeMap<String, (f64, f64)> {
        let mut materials = BTreeMap::new();
        for (i, m) in raw.iter().enumerate() {
            self.positive(format!("material[{i}].youngs_modulus_pa"), m.youngs_modulus_pa);
            self.positive(format!("material[{i}].shear_modulus_pa"), m.shear_modulus_pa);
            let moduli = (m.youngs_modulus_pa, m.shear_modulus_pa);
            if materials.insert(m.name.clone(), moduli).is_some() {
                self.refuse(
                    format!("material[{i}].name"),
                    format!("`{}` again", m.name),
                    "a new name",
                );
            }
        }
        materials
    }

    fn link(
        &mut self,
        stick: &Stick,
        key: &str,
        grid: &str,
        position_m: Option<[f64; 3]>,
    ) -> (usize, Vector3<f64>) {
        let node = self.node(&format!("{key}.grid"), grid);
        let position = match position_m {
            Some(p) => self.vector(&format!("{key}.position_m"), p),
            // Without any node a problem is already noted.
            None => stick.nodes.get(node).map_or_else(Vector3::zeros, |n| n.position_m),
        };
        (node, position)
    }

    fn grid_names(&mut self, stick: &Stick) {
        let mut seen = std::collections::BTreeSet::new();
        let names = (stick.point_masses.iter().map(|p| ("point_mass.name", &p.name)))
            .chain(stick.points.iter().map(|p| ("point.name", &p.name)));
        for (key, name) in names {
            if name.is_empty() || self.nodes.contains_key(name) || !seen.insert(name) {
                self.refuse(key, format!("`{name}`"), "a name that no other grid has");
            }
        }
    }

    fn beam(
        &mut self,
        stick: &mut Stick,
        materials: &BTreeMap<String, (f64, f64)>,
        index: usize,
        beam: raw::Beam,
    ) {
        let key = format!("beam[{index}]");
        let start = self.vector(&format!("{key}.start_m"), beam.start_m);
        let end = self.vector(&format!("{key}.end_m"), beam.end_m);
        self.finite(format!("{key}.first_station_m"), beam.first_station_m);
        let length = (end - start).norm();
        let Some(axes) = local_axes(end - start, beam.up.map(Vector3::from)) else {
            self.refuse(
                key,
                format!("start_m {:?}, end_m {:?}, up {:?}", beam.start_m, beam.end_m, beam.up),
                "two different points and `up` not along the beam",
            );
            return;
        };
        // Stations are read to a part in a thousand million of the beam; the last one is exact.
        let tolerance = 1e-9 * length;
        let first = beam.first_station_m;
        let last = first + length;
        let begin = stick.elements.len();
        let mut from = first;
        for (j, piece) in beam.piece.iter().enumerate() {
            let key = format!("{key}.piece[{j}]");
            let to = piece.to_station_m;
            let is_last = j + 1 == beam.piece.len();
            if !(to > from) || !(if is_last { (to - last).abs() } else { to - last } <= tolerance) {
                self.refuse(
                    format!("{key}.to_station_m"),
                    to.to_string(),
                    &format!("above {from}; the last piece ends at {last}"),
                );
                return;
            }
            if piece.elements == 0 {
                self.refuse(format!("{key}.elements"), "0", "at least 1");
                return;
            }
            let &(youngs_modulus_pa, shear_modulus_pa) =
                materials.get(&piece.material).unwrap_or_else(|| {
                    self.refuse(
                        format!("{key}.material"),
                        format!("`{}`", piece.material),
                        "the name of a material",
                    );
                    &(1.0, 1.0)
                });
            let section = self.section(&format!("{key}.section"), &piece.section);
            let end_section = match &piece.end_section {
                Some(s) => self.section(&format!("{key}.end_section"), s),
                None => section,
            };
            let to = if is_last { last } else { to };
            let n = piece.elements;
            for e in 0..=n {
                if e == n && !is_last {
                    break;
                }
                let station = from + (to - from) * e as f64 / n as f64;
                stick.nodes.push(Node {
                    name: format!("{}.{:02}", piece.grids, e + 1),
                    position_m: start + (end - start) * ((station - first) / length),
                });
            }
            // The first node of this piece stands `e` places before the node of element `e`.
            let base = stick.nodes.len() - n - usize::from(is_last);
            for e in 0..n {
                let at = |k: usize| k as f64 / n as f64;
                stick.elements.push(Element {
                    nodes: [base + e, base + e + 1],
                    stations_m: [from + (to - from) * at(e), from + (to - from) * at(e + 1)],
                    axes,
                    sections: [
                        between(&section, &end_section, at(e)),
                        between(&section, &end_section, at(e + 1)),
                    ],
                    youngs_modulus_pa,
                    shear_modulus_pa,
                });
            }
            from = to;
        }
        if beam.piece.is_empty() {
            self.refuse(format!("{key}.piece"), "no piece", "at least one piece");
        }
        let range = begin..stick.elements.len();
        for (j, mass) in beam.mass.into_iter().enumerate() {
            let key = format!("{key}.mass[{j}]");
            let mass = self.line_mass(&key, mass, [first, last], tolerance, range.clone());
            stick.line_masses.push(mass);
        }
    }

    fn line_mass(
        &mut self,
        key: &str,
        raw: raw::LineMass,
        [first, last]: [f64; 2],
        tolerance: f64,
        elements: std::ops::Range<usize>,
    ) -> LineMass {
        let from = raw.from_station_m.unwrap_or(first);
        let to = raw.to_station_m.unwrap_or(last);
        if !(from >= first - tolerance && to > from && to <= last + tolerance) {
            self.refuse(
                format!("{key}.from_station_m, to_station_m"),
                format!("{from}, {to}"),
                &format!("increasing, within {first} to {last}"),
            );
        }
        if let Some(radius) = raw.gyration_m {
            self.not_negative(format!("{key}.gyration_m"), radius);
        }
        self.not_negative(format!("{key}.slosh_kg"), raw.slosh_kg);
        let least = raw.mass_kg.iter().copied().fold(f64::INFINITY, f64::min);
        let most = raw.mass_kg.iter().copied().fold(0.0, f64::max);
        if !(raw.slosh_kg <= least) {
            self.refuse(
                format!("{key}.slosh_kg"),
                raw.slosh_kg.to_string(),
                "at most the least of mass_kg",
            );
        }
        if let Some(full) = raw.full_kg {
            self.positive(format!("{key}.full_kg"), full);
            if !(most <= full) {
                self.refuse(
                    format!("{key}.full_kg"),
                    full.to_string(),
                    "at least the greatest of mass_kg",
                );
            }
        }
        LineMass {
            mass_kg: self.history(key, raw.time_s, raw.mass_kg),
            name: raw.name,
            elements,
            stations_m: [from.max(first), to.min(last)],
            full_kg: raw.full_kg,
            axial: raw.axial,
            torsion: raw.torsion,
            gyration_m: raw.gyration_m,
            slosh_kg: raw.slosh_kg,
        }
    }
}

/// Section a fraction `w` of the way along a piece, of the same form as its ends where it can be.
fn between(start: &Section, end: &Section, w: f64) -> Section {
    match (start, end) {
        (
            Section::Tube { radius_m: r0, thickness_m: t0 },
            Section::Tube { radius_m: r1, thickness_m: t1 },
        ) => Section::Tube { radius_m: r0 + w * (r1 - r0), thickness_m: t0 + w * (t1 - t0) },
        _ => Section::General(start.toward(end, w)),
    }
}

/// Rows: unit vectors along the beam, local y = z × x, and local z towards `up`.
fn local_axes(along: Vector3<f64>, up: Option<Vector3<f64>>) -> Option<Matrix3<f64>> {
    let x = along.try_normalize(0.0)?;
    let up = up.unwrap_or(if x.z.abs() < 0.9 { Vector3::z() } else { Vector3::y() });
    // Within a thousandth of a radian of the axis the direction of z is not meant seriously.
    let y = up.try_normalize(0.0)?.cross(&x).try_normalize(1e-3)?;
    let z = x.cross(&y);
    let axes = Matrix3::from_rows(&[x.transpose(), y.transpose(), z.transpose()]);
    axes.iter().all(|v| v.is_finite()).then_some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const REFERENCE: &str = include_str!("../../vehicles/sls-like/stick.toml");

    fn problems_after(change: &[(&str, &str)]) -> String {
        let mut text = REFERENCE.to_owned();
        for (from, to) in change {
            assert!(text.contains(from), "{from}");
            text = text.replacen(from, to, 1);
        }
        Stick::parse(&text, "stick.toml").unwrap_err().to_string()
    }

    #[test]
    fn the_reference_stick_is_read_and_is_mirror_symmetric() {
        let stick = Stick::parse(REFERENCE, "stick.toml").unwrap();
        let named = |name: &str| {
            let nodes = stick.nodes.iter().map(|n| (&n.name, n.position_m));
            let points = stick.points.iter().map(|p| (&p.name, p.position_m));
            nodes.chain(points).find(|(n, _)| *n == name).map(|(_, p)| p)
        };
        let grids =
            (stick.nodes.iter().map(|n| &n.name)).chain(stick.points.iter().map(|p| &p.name));
        for name in grids.filter(|name| name.contains("left")) {
            let (left, right) =
                (named(name).unwrap(), named(&name.replace("left", "right")).unwrap());
            assert_eq!(left, Vector3::new(right.x, -right.y, right.z), "{name}");
        }
        let case = stick.nodes.iter().filter(|n| n.name.starts_with("booster.left.case."));
        assert!(case.count() > 20);
    }

    #[test]
    fn all_problems_of_a_text_are_told_at_once_each_with_its_key() {
        let told = problems_after(&[
            ("format = 1", "format = 2"),
            ("youngs_modulus_pa = 73e9", "youngs_modulus_pa = -73e9"),
            ("mass_kg = [75000.0]", "mass_kg = [nan]"),
            ("grid = \"booster.left.aft.01\"", "grid = \"booster.left.oft.01\""),
            ("name = \"nose\"", "name = \"tank.lox\""),
            ("time_s = [0, 120]", "time_s = [120, 0]"),
            ("material = \"steel\"", "material = \"steal\""),
        ]);
        for key in [
            "format: found 2; allowed: 1",
            "material[0].youngs_modulus_pa: found -73000000000",
            "beam[0].mass[0].mass_kg: found NaN",
            "point[0].grid: found `booster.left.oft.01`",
            "point.name: found `tank.lox`",
            "beam[0].mass[2].time_s: found [120.0, 0.0]",
            "beam[1].piece[0].material: found `steal`",
        ] {
            assert!(told.contains(key), "{key} is missing in\n{told}");
        }
        assert_eq!(told.lines().count(), 7, "{told}");
    }

    #[test]
    fn a_misspelt_key_and_a_wrong_type_are_told_with_their_line() {
        let told = problems_after(&[("elements = 9", "element = 9")]);
        assert!(told.contains("line ") && told.contains("element"), "{told}");
        let told = problems_after(&[("elements = 9", "elements = \"nine\"")]);
        assert!(told.contains("line ") && told.contains("nine"), "{told}");
    }

    #[test]
    fn geometry_that_does_not_fit_is_told() {
        for (from, to, key) in [
            ("to_station_m = 94.0", "to_station_m = 95.0", "to_station_m: found 95"),
            ("to_station_m = 50.4", "to_station_m = 30.0", "to_station_m: found 30"),
            ("end_m = [94.0, 0.0, 0.0]", "end_m = [0.0, 0.0, 0.0]", "two different points"),
            ("elements = 9", "elements = 0", "elements: found 0"),
            ("elements = 9", "elements = 99999999999", "at most 1000 elements"),
            ("thickness_m = 0.012", "thickness_m = 9.0", "at most twice the mean radius"),
            ("radius_m = 1.2, ", "radius_m = 1.2, area_m2 = 1.0, ", "a mixture of both forms"),
            ("radius_m = 1.2, ", "", "radius_m: found 0"),
            ("slosh_kg = 7490.0", "slosh_kg = 749000.0", "at most the least of mass_kg"),
            ("full_kg = 146700.0", "full_kg = 14670.0", "at least the greatest of mass_kg"),
            ("from_station_m = 34.3", "from_station_m = 94.3", "increasing, within 0 to 94"),
            ("mass_kg = [843700.0, 632308.0]", "mass_kg = [843700.0]", "one value, or one for"),
        ] {
            let told = problems_after(&[(from, to)]);
            assert!(told.contains(key), "{key} is missing in\n{told}");
        }
    }

    proptest! {
        #[test]
        fn any_text_is_read_or_refused(text in "[a-z_=.\"0-9\\[\\]\n -]{0,200}") {
            let _ = Stick::parse(&text, "stick.toml");
        }

        #[test]
        fn an_altered_reference_is_read_or_refused(
            at in 0..1_000_000_usize, length in 0..40_usize, to in "[-a-z_=.\"0-9\\[\\]\n]{0,12}",
        ) {
            let from = (at % REFERENCE.len()..).find(|&i| REFERENCE.is_char_boundary(i)).unwrap();
            let end = (from + length..).find(|&i| i >= REFERENCE.len() || REFERENCE.is_char_boundary(i));
            let end = end.unwrap().min(REFERENCE.len());
            let text = format!("{}{to}{}", &REFERENCE[..from], &REFERENCE[end..]);
            if let Ok(stick) = Stick::parse(&text, "stick.toml") {
                prop_assert!(stick.elements.len() <= MAX_ELEMENTS);
            }
        }
    }
}
