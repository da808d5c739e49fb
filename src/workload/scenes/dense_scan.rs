//! A body of small triangles, as a scanner would give it.

use glam::Vec3;

use super::patch::push_patch;
use crate::geometry::Mesh;
use crate::scene::Camera;
use crate::workload::random::fractal_noise;
use crate::workload::{Model, Part, Stage};

/// A rough closed body of about `triangles` triangles of nearly one size that fills the view: at a
/// million triangles and a megapixel there is a front triangle for every second pixel.
pub fn dense_scan(triangles: usize) -> Model {
    let side = ((triangles as f32 / 12.0).sqrt().round() as usize).max(1);
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for face in [-1.0, 1.0] {
            push_patch(&mut mesh, side, side, |u, v| {
                // The angles grow evenly, so that the triangles at the corners are not smaller.
                let along = |at: f32| (std::f32::consts::FRAC_PI_4 * (2.0 * at - 1.0)).tan();
                let mut cube = [0.0; 3];
                cube[axis] = face;
                // Where two faces meet both give exactly the same points.
                cube[(axis + 1) % 3] = if u == 0.0 || u == 1.0 { 2.0 * u - 1.0 } else { along(u) };
                cube[(axis + 2) % 3] = if v == 0.0 || v == 1.0 { 2.0 * v - 1.0 } else { along(v) };
                surface(Vec3::from(cube))
            });
        }
    }
    let bounds = crate::geometry::Aabb::of_points(&mesh.positions);
    let eye = Vec3::new(0.35, 0.35, 1.0).normalize() * 4.2;
    let camera = Camera { eye, target: Vec3::ZERO, up: Vec3::Y, vertical_fov: 24.0 };
    let stage = Stage { camera, ..Stage::framing(&bounds) };
    Model { name: "dense".into(), parts: vec![Part::Mesh(mesh)], stage }
}

/// The point of the body in this direction.
fn surface(cube: Vec3) -> Vec3 {
    // The longest part is exactly 1; squares are summed in order of size, so that the length does
    // not depend on the face.
    let mut squares = [cube.x * cube.x, cube.y * cube.y, cube.z * cube.z];
    squares.sort_by(f32::total_cmp);
    let on_sphere = cube / (squares[0] + squares[1] + squares[2]).sqrt();
    let folds = fractal_noise(on_sphere * 2.5, 3, 5).abs();
    let grain = fractal_noise(on_sphere * 20.0, 4, 7);
    on_sphere * (1.0 + 0.4 * folds + 0.012 * grain)
}
