//! Spheres, quads and triangles among one another.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::patch::push_patch;
use crate::geometry::{Aabb, Mesh, Quads, Spheres};
use crate::workload::model::ground_under;
use crate::workload::random::Random;
use crate::workload::{Model, Part, Stage};

/// A field of about `objects` things on the ground: a third each heaps of four spheres, boxes of
/// six quads, and rings of 256 triangles.
pub fn mixed(objects: usize) -> Model {
    let side = ((objects as f32).sqrt().ceil() as usize).max(1);
    let (mut spheres, mut quads, mut mesh) =
        (Spheres::default(), Quads::default(), Mesh::default());
    let mut random = Random::new(3, 0);
    for index in 0..side * side {
        let at = |place: usize, random: &mut Random| {
            place as f32 - 0.5 * side as f32 + random.range(-0.2, 0.2)
        };
        let (x, z) = (at(index % side, &mut random), at(index / side, &mut random));
        match random.below(3) {
            0 => push_heap(&mut spheres, Vec3::new(x, 0.0, z), &mut random),
            1 => push_block(&mut quads, Vec3::new(x, 0.0, z), &mut random),
            _ => push_ring(&mut mesh, Vec3::new(x, 0.45, z), &mut random),
        }
    }
    let half = 0.5 * side as f32;
    let bounds = Aabb { min: Vec3::new(-half, 0.0, -half), max: Vec3::new(half, 0.1 * half, half) };
    let mut stage = Stage::framing(&bounds);
    stage.camera.eye = Vec3::new(0.15 * half, 0.35 * half, 1.1 * half);
    let ground = ground_under(&bounds);
    let parts =
        vec![Part::Mesh(mesh), Part::Spheres(spheres), Part::Quads(quads), Part::Quads(ground)];
    Model { name: "mixed".into(), parts, stage }
}

fn push_heap(spheres: &mut Spheres, at: Vec3, random: &mut Random) {
    for layer in 0..4 {
        let radius = random.range(0.1, 0.3);
        let aside = Vec3::new(random.range(-0.2, 0.2), 0.0, random.range(-0.2, 0.2));
        spheres.push(at + aside + Vec3::Y * (0.2 + 0.25 * layer as f32), radius);
    }
}

fn push_block(quads: &mut Quads, at: Vec3, random: &mut Random) {
    let turn = random.range(0.0, TAU);
    let (width, height) = (random.range(0.3, 0.7), random.range(0.3, 1.5));
    let right = Vec3::new(turn.cos(), 0.0, turn.sin()) * width;
    let back = Vec3::new(-turn.sin(), 0.0, turn.cos()) * width;
    let up = Vec3::Y * height;
    let corner = at - 0.5 * (right + back);
    for (corner, edge_u, edge_v) in [
        (corner, right, back),
        (corner + up, right, back),
        (corner, right, up),
        (corner + back, right, up),
        (corner, back, up),
        (corner + right, back, up),
    ] {
        quads.push(corner, edge_u, edge_v);
    }
}

fn push_ring(mesh: &mut Mesh, at: Vec3, random: &mut Random) {
    let axis = Vec3::new(random.range(-1.0, 1.0), random.range(0.1, 1.0), random.range(-1.0, 1.0));
    let axis = axis.normalize();
    let (right, forward) = axis.any_orthonormal_pair();
    let (large, small) = (random.range(0.25, 0.4), random.range(0.05, 0.12));
    push_patch(mesh, 16, 8, |u, v| {
        let (around, across) = (TAU * u, TAU * v + PI);
        let outward = right * around.cos() + forward * around.sin();
        at + outward * (large + small * across.cos()) + axis * (small * across.sin())
    });
}
