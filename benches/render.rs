//! How many rays a second whole pictures take, from camera rays to pixels: on one thread, and on
//! one a logical core. Before that, where the time of the pictures goes:
//!
//! ```sh
//! cargo bench --bench render -- --phases            # the table alone
//! OCTRAY_BENCH_MESH=mesh.obj cargo bench --bench render -- --phases
//! ```
//!
//! The table has pictures of 1024 x 1024 with one ray a pixel: the Cornell box with 16 and 64 shadow
//! rays a point, a mesh on a plane and the dense scan of a million triangles with 16. Everything but
//! tracing should take less than a fifth: camera rays, shading, sums, placing samples (which the shadow
//! phase does; measured apart, for as many points as asked for theirs), and the file.

// Output for people is what a bench is for.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use criterion::{Criterion, Throughput, criterion_group};
use octray::glam::Vec3;
use octray::render::{Aov, PictureFile, Renderer, reference};
use octray::shading::sampling::{SampleKey, StratifiedSet};
use octray::workload::{Model, scenes};
use octray::{Camera, Light, Loaded, Scene, Settings};

/// How often each picture of the table is made; the medians count.
const TURNS: usize = 11;

/// A picture's parts may differ from those of the scalar reference by so much: sums have another
/// order.
const TOLERANCE: f32 = 1.0e-4;

fn render(criterion: &mut Criterion) {
    // `cargo bench -- --test` runs everything once: small pictures are enough then.
    let is_test = std::env::args().any(|argument| argument == "--test");
    let side = if is_test { 16 } else { 192 };
    for name in ["cornell-box", "mesh"] {
        let path = format!("{}/scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let loaded = octray::load(path.as_ref()).expect("the scenes of the repository load");
        check(&loaded);
        let settings = at_size(&loaded, side);
        let mut group = criterion.benchmark_group(format!("render/{name}"));
        group.sample_size(10);
        for threads in [1, 0] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let pool = pool.expect("threads can be had");
            let renderer = Renderer::new(&loaded.scene, &loaded.camera, settings);
            let once = pool.install(|| renderer.render()).expect("the settings are valid");
            group.throughput(Throughput::Elements(once.stats.rays()));
            let label = if threads == 1 { "one thread" } else { "all threads" };
            group.bench_function(label, |bencher| {
                bencher.iter(|| pool.install(|| renderer.render()));
            });
        }
        group.finish();
    }
}

/// The settings of a scene for one camera ray a pixel and sixteen shadow rays a point.
fn at_size(loaded: &Loaded, side: u32) -> Settings {
    Settings { width: side, height: side, spp: 1, shadow_samples: 16, ..loaded.settings }
}

/// The picture must be that of the scalar reference before its time counts.
fn check(loaded: &Loaded) {
    // The reference tries every triangle with every ray.
    let (scene, camera, settings) = (&loaded.scene, &loaded.camera, at_size(loaded, 12));
    let expected = reference::render(scene, camera, settings, None, Aov::Color);
    let expected = expected.expect("the settings are valid").pixels;
    let found = Renderer::new(scene, camera, settings).render();
    let found = found.expect("the settings are valid").image.pixels;
    assert_eq!(found.len(), expected.len());
    for (pixel, (found, expected)) in found.iter().zip(&expected).enumerate() {
        for (one, other) in found.iter().zip(expected) {
            // Asked this way round, a NaN fails.
            let same = (one - other).abs() <= TOLERANCE;
            assert!(same, "pixel {pixel} is {found:?}, must be {expected:?}");
        }
    }
}

/// The table of phases, for pictures of `side` x `side`.
fn phases(side: u32) {
    println!("Share of each phase in percent, {side}x{side}, one thread, median of {TURNS} turns");
    println!(
        "{:<14} {:>7} {:>8} {:>7} {:>9} {:>6} {:>7} {:>5} {:>8} {:>5} {:>12}",
        "picture",
        "samples",
        "seconds",
        "camera",
        "intersect",
        "shade",
        "shadow",
        "film",
        "placing",
        "file",
        "not tracing"
    );
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box.toml");
    let Loaded { scene, camera, .. } = octray::load(path.as_ref()).expect("a scene loads");
    for samples in [16, 64] {
        phases_of("cornell-box", &scene, &camera, (side, samples));
    }
    if let Some(path) = std::env::var_os("OCTRAY_BENCH_MESH").filter(|path| !path.is_empty()) {
        let loaded = octray::load(path.as_ref()).expect("the mesh loads");
        let model = Model::triangles_on_ground("mesh", &loaded.scene);
        phases_of(&model.name, &lit(&model), &model.stage.camera, (side, 16));
    }
    let model = scenes::dense_scan(1_000_000);
    phases_of(&model.name, &lit(&model), &model.stage.camera, (side, 16));
}

/// The scene of a model, with its light.
fn lit(model: &Model) -> Scene {
    let mut builder = model.builder();
    let light = Light::new(model.stage.light, Vec3::splat(0.9));
    builder.add_light(Light { ambient: Vec3::splat(0.1), ..light });
    builder.build().expect("the model makes a scene")
}

fn phases_of(name: &str, scene: &Scene, camera: &Camera, (side, samples): (u32, u32)) {
    let (width, height) = (side, side);
    let settings =
        Settings { width, height, spp: 1, shadow_samples: samples, ..Settings::default() };
    let renderer = Renderer::new(scene, camera, settings).threads(1);
    let folder = tempfile::tempdir().expect("a folder for pictures");
    let file = PictureFile::new(&folder.path().join("picture.png")).expect("PNG can be written");
    let mut turns: [Vec<f64>; 8] = Default::default();
    for _ in 0..TURNS {
        let picture = renderer.render_to(&file).expect("the settings are valid");
        let stats = *picture.stats();
        let start = Instant::now();
        picture.save().expect("the picture can be written");
        let file = start.elapsed().as_secs_f64();
        let placing = placing(stats.placed_samples, samples);
        let phases = stats.phases;
        let all = stats.wall_seconds + file;
        let values = [
            all,
            phases.camera / all,
            phases.intersect / all,
            phases.shade / all,
            phases.shadow / all,
            phases.film / all,
            placing / all,
            file / all,
        ];
        turns.iter_mut().zip(values).for_each(|(turns, value)| turns.push(value));
    }
    let [all, camera, intersect, shade, shadow, film, placing, file] = turns.map(|mut turns| {
        turns.sort_by(f64::total_cmp);
        turns[turns.len() / 2]
    });
    let rest = 1.0 - intersect - shadow + placing;
    println!(
        "{name:<14} {samples:>7} {all:>8.3} {:>7.1} {:>9.1} {:>6.1} {:>7.1} {:>5.1} {:>8.1} {:>5.1} {:>12.1}",
        100.0 * camera,
        100.0 * intersect,
        100.0 * shade,
        100.0 * shadow,
        100.0 * film,
        100.0 * placing,
        100.0 * file,
        100.0 * rest,
    );
}

/// The seconds that it takes to place so many samples, `per_point` at a time.
fn placing(samples: u64, per_point: u32) -> f64 {
    let (mut u, mut v) = (vec![0.0; per_point as usize], vec![0.0; per_point as usize]);
    let set = StratifiedSet::new(SampleKey::new(0, 0, 0, 0), per_point);
    let start = Instant::now();
    for point in 0..(samples / u64::from(per_point)) as u32 {
        let key = SampleKey::new(point, 7, 0, 0).dimension(1);
        set.named(key).fill(0, &mut u, &mut v);
        std::hint::black_box((&mut u, &mut v));
    }
    start.elapsed().as_secs_f64()
}

criterion_group!(benches, render);

fn main() {
    let given = |argument: &str| std::env::args().any(|given| given == argument);
    phases(if given("--test") { 32 } else { 1024 });
    if !given("--phases") {
        benches();
        Criterion::default().configure_from_args().final_summary();
    }
}
