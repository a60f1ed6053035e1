//! A column of a results table: name, unit, description and how its value is taken from a row.
//!
//! The schema, the data dictionary and the buffers derive from it; which columns a table has is
//! said in `schema`.

use arrow::array::{
    ArrayRef, BooleanBuilder, DictionaryArray, Float64Builder, Int32Builder, Int64Builder,
    StringArray, StringBuilder,
};
use arrow::datatypes::{DataType, Field, Int32Type};
use std::sync::Arc;

type Take<R, T> = Box<dyn Fn(&R) -> Option<T> + Send>;
type TakeText<R> = Box<dyn Fn(&R) -> Option<&str> + Send>;

/// How the value of a column is taken from a row.
pub enum Get<R> {
    /// A number; what is not finite becomes NULL.
    Number(Take<R, f64>),
    /// A whole number.
    Count(Take<R, i64>),
    /// Yes or no.
    Flag(Take<R, bool>),
    /// One of a fixed list of words, by its index.
    Word(Vec<String>, Take<R, usize>),
    /// Free text.
    Text(TakeText<R>),
}

/// A column of a table with rows of type `R`.
pub struct Column<R> {
    /// Name, `[a-z0-9_]`, at most 63 characters, with the unit as suffix.
    pub name: String,
    /// Unit; `1` for a pure number, empty for text.
    pub unit: String,
    /// Description.
    pub description: String,
    /// The value.
    pub get: Get<R>,
}

impl<R> Column<R> {
    /// A column of numbers.
    pub fn number(
        name: impl Into<String>,
        unit: impl Into<String>,
        description: impl Into<String>,
        get: impl Fn(&R) -> Option<f64> + Send + 'static,
    ) -> Self {
        Self::new(name, unit, description, Get::Number(Box::new(get)))
    }

    /// A column of whole numbers.
    pub fn count(
        name: impl Into<String>,
        description: impl Into<String>,
        get: impl Fn(&R) -> Option<i64> + Send + 'static,
    ) -> Self {
        Self::new(name, "1", description, Get::Count(Box::new(get)))
    }

    /// A column of truth values.
    pub fn flag(
        name: &str,
        description: &str,
        get: impl Fn(&R) -> Option<bool> + Send + 'static,
    ) -> Self {
        Self::new(name, "", description, Get::Flag(Box::new(get)))
    }

    /// A column of words from a list.
    pub fn word(
        name: &str,
        description: &str,
        words: impl IntoIterator<Item = impl Into<String>>,
        get: impl Fn(&R) -> Option<usize> + Send + 'static,
    ) -> Self {
        let words = words.into_iter().map(Into::into).collect();
        Self::new(name, "", description, Get::Word(words, Box::new(get)))
    }

    /// A column of text.
    pub fn text(
        name: &str,
        description: &str,
        get: impl Fn(&R) -> Option<&str> + Send + 'static,
    ) -> Self {
        Self::new(name, "", description, Get::Text(Box::new(get)))
    }

    fn new(
        name: impl Into<String>,
        unit: impl Into<String>,
        description: impl Into<String>,
        get: Get<R>,
    ) -> Self {
        Self { name: name.into(), unit: unit.into(), description: description.into(), get }
    }

    /// The word for the column's type in the data dictionary.
    pub fn type_name(&self) -> &'static str {
        match self.get {
            Get::Number(_) => "double",
            Get::Count(_) => "int64",
            Get::Flag(_) => "boolean",
            Get::Word(..) => "dictionary<string>",
            Get::Text(_) => "string",
        }
    }

    /// The field of the schema, with unit and description as its metadata.
    pub fn field(&self) -> Field {
        let kind = match self.get {
            Get::Number(_) => DataType::Float64,
            Get::Count(_) => DataType::Int64,
            Get::Flag(_) => DataType::Boolean,
            Get::Word(..) => {
                DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8))
            }
            Get::Text(_) => DataType::Utf8,
        };
        Field::new(&self.name, kind, true).with_metadata([
            ("unit".to_owned(), self.unit.clone()),
            ("description".to_owned(), self.description.clone()),
        ])
    }
}

/// The values of a column gathered for one row group.
pub enum Buffer {
    /// Of [`Get::Number`].
    Number(Float64Builder),
    /// Of [`Get::Count`].
    Count(Int64Builder),
    /// Of [`Get::Flag`].
    Flag(BooleanBuilder),
    /// Of [`Get::Word`].
    Word(Int32Builder),
    /// Of [`Get::Text`].
    Text(StringBuilder),
}

impl Buffer {
    /// An empty buffer for a column.
    pub fn new<R>(column: &Column<R>) -> Self {
        match column.get {
            Get::Number(_) => Self::Number(Float64Builder::new()),
            Get::Count(_) => Self::Count(Int64Builder::new()),
            Get::Flag(_) => Self::Flag(BooleanBuilder::new()),
            Get::Word(..) => Self::Word(Int32Builder::new()),
            Get::Text(_) => Self::Text(StringBuilder::new()),
        }
    }

    /// Takes the value of a row.
    pub fn push<R>(&mut self, column: &Column<R>, row: &R) {
        match (self, &column.get) {
            (Self::Number(buffer), Get::Number(get)) => {
                buffer.append_option(get(row).filter(|value| value.is_finite()));
            }
            (Self::Count(buffer), Get::Count(get)) => buffer.append_option(get(row)),
            (Self::Flag(buffer), Get::Flag(get)) => buffer.append_option(get(row)),
            (Self::Word(buffer), Get::Word(words, get)) => {
                let index = get(row).inspect(|index| assert!(*index < words.len()));
                buffer.append_option(index.map(|index| index as i32));
            }
            (Self::Text(buffer), Get::Text(get)) => buffer.append_option(get(row)),
            _ => unreachable!("a buffer is made for its column"),
        }
    }

    /// The values gathered; the buffer is empty afterwards.
    pub fn finish<R>(&mut self, column: &Column<R>) -> ArrayRef {
        match (self, &column.get) {
            (Self::Number(buffer), _) => Arc::new(buffer.finish()),
            (Self::Count(buffer), _) => Arc::new(buffer.finish()),
            (Self::Flag(buffer), _) => Arc::new(buffer.finish()),
            (Self::Word(buffer), Get::Word(words, _)) => {
                let words = Arc::new(StringArray::from_iter_values(words));
                Arc::new(DictionaryArray::<Int32Type>::new(buffer.finish(), words))
            }
            (Self::Word(_), _) => unreachable!("a buffer is made for its column"),
            (Self::Text(buffer), _) => Arc::new(buffer.finish()),
        }
    }
}
