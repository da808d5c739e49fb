//! Finds and loads Embree's shared library.

#![allow(unsafe_code)]

use std::path::{Path, PathBuf};
use std::process::Command;

use libloading::Library;

use crate::api::Api;

/// What to say when there is none.
pub(crate) const HOW_TO_GET: &str = "\
Embree 4 was not found: nothing to compare with. Get it by `pip install embreex` (its wheel holds \
the library), or set OCTRAY_EMBREE_LIB to the path of libembree4. `--octray-only` runs without it.";

/// Prints the folder of the `embreex` package without importing it.
const FIND_PACKAGE: &str = "import importlib.util as u, os; s = u.find_spec('embreex'); \
                            print(os.path.dirname(s.origin) if s else '')";

/// The library, and where it was found. `Err` says why there is none.
pub(crate) fn load() -> Result<(Api, PathBuf), String> {
    let path = find().ok_or(HOW_TO_GET)?;
    let library = open(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    // SAFETY: by its name it is Embree 4, or the user says so.
    let api = unsafe { Api::new(library) };
    Ok((api.map_err(|error| format!("{}: {error}", path.display()))?, path))
}

fn find() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("OCTRAY_EMBREE_LIB").filter(|given| !given.is_empty()) {
        let given = PathBuf::from(given);
        return if given.is_dir() { embree_in(&given) } else { Some(given) };
    }
    let of_package = ["python3", "python"].into_iter().find_map(|python| {
        let output = Command::new(python).args(["-c", FIND_PACKAGE]).output().ok()?;
        let package = String::from_utf8(output.stdout).ok()?;
        let package = Path::new(package.trim());
        let beside = package.with_file_name("embreex.libs");
        [beside, package.join(".dylibs"), package.join("lib"), package.to_owned()]
            .iter()
            .find_map(|folder| embree_in(folder))
    });
    of_package.or_else(|| {
        ["/usr/local/lib", "/usr/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib"]
            .into_iter()
            .find_map(|folder| embree_in(Path::new(folder)))
    })
}

/// The first file in the folder that is called like Embree 4.
fn embree_in(folder: &Path) -> Option<PathBuf> {
    files_called(folder, &["libembree4", "embree4"]).into_iter().next()
}

fn files_called(folder: &Path, starts: &[&str]) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_library = |name: &str| [".so", ".dylib", ".dll"].iter().any(|end| name.contains(end));
    let mut found: Vec<PathBuf> = entries
        .filter(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            starts.iter().any(|start| name.starts_with(start)) && is_library(&name)
        })
        .map(|entry| entry.path())
        .collect();
    found.sort();
    found
}

fn open(path: &Path) -> Result<Library, libloading::Error> {
    // A wheel's library needs the threading library that lies beside it: it is loaded first, for
    // all, and stays.
    for beside in files_called(path.parent().unwrap_or(Path::new(".")), &["libtbb", "tbb"]) {
        if let Ok(library) = open_for_all(&beside) {
            std::mem::forget(library);
        }
    }
    open_for_all(path)
}

#[cfg(unix)]
fn open_for_all(path: &Path) -> Result<Library, libloading::Error> {
    use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
    // SAFETY: Embree and its threading library run no initialisers that need anything of us.
    unsafe { Library::open(Some(path), RTLD_NOW | RTLD_GLOBAL) }.map(Into::into)
}

#[cfg(not(unix))]
fn open_for_all(path: &Path) -> Result<Library, libloading::Error> {
    // SAFETY: Embree and its threading library run no initialisers that need anything of us.
    unsafe { Library::new(path) }
}
