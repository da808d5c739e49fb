//! Rays at the edges of what is defined: along axes, planes and faces, ranges that end at the hit,
//! directions of any length, NaN, infinity, denormals. After the list of Embree's own tests.

mod made;

use glam::Vec3;
use made::{CHAOS_KINDS, RAY_KINDS, Random, Shapes, chaos, rays, run};
use octray::{Hit, HitBatch, HitPacket, Ray, RayBatch, RayPacket, Scene};

const TINY: f32 = f32::from_bits(1);

/// The hit of `ray` on every path, all of which agree with the reference.
fn hit(scene: &Scene, ray: &Ray) -> Option<Hit> {
    let expected = scene.intersect_reference(ray);
    let batch: RayBatch = std::iter::repeat_n(*ray, 19).collect();
    let mut hits = HitBatch::new(batch.len());
    let mut occluded = vec![false; batch.len()];
    scene.intersect_batch(batch.as_rays(), hits.as_hits()).unwrap();
    scene.occluded_batch(batch.as_rays(), &mut occluded).unwrap();
    let packet = RayPacket::new(&[*ray; 8]);
    let mut packet_hits = HitPacket::MISS;
    scene.intersect_packet(&packet, 0xff, &mut packet_hits);
    assert_eq!(scene.intersect(ray), expected, "single {ray:?}");
    assert_eq!(scene.occluded(ray), expected.is_some(), "{ray:?}");
    for (index, &occluded) in occluded.iter().enumerate() {
        assert_eq!(hits.get(index), expected.unwrap_or(Hit::MISS), "batch {ray:?}");
        assert_eq!(occluded, expected.is_some(), "batch {ray:?}");
    }
    assert_eq!(packet_hits.get(3), expected.unwrap_or(Hit::MISS), "packet {ray:?}");
    let bits = scene.occluded_packet(&packet, 0xff);
    assert_eq!(bits, if expected.is_some() { 0xff } else { 0 }, "packet {ray:?}");
    expected
}

/// One scene for each kind of primitive in the plane `z = 0` (the sphere touches it from behind),
/// and one primitive far away so that the tree has two leaves or more.
fn facing() -> [Scene; 3] {
    let mut shapes = [Shapes::default(), Shapes::default(), Shapes::default()];
    shapes[0].triangle([Vec3::new(-4.0, -4.0, 0.0), Vec3::new(4.0, -4.0, 0.0), Vec3::Y * 4.0]);
    shapes[1].quad(Vec3::new(-2.0, -2.0, 0.0), Vec3::X * 4.0, Vec3::Y * 4.0);
    shapes[2].sphere(Vec3::new(0.0, 0.0, 1.0), 1.0);
    shapes.map(|mut shapes| {
        for place in 0..20 {
            shapes.sphere(Vec3::new(100.0 + place as f32, 0.0, 0.0), 0.25);
        }
        shapes.build()
    })
}

/// An axis-aligned box from -1 to 1, of triangles or of quads.
fn cube(of_quads: bool) -> Scene {
    let mut shapes = Shapes::default();
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let (mut corner, mut u, mut v) = (Vec3::NEG_ONE, Vec3::ZERO, Vec3::ZERO);
            corner[axis] = side;
            u[(axis + 1) % 3] = 2.0;
            v[(axis + 2) % 3] = 2.0;
            if of_quads {
                shapes.quad(corner, u, v);
            } else {
                shapes.triangle([corner, corner + u, corner + u + v]);
                shapes.triangle([corner, corner + u + v, corner + v]);
            }
        }
    }
    shapes.build()
}

#[test]
fn axis_parallel_rays_with_zeros_of_either_sign() {
    let scenes = [cube(false), cube(true)];
    for axis in 0..3 {
        for zero in [0.0, -0.0] {
            for forward in [1.0, -1.0, 3.0, -0.25] {
                let mut dir = Vec3::splat(zero);
                dir[axis] = forward;
                let origin = -2.0 * dir / forward.abs();
                for scene in &scenes {
                    let found = hit(scene, &Ray::new(origin, dir)).expect("the cube is in the way");
                    assert_eq!(found.t, 1.0 / forward.abs());
                    assert_eq!(hit(scene, &Ray::new(origin, -dir)), None, "away from the cube");
                }
            }
        }
    }
}

/// A ray in the plane of a triangle or a quad sees no area of it, in whatever direction it runs.
#[test]
fn rays_in_the_plane_of_a_primitive_miss_it() {
    let [triangle, quad, _] = facing();
    for scene in [triangle, quad] {
        for dir in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::new(1.0, 2.0, 0.0)] {
            for back in [-8.0, 0.0] {
                let ray = Ray { t_max: 20.0, ..Ray::new(dir * back, dir) };
                assert_eq!(hit(&scene, &ray), None, "{ray:?}");
            }
        }
    }
}

/// Along a face of a box, the faces across the ray's way are met at their edge.
#[test]
fn rays_along_the_faces_of_a_box_meet_its_sides() {
    for scene in [cube(false), cube(true)] {
        for axis in 0..3 {
            for (first, second) in [(1.0, 0.3), (-1.0, 0.3), (0.3, 1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let mut origin = Vec3::ZERO;
                origin[axis] = -3.0;
                origin[(axis + 1) % 3] = first;
                origin[(axis + 2) % 3] = second;
                let mut dir = Vec3::ZERO;
                dir[axis] = 1.0;
                let found = hit(&scene, &Ray::new(origin, dir)).expect("faces own their edges");
                assert_eq!(found.t, 2.0);
            }
        }
    }
}

#[test]
fn origins_on_the_surface_are_at_t_zero() {
    for scene in &facing() {
        for dir in [Vec3::Z, Vec3::NEG_Z, Vec3::new(0.25, 0.5, 1.0), Vec3::new(1.0, 0.0, -0.5)] {
            assert_eq!(hit(scene, &Ray::new(Vec3::ZERO, dir)).expect("on the surface").t, 0.0);
            let after = Ray { t_min: f32::MIN_POSITIVE, ..Ray::new(Vec3::ZERO, dir) };
            let next = hit(scene, &after);
            assert!(next.is_none_or(|next| next.t > 0.1), "{next:?} after the surface");
        }
    }
}

/// Both ends of the range belong to it, to the last bit; for directions of any length.
#[test]
fn ranges_include_their_ends() {
    run("ranges", 21, 30_000, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 6);
        let scene = shapes.build();
        let batch = rays(random, &shapes, number / CHAOS_KINDS % RAY_KINDS, 16);
        let mut tried = 0;
        for index in 0..batch.len() {
            let ray = batch.as_rays().get(index);
            let Some(found) = scene.intersect(&ray).filter(|found| found.t.abs() > 1e-30) else {
                continue;
            };
            // Directions of denormals, or of the largest floats, scale `t` out of its own range.
            let length = ray.dir.abs().max_element();
            if !(1e-30..1e30).contains(&length) || found.t.abs() * length < 1e-30 {
                continue;
            }
            let at = Ray { t_min: found.t, t_max: found.t, ..ray };
            assert_eq!(hit(&scene, &at), Some(found), "from t to t: {ray:?}");
            let before = Ray { t_max: found.t.next_down(), ..ray };
            assert_eq!(hit(&scene, &before), None, "before t: {ray:?}");
            let after = Ray { t_min: found.t.next_up(), ..ray };
            assert!(hit(&scene, &after).is_none_or(|next| next.t > found.t), "after t: {ray:?}");
            tried += 3;
        }
        tried
    });
}

/// A direction times a power of two meets the same primitive, `t` divided by it exactly; times
/// another factor, at that `t` within rounding.
#[test]
fn directions_of_any_length() {
    for scene in &facing() {
        let origin = Vec3::new(0.1, 0.2, -3.0);
        let unit = Ray::new(origin, Vec3::new(0.01, -0.02, 1.0));
        let expected = hit(scene, &unit).expect("in front");
        for power in -66..=66 {
            let length = 2_f32.powi(power);
            let ray = Ray { dir: unit.dir * length, ..unit };
            let found = hit(scene, &ray).expect("the same way");
            assert_eq!(Hit { t: found.t * length, ..found }, expected);
            for factor in [1e-20, 3e-7, 1.1, 7e5, 1e20] {
                let ray = Ray { dir: unit.dir * factor, ..unit };
                let found = hit(scene, &ray).expect("the same way");
                assert_eq!(found.prim_id, expected.prim_id);
                assert!((found.t * factor / expected.t - 1.0).abs() < 1e-6, "{found:?}");
            }
        }
    }
}

/// Directions and coordinates of denormals are numbers like others.
#[test]
fn denormals() {
    for scene in &facing() {
        for dir in [Vec3::Z * TINY, Vec3::new(TINY, -TINY, 8388608.0 * TINY), Vec3::Z * 1e-40] {
            let ray = Ray { t_max: f32::INFINITY, ..Ray::new(Vec3::Z * -1e-8, dir) };
            let found = hit(scene, &ray);
            let t = 1e-8 / f64::from(dir.z);
            if t < 3e38 {
                let found = found.expect("in front");
                assert!((f64::from(found.t) / t - 1.0).abs() < 1e-6, "{found:?} for {t}");
            } else {
                assert_eq!(found, None, "t is out of the range of floats");
            }
        }
        for origin in [Vec3::new(TINY, -TINY, -1.0), Vec3::new(0.0, 1e-40, -1.0)] {
            assert_eq!(hit(scene, &Ray::new(origin, Vec3::new(1e-41, TINY, 1.0))).unwrap().t, 1.0);
        }
    }
    // The smallest direction, through the very edge of a box: the slab test's own smallest part of
    // a direction must stay small beside it.
    let mut shapes = Shapes::default();
    let corners = [Vec3::new(0.7, 0.0, -1.0), Vec3::new(0.7, 0.0, 1.0), Vec3::new(-0.3, 0.0, 0.0)];
    for at in [1.0, -1.0] {
        shapes.triangle(corners.map(|corner| corner * Vec3::new(at, 1.0, 1.0)));
    }
    let scene = shapes.build();
    for side in [1.0, -1.0] {
        let origin = Vec3::new(0.7 * side, -1e-9, 0.0);
        assert!(hit(&scene, &Ray::new(origin, Vec3::Y * 4.0 * TINY)).is_some());
    }
}

/// A NaN anywhere, an infinity in the origin or the direction, a direction of zeros, an empty
/// range: a miss. An infinite `t_min` or `t_max` is a bound like others.
#[test]
fn rays_that_miss_by_definition() {
    let scenes = facing();
    let good = Ray::new(Vec3::NEG_Z, Vec3::Z);
    let mut bad = vec![
        Ray { dir: Vec3::ZERO, ..good },
        Ray { dir: -Vec3::ZERO, ..good },
        Ray { t_min: f32::NAN, ..good },
        Ray { t_max: f32::NAN, ..good },
        Ray { t_min: 2.0, t_max: 0.5, ..good },
        Ray { t_min: f32::INFINITY, ..good },
        Ray { t_max: f32::NEG_INFINITY, ..good },
        Ray { t_min: f32::NEG_INFINITY, t_max: f32::NEG_INFINITY, ..good },
    ];
    for axis in 0..3 {
        for value in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let (mut origin, mut dir) = (good.origin, good.dir);
            origin[axis] = value;
            dir[axis] = value;
            bad.push(Ray { origin, ..good });
            bad.push(Ray { dir, ..good });
        }
    }
    for scene in &scenes {
        let expected = hit(scene, &good);
        assert!(expected.is_some());
        for ray in &bad {
            assert_eq!(hit(scene, ray), None, "{ray:?}");
        }
        let endless = Ray { t_min: f32::NEG_INFINITY, ..good };
        assert_eq!(hit(scene, &endless), expected);
    }
}

/// Bad rays beside good ones change no bit of these: in packets, in tiles, in batches.
#[test]
fn bad_rays_disturb_no_neighbour() {
    run("neighbours", 22, 3000, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 20);
        let scene = shapes.build();
        let good = rays(random, &shapes, number / CHAOS_KINDS % RAY_KINDS, 300);
        let every = 1 + random.below(9);
        let mut mixed = RayBatch::default();
        for index in 0..good.len() {
            let mut ray = good.as_rays().get(index);
            if index % every == 0 {
                spoil(random, &mut ray);
            }
            mixed.push(&ray);
        }
        let trace = |rays: &RayBatch| {
            let mut hits = HitBatch::new(rays.len());
            scene.intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
            let mut occluded = vec![false; rays.len()];
            scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
            (hits, occluded)
        };
        let (expected, found) = (trace(&good), trace(&mixed));
        for index in 0..good.len() {
            if index % every == 0 {
                assert_eq!(found.0.get(index), Hit::MISS, "{:?}", mixed.as_rays().get(index));
                assert!(!found.1[index]);
            } else {
                assert_eq!(found.0.get(index), expected.0.get(index));
                assert_eq!(found.1[index], expected.1[index]);
            }
        }
        good.len() as u64
    });
}

fn spoil(random: &mut Random, ray: &mut Ray) {
    let bad = random.pick(&[f32::NAN, f32::INFINITY, f32::NEG_INFINITY]);
    match random.below(5) {
        0 => ray.origin[random.below(3)] = bad,
        1 => ray.dir[random.below(3)] = bad,
        2 => ray.dir = Vec3::ZERO,
        3 => ray.t_min = f32::NAN,
        _ => (ray.t_min, ray.t_max) = (1.0, random.pick(&[0.5, f32::NAN])),
    }
}

/// The caller's control register is as it was, and its exception masks with it: the crate never
/// writes it, and a denormal result is the proof that it did not turn denormals off.
#[test]
fn denormals_stay_on_after_a_query() {
    let [scene, ..] = facing();
    assert!(hit(&scene, &Ray::new(Vec3::NEG_Z, Vec3::Z)).is_some());
    let half = std::hint::black_box(f32::MIN_POSITIVE) * std::hint::black_box(0.5);
    assert!(half > 0.0 && half.is_subnormal());
}
