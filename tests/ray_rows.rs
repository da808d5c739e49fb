//! Rays in rows get the answers of the same rays in arrays, bit for bit: in each layout, in order and sorted,
//! on one thread and many; and a batch ends when it is told to.

use std::sync::atomic::{AtomicUsize, Ordering};

use octray::geometry::shapes;
use octray::glam::Vec3;
use octray::{BatchRays, Ends, Hit, HitBatch, Ray, RayBatch, RayRows, Rows, Scene, SceneBuilder};

fn scene() -> Scene {
    let mut builder = SceneBuilder::new();
    let material = builder.add_material(Default::default());
    builder.add_mesh(shapes::icosphere(4), material);
    builder.build().expect("a sphere")
}

/// Rays in rows, as their owner has them.
struct Owned {
    origins: Vec<[f64; 3]>,
    dirs: Vec<[f64; 3]>,
    t_min: Vec<f64>,
    t_max: Vec<f64>,
}

impl Owned {
    /// Rays from about one point; neighbours of a large batch lie far apart. Their numbers are no floats.
    fn new(count: usize, step: usize) -> Self {
        let mut owned =
            Self { origins: Vec::new(), dirs: Vec::new(), t_min: Vec::new(), t_max: Vec::new() };
        for index in 0..count {
            let number = index * step % count;
            // Along a spiral, of which the sphere hides the middle.
            let (turn, out) = (number as f64 * 0.7, 1.7 * (number as f64 / count as f64).sqrt());
            let aside = [turn.cos() * out, turn.sin() * out];
            owned.origins.push([0.1 + number as f64 * 1e-9, -0.2, 3.1]);
            owned.dirs.push([aside[0], aside[1] + 0.01, -3.0]);
            owned.t_min.push(if index % 7 == 0 { 0.9 } else { 0.1 });
            owned.t_max.push(if index % 5 == 0 { 1.1 } else { f64::INFINITY });
        }
        // Some that hit nothing.
        owned.dirs[count / 2] = [f64::NAN, 0.0, 1.0];
        owned.origins[count / 3] = [0.0, f64::INFINITY, 0.0];
        owned
    }
}

fn arrays(rays: BatchRays<'_>) -> RayBatch {
    (0..rays.len()).map(|index| rays.get(index)).collect()
}

fn bits(hits: &HitBatch) -> Vec<[u32; 5]> {
    let bits = |hit: Hit| [hit.t, hit.u, hit.v].map(f32::to_bits);
    let all = (0..hits.len()).map(|index| hits.get(index));
    all.map(|hit| {
        let [t, u, v] = bits(hit);
        [t, u, v, hit.prim_id, hit.geom_id]
    })
    .collect()
}

/// Asks all queries for batches about the rows, and compares them with what is said of single rays.
fn check(scene: &Scene, rows: RayRows<'_>, name: &str) -> usize {
    let rays = BatchRays::from(rows);
    let batch = arrays(rays);
    let count = rays.len();
    let expected: Vec<Hit> =
        (0..count).map(|index| scene.intersect(&rays.get(index)).unwrap_or(Hit::MISS)).collect();
    let expected: HitBatch = {
        let mut hits = HitBatch::new(count);
        expected.iter().enumerate().for_each(|(index, hit)| hits.as_hits().set(index, hit));
        hits
    };
    let seen: Vec<bool> = expected.geom_id.iter().map(|&geometry| geometry == 0).collect();
    let go_on = || true;
    for rays in [rays, batch.as_rays().into()] {
        for parallel in [false, true] {
            let mut hits = HitBatch::new(count);
            if parallel {
                scene.par_intersect_batch(rays, hits.as_hits()).expect("one length");
            } else {
                scene.intersect_batch(rays, hits.as_hits()).expect("one length");
            }
            assert!(bits(&hits) == bits(&expected), "{name}, parallel {parallel}");
            let mut hits = HitBatch::new(count);
            let watched = scene.intersect_batch_while(rays, hits.as_hits(), parallel, &go_on);
            assert_eq!(watched, Ok(true));
            assert!(bits(&hits) == bits(&expected), "{name}, watched, parallel {parallel}");
            let mut occluded = vec![false; count];
            let watched = scene.occluded_batch_while(rays, &mut occluded, parallel, &go_on);
            assert_eq!(watched, Ok(true));
            assert!(occluded == seen, "{name}, occluded, parallel {parallel}");
        }
    }
    seen.into_iter().filter(|&hit| hit).count()
}

#[test]
fn every_layout_gives_the_answers_of_single_rays() {
    let scene = scene();
    let threads = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
    // The last ones are enough to be sorted.
    for (count, step) in [(1, 1), (15, 1), (16, 1), (257, 1), (3_001, 1), (140_003, 40_503)] {
        let owned = Owned::new(count, step);
        let narrow = |rows: &[[f64; 3]]| -> Vec<[f32; 3]> {
            rows.iter().map(|row| row.map(|value| value as f32)).collect()
        };
        let (origins, dirs) = (narrow(&owned.origins), narrow(&owned.dirs));
        let t_min: Vec<f32> = owned.t_min.iter().map(|&t| t as f32).collect();
        let t_max: Vec<f32> = owned.t_max.iter().map(|&t| t as f32).collect();
        let moved = origins_moved(&owned.origins);
        let all = Ends::Same(0.0);
        let far = Ends::Same(f32::INFINITY);
        let layouts = [
            ("floats", Rows::F32(&origins), Rows::F32(&dirs), all, far),
            ("doubles", Rows::F64(&owned.origins), Rows::F64(&owned.dirs), all, far),
            ("one origin", Rows::Same([0.1, -0.2, 3.1]), Rows::F32(&dirs), all, far),
            ("one direction", Rows::F32(&origins), Rows::Same([-0.05, 0.1, -1.0]), all, far),
            ("mixed", Rows::F32(&origins), Rows::F64(&owned.dirs), Ends::F64(&owned.t_min), far),
            ("ends", Rows::F64(&moved), Rows::F32(&dirs), Ends::F32(&t_min), Ends::F32(&t_max)),
            ("double ends", Rows::F32(&origins), Rows::F32(&dirs), all, Ends::F64(&owned.t_max)),
        ];
        for (name, origins, dirs, t_min, t_max) in layouts {
            let rows = RayRows::new(count, origins, dirs, t_min, t_max).expect("one length");
            let hits = threads.install(|| check(&scene, rows, name));
            assert!(
                count < 200 || (hits > count / 20 && hits < count),
                "{name}: {hits} of {count}"
            );
        }
    }
}

/// Rows that are not those of another layout, so that none can be mistaken for it.
fn origins_moved(origins: &[[f64; 3]]) -> Vec<[f64; 3]> {
    origins.iter().map(|[x, y, z]| [x - 0.2, y + 0.1, *z]).collect()
}

#[test]
fn arrays_of_other_lengths_are_named() {
    let (three, two) = ([[0.0; 3]; 3], [[0.0; 3]; 2]);
    let (all, far) = (Ends::Same(0.0), Ends::Same(1.0));
    let short = RayRows::new(3, Rows::F32(&three), Rows::F32(&two), all, far);
    assert!(short.expect_err("too short").to_string().contains("dirs"));
    let short = RayRows::new(3, Rows::F32(&three), Rows::F32(&three), all, Ends::F64(&[1.0]));
    assert!(short.expect_err("too short").to_string().contains("t_max"));
    let rows = RayRows::new(3, Rows::F32(&three), Rows::F32(&three), all, far).expect("one length");
    let mut hits = HitBatch::new(2);
    assert!(scene().intersect_batch(rows, hits.as_hits()).is_err());
    assert!(scene().occluded_batch(rows, &mut [false; 4]).is_err());
}

#[test]
fn a_query_ends_when_it_is_told_to() {
    let scene = scene();
    for step in [1, 40_503] {
        let count = 400_003;
        let owned = Owned::new(count, step);
        let (dirs, origin) = (Rows::F64(&owned.dirs), Rows::Same([0.1, -0.2, 3.1]));
        let far = Ends::Same(f32::INFINITY);
        let rows = RayRows::new(count, origin, dirs, Ends::Same(0.0), far).expect("one length");
        for parallel in [false, true] {
            let asked = AtomicUsize::new(0);
            let go_on = || asked.fetch_add(1, Ordering::Relaxed) < 3;
            let mut hits = HitBatch::new(count);
            let ended = scene.intersect_batch_while(rows, hits.as_hits(), parallel, &go_on);
            assert_eq!(ended, Ok(false));
            let mut occluded = vec![false; count];
            let never = scene.occluded_batch_while(rows, &mut occluded, parallel, &|| false);
            assert_eq!(never, Ok(false));
            // Nothing is asked for long after the end.
            assert!(asked.into_inner() < 64);
        }
    }
}

#[test]
fn a_single_ray_of_rows_is_the_ray() {
    let rows = RayRows::new(
        2,
        Rows::F64(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]),
        Rows::Same([0.0, 1.0, 0.0]),
        Ends::F32(&[0.25, 0.5]),
        Ends::Same(9.0),
    );
    let rays = BatchRays::from(rows.expect("one length"));
    let second = Ray { origin: Vec3::new(4.0, 5.0, 6.0), dir: Vec3::Y, t_min: 0.5, t_max: 9.0 };
    assert_eq!((rays.len(), rays.get(1)), (2, second));
    assert_eq!(rays.range(1, 2).get(0), second);
    assert!(rays.range(1, 1).is_empty());
}
