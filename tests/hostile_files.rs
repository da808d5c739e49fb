//! Files that are made to be expensive: deep nesting, huge counts, endless lines. Each is answered at
//! once, and none by a panic or a full stack.

use std::fmt::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use octray::bvh::PrimKind;
use octray::scene::{LoadError, load_obj, load_toml};
use octray::{Loaded, load};

/// What a file may take: far more than it does, far less than anything quadratic would.
const AT_ONCE: Duration = Duration::from_secs(20);

fn toml(text: &str) -> Result<Loaded, LoadError> {
    let start = Instant::now();
    let loaded = load_toml(text.as_bytes(), Path::new("a.toml"));
    assert!(start.elapsed() < AT_ONCE, "{:.60}: {:?}", text, start.elapsed());
    loaded
}

fn obj(text: &str) -> Result<Loaded, LoadError> {
    let start = Instant::now();
    let loaded = load_obj(text.as_bytes(), Path::new("a.obj"));
    assert!(start.elapsed() < AT_ONCE, "{:.60}: {:?}", text, start.elapsed());
    loaded
}

fn triangles(loaded: &Loaded) -> usize {
    loaded.scene.primitive_count(PrimKind::Triangle)
}

#[test]
fn deep_nesting_is_refused() {
    for text in [
        format!("x = {}", "[".repeat(200_000)),
        format!("x = {}", "{a=".repeat(200_000)),
        format!("a{} = 1", ".a".repeat(200_000)),
        format!("[{}a]", "a.".repeat(200_000)),
        "[[spheres]]\ncenter = ".to_owned() + &"[".repeat(200_000) + &"]".repeat(200_000),
    ] {
        let message = toml(&text).expect_err("too deep").to_string();
        assert!(message.contains("recur"), "{message:.200}");
        assert!(!message.contains('\n'));
    }
}

#[test]
fn huge_numbers_are_refused() {
    for (line, part) in [
        ("width = 99999999999999999999", "whole number"),
        ("width = 4294967297", "65536"),
        ("width = 1e400", "overflowed"),
        ("spp = 18446744073709551617", "whole number"),
    ] {
        let message = toml(&format!("[render]\n{line}\n")).expect_err(line).to_string();
        assert!(message.starts_with("a.toml:2:") && message.contains(part), "{message}");
    }
    for (line, part) in [("segments = 4294967295", "32768"), ("sides = 1000000", "1024")] {
        let text = format!("[[meshes]]\ngenerate = \"knot\"\n{line}\n");
        let message = toml(&text).expect_err(line).to_string();
        assert!(message.starts_with("a.toml:3:") && message.contains(part), "{message}");
    }
    for index in ["4", "4294967295", "4294967297", "99999999999999999999", "-9223372036854775808"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n");
        let message = obj(&text).expect_err(index).to_string();
        assert!(message.starts_with("a.obj:4:7: "), "{message}");
    }
}

/// A polygon of many corners, round, folded over itself or as a comb; a line continued for ever.
#[test]
fn large_faces_are_read() {
    let corners = 50_000;
    let round = |at: usize| {
        let angle = at as f64 * std::f64::consts::TAU / corners as f64;
        (angle.cos(), angle.sin())
    };
    let folded = |at: usize| ((at * 7919 % 10_007) as f64, (at * 104_729 % 9973) as f64);
    let comb = |at: usize| (at as f64, [0.0, 101.0, 0.0, 103.0][at % 4]);
    for at in [&round as &dyn Fn(usize) -> (f64, f64), &folded, &comb] {
        let mut text = String::new();
        for corner in 0..corners {
            let (x, y) = at(corner);
            let _ = writeln!(text, "v {x} {y} 0");
        }
        text.push('f');
        for corner in 1..=corners {
            let _ = write!(text, " {corner}");
        }
        assert_eq!(triangles(&obj(&text).unwrap()), corners - 2);
    }
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3".to_owned() + &" \\\n".repeat(200_000);
    assert_eq!(triangles(&obj(&text).unwrap()), 1);
}

#[test]
fn many_tables_are_read() {
    let loaded = toml(&"[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\n".repeat(20_000)).unwrap();
    assert_eq!(loaded.scene.primitive_count(PrimKind::Sphere), 20_000);
}

/// The scene of the README, cut off after each of its bytes: a scene, or one line that says where.
#[test]
fn a_file_cut_anywhere_is_told_with_its_place() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
    load(&file).unwrap();
    let bytes = std::fs::read(file).unwrap();
    for end in 0..bytes.len() {
        if let Err(error) = load_toml(&bytes[..end], Path::new("a.toml")) {
            let message = error.to_string();
            assert!(message.starts_with("a.toml") && !message.contains('\n'), "{end}: {message}");
        }
    }
}
