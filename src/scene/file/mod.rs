//! Scene files: a TOML text or a mesh alone (OBJ, PLY) to a scene, a camera and settings.
//!
//! `docs/scene-files.md` is the reference of the format. A file goes through `read` (is it text?),
//! `keys` and `values` (is it a scene file?), then through `picture`, `looks`, `meshes` and `build`
//! (do its values make sense?). The first thing that is wrong ends it with one [`LoadError`].

mod build;
mod check;
mod error;
mod keys;
mod looks;
mod meshes;
mod picture;
pub(super) mod read;
mod transform;
mod values;
mod wording;

use std::path::Path;

use glam::Vec3;

pub use error::{LoadError, Place, Problem};

use crate::bvh::{BuildQuality, Watch};
use crate::geometry::Aabb;
use crate::scene::mesh_file::{self, MeshFile};
use crate::scene::{
    Camera, Dropped, Light, LightShape, Material, Scene, SceneBuilder, Settings, obj, ply,
};

/// What a file holds, ready to be rendered.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// The camera; framed around the scene if the file names none.
    pub camera: Camera,
    /// The settings; those that the file does not name have their default.
    pub settings: Settings,
    /// What is odd but not wrong, such as triangles without area that were left out: one line each.
    pub warnings: Vec<String>,
}

/// How a file is to be loaded.
#[derive(Clone, Copy, Default)]
pub struct LoadOptions<'a> {
    /// How much work goes into the tree, if not what the file says.
    pub build: Option<BuildQuality>,
    /// Who watches the build.
    pub watch: Option<&'a Watch<'a>>,
}

/// Loads a scene (`.toml`) or a mesh alone (`.obj`, `.ply`, with a camera and a light framed around
/// it).
/// Builds the scene on the rayon pool that it is called in.
///
/// # Errors
/// [`LoadError`] for a file that can't be read, is none of them, or has anything wrong in it.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    load_with(path, LoadOptions::default())
}

/// As [`load`], with options.
///
/// # Errors
/// As [`load`]; [`BuildError::Cancelled`](crate::BuildError::Cancelled) in a [`Problem::Build`] if
/// whoever watches ended it.
pub fn load_with(path: &Path, options: LoadOptions<'_>) -> Result<Loaded, LoadError> {
    if has_extension(path, "toml") {
        let bytes = read::bytes(path)?;
        build::load(read::utf8(&bytes, path)?, path, options)
    } else if let Some(mesh) = mesh_file::read(path, true) {
        mesh_alone(path, mesh?, options)
    } else {
        // A folder or a missing file is the clearer news.
        read::check(path)?;
        let message = "is neither a scene nor a mesh: name a .toml, an .obj or a .ply file";
        Err(LoadError::new(path, None, Problem::Kind(message.into())))
    }
}

/// As [`load`] for the text of a scene file. `file` need not be there: errors name it, and meshes
/// are looked for beside it.
///
/// # Errors
/// As [`load`].
pub fn load_toml(text: &[u8], file: &Path) -> Result<Loaded, LoadError> {
    build::load(read::utf8(text, file)?, file, LoadOptions::default())
}

/// As [`load`] for the text of an OBJ file; see [`load_toml`].
///
/// # Errors
/// As [`load`].
pub fn load_obj(text: &[u8], file: &Path) -> Result<Loaded, LoadError> {
    mesh_alone(file, obj::parse(|| Ok(text), file, true)?, LoadOptions::default())
}

/// As [`load`] for the bytes of a PLY file; see [`load_toml`].
///
/// # Errors
/// As [`load`].
pub fn load_ply(bytes: &[u8], file: &Path) -> Result<Loaded, LoadError> {
    let mesh = ply::parse(bytes, bytes.len() as u64, file)?;
    mesh_alone(file, mesh, LoadOptions::default())
}

/// True if the path ends in this extension, in small letters or large ones.
pub(super) fn has_extension(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

/// A scene of one mesh.
fn mesh_alone(file: &Path, mesh: MeshFile, options: LoadOptions<'_>) -> Result<Loaded, LoadError> {
    let mut builder = SceneBuilder::new();
    let ids: Vec<u32> = mesh.materials.iter().map(|&one| builder.add_material(one)).collect();
    let mut plain = None;
    let mut bounds = Aabb::EMPTY;
    for part in mesh.parts {
        for index in 0..part.mesh.len() {
            let corners = part.mesh.triangle(index);
            if corners.iter().all(|corner| corner.is_finite()) {
                bounds = bounds.union(Aabb::of_points(&corners));
            }
        }
        let material = match part.material {
            Some(index) => ids[index],
            None => *plain.get_or_insert_with(|| builder.add_material(light_grey())),
        };
        builder.add_mesh(part.mesh, material);
    }
    if !bounds.is_empty() {
        builder.add_light(framing_light(&bounds));
    }
    let settings =
        Settings { spp: 4, background: Vec3::new(0.1, 0.11, 0.13), ..Settings::default() };
    finish(file, builder, None, settings, mesh.warnings, options)
}

/// The material of a mesh that has none, in a scene of its own.
fn light_grey() -> Material {
    let specular = Vec3::splat(0.15);
    Material { specular, shininess: 40.0, ..Material::matt(Vec3::splat(0.75)) }
}

/// An area light above the right shoulder of [`Camera::framing`], facing the middle of the scene.
fn framing_light(bounds: &Aabb) -> Light {
    let diagonal = bounds.diagonal();
    let towards = Vec3::new(0.3, 1.2, 0.5);
    let side = diagonal * 0.25;
    let edge_u = towards.cross(Vec3::Z).normalize() * side;
    let edge_v = towards.cross(edge_u).normalize() * side;
    let corner = bounds.center() + towards * diagonal - (edge_u + edge_v) * 0.5;
    let shape = LightShape::Quad { corner, edge_u, edge_v };
    Light { ambient: Vec3::splat(0.2), ..Light::new(shape, Vec3::splat(0.85)) }
}

/// [`Camera::framing`] at the distance from which the box just fits into a square picture, so that
/// it fits into wider ones too.
fn framed(bounds: &Aabb) -> Camera {
    let camera = Camera::framing(bounds);
    let center = bounds.center();
    let back = (camera.eye - center).normalize_or(Vec3::Z);
    let right = camera.up.cross(back).normalize_or(Vec3::X);
    let up = back.cross(right);
    let reach = (camera.vertical_fov * 0.5).to_radians().tan();
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    let distance_of = |corner: u32| {
        let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let from = half * Vec3::new(sign(0), sign(1), sign(2));
        from.dot(back) + from.dot(right).abs().max(from.dot(up).abs()) / reach
    };
    let distance = (0..8).map(distance_of).fold(0.0, f32::max);
    let eye = center + back * distance;
    if eye.is_finite() && eye != center { Camera { eye, ..camera } } else { camera }
}

/// Builds the scene, refuses one without primitives, frames the camera if there is none.
fn finish(
    file: &Path,
    mut builder: SceneBuilder,
    camera: Option<Camera>,
    settings: Settings,
    mut warnings: Vec<String>,
    options: LoadOptions<'_>,
) -> Result<Loaded, LoadError> {
    if let Some(quality) = options.build {
        builder.set_quality(quality);
    }
    let scene = match options.watch {
        Some(watch) => builder.build_watched(watch),
        None => builder.build(),
    };
    let scene = scene.map_err(|error| LoadError::new(file, None, error.into()))?;
    let Dropped { degenerate, not_finite } = scene.dropped();
    if scene.bounds().is_empty() {
        let message = if degenerate + not_finite > 0 {
            "all triangles are without area or not finite: there is nothing to see"
        } else {
            "there is nothing to see: add [[spheres]], [[quads]] or [[meshes]]"
        };
        return Err(LoadError::new(file, None, Problem::Empty(message.into())));
    }
    for (count, why) in [(degenerate, "have no area"), (not_finite, "are not finite")] {
        if count > 0 {
            warnings.push(format!(
                "{}: triangles left out because they {why}: {count}",
                file.display()
            ));
        }
    }
    let camera = camera.unwrap_or_else(|| framed(&scene.bounds()));
    Ok(Loaded { scene, camera, settings, warnings })
}
