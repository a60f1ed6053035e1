//! CalculiX result file `.frd`: nodes and the displacements of each mode, as text or binary.
//!
//! Elements, stresses and static steps are skipped. Solid elements only: there are no rotations,
//! and shells and beams are written as the solids they are expanded to.
//!
//! Format as in the manual of CalculiX GraphiX, "Result Format".

use super::lines::{columns, digits, real};
use super::{complex, frequency_hz};
use crate::fem::results::{Node, NodeShape, Precision, RawMode, Results};
use crate::problem::Problems;

/// Nodes of the element types 1 to 12.
const ELEMENT_NODES: [usize; 12] = [8, 6, 4, 20, 15, 10, 3, 6, 4, 8, 2, 3];

pub(super) fn recognised(bytes: &[u8]) -> bool {
    let line = bytes.split(|byte| *byte == b'\n').next().unwrap_or_default();
    line.starts_with(b"    1C") || line.starts_with(b"    1U") || line.starts_with(b"    2C")
}

/// The bytes not read yet: lines of text and, between them, blocks of binary numbers.
struct Reader<'a> {
    name: &'a str,
    bytes: &'a [u8],
    at: usize,
    line: usize,
    digits: u8,
}

/// How the numbers of a block are written.
#[derive(Clone, Copy, PartialEq)]
enum Coding {
    Short,
    Long,
    Float,
    Double,
}

pub(super) fn read(bytes: &[u8], name: &str) -> Result<Results, Problems> {
    let mut results = Results::empty("CalculiX frd", Precision::Text { digits: 0 });
    let mut reader = Reader { name, bytes, at: 0, line: 0, digits: 0 };
    let mut step = Step::default();
    let mut ended = false;
    while let Some(line) = reader.next()? {
        if line.starts_with("    1PSTEP") {
            step = Step::default();
        } else if line.starts_with("    1PGM") {
            step.mass = real(columns(line, 10, line.len()));
        } else if line.starts_with("    1PGK") {
            step.stiffness = real(columns(line, 10, line.len()));
        } else if line.starts_with("    1PMODE") {
            step.mode = columns(line, 10, line.len()).parse().ok();
        } else if line.starts_with("    1PHID") {
            step.harmonic = columns(line, 10, line.len()).parse().unwrap_or(-1);
        } else if line.starts_with("    2C") {
            let (count, coding) = reader.head(line, 24, 36, 73)?;
            reader.nodes(count, coding, &mut results)?;
        } else if line.starts_with("    3C") {
            let (count, coding) = reader.head(line, 24, 36, 73)?;
            reader.elements(count, coding)?;
        } else if line.starts_with("  100C") {
            let head = line.to_owned();
            reader.result(&head, &step, &mut results)?;
        } else if line.starts_with(" 9999") {
            ended = true;
            break;
        }
    }
    if !ended {
        let found = "the end of the file";
        return Err(Problems::damage(name, format!("line {}", reader.line), found, "9999"));
    }
    if results.precision == (Precision::Text { digits: 0 }) {
        results.precision = Precision::Text { digits: reader.digits };
    }
    Ok(results)
}

/// Parameters of the step to which the next blocks belong.
struct Step {
    mode: Option<i64>,
    mass: Option<f64>,
    stiffness: Option<f64>,
    /// Nodal diameter of cyclic symmetry; -1 without it.
    harmonic: i64,
}

impl Default for Step {
    fn default() -> Self {
        Self { mode: None, mass: None, stiffness: None, harmonic: -1 }
    }
}

impl<'a> Reader<'a> {
    fn damage(&self, found: impl Into<String>, allowed: &str) -> Problems {
        Problems::damage(self.name, format!("line {}", self.line), found, allowed)
    }

    fn next(&mut self) -> Result<Option<&'a str>, Problems> {
        let rest = &self.bytes[self.at..];
        if rest.is_empty() {
            return Ok(None);
        }
        let end = rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len());
        self.at += (end + 1).min(rest.len());
        self.line += 1;
        let line = rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]);
        // User headers may be in any encoding; nothing in them is read.
        match std::str::from_utf8(line) {
            Ok(line) => Ok(Some(line)),
            Err(_) if line.starts_with(b"    1U") => Ok(Some("    1U")),
            Err(_) => Err(self.damage("bytes that are no text", "a line of text")),
        }
    }

    /// Number of entries and coding in the head line of a block; each entry takes a byte at least.
    fn head(
        &self,
        line: &str,
        from: usize,
        to: usize,
        coding: usize,
    ) -> Result<(usize, Coding), Problems> {
        let count = columns(line, from, to).parse().ok();
        let count = count.filter(|count| *count <= self.bytes.len() - self.at);
        let coding = match columns(line, coding, coding + 2) {
            "0" | "" => Some(Coding::Short),
            "1" => Some(Coding::Long),
            "2" => Some(Coding::Float),
            "3" => Some(Coding::Double),
            _ => None,
        };
        let wrong = || self.damage(format!("{line:?}"), "a count that fits the file and a coding");
        Ok((count.ok_or_else(wrong)?, coding.ok_or_else(wrong)?))
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Problems> {
        let taken = self.bytes[self.at..]
            .get(..length)
            .ok_or_else(|| self.damage("the end of the file", "the numbers of a binary block"))?;
        self.at += length;
        Ok(taken)
    }

    fn integer(&mut self) -> Result<i64, Problems> {
        let bytes = self.take(4)?;
        Ok(i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]).into())
    }

    /// Node id and the numbers of each entry of a block.
    fn entries(
        &mut self,
        count: usize,
        width: usize,
        coding: Coding,
        mut entry: impl FnMut(i64, &[f64]),
    ) -> Result<(), Problems> {
        let mut values = Vec::new();
        for _ in 0..count {
            values.clear();
            let id = match coding {
                Coding::Float => {
                    let id = self.integer()?;
                    let bytes = self.take(4 * width)?.as_chunks::<4>().0;
                    values.extend(bytes.iter().map(|b| f64::from(f32::from_le_bytes(*b))));
                    id
                }
                Coding::Double => {
                    let id = self.integer()?;
                    let bytes = self.take(8 * width)?.as_chunks::<8>().0;
                    values.extend(bytes.iter().map(|b| f64::from_le_bytes(*b)));
                    id
                }
                Coding::Short | Coding::Long => self.text_entry(width, coding, &mut values)?,
            };
            entry(id, &values);
        }
        if matches!(coding, Coding::Short | Coding::Long) {
            let line = self.next()?.unwrap_or("");
            if !line.starts_with(" -3") {
                return Err(self.damage(format!("{line:?}"), "-3 after the counted entries"));
            }
        }
        Ok(())
    }

    fn text_entry(
        &mut self,
        width: usize,
        coding: Coding,
        values: &mut Vec<f64>,
    ) -> Result<i64, Problems> {
        let id_end = if coding == Coding::Short { 8 } else { 13 };
        let mut id = None;
        while values.len() < width {
            let line = self.next()?.unwrap_or("");
            let wrong = |reader: &Self| {
                reader.damage(format!("{line:?}"), "-1, node and numbers of twelve columns")
            };
            match &id {
                None if line.starts_with(" -1") => id = columns(line, 3, id_end).parse().ok(),
                Some(_) if line.starts_with(" -2") => {}
                _ => return Err(wrong(self)),
            }
            for k in 0..(width - values.len()).min(6) {
                let text = columns(line, id_end + 12 * k, id_end + 12 * (k + 1));
                values.push(real(text).ok_or_else(|| wrong(self))?);
                self.digits = self.digits.max(digits(text));
            }
        }
        id.ok_or_else(|| self.damage("no node", "a node"))
    }

    fn nodes(
        &mut self,
        count: usize,
        coding: Coding,
        results: &mut Results,
    ) -> Result<(), Problems> {
        let nodes = &mut results.nodes;
        self.entries(count, 3, coding, |id, at| {
            nodes.push(Node {
                id,
                position: [at[0], at[1], at[2]],
                position_system: 0,
                displacement_system: 0,
            });
        })
    }

    fn elements(&mut self, count: usize, coding: Coding) -> Result<(), Problems> {
        if matches!(coding, Coding::Short | Coding::Long) {
            while let Some(line) = self.next()? {
                if line.starts_with(" -3") {
                    return Ok(());
                }
            }
            return Err(self.damage("the end of the file", "-3 after the elements"));
        }
        for _ in 0..count {
            self.integer()?;
            let kind = self.integer()?;
            let index = usize::try_from(kind - 1).unwrap_or(usize::MAX);
            let nodes = ELEMENT_NODES.get(index).ok_or_else(|| {
                self.damage(format!("element type {kind}"), "a type from 1 to 12")
            })?;
            self.take(4 * (2 + nodes))?;
        }
        Ok(())
    }

    /// A block of nodal results; those that are no displacements of a mode are passed over.
    fn result(&mut self, head: &str, step: &Step, results: &mut Results) -> Result<(), Problems> {
        let (count, coding) = self.head(head, 24, 36, 73)?;
        let attribute = self.next()?.unwrap_or("").to_owned();
        let components = columns(&attribute, 13, 18).parse::<usize>().ok();
        let components = components
            .filter(|n| attribute.starts_with(" -4") && (1..=40).contains(n))
            .ok_or_else(|| self.damage(format!("{attribute:?}"), "-4, name and components"))?;
        let mut stored = 0;
        for _ in 0..components {
            let line = self.next()?.unwrap_or("");
            if !line.starts_with(" -5") {
                return Err(self.damage(format!("{line:?}"), "-5 and a component"));
            }
            // Components that the viewer computes itself are marked and not stored.
            stored += usize::from(columns(line, 33, 38) != "1");
        }
        let name = columns(&attribute, 5, 13);
        let modal = columns(head, 63, 73).starts_with("MODAL") || step.mode.is_some();
        if name.starts_with("DISPI") && modal {
            return Err(complex(self.name, &format!("line {}", self.line)));
        }
        if name != "DISP" || !modal {
            let width = stored.max(1);
            return self.entries(count, width, coding, |_, _| {});
        }
        if step.harmonic >= 0 {
            let found = format!("modes of cyclic symmetry, nodal diameter {}", step.harmonic);
            return Err(Problems::input(self.name, format!("line {}", self.line), found, {
                "modes of the whole structure"
            }));
        }
        if stored != 3 {
            return Err(self.damage(format!("{stored} displacements"), "three"));
        }
        let printed = real(columns(head, 12, 24));
        let wrong = || self.damage(format!("{head:?}"), "a mode and its frequency");
        // From 10 Hz on the frequency is printed with ten digits, below with six, and zero for a
        // negative eigenvalue; generalised stiffness and mass have seven.
        let frequency_hz = match (step.mass, step.stiffness) {
            (Some(mass), Some(stiffness)) if mass > 0.0 && digits(columns(head, 12, 24)) < 8 => {
                frequency_hz(stiffness / mass)
            }
            _ => printed.ok_or_else(wrong)?,
        };
        let number = columns(head, 58, 63).parse().ok();
        let number = step.mode.or(number).ok_or_else(wrong)?;
        let mut shape = Vec::new();
        self.entries(count, 3, coding, |node, u| {
            shape.push(NodeShape { node, translation: [u[0], u[1], u[2]], rotation: None });
        })?;
        if coding == Coding::Float {
            results.precision = Precision::Single;
        } else if coding == Coding::Double {
            results.precision = Precision::Double;
        }
        results.modes.push(RawMode { number, frequency_hz, generalised_mass: step.mass, shape });
        Ok(())
    }
}
