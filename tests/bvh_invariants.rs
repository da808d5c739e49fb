//! The tree over any geometry: valid, of bounded depth, the same for every number of threads, and
//! traced as the reference says.

mod made;

use glam::Vec3;
use made::closed::scene_of;
use made::shapes::Shape;
use made::{CHAOS_KINDS, RAY_KINDS, Random, Shapes, chaos, rays, run};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use octray::bvh::{
    BuildPrimitive, BuildProgress, BuildQuality, Bvh, MAX_DEPTH, PrimKind, PrimitiveSource, Watch,
};
use octray::{BuildError, Hit, HitBatch, Mesh, Quads, Ray, RayBatch, Scene, SceneBuilder, Spheres};

/// The rays of the batch hit what the reference says, on the single and the batch path.
fn assert_traced(scene: &Scene, rays: &RayBatch) {
    let mut hits = HitBatch::new(rays.len());
    scene.intersect_batch(rays.as_rays(), hits.as_hits()).unwrap();
    for index in 0..rays.len() {
        let ray = rays.as_rays().get(index);
        let expected = scene.intersect_reference(&ray);
        assert_eq!(scene.intersect(&ray), expected, "{ray:?}");
        assert_eq!(scene.occluded(&ray), expected.is_some(), "{ray:?}");
        assert_eq!(hits.get(index), expected.unwrap_or(Hit::MISS), "{ray:?}");
    }
}

fn check(random: &mut Random, shapes: &Shapes) -> Scene {
    let scene = shapes.build();
    scene.bvh().validate().unwrap();
    for kind in 0..RAY_KINDS {
        assert_traced(&scene, &rays(random, shapes, kind, 16));
    }
    scene
}

#[test]
fn an_empty_scene_is_missed() {
    let mut random = Random::new(41, 0);
    let mut builder = SceneBuilder::new();
    assert!(check(&mut random, &Shapes::default()).bounds().is_empty());
    builder.add_mesh(Mesh::default(), 0);
    builder.add_spheres(Spheres::default(), 0);
    builder.add_quads(Quads::default(), 0);
    let scene = builder.build().unwrap();
    scene.bvh().validate().unwrap();
    assert_eq!(scene.intersect(&Ray::new(Vec3::ZERO, Vec3::X)), None);
    let shapes = chaos(&mut random, 0, 3);
    for kind in 0..RAY_KINDS {
        assert_traced(&scene, &rays(&mut random, &shapes, kind, 300));
    }
}

/// From one primitive on, across the sizes of leaves and nodes; alone and mixed with others.
#[test]
fn scenes_of_1_to_80_primitives() {
    run("small scenes", 42, 80 * CHAOS_KINDS as u64, |random, number| {
        let mut shapes = chaos(random, number % CHAOS_KINDS, 1 + number / CHAOS_KINDS);
        check(random, &shapes);
        shapes.0.truncate(1 + number / CHAOS_KINDS);
        check(random, &shapes);
        for kind in 0..3 {
            let of_kind = |shape: &&Shape| match shape {
                Shape::Triangle(_) => kind == 0,
                Shape::Quad(_) => kind == 1,
                Shape::Sphere(..) => kind == 2,
            };
            check(random, &Shapes(shapes.0.iter().filter(of_kind).copied().collect()));
        }
        5 * 16 * RAY_KINDS as u64
    });
}

#[test]
fn ten_thousand_coincident_primitives() {
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut shapes = Shapes::default();
    for place in 0..10_000 {
        match place % 3 {
            0 => shapes.triangle(corners),
            1 => shapes.quad(Vec3::ZERO, Vec3::X, Vec3::Y),
            _ => shapes.sphere(Vec3::splat(0.25), 0.25),
        }
    }
    let scene = shapes.build();
    scene.bvh().validate().unwrap();
    assert!(scene.bvh().depth <= 16, "depth {}", scene.bvh().depth);
    let hit = scene.intersect(&Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::Z)).unwrap();
    assert_eq!((hit.t, hit.geom_id, hit.prim_id), (1.0, 0, 0), "the smallest ids win");
    // Of one kind alone, so that all centres and boxes agree.
    shapes.0.retain(|shape| matches!(shape, Shape::Triangle(_)));
    let scene = shapes.build();
    scene.bvh().validate().unwrap();
    let hit = scene.intersect(&Ray::new(Vec3::new(0.25, 0.25, -1.0), Vec3::Z)).unwrap();
    assert_eq!(hit.prim_id, 0);
}

/// Triangles that are dropped are counted and keep their place; turned ones are hit like others.
#[test]
fn degenerate_inverted_and_not_finite_triangles() {
    let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mut mesh = Mesh::default();
    let mut push = |corners: [Vec3; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.indices.push([first, first + 1, first + 2]);
    };
    push([Vec3::X, Vec3::X, Vec3::Y]);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for corner in 0..3 {
            let mut corners = good;
            corners[corner][corner] = value;
            push(corners);
        }
    }
    push([good[0], good[2], good[1]]);
    push(good);
    let scene = scene_of(mesh);
    scene.bvh().validate().unwrap();
    assert_eq!((scene.dropped().degenerate, scene.dropped().not_finite), (1, 9));
    assert_eq!(scene.primitive_count(PrimKind::Triangle), 12);
    for (z, dir) in [(-1.0, Vec3::Z), (1.0, Vec3::NEG_Z)] {
        let hit = scene.intersect(&Ray::new(Vec3::new(0.2, 0.3, z), dir)).unwrap();
        assert_eq!((hit.t, hit.prim_id, hit.u, hit.v), (1.0, 10, 0.3, 0.2));
    }
}

#[test]
fn indices_out_of_range_are_named() {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
    for index in [3, 4, u32::MAX] {
        let mut builder = SceneBuilder::new();
        builder.add_spheres(Spheres::one(Vec3::ZERO, 1.0), 0);
        let indices = vec![[0, 1, 2], [0, index, 2]];
        builder.add_mesh(Mesh { positions: positions.clone(), indices, normals: vec![] }, 0);
        let error = BuildError::Index { geom_id: 1, prim_id: 1, index, vertices: 3 };
        assert_eq!(builder.build().unwrap_err(), error);
    }
}

/// Spheres and quads of numbers that make no sense are errors, each named.
#[test]
fn senseless_spheres_and_quads_are_refused() {
    for (center, radius) in [
        (Vec3::ZERO, 0.0),
        (Vec3::ZERO, -1.0),
        (Vec3::ZERO, f32::NAN),
        (Vec3::ZERO, f32::INFINITY),
        (Vec3::new(0.0, f32::NAN, 0.0), 1.0),
        (Vec3::new(f32::INFINITY, 0.0, 0.0), 1.0),
    ] {
        let mut builder = SceneBuilder::new();
        builder.add_spheres(Spheres::one(center, radius), 0);
        assert!(matches!(builder.build(), Err(BuildError::Sphere { geom_id: 0, .. })));
    }
    for (corner, edge_u, edge_v) in [
        (Vec3::ZERO, Vec3::X, Vec3::X * 2.0),
        (Vec3::ZERO, Vec3::X, Vec3::ZERO),
        (Vec3::NAN, Vec3::X, Vec3::Y),
        (Vec3::ZERO, Vec3::X, Vec3::INFINITY),
        (Vec3::splat(3e38), Vec3::X * 3e38, Vec3::Y),
    ] {
        let mut builder = SceneBuilder::new();
        builder.add_quads(Quads::one(corner, edge_u, edge_v), 0);
        assert!(matches!(builder.build(), Err(BuildError::Quad { geom_id: 0, .. })));
    }
}

/// Coordinates from 1e-30 to 1e+30: valid trees, and hits as the reference says.
#[test]
fn coordinates_of_any_size() {
    run("sizes", 43, 61 * 4, |random, number| {
        let power = number as i32 / 4 - 30;
        let size = 10_f64.powi(power) as f32;
        let mut shapes = chaos(random, 0, 40);
        let own = shapes.size();
        let resized = |p: Vec3| p / own * size;
        for shape in &mut shapes.0 {
            *shape = match *shape {
                Shape::Triangle(corners) => Shape::Triangle(corners.map(resized)),
                Shape::Quad(corner_and_edges) => Shape::Quad(corner_and_edges.map(resized)),
                Shape::Sphere(center, radius) => {
                    Shape::Sphere(resized(center), radius / own * size)
                }
            };
        }
        let shapes = Shapes(shapes.0.iter().filter(|shape| is_valid(shape)).copied().collect());
        let scene = check(random, &shapes);
        // In the range of sizes that the kernels promise, things are hit.
        if (-13..=17).contains(&power) {
            let batch = rays(random, &shapes, 2, 200);
            let hits = (0..200).filter(|&i| scene.occluded(&batch.as_rays().get(i))).count();
            assert!(hits > 50, "only {hits} hits at {size:e}");
        }
        16 * RAY_KINDS as u64
    });
}

fn is_valid(shape: &Shape) -> bool {
    match *shape {
        Shape::Triangle(_) => true,
        Shape::Quad([corner, u, v]) => Quads::one(corner, u, v).validate(0).is_ok(),
        Shape::Sphere(center, radius) => Spheres::one(center, radius).validate(0).is_ok(),
    }
}

/// After Embree: scenes of 20 meshes of random bits each, built; and here traced as well.
#[test]
fn meshes_of_random_bits() {
    run("random bits", 44, 1000, |random, _| {
        let mut builder = SceneBuilder::new();
        let mut shapes = Shapes::default();
        for _ in 0..20 {
            let mut mesh = Mesh::default();
            let one_exponent = random.once_in(2).then(|| random.next() as u32 & 0x7f80_0000);
            for _ in 0..3 + random.below(30) {
                let mut float = || {
                    let bits = random.next() as u32;
                    f32::from_bits(one_exponent.map_or(bits, |e| bits & !0x7f80_0000 | e))
                };
                mesh.positions.push(Vec3::new(float(), float(), float()));
            }
            for _ in 0..random.below(20) {
                mesh.indices.push([0; 3].map(|_| random.below(mesh.positions.len()) as u32));
            }
            for index in 0..mesh.len() {
                shapes.triangle(mesh.triangle(index));
            }
            builder.add_mesh(mesh, 0);
        }
        let scene = builder.build().unwrap();
        scene.bvh().validate().unwrap();
        let kind = random.below(RAY_KINDS);
        assert_traced(&scene, &rays(random, &shapes, kind, 64));
        64
    });
}

/// More primitives than ids are refused before anything is allocated for them. (The zeros of the
/// radii are pages that the system never has to provide.)
#[test]
fn too_many_primitives_are_refused() {
    let mut builder = SceneBuilder::new();
    builder.add_spheres(Spheres { radius: vec![0.0; 1 << 26], ..Spheres::default() }, 0);
    let error = builder.build().unwrap_err();
    assert_eq!(error, BuildError::TooMany { count: 67_108_864, max: 67_108_863 });
}

/// Boxes that shrink exponentially towards a corner defeat every split in the middle: the depth
/// stays within what the traversals' stacks are made for.
#[test]
fn exponentially_spaced_primitives_keep_the_depth_bounded() {
    let mut random = Random::new(45, 0);
    for ratio in [1.05_f32, 1.5, 2.0, 4.0, 16.0] {
        for flat in [false, true] {
            let mut shapes = Shapes::default();
            let mut at = 1e-18_f32;
            while at < 1e18 && shapes.0.len() < 3000 {
                let y = if flat { 0.0 } else { at };
                shapes.triangle([
                    Vec3::new(at, y, 0.0),
                    Vec3::new(at, y, at),
                    Vec3::new(at, -at, 0.0),
                ]);
                shapes.sphere(Vec3::new(at, y, -at), at * 0.1);
                at *= ratio;
            }
            // Many at one place beside them, so that halving has to go on at the greatest depth.
            for _ in 0..1000 {
                shapes.triangle([Vec3::ZERO, Vec3::X * 1e-20, Vec3::Y * 1e-20]);
            }
            let scene = check(&mut random, &shapes);
            assert!(scene.bvh().depth <= MAX_DEPTH);
        }
    }
}

/// Triangles whose box `i` reaches from 0 to `2^i`.
struct Nested;

impl PrimitiveSource for Nested {
    fn boxes(&self, first: u32, into: &mut [BuildPrimitive]) {
        for (one, id) in into.iter_mut().zip(first..) {
            let bounds = octray::Aabb::of_points(&self.triangle(id));
            *one = BuildPrimitive::new(bounds, PrimKind::Triangle, id);
        }
    }
    fn triangle(&self, id: u32) -> [Vec3; 3] {
        let size = 2_f32.powi(id as i32 % 240 - 120);
        [Vec3::ZERO, Vec3::X * size, Vec3::Y * size]
    }
    fn quad(&self, _: u32) -> [Vec3; 4] {
        unreachable!("all are triangles")
    }
    fn sphere(&self, _: u32) -> (Vec3, f32) {
        unreachable!("all are triangles")
    }
}

/// A builder's worst case without a scene around it.
#[test]
fn nested_boxes_keep_the_depth_bounded() {
    for quality in BuildQuality::ALL {
        let bvh = Bvh::build(20_000, &Nested, quality, &Watch::new()).unwrap();
        bvh.validate().unwrap();
        assert!(bvh.depth <= MAX_DEPTH);
    }
}

/// One tree for every number of threads, bit for bit.
#[test]
fn the_tree_does_not_depend_on_threads() {
    let mut random = Random::new(46, 0);
    for kind in 0..CHAOS_KINDS {
        let shapes = chaos(&mut random, kind, 6000);
        for quality in BuildQuality::ALL {
            let build = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| shapes.build_with(quality))
            };
            let one = build(1);
            one.bvh().validate().unwrap();
            for threads in [2, 3, 8] {
                let other = build(threads);
                let text = |scene: &Scene| format!("{:?}", scene.bvh());
                assert!(text(&one) == text(&other), "{threads} threads built another tree");
            }
        }
    }
}

/// Progress ends at its end; a cancelled build says so and leaves nothing half done.
#[test]
fn a_build_is_watched_and_cancelled() {
    let shapes = chaos(&mut Random::new(47, 0), 0, 30_000);
    for quality in BuildQuality::ALL {
        let (calls, most, steps) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let cancel = AtomicBool::new(false);
        let tell = |progress: &BuildProgress| {
            assert!(progress.done <= progress.steps, "{progress:?}");
            calls.fetch_add(1, Ordering::Relaxed);
            most.fetch_max(progress.done, Ordering::Relaxed);
            steps.store(progress.steps, Ordering::Relaxed);
        };
        let watch = Watch::new().on_progress(&tell).cancel(&cancel);
        let build = |watch: &Watch<'_>| {
            let mut builder = shapes.builder();
            builder.set_quality(quality);
            builder.build_watched(watch)
        };
        let scene = build(&watch).unwrap();
        let primitives = scene.bvh().stats().primitives;
        let each = if quality == BuildQuality::High { 5 } else { 2 };
        assert_eq!((most.into_inner(), steps.into_inner()), (each * primitives, each * primitives));
        let whole = calls.into_inner();
        assert!(whole > 8, "{whole} calls");

        // From the start, and from each call on.
        for last in 0..=whole {
            let (calls, cancel) = (AtomicUsize::new(0), AtomicBool::new(last == 0));
            let tell = |_: &BuildProgress| {
                if calls.fetch_add(1, Ordering::Relaxed) + 1 == last {
                    cancel.store(true, Ordering::Relaxed);
                }
            };
            let found = build(&Watch::new().on_progress(&tell).cancel(&cancel));
            assert_eq!(found.err(), Some(BuildError::Cancelled), "after call {last} of {whole}");
        }
    }
}
