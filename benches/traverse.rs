//! How many rays a second each query makes: workload x scene x packet and batch, on one thread.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use octray::workload::{Effort, Kind, Model, Path, Query, Viewpoint, Workload, measure, scenes};
use octray::{HitBatch, HitPacket, PACKET_LANES, RayPacket, Scene};

fn traverse(criterion: &mut Criterion) {
    // `cargo bench -- --test` runs everything once: small scenes and pictures are enough then.
    let is_test = std::env::args().any(|argument| argument == "--test");
    let (triangles, side) = if is_test { (1000, 16) } else { (1_000_000, 256) };
    let models: [fn(usize) -> Model; 4] = [
        scenes::terrain,
        scenes::dense_scan,
        |triangles| scenes::sphereflake(triangles / 10),
        |triangles| scenes::mixed(triangles / 100),
    ];
    for model in models.map(|make| make(triangles)) {
        let scene = model.scene().expect("the made scenes are valid");
        let view = Viewpoint::new(&scene, &model.stage, side, side, 1).expect("so are cameras");
        let mut group = criterion.benchmark_group(&model.name);
        group.sample_size(10);
        for kind in Kind::ALL {
            let workload = view.workload(kind);
            check(&scene, &workload);
            group.throughput(Throughput::Elements(workload.rays.len() as u64));
            group.bench_function(format!("{kind}/batch"), |bencher| {
                let mut hits = HitBatch::new(workload.rays.len());
                let mut occluded = vec![false; workload.rays.len()];
                let rays = workload.rays.as_rays();
                bencher.iter(|| match workload.query {
                    Query::Intersect => scene.intersect_batch(rays, hits.as_hits()),
                    Query::Occluded => scene.occluded_batch(rays, &mut occluded),
                });
            });
            let packets = packets(&workload);
            group.throughput(Throughput::Elements((packets.len() * PACKET_LANES) as u64));
            group.bench_function(format!("{kind}/packet"), |bencher| {
                bencher.iter(|| trace_packets(&scene, workload.query, &packets));
            });
        }
        group.finish();
    }
}

/// The hits of both paths must be right before their time counts.
fn check(scene: &Scene, workload: &Workload) {
    for path in [Path::Batch, Path::Packet] {
        let once = Effort { seconds: 0.0, runs: 1 };
        measure(scene, workload, path, once).expect("the queries agree with the reference");
    }
}

/// The full packets.
fn packets(workload: &Workload) -> Vec<RayPacket> {
    let rays = workload.rays.as_rays();
    (0..rays.len() / PACKET_LANES)
        .map(|packet| {
            RayPacket::new(&std::array::from_fn(|lane| rays.get(packet * PACKET_LANES + lane)))
        })
        .collect()
}

fn trace_packets(scene: &Scene, query: Query, packets: &[RayPacket]) -> u32 {
    let mut hits = HitPacket::MISS;
    packets.iter().fold(0, |count, packet| match query {
        Query::Intersect => {
            scene.intersect_packet(packet, u8::MAX, &mut hits);
            count ^ hits.prim_id[0]
        }
        Query::Occluded => count + scene.occluded_packet(packet, u8::MAX).count_ones(),
    })
}

criterion_group!(benches, traverse);
criterion_main!(benches);
