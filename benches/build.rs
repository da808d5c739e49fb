//! How many primitives a second the tree is built of, for each made scene.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use octray::workload::{Model, scenes};

fn build(criterion: &mut Criterion) {
    // `cargo bench -- --test` runs everything once: small scenes are enough then.
    let primitives = if is_test() { 1000 } else { 200_000 };
    let mut group = criterion.benchmark_group("build");
    group.sample_size(10);
    for model in models(primitives) {
        check(&model);
        group.throughput(Throughput::Elements(model.primitive_count() as u64));
        group.bench_function(&model.name, |bencher| {
            bencher.iter_batched(
                || model.clone(),
                |model| model.scene().expect("the made scenes are valid"),
                BatchSize::LargeInput,
            );
        });
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

/// The tree must hold what the model has, inside its boxes.
fn check(model: &Model) {
    let scene = model.scene().expect("the made scenes are valid");
    scene.bvh().validate().expect("the tree is sound");
    assert_eq!(scene.bvh().stats().primitives, model.primitive_count(), "{}", model.name);
}

fn is_test() -> bool {
    std::env::args().any(|argument| argument == "--test")
}

criterion_group!(benches, build);
criterion_main!(benches);
