//! Pages of a row group under way, kept on the disk: a column's bytes must lie together in a
//! Parquet file, while rows come with all columns at once.
//!
//! So a row group takes no memory, however large. What rows it holds is decided in `assemble`.

use super::fault;
use super::files;
use crate::problem::Problems;
use bytes::Bytes;
use parquet::arrow::arrow_writer::{PageKey, PageStore, PageStoreArgs, PageStoreFactory};
use parquet::errors::{ParquetError, Result};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// A file without a name, which vanishes with the process, filled page by page and used again for
/// every row group.
#[derive(Debug, Clone)]
pub struct Scratch(Arc<Mutex<Filled>>);

#[derive(Debug)]
struct Filled {
    file: File,
    bytes: u64,
}

impl Scratch {
    /// A file in `folder`.
    ///
    /// # Errors
    /// One problem if the folder is missing, not writable or full.
    pub fn within(folder: &Path) -> std::result::Result<Self, Problems> {
        let file = fault::step().and_then(|()| tempfile::tempfile_in(folder));
        let file = file.map_err(|error| files::write_problem(folder, &error))?;
        Ok(Self(Arc::new(Mutex::new(Filled { file, bytes: 0 }))))
    }

    /// Forgets all pages: the row group is written.
    pub fn clear(&self) {
        self.with(|filled| filled.bytes = 0);
    }

    fn with<T>(&self, work: impl FnOnce(&mut Filled) -> T) -> T {
        // A panic elsewhere leaves bytes that nobody asks for.
        work(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Filled {
    fn add(&mut self, page: &[u8]) -> io::Result<Place> {
        fault::step()?;
        let start = self.bytes;
        self.file.seek(SeekFrom::Start(start))?;
        self.file.write_all(page)?;
        self.bytes += page.len() as u64;
        Ok(Place { start, bytes: page.len() })
    }

    fn get(&mut self, place: &Place) -> io::Result<Vec<u8>> {
        let mut page = vec![0; place.bytes];
        self.file.seek(SeekFrom::Start(place.start))?;
        self.file.read_exact(&mut page)?;
        Ok(page)
    }
}

impl PageStoreFactory for Scratch {
    fn create(&self, _: &PageStoreArgs<'_>) -> Result<Box<dyn PageStore>> {
        Ok(Box::new(Pages { scratch: self.clone(), places: Vec::new() }))
    }
}

/// The pages of one column of a row group.
struct Pages {
    scratch: Scratch,
    places: Vec<Place>,
}

/// Where a page lies.
struct Place {
    start: u64,
    bytes: usize,
}

impl PageStore for Pages {
    fn put(&mut self, page: Bytes) -> Result<PageKey> {
        let place = self.scratch.with(|filled| filled.add(&page))?;
        self.places.push(place);
        Ok(PageKey::new(self.places.len() as u64 - 1))
    }

    fn take(&mut self, key: PageKey) -> Result<Bytes> {
        let place = usize::try_from(key.get()).ok().and_then(|index| self.places.get(index));
        let place = place.ok_or_else(|| ParquetError::General("no such page".to_owned()))?;
        Ok(self.scratch.with(|filled| filled.get(place))?.into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pages(scratch: &Scratch) -> Pages {
        Pages { scratch: scratch.clone(), places: Vec::new() }
    }

    #[test]
    fn pages_of_several_columns_come_back_whole_and_in_any_order() {
        let folder = tempfile::tempdir().unwrap();
        let scratch = Scratch::within(folder.path()).unwrap();
        for _ in 0..2 {
            let mut columns = [pages(&scratch), pages(&scratch)];
            let page =
                |column: usize, number: usize| vec![(7 * column + number) as u8; 100 + number];
            let mut keys = [Vec::new(), Vec::new()];
            for number in 0..5 {
                for column in 0..2 {
                    keys[column].push(columns[column].put(page(column, number).into()).unwrap());
                }
            }
            for column in [1, 0] {
                for number in (0..5).rev() {
                    let found = columns[column].take(keys[column][number]).unwrap();
                    assert_eq!(found, page(column, number));
                }
            }
            assert!(columns[0].take(PageKey::new(5)).is_err());
            scratch.clear();
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}
