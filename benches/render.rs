//! How many rays a second whole pictures take, from camera rays to pixels: on one thread, and on
//! one a logical core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use octray::render::{Aov, Renderer, reference};
use octray::{Loaded, Settings};

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

criterion_group!(benches, render);
criterion_main!(benches);
