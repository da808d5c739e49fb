//! Mesh files of all kinds: OBJ and PLY, told apart by their extension.

use std::path::Path;

use super::file::{LoadError, has_extension};
use super::{obj, ply};
use crate::geometry::Mesh;
use crate::scene::Material;

/// What a mesh file holds.
#[derive(Clone, Debug, Default)]
pub(crate) struct MeshFile {
    /// One mesh for each object and material that has faces, in the order of the file.
    pub(crate) parts: Vec<Part>,
    /// The materials that the file brings with it.
    pub(crate) materials: Vec<Material>,
    /// What is odd but not wrong, one line each.
    pub(crate) warnings: Vec<String>,
}

/// A mesh and which of the file's materials it has.
#[derive(Clone, Debug)]
pub(crate) struct Part {
    pub(crate) mesh: Mesh,
    pub(crate) material: Option<usize>,
}

impl MeshFile {
    /// One mesh without a material.
    pub(crate) fn of_mesh(mesh: Mesh) -> Self {
        Self { parts: vec![Part { mesh, material: None }], ..Self::default() }
    }
}

/// Reads a file. Without `with_materials` an OBJ is split by objects alone and no MTL file is
/// opened. None if the extension is not that of a mesh.
pub(crate) fn read(path: &Path, with_materials: bool) -> Option<Result<MeshFile, LoadError>> {
    if has_extension(path, "obj") {
        Some(obj::read(path, with_materials))
    } else if has_extension(path, "ply") {
        Some(ply::read(path))
    } else {
        None
    }
}
