//! Spheres on spheres (after Eric Haines' "sphereflake", 1987).

use std::collections::VecDeque;
use std::f32::consts::TAU;

use glam::Vec3;

use crate::geometry::{Aabb, Spheres};
use crate::workload::model::ground_under;
use crate::workload::{Model, Part, Stage};

/// The first `count` spheres of a sphereflake on its ground quad: nine spheres of a third of the
/// radius sit on each sphere, larger ones first.
pub fn sphereflake(count: usize) -> Model {
    let mut spheres = Spheres::default();
    let mut bounds = Aabb::EMPTY;
    let mut waiting = VecDeque::from([(Vec3::ZERO, 1.0_f32, Vec3::Y)]);
    while spheres.len() < count
        && let Some((center, radius, axis)) = waiting.pop_front()
    {
        spheres.push(center, radius);
        bounds = bounds.union(spheres.bounds(spheres.len() - 1));
        let small = radius / 3.0;
        let (right, forward) = axis.any_orthonormal_pair();
        let mut sit = |turn: f32, lift: f32| {
            let flat = right * turn.cos() + forward * turn.sin();
            let dir = (flat * lift.cos() + axis * lift.sin()).normalize();
            waiting.push_back((center + dir * (radius + small), small, dir));
        };
        (0..6).for_each(|step| sit(TAU * step as f32 / 6.0, 0.0));
        (0..3).for_each(|step| sit(TAU * (step as f32 + 0.25) / 3.0, 1.0));
    }
    let ground = ground_under(&bounds);
    let parts = vec![Part::Spheres(spheres), Part::Quads(ground)];
    let mut stage = Stage::framing(&bounds);
    // Nearer than a mesh: the flake's box is mostly empty.
    let away = stage.camera.eye - stage.camera.target;
    stage.camera.eye = stage.camera.target + away * 0.7;
    Model { name: "sphereflake".into(), parts, stage }
}
