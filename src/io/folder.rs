//! A folder of files written aside, synced and renamed: it appears complete or not at all.
//!
//! Single files are the business of `files`; what they hold is that of the callers.

#![expect(clippy::disallowed_methods, reason = "the place where the program touches the disk")]

use super::fault;
use super::files::{ASIDE, name, write_problem};
use crate::problem::Problems;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Writes `files` (paths inside the folder, and bytes) as the folder `target`. The parent of
/// `target` is made where it is missing. A folder that exists is refused, or replaced as a whole
/// where `replace` names a file that it holds: so nothing but a folder of its kind is replaced. Files
/// beside `files` that such a folder may hold are named by `also`, paths inside it.
///
/// # Errors
/// One problem if the folder exists, or cannot be written; then nothing of it is left behind and
/// an older folder stays.
pub fn write(
    target: &Path,
    files: &[(PathBuf, Vec<u8>)],
    replace: Option<&str>,
    also: &[PathBuf],
) -> Result<(), Problems> {
    let exists = fs::symlink_metadata(target).is_ok();
    if exists && replace.is_none_or(|mark| !target.join(mark).is_file()) {
        let (found, allowed) = match replace {
            None => ("something that exists", "the name of a new folder, or --force".to_owned()),
            Some(mark) => {
                ("something that exists", format!("a new folder, or one that holds {mark}"))
            }
        };
        return Err(Problems::input(name(target), "", found, allowed));
    }
    // Nothing but files of its kind is ever removed.
    let known: Vec<&Path> =
        files.iter().map(|(file, _)| file).chain(also).map(PathBuf::as_path).collect();
    if let Some(entry) = foreign_entry(target, &known).filter(|_| exists) {
        let found = format!("a folder that also holds `{entry}`");
        let allowed = "a folder with files of its kind alone";
        return Err(Problems::input(name(target), "", found, allowed));
    }
    let parent = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    fill(parent, target, files, exists).map_err(|e| write_problem(target, &e))
}

/// A file below the folder `target` that is not among the `known` ones.
fn foreign_entry(target: &Path, known: &[&Path]) -> Option<String> {
    let mut folders = vec![target.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).ok()?.flatten() {
            let path = entry.path();
            let inside = path.strip_prefix(target).ok()?.to_owned();
            if known.contains(&inside.as_path()) {
                continue;
            }
            if path.is_dir() && known.iter().any(|file| file.starts_with(&inside)) {
                folders.push(path);
                continue;
            }
            return Some(inside.display().to_string());
        }
    }
    None
}

fn fill(
    parent: &Path,
    target: &Path,
    files: &[(PathBuf, Vec<u8>)],
    exists: bool,
) -> io::Result<()> {
    fs::create_dir_all(parent)?;
    let aside = folder_aside(parent)?;
    let mut folders = vec![aside.path().to_owned()];
    for (path, bytes) in files {
        let path = aside.path().join(path);
        if let Some(folder) = path.parent().filter(|f| !folders.iter().any(|g| g == f)) {
            fs::create_dir_all(folder)?;
            folders.push(folder.to_owned());
        }
        fault::step()?;
        let mut file = File::create_new(&path)?;
        file.write_all(bytes)?;
        file.sync_all()?;
    }
    for folder in folders.iter().rev() {
        sync(folder)?;
    }
    // A folder that is replaced steps aside first, and comes back if the new one cannot follow.
    let old = if exists { Some(folder_aside(parent)?) } else { None };
    if let Some(old) = &old {
        fs::rename(target, old.path().join("old"))?;
    }
    let renamed = fs::rename(aside.path(), target);
    if let (Err(_), Some(old)) = (&renamed, &old) {
        fs::rename(old.path().join("old"), target)?;
    }
    renamed?;
    // What was written aside now bears its final name and is not to be removed.
    let _ = aside.keep();
    sync(parent)
}

fn folder_aside(parent: &Path) -> io::Result<tempfile::TempDir> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(ASIDE);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    builder.tempdir_in(parent)
}

/// Makes new names in a folder durable, where folders can be opened.
fn sync(folder: &Path) -> io::Result<()> {
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(text: &str) -> Vec<(PathBuf, Vec<u8>)> {
        vec![("mark".into(), text.into()), ("tables/a".into(), b"table".to_vec())]
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_folder_appears_with_all_its_files_and_nothing_beside_it() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("new/folder");
        write(&target, &files("one"), None, &[]).unwrap();
        assert_eq!(fs::read(target.join("tables/a")).unwrap(), b"table");
        assert_eq!(names(&place.path().join("new")), ["folder"]);
    }

    #[test]
    fn a_folder_that_exists_is_refused_and_replaced_only_where_it_holds_the_mark() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("folder");
        write(&target, &files("one"), None, &[]).unwrap();
        assert!(
            write(&target, &files("two"), None, &[]).unwrap_err().to_string().contains("--force")
        );
        write(&target, &files("two"), Some("mark"), &[]).unwrap();
        assert_eq!(fs::read(target.join("mark")).unwrap(), b"two");
        assert!(write(&target, &files("three"), Some("other"), &[]).is_err());
        assert_eq!(fs::read(target.join("mark")).unwrap(), b"two");
        assert_eq!(names(place.path()), ["folder"]);
    }

    #[test]
    fn a_folder_that_holds_anything_else_is_not_replaced() {
        for foreign in ["notes.md", "tables/notes.md", "own/notes.md"] {
            let place = tempfile::tempdir().unwrap();
            let target = place.path().join("folder");
            write(&target, &files("one"), None, &[]).unwrap();
            fs::create_dir_all(target.join("own")).unwrap();
            fs::write(target.join(foreign), "mine").unwrap();
            assert!(write(&target, &files("two"), Some("mark"), &[]).is_err(), "{foreign}");
            assert_eq!(fs::read(target.join(foreign)).unwrap(), b"mine");
            assert_eq!(fs::read(target.join("mark")).unwrap(), b"one");
        }
    }

    #[test]
    fn a_file_of_its_kind_that_is_not_written_again_goes_with_the_folder() {
        let place = tempfile::tempdir().unwrap();
        let target = place.path().join("folder");
        let also = [PathBuf::from("tables/b")];
        let mut more = files("one");
        more.push((also[0].clone(), b"second".to_vec()));
        write(&target, &more, None, &[]).unwrap();
        assert!(write(&target, &files("two"), Some("mark"), &[]).is_err());
        write(&target, &files("two"), Some("mark"), &also).unwrap();
        assert_eq!(names(&target.join("tables")), ["a"]);
    }

    #[test]
    fn a_place_that_is_no_folder_is_a_problem_that_names_the_target() {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("file"), "").unwrap();
        let target = place.path().join("file/folder");
        let problems = write(&target, &files("one"), None, &[]).unwrap_err();
        assert!(problems.to_string().contains("file/folder"), "{problems}");
    }
}
