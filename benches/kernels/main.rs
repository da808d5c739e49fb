//! How many ray-primitive tests a second each kernel makes, on 1, 8 and 16 lanes, and what rays
//! with a NaN cost their neighbours.
//!
//! Each test is as the traversals make it: lanes of rays against one primitive that is the same in
//! all of them. Rays are made ready beforehand. About one ray in ten meets a primitive.

mod primitives;
mod random;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use octray::glam::Vec3;
use octray::simd::{F32x8, F32x16, LaneMask, Lanes};
use octray::workload::{Kind, Viewpoint, scenes};
use octray::{Hit, HitBatch, HitPacket, PACKET_LANES, Ray, RayBatch, RayPacket, Scene};

use crate::primitives::{Kernel, Quad, Ready, Slab, SlabAnySign, Sphere, Triangle};
use crate::random::Random;

fn kernels(criterion: &mut Criterion) {
    // `cargo bench -- --test` runs everything once: a few primitives are enough then.
    let count = if is_test() { 8 } else { 64 };
    let mut random = Random(1);
    let rays = rays(&mut random);
    let triangles: Vec<_> = (0..count).map(|_| Triangle::seeded(&mut random)).collect();
    let quads: Vec<_> = (0..count).map(|_| Quad::seeded(&mut random)).collect();
    let spheres: Vec<_> = (0..count).map(|_| Sphere::seeded(&mut random)).collect();
    let slabs: Vec<_> = spheres.iter().map(|&Sphere(at, radius)| Slab(at, radius)).collect();
    let any_sign: Vec<_> = slabs.iter().map(|&slab| SlabAnySign(slab)).collect();
    bench(criterion, "triangle", &rays, &triangles);
    bench(criterion, "quad", &rays, &quads);
    bench(criterion, "sphere", &rays, &spheres);
    bench(criterion, "slab", &rays, &slabs);
    bench(criterion, "slab of any sign", &rays, &any_sign);
}

/// Rays in the order of a picture's rows, all towards positive coordinates.
fn rays(random: &mut Random) -> Vec<Ray> {
    let side = 32;
    let mut ray = |index: usize| {
        let at = |place: usize| 2.0 * place as f32 / side as f32 - 1.0;
        let dir = Vec3::new(random.range(0.05, 0.25), random.range(0.05, 0.25), 1.0);
        let through = Vec3::new(at(index % side), at(index / side), 0.0);
        // Not of unit length: the kernels see a scaled direction.
        Ray::new(through - 4.0 * dir, dir * random.range(0.3, 3.0))
    };
    (0..side * side).map(&mut ray).collect()
}

fn bench<K: Kernel>(criterion: &mut Criterion, name: &str, rays: &[Ray], primitives: &[K]) {
    check(name, rays, primitives);
    let mut group = criterion.benchmark_group(format!("kernels/{name}"));
    group.throughput(Throughput::Elements((rays.len() * primitives.len()) as u64));
    let (one, eight, sixteen) = (Ready::all(rays), Ready::all(rays), Ready::all(rays));
    group.bench_function("1", |bencher| bencher.iter(|| test_all::<K, f32>(&one, primitives)));
    group.bench_function("8", |bencher| bencher.iter(|| test_all::<K, F32x8>(&eight, primitives)));
    group.bench_function("16", |bencher| {
        bencher.iter(|| test_all::<K, F32x16>(&sixteen, primitives));
    });
    group.finish();
}

/// What is timed: all rays against all primitives.
#[inline(never)]
fn test_all<K: Kernel, F: Lanes>(rays: &[Ready<F>], primitives: &[K]) {
    for primitive in primitives {
        for rays in rays {
            if let Some(met) = primitive.meet(rays) {
                black_box(&met);
            }
        }
    }
}

/// Every lane count must find what one lane does, and that must be what the reference finds.
fn check<K: Kernel>(name: &str, rays: &[Ray], primitives: &[K]) {
    let one = find_all::<K, f32>(&Ready::all(rays), primitives);
    assert_eq!(find_all::<K, F32x8>(&Ready::all(rays), primitives), one, "{name}: 8 lanes and 1");
    assert_eq!(find_all::<K, F32x16>(&Ready::all(rays), primitives), one, "{name}: 16 and 1");
    let met = one.iter().flatten().count();
    assert!(met > one.len() / 50 && met < one.len() / 2, "{name}: {met} of {} met", one.len());
    for (primitive, found) in primitives.iter().zip(one.chunks_exact(rays.len())).take(8) {
        let scene = primitive.scene();
        for (ray, found) in rays.iter().zip(found) {
            let scale = Ready::<f32>::all(std::slice::from_ref(ray))[0].scaled.scale;
            let found = found.map(|bits| bits.map(f32::from_bits));
            let expected = scene.intersect_reference(ray);
            assert!(K::is_right(found, scale, expected), "{name}: {found:?}, {expected:?}");
        }
    }
}

/// The bits of what each ray meets of each primitive.
fn find_all<K: Kernel, F: Lanes>(rays: &[Ready<F>], primitives: &[K]) -> Vec<Option<[u32; 3]>> {
    let pairs =
        primitives.iter().flat_map(|primitive| rays.iter().map(move |ray| (primitive, ray)));
    pairs
        .flat_map(|(primitive, rays)| {
            let met = primitive.meet(rays);
            (0..F::LANES).map(move |lane| {
                let met = met.filter(|met| met.mask.bits() >> lane & 1 != 0)?;
                Some([met.t, met.u, met.v].map(|value| value.lane(lane).to_bits()))
            })
        })
        .collect()
}

/// A batch and packets of valid rays, and the same with a NaN in one ray of each eight.
fn nan(criterion: &mut Criterion) {
    let (triangles, side) = if is_test() { (1000, 16) } else { (100_000, 256) };
    let model = scenes::terrain(triangles);
    let scene = model.scene().expect("the made scenes are valid");
    let view = Viewpoint::new(&scene, &model.stage, side, side, 1).expect("so are cameras");
    let valid = view.workload(Kind::Primary).rays;
    let mut spoilt = valid.clone();
    for (index, dir) in spoilt.dir_x.iter_mut().enumerate() {
        // Another lane in each packet.
        if index % PACKET_LANES == index / PACKET_LANES % PACKET_LANES {
            *dir = f32::NAN;
        }
    }
    check_spoilt(&scene, &valid, &spoilt);
    let mut group = criterion.benchmark_group("nan");
    group.throughput(Throughput::Elements(valid.len() as u64));
    for (name, rays) in [("valid", &valid), ("one of eight NaN", &spoilt)] {
        let packets = packets(rays);
        group.bench_function(format!("packet/{name}"), |bencher| {
            let mut hits = HitPacket::MISS;
            bencher.iter(|| {
                for packet in &packets {
                    scene.intersect_packet(packet, u8::MAX, &mut hits);
                    black_box(&hits);
                }
            });
        });
        group.bench_function(format!("batch/{name}"), |bencher| {
            let mut hits = HitBatch::new(rays.len());
            bencher.iter(|| scene.intersect_batch(rays.as_rays(), hits.as_hits()));
        });
    }
    group.finish();
}

/// Rays with a NaN miss, and their neighbours hit what they hit without them.
fn check_spoilt(scene: &Scene, valid: &RayBatch, spoilt: &RayBatch) {
    assert_eq!(valid.len() % PACKET_LANES, 0, "the packets hold all rays");
    let batch = |rays: &RayBatch| {
        let mut hits = HitBatch::new(rays.len());
        scene.intersect_batch(rays.as_rays(), hits.as_hits()).expect("as many hits as rays");
        hits
    };
    let (expected, found) = (batch(valid), batch(spoilt));
    let mut packet_hits = HitPacket::MISS;
    for (number, packet) in packets(spoilt).iter().enumerate() {
        scene.intersect_packet(packet, u8::MAX, &mut packet_hits);
        for lane in 0..PACKET_LANES {
            let index = number * PACKET_LANES + lane;
            let is_nan = spoilt.dir_x[index].is_nan();
            let expected = if is_nan { Hit::MISS } else { expected.get(index) };
            assert_eq!(found.get(index), expected, "ray {index} of the batch");
            assert_eq!(packet_hits.get(lane), expected, "ray {index} in its packet");
        }
    }
    for index in (0..valid.len()).step_by(valid.len() / 64) {
        let reference = scene.intersect_reference(&spoilt.as_rays().get(index));
        assert_eq!(found.get(index), reference.unwrap_or(Hit::MISS), "ray {index}");
    }
}

fn packets(rays: &RayBatch) -> Vec<RayPacket> {
    let rays = rays.as_rays();
    let packet = |first| RayPacket::new(&std::array::from_fn(|lane| rays.get(first + lane)));
    (0..rays.len()).step_by(PACKET_LANES).map(packet).collect()
}

fn is_test() -> bool {
    std::env::args().any(|argument| argument == "--test")
}

criterion_group!(benches, kernels, nan);
criterion_main!(benches);
