//! The keys of a scene file to a [`Loaded`] scene.
//!
//! Numbers are predictable. Geometries: spheres, one geometry a material in the order in which the
//! file first uses it; then quads likewise; then meshes in the order of the file, an OBJ one for
//! each of its parts. Within one, `prim_id` follows the file. Materials: by name; then the default
//! and those of OBJ files as they are first used.

use std::path::Path;

use toml::Spanned;

use super::check::Source;
use super::error::{LoadError, Place, Problem};
use super::keys::{MeshKeys, QuadKeys, SceneKeys, SphereKeys};
use super::looks::{self, Materials};
use super::{LoadOptions, Loaded, meshes, picture, wording};
use crate::geometry::{Quads, Spheres};
use crate::scene::{SceneBuilder, Shading};

/// The scene of a text that is known to be UTF-8 without byte order mark.
pub(super) fn load(text: &str, file: &Path, options: LoadOptions<'_>) -> Result<Loaded, LoadError> {
    let source = Source { file, text };
    let keys: SceneKeys = toml::from_str(text).map_err(|error| {
        let place = error.span().map(|span| Place::of(text, span.start));
        LoadError::new(file, place, Problem::Format(wording::of_toml(error.message())))
    })?;
    let camera = keys.camera.as_ref().map(|camera| picture::camera(source, camera)).transpose()?;
    let settings = picture::settings(source, &keys.render)?;
    let mut builder = SceneBuilder::new();
    builder.set_quality(picture::build(&keys.render));
    let mut materials = Materials::add(source, &keys.materials, &mut builder)?;
    for light in &keys.lights {
        builder.add_light(looks::light(source, light)?);
    }
    add_spheres(source, &keys.spheres, &mut materials, &mut builder)?;
    add_quads(source, &keys.quads, &mut materials, &mut builder)?;
    let mut warnings = Vec::new();
    for mesh in &keys.meshes {
        add_mesh(source, mesh, &mut materials, &mut builder, &mut warnings)?;
    }
    if keys.lights.is_empty() && settings.shading == Shading::Phong {
        warnings.push(format!(
            "{}: there is no light, so everything is black: add [[lights]], or shading = \"flat\" \
             under [render]",
            file.display()
        ));
    }
    super::finish(file, builder, camera, settings, warnings, options)
}

/// Geometries by material, in the order of first use. Scenes have few materials: a list will do.
struct Batches<T>(Vec<(u32, T)>);

impl<T: Default> Batches<T> {
    fn of(&mut self, material: u32) -> &mut T {
        let found = self.0.iter().position(|(id, _)| *id == material);
        let index = found.unwrap_or_else(|| {
            self.0.push((material, T::default()));
            self.0.len() - 1
        });
        &mut self.0[index].1
    }
}

fn add_spheres(
    source: Source<'_>,
    spheres: &[SphereKeys],
    materials: &mut Materials,
    builder: &mut SceneBuilder,
) -> Result<(), LoadError> {
    let mut batches = Batches::<Spheres>(Vec::new());
    for keys in spheres {
        let center = source.vector("center", &keys.center)?;
        let radius = source.positive("radius", &keys.radius)?;
        let material = materials.find_or_default(source, &keys.material, builder)?;
        batches.of(material).push(center, radius);
    }
    for (material, spheres) in batches.0 {
        builder.add_spheres(spheres, material);
    }
    Ok(())
}

fn add_quads(
    source: Source<'_>,
    quads: &[Spanned<QuadKeys>],
    materials: &mut Materials,
    builder: &mut SceneBuilder,
) -> Result<(), LoadError> {
    let mut batches = Batches::<Quads>(Vec::new());
    for at in quads {
        let keys = at.get_ref();
        let corner = source.vector("corner", &keys.corner)?;
        let edge_u = source.vector("edge_u", &keys.edge_u)?;
        let edge_v = source.vector("edge_v", &keys.edge_v)?;
        // What the builder would refuse too, but without a place.
        if Quads::one(corner, edge_u, edge_v).validate(0).is_err() {
            let message = "the quad has no area, or reaches beyond the largest float: give edges \
                           that are not parallel";
            return Err(source.wrong(&keys.edge_u, message.into()));
        }
        let material = materials.find_or_default(source, &keys.material, builder)?;
        batches.of(material).push(corner, edge_u, edge_v);
    }
    for (material, quads) in batches.0 {
        builder.add_quads(quads, material);
    }
    Ok(())
}

fn add_mesh(
    source: Source<'_>,
    at: &Spanned<MeshKeys>,
    materials: &mut Materials,
    builder: &mut SceneBuilder,
    warnings: &mut Vec<String>,
) -> Result<(), LoadError> {
    let own =
        at.get_ref().material.as_ref().map(|name| materials.find(source, name)).transpose()?;
    let obj = meshes::read(source, at)?;
    warnings.extend(obj.warnings);
    let mut ids = vec![None; obj.materials.len()];
    for part in obj.parts {
        let material = match (own, part.material) {
            (Some(own), _) => own,
            (None, Some(index)) => {
                *ids[index].get_or_insert_with(|| builder.add_material(obj.materials[index]))
            }
            (None, None) => materials.default(builder),
        };
        builder.add_mesh(part.mesh, material);
    }
    Ok(())
}
