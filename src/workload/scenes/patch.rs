//! Surfaces of two parameters, made of triangles.

use glam::Vec3;

use crate::geometry::Mesh;

/// Appends a grid of `columns` x `rows` cells, two triangles each, to `mesh`. `at` gives the point
/// at (u, v), both from 0 to 1.
pub(super) fn push_patch(
    mesh: &mut Mesh,
    columns: usize,
    rows: usize,
    at: impl Fn(f32, f32) -> Vec3,
) {
    let first = mesh.positions.len() as u32;
    for row in 0..=rows {
        for column in 0..=columns {
            mesh.positions.push(at(column as f32 / columns as f32, row as f32 / rows as f32));
        }
    }
    let width = columns as u32 + 1;
    for row in 0..rows as u32 {
        for column in 0..columns as u32 {
            let corner = first + row * width + column;
            mesh.indices.push([corner, corner + 1, corner + width + 1]);
            mesh.indices.push([corner, corner + width + 1, corner + width]);
        }
    }
}

/// Appends a box with faces of `cells` x `cells` cells: long faces give long thin triangles.
pub(super) fn push_box(mesh: &mut Mesh, min: Vec3, max: Vec3, cells: usize) {
    let size = max - min;
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0.0, 1.0] {
            push_patch(mesh, cells, cells, |u, v| {
                let mut at = [0.0; 3];
                (at[axis], at[a], at[b]) = (side, u, v);
                min + size * Vec3::from(at)
            });
        }
    }
}
