//! Small flat Parquet tables, whole in memory: columns of numbers and texts to bytes and back.
//!
//! It knows Parquet and nothing of what the columns mean. Large results that are streamed row
//! group by row group are not its business.

use crate::problem::{Kind, Problems};
use arrow::array::{Array, ArrayRef, Float64Array, RecordBatch, StringArray};
use arrow::datatypes::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::properties::WriterProperties;
use parquet::schema::types::ColumnPath;
use std::collections::BTreeMap;
use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// Most rows of a table that is read; more is refused before anything is allocated.
pub const MAX_ROWS: usize = 20_000_000;
/// Most bytes of a table once decompressed.
const MAX_BYTES: i64 = 2 << 30;

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Holds {
    /// Numbers in double precision, in this unit.
    Number(&'static str),
    /// Texts.
    Text,
}

/// A column: name, content, description.
#[derive(Debug, Clone, Copy)]
pub struct Column(pub &'static str, pub Holds, pub &'static str);

/// The layout of a table.
#[derive(Debug, Clone, Copy)]
pub struct Layout {
    /// Name of the table, that of its file.
    pub name: &'static str,
    /// Its columns in order.
    pub columns: &'static [Column],
}

/// The values of a table, column by column in the order of its layout.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Numbers.
    Number(Vec<f64>),
    /// Texts, each distinct one once, and its place for each row.
    Text(Texts),
}

/// Texts of a column.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Texts {
    words: Vec<String>,
    known: BTreeMap<String, u32>,
    rows: Vec<u32>,
}

impl Texts {
    /// Adds the text of a further row.
    pub fn push(&mut self, text: &str) {
        let word = self.known.get(text).copied().unwrap_or_else(|| {
            let new = u32::try_from(self.words.len()).expect("rows are bounded by MAX_ROWS");
            self.words.push(text.to_owned());
            self.known.insert(text.to_owned(), new);
            new
        });
        self.rows.push(word);
    }

    /// The text of each row.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.rows.iter().map(|&word| self.words[word as usize].as_str())
    }
}

/// A table in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    columns: Vec<Values>,
}

/// A text as a cell of comma-separated values.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

impl Table {
    /// An empty table of this layout.
    pub fn new(layout: &Layout) -> Self {
        let columns = layout.columns.iter().map(|Column(_, holds, _)| match holds {
            Holds::Number(_) => Values::Number(Vec::new()),
            Holds::Text => Values::Text(Texts::default()),
        });
        Self { columns: columns.collect() }
    }

    /// Adds a row: its texts and its numbers, each in the order of the columns.
    pub fn push(&mut self, texts: &[&str], numbers: &[f64]) {
        let (mut texts, mut numbers) = (texts.iter(), numbers.iter());
        for column in &mut self.columns {
            match column {
                Values::Number(values) => values.push(*numbers.next().expect("a number a column")),
                Values::Text(values) => values.push(texts.next().expect("a text a column")),
            }
        }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        match self.columns.first() {
            Some(Values::Number(values)) => values.len(),
            Some(Values::Text(values)) => values.rows.len(),
            None => 0,
        }
    }

    /// The numbers of the column at `index`.
    pub fn numbers(&self, index: usize) -> &[f64] {
        match &self.columns[index] {
            Values::Number(values) => values,
            Values::Text(_) => unreachable!("the layout says what a column holds"),
        }
    }

    /// The texts of the column at `index`.
    pub fn texts(&self, index: usize) -> impl Iterator<Item = &str> {
        match &self.columns[index] {
            Values::Text(values) => values.iter(),
            Values::Number(_) => unreachable!("the layout says what a column holds"),
        }
    }

    /// The table as comma-separated values with a header; numbers in as many digits as bring them back.
    pub fn to_csv(&self, layout: &Layout) -> String {
        let names: Vec<&str> = layout.columns.iter().map(|Column(name, ..)| *name).collect();
        let mut csv = names.join(",") + "\n";
        let texts = self.columns.iter().map(|column| match column {
            Values::Number(values) => values.iter().map(|x| format!("{x:?}")).collect(),
            Values::Text(values) => values.iter().map(quoted).collect(),
        });
        let columns: Vec<Vec<String>> = texts.collect();
        for row in 0..self.rows() {
            let cells: Vec<&str> = columns.iter().map(|column| column[row].as_str()).collect();
            csv += &cells.join(",");
            csv.push('\n');
        }
        csv
    }

    /// The bytes of the Parquet file: snappy, dictionaries for texts alone, one row group, no time
    /// stamp; the same bytes for the same values.
    ///
    /// # Errors
    /// What the Parquet writer says.
    pub fn to_bytes(&self, layout: &Layout) -> Result<Vec<u8>, ParquetError> {
        let mut properties = WriterProperties::builder()
            .set_created_by("tvse modal package 1".to_owned())
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            .set_max_row_group_row_count(None)
            .set_key_value_metadata(Some(vec![KeyValue::new(
                "table".to_owned(),
                layout.name.to_owned(),
            )]));
        let (mut fields, mut arrays): (Vec<Field>, Vec<ArrayRef>) = (Vec::new(), Vec::new());
        for (Column(name, holds, description), values) in layout.columns.iter().zip(&self.columns) {
            let mut facts = HashMap::from([("description".to_owned(), (*description).to_owned())]);
            if let Holds::Number(unit) = holds {
                facts.insert("unit".to_owned(), (*unit).to_owned());
            }
            let (kind, array): (DataType, ArrayRef) = match values {
                Values::Number(values) => {
                    (DataType::Float64, Arc::new(Float64Array::from(values.clone())))
                }
                Values::Text(values) => {
                    properties =
                        properties.set_column_dictionary_enabled(ColumnPath::from(*name), true);
                    (DataType::Utf8, Arc::new(StringArray::from_iter_values(values.iter())))
                }
            };
            fields.push(Field::new(*name, kind, false).with_metadata(facts));
            arrays.push(array);
        }
        let batch = RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays)?;
        let mut writer =
            ArrowWriter::try_new(Vec::new(), batch.schema(), Some(properties.build()))?;
        writer.write(&batch)?;
        writer.into_inner()
    }

    /// Reads the bytes of a Parquet file with the columns of `layout`, in any order, and perhaps
    /// others; `file` is how the user named it.
    ///
    /// # Errors
    /// Damage if it is not a whole Parquet file or larger than [`MAX_ROWS`]; wrong input for each
    /// missing column, wrong type, missing value (NULL) or number that is not finite.
    pub fn from_bytes(layout: &Layout, bytes: Vec<u8>, file: &str) -> Result<Self, Problems> {
        // The Parquet reader panics on some malformed files instead of returning an error.
        catch_unwind(AssertUnwindSafe(|| Self::decode(layout, bytes, file))).unwrap_or_else(|_| {
            Err(Problems::damage(file, "", "a malformed Parquet file", "a whole Parquet file"))
        })
    }

    fn decode(layout: &Layout, bytes: Vec<u8>, file: &str) -> Result<Self, Problems> {
        let damage = |e: &dyn std::fmt::Display| {
            Problems::damage(file, "", e.to_string(), "a whole Parquet file")
        };
        // The column types come from Parquet itself, not from what a writer noted about Arrow.
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(
            bytes::Bytes::from(bytes),
            options,
        )
        .map_err(|e| damage(&e))?;
        let metadata = builder.metadata().clone();
        readable(&metadata, file)?;
        let rows = metadata.file_metadata().num_rows();
        let size = (metadata.row_groups().iter())
            .try_fold(0_i64, |sum, group| sum.checked_add(group.total_byte_size()));
        if !(0..=MAX_ROWS as i64).contains(&rows)
            || !size.is_some_and(|size| (0..=MAX_BYTES).contains(&size))
        {
            let found = format!("{rows} rows");
            return Err(Problems::damage(file, "", found, "at most 20 million rows and 2 GiB"));
        }
        let schema = builder.schema().clone();
        let mut problems = Problems::default();
        for Column(name, holds, _) in layout.columns {
            let (wanted, word) = match holds {
                Holds::Number(_) => (DataType::Float64, "double-precision numbers"),
                Holds::Text => (DataType::Utf8, "texts"),
            };
            match schema.field_with_name(name) {
                Err(_) => problems.push(Kind::Input, file, *name, "no such column", word),
                Ok(field) if *field.data_type() != wanted => {
                    problems.push(Kind::Input, file, *name, field.data_type().to_string(), word);
                }
                Ok(_) => {}
            }
        }
        let mut table = problems.into_result(Self::new(layout))?;
        let mut problems = Problems::default();
        let mut read = 0;
        for batch in builder.build().map_err(|e| damage(&e))? {
            let batch = batch.map_err(|e| damage(&e))?;
            if batch.num_rows() as i64 > rows - read as i64 {
                return Err(damage(&"more rows than the file says"));
            }
            for (Column(name, ..), values) in layout.columns.iter().zip(&mut table.columns) {
                let array = batch.column_by_name(name).expect("the schema has the column");
                if array.null_count() > 0 {
                    problems.push(Kind::Input, file, *name, "NULL", "a value in every row");
                    continue;
                }
                match values {
                    Values::Number(values) => {
                        let array = array.as_any().downcast_ref::<Float64Array>();
                        let array = array.expect("the type was checked").values();
                        if let Some(at) = array.iter().position(|v| !v.is_finite()) {
                            let found = format!("{} in row {}", array[at], read + at);
                            problems.push(Kind::Input, file, *name, found, "finite numbers");
                        }
                        values.extend_from_slice(array);
                    }
                    Values::Text(values) => {
                        let array = array.as_any().downcast_ref::<StringArray>();
                        let array = array.expect("the type was checked");
                        array.iter().flatten().for_each(|text| values.push(text));
                    }
                }
            }
            read += batch.num_rows();
        }
        if read as i64 != rows {
            return Err(damage(&format!("{read} of {rows} rows")));
        }
        problems.into_result(table)
    }
}

/// Whether every column is compressed in a way that can be undone.
///
/// # Errors
/// Wrong input with the name of the codec.
pub fn readable(metadata: &ParquetMetaData, file: &str) -> Result<(), Problems> {
    let mut columns = metadata.row_groups().iter().flat_map(|group| group.columns());
    match columns.find(|column| column.compression() == Compression::LZO) {
        None => Ok(()),
        Some(column) => {
            let found = format!("a column compressed by {}", column.compression());
            let allowed = "zstd, Snappy, gzip, Brotli, LZ4 or no compression";
            Err(Problems::input(file, column.column_path().string(), found, allowed))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LAYOUT: Layout = Layout {
        name: "trial",
        columns: &[
            Column("name", Holds::Text, "A name"),
            Column("length_m", Holds::Number("m"), "A length"),
        ],
    };

    fn table() -> Table {
        let mut table = Table::new(&LAYOUT);
        for i in 0..100 {
            table.push(&[["a", "b", "ü"][i % 3]], &[i as f64 / 3.0]);
        }
        table
    }

    #[test]
    fn a_table_comes_back_bit_for_bit_and_its_bytes_repeat() {
        let bytes = table().to_bytes(&LAYOUT).unwrap();
        assert_eq!(bytes, table().to_bytes(&LAYOUT).unwrap());
        assert_eq!(Table::from_bytes(&LAYOUT, bytes, "t").unwrap(), table());
    }

    #[test]
    fn a_table_is_read_whatever_the_codec_and_one_that_cannot_be_undone_is_named() {
        use parquet::arrow::arrow_reader::ArrowReaderMetadata;
        let bytes = bytes::Bytes::from(table().to_bytes(&LAYOUT).unwrap());
        let batches = || {
            let builder = ParquetRecordBatchReaderBuilder::try_new(bytes.clone()).unwrap();
            builder.build().unwrap().map(Result::unwrap)
        };
        for codec in [
            Compression::UNCOMPRESSED,
            Compression::SNAPPY,
            Compression::GZIP(Default::default()),
            Compression::BROTLI(Default::default()),
            Compression::ZSTD(Default::default()),
            Compression::LZ4,
            Compression::LZ4_RAW,
        ] {
            let properties = WriterProperties::builder().set_compression(codec).build();
            let schema = batches().next().unwrap().schema();
            let mut writer = ArrowWriter::try_new(Vec::new(), schema, Some(properties)).unwrap();
            batches().for_each(|batch| writer.write(&batch).unwrap());
            let written = writer.into_inner().unwrap();
            assert_eq!(Table::from_bytes(&LAYOUT, written, "t").unwrap(), table(), "{codec}");
        }
        let footer = ArrowReaderMetadata::load(&bytes, ArrowReaderOptions::new()).unwrap();
        assert_eq!(readable(footer.metadata(), "t"), Ok(()));
        let mut whole = ParquetMetaData::clone(footer.metadata()).into_builder();
        for group in whole.take_row_groups() {
            let mut group = group.into_builder();
            for column in group.take_columns() {
                let packed = column.into_builder().set_compression(Compression::LZO);
                group = group.add_column_metadata(packed.build().unwrap());
            }
            whole = whole.add_row_group(group.build().unwrap());
        }
        let refused = readable(&whole.build(), "t").unwrap_err();
        assert_eq!(refused.0[0].kind, Kind::Input);
        assert!(refused.to_string().contains("compressed by LZO"), "{refused}");
    }

    #[test]
    fn every_missing_column_and_every_wrong_type_is_named() {
        const OTHER: Layout = Layout {
            name: "trial",
            columns: &[Column("length_m", Holds::Text, ""), Column("mass_kg", Holds::Text, "")],
        };
        let bytes = table().to_bytes(&LAYOUT).unwrap();
        let problems = Table::from_bytes(&OTHER, bytes, "t").unwrap_err();
        assert_eq!(problems.0.len(), 2);
        assert!(problems.to_string().contains("length_m: found Float64; allowed: texts"));
        assert!(problems.to_string().contains("mass_kg: found no such column"));
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_with_its_row() {
        let mut table = table();
        table.push(&["a"], &[f64::NAN]);
        let bytes = table.to_bytes(&LAYOUT).unwrap();
        let problems = Table::from_bytes(&LAYOUT, bytes, "t").unwrap_err();
        assert!(problems.to_string().contains("length_m: found NaN in row 100"), "{problems}");
    }

    #[test]
    fn a_cut_file_is_damage() {
        let bytes = table().to_bytes(&LAYOUT).unwrap();
        for length in 0..bytes.len() {
            let problems = Table::from_bytes(&LAYOUT, bytes[..length].to_vec(), "t").unwrap_err();
            assert_eq!(problems.kind(), Kind::Damage);
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            let _ = Table::from_bytes(&LAYOUT, bytes, "t");
        }

        #[test]
        fn altered_bytes_are_read_or_refused(at in 0..1_000_000_usize, to in any::<u8>()) {
            let mut bytes = table().to_bytes(&LAYOUT).unwrap();
            let at = at % bytes.len();
            bytes[at] = to;
            if let Ok(read) = Table::from_bytes(&LAYOUT, bytes, "t") {
                prop_assert_eq!(read.rows(), 100);
            }
        }
    }
}
