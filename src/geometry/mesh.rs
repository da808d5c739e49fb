//! Indexed triangle meshes.

use glam::Vec3;

use crate::error::{BuildError, ShapeError};

/// An indexed triangle mesh with optional normals at the vertices.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Positions of the vertices.
    pub positions: Vec<Vec3>,
    /// The three vertices of each triangle, counted from 0.
    pub indices: Vec<[u32; 3]>,
    /// Shading normals, one a vertex, of any non-zero length; empty for flat triangles.
    pub normals: Vec<Vec3>,
}

impl Mesh {
    /// How many triangles there are.
    pub fn len(&self) -> usize {
        self.indices.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The corners of triangle `index`. Panics if it names a vertex that is not there.
    #[inline(always)]
    pub fn triangle(&self, index: usize) -> [Vec3; 3] {
        let [a, b, c] = self.indices[index];
        [self.positions[a as usize], self.positions[b as usize], self.positions[c as usize]]
    }

    /// # Errors
    /// [`BuildError`] for an index out of range, or for normals that are not one a vertex.
    /// Triangles without area or with a corner that is not finite are no error: the scene drops
    /// and counts them.
    pub fn validate(&self, geom_id: u32) -> Result<(), BuildError> {
        if !self.normals.is_empty() {
            ShapeError::check("normals", self.normals.len(), "positions", self.positions.len())?;
        }
        let vertices = self.positions.len();
        for (prim_id, triangle) in self.indices.iter().enumerate() {
            if let Some(&index) = triangle.iter().find(|&&index| index as usize >= vertices) {
                return Err(BuildError::Index {
                    geom_id,
                    prim_id: prim_id as u32,
                    index,
                    vertices,
                });
            }
        }
        Ok(())
    }
}
