//! Pictures in files: those that are made for a file are those that are made and then written.

use std::fs;

use glam::Vec3;
use octray::render::{Aov, Crop, PictureFile, PictureFormat, RenderStats, Renderer};
use octray::scene::load;
use octray::{Camera, Light, LightShape, Material, Quads, Scene, SceneBuilder, Settings, Spheres};

/// A plane, a ball and a mirror under two lights, and nothing behind them.
fn scene() -> (Scene, Camera) {
    let mut scene = SceneBuilder::new();
    let matt = scene.add_material(Material::matt(Vec3::new(0.9, 0.4, 0.1)));
    let mirror = Material { mirror: 0.7, specular: Vec3::ONE, ..Material::matt(Vec3::splat(0.3)) };
    let mirror = scene.add_material(mirror);
    let (x, z) = (Vec3::X * 6.0, Vec3::Z * 6.0);
    scene.add_quads(Quads::one(Vec3::new(-3.0, -1.0, -3.0), z, x), matt);
    scene.add_spheres(Spheres::one(Vec3::new(-0.7, 0.0, 0.0), 1.0), matt);
    scene.add_spheres(Spheres::one(Vec3::new(1.2, -0.3, 0.4), 0.7), mirror);
    scene.add_light(Light::new(LightShape::Point(Vec3::new(3.0, 5.0, 4.0)), Vec3::splat(0.7)));
    let corner = Vec3::new(-3.0, 4.0, 0.0);
    let area = LightShape::Quad { corner, edge_u: Vec3::X, edge_v: Vec3::Z };
    scene.add_light(Light::new(area, Vec3::new(0.5, 0.6, 0.9)));
    let scene = scene.build().unwrap();
    let camera = Camera::framing(&scene.bounds());
    (scene, camera)
}

fn rays(stats: &RenderStats) -> [u64; 4] {
    [stats.primary_rays, stats.mirror_rays, stats.shadow_rays, stats.placed_samples]
}

#[test]
fn pictures_for_files_are_those_that_are_written() {
    let (scene, camera) = scene();
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = 0;
    // Whole tiles, parts of tiles, and a part of the picture; with samples that fill several waves, too.
    let parts = [
        (70, 66, 1, None),
        (37, 21, 3, Some(Crop { x0: 3, y0: 2, x1: 36, y1: 19 })),
        (32, 32, 9, None),
    ];
    for (width, height, spp, crop) in parts {
        let settings = Settings { width, height, spp, shadow_samples: 3, ..Settings::default() };
        for aov in [Aov::Color, Aov::Normal, Aov::Depth, Aov::Prim] {
            let mut renderer = Renderer::new(&scene, &camera, settings).aov(aov);
            if let Some(crop) = crop {
                renderer = renderer.crop(crop);
            }
            let written = renderer.render().unwrap();
            for (format, extensions) in PictureFormat::ALL {
                let path = folder.path().join("picture").with_extension(extensions[0]);
                let file = PictureFile::new(&path).unwrap();
                assert_eq!(file.format(), format);
                file.write(&written.image).unwrap();
                let expected = fs::read(&path).unwrap();
                fs::remove_file(&path).unwrap();
                let picture = renderer.render_to(&file).unwrap();
                assert!(!path.exists(), "a picture that is not saved is in no file");
                assert_eq!(rays(picture.stats()), rays(&written.stats));
                picture.save().unwrap();
                assert!(fs::read(&path).unwrap() == expected, "{aov:?} as {}", format.name());
                bytes += expected.len();
            }
        }
    }
    assert!(bytes > 300_000, "{bytes} bytes are few for pictures with something on them");
}

#[test]
fn the_file_holds_the_picture_and_nothing_else_is_left() {
    let (scene, camera) = scene();
    let settings = Settings { width: 80, height: 48, shadow_samples: 4, ..Settings::default() };
    let folder = tempfile::tempdir().unwrap();
    let file = PictureFile::new(&folder.path().join("picture.png")).unwrap();
    let renderer = Renderer::new(&scene, &camera, settings);
    renderer.render_to(&file).unwrap().save().unwrap();
    let names: Vec<_> =
        fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(names, ["picture.png"]);
    let found = image::open(folder.path().join("picture.png")).unwrap().into_rgb8();
    let expected = renderer.render().unwrap().image;
    assert_eq!(found.dimensions(), (80, 48));
    for (x, y, code) in found.enumerate_pixels() {
        for (code, linear) in code.0.into_iter().zip(expected.pixel(x, y)) {
            let linear = linear.clamp(0.0, 1.0);
            let curve = if linear <= 0.003_130_8 {
                12.92 * linear
            } else {
                1.055 * linear.powf(1.0 / 2.4) - 0.055
            };
            assert!((f32::from(code) - curve * 255.0).abs() < 0.51, "({x}, {y}): {linear}, {code}");
        }
    }
}

#[test]
fn scene_files_make_the_same_files_both_ways() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box.toml");
    let loaded = load(path.as_ref()).unwrap();
    let settings = Settings { width: 128, height: 96, spp: 1, ..loaded.settings };
    let renderer = Renderer::new(&loaded.scene, &loaded.camera, settings);
    let folder = tempfile::tempdir().unwrap();
    let file = PictureFile::new(&folder.path().join("picture.bmp")).unwrap();
    file.write(&renderer.render().unwrap().image).unwrap();
    let expected = fs::read(folder.path().join("picture.bmp")).unwrap();
    for threads in [1, 2, 3] {
        renderer.clone().threads(threads).render_to(&file).unwrap().save().unwrap();
        assert!(fs::read(folder.path().join("picture.bmp")).unwrap() == expected);
    }
}
