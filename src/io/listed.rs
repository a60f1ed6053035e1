//! A plan file: the cases of a campaign as CSV or Parquet, a column for every draw key.
//!
//! How its cases are drawn is decided in `dispersion::plan`.

use super::files;
use crate::dispersion::plan::acting;
use crate::dispersion::{Dispersion, Listed, Position};
use crate::problem::{Kind, Problems};
use crate::spelling::allowed_instead;
use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Most cases of a plan file.
const MOST_CASES: usize = 10_000_000;

/// A column as it stands in the file.
struct Column {
    name: String,
    values: Vec<f64>,
}

/// The kinds of plan files, by the end of their names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Comma-separated values with a header.
    Csv,
    /// Parquet.
    Parquet,
}

impl Format {
    /// The kind of a file by its name; none if it is neither.
    pub fn of(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase();
        [(".csv", Self::Csv), (".parquet", Self::Parquet)]
            .into_iter()
            .find_map(|(end, format)| name.ends_with(end).then_some(format))
    }
}

/// Reads the cases in `bytes` of the file called `file` for `dispersion`: a column for every draw key
/// that acts on the vehicle, called by its key (normal scores where `normal_scores`, else values) or
/// by its column in the table `cases` (`draw_…` a value, `z_…` a normal score), and perhaps one called
/// `case` that counts from zero.
///
/// # Errors
/// Every column that is unknown, missing or given twice, and the first value of each that is no number.
pub fn read(
    bytes: Vec<u8>,
    file: &str,
    format: Format,
    normal_scores: bool,
    dispersion: &Dispersion,
) -> Result<Listed, Problems> {
    let mut problems = Problems::default();
    let columns = match format {
        Format::Csv => csv(&bytes, file, &mut problems)?,
        Format::Parquet => parquet(bytes, file, &mut problems)?,
    };
    let wanted = acting(dispersion);
    let mut names: BTreeMap<String, (usize, bool)> = BTreeMap::new();
    for &draw in &wanted {
        let column = &dispersion.draws()[draw].column;
        let score = format!("z_{}", column.strip_prefix("draw_").unwrap_or(column));
        names.insert(dispersion.draws()[draw].key.clone(), (draw, normal_scores));
        names.insert(column.clone(), (draw, false));
        names.insert(score, (draw, true));
    }
    let mut found: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for Column { name, mut values } in columns {
        if name == "case" {
            if let Some(at) = values.iter().zip(0_u32..).position(|(v, i)| *v != f64::from(i)) {
                let (key, found) = (format!("case[{at}]"), values[at].to_string());
                problems.push(Kind::Input, file, key, found, at.to_string());
            }
            continue;
        }
        let Some(&(draw, score)) = names.get(&name) else {
            let keys = wanted.iter().map(|&d| dispersion.draws()[d].key.as_str());
            let allowed = format!("a draw key or its column: {}", allowed_instead(&name, keys));
            problems.push(Kind::Input, file, name, "an unknown column", allowed);
            continue;
        };
        if score {
            let law = &dispersion.draws()[draw].law;
            values.iter_mut().for_each(|v| *v = law.value(&Position::of_score(*v)));
        }
        if found.insert(draw, values).is_some() {
            let key = &dispersion.draws()[draw].key;
            problems.push(Kind::Input, file, name, format!("`{key}` again"), "each key once");
        }
    }
    for &draw in wanted.iter().filter(|draw| !found.contains_key(draw)) {
        let key = &dispersion.draws()[draw].key;
        problems.push(Kind::Input, file, key, "no such column", "a column for every draw key");
    }
    let listed = Listed { columns: found.into_iter().collect() };
    if problems.0.is_empty() && listed.cases() == 0 {
        problems.push(Kind::Input, file, "", "no case", "at least one");
    }
    problems.into_result(listed)
}

/// Reads CSV: a header, commas, a decimal point; names may be quoted.
fn csv(bytes: &[u8], file: &str, problems: &mut Problems) -> Result<Vec<Column>, Problems> {
    let text = std::str::from_utf8(bytes)
        .map_err(|error| Problems::input(file, "", error.to_string(), "UTF-8 text"))?;
    let mut lines = text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate();
    let header = lines.next().map_or("", |(_, line)| line);
    let mut columns: Vec<Column> = header
        .split(',')
        .map(|name| Column { name: name.trim().trim_matches('"').to_owned(), values: vec![] })
        .collect();
    let mut bad = vec![false; columns.len()];
    for (number, line) in lines.filter(|(_, line)| !line.trim().is_empty()) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != columns.len() {
            let found = format!("{} values in line {}", cells.len(), number + 1);
            let allowed = format!("{}, as many as names in the header", columns.len());
            return Err(Problems::input(file, "", found, allowed));
        }
        for ((column, cell), bad) in columns.iter_mut().zip(cells).zip(&mut bad) {
            let value = cell.trim().parse::<f64>().ok().filter(|value| value.is_finite());
            if value.is_none() && !*bad {
                *bad = true;
                let found = format!("\"{}\" in line {}", cell.trim(), number + 1);
                problems.push(Kind::Input, file, &column.name, found, "a finite number");
            }
            column.values.push(value.unwrap_or(0.0));
        }
    }
    Ok(columns)
}

/// Reads Parquet: columns of numbers.
fn parquet(bytes: Vec<u8>, file: &str, problems: &mut Problems) -> Result<Vec<Column>, Problems> {
    // The Parquet reader panics on some malformed files instead of returning an error.
    let decoded = catch_unwind(AssertUnwindSafe(|| decode(bytes, file)));
    let malformed = || damage(file, "a malformed Parquet file".to_owned());
    let all = decoded.unwrap_or_else(|_| Err(malformed()))?;
    let mut columns = Vec::new();
    for (name, values) in all {
        let Ok(values) = values else {
            problems.push(Kind::Input, file, name, "no numbers", "a column of numbers");
            continue;
        };
        if let Some(row) = values.iter().position(|value| !value.is_finite()) {
            let found = format!("no finite number in row {row}");
            problems.push(Kind::Input, file, &name, found, "a finite number");
        }
        columns.push(Column { name, values });
    }
    Ok(columns)
}

fn damage(file: &str, found: String) -> Problems {
    Problems::damage(file, "", found, "a whole Parquet file")
}

type Decoded = Vec<(String, Result<Vec<f64>, ()>)>;

/// Names and numbers of a Parquet file; NaN for NULL, no numbers for a column of something else.
fn decode(bytes: Vec<u8>, file: &str) -> Result<Decoded, Problems> {
    let text = |error: parquet::errors::ParquetError| damage(file, error.to_string());
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let bytes = bytes::Bytes::from(bytes);
    let builder =
        ParquetRecordBatchReaderBuilder::try_new_with_options(bytes, options).map_err(text)?;
    super::flat::readable(builder.metadata(), file)?;
    let rows = builder.metadata().file_metadata().num_rows();
    if !(0..=MOST_CASES as i64).contains(&rows) {
        return Err(damage(file, format!("{rows} rows, beyond {MOST_CASES}")));
    }
    let fields = builder.schema().fields().iter();
    let mut columns: Decoded = fields.map(|f| (f.name().clone(), Ok(Vec::new()))).collect();
    for batch in builder.build().map_err(text)? {
        let batch = batch.map_err(|error| damage(file, error.to_string()))?;
        for ((_, values), array) in columns.iter_mut().zip(batch.columns()) {
            let numbers = if array.data_type().is_numeric() {
                arrow::compute::cast(array, &DataType::Float64).ok()
            } else {
                None
            };
            match (numbers, values) {
                (Some(numbers), Ok(values)) => {
                    let numbers = numbers.as_primitive::<Float64Type>();
                    values.extend(numbers.iter().map(|value| value.unwrap_or(f64::NAN)));
                }
                (_, values) => *values = Err(()),
            }
        }
    }
    Ok(columns)
}

/// Reads the plan file at `path`; gives its bytes too.
///
/// # Errors
/// As [`read`], or a file that cannot be read.
pub fn load(
    path: &std::path::Path,
    normal_scores: bool,
    dispersion: &Dispersion,
) -> Result<(Format, Vec<u8>, Listed), Problems> {
    let name = files::name(path);
    let Some(format) = Format::of(&name) else {
        return Err(Problems::input(name, "", "another name", "a name in .csv or .parquet"));
    };
    let bytes = files::read_bytes(path)?;
    let listed = read(bytes.clone(), &name, format, normal_scores, dispersion)?;
    Ok((format, bytes, listed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dispersion::{Table, fixture, resolve};

    fn dispersion() -> Dispersion {
        let text = "[[row]]\npath = \"booster.*.thrust\"\nlevel = \"engine\"\napply = \"scale\"\n\
            source = \"E\"\nlaw = { kind = \"normal\", mean = 1.0, sigma = 0.1 }\n\
            common = \"f\"\ncommon_weight = 0.5\n[[common]]\nid = \"f\"\nsource = \"E\"\n";
        let table: Table = toml::from_str(text).unwrap();
        resolve(&table, &fixture::vehicle(), &mut |key, found, _| panic!("{key}: {found}"))
    }

    fn of_csv(text: &str, scores: bool) -> Result<Listed, Problems> {
        read(text.as_bytes().to_vec(), "p.csv", Format::Csv, scores, &dispersion())
    }

    #[test]
    fn columns_are_known_by_draw_key_and_by_their_names_in_the_results() {
        let by_key = "case,booster.right.thrust @ engine,\"booster.left.thrust @ engine\"\n\
                      0,1.5,0.9\n1,1,1.2\n";
        let listed = of_csv(by_key, false).unwrap();
        assert_eq!(listed.columns, [(0, vec![0.9, 1.2]), (1, vec![1.5, 1.0])]);
        let by_column = "draw_booster_left_thrust_scale,z_booster_right_thrust_scale\r\n1.1,0\r\n";
        assert_eq!(of_csv(by_column, false).unwrap().columns, [(0, vec![1.1]), (1, vec![1.0])]);
        let scores = of_csv(by_key, true).unwrap();
        // Φ and its inverse at 1.5: a few roundings.
        assert!((scores.columns[1].1[0] - 1.15).abs() < 1e-14);
    }

    #[test]
    fn unknown_missing_and_repeated_columns_and_bad_numbers_are_all_named() {
        let text = "booster.left.thrus @ engine,case,booster.left.thrust @ engine,\
                    draw_booster_left_thrust_scale\n1,0,1,1\n1,5,,nan\n";
        let problems = of_csv(text, false).unwrap_err();
        let keys: Vec<&str> = problems.0.iter().map(|p| p.key.as_str()).collect();
        for key in [
            "booster.left.thrus @ engine",
            "case[1]",
            "booster.left.thrust @ engine",
            "draw_booster_left_thrust_scale",
            "booster.right.thrust @ engine",
        ] {
            assert!(keys.contains(&key), "{key}: {problems}");
        }
        assert!(problems.0.iter().all(|p| p.file == "p.csv"));
        assert!(problems.to_string().contains("\"\" in line 3"), "{problems}");
    }

    #[test]
    fn short_lines_empty_files_and_other_bytes_are_refused() {
        let header = "booster.left.thrust @ engine,booster.right.thrust @ engine\n";
        assert!(of_csv(&format!("{header}1\n"), false).is_err());
        assert!(of_csv(header, false).is_err());
        assert!(of_csv("", false).is_err());
        for bytes in [vec![0xff, 0xfe], b"PAR1".to_vec(), Vec::new()] {
            for format in [Format::Csv, Format::Parquet] {
                assert!(read(bytes.clone(), "p", format, false, &dispersion()).is_err());
            }
        }
    }
}
