//! The program as a stranger uses it: messages, exit codes, files.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use tempfile::TempDir;

const SCENE: &str = r#"
[camera]
eye = [0, 1, 4]
target = [0, 0.5, 0]
vertical_fov = 40

[render]
width = 64
height = 48

[[lights]]
type = "area"
corner = [-1, 4, -1]
edge_u = [2, 0, 0]
edge_v = [0, 0, 2]
ambient = 0.2
diffuse = 0.8

[materials.matt]
color = [0.8, 0.4, 0.2]
mirror = 0.2

[[quads]]
corner = [-5, 0, 5]
edge_u = [10, 0, 0]
edge_v = [0, 0, -10]
material = "matt"

[[spheres]]
center = [0, 0.5, 0]
radius = 0.5
material = "matt"
"#;

/// A folder with `scene.toml` in it.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    folder
}

fn octray(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_octray"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    octray(folder, arguments).output().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Runs, checks the exit code, that there is one message with `part` in it, and that nothing is
/// left behind.
fn refused(folder: &Path, arguments: &[&str], code: i32, part: &str) {
    let before = names(folder);
    let output = run(folder, arguments);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {message}");
    assert!(message.starts_with("error: "), "{arguments:?}: {message}");
    assert!(message.contains(part), "{arguments:?}: {message}");
    assert!(!message.contains("panicked"), "{arguments:?}: {message}");
    if code == 1 {
        assert_eq!(message.trim_end().lines().count(), 1, "{arguments:?}: {message}");
    }
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder), before, "{arguments:?} left a file behind");
}

fn names(folder: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    names.sort();
    names
}

#[test]
fn a_scene_becomes_a_picture_with_its_name() {
    let folder = folder();
    let output = run(folder.path(), &["render", "scene.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
    let message = stderr(&output);
    assert!(message.starts_with("scene.png: 64x48 in "), "{message}");
    assert!(message.contains("Mray/s"), "{message}");
    // One line and no bar in a pipe.
    assert_eq!(message.lines().count(), 1, "{message}");
    let picture = image::open(folder.path().join("scene.png")).unwrap();
    assert_eq!((picture.width(), picture.height()), (64, 48));
    assert_eq!(names(folder.path()).len(), 2);
}

#[test]
fn quiet_says_nothing_and_json_says_all() {
    let folder = folder();
    let output = run(folder.path(), &["render", "scene.toml", "--quiet"]);
    assert!(output.stdout.is_empty() && output.stderr.is_empty());
    let arguments = ["render", "scene.toml", "-q", "--json", "--crop", "1,2,11,22", "-o", "a.exr"];
    let output = run(folder.path(), &arguments);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["width"], 10);
    assert_eq!(json["rays"]["primary"], 200);
    assert!(json["seconds"]["phases"]["shadow"].is_number());
    assert!(json["mray_per_second"].is_number());
    let output = run(folder.path(), &["info", "scene.toml", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["primitives"]["spheres"], 1);
    assert_eq!(json["lights"]["area"], 1);
    assert!(json["instruction_sets"]["build"].is_array());
    let output = run(folder.path(), &["info", "scene.toml"]);
    let text = String::from_utf8(output.stdout).unwrap();
    for part in ["1 spheres, 1 quads", "bounds", "SAH cost", "bytes a primitive", "CPU has"] {
        assert!(text.contains(part), "{text}");
    }
}

#[test]
fn help_is_no_error() {
    let folder = folder();
    for arguments in [&["--help"][..], &["render", "--help"], &["info", "-h"], &["--version"]] {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0));
        assert!(!output.stdout.is_empty() && output.stderr.is_empty());
    }
}

#[test]
fn threads_and_crops_do_not_change_the_picture() {
    let folder = folder();
    let render = |name: &str, more: &[&str]| {
        let mut arguments =
            vec!["render", "scene.toml", "--size", "90x70", "--spp", "2", "-o", name];
        arguments.extend(more);
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        fs::read(folder.path().join(name)).unwrap()
    };
    let one = render("one.png", &["--threads", "1"]);
    assert!(one == render("eight.png", &["--threads", "8"]));
    assert!(one != render("seed.png", &["--seed", "5"]));
    render("crop.png", &["--crop", "30,20,62,55"]);
    let open = |name| image::open(folder.path().join(name)).unwrap().to_rgb8();
    let (full, part) = (open("one.png"), open("crop.png"));
    assert_eq!(part.dimensions(), (32, 35));
    assert!(part.enumerate_pixels().all(|(x, y, pixel)| pixel == full.get_pixel(30 + x, 20 + y)));
}

#[test]
fn every_format_and_every_aov_is_written() {
    let folder = folder();
    for name in [
        "a.png", "a.jpg", "a.jpeg", "a.bmp", "a.tga", "a.tif", "a.tiff", "a.webp", "a.exr", "a.hdr",
    ] {
        for aov in ["color", "normal", "depth", "prim"] {
            let arguments =
                ["render", "scene.toml", "-q", "--size", "20x10", "--aov", aov, "-o", name];
            let output = run(folder.path(), &arguments);
            assert!(output.status.success(), "{name} {aov}: {}", stderr(&output));
            let picture = image::open(folder.path().join(name)).unwrap();
            assert_eq!((picture.width(), picture.height()), (20, 10), "{name}");
        }
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = folder();
    for (arguments, part) in [
        (&["render", "scene.toml", "--spp", "many"][..], "many"),
        (&["render", "scene.toml", "--spp", "0"], "--spp"),
        (&["render", "scene.toml", "--threads", "-1"], "-1"),
        (&["render", "scene.toml", "--size", "0x10"], "800x600"),
        (&["render", "scene.toml", "--size", "10"], "800x600"),
        (&["render", "scene.toml", "--crop", "5,5,5,9"], "X0 < X1"),
        (&["render", "scene.toml", "--aov", "albedo"], "prim"),
        (&["render", "scene.toml", "--fast"], "--fast"),
        (&["render"], "<SCENE>"),
        (&["paint"], "paint"),
    ] {
        refused(folder.path(), arguments, 2, part);
    }
    assert_eq!(run(folder.path(), &[]).status.code(), Some(2));
}

#[test]
fn failures_exit_with_1_and_one_message() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder.png")).unwrap();
    fs::write(folder.path().join("broken.toml"), "[camera]\neye = [0, 1]\n").unwrap();
    for (arguments, part) in [
        (&["render", "none.toml"][..], "none.toml"),
        (&["info", "none.toml"], "none.toml"),
        (&["render", "broken.toml"], "broken.toml"),
        (&["render", "scene.toml", "-o", "a.gif"], ".webp"),
        (&["render", "scene.toml", "-o", "a"], "extension"),
        // Refused before the scene is even looked for.
        (&["render", "none.toml", "-o", "a.gif"], ".webp"),
        (&["render", "scene.toml", "-o", "nowhere/a.png"], "nowhere"),
        (&["render", "scene.toml", "-o", "folder.png"], "a directory"),
        (&["render", "scene.toml", "--size", "99999x1"], "99999"),
        (&["render", "scene.toml", "--size", "60000x60000"], "pixels"),
        (&["render", "scene.toml", "--size", "20000x10", "-o", "a.webp"], "16383"),
        (&["render", "scene.toml", "--crop", "0,0,65,10"], "64x48"),
    ] {
        refused(folder.path(), arguments, 1, part);
    }
}

#[cfg(unix)]
// Tests that are skipped say so.
#[allow(clippy::print_stderr)]
mod unix {
    use super::*;
    use std::io::Read;
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::time::{Duration, Instant};

    fn send_interrupt(id: u32) {
        let sent = Command::new("kill").args(["-INT", &id.to_string()]).status().unwrap();
        assert!(sent.success());
    }

    #[test]
    fn ctrl_c_leaves_no_file_and_the_old_picture() {
        let folder = folder();
        let old = folder.path().join("scene.png");
        fs::write(&old, "the old picture").unwrap();
        let arguments = ["render", "scene.toml", "--size", "4000x4000", "--shadow-samples", "4096"];
        let mut command = octray(folder.path(), &arguments);
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(700));
        let start = Instant::now();
        send_interrupt(child.id());
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(130));
        assert!(start.elapsed() < Duration::from_secs(20));
        let mut message = String::new();
        child.stderr.take().unwrap().read_to_string(&mut message).unwrap();
        assert_eq!(message, "interrupted\n");
        assert_eq!(fs::read_to_string(&old).unwrap(), "the old picture");
        assert_eq!(names(folder.path()).len(), 2);
    }

    #[test]
    fn a_closed_pipe_is_no_panic() {
        let folder = folder();
        for arguments in [&["info", "scene.toml", "--json"][..], &["--help"]] {
            let mut command = octray(folder.path(), arguments);
            let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
            drop(child.stdout.take());
            let output = child.wait_with_output().unwrap();
            assert_eq!(stderr(&output), "");
            assert_eq!(output.status.code(), Some(0));
        }
    }

    #[test]
    fn a_full_stdout_is_an_error() {
        let folder = folder();
        let Ok(full) = fs::OpenOptions::new().write(true).open("/dev/full") else { return };
        let mut command = octray(folder.path(), &["info", "scene.toml"]);
        let output = command.stdout(full).stderr(Stdio::piped()).output().unwrap();
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).starts_with("error: stdout: "));
    }

    #[test]
    fn devices_are_not_replaced() {
        let folder = folder();
        symlink("/dev/full", folder.path().join("full.png")).unwrap();
        refused(folder.path(), &["render", "scene.toml", "-o", "full.png"], 1, "no ordinary file");
        assert!(!fs::metadata("/dev/full").unwrap().is_file());
    }

    #[test]
    fn links_and_permissions_stay() {
        let folder = folder();
        let (target, link) = (folder.path().join("real.png"), folder.path().join("link.png"));
        fs::write(&target, "old").unwrap();
        fs::set_permissions(&target, PermissionsExt::from_mode(0o640)).unwrap();
        symlink("real.png", &link).unwrap();
        let output = run(folder.path(), &["render", "scene.toml", "-q", "-o", "link.png"]);
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert!(image::open(&target).is_ok());
        assert_eq!(fs::metadata(&target).unwrap().permissions().mode() & 0o777, 0o640);
    }

    /// A mounted file system of a few pages; unmounted when dropped.
    struct SmallDisk(PathBuf);

    impl SmallDisk {
        fn mount(at: PathBuf) -> Option<Self> {
            fs::create_dir(&at).unwrap();
            let mut command = Command::new("mount");
            command.args(["-t", "tmpfs", "-o", "size=64k", "tmpfs"]).arg(&at);
            let mounted = command.stderr(Stdio::null()).status().is_ok_and(|s| s.success());
            mounted.then_some(Self(at))
        }
    }

    impl Drop for SmallDisk {
        fn drop(&mut self) {
            let _ = Command::new("umount").arg(&self.0).status();
        }
    }

    #[test]
    fn a_full_disk_keeps_the_old_picture() {
        let folder = folder();
        let Some(disk) = SmallDisk::mount(folder.path().join("disk")) else {
            eprintln!("skipped: mounting a small disk takes root");
            return;
        };
        let old = disk.0.join("a.bmp");
        fs::write(&old, "the old picture").unwrap();
        let arguments = ["render", "scene.toml", "-q", "--size", "300x300", "-o", "disk/a.bmp"];
        let output = run(folder.path(), &arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(message.starts_with("error: disk/a.bmp: could not be written: "), "{message}");
        assert_eq!(fs::read_to_string(&old).unwrap(), "the old picture");
        assert_eq!(names(&disk.0), [old]);
    }
}
