//! A height field.

use glam::Vec3;

use super::patch::push_patch;
use crate::geometry::Mesh;
use crate::scene::Camera;
use crate::workload::model::horizontal_light;
use crate::workload::random::fractal_noise;
use crate::workload::{Model, Part, Stage};

/// Mountains of about `triangles` triangles, 100 units wide, seen from above one edge: many pixels
/// a triangle in front, many triangles a pixel towards the horizon.
pub fn terrain(triangles: usize) -> Model {
    let side = ((triangles as f32 / 2.0).sqrt().round() as usize).max(1);
    let mut mesh = Mesh::default();
    push_patch(&mut mesh, side, side, |u, v| {
        let (x, z) = (100.0 * u - 50.0, 50.0 - 100.0 * v);
        Vec3::new(x, height(x, z), z)
    });
    let eye = Vec3::new(4.0, height(4.0, 46.0) + 8.0, 46.0);
    let stage = Stage {
        camera: Camera { eye, target: Vec3::new(-6.0, 2.0, 0.0), up: Vec3::Y, vertical_fov: 50.0 },
        light: horizontal_light(Vec3::new(40.0, 60.0, -20.0), 20.0),
        diagonal: 140.0,
    };
    Model { name: "terrain".into(), parts: vec![Part::Mesh(mesh)], stage }
}

fn height(x: f32, z: f32) -> f32 {
    let at = Vec3::new(x * 0.045, 0.5, z * 0.045);
    let ridges = 1.0 - fractal_noise(at, 9, 11).abs() * 2.0;
    let hills = fractal_noise(at * 0.6, 4, 23);
    14.0 * (0.5 * ridges * ridges + 0.7 * hills)
}
