//! The lock of a run: one process at a time, told by name; a lock whose owner is gone is stale.
//!
//! The system holds the lock as long as the process lives, whatever ends it; the text in the file
//! only says who it is and how far it has come.

#![expect(clippy::disallowed_methods, reason = "a place where the program touches the disk")]

use super::{fault, files};
use crate::problem::Problems;
use serde::{Deserialize, Serialize};
use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Longest text of a lock that is read, bytes.
const LONGEST: u64 = 4096;

/// Who holds a lock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Owner {
    /// Process.
    pub pid: u32,
    /// Machine.
    pub host: String,
    /// When it began, UTC.
    pub started: String,
    /// How far it has come.
    pub progress: Option<Told>,
}

/// How far a process has come with the cases it set out to evaluate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Told {
    /// Cases to be evaluated by this process.
    pub total: u64,
    /// Cases evaluated.
    pub done: u64,
    /// Of these, cases with a failed evaluation.
    pub failed: u64,
    /// Of these, cases with an unstable named mode.
    pub unstable: u64,
    /// Cases per second.
    pub cases_per_s: f64,
    /// Seconds left at that rate.
    pub left_s: Option<f64>,
}

impl Owner {
    /// This process.
    pub fn here() -> Self {
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let host = if host.trim().is_empty() { "this machine" } else { host.trim() };
        Self {
            pid: std::process::id(),
            host: host.to_owned(),
            started: super::manifest::utc(std::time::SystemTime::now()),
            progress: None,
        }
    }

    /// The owner in words.
    pub fn name(&self) -> String {
        format!("process {} on {} since {}", self.pid, self.host, self.started)
    }
}

/// A lock that is held until it is dropped.
#[derive(Debug)]
pub struct Lock {
    file: File,
    path: PathBuf,
    /// None of a shared lock.
    owner: Option<Owner>,
    /// Who held it before and never gave it back.
    pub stale: Option<Owner>,
}

impl Lock {
    /// Takes the lock for this process alone.
    ///
    /// # Errors
    /// An input problem if another process holds it, which is named, or the file cannot be written.
    pub fn take(path: &Path) -> Result<Self, Problems> {
        Self::acquire(path, Some(Owner::here()))
    }

    /// Takes the lock together with others that share it.
    ///
    /// # Errors
    /// An input problem if a process holds it alone, or the file cannot be written.
    pub fn share(path: &Path) -> Result<Self, Problems> {
        Self::acquire(path, None)
    }

    fn acquire(path: &Path, owner: Option<Owner>) -> Result<Self, Problems> {
        let failed = |error: std::io::Error| files::write_problem(path, &error);
        loop {
            fault::step().map_err(failed)?;
            let mut file = File::options()
                .create(true)
                .truncate(false)
                .read(true)
                .write(true)
                .open(path)
                .map_err(failed)?;
            let locked = if owner.is_some() { file.try_lock() } else { file.try_lock_shared() };
            match locked {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let by = read(&mut file).map_or("another process".to_owned(), |o| o.name());
                    let allowed = "one process at a time; see `tvse status`";
                    let found = format!("a lock held by {by}");
                    return Err(Problems::input(files::name(path), "", found, allowed));
                }
                // No locks on this file system: the process is looked for instead.
                Err(TryLockError::Error(_)) => {
                    if let Some(by) = read(&mut file).filter(alive) {
                        let found = format!("a lock of {}", by.name());
                        let allowed = "one process at a time; remove the file if that one is gone";
                        return Err(Problems::input(files::name(path), "", found, allowed));
                    }
                }
            }
            // Its last owner may have removed the file between the two calls.
            if !same(&file, path) {
                continue;
            }
            let stale = owner.as_ref().and_then(|_| read(&mut file));
            let mut lock = Self { file, path: path.to_owned(), owner, stale };
            lock.write().map_err(failed)?;
            return Ok(lock);
        }
    }

    /// Says in the lock how far its owner has come. What cannot be written is left out.
    pub fn tell(&mut self, progress: Told) {
        if let Some(owner) = &mut self.owner {
            owner.progress = Some(progress);
            let _ = self.write();
        }
    }

    fn write(&mut self) -> std::io::Result<()> {
        let Some(owner) = &self.owner else { return Ok(()) };
        fault::step()?;
        let text = serde_json::to_vec(owner).expect("an owner has text keys only");
        self.file.seek(SeekFrom::Start(0))?;
        self.file.write_all(&text)?;
        self.file.set_len(text.len() as u64)
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Shared by others the file stays. Removed while it is still held, so that no other
        // process can have taken it.
        if self.owner.is_some() && !fault::gone() && same(&self.file, &self.path) {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Who holds a lock, if it is held.
pub fn holder(path: &Path) -> Option<Owner> {
    let mut file = File::open(path).ok()?;
    let owner = read(&mut file);
    match file.try_lock_shared() {
        Ok(()) => None,
        Err(TryLockError::WouldBlock) => owner,
        Err(TryLockError::Error(_)) => owner.filter(alive),
    }
}

fn read(file: &mut File) -> Option<Owner> {
    let mut text = String::new();
    file.seek(SeekFrom::Start(0)).ok()?;
    file.take(LONGEST).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

/// Whether the owner may still be at work: of another machine it is not known.
fn alive(owner: &Owner) -> bool {
    owner.host != Owner::here().host || Path::new(&format!("/proc/{}", owner.pid)).exists()
}

/// Whether the name still stands for the open file.
fn same(file: &File, path: &Path) -> bool {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let id = |about: fs::Metadata| (about.dev(), about.ino());
        let (open, named) = (file.metadata().map(id), fs::metadata(path).map(id));
        open.ok() == named.ok()
    }
    #[cfg(not(unix))]
    {
        let _ = file;
        path.exists()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lock_is_held_by_one_alone_or_shared_and_names_its_owner() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let mut lock = Lock::take(&path).unwrap();
        assert!(lock.stale.is_none());
        let told =
            Told { total: 9, done: 4, failed: 1, unstable: 2, cases_per_s: 2.5, left_s: None };
        lock.tell(told);
        for refused in [Lock::take(&path), Lock::share(&path)] {
            let text = refused.unwrap_err().to_string();
            assert!(text.contains(&format!("process {}", std::process::id())), "{text}");
        }
        assert_eq!(holder(&path).unwrap().progress, Some(told));
        drop(lock);
        assert!(!path.exists() && holder(&path).is_none());
        let (one, two) = (Lock::share(&path).unwrap(), Lock::share(&path).unwrap());
        assert!(Lock::take(&path).is_err());
        drop((one, two));
        assert!(Lock::take(&path).is_ok());
    }

    #[test]
    fn a_lock_whose_owner_is_gone_is_stale_and_taken_over() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let gone = Owner { pid: 1, started: "2001-01-01T00:00:00Z".to_owned(), ..Owner::here() };
        fs::write(&path, serde_json::to_string(&gone).unwrap()).unwrap();
        assert_eq!(Lock::take(&path).unwrap().stale, Some(gone));
        // Nor does a text that is no owner stand in the way.
        fs::write(&path, "half a te").unwrap();
        assert_eq!(Lock::take(&path).unwrap().stale, None);
    }
}
