//! The program as a user without rights: files that it may not read, folders that it may not write
//! to. The superuser may do both, so it hands the program to another user first.
#![cfg(unix)]
// Tests that are skipped say so.
#![allow(clippy::print_stderr)]

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{Mutex, PoisonError};

use tempfile::TempDir;

const SCENE: &str = "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n";

/// By custom the user and the group without rights.
const NOBODY: u32 = 65_534;

fn mode(path: &Path, mode: u32) {
    fs::set_permissions(path, PermissionsExt::from_mode(mode)).unwrap();
}

/// One test at a time: what one thread copies, another one's child process holds open.
static ALONE: Mutex<()> = Mutex::new(());

/// A folder that everyone may write to, with a scene and the program in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    mode(folder.path(), 0o777);
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    fs::copy(env!("CARGO_BIN_EXE_octray"), folder.path().join("octray")).unwrap();
    folder
}

/// Runs the program as a user without rights in the folder.
fn run(folder: &Path, arguments: &[&str]) -> Option<Output> {
    let program: PathBuf = folder.join("octray");
    let mut command = Command::new(&program);
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    if fs::metadata(&program).unwrap().uid() == 0 {
        command.uid(NOBODY).gid(NOBODY);
    }
    match command.output() {
        Ok(output) => Some(output),
        Err(error) => {
            eprintln!("skipped: the program can't be run as another user: {error}");
            None
        }
    }
}

fn refused(folder: &Path, arguments: &[&str], message: &str) {
    let Some(output) = run(folder, arguments) else { return };
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {told}");
    assert!(told.starts_with(message), "{arguments:?}: {told}");
    assert_eq!(told.trim_end().lines().count(), 1, "{told}");
    assert!(output.stdout.is_empty());
}

#[test]
fn a_file_without_permission_is_named() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let secret = folder.path().join("secret.toml");
    fs::write(&secret, SCENE).unwrap();
    fs::write(folder.path().join("secret.obj"), "v 0 0 0\n").unwrap();
    fs::write(folder.path().join("with.toml"), "[[meshes]]\npath = \"secret.obj\"\n").unwrap();
    mode(&secret, 0o000);
    mode(&folder.path().join("secret.obj"), 0o000);
    let why = "no permission to read it: change its mode";
    for command in ["info", "render", "bench"] {
        let message = format!("error: secret.toml: {why}");
        refused(folder.path(), &[command, "secret.toml"], &message);
    }
    refused(folder.path(), &["info", "secret.obj"], &format!("error: secret.obj: {why}"));
    refused(folder.path(), &["info", "with.toml"], "error: with.toml:2:8: mesh `secret.obj`");
}

#[test]
fn a_read_only_folder_is_named() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder();
    let closed = folder.path().join("closed");
    fs::create_dir(&closed).unwrap();
    let old = closed.join("a.png");
    fs::write(&old, "the old picture").unwrap();
    mode(&closed, 0o555);
    for name in ["closed/a.png", "closed/b.png"] {
        let arguments = ["render", "scene.toml", "-q", "--size", "8x8", "-o", name];
        refused(folder.path(), &arguments, &format!("error: {name}: "));
    }
    assert_eq!(fs::read_to_string(&old).unwrap(), "the old picture");
    assert_eq!(fs::read_dir(&closed).unwrap().count(), 1);
    mode(&closed, 0o755);
}
