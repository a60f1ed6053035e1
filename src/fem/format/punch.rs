//! Nastran punch file: the `$EIGENVECTOR` blocks in SORT1 form.
//!
//! It holds no grids and no generalised masses; those come from the deck and from elsewhere.

use super::lines::{columns, digits, lines, real};
use super::{complex, frequency_hz, refuse_superelement};
use crate::fem::results::{NodeShape, Precision, RawMode, Results};
use crate::problem::Problems;

pub(super) fn recognised(bytes: &[u8]) -> bool {
    let headers = ["$TITLE   =", "$EIGENVECTOR", "$SUBTITLE=", "$DISPLACEMENTS"];
    lines(bytes).take(20).any(|(_, line)| headers.iter().any(|header| line.starts_with(header)))
}

/// The block of which lines are being read.
#[derive(Default)]
struct Block {
    /// The header names eigenvectors or displacements.
    shapes: bool,
    /// Components follow as real and imaginary parts.
    imaginary: bool,
    subcase: String,
    /// Set by the `$EIGENVALUE` line, without which displacements are no modes.
    mode: Option<RawMode>,
}

/// One point: its node if it is a grid, and the numbers of its lines so far.
struct Point {
    line: usize,
    node: Option<i64>,
    values: Vec<f64>,
}

struct Reader<'a> {
    name: &'a str,
    results: Results,
    block: Block,
    point: Option<Point>,
    digits: u8,
    subcases: Vec<String>,
    scalar_points: usize,
    undamped_complex: bool,
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let mut reader = Reader {
        name,
        results: Results::empty("Nastran punch file", Precision::Text { digits: 0 }),
        block: Block::default(),
        point: None,
        digits: 0,
        subcases: Vec::new(),
        scalar_points: 0,
        undamped_complex: false,
    };
    for (number, line) in lines(bytes) {
        reader.line(number, &line)?;
    }
    reader.end_block()?;
    let Reader { mut results, digits, scalar_points, undamped_complex, .. } = reader;
    if results.modes.is_empty() {
        return Err(Problems::input(
            name,
            "",
            "a punch file without eigenvectors",
            "$EIGENVECTOR blocks (VECTOR(PUNCH,SORT1) = ALL in the deck)",
        ));
    }
    results.precision = Precision::Text { digits };
    if scalar_points > 0 {
        results.warnings.push(format!("{scalar_points} values at scalar points are left out"));
    }
    if undamped_complex {
        let what = "the modes come from a complex solution; all its imaginary parts are zero";
        results.warnings.push(what.into());
    }
    Ok(results)
}

impl Reader<'_> {
    fn damage(&self, line: usize, found: impl Into<String>, allowed: &str) -> Problems {
        Problems::damage(self.name, format!("line {line}"), found, allowed)
    }

    fn line(&mut self, number: usize, line: &str) -> Result<(), Problems> {
        if let Some(header) = line.strip_prefix('$') {
            self.header(number, columns(header, 0, 71))
        } else if line.trim().is_empty() || !self.block.shapes || self.block.mode.is_none() {
            Ok(())
        } else {
            self.values(number, line)
        }
    }

    fn header(&mut self, number: usize, header: &str) -> Result<(), Problems> {
        self.end_point()?;
        let key = format!("line {number}");
        let value = || header.split_once('=').map_or("", |(_, value)| value.trim());
        refuse_superelement(header, self.name, &key)?;
        if header.starts_with("TITLE") {
            self.end_block()?;
        } else if header.starts_with("EIGENVECTOR") || header.starts_with("DISPLACEMENTS") {
            self.end_block()?;
            self.block.shapes = true;
        } else if !self.block.shapes {
        } else if header.starts_with("REAL-IMAGINARY") {
            self.block.imaginary = true;
        } else if header.starts_with("MAGNITUDE-PHASE") {
            return Err(complex(self.name, &key));
        } else if header.starts_with("SUBCASE ID") {
            self.block.subcase = value().to_owned();
        } else if header.starts_with("POINT ID") {
            let found = "eigenvectors sorted by point (SORT2)";
            return Err(Problems::input(self.name, key, found, "SORT1 output"));
        } else if header.starts_with("EIGENVALUE") {
            self.eigenvalue(number, header)?;
        }
        Ok(())
    }

    /// `EIGENVALUE =  8.232777E+06  MODE =     1`, the eigenvalue of a complex solution in brackets.
    fn eigenvalue(&mut self, number: usize, header: &str) -> Result<(), Problems> {
        let wrong = || self.damage(number, format!("${header}"), "$EIGENVALUE = … MODE = …");
        let (value, mode) = header.split_once("MODE").ok_or_else(wrong)?;
        let mode: i64 = mode.trim_start_matches([' ', '=']).trim().parse().map_err(|_| wrong())?;
        let value = value.split_once('=').ok_or_else(wrong)?.1.trim();
        let frequency_hz = match value.strip_prefix('(') {
            None => frequency_hz(real(value).ok_or_else(wrong)?),
            Some(pair) => {
                let (decay, omega) =
                    pair.trim_end_matches(')').split_once(',').ok_or_else(wrong)?;
                let decay = real(decay).ok_or_else(wrong)?;
                if decay != 0.0 {
                    return Err(complex(self.name, &format!("mode {mode}")));
                }
                real(omega).ok_or_else(wrong)?.abs() / std::f64::consts::TAU
            }
        };
        if !self.subcases.contains(&self.block.subcase) {
            self.subcases.push(self.block.subcase.clone());
            if self.subcases.len() > 1 {
                let found = format!("eigenvectors of subcases {}", self.subcases.join(", "));
                return Err(Problems::input(self.name, "", found, "one subcase with eigenvectors"));
            }
        }
        self.block.mode =
            Some(RawMode { number: mode, frequency_hz, generalised_mass: None, shape: Vec::new() });
        Ok(())
    }

    fn values(&mut self, number: usize, line: &str) -> Result<(), Problems> {
        if !line.starts_with("-CONT-") {
            self.end_point()?;
            let id = columns(line, 0, 10);
            let Ok(id) = id.parse() else {
                return Err(self.damage(number, format!("{id:?}"), "a point id"));
            };
            let node = (columns(line, 10, 18) == "G").then_some(id);
            self.point = Some(Point { line: number, node, values: Vec::new() });
        }
        let Some(point) = &mut self.point else {
            return Err(self.damage(number, "a continuation without a start", "a point id"));
        };
        for from in [18, 36, 54] {
            let text = columns(line, from, from + 18);
            if !text.is_empty() {
                let Some(value) = real(text) else {
                    return Err(self.damage(number, format!("{text:?}"), "a number"));
                };
                if value != 0.0 {
                    self.digits = self.digits.max(digits(text));
                }
                point.values.push(value);
            }
        }
        Ok(())
    }

    fn end_point(&mut self) -> Result<(), Problems> {
        let Some(Point { line, node, values }) = self.point.take() else { return Ok(()) };
        let Some(mode) = &mut self.block.mode else { return Ok(()) };
        let Some(node) = node else {
            self.scalar_points += 1;
            return Ok(());
        };
        let expected = if self.block.imaginary { 12 } else { 6 };
        if values.len() != expected {
            let found = format!("{} values", values.len());
            return Err(self.damage(line, found, &format!("{expected} values for each grid")));
        }
        if values[6..].iter().any(|imaginary| *imaginary != 0.0) {
            let key = format!("mode {}", mode.number);
            return Err(complex(self.name, &key));
        }
        mode.shape.push(NodeShape {
            node,
            translation: [values[0], values[1], values[2]],
            rotation: Some([values[3], values[4], values[5]]),
        });
        Ok(())
    }

    fn end_block(&mut self) -> Result<(), Problems> {
        self.end_point()?;
        let block = std::mem::take(&mut self.block);
        if let Some(mode) = block.mode {
            self.undamped_complex |= block.imaginary;
            self.results.modes.push(mode);
        }
        Ok(())
    }
}
