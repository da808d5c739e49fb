//! How many primitives a second the tree is built of, for each made scene and
//! quality of tree.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use octray::workload::{Model, scenes};
use octray::{BuildQuality, SceneBuilder};

fn build(criterion: &mut Criterion) {
    // `cargo bench -- --test` runs everything once: small scenes are enough then.
    let primitives = if is_test() { 1000 } else { 200_000 };
    let mut group = criterion.benchmark_group("build");
    group.sample_size(10);
    for model in models(primitives) {
        group.throughput(Throughput::Elements(model.primitive_count() as u64));
        for quality in BuildQuality::ALL {
            check(&model, quality);
            group.bench_function(format!("{}/{quality}", model.name), |bencher| {
                bencher.iter_batched(
                    || builder(&model, quality),
                    |builder| builder.build().expect("the made scenes are valid"),
                    BatchSize::LargeInput,
                );
            });
        }
    }
    group.finish();
}

fn models(primitives: usize) -> [Model; 4] {
    [
        scenes::terrain(primitives),
        scenes::dense_scan(primitives),
        scenes::sphereflake(primitives),
        scenes::mixed(primitives / 100),
    ]
}

fn builder(model: &Model, quality: BuildQuality) -> SceneBuilder {
    let mut builder = model.builder();
    builder.set_quality(quality);
    builder
}

/// The tree must hold what the model has, inside its boxes.
fn check(model: &Model, quality: BuildQuality) {
    let scene = builder(model, quality).build().expect("the made scenes are valid");
    scene.bvh().validate().expect("the tree is sound");
    assert_eq!(scene.bvh().stats().primitives, model.primitive_count(), "{}", model.name);
}

fn is_test() -> bool {
    std::env::args().any(|argument| argument == "--test")
}

criterion_group!(benches, build);
criterion_main!(benches);
