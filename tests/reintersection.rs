//! A ray that leaves a surface from [`Surface::offset_origin`] does not meet it again: pbrt's test,
//! for each kind of primitive, from 1e-8 to 1e+8.

mod made;

use glam::Vec3;
use made::shapes::{Shape, Shapes};
use made::{Random, run};
use octray::{Ray, Scene};

/// A number of random sign whose magnitude is anything from 1e-8 to 1e+8.
fn any_scale(random: &mut Random) -> f32 {
    random.scale(-8, 8) * random.pick(&[1.0, -1.0])
}

fn any_point(random: &mut Random) -> Vec3 {
    Vec3::new(any_scale(random), any_scale(random), any_scale(random))
}

/// A ray from somewhere to a point of the scene's only primitive, and what it hits.
fn arrival(random: &mut Random, shapes: &Shapes, scene: &Scene) -> Option<(Ray, octray::Hit)> {
    let origin = any_point(random);
    let ray = Ray::new(origin, shapes.point(random) - origin);
    scene.intersect(&ray).map(|hit| (ray, hit))
}

/// Leaves the surface in 100 directions on both sides; `is_self` tells a hit that must not be.
fn leave(
    random: &mut Random,
    scene: &Scene,
    (ray, hit): (Ray, octray::Hit),
    is_self: impl Fn(&Ray, Vec3, f32) -> bool,
) -> u64 {
    let surface = scene.surface(&ray, &hit);
    for place in 0..100 {
        let mut dir = random.dir();
        if place % 4 == 0 {
            // Almost along the surface.
            let normal = surface.geometric_normal;
            dir = (dir - normal * dir.dot(normal) * 0.999_9).normalize();
        }
        let away = Ray::new(surface.offset_origin(dir), dir);
        if let Some(again) = scene.intersect(&away) {
            let is_self = is_self(&away, surface.geometric_normal, again.t);
            assert!(!is_self, "{away:?} meets again at {again:?} after {ray:?} at {hit:?}");
        } else {
            assert!(!scene.occluded(&away));
        }
    }
    100
}

fn one(shape: Shape) -> (Shapes, Scene) {
    let shapes = Shapes(vec![shape]);
    let scene = shapes.build();
    (shapes, scene)
}

#[test]
fn triangles_are_not_met_again() {
    let tried = run("triangles", 61, 100_000, |random, _| {
        let shape = Shape::Triangle([any_point(random), any_point(random), any_point(random)]);
        let (shapes, scene) = one(shape);
        let Some(arrival) = arrival(random, &shapes, &scene) else { return 0 };
        leave(random, &scene, arrival, |_, _, _| true)
    });
    assert!(tried > 1_000_000, "only {tried} rays");
}

#[test]
fn quads_are_not_met_again() {
    let tried = run("quads", 62, 100_000, |random, _| {
        let mut shapes = Shapes::default();
        let [corner, edge_u, edge_v] = [0; 3].map(|_| any_point(random));
        shapes.quad(corner, edge_u, edge_v);
        let scene = shapes.build();
        // A quad narrower than some steps of its corners' coordinates is not flat: they are rounded.
        let area = edge_u.as_dvec3().cross(edge_v.as_dvec3()).length();
        let width = area / f64::from(edge_u.length().max(edge_v.length()));
        let largest = (corner.abs() + edge_u.abs() + edge_v.abs()).max_element();
        if width < 64.0 * f64::from(f32::EPSILON * largest) {
            return 0;
        }
        let Some(arrival) = arrival(random, &shapes, &scene) else { return 0 };
        leave(random, &scene, arrival, |_, _, _| true)
    });
    assert!(tried > 1_000_000, "only {tried} rays");
}

/// Outwards nothing is met; inwards the other side is, at the length of the chord.
#[test]
fn spheres_are_not_met_again() {
    let tried = run("spheres", 63, 100_000, |random, _| {
        let (center, radius) = (any_point(random), random.scale(-8, 8));
        let (shapes, scene) = one(Shape::Sphere(center, radius));
        let Some(arrival) = arrival(random, &shapes, &scene) else { return 0 };
        // A sphere smaller than the steps of its centre's coordinates has no surface to stand on.
        if radius < 1e-4 * center.abs().max_element() {
            return 0;
        }
        leave(random, &scene, arrival, |ray, normal, t| {
            let inwards = -ray.dir.dot(normal);
            let chord = 2.0 * inwards * radius;
            inwards <= 0.0 || (inwards > 0.05 && t < 0.9 * chord)
        })
    });
    assert!(tried > 1_000_000, "only {tried} rays");
}
