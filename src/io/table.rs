//! One results table being written: rows gathered to blocks and row groups, bytes digested on their
//! way.
//!
//! Both end where the caller says, so that the bytes depend on the rows alone.

use super::column::{Buffer, Column};
use super::files::Aside;
use super::scratch::Scratch;
use crate::problem::Problems;
use arrow::datatypes::{DataType, Field, Schema, SchemaRef};
use arrow::record_batch::RecordBatch;
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_writer::ArrowWriterOptions;
use parquet::basic::Compression;
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;
use serde::{Deserialize, Serialize};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

/// Most rows of a page: one of every column is in memory.
const PAGE_ROWS: usize = 2048;

/// What a finished table holds.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Content {
    /// Number of rows.
    pub rows: u64,
    /// Size of the file, bytes.
    pub bytes: u64,
    /// BLAKE3 digest of the file, hexadecimal.
    pub blake3: String,
}

/// A table of record batches, each a block of a row group, written to `W`.
pub struct Sheet<W: Write + Send = Aside> {
    schema: SchemaRef,
    writer: ArrowWriter<Digested<W>>,
    scratch: Option<Scratch>,
    rows: u64,
}

impl<W: Write + Send> Sheet<W> {
    /// A table of these columns with file-level metadata; pages of the row group under way are in
    /// `scratch`, or in memory.
    ///
    /// # Errors
    /// What the Parquet writer says.
    pub fn new(
        fields: Vec<Field>,
        metadata: &[(&str, String)],
        out: W,
        scratch: Option<Scratch>,
    ) -> Result<Self, ParquetError> {
        let mut properties = WriterProperties::builder()
            .set_created_by(concat!("tvse ", env!("CARGO_PKG_VERSION")).to_owned())
            .set_compression(Compression::SNAPPY)
            .set_dictionary_enabled(false)
            // Pages have no index: of a long table it would grow with the rows until the end.
            .set_statistics_enabled(EnabledStatistics::Chunk)
            .set_offset_index_disabled(true)
            .set_data_page_row_count_limit(PAGE_ROWS)
            .set_max_row_group_row_count(None)
            .set_max_row_group_bytes(None);
        // Equal values are worth storing once where they are text, not where they are numbers.
        let repeats = |kind: &DataType| matches!(kind, DataType::Dictionary(..) | DataType::Utf8);
        for field in fields.iter().filter(|field| repeats(field.data_type())) {
            let path = ColumnPath::from(field.name().as_str());
            properties = properties.set_column_dictionary_enabled(path, true);
        }
        let pairs = metadata.iter().map(|(k, v)| KeyValue::new((*k).to_owned(), v.clone()));
        let properties = properties.set_key_value_metadata(Some(pairs.collect())).build();
        let schema = Arc::new(Schema::new(fields));
        let out = Digested { out, hasher: blake3::Hasher::new(), bytes: 0 };
        let mut options = ArrowWriterOptions::new().with_properties(properties);
        if let Some(scratch) = &scratch {
            options = options.with_page_store_factory(Arc::new(scratch.clone()));
        }
        let writer = ArrowWriter::try_new_with_options(out, schema.clone(), options)?;
        Ok(Self { schema, writer, scratch, rows: 0 })
    }

    /// The columns.
    pub fn schema(&self) -> &SchemaRef {
        &self.schema
    }

    /// Writes a block of the row group under way.
    ///
    /// # Errors
    /// What the Parquet writer or the scratch file says.
    pub fn block(&mut self, rows: &RecordBatch) -> Result<(), ParquetError> {
        self.rows += rows.num_rows() as u64;
        self.writer.write(rows)
    }

    /// Ends the row group, if it has rows.
    ///
    /// # Errors
    /// What the Parquet writer, the scratch file or the output says.
    pub fn end_group(&mut self) -> Result<(), ParquetError> {
        self.writer.flush()?;
        if let Some(scratch) = &self.scratch {
            scratch.clear();
        }
        Ok(())
    }

    /// Ends the file and gives back the output with what it holds.
    ///
    /// # Errors
    /// What the Parquet writer or the output says.
    pub fn close(self) -> Result<(W, Content), ParquetError> {
        let Digested { out, hasher, bytes } = self.writer.into_inner()?;
        let blake3 = hasher.finalize().to_hex().to_string();
        Ok((out, Content { rows: self.rows, bytes, blake3 }))
    }
}

/// A table of rows of type `R`, written to `W`.
pub struct Table<R, W: Write + Send = Aside> {
    columns: Vec<Column<R>>,
    buffers: Vec<Buffer>,
    sheet: Sheet<W>,
    gathered: u64,
}

impl<R, W: Write + Send> Table<R, W> {
    /// A table of these columns with file-level metadata; pages of the row group under way are in
    /// `scratch`, or in memory.
    ///
    /// # Errors
    /// What the Parquet writer says.
    pub fn new(
        columns: Vec<Column<R>>,
        metadata: &[(&str, String)],
        out: W,
        scratch: Option<Scratch>,
    ) -> Result<Self, ParquetError> {
        let fields = columns.iter().map(Column::field).collect();
        let sheet = Sheet::new(fields, metadata, out, scratch)?;
        let buffers = columns.iter().map(Buffer::new).collect();
        Ok(Self { columns, buffers, sheet, gathered: 0 })
    }

    /// Adds a row.
    pub fn push(&mut self, row: &R) {
        for (buffer, column) in self.buffers.iter_mut().zip(&self.columns) {
            buffer.push(column, row);
        }
        self.gathered += 1;
    }

    /// Rows gathered for the block under way.
    pub fn gathered(&self) -> u64 {
        self.gathered
    }

    /// Ends the block, if it has rows, and writes it.
    ///
    /// # Errors
    /// As [`Sheet::block`].
    pub fn end_block(&mut self) -> Result<(), ParquetError> {
        if self.gathered == 0 {
            return Ok(());
        }
        let arrays = self.buffers.iter_mut().zip(&self.columns).map(|(b, c)| b.finish(c)).collect();
        self.gathered = 0;
        self.sheet.block(&RecordBatch::try_new(self.sheet.schema().clone(), arrays)?)
    }

    /// Ends the row group, if it has rows, and writes it.
    ///
    /// # Errors
    /// As [`Sheet::end_group`].
    pub fn end_group(&mut self) -> Result<(), ParquetError> {
        self.end_block()?;
        self.sheet.end_group()
    }

    /// Ends the file and gives back the output with what it holds.
    ///
    /// # Errors
    /// What the Parquet writer or the output says.
    pub fn close(mut self) -> Result<(W, Content), ParquetError> {
        self.end_group()?;
        self.sheet.close()
    }
}

/// The problem of a table that could not be written.
pub fn problem(target: &Path, error: &ParquetError) -> Problems {
    let found = match error {
        ParquetError::External(source) => source.to_string(),
        other => other.to_string(),
    };
    super::files::write_problem(target, &io::Error::other(found))
}

/// An output whose bytes are digested and counted.
struct Digested<W> {
    out: W,
    hasher: blake3::Hasher,
    bytes: u64,
}

impl<W: Write> Write for Digested<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hasher.update(&bytes[..written]);
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
