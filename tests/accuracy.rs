//! How far hits are from those of doubles: of `t` and of the position, in epsilons of the floats.
//! Prints the table of `docs/accuracy.md`.

// Numbers to read with `--nocapture`.
#![allow(clippy::print_stdout)]

mod made;

use glam::{DVec3, Vec3};
use made::shapes::{Shape, Shapes};
use made::{Random, run};
use octray::{Quads, Ray};
use std::sync::Mutex;

const EPSILON: f64 = f32::EPSILON as f64;

/// One line of the table: how primitives and rays are made.
struct Case {
    name: &'static str,
    make: fn(&mut Random) -> (Shape, Ray),
    /// The largest errors that are allowed.
    bounds: [f64; 2],
}

fn triangle(random: &mut Random) -> [Vec3; 3] {
    loop {
        let corners = [random.vec(), random.vec(), random.vec()];
        let [a, b, c] = corners;
        if (b - a).cross(c - a).length() > 0.2 {
            return corners;
        }
    }
}

fn inside(random: &mut Random, [a, b, c]: [Vec3; 3]) -> Vec3 {
    let (u, v) = (0.05 + 0.4 * random.unit(), 0.05 + 0.4 * random.unit());
    a + (b - a) * u + (c - a) * v
}

/// A ray from `distance` away to `target`, at least `steep` between 0 and 1 off the plane.
fn towards(random: &mut Random, target: Vec3, normal: Vec3, distance: f32, steep: [f32; 2]) -> Ray {
    loop {
        let along = random.dir();
        let along = along - normal * along.dot(normal);
        let up = normal * (steep[0] + (steep[1] - steep[0]) * random.unit());
        if along.length() > 0.1 {
            let origin = target + (along.normalize() + up).normalize() * distance;
            return Ray::new(origin, target - origin);
        }
    }
}

fn facing(random: &mut Random, distance: f32, steep: [f32; 2]) -> (Shape, Ray) {
    let [a, b, c] = triangle(random);
    let target = inside(random, [a, b, c]);
    let normal = (b - a).cross(c - a).normalize();
    (Shape::Triangle([a, b, c]), towards(random, target, normal, distance, steep))
}

fn as_quad((shape, ray): (Shape, Ray)) -> (Shape, Ray) {
    match shape {
        Shape::Triangle([a, b, c]) => (Shape::Quad([a, b - a, c - a]), ray),
        other => (other, ray),
    }
}

/// A sphere whose ray passes `aside` radii beside its centre, from `distance` away.
fn sphere(random: &mut Random, radius: f32, distance: f32, aside: f32) -> (Shape, Ray) {
    let center = random.vec();
    let origin = center + random.dir() * distance;
    let to = (center - origin).normalize();
    let across = to.any_orthonormal_vector() * (aside * radius);
    (Shape::Sphere(center, radius), Ray::new(origin, center + across - origin))
}

const CASES: [Case; 11] = [
    Case {
        name: "triangle of size 1, near",
        make: |r| facing(r, 3.0, [0.5, 2.0]),
        bounds: [16.0, 16.0],
    },
    Case {
        name: "triangle of size 1, 1e+4 away",
        make: |r| facing(r, 1e4, [0.5, 2.0]),
        bounds: [16.0, 16.0],
    },
    Case {
        name: "triangle, grazing (1 in 100)",
        make: |r| facing(r, 3.0, [0.01, 0.02]),
        bounds: [400.0, 400.0],
    },
    Case {
        name: "quad, near",
        make: |r| as_quad(facing(r, 3.0, [0.5, 2.0])),
        bounds: [16.0, 16.0],
    },
    Case {
        name: "quad, 1e+4 away",
        make: |r| as_quad(facing(r, 1e4, [0.5, 2.0])),
        bounds: [16.0, 16.0],
    },
    Case {
        name: "quad, grazing (1 in 100)",
        make: |r| as_quad(facing(r, 3.0, [0.01, 0.02])),
        bounds: [400.0, 400.0],
    },
    Case {
        name: "sphere of radius 1, near",
        make: |r| {
            let aside = 0.9 * r.unit();
            sphere(r, 1.0, 3.0, aside)
        },
        bounds: [1.0, 1.0],
    },
    Case {
        name: "sphere of radius 1, 1e+4 away",
        make: |r| {
            let aside = 0.9 * r.unit();
            sphere(r, 1.0, 1e4, aside)
        },
        bounds: [1.0, 1.0],
    },
    Case {
        name: "sphere of radius 1e-4, 1e+4 away",
        make: |r| {
            let aside = 0.5 * r.unit();
            sphere(r, 1e-4, 1e4, aside)
        },
        bounds: [1.0, 1.0],
    },
    Case {
        name: "sphere, grazing (0.9999 radii)",
        make: |r| sphere(r, 1.0, 3.0, 0.9999),
        bounds: [1.0, 1.0],
    },
    Case {
        name: "sphere, from inside",
        make: |r| {
            let (at, aside) = (0.9 * r.unit() + 0.05, 0.1 * r.unit());
            sphere(r, 1.0, at, aside)
        },
        bounds: [1.0, 1.0],
    },
];

/// Where doubles meet the shape: `t`.
fn exact(shape: &Shape, ray: &Ray) -> Option<f64> {
    let (origin, dir) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let plane = |[a, b, c]: [Vec3; 3]| {
        let [a, b, c] = [a, b, c].map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a);
        (a - origin).dot(normal) / dir.dot(normal)
    };
    match *shape {
        Shape::Triangle(corners) => Some(plane(corners)),
        Shape::Quad([corner, u, v]) => {
            // Of the half that is met: its corners are rounded, so both planes differ a little.
            let [a, b, c, d] = Quads::one(corner, u, v).corners(0);
            let at = origin + dir * plane([a, b, c]) - a.as_dvec3();
            let (u, v) = (u.as_dvec3(), v.as_dvec3());
            let normal = u.cross(v);
            let first = at.cross(v).dot(normal) >= u.cross(at).dot(normal);
            Some(if first { plane([a, b, c]) } else { plane([a, c, d]) })
        }
        Shape::Sphere(center, radius) => {
            let from: DVec3 = origin - center.as_dvec3();
            let (a, b) = (dir.length_squared(), from.dot(dir));
            let next = from - dir * (b / a);
            let rest = f64::from(radius).powi(2) - next.length_squared();
            let root = (rest / a).sqrt();
            [-b / a - root, -b / a + root].into_iter().find(|&t| t >= 0.0)
        }
    }
}

#[test]
fn hits_are_within_epsilons_of_doubles() {
    let table = Mutex::new([[0.0_f64; 3]; CASES.len()]);
    let tried = run("accuracy", 71, 11 * 100, |random, number| {
        let place = number % CASES.len();
        let mut worst = [0.0_f64; 3];
        let mut tried = 0;
        for _ in 0..1000 {
            let (shape, ray) = (CASES[place].make)(random);
            let scene = Shapes(vec![shape]).build();
            let (Some(hit), Some(t)) = (scene.intersect(&ray), exact(&shape, &ray)) else {
                continue;
            };
            tried += 1;
            let surface = scene.surface(&ray, &hit);
            let at = ray.origin.as_dvec3() + ray.dir.as_dvec3() * t;
            // The position is compared with the surface, not with the point of the ray: along the
            // surface it moves as the ray's own floats do.
            let off = match shape {
                Shape::Sphere(center, radius) => {
                    let from = surface.position.as_dvec3() - center.as_dvec3();
                    (from.length() - f64::from(radius)).abs()
                }
                _ => {
                    let normal = surface.geometric_normal.as_dvec3();
                    (surface.position.as_dvec3() - at).dot(normal).abs()
                }
            };
            let size = surface.position.abs().max_element().max(1.0);
            worst[0] = worst[0].max((f64::from(hit.t) - t).abs() / t / EPSILON);
            worst[1] = worst[1].max(off / f64::from(size) / EPSILON);
            worst[2] = worst[2].max((f64::from(hit.t) - t).abs() * f64::from(ray.dir.length()));
        }
        let mut table = table.lock().unwrap();
        for (all, one) in table[place].iter_mut().zip(worst) {
            *all = all.max(one);
        }
        tried
    });
    println!(
        "| case | error of t, epsilons of t | position off the surface, epsilons | error of t as a length |"
    );
    println!("|---|---|---|---|");
    let table = table.into_inner().unwrap();
    for (case, [t, off, length]) in CASES.iter().zip(table) {
        println!("| {} | {t:.2} | {off:.2} | {length:.1e} |", case.name);
    }
    for (case, [t, off, _]) in CASES.iter().zip(table) {
        assert!(t <= case.bounds[0] && off <= case.bounds[1], "{}: {t} and {off}", case.name);
    }
    assert!(tried > 900_000, "only {tried} hits");
}
