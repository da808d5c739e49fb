//! What must hold for any bytes at all: as a scene file, as a mesh, as materials, as geometry.
//!
//! The fuzz targets in `fuzz/` and `tests/fuzz_seeds.rs` run the same functions; their inputs lie
//! beside this file, in a folder for each. An input that once broke something stays there.
#![allow(dead_code, unreachable_pub)]

mod bytes;
mod geometry;

use std::path::Path;

use octray::render::{Aov, RenderError, Renderer, reference};
use octray::scene::{load_obj, load_ply, load_toml};
use octray::{LoadError, Loaded, Settings};

pub use geometry::geometry;

/// A function that takes any bytes and panics if the library does what it must not.
pub type Target = fn(&[u8]);

/// All targets by name: that of their folder and of the binary in `fuzz/`.
pub const TARGETS: [(&str, Target); 5] = [
    ("scene_file", scene_file),
    ("obj_file", obj_file),
    ("mtl_file", mtl_file),
    ("geometry", geometry),
    ("ply_file", ply_file),
];

/// A file of more than this is as good as many small ones, and slower.
const MOST_BYTES: usize = 1 << 14;

/// Loads the bytes as a scene file.
pub fn scene_file(bytes: &[u8]) {
    if bytes.len() > MOST_BYTES || generates_much(bytes) {
        return;
    }
    // A folder that is not there: no mesh is found beside the file.
    look_at(load_toml(bytes, Path::new("nowhere/a.toml")));
}

/// Loads the bytes as an OBJ mesh.
pub fn obj_file(bytes: &[u8]) {
    if bytes.len() <= MOST_BYTES {
        look_at(load_obj(bytes, Path::new("nowhere/a.obj")));
    }
}

/// Loads the bytes as a PLY mesh.
pub fn ply_file(bytes: &[u8]) {
    if bytes.len() <= MOST_BYTES {
        look_at(load_ply(bytes, Path::new("nowhere/a.ply")));
    }
}

/// Loads the bytes as the materials of a mesh; they have to be in a file for it.
pub fn mtl_file(bytes: &[u8]) {
    if bytes.len() > MOST_BYTES {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder to write to");
    std::fs::write(folder.path().join("a.mtl"), bytes).expect("a small file");
    let mesh = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b\nf 3 2 1\n";
    let loaded = load_obj(mesh.as_bytes(), &folder.path().join("a.obj"));
    assert!(loaded.is_ok(), "materials are no reason to refuse a mesh: {loaded:?}");
    for material in told(loaded).expect("as above").scene.materials() {
        material.validate().expect("what is no material is left out");
    }
}

/// What was loaded, if anything was; what is wrong is told in one line.
fn told(loaded: Result<Loaded, LoadError>) -> Option<Loaded> {
    let messages = match &loaded {
        Ok(loaded) => loaded.warnings.clone(),
        Err(error) => vec![error.to_string()],
    };
    for message in messages {
        assert!(!message.is_empty() && !message.contains('\n'), "{message:?}");
    }
    loaded.ok()
}

/// What is right can be rendered, and shows what the reference says.
fn look_at(loaded: Result<Loaded, LoadError>) {
    let Some(loaded) = told(loaded) else { return };
    loaded.scene.bvh().validate().expect("a valid tree");
    loaded.settings.validate().expect("settings in their ranges");
    let settings = Settings {
        width: 6,
        height: 5,
        spp: 1,
        shadow_samples: loaded.settings.shadow_samples.min(4),
        max_bounces: loaded.settings.max_bounces.min(2),
        ..loaded.settings
    };
    let (scene, camera) = (&loaded.scene, &loaded.camera);
    for aov in [Aov::Color, Aov::Prim] {
        let rendered = Renderer::new(scene, camera, settings).aov(aov).threads(1).render();
        let image = match rendered {
            Ok(rendered) => rendered.image,
            // A camera that looks nowhere is refused before the first ray.
            Err(RenderError::Camera(_)) => return,
            Err(error) => panic!("{error}"),
        };
        // The reference tries every primitive: small scenes only.
        if aov == Aov::Prim && scene.bvh().stats().primitives < 1000 {
            let expected = reference::render(scene, camera, settings, None, aov).expect("as above");
            assert!(image.pixels == expected.pixels, "other primitives than the reference's");
        }
    }
}

/// True if the text asks for a generated mesh that would take long to build.
fn generates_much(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let Ok(table) = text.trim_start_matches('\u{feff}').parse::<toml::Table>() else {
        return false;
    };
    let most = [("subdivisions", 4), ("segments", 200), ("sides", 50)];
    let meshes = table.get("meshes").and_then(toml::Value::as_array);
    meshes.into_iter().flatten().any(|mesh| {
        let is_over = |(key, most)| {
            let value = mesh.get(key).and_then(toml::Value::as_float);
            let value = value.or(mesh.get(key).and_then(toml::Value::as_integer).map(|n| n as f64));
            // As far as the format allows there are no more than these; by default there are more.
            value.is_some_and(|value| value > f64::from(most))
        };
        most.into_iter().any(is_over)
    })
}
