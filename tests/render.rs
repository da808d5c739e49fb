//! Pictures: tiles against the scalar reference, analytic scenes, threads, crops, refusals.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use glam::Vec3;
use octray::geometry::shapes;
use octray::render::{Aov, Crop, Image, RenderError, Renderer, reference};
use octray::scene::load;
use octray::{
    Camera, Light, LightShape, Material, Quads, Scene, SceneBuilder, Settings, Shading, Spheres,
};

const TOLERANCE: f32 = 1.0e-4;

fn picture(scene: &Scene, camera: &Camera, settings: Settings) -> Image {
    Renderer::new(scene, camera, settings).threads(1).render().unwrap().image
}

fn settings(width: u32, height: u32) -> Settings {
    Settings { width, height, shadow_samples: 4, ..Settings::default() }
}

fn scene_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "toml"))
        .collect();
    files.sort();
    assert!(files.len() >= 9, "{files:?}");
    files
}

/// Mirrors that face each other, smooth and flat triangles, spheres, a camera inside a sphere,
/// lights of both shapes, one of them through the floor.
fn hall_of_mirrors() -> (Scene, Camera) {
    let mut scene = SceneBuilder::new();
    let mirror = |share| Material {
        mirror: share,
        specular: Vec3::splat(0.4),
        shininess: 30.0,
        ..Material::matt(Vec3::new(0.5, 0.6, 0.7))
    };
    let full = scene.add_material(mirror(1.0));
    let half = scene.add_material(mirror(0.5));
    let matt = scene.add_material(Material::matt(Vec3::new(0.9, 0.4, 0.3)));
    let (x, y, z) = (Vec3::X * 4.0, Vec3::Y * 4.0, Vec3::Z * 4.0);
    let corner = Vec3::new(-2.0, -1.0, -2.0);
    scene.add_quads(Quads::one(corner, z, x), matt);
    scene.add_quads(Quads::one(corner, x, y), full);
    scene.add_quads(Quads::one(corner + z, y, x), half);
    let mut ball = shapes::icosphere(2);
    ball.positions.iter_mut().for_each(|p| *p = *p * 0.5 + Vec3::new(-0.7, -0.5, 0.0));
    let mut flat = ball.clone();
    flat.positions.iter_mut().for_each(|p| *p += Vec3::new(1.4, 0.0, -0.6));
    flat.normals.clear();
    scene.add_mesh(ball, half);
    scene.add_mesh(flat, matt);
    scene.add_spheres(Spheres::one(Vec3::new(0.0, 0.5, 0.0), 0.3), half);
    scene.add_spheres(Spheres::one(Vec3::ZERO, 30.0), matt);
    let ambient = |light: Light| Light { ambient: Vec3::splat(0.1), ..light };
    let point = LightShape::Point(Vec3::new(1.0, 3.0, 1.5));
    scene.add_light(ambient(Light::new(point, Vec3::new(0.5, 0.6, 0.5))));
    let area = LightShape::Quad {
        corner: Vec3::new(-1.5, 2.0, -1.0),
        edge_u: Vec3::X,
        edge_v: Vec3::new(0.0, 0.3, 1.0),
    };
    scene.add_light(ambient(Light::new(area, Vec3::splat(0.4))));
    let through_floor = LightShape::Quad {
        corner: Vec3::new(1.2, -1.5, 0.5),
        edge_u: Vec3::Y * 2.0,
        edge_v: Vec3::Z * 0.5,
    };
    scene.add_light(Light::new(through_floor, Vec3::new(0.2, 0.3, 0.6)));
    let eye = Vec3::new(0.4, 0.6, 1.8);
    let camera = Camera { eye, target: Vec3::ZERO, up: Vec3::Y, vertical_fov: 70.0 };
    (scene.build().unwrap(), camera)
}

fn assert_same(scene: &Scene, camera: &Camera, settings: Settings, name: &str) {
    for aov in [Aov::Normal, Aov::Depth, Aov::Prim] {
        let tiles = Renderer::new(scene, camera, settings).aov(aov).render().unwrap().image;
        let reference = reference::render(scene, camera, settings, None, aov).unwrap();
        let bits = |image: &Image| -> Vec<_> {
            image.pixels.iter().flatten().map(|value| value.to_bits()).collect()
        };
        assert!(bits(&tiles) == bits(&reference), "{name}: {aov:?} differs");
    }
    let tiles = Renderer::new(scene, camera, settings).render().unwrap().image;
    let reference = reference::render(scene, camera, settings, None, Aov::Color).unwrap();
    for (index, (a, b)) in tiles.pixels.iter().zip(&reference.pixels).enumerate() {
        let difference = (Vec3::from(*a) - Vec3::from(*b)).abs().max_element();
        // NaN must not pass.
        let same = difference <= TOLERANCE;
        assert!(same, "{name}: pixel {index} is {a:?} and should be {b:?}");
    }
}

#[test]
fn tiles_equal_the_reference() {
    let (scene, camera) = hall_of_mirrors();
    for (spp, max_bounces, shading) in [
        (1, 4, Shading::Phong),
        (3, 0, Shading::Phong),
        (5, 9, Shading::Phong),
        (2, 1, Shading::Flat),
    ] {
        let settings = Settings {
            spp,
            max_bounces,
            shading,
            shadow_samples: 7,
            background: Vec3::new(0.1, 0.2, 0.3),
            seed: 11,
            ..settings(45, 37)
        };
        assert_same(&scene, &camera, settings, "hall of mirrors");
    }
}

#[test]
fn scene_files_equal_the_reference() {
    for file in scene_files() {
        let loaded = load(&file).unwrap();
        let is_large = loaded.scene.bvh().stats().primitives > 1000;
        // The reference tries every primitive with every ray.
        let (width, height, spp) = if is_large { (20, 15, 1) } else { (64, 48, 2) };
        let settings = Settings { width, height, spp, shadow_samples: 4, ..loaded.settings };
        assert_same(&loaded.scene, &loaded.camera, settings, &file.display().to_string());
    }
}

/// A camera on the z axis that looks at the origin.
fn camera_at(distance: f32, vertical_fov: f32) -> Camera {
    Camera { eye: Vec3::Z * distance, target: Vec3::ZERO, up: Vec3::Y, vertical_fov }
}

#[test]
fn ambient_light_alone_is_ka_times_ia() {
    let mut scene = SceneBuilder::new();
    let ambient = Vec3::new(0.7, 0.3, 0.1);
    scene.add_material(Material { ambient, ..Material::matt(Vec3::ONE) });
    scene.add_spheres(Spheres::one(Vec3::ZERO, 1.0), 0);
    let mut light = Light::new(LightShape::Point(Vec3::Y * 9.0), Vec3::ZERO);
    light.ambient = Vec3::new(0.5, 0.25, 1.0);
    scene.add_light(light);
    let scene = scene.build().unwrap();
    let background = Vec3::splat(0.125);
    let image = picture(&scene, &camera_at(5.0, 40.0), Settings { background, ..settings(64, 64) });
    let lit = (ambient * light.ambient).to_array();
    assert!(image.pixels.iter().all(|pixel| *pixel == lit || *pixel == background.to_array()));
    assert_eq!(image.pixel(32, 32), lit);
    assert_eq!(image.pixel(0, 0), background.to_array());
    // The disc: tan of its angle is 1 / sqrt(24), half the picture is tan 20 degrees.
    let covered = image.pixels.iter().filter(|pixel| **pixel == lit).count() as f32 / 4096.0;
    let radius = (1.0 / 24_f32.sqrt()) / 20_f32.to_radians().tan();
    assert!((covered - radius * radius * std::f32::consts::PI / 4.0).abs() < 0.01, "{covered}");
}

#[test]
fn a_plane_has_the_cosine_of_a_point_light() {
    for side in [1.0, -1.0] {
        let mut scene = SceneBuilder::new();
        scene.add_material(Material::matt(Vec3::splat(0.8)));
        // Turned either way: surfaces have two sides.
        scene.add_quads(
            Quads::one(Vec3::new(-9.0, -9.0 * side, 0.0), Vec3::X * 18.0, Vec3::Y * 18.0 * side),
            0,
        );
        let at = Vec3::new(0.5, -0.25, 2.0);
        scene.add_light(Light::new(LightShape::Point(at), Vec3::ONE));
        let scene = scene.build().unwrap();
        let image = picture(&scene, &camera_at(4.0, 60.0), settings(32, 32));
        let half = 4.0 * 30_f32.to_radians().tan();
        for y in 0..32 {
            for x in 0..32 {
                let across = ((x as f32 + 0.5) / 16.0 - 1.0) * half;
                let down = ((y as f32 + 0.5) / 16.0 - 1.0) * half;
                let to_light = at - Vec3::new(across, -down, 0.0);
                let expected = 0.8 * to_light.normalize().z;
                assert!((image.pixel(x, y)[0] - expected).abs() < 1e-5, "({x}, {y})");
            }
        }
    }
}

#[test]
fn half_of_an_area_light_is_half_the_light() {
    let mut scene = SceneBuilder::new();
    scene.add_material(Material::matt(Vec3::ONE));
    scene.add_quads(Quads::one(Vec3::new(-1.0, -1.0, 0.0), Vec3::X * 2.0, Vec3::Y * 2.0), 0);
    // A wall that ends over the middle of the plane, halfway to the light.
    scene.add_quads(Quads::one(Vec3::new(0.0, -50.0, 5.0), Vec3::X * 50.0, Vec3::Y * 100.0), 0);
    let corner = Vec3::new(-1.0, -1.0, 10.0);
    let shape = LightShape::Quad { corner, edge_u: Vec3::X * 2.0, edge_v: Vec3::Y * 2.0 };
    scene.add_light(Light::new(shape, Vec3::ONE));
    let scene = scene.build().unwrap();
    for shadow_samples in [1, 4, 15, 16, 64] {
        let settings = Settings { shadow_samples, ..settings(64, 64) };
        // So narrow that all pixels look at the middle.
        let image = picture(&scene, &camera_at(1.0, 0.01), settings);
        let mean = image.pixels.iter().map(|pixel| pixel[0]).sum::<f32>() / 4096.0;
        assert!((mean - 0.5).abs() < 0.02, "{shadow_samples} samples: {mean}");
        if shadow_samples == 16 {
            // Stratified: 8 of 16 cells are behind the wall, and its edge is next to no other.
            assert!(image.pixels.iter().all(|pixel| (pixel[0] - 0.5).abs() < 0.07));
        }
    }
}

#[test]
fn a_plane_through_the_origin_does_not_shade_itself() {
    for (edge_u, edge_v) in
        [(Vec3::X, Vec3::Y), (Vec3::new(1.0, 0.3, 0.2), Vec3::new(-0.2, 1.0, 0.1))]
    {
        for size in [1.0e-3, 1.0, 1.0e4] {
            let mut scene = SceneBuilder::new();
            scene.add_material(Material::matt(Vec3::ONE));
            let (edge_u, edge_v) = (edge_u * size * 8.0, edge_v * size * 8.0);
            scene.add_quads(Quads::one((edge_u + edge_v) * -0.5, edge_u, edge_v), 0);
            let grazing = LightShape::Point((edge_u * 4.0).with_z(0.9 * size + 4.0 * edge_u.z));
            scene.add_light(Light::new(grazing, Vec3::ONE));
            let scene = scene.build().unwrap();
            let image = picture(&scene, &camera_at(size, 60.0), settings(64, 64));
            assert!(image.pixels.iter().all(|pixel| pixel[0] > 0.0), "size {size}");
        }
    }
}

#[test]
fn a_mirror_shows_its_share() {
    let mut scene = SceneBuilder::new();
    let color = Vec3::new(0.5, 0.25, 0.125);
    scene.add_material(Material { mirror: 0.75, ..Material::matt(color) });
    scene.add_quads(Quads::one(Vec3::new(-9.0, -9.0, 0.0), Vec3::X * 18.0, Vec3::Y * 18.0), 0);
    let mut light = Light::new(LightShape::Point(Vec3::Z * 9.0), Vec3::ZERO);
    light.ambient = Vec3::ONE;
    scene.add_light(light);
    let scene = scene.build().unwrap();
    let background = Vec3::new(0.0, 0.5, 1.0);
    for (max_bounces, expected) in [(1, color * 0.25 + background * 0.75), (0, color * 0.25)] {
        let settings = Settings { max_bounces, background, ..settings(8, 8) };
        let image = picture(&scene, &camera_at(4.0, 60.0), settings);
        assert!(image.pixels.iter().all(|pixel| *pixel == expected.to_array()));
    }
}

#[test]
fn threads_do_not_change_a_byte() {
    let (scene, camera) = hall_of_mirrors();
    // One thread takes larger tiles than two or eight do.
    for spp in [1, 3] {
        let settings = Settings { spp, ..settings(300, 201) };
        let one = Renderer::new(&scene, &camera, settings).threads(1).render().unwrap();
        for threads in [0, 2, 8] {
            let many = Renderer::new(&scene, &camera, settings).threads(threads).render().unwrap();
            assert!(one.image == many.image, "{threads} threads, {spp} rays a pixel");
            assert_eq!(one.stats.rays(), many.stats.rays());
        }
        let other = picture(&scene, &camera, Settings { seed: 1, ..settings });
        assert!(one.image != other);
    }
}

#[test]
fn a_crop_is_a_part_of_the_picture() {
    let (scene, camera) = hall_of_mirrors();
    for spp in [1, 2] {
        let settings = Settings { spp, ..settings(100, 80) };
        let full = picture(&scene, &camera, settings);
        for crop in [
            Crop { x0: 13, y0: 7, x1: 78, y1: 71 },
            Crop { x0: 99, y0: 79, x1: 100, y1: 80 },
            Crop { x0: 0, y0: 0, x1: 100, y1: 80 },
        ] {
            let part = Renderer::new(&scene, &camera, settings).crop(crop).render().unwrap().image;
            assert_eq!((part.width, part.height), (crop.width(), crop.height()));
            for y in 0..part.height {
                for x in 0..part.width {
                    assert_eq!(part.pixel(x, y), full.pixel(crop.x0 + x, crop.y0 + y), "{crop}");
                }
            }
        }
    }
}

#[test]
fn an_empty_scene_is_background() {
    let scene = SceneBuilder::new().build().unwrap();
    let background = Vec3::new(0.1, 0.2, 0.3);
    let settings = Settings { background, ..settings(40, 40) };
    let image = picture(&scene, &camera_at(1.0, 40.0), settings);
    assert!(image.pixels.iter().all(|pixel| *pixel == background.to_array()));
}

#[test]
fn progress_counts_and_cancelling_stops() {
    let (scene, camera) = hall_of_mirrors();
    let calls = AtomicU32::new(0);
    let on_progress = |progress: &octray::render::Progress| {
        assert_eq!(calls.fetch_add(1, Ordering::Relaxed) + 1, progress.tiles_done);
        assert_eq!(progress.tiles, 12);
    };
    let renderer = Renderer::new(&scene, &camera, settings(128, 96)).on_progress(&on_progress);
    let stats = renderer.render().unwrap().stats;
    assert_eq!(calls.load(Ordering::Relaxed), 12);
    assert_eq!(stats.primary_rays, 128 * 96);
    assert!(stats.mirror_rays > 0 && stats.shadow_rays > 0 && stats.mray_per_second() > 0.0);
    assert!(stats.placed_samples <= stats.shadow_rays);

    let cancel = AtomicBool::new(false);
    let stop_at_three = |progress: &octray::render::Progress| {
        cancel.store(progress.tiles_done >= 3, Ordering::Relaxed);
    };
    let renderer = Renderer::new(&scene, &camera, settings(128, 96)).threads(1);
    let stopped = renderer.on_progress(&stop_at_three).cancel(&cancel).render();
    assert_eq!(stopped.unwrap_err(), RenderError::Cancelled);
}

#[test]
fn what_makes_no_picture_is_refused() {
    let (scene, camera) = hall_of_mirrors();
    let refused = |settings: Settings, crop: Option<Crop>| {
        let renderer = Renderer::new(&scene, &camera, settings);
        let renderer = crop.map_or(renderer.clone(), |crop| renderer.crop(crop));
        renderer.render().unwrap_err().to_string()
    };
    let fine = settings(10, 10);
    assert!(refused(Settings { width: 0, ..fine }, None).contains("`width` is 0"));
    assert!(refused(Settings { width: 4_000_000_000, ..fine }, None).contains("`width`"));
    assert!(refused(settings(60_000, 60_000), None).contains("pixels"));
    assert!(refused(Settings { spp: 0, ..fine }, None).contains("`spp`"));
    assert!(refused(Settings { shadow_samples: 0, ..fine }, None).contains("`shadow_samples`"));
    for crop in [
        Crop { x0: 0, y0: 0, x1: 11, y1: 10 },
        Crop { x0: 5, y0: 0, x1: 5, y1: 10 },
        Crop { x0: 9, y0: 0, x1: 5, y1: 10 },
    ] {
        assert!(refused(fine, Some(crop)).contains("does not lie in the picture of 10x10"));
    }
    let blind = Camera { target: camera.eye, ..camera };
    let error = Renderer::new(&scene, &blind, fine).render().unwrap_err();
    assert!(matches!(error, RenderError::Camera(_)), "{error}");
}
