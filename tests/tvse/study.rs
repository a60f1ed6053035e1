//! A study: a scaffold in a folder of its own, whose files a test edits and on which it runs `tvse`.

use arrow::array::{Array, AsArray};
use arrow::datatypes::{DataType, Float64Type};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// The five tables of a run.
pub const TABLES: [&str; 5] = ["cases", "columns", "modes", "summary", "worst"];

/// A scaffold in a temporary folder.
pub struct Study {
    place: TempDir,
}

/// What the program said and how it ended.
#[derive(Debug)]
pub struct Said {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// The program with these words, to be run in `folder`.
pub fn tvse(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tvse"));
    command.args(words).current_dir(folder);
    command
}

/// What the program says to these words.
pub fn said(folder: &Path, words: &[&str]) -> Said {
    tvse(folder, words).output().unwrap().into()
}

impl Study {
    /// A new scaffold whose `runs/smoke.toml` asks for six cases.
    pub fn new() -> Self {
        let place = tempfile::tempdir().unwrap();
        let study = Self { place };
        tvse::io::scaffold::write(&study.path("")).unwrap();
        study.edit("runs/smoke.toml", "cases = 50", "cases = 6");
        study
    }

    /// Path of a file of the study.
    pub fn path(&self, name: &str) -> PathBuf {
        self.place.path().join("study").join(name)
    }

    /// Text of a file.
    pub fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Replaces the first `from` in a file by `to`.
    pub fn edit(&self, name: &str, from: &str, to: &str) {
        let text = self.text(name);
        assert!(text.contains(from), "{from} is not in {name}");
        fs::write(self.path(name), text.replacen(from, to, 1)).unwrap();
    }

    /// Adds text at the end of a file.
    pub fn append(&self, name: &str, text: &str) {
        fs::write(self.path(name), self.text(name) + text).unwrap();
    }

    /// An adverse corner with evaluated signs and three cases around it in `runs/smoke.toml`.
    pub fn with_corner(self) -> Self {
        self.append(
            "runs/smoke.toml",
            "[[corner]]\nname = \"adverse\"\ncases = 3\nsigns = \"evaluated\"\nmode = \"tvse\"\n\
             variant = \"jet_damping\"\nkeys = [\"booster.*.thrust\", \"booster.*.nozzle.*\"]\n",
        );
        self
    }

    /// What the program says to these words.
    pub fn said(&self, words: &[&str]) -> Said {
        said(&self.path(""), words)
    }

    /// Runs `runs/smoke.toml` into `folder`, which must work, and gives what was printed.
    pub fn run(&self, folder: &str, more: &[&str]) -> String {
        let said = self.said(&[&["run", "runs/smoke.toml", "-o", folder], more].concat());
        assert_eq!(said.code, 0, "{said:?}");
        assert_eq!(said.err, "");
        said.out
    }

    /// Bytes of every table of a run.
    pub fn tables(&self, run: &str) -> Vec<Vec<u8>> {
        TABLES.map(|t| fs::read(self.path(&format!("{run}/tables/{t}.parquet"))).unwrap()).into()
    }

    /// Everything in the study, by path and size.
    pub fn everything(&self) -> BTreeMap<PathBuf, u64> {
        let mut found = BTreeMap::new();
        let mut folders = vec![self.place.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
                let about = entry.metadata().unwrap();
                if about.is_dir() {
                    folders.push(entry.path());
                    found.insert(entry.path(), 0);
                } else {
                    found.insert(entry.path(), about.len());
                }
            }
        }
        found
    }
}

/// The numbers of every column of numbers of a table, by name, and the texts of the others.
#[derive(Debug, Default)]
pub struct Columns {
    pub numbers: BTreeMap<String, Vec<Option<f64>>>,
    pub texts: BTreeMap<String, Vec<Option<String>>>,
}

/// Reads a Parquet table.
pub fn columns(path: &Path) -> Columns {
    let mut columns = Columns::default();
    let reader = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    for batch in reader.build().unwrap() {
        let batch = batch.unwrap();
        for (field, column) in batch.schema().fields().iter().zip(batch.columns()) {
            let name = field.name().clone();
            if column.data_type().is_numeric() {
                let numbers = arrow::compute::cast(column, &DataType::Float64).unwrap();
                let numbers = numbers.as_primitive::<Float64Type>();
                columns.numbers.entry(name).or_default().extend(numbers);
            } else {
                let texts = arrow::compute::cast(column, &DataType::Utf8).unwrap();
                let texts = texts.as_string::<i32>().iter().map(|text| text.map(str::to_owned));
                columns.texts.entry(name).or_default().extend(texts);
            }
        }
    }
    columns
}
