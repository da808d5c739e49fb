//! OBJ meshes and their MTL materials, through `tobj`.
//!
//! `tobj` splits a file into parts by object and material, and shares vertices; it also says
//! little about what is wrong with a file, and panics or wraps around on some. So `lines` reads the
//! file first, finds every mistake with its place, and hands on a text without surprises: finished
//! triangles with indices from 1 that exist. `mtl` does the same for materials.

mod lines;
mod mtl;

use std::cell::RefCell;
use std::path::Path;

use glam::Vec3;

use super::file::{LoadError, Problem, read as files};
use super::mesh_file::{MeshFile, Part};
use crate::geometry::Mesh;

/// Reads a file. Without `with_materials` it is split by objects alone and no MTL file is opened.
pub(crate) fn read(path: &Path, with_materials: bool) -> Result<MeshFile, LoadError> {
    parse(&files::bytes(path)?, path, with_materials)
}

/// As [`read`] for the text of a file. MTL files are looked for beside `path`.
pub(crate) fn parse(
    bytes: &[u8],
    path: &Path,
    with_materials: bool,
) -> Result<MeshFile, LoadError> {
    // Names and comments in old encodings are no reason to refuse a mesh.
    let text = String::from_utf8_lossy(files::refuse_binary(bytes, path)?);
    let clean = lines::clean(&text, path, with_materials)?;
    let warnings = RefCell::new(clean.warnings);
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let folder = path.parent().unwrap_or(Path::new(""));
    let (models, materials) = tobj::load_obj_buf(&mut clean.text.as_bytes(), &options, |name| {
        mtl::read(&folder.join(name), &mut warnings.borrow_mut())
    })
    .map_err(|error| {
        // `lines` has looked for all that `tobj` refuses; should it miss something, this is it.
        LoadError::new(path, None, Problem::Format(format!("not a valid OBJ file: {error}")))
    })?;
    let mut obj = MeshFile { warnings: warnings.into_inner(), ..MeshFile::default() };
    let materials = materials.unwrap_or_default();
    let is_known = |name: &String| materials.iter().any(|material| material.name == *name);
    let unknown: Vec<_> = clean.used.into_iter().filter(|name| !is_known(name)).collect();
    if let [first, others @ ..] = &unknown[..] {
        let others = match others.len() {
            0 => String::new(),
            count => format!(" (and {count} more)"),
        };
        obj.warnings.push(format!(
            "{}: its MTL files have no material `{first}`{others}: such faces get the default one",
            path.display()
        ));
    }
    obj.materials = materials.iter().map(|one| mtl::material(one, &mut obj.warnings)).collect();
    for model in models.into_iter().filter(|model| !model.mesh.indices.is_empty()) {
        let material = model.mesh.material_id;
        obj.parts.push(Part { mesh: mesh(&model.mesh), material });
    }
    if obj.parts.is_empty() {
        let message = "has no faces: a mesh needs at least one `f` line".into();
        return Err(LoadError::new(path, None, Problem::Empty(message)));
    }
    Ok(obj)
}

fn mesh(from: &tobj::Mesh) -> Mesh {
    let points = |flat: &[f32]| flat.chunks_exact(3).map(Vec3::from_slice).collect::<Vec<_>>();
    Mesh {
        positions: points(&from.positions),
        indices: from.indices.chunks_exact(3).map(|of| [of[0], of[1], of[2]]).collect(),
        normals: points(&from.normals),
    }
}
