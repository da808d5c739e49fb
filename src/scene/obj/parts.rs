//! The triangles of a file to meshes: one for each object and material, with the vertices that it
//! uses in the order of their first use. Two corners are one vertex if they have the same position
//! and the same normal.

use std::collections::HashMap;

use glam::Vec3;

use crate::geometry::Mesh;
use crate::scene::mesh_file::Part;

const NONE: u32 = u32::MAX;

/// A position and a normal, both counted from 0; a normal may be [`NO_NORMAL`].
pub(super) type Corner = (u32, u32);

/// Stands for the normal of a corner that has none.
pub(super) const NO_NORMAL: u32 = NONE;

/// Makes meshes.
pub(super) struct Parts {
    pub(super) positions: Vec<Vec3>,
    pub(super) normals: Vec<Vec3>,
    mesh: Mesh,
    /// The vertex of the mesh that was the first with each position.
    first: Vec<u32>,
    /// Position and normal of each vertex of the mesh.
    corners: Vec<Corner>,
    /// The vertices whose position had another normal before.
    others: HashMap<Corner, u32>,
    done: Vec<Part>,
}

impl Parts {
    /// For that many faces.
    pub(super) fn new(positions: Vec<Vec3>, normals: Vec<Vec3>, faces: usize) -> Self {
        let first = vec![NONE; positions.len()];
        // Most files have one part; what it has no use for is given back at its end.
        let mesh = Mesh {
            positions: Vec::with_capacity(positions.len()),
            indices: Vec::with_capacity(faces),
            normals: Vec::new(),
        };
        let corners = Vec::with_capacity(positions.len());
        let others = HashMap::new();
        Self { positions, normals, mesh, first, corners, others, done: Vec::new() }
    }

    /// Adds a triangle to the part.
    #[inline]
    pub(super) fn triangle(&mut self, corners: [Corner; 3]) {
        let triangle = corners.map(|corner| self.vertex(corner));
        self.mesh.indices.push(triangle);
    }

    #[inline]
    fn vertex(&mut self, corner: Corner) -> u32 {
        let first = self.first[corner.0 as usize];
        if first == NONE {
            let new = self.add(corner);
            self.first[corner.0 as usize] = new;
            return new;
        }
        if self.corners[first as usize] == corner {
            return first;
        }
        if let Some(&other) = self.others.get(&corner) {
            return other;
        }
        let new = self.add(corner);
        self.others.insert(corner, new);
        new
    }

    fn add(&mut self, corner: Corner) -> u32 {
        let (position, normal) = corner;
        self.mesh.positions.push(self.positions[position as usize]);
        if !self.normals.is_empty() {
            // No direction: the surface takes its own.
            let normal = self.normals.get(normal as usize).copied().unwrap_or(Vec3::ZERO);
            self.mesh.normals.push(normal);
        }
        self.corners.push(corner);
        self.corners.len() as u32 - 1
    }

    /// Ends a part; one without triangles is none.
    pub(super) fn end(&mut self, material: Option<usize>) {
        let mut mesh = std::mem::take(&mut self.mesh);
        if mesh.is_empty() {
            self.mesh = mesh;
            return;
        }
        mesh.positions.shrink_to_fit();
        mesh.indices.shrink_to_fit();
        mesh.normals.shrink_to_fit();
        self.done.push(Part { mesh, material });
        for (position, _) in self.corners.drain(..) {
            self.first[position as usize] = NONE;
        }
        if !self.others.is_empty() {
            self.others = HashMap::new();
        }
    }

    /// All parts in the order of the file.
    pub(super) fn finish(self) -> Vec<Part> {
        self.done
    }
}
