//! Workloads are the same in every run, are what they say, and are measured only if answered right.

use octray::workload::{
    Effort, Kind, Lamp, Model, Part, Path, Query, Stage, Viewpoint, Workload, measure, scenes,
};
use octray::{Light, LightShape, RayBatch, SceneBuilder};

fn small_models() -> Vec<Model> {
    vec![
        scenes::terrain(2000),
        scenes::dense_scan(2000),
        scenes::sphereflake(300),
        scenes::mixed(36),
    ]
}

fn workloads(model: &Model, seed: u64) -> Vec<Workload> {
    let scene = model.scene().unwrap();
    let view = Viewpoint::new(&scene, &model.stage, 40, 24, seed).unwrap();
    Kind::ALL.map(|kind| view.workload(kind)).into()
}

fn bits(rays: &RayBatch) -> Vec<[u32; 8]> {
    (0..rays.len())
        .map(|index| {
            let ray = rays.as_rays().get(index);
            let (o, d) = (ray.origin, ray.dir);
            [o.x, o.y, o.z, d.x, d.y, d.z, ray.t_min, ray.t_max].map(f32::to_bits)
        })
        .collect()
}

#[test]
fn rays_derive_from_the_seed_alone() {
    for model in small_models() {
        let (once, again, other) =
            (workloads(&model, 1), workloads(&model, 1), workloads(&model, 2));
        for ((once, again), other) in once.iter().zip(&again).zip(&other) {
            assert_eq!(bits(&once.rays), bits(&again.rays), "{} {}", model.name, once.name);
            assert_ne!(bits(&once.rays), bits(&other.rays), "{} {}", model.name, once.name);
        }
    }
}

#[test]
fn every_scene_has_rays_of_every_kind_and_hits_among_them() {
    let effort = Effort { seconds: 0.0, runs: 1 };
    for model in small_models() {
        let scene = model.scene().unwrap();
        let mut secondary_hits = 0;
        for workload in workloads(&model, 1) {
            let measured = measure(&scene, &workload, Path::Batch, effort).unwrap();
            let label = format!("{} {}: {measured:?}", model.name, workload.name);
            assert_eq!(measured.rays, workload.rays.len());
            assert!(measured.rays > 0, "{label}");
            if workload.name == "primary" {
                assert!(measured.hits > measured.rays / 2, "{label}");
            } else {
                secondary_hits += measured.hits;
            }
        }
        assert!(secondary_hits > 0, "{}", model.name);
    }
}

#[test]
fn a_shuffle_keeps_the_rays() {
    let model = scenes::terrain(500);
    let workload = workloads(&model, 1).remove(0);
    let shuffled = workload.shuffled(3);
    assert_eq!(shuffled.name, "primary-shuffled");
    let (mut before, mut after) = (bits(&workload.rays), bits(&shuffled.rays));
    assert_ne!(before, after);
    before.sort_unstable();
    after.sort_unstable();
    assert_eq!(before, after);
}

#[test]
fn soft_shadows_end_on_the_light() {
    let model = scenes::terrain(500);
    let LightShape::Quad { corner, edge_u, edge_v } = model.stage.light else {
        panic!("the stage's light is an area");
    };
    for workload in workloads(&model, 1).iter().filter(|workload| workload.name.starts_with("soft"))
    {
        assert_eq!(workload.query, Query::Occluded);
        let samples: usize = workload.name[4..].parse().unwrap();
        assert_eq!(workload.rays.len() % samples, 0);
        for index in 0..workload.rays.len() {
            let ray = workload.rays.as_rays().get(index);
            let on_light = ray.at(ray.t_max) - corner;
            let (u, v) = (
                on_light.dot(edge_u) / edge_u.length_squared(),
                on_light.dot(edge_v) / edge_v.length_squared(),
            );
            assert!((-1e-3..1.001).contains(&u) && (-1e-3..1.001).contains(&v), "{u} {v}");
        }
    }
}

#[test]
fn rays_to_lamps_go_light_by_light() {
    let model = scenes::terrain(500);
    let scene = model.scene().unwrap();
    let view = Viewpoint::new(&scene, &model.stage, 48, 32, 1).unwrap();
    for lamp in Lamp::ALL {
        let kind = Kind::Lamp(lamp, 4);
        let (points, rays) = (view.shadow_points(kind).unwrap(), view.workload(kind).rays);
        assert_eq!(points.lights.len(), lamp.count());
        assert_eq!(rays.len(), lamp.count() * points.u.len());
        for index in 0..rays.len() {
            let (ray, sample) = (rays.as_rays().get(index), index % points.u.len());
            let start = points.position.each_ref().map(|part| part[sample / 4]);
            assert_eq!(ray.origin.to_array(), start);
            let end = points.lights[index / points.u.len()].at(points.u[sample], points.v[sample]);
            assert!((ray.at(ray.t_max) - end).length() < 1e-3, "{lamp}: ray {index}");
        }
    }
    assert!(view.shadow_points(Kind::Ao).is_none());
}

#[test]
fn below_the_grating_all_is_penumbra() {
    let model = scenes::grating(400);
    let scene = model.scene().unwrap();
    let view = Viewpoint::new(&scene, &model.stage, 64, 64, 1).unwrap();
    let rays = view.workload(Kind::Soft(64)).rays;
    let mut occluded = vec![false; rays.len()];
    scene.occluded_batch(rays.as_rays(), &mut occluded).unwrap();
    let points = occluded.chunks(64);
    let (count, mixed) = (points.len(), |point: &&[bool]| point.iter().any(|&o| o != point[0]));
    assert!(points.filter(mixed).count() * 10 > count * 9);
}

#[test]
fn kinds_are_read_as_they_are_written() {
    let lamps = Lamp::ALL.map(|lamp| Kind::Lamp(lamp, 16));
    for kind in Kind::ALL.into_iter().chain(lamps) {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    for wrong in ["", "soft", "soft0", "near", "many0", "softly", "soft99999", "Primary"] {
        let error = wrong.parse::<Kind>().unwrap_err().to_string();
        assert!(error.contains("primary, mirror"), "{error}");
    }
}

#[test]
fn scenes_have_about_the_size_that_is_asked_for() {
    for (model, size) in [
        (scenes::terrain(20_000), 20_000),
        (scenes::dense_scan(20_000), 20_000),
        (scenes::sphereflake(20_000), 20_000),
        (scenes::atrium(), 280_000),
    ] {
        let ratio = model.primitive_count() as f64 / size as f64;
        assert!((0.9..1.1).contains(&ratio), "{}: {}", model.name, model.primitive_count());
        assert_eq!(model.scene().unwrap().dropped(), Default::default(), "{}", model.name);
    }
}

#[test]
fn the_dense_scan_is_closed() {
    let model = scenes::dense_scan(3000);
    let Part::Mesh(mesh) = &model.parts[0] else { panic!("the scan is a mesh") };
    let corner = |index: u32| mesh.positions[index as usize].to_array().map(f32::to_bits);
    let mut edges = std::collections::HashMap::new();
    for triangle in &mesh.indices {
        for side in 0..3 {
            let (a, b) = (corner(triangle[side]), corner(triangle[(side + 1) % 3]));
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    assert!(edges.values().all(|&triangles| triangles == 2));
}

#[test]
fn a_scene_with_lights_of_its_own_keeps_them() {
    let mut builder = SceneBuilder::new();
    builder.add_mesh(octray::Mesh::default(), 0);
    let light = scenes::atrium().stage.light;
    builder.add_light(Light::new(LightShape::Point(glam::Vec3::ONE), glam::Vec3::ONE));
    builder.add_light(Light::new(light, glam::Vec3::ONE));
    let camera = scenes::atrium().stage.camera;
    let stage = Stage::of_scene(&builder.build().unwrap(), camera);
    assert_eq!((stage.light, stage.camera), (light, camera));
}

#[test]
fn packets_are_measured_as_batches_are() {
    let model = scenes::mixed(25);
    let scene = model.scene().unwrap();
    let effort = Effort { seconds: 0.0, runs: 5 };
    for workload in workloads(&model, 4) {
        let [reference, packet, batch] =
            Path::ALL.map(|path| measure(&scene, &workload, path, effort).unwrap());
        assert_eq!(packet.hits, batch.hits);
        assert!(reference.rays <= batch.rays && reference.runs == 5);
        assert!(batch.low <= batch.median && batch.median <= batch.high);
    }
}
