//! Files: whole texts read, files written aside, synced and renamed, new folders.
//!
//! What the files hold is decided by their callers. Nothing here leaves a half-written file under
//! a final name: a file appears complete or not at all.

#![expect(clippy::disallowed_methods, reason = "the place where the program touches the disk")]

use super::fault;
use crate::problem::Problems;
use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// The largest text file that is read, bytes; hand-written scenarios are thousandths of it.
const LARGEST_TEXT: u64 = 64 << 20;
/// The largest file of data that is read as a whole, bytes.
const LARGEST_DATA: u64 = 2 << 30;
/// Bytes written and taken back when a file is opened, so that a full disk is found at once.
const PROBE: usize = 64 << 10;

/// The whole text of a file.
///
/// # Errors
/// One problem if the file is missing, unreadable, not UTF-8 or larger than 64 MiB.
pub fn read_text(path: &Path) -> Result<String, Problems> {
    let allowed = "a readable text file";
    // Opening a pipe would wait for a writer.
    if fs::metadata(path).is_ok_and(|about| !about.is_file() && !about.is_dir()) {
        return Err(Problems::input(name(path), "", "no regular file", allowed));
    }
    let file = File::open(path).map_err(|e| problem(path, &e, allowed))?;
    let bytes = file.metadata().map_err(|e| problem(path, &e, allowed))?.len();
    if bytes > LARGEST_TEXT {
        let found = format!("{bytes} bytes");
        return Err(Problems::input(name(path), "", found, "at most 64 MiB of text"));
    }
    let mut text = String::new();
    // The length may change between the two calls; what is read stays bounded.
    file.take(LARGEST_TEXT).read_to_string(&mut text).map_err(|e| problem(path, &e, allowed))?;
    Ok(text)
}

/// A file opened for reading.
///
/// # Errors
/// One problem if it is missing or unreadable.
pub fn open(path: &Path) -> Result<File, Problems> {
    File::open(path).map_err(|e| problem(path, &e, "a readable file"))
}

/// Size of a file, bytes.
///
/// # Errors
/// What the system says of it.
pub fn size(path: &Path) -> io::Result<u64> {
    Ok(fs::metadata(path)?.len())
}

/// BLAKE3 digest of a file's bytes, hexadecimal.
///
/// # Errors
/// One problem if it is missing or unreadable.
pub fn digest(path: &Path) -> Result<String, Problems> {
    let mut file = open(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(&mut file).map_err(|e| problem(path, &e, "a readable file"))?;
    Ok(hasher.finalize().to_hex().to_string())
}

/// BLAKE3 digest of bytes, hexadecimal.
pub fn digest_of(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex().to_string()
}

/// Makes a new folder, with its parents; refuses one that exists.
///
/// # Errors
/// One problem if something of that name exists or the folder cannot be made.
pub fn create_folder(path: &Path) -> Result<(), Problems> {
    if let Some(parent) = path.parent().filter(|p| !p.as_os_str().is_empty()) {
        fs::create_dir_all(parent).map_err(|e| problem(parent, &e, "a writable folder"))?;
    }
    fs::create_dir(path).map_err(|e| match e.kind() {
        io::ErrorKind::AlreadyExists => {
            Problems::input(name(path), "", "something that exists", "the name of a new folder")
        }
        _ => problem(path, &e, "a folder that can be made"),
    })
}

/// Makes a folder, and those above it, unless it is there.
///
/// # Errors
/// One problem if it cannot be made.
pub fn ensure_folder(path: &Path) -> Result<(), Problems> {
    fault::step().and_then(|()| fs::create_dir_all(path)).map_err(|e| write_problem(path, &e))
}

/// Names in a folder, in order; none where there is no such folder.
///
/// # Errors
/// One problem if it cannot be read.
pub fn names(folder: &Path) -> Result<Vec<String>, Problems> {
    let failed = |e: io::Error| problem(folder, &e, "a readable folder");
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        other => other.map_err(failed)?,
    };
    let mut names = Vec::new();
    for entry in entries {
        names.push(entry.map_err(failed)?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}

/// Renames a file or folder inside one folder, for good.
///
/// # Errors
/// One problem if it cannot be renamed.
pub fn rename(from: &Path, to: &Path) -> Result<(), Problems> {
    fault::step()
        .and_then(|()| fs::rename(from, to))
        .and_then(|()| sync_parent(to))
        .map_err(|e| write_problem(to, &e))
}

/// Removes a file; one that is not there is removed.
///
/// # Errors
/// One problem if it cannot be removed.
pub fn remove(path: &Path) -> Result<(), Problems> {
    fault::step().map_err(|e| write_problem(path, &e))?;
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(write_problem(path, &error)),
        _ => Ok(()),
    }
}

/// A path that does not depend on the current folder.
///
/// # Errors
/// One problem if the current folder is not known.
pub fn absolute(path: &Path) -> Result<PathBuf, Problems> {
    std::path::absolute(path).map_err(|e| problem(path, &e, "a path"))
}

/// The folder in which something of this name lies.
pub fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// A path with every link followed, as far as it exists.
pub fn resolved(path: &Path) -> PathBuf {
    if path.as_os_str().is_empty() {
        return resolved(Path::new("."));
    }
    fs::canonicalize(path).unwrap_or_else(|_| match (path.parent(), path.file_name()) {
        (Some(parent), Some(name)) => resolved(parent).join(name),
        (Some(parent), None) => resolved(parent).parent().unwrap_or(Path::new("/")).to_owned(),
        (None, _) => path.to_owned(),
    })
}

/// What the name of a file written aside begins with.
pub const ASIDE: &str = ".aside-";

/// Removes what a process that was killed has left written aside in `folder`.
pub fn sweep(folder: &Path) {
    for name in names(folder).unwrap_or_default() {
        if name.starts_with(ASIDE) {
            let path = folder.join(name);
            let _ = fs::remove_file(&path).or_else(|_| fs::remove_dir_all(&path));
        }
    }
}

/// The beginning of a file, up to and without its first line feed.
///
/// # Errors
/// What the system says; a line longer than `most` bytes.
pub fn first_line(path: &Path, most: usize) -> io::Result<Vec<u8>> {
    let mut line = Vec::new();
    let mut file = io::BufReader::new(File::open(path)?).take(most as u64);
    io::BufRead::read_until(&mut file, b'\n', &mut line)?;
    match line.pop() {
        Some(b'\n') => Ok(line),
        _ => Err(io::Error::new(io::ErrorKind::InvalidData, "no first line")),
    }
}

/// The bytes of a file that lie `skip` bytes behind the beginning of its last `tail` bytes.
///
/// # Errors
/// What the system says; a file that is too short.
pub fn read_tail(path: &Path, tail: u64, skip: u64, length: u64) -> io::Result<Vec<u8>> {
    let mut file = File::open(path)?;
    let size = file.metadata()?.len();
    let start = size.checked_sub(tail);
    let start = start.ok_or_else(|| io::Error::from(io::ErrorKind::UnexpectedEof))?;
    file.seek(SeekFrom::Start(start + skip))?;
    // No more is asked for than there is, whatever a damaged header says.
    let mut bytes = Vec::with_capacity(length.min(size) as usize);
    file.take(length).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Refuses a name that something has already.
///
/// # Errors
/// One problem if something of that name exists.
pub fn refuse_existing(path: &Path) -> Result<(), Problems> {
    if fs::symlink_metadata(path).is_ok() {
        let allowed = "a new name that nothing has yet";
        return Err(Problems::input(name(path), "", "something that exists", allowed));
    }
    Ok(())
}

/// Makes the folders above `path` where they are missing.
///
/// # Errors
/// One problem if a folder cannot be made.
pub fn create_parents(path: &Path) -> Result<(), Problems> {
    let parent = path.parent().unwrap_or(path);
    fs::create_dir_all(parent).map_err(|e| problem(parent, &e, "a folder that can be made"))
}

/// All bytes of a file.
///
/// # Errors
/// One problem if it is missing, unreadable or larger than 2 GiB.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, Problems> {
    let failed = |e: io::Error| problem(path, &e, "a readable file");
    let bytes = size(path).map_err(failed)?;
    if bytes > LARGEST_DATA {
        let found = format!("{bytes} bytes");
        return Err(Problems::damage(name(path), "", found, "at most 2 GiB"));
    }
    fs::read(path).map_err(failed)
}

/// Removes a folder with all that is in it, as far as the system lets it go.
pub fn remove_folder(path: &Path) {
    if fault::gone() {
        return;
    }
    // What cannot be removed, or is gone already, is no error of this call.
    let _ = fs::remove_dir_all(path);
}

/// Removes a folder if it is empty; anything else stays as it is.
pub fn remove_if_empty(path: &Path) {
    if fault::gone() {
        return;
    }
    // A folder that is not empty or already gone is no error of this call.
    let _ = fs::remove_dir(path);
}

/// A file being written aside; it takes its final name in [`Aside::finish`] and vanishes if dropped.
#[derive(Debug)]
pub struct Aside {
    file: Option<NamedTempFile>,
    target: PathBuf,
}

impl Aside {
    /// Opens a file that will be called `target`, written beside it.
    ///
    /// # Errors
    /// One problem if the folder is missing, not writable or full.
    pub fn beside(target: &Path) -> Result<Self, Problems> {
        Self::within(folder_of(target), target)
    }

    /// Opens a file that will be called `target`, written in `folder` of the same file system;
    /// so a folder of tables never holds anything else than tables.
    ///
    /// # Errors
    /// One problem if the folder is missing, not writable or full.
    pub fn within(folder: &Path, target: &Path) -> Result<Self, Problems> {
        fault::step().map_err(|e| write_problem(target, &e))?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(ASIDE);
        #[cfg(unix)]
        {
            // The usual rights of a new file, less the user's mask, not those of a secret.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(folder).map_err(|e| write_problem(target, &e))?;
        probe(file.as_file_mut()).map_err(|e| write_problem(target, &e))?;
        Ok(Self { file: Some(file), target: target.to_owned() })
    }

    /// The final name.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// Syncs the file to the disk and gives it its final name, replacing a file of that name.
    ///
    /// # Errors
    /// One problem if the disk is full or the file cannot be renamed; nothing is left behind.
    pub fn finish(self) -> Result<(), Problems> {
        self.sync().map_err(|e| write_problem(&self.target, &e))?;
        let (file, target) = self.into_parts();
        let renamed = fault::step().and_then(|()| file.persist(&target).map_err(|e| e.error));
        renamed.and_then(|_| sync_parent(&target)).map_err(|e| write_problem(&target, &e))
    }

    /// Like [`Aside::finish`], but leaves a file that has the name already; whether it was given.
    ///
    /// # Errors
    /// As [`Aside::finish`].
    pub fn finish_new(self) -> Result<bool, Problems> {
        self.sync().map_err(|e| write_problem(&self.target, &e))?;
        let (file, target) = self.into_parts();
        let failed = |e: io::Error| write_problem(&target, &e);
        fault::step().map_err(failed)?;
        match file.persist_noclobber(&target) {
            Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => Ok(false),
            Err(error) => Err(failed(error.error)),
            Ok(_) => sync_parent(&target).map(|()| true).map_err(failed),
        }
    }

    fn sync(&self) -> io::Result<()> {
        fault::step()?;
        self.file().as_file().sync_all()
    }

    fn file(&self) -> &NamedTempFile {
        self.file.as_ref().expect("there until it is finished")
    }

    fn into_parts(mut self) -> (NamedTempFile, PathBuf) {
        let file = self.file.take().expect("there until it is finished");
        (file, std::mem::take(&mut self.target))
    }
}

impl Drop for Aside {
    fn drop(&mut self) {
        // A power failure tidies nothing up; otherwise the file vanishes with its handle.
        if let Some(file) = self.file.take().filter(|_| fault::gone()) {
            let _ = file.keep();
        }
    }
}

/// Makes a new name durable: its folder is synced; where folders cannot be opened (not on Unix) the
/// system decides.
fn sync_parent(path: &Path) -> io::Result<()> {
    fault::step()?;
    #[cfg(unix)]
    File::open(folder_of(path))?.sync_all()?;
    #[cfg(not(unix))]
    let _ = path;
    Ok(())
}

impl Write for Aside {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let file = self.file.as_mut().expect("there until it is finished").as_file_mut();
        if let Err(error) = fault::step() {
            // A disk that fills up or loses power takes a part of what is written.
            let _ = file.write(&bytes[..bytes.len() / 2]);
            return Err(error);
        }
        file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_mut().expect("there until it is finished").as_file_mut().flush()
    }
}

/// Writes a whole file aside, syncs and renames it.
///
/// # Errors
/// One problem if the folder is missing, not writable or full; an older file of that name stays.
pub fn write(target: &Path, bytes: &[u8]) -> Result<(), Problems> {
    let mut aside = Aside::beside(target)?;
    aside.write_all(bytes).map_err(|e| write_problem(target, &e))?;
    aside.finish()
}

/// Writes a whole file aside, syncs and renames it unless a file has the name; whether it was given.
///
/// # Errors
/// As [`write()`].
pub fn write_new(target: &Path, bytes: &[u8]) -> Result<bool, Problems> {
    let mut aside = Aside::beside(target)?;
    aside.write_all(bytes).map_err(|e| write_problem(target, &e))?;
    aside.finish_new()
}

/// Adds to the end of a file, which is made where there is none: for files that others write to as well.
///
/// # Errors
/// One problem if it cannot be written.
pub fn append(target: &Path, text: &str) -> Result<(), Problems> {
    let file = File::options().append(true).create(true).open(target);
    file.and_then(|mut file| file.write_all(text.as_bytes()))
        .map_err(|error| write_problem(target, &error))
}

/// The problem of a file that could not be written.
pub fn write_problem(target: &Path, error: &io::Error) -> Problems {
    problem(target, error, "a writable folder on a disk with free space")
}

/// A path as the user reads it.
pub fn name(path: &Path) -> String {
    path.display().to_string()
}

fn problem(path: &Path, error: &io::Error, allowed: &str) -> Problems {
    Problems::input(name(path), "", error.to_string(), allowed)
}

fn probe(file: &mut File) -> io::Result<()> {
    file.write_all(&[0; PROBE])?;
    file.sync_all()?;
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0)).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(folder)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_appears_only_when_it_is_finished() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        let mut aside = Aside::beside(&target).unwrap();
        aside.write_all(b"whole").unwrap();
        assert!(!target.exists());
        aside.finish().unwrap();
        assert_eq!(read_text(&target).unwrap(), "whole");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_dropped_file_leaves_nothing_and_the_older_file_stays() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.txt");
        write(&target, b"old").unwrap();
        let mut aside = Aside::beside(&target).unwrap();
        aside.write_all(b"half").unwrap();
        drop(aside);
        assert_eq!(read_text(&target).unwrap(), "old");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_folder_that_exists_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("runs/first");
        create_folder(&path).unwrap();
        let problems = create_folder(&path).unwrap_err();
        assert_eq!(problems.kind(), crate::problem::Kind::Input);
        assert!(problems.to_string().contains("first: found something that exists"));
    }

    #[test]
    fn a_missing_folder_and_a_text_that_is_not_utf8_are_problems_of_their_file() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("none/a.txt");
        assert!(Aside::beside(&missing).unwrap_err().to_string().contains("none/a.txt"));
        let binary = folder.path().join("b.toml");
        write(&binary, &[0xff, 0xfe]).unwrap();
        assert!(read_text(&binary).unwrap_err().to_string().contains("UTF-8"));
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_found_when_the_file_is_opened() {
        let full = Path::new("/dev/full");
        let mut file = fs::OpenOptions::new().write(true).open(full).unwrap();
        let error = probe(&mut file).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert!(write_problem(full, &error).to_string().contains("free space"));
    }
}
