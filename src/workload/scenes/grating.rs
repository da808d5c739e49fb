//! A dense grating over a floor: a scene that is all in penumbra.

use glam::Vec3;

use super::patch::{push_box, push_patch};
use crate::geometry::Mesh;
use crate::scene::Camera;
use crate::workload::model::horizontal_light;
use crate::workload::{Model, Part, Stage};

/// The width of floor and grating.
const WIDTH: f32 = 20.0;
/// How high the grating is.
const HEIGHT: f32 = 3.0;

/// A floor below `bars` bars that cover half of it, across each other in two layers; each point of the
/// floor sees the light through dozens of them. Each bar has twelve long triangles.
pub fn grating(bars: usize) -> Model {
    let mut mesh = Mesh::default();
    push_patch(&mut mesh, 64, 64, |u, v| Vec3::new(WIDTH * (u - 0.5), 0.0, WIDTH * (0.5 - v)));
    let each_way = bars.div_ceil(2).max(1);
    let pitch = WIDTH / each_way as f32;
    for bar in 0..each_way {
        let at = pitch * bar as f32 - 0.5 * WIDTH;
        let wide = 0.3 * pitch;
        let along_x = Vec3::new(-0.5 * WIDTH, HEIGHT, at);
        push_box(&mut mesh, along_x, along_x + Vec3::new(WIDTH, wide, wide), 1);
        let along_z = Vec3::new(at, HEIGHT + pitch, -0.5 * WIDTH);
        push_box(&mut mesh, along_z, along_z + Vec3::new(wide, wide, WIDTH), 1);
    }
    let eye = Vec3::new(0.0, 2.5, 0.4 * WIDTH);
    let stage = Stage {
        camera: Camera { eye, target: Vec3::new(0.0, 0.0, 1.0), up: Vec3::Y, vertical_fov: 50.0 },
        light: horizontal_light(Vec3::new(1.0, 9.0, -1.0), 5.0),
        diagonal: 28.0,
    };
    Model { name: "grating".into(), parts: vec![Part::Mesh(mesh)], stage }
}
