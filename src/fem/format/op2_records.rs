//! Records of a Nastran OP2 file: Fortran blocks, keys and tables, in either byte order and with
//! words of 4 or 8 bytes.
//!
//! Not what the tables mean.
//!
//! Layout as in the MSC Nastran DMAP Programmer's Guide, OUTPUT2: every key and every piece of
//! data is one Fortran block; records of a table are numbered -1, -2, … and end with a key of 0.

use std::borrow::Cow;

use crate::problem::Problems;

/// Byte order and word length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Words {
    big: bool,
    /// Bytes of a word, 4 or 8.
    pub size: usize,
}

impl Words {
    /// From the first Fortran block, which holds one word: its length in front and behind.
    pub fn recognise(bytes: &[u8]) -> Option<Self> {
        [false, true].into_iter().find_map(|big| {
            let words = |size| Self { big, size };
            let length = words(4).marker(bytes, 0)?;
            let size = usize::try_from(length).ok().filter(|size| [4, 8].contains(size))?;
            (words(4).marker(bytes, 4 + size)? == length).then_some(words(size))
        })
    }

    /// The length of a Fortran block, always of four bytes.
    fn marker(self, bytes: &[u8], at: usize) -> Option<i32> {
        let bytes = *bytes.get(at..)?.first_chunk()?;
        Some(if self.big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
    }

    /// Integer in word `k`; 0 beyond the end.
    pub fn integer(self, bytes: &[u8], k: usize) -> i64 {
        let word = bytes.get(k * self.size..).unwrap_or_default();
        if self.size == 4 {
            let word = word.first_chunk().copied().unwrap_or_default();
            i64::from(if self.big { i32::from_be_bytes(word) } else { i32::from_le_bytes(word) })
        } else {
            let word = word.first_chunk().copied().unwrap_or_default();
            if self.big { i64::from_be_bytes(word) } else { i64::from_le_bytes(word) }
        }
    }

    /// Real number in word `k`; 0 beyond the end.
    pub fn real(self, bytes: &[u8], k: usize) -> f64 {
        if self.size == 8 {
            return self.double(bytes, k);
        }
        let word = bytes.get(k * 4..).and_then(<[u8]>::first_chunk).copied().unwrap_or_default();
        f64::from(if self.big { f32::from_be_bytes(word) } else { f32::from_le_bytes(word) })
    }

    /// Double precision number that starts at word `k`; 0 beyond the end.
    pub fn double(self, bytes: &[u8], k: usize) -> f64 {
        let from = bytes.get(k * self.size..).unwrap_or_default();
        let word = from.first_chunk().copied().unwrap_or_default();
        if self.big { f64::from_be_bytes(word) } else { f64::from_le_bytes(word) }
    }

    /// Text in words `from..to`: four letters each, followed by blanks in words of 8 bytes.
    pub fn text(self, bytes: &[u8], from: usize, to: usize) -> String {
        let letters = bytes.chunks_exact(self.size).take(to).skip(from).flat_map(|word| &word[..4]);
        letters.map(|b| if b.is_ascii_graphic() { char::from(*b) } else { ' ' }).collect()
    }
}

/// The records of a file, table after table.
pub(super) struct Records<'a> {
    pub name: &'a str,
    pub words: Words,
    bytes: &'a [u8],
    at: usize,
    /// A key that was read while looking for the end of a record.
    pending: Option<i64>,
    /// The name of the table that is being read, for messages.
    pub table: String,
}

impl<'a> Records<'a> {
    /// Also gives the label of the file, with the program's version; empty if there is none.
    pub fn open(bytes: &'a [u8], name: &'a str) -> Result<(Self, String), Problems> {
        let words = Words::recognise(bytes).ok_or_else(|| {
            Problems::damage(name, "", "no Fortran records", "a Nastran OP2 file")
        })?;
        let table = String::new();
        let mut records = Self { name, words, bytes, at: 0, pending: None, table };
        let mut label = String::new();
        // With PARAM,POST,-1 a date of three words comes first, then a title and the label.
        if records.key()? == Some(3) {
            records.data(3)?;
            let title = records.expect_key()?;
            records.data(title)?;
            let version = records.expect_key()?;
            label = words.text(records.data(version)?, 0, 2).trim().to_owned();
            while records.expect_key()? != 0 {}
        } else {
            records.at = 0;
        }
        Ok((records, label))
    }

    /// The refusal of a file that breaks its own layout.
    pub fn damage(&self, found: impl Into<String>, allowed: &str) -> Problems {
        let key = if self.table.is_empty() {
            format!("byte {}", self.at)
        } else {
            format!("table {}: byte {}", self.table, self.at)
        };
        Problems::damage(self.name, key, found, allowed)
    }

    /// The next Fortran block; none at the end of the file.
    fn block(&mut self) -> Result<Option<&'a [u8]>, Problems> {
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let truncated = |records: &Self| records.damage("the end of the file", "a whole block");
        let length = self.words.marker(self.bytes, self.at).ok_or_else(|| truncated(self))?;
        let Ok(length) = usize::try_from(length) else {
            return Err(self.damage(format!("a block of {length} bytes"), "a length above 0"));
        };
        let from = self.at + 4;
        let end = from.checked_add(length).ok_or_else(|| truncated(self))?;
        let block = self.bytes.get(from..end).ok_or_else(|| truncated(self))?;
        let after = self.words.marker(self.bytes, end).ok_or_else(|| truncated(self))?;
        if usize::try_from(after) != Ok(length) {
            let found = format!("a block of {length} bytes that ends with the length {after}");
            return Err(self.damage(found, "the same length in front and behind"));
        }
        self.at = end + 4;
        Ok(Some(block))
    }

    fn key(&mut self) -> Result<Option<i64>, Problems> {
        if let Some(key) = self.pending.take() {
            return Ok(Some(key));
        }
        let Some(block) = self.block()? else { return Ok(None) };
        if block.len() != self.words.size {
            return Err(self.damage(format!("a block of {} bytes", block.len()), "a key"));
        }
        Ok(Some(self.words.integer(block, 0)))
    }

    fn expect_key(&mut self) -> Result<i64, Problems> {
        self.key()?.ok_or_else(|| self.damage("the end of the file", "a key"))
    }

    /// A block of `count` words.
    fn data(&mut self, count: i64) -> Result<&'a [u8], Problems> {
        let block = self.block()?.ok_or_else(|| self.damage("the end of the file", "data"))?;
        let expected = usize::try_from(count).ok().and_then(|n| n.checked_mul(self.words.size));
        if expected != Some(block.len()) {
            let found = format!("{} bytes", block.len());
            return Err(self.damage(found, &format!("{count} words of {}", self.words.size)));
        }
        Ok(block)
    }

    /// Moves to the next table and gives its name; none at the end of the file, which is a key of
    /// 0: without it the program was stopped or the file is cut.
    pub fn next_table(&mut self) -> Result<Option<String>, Problems> {
        loop {
            let key = self.expect_key()?;
            if key == 0 {
                if self.at == self.bytes.len() {
                    return Ok(None);
                }
                continue;
            }
            if key < 0 {
                return Err(self.damage(format!("key {key}"), "the name of a table"));
            }
            let name = self.data(key)?;
            self.table = self.words.text(name, 0, 2).trim().to_owned();
            let first = self.expect_key()?;
            let trailer = self.expect_key()?;
            if first != -1 || trailer < 0 {
                return Err(self.damage(format!("keys {first} and {trailer}"), "a new table"));
            }
            if trailer > 0 {
                self.data(trailer)?;
                return Ok(Some(self.table.clone()));
            }
        }
    }

    /// The next record of the table, its first being the header -2; none at the end of the table.
    pub fn next_record(&mut self) -> Result<Option<Cow<'a, [u8]>>, Problems> {
        let number = self.expect_key()?;
        let (one, kind) = (self.expect_key()?, self.expect_key()?);
        if number >= 0 || one != 1 {
            return Err(self.damage(format!("keys {number} and {one}"), "a new record"));
        }
        let mut record: Option<Cow<'a, [u8]>> = None;
        loop {
            let key = self.expect_key()?;
            if key <= 0 {
                if key < 0 || record.is_some() {
                    self.pending = Some(key);
                }
                // An empty record is one of a matrix; only a key of 0 ends the table.
                return Ok(record.or(if key < 0 { Some(Cow::Borrowed(&[])) } else { None }));
            }
            // In front of each piece of a matrix column stands its row.
            let data = self.data(if kind == 0 { key } else { key.saturating_add(1) })?;
            match &mut record {
                None => record = Some(Cow::Borrowed(data)),
                // Bounded by the file: each piece is copied once.
                Some(whole) => whole.to_mut().extend_from_slice(data),
            }
        }
    }
}
