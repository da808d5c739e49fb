//! Indexed triangle meshes.

use glam::Vec3;
use rayon::prelude::*;

use crate::error::{BuildError, ShapeError};

/// So many triangles are checked by a thread in a row.
const CHUNK: usize = 16_384;

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
        // Whether one is too large is asked of many at once: that takes no branches and all threads.
        let largest = |chunk: &[[u32; 3]]| chunk.as_flattened().iter().fold(0, |a, &b| a.max(b));
        let chunks = self.indices.par_chunks(CHUNK);
        let Some(chunk) = chunks.position_first(|chunk| largest(chunk) as usize >= vertices) else {
            return Ok(());
        };
        let first = 3 * CHUNK * chunk;
        let indices = self.indices.as_flattened()[first..].iter().zip(first..);
        let mut beyond = indices.filter(|&(&index, _)| index as usize >= vertices);
        let (&index, place) = beyond.next().expect("one in this chunk");
        Err(BuildError::Index { geom_id, prim_id: (place / 3) as u32, index, vertices })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_index_too_large_is_named() {
        let mut mesh = Mesh {
            positions: vec![Vec3::ZERO; 7],
            indices: vec![[0, 6, 3]; 3 * CHUNK],
            ..Mesh::default()
        };
        assert_eq!(mesh.validate(0), Ok(()));
        for (prim_id, triangle, index) in [
            (3 * CHUNK - 2, [0, 0, 7], 7),
            (CHUNK + 5, [1, 8, 7], 8),
            (CHUNK - 1, [u32::MAX; 3], u32::MAX),
        ] {
            mesh.indices[prim_id] = triangle;
            let prim_id = prim_id as u32;
            let error = BuildError::Index { geom_id: 4, prim_id, index, vertices: 7 };
            assert_eq!(mesh.validate(4), Err(error));
        }
    }
}
