//! Made rays: coherent and not, aimed at what is hard.

use glam::Vec3;
use octray::{Ray, RayBatch};

use super::{Random, Shapes};

/// The kinds of batches.
pub const RAY_KINDS: usize = 8;

/// A batch of `count` rays for `shapes`; `kind` says which.
pub fn rays(random: &mut Random, shapes: &Shapes, kind: usize, count: usize) -> RayBatch {
    let size = shapes.size();
    let eye = random.vec() * size * random.pick(&[1.0, 3.0, 100.0, 1e5]);
    let target = shapes.point(random);
    let narrow = (target - eye) * 0.01;
    (0..count)
        .map(|_| {
            let mut ray = match kind {
                // From one point, close together: a tile.
                0 => Ray::new(eye, target - eye + random.vec() * narrow.length()),
                // From neighbouring points to one: shadows.
                1 => {
                    let from = eye + random.vec() * narrow;
                    Ray { t_max: 1.0, ..Ray::new(from, target - from) }
                }
                // From anywhere to a point of a primitive.
                2 => aimed(random.vec() * size * 1.5, shapes.point(random)),
                // From far away to a point of a primitive.
                3 => aimed(random.dir() * size * random.scale(1, 6), shapes.point(random)),
                // In the plane of a primitive.
                4 => {
                    let (from, to) = shapes.plane_points(random);
                    aimed(from, to)
                }
                // From a point of a primitive to another one.
                5 => aimed(shapes.point(random), shapes.point(random)),
                // Along an axis, through a point of a primitive.
                6 => {
                    let axis = random.below(3);
                    let mut dir = Vec3::splat(random.pick(&[0.0, -0.0]));
                    dir[axis] = random.pick(&[1.0, -1.0, 0.7]);
                    let back = dir * size * random.pick(&[0.0, 1.0, 2.0]);
                    Ray::new(shapes.point(random) - back, dir)
                }
                // Anything, valid or not.
                _ => Ray {
                    origin: Vec3::new(random.bits(), random.bits(), random.bits()),
                    dir: Vec3::new(random.bits(), random.bits(), random.bits()),
                    t_min: random.bits(),
                    t_max: random.bits(),
                },
            };
            if kind > 1 && kind < 7 {
                vary(random, &mut ray);
            }
            ray
        })
        .collect()
}

fn aimed(from: Vec3, to: Vec3) -> Ray {
    Ray::new(from, to - from)
}

/// Directions of any length, ranges that begin behind the origin or end before the primitive.
fn vary(random: &mut Random, ray: &mut Ray) {
    if random.once_in(4) {
        ray.dir *= random.scale(-45, 15);
    }
    if random.once_in(8) {
        let length = ray.dir.length();
        let reach = if length > 0.0 { 1.0 / length } else { 1.0 };
        ray.t_min = reach * random.pick(&[-1e3, -1.0, 0.5, f32::NEG_INFINITY]);
        ray.t_max = random.pick(&[reach, 1.0, f32::INFINITY]);
    }
}
