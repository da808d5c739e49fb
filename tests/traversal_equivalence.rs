//! Every path gives the bits of the scalar reference: one ray, packets under all masks, batches of
//! every length, tiles, threads, shuffled rays and shuffled primitives.

mod made;

use made::shapes::{Shape, grid};
use made::{CHAOS_KINDS, RAY_KINDS, Shapes, chaos, rays, run};
use octray::{Hit, HitBatch, HitPacket, Ray, RayBatch, RayPacket, Scene};

/// A hit as bits, so that `-0.0` is not `0.0`.
fn bits(hit: &Hit) -> [u32; 5] {
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.prim_id, hit.geom_id]
}

/// What the reference says of each ray; checks what any hit must fulfil.
fn expected(scene: &Scene, rays: &RayBatch) -> Vec<Hit> {
    let one = |index| {
        let ray = rays.as_rays().get(index);
        let hit = scene.intersect_reference(&ray).unwrap_or(Hit::MISS);
        if hit.is_hit() {
            // Ends of a range that lie within a denormal of the origin are rounded to one.
            let is_rounded = |end: f32| (end * ray.dir.abs().max_element()).abs() < 2.4e-38;
            let after_start = hit.t >= ray.t_min || is_rounded(ray.t_min);
            let before_end = hit.t <= ray.t_max || is_rounded(ray.t_max);
            assert!(hit.t.is_finite() && after_start && before_end, "{hit:?} {ray:?}");
            assert!((0.0..=1.000_001).contains(&hit.u), "{hit:?} {ray:?}");
            assert!((0.0..=1.000_001).contains(&hit.v), "{hit:?} {ray:?}");
        }
        hit
    };
    (0..rays.len()).map(one).collect()
}

fn same(path: &str, ray: &Ray, found: &Hit, expected: &Hit) {
    assert_eq!(bits(found), bits(expected), "{path}: {found:?} for {expected:?} of {ray:?}");
}

/// Compares all paths for these rays; returns how many rays there were.
fn compare(scene: &Scene, rays: &RayBatch) -> u64 {
    let expected = expected(scene, rays);
    let mut hits = HitBatch::new(rays.len());
    let mut occluded = vec![false; rays.len()];
    scene.intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
    scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
    for (index, expected) in expected.iter().enumerate() {
        let ray = rays.as_rays().get(index);
        same("single", &ray, &scene.intersect(&ray).unwrap_or(Hit::MISS), expected);
        assert_eq!(scene.occluded(&ray), expected.is_hit(), "single occluded {ray:?}");
        same("batch", &ray, &hits.get(index), expected);
        assert_eq!(occluded[index], expected.is_hit(), "batch occluded {ray:?}");
    }
    for start in (0..rays.len().saturating_sub(7)).step_by(8) {
        packet(scene, rays, start, 0xff, &expected);
    }
    rays.len() as u64
}

/// Compares the packet that starts at `start`: active lanes right, the others as they were.
fn packet(scene: &Scene, rays: &RayBatch, start: usize, active: u8, expected: &[Hit]) {
    let packet = RayPacket::new(&std::array::from_fn(|lane| rays.as_rays().get(start + lane)));
    let before = Hit { t: f32::NAN, u: -0.0, v: 7.0, prim_id: 0x5555_5555, geom_id: 0xaaaa_aaaa };
    let mut hits = HitPacket::MISS;
    for lane in 0..8 {
        (hits.t[lane], hits.u[lane], hits.v[lane]) = (before.t, before.u, before.v);
        (hits.prim_id[lane], hits.geom_id[lane]) = (before.prim_id, before.geom_id);
    }
    scene.intersect_packet(&packet, active, &mut hits);
    let mut occluded = 0;
    for lane in 0..8 {
        let ray = rays.as_rays().get(start + lane);
        let is_active = active >> lane & 1 != 0;
        let expected = if is_active { &expected[start + lane] } else { &before };
        same("packet", &ray, &hits.get(lane), expected);
        occluded |= u8::from(is_active && expected.is_hit()) << lane;
    }
    let found = scene.occluded_packet(&packet, active);
    assert_eq!(found, occluded, "packet occluded from {start} on, active {active:#x}");
}

#[test]
fn grid_scenes() {
    run("grid", 1, 7000, |random, _| {
        let count = 1 + random.below(50);
        let shapes = grid(random, count);
        let coherent = random.once_in(2);
        let (origin, toward) = (random.grid(12), random.grid(3));
        let rays: RayBatch = (0..500)
            .map(|_| {
                let origin = if coherent { origin } else { random.grid(9) };
                let target = if coherent { toward + random.grid(1) } else { random.grid(4) };
                Ray::new(origin, target - origin)
            })
            .collect();
        compare(&shapes.build(), &rays)
    });
}

#[test]
fn chaos_scenes() {
    run("chaos", 2, 13_680, |random, number| {
        let largest = if random.once_in(8) { 100 } else { 12 };
        let count = 1 + random.below(largest);
        let shapes = chaos(random, number % CHAOS_KINDS, count);
        let rays = rays(random, &shapes, number / CHAOS_KINDS % RAY_KINDS, 500);
        compare(&shapes.build(), &rays)
    });
}

/// Parallel rays, as from an orthographic camera or a sun: what looks like a point that all of them
/// run through lies at the end of the range of floats, or nowhere.
#[test]
fn parallel_rays() {
    run("parallel", 8, 2000, |random, number| {
        let shapes = if number % 2 == 0 {
            grid(random, 40)
        } else {
            chaos(random, number / 2 % CHAOS_KINDS, 30)
        };
        let size = shapes.size();
        let dir = if random.once_in(2) { random.grid(2) } else { random.vec() };
        let dir = dir * random.pick(&[1.0, -1.0, size, 1e-3]);
        let far = random.scale(0, 12);
        let t_max = random.pick(&[f32::INFINITY, f32::MAX, 1e30, 2.0, far, far * size]);
        let back = dir * random.pick(&[0.0, 1.0, 2.0, 1e5]);
        let rays: RayBatch =
            (0..300).map(|_| Ray { t_max, ..Ray::new(shapes.point(random) - back, dir) }).collect();
        compare(&shapes.build(), &rays)
    });
}

/// Rays that run through one point, which lies before them, behind them or at their ends: as to a
/// light, or off a flat mirror. The point is near the scene or far away, and the rays spread widely.
#[test]
fn rays_through_one_point() {
    run("through one point", 9, 4000, |random, number| {
        let shapes = if number % 4 == 0 {
            grid(random, 40)
        } else {
            chaos(random, number / 4 % CHAOS_KINDS, 30)
        };
        let size = shapes.size();
        let apex = random.dir() * size * random.pick(&[0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 100.0]);
        let behind = random.once_in(2);
        let t_max = random.pick(&[1.0, 0.999, 2.0, f32::INFINITY]);
        let rays: RayBatch = (0..300)
            .map(|_| {
                let target = shapes.point(random);
                let part = 0.1 + random.unit();
                if behind {
                    // Off a mirror that cuts the way from the apex.
                    Ray::new(apex + (target - apex) * (0.5 * part), target - apex)
                } else {
                    let origin = target + (target - apex) * part;
                    Ray { t_max, ..Ray::new(origin, apex - origin) }
                }
            })
            .collect();
        compare(&shapes.build(), &rays)
    });
}

#[test]
fn packets_under_all_masks() {
    run("masks", 3, 144, |random, number| {
        let count = 1 + random.below(60);
        let shapes = chaos(random, number % CHAOS_KINDS, count);
        let (scene, rays) = (shapes.build(), rays(random, &shapes, number % RAY_KINDS, 16));
        let expected = expected(&scene, &rays);
        for active in 0..=255 {
            packet(&scene, &rays, 0, active, &expected);
            packet(&scene, &rays, 8, active, &expected);
        }
        2 * 256 * 8
    });
}

/// The batch queries, on one thread or on the pool that this is called in.
fn trace(scene: &Scene, rays: &RayBatch, parallel: bool) -> (HitBatch, Vec<bool>) {
    let mut hits = HitBatch::new(rays.len());
    let mut occluded = vec![true; rays.len()];
    if parallel {
        scene.par_intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
        scene.par_occluded_batch(rays.as_rays(), &mut occluded).unwrap();
    } else {
        scene.intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
        scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
    }
    (hits, occluded)
}

/// Batches of every length from 0 to 300, and any stretch of a batch, give what the whole gives.
#[test]
fn batches_of_every_length() {
    run("lengths", 4, 2 * RAY_KINDS as u64, |random, number| {
        let shapes = chaos(random, number % CHAOS_KINDS, 20);
        let scene = shapes.build();
        let rays = rays(random, &shapes, number % RAY_KINDS, 400);
        let expected = expected(&scene, &rays);
        let mut tried = 0;
        for length in 0..=300 {
            let start = random.below(100);
            let part = rays.as_rays().range(start, start + length);
            let mut hits = HitBatch::new(length);
            let mut occluded = vec![true; length];
            scene.intersect_batch(part, hits.as_hits()).unwrap();
            scene.occluded_batch(part, &mut occluded).unwrap();
            for index in 0..length {
                let expected = &expected[start + index];
                same("length", &part.get(index), &hits.get(index), expected);
                assert_eq!(occluded[index], expected.is_hit());
            }
            tried += length as u64;
        }
        tried
    });
}

/// One thread or many, rays in order or shuffled: the same bits for each ray.
#[test]
fn threads_and_the_order_of_rays_change_nothing() {
    let pools = [1, 2, 3, 8].map(|threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool")
    });
    for number in 0..4 * RAY_KINDS {
        let random = &mut made::Random::new(5, number as u64);
        let shapes = chaos(random, number % CHAOS_KINDS, 30);
        let scene = shapes.build();
        let count = 40_000 + random.below(9000);
        let rays = rays(random, &shapes, number % RAY_KINDS, count);
        let expected = trace(&scene, &rays, false);
        for pool in &pools {
            let found = pool.install(|| trace(&scene, &rays, true));
            let threads = pool.current_num_threads();
            assert!(found == expected, "{threads} threads give something else, round {number}");
        }
        let mut order: Vec<usize> = (0..rays.len()).collect();
        random.shuffle(&mut order);
        let shuffled = order.iter().map(|&index| rays.as_rays().get(index)).collect();
        let (hits, occluded) = trace(&scene, &shuffled, false);
        for (place, &index) in order.iter().enumerate() {
            same("shuffled", &rays.as_rays().get(index), &hits.get(place), &expected.0.get(index));
            assert_eq!(occluded[place], expected.1[index]);
        }
    }
}

/// So many rays of one start, or to one end, that they are sorted if they come in no order.
#[test]
fn strewn_rays_of_one_point_get_the_hits_of_rays_in_order() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    for number in 0..4 {
        let random = &mut made::Random::new(51, number as u64);
        let scene =
            if number < 2 { grid(random, 40).build() } else { chaos(random, 0, 30).build() };
        let bounds = scene.bvh().bounds;
        let (middle, half) = (0.5 * (bounds.min + bounds.max), 0.5 * (bounds.max - bounds.min));
        let point = middle + half * glam::Vec3::new(0.1, -0.2, 3.0);
        let ray = |index: usize| {
            let (x, y) = ((index % 512) as f32 / 256.0, (index / 512) as f32 / 137.0);
            let dir = middle + half * glam::Vec3::new(x - 1.0, y - 1.0, 0.0) - point;
            if number % 2 == 0 {
                Ray::new(point, dir)
            } else {
                Ray { origin: point + 2.0 * dir, dir: -2.0 * dir, t_min: 0.0, t_max: 0.99 }
            }
        };
        let mut rays: RayBatch = (0..140_000).map(ray).collect();
        for bad in [0, 999, 139_999] {
            rays.dir_x[bad] = f32::NAN;
            rays.origin_y[bad / 2] = f32::INFINITY;
        }
        let expected = trace(&scene, &rays, false);
        assert!(expected.1.iter().any(|&occluded| occluded));
        let mut order: Vec<usize> = (0..rays.len()).collect();
        random.shuffle(&mut order);
        let strewn = order.iter().map(|&index| rays.as_rays().get(index)).collect();
        for parallel in [false, true] {
            let (hits, occluded) = pool.install(|| trace(&scene, &strewn, parallel));
            for (place, &index) in order.iter().enumerate() {
                let ray = &rays.as_rays().get(index);
                same("strewn", ray, &hits.get(place), &expected.0.get(index));
                assert_eq!(occluded[place], expected.1[index]);
            }
        }
    }
}

/// Primitives in another order: the same `t`, and a primitive that is the same one, or one of those
/// that are met at this `t` too.
#[test]
fn the_order_of_primitives_changes_no_distance() {
    run("primitive order", 6, 1800, |random, number| {
        let shapes = if number % 2 == 0 {
            grid(random, 40)
        } else {
            chaos(random, number / 2 % CHAOS_KINDS, 30)
        };
        let mut shuffled = shapes.clone();
        random.shuffle(&mut shuffled.0);
        let rays = rays(random, &shapes, number % RAY_KINDS, 300);
        let (one, other) = (shapes.build(), shuffled.build());
        let (first, second) = (trace(&one, &rays, false), trace(&other, &rays, false));
        assert_eq!(first.1, second.1, "occluded in one order and not in the other");
        for index in 0..rays.len() {
            let (a, b) = (first.0.get(index), second.0.get(index));
            assert_eq!(a.t.to_bits() << 1, b.t.to_bits() << 1, "{a:?} {b:?}");
            assert_eq!(a.is_hit(), b.is_hit());
            if a.is_hit() && of_kind(&shapes, &a) != of_kind(&shuffled, &b) {
                // The other order's primitive, alone, is met at this `t`.
                let alone = Shapes(vec![of_kind(&shuffled, &b)]).build();
                let ray = rays.as_rays().get(index);
                let found = alone.intersect(&Ray { t_min: a.t, t_max: a.t, ..ray });
                assert!(found.is_some() || a.t.abs() < 1e-30, "{a:?} {b:?} {ray:?}");
            }
        }
        rays.len() as u64
    });
}

/// The primitive that a hit names.
fn of_kind(shapes: &Shapes, hit: &Hit) -> Shape {
    let of_geometry = |shape: &&Shape| match shape {
        Shape::Sphere(..) => hit.geom_id == 0,
        Shape::Triangle(_) => hit.geom_id == 1,
        Shape::Quad(_) => hit.geom_id == 2,
    };
    *shapes.0.iter().filter(of_geometry).nth(hit.prim_id as usize).expect("it is in the scene")
}

/// The hits of fixed scenes and rays, down to the last bit, as one number: every build gives it,
/// whatever its instruction set.
#[test]
fn every_build_gives_the_same_bits() {
    // FNV-1a, 64 bits.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut hits_in_all = 0;
    for number in 0..8 * CHAOS_KINDS * RAY_KINDS {
        let random = &mut made::Random::new(7, number as u64);
        let shapes = chaos(random, number % CHAOS_KINDS, 20);
        let rays = rays(random, &shapes, number / CHAOS_KINDS % RAY_KINDS, 200);
        let (hits, _) = trace(&shapes.build(), &rays, false);
        for index in 0..hits.len() {
            let hit = hits.get(index);
            hits_in_all += usize::from(hit.is_hit());
            for byte in bits(&hit).iter().flat_map(|bits| bits.to_le_bytes()) {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
    }
    assert_eq!((hits_in_all, hash), GOLDEN);
}

/// How many of the rays of [`every_build_gives_the_same_bits`] hit, and the hash of their hits.
const GOLDEN: (usize, u64) = (60922, 9078397162677885267);
