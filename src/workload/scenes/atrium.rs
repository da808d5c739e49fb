//! A hall with two storeys of arcades around it, seen from inside.

use std::f32::consts::{PI, TAU};

use glam::Vec3;

use super::patch::{push_box, push_patch};
use crate::geometry::Mesh;
use crate::scene::Camera;
use crate::workload::model::horizontal_light;
use crate::workload::random::fractal_noise;
use crate::workload::{Model, Part, Stage};

/// Half the length of the hall.
const LENGTH: f32 = 20.0;
/// How far from the middle the columns stand, and how far the outer walls.
const COLUMNS_AT: f32 = 5.0;
const WALLS_AT: f32 = 9.0;
const STOREY: f32 = 6.0;
/// From column to column.
const BAY: f32 = 4.0;

/// A hall of about 250,000 triangles: fluted columns and arches of small triangles, outer walls and
/// beams of long thin ones, an open roof, curtains. Camera and light are inside.
pub fn atrium() -> Model {
    let mut mesh = Mesh::default();
    push_shell(&mut mesh);
    for storey in 0..2 {
        let floor = STOREY * storey as f32;
        for side in [-1.0, 1.0] {
            let bays = (2.0 * LENGTH / BAY) as usize;
            for bay in 0..=bays {
                let z = BAY * bay as f32 - LENGTH;
                push_column(&mut mesh, Vec3::new(side * COLUMNS_AT, floor, z));
                if bay < bays {
                    push_arch(&mut mesh, Vec3::new(side * COLUMNS_AT, floor + 4.0, z + 0.5 * BAY));
                    push_balustrade(&mut mesh, Vec3::new(side * COLUMNS_AT, floor, z), storey);
                }
                if bay % 2 == 1 && storey == 1 {
                    push_curtain(&mut mesh, Vec3::new(side * (COLUMNS_AT - 0.4), floor, z));
                }
            }
        }
    }
    let eye = Vec3::new(-1.5, 3.2, 0.85 * LENGTH);
    let stage = Stage {
        camera: Camera { eye, target: Vec3::new(1.0, 4.6, 0.0), up: Vec3::Y, vertical_fov: 60.0 },
        light: horizontal_light(Vec3::new(1.0, 2.0 * STOREY + 2.0, -4.0), 5.0),
        diagonal: 45.0,
    };
    Model { name: "atrium".into(), parts: vec![Part::Mesh(mesh)], stage }
}

/// Floor, outer walls of upright slats, galleries and the beams under them.
fn push_shell(mesh: &mut Mesh) {
    push_patch(mesh, 40, 80, |u, v| {
        let (x, z) = (WALLS_AT * (2.0 * u - 1.0), LENGTH * (2.0 * v - 1.0));
        Vec3::new(x, 0.01 * fractal_noise(Vec3::new(x, 0.0, z), 2, 31), z)
    });
    let top = 2.0 * STOREY;
    for side in [-1.0, 1.0] {
        // One cell high and 400 long: slivers of 12 x 0.1.
        push_patch(mesh, 400, 1, |u, v| {
            let relief = 0.05 * (TAU * 100.0 * u).sin();
            Vec3::new(side * (WALLS_AT + relief), top * v, LENGTH * (2.0 * u - 1.0))
        });
        push_patch(mesh, 180, 1, |u, v| {
            let relief = 0.05 * (TAU * 45.0 * u).sin();
            Vec3::new(WALLS_AT * (2.0 * u - 1.0), top * v, side * (LENGTH + relief))
        });
        for storey in [1.0, 2.0] {
            let (inner, outer) = (side * (COLUMNS_AT - 0.3), side * WALLS_AT);
            let floor = STOREY * storey;
            let min = Vec3::new(inner.min(outer), floor - 0.3, -LENGTH);
            push_box(mesh, min, Vec3::new(inner.max(outer), floor, LENGTH), 12);
            for beam in 0..80 {
                let z = LENGTH * (beam as f32 / 40.0 - 1.0) + 0.2;
                let min = Vec3::new(inner.min(outer), floor - 0.5, z);
                push_box(mesh, min, Vec3::new(inner.max(outer), floor - 0.3, z + 0.08), 1);
            }
        }
    }
}

/// A fluted shaft between a square base and a round capital.
fn push_column(mesh: &mut Mesh, foot: Vec3) {
    let half = Vec3::new(0.45, 0.0, 0.45);
    push_box(mesh, foot - half, foot + half + Vec3::Y * 0.3, 2);
    push_patch(mesh, 64, 12, |u, v| {
        let angle = TAU * u;
        let radius = 0.32 - 0.06 * v + 0.012 * (16.0 * angle).cos();
        foot + Vec3::new(radius * angle.cos(), 0.3 + 3.2 * v, radius * angle.sin())
    });
    push_patch(mesh, 32, 12, |u, v| {
        let angle = TAU * u;
        let radius = 0.26 + 0.2 * v * v + 0.03 * (TAU * 2.0 * v).sin();
        foot + Vec3::new(radius * angle.cos(), 3.5 + 0.5 * v, radius * angle.sin())
    });
}

/// A half ring with moulded sides from column to column, its feet at the height of `middle`.
fn push_arch(mesh: &mut Mesh, middle: Vec3) {
    push_patch(mesh, 48, 12, |u, v| {
        let (around, across) = (PI * u, TAU * v);
        let radius = 0.5 * BAY - 0.25 + 0.2 * across.cos() + 0.03 * (4.0 * across).cos();
        let sideways = 0.35 * across.sin();
        middle + Vec3::new(sideways, radius * around.sin() * 0.8, radius * around.cos())
    });
}

/// A rail over turned posts on the gallery; a bench in the lower storey.
fn push_balustrade(mesh: &mut Mesh, start: Vec3, storey: usize) {
    if storey == 0 {
        let min = start + Vec3::new(-0.2, 0.4, 0.6);
        push_box(mesh, min, min + Vec3::new(0.4, 0.06, BAY - 1.2), 1);
        return;
    }
    let min = start + Vec3::new(-0.08, 1.0, 0.3);
    push_box(mesh, min, min + Vec3::new(0.16, 0.08, BAY - 0.6), 1);
    for post in 0..12 {
        let foot = start + Vec3::new(0.0, 0.0, 0.5 + 0.28 * post as f32);
        push_patch(mesh, 12, 12, |u, v| {
            let angle = TAU * u;
            let radius = 0.05 + 0.03 * (TAU * v).sin();
            foot + Vec3::new(radius * angle.cos(), v, radius * angle.sin())
        });
    }
}

/// A cloth in folds that hangs from the upper arches.
fn push_curtain(mesh: &mut Mesh, foot: Vec3) {
    push_patch(mesh, 60, 40, |u, v| {
        let fold = 0.25 * (TAU * 5.0 * u).sin() * (1.0 - 0.6 * v);
        let sway = 0.3 * fractal_noise(Vec3::new(u * 3.0, v * 3.0, foot.z), 3, 41);
        foot + Vec3::new(fold + sway * (1.0 - v), 1.5 + 2.5 * v, (u - 0.5) * 2.4)
    });
}
