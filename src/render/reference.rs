//! Whole pictures by plain recursion: one ray at a time, through a loop over all primitives.
//!
//! It shares the formula and the sample positions with the tiles, and no other code: rays, hits,
//! normals and sums are worked out here once more, as the text of `shading::phong` and of
//! `ARCHITECTURE.md` has them. Tests hold the tiles equal to it. It is slow on purpose.

use glam::Vec3;

use crate::hit::Hit;
use crate::ray::Ray;
use crate::render::{Aov, Crop, Image, RenderError, SHADOW_T_MAX, frame::Frame};
use crate::scene::{Camera, LightShape, Scene, Settings, Shading};
use crate::shading::phong;
use crate::shading::sampling::{PixelSamples, SampleKey, StratifiedSet, light_dimension};

/// The picture that [`crate::render::Renderer`] must make: the same hits bit for bit, the colours
/// but for the order of sums.
///
/// # Errors
/// Those of [`crate::render::Renderer::render`].
pub fn render(
    scene: &Scene,
    camera: &Camera,
    settings: Settings,
    crop: Option<Crop>,
    aov: Aov,
) -> Result<Image, RenderError> {
    // Checks, the view, and the way of a camera ray are the frame's.
    let frame = Frame::new(scene, camera, &settings, crop, aov)?;
    let area = frame.area;
    let mut image = Image::new(area.width(), area.height(), aov)?;
    image.depth_range = frame.depth_range();
    let mut pixels = image.pixels.iter_mut();
    for y in area.y0..area.y1 {
        for x in area.x0..area.x1 {
            let positions = PixelSamples::new(x, y, frame.settings.spp, settings.seed);
            let mut sum = Vec3::ZERO;
            for sample in 0..frame.settings.spp {
                let ray = frame.camera_ray(x, y, positions.at(sample));
                let key = SampleKey::new(x, y, sample, settings.seed);
                let path = Path { scene, settings, key };
                sum += if aov == Aov::Color { path.color(&ray, 0) } else { path.look(&ray, aov) };
            }
            let mean = sum / frame.settings.spp as f32;
            pixels.next().expect("one pixel a turn").copy_from_slice(&mean.to_array());
        }
    }
    Ok(image)
}

struct Path<'a> {
    scene: &'a Scene,
    settings: Settings,
    key: SampleKey,
}

impl Path<'_> {
    /// The colour that comes back along `ray`, which left after `bounce` mirrors.
    fn color(&self, ray: &Ray, bounce: u32) -> Vec3 {
        let Some(hit) = self.scene.intersect_reference(ray) else {
            return self.settings.background;
        };
        let material = self.scene.material(hit.geom_id);
        if self.settings.shading == Shading::Flat {
            return material.diffuse;
        }
        let mut color = Vec3::ZERO;
        if material.mirror < 1.0 {
            color += self.phong(ray, &hit, bounce) * (1.0 - material.mirror);
        }
        if material.mirror > 0.0 && bounce < self.settings.max_bounces {
            let surface = self.scene.surface(ray, &hit);
            let side = side_of(surface.geometric_normal, ray);
            let geometric = surface.geometric_normal * side;
            let to_viewer = -ray.dir.normalize();
            let mut dir = phong::mirrored(to_viewer, surface.shading_normal * side);
            if dir.dot(geometric) <= 0.0 {
                dir = phong::mirrored(to_viewer, geometric);
            }
            let reflected = Ray::new(surface.offset_origin(dir), dir);
            color += self.color(&reflected, bounce + 1) * material.mirror;
        }
        color
    }

    /// `Ia Ka` and what each light gives, by the fraction that the point sees.
    fn phong(&self, ray: &Ray, hit: &Hit, bounce: u32) -> Vec3 {
        let surface = self.scene.surface(ray, hit);
        let material = self.scene.material(hit.geom_id);
        let side = side_of(surface.geometric_normal, ray);
        let lights = self.scene.lights();
        let mut color = phong::ambient_light(lights) * material.ambient;
        for (index, light) in lights.iter().enumerate() {
            let to_light = phong::light_center(&light.shape) - surface.position;
            let seen = phong::reflected(
                light,
                material,
                surface.shading_normal * side,
                to_light.normalize_or_zero(),
                -ray.dir.normalize(),
            );
            let origin = surface.offset_origin(surface.geometric_normal * side);
            let arrives = |target: Vec3| {
                let dir = target - origin;
                let shadow = Ray { origin, dir, t_min: 0.0, t_max: SHADOW_T_MAX };
                let above = dir.dot(surface.geometric_normal * side) > 0.0;
                above && self.scene.intersect_reference(&shadow).is_none()
            };
            let fraction = match light.shape {
                _ if seen == Vec3::ZERO => 0.0,
                LightShape::Point(position) => f32::from(u8::from(arrives(position))),
                LightShape::Quad { corner, edge_u, edge_v } => {
                    let count = self.settings.shadow_samples;
                    let dimension = light_dimension(bounce, index, lights.len());
                    let set = StratifiedSet::new(self.key.dimension(dimension), count);
                    let points = (0..count).map(|sample| set.point(sample));
                    let targets = points.map(|at| corner + edge_u * at.x + edge_v * at.y);
                    targets.filter(|&target| arrives(target)).count() as f32 / count as f32
                }
            };
            color += seen * fraction;
        }
        color
    }

    /// What a picture other than of colour has for `ray`.
    fn look(&self, ray: &Ray, aov: Aov) -> Vec3 {
        match (aov, self.scene.intersect_reference(ray)) {
            (Aov::Color, _) => self.color(ray, 0),
            (Aov::Normal, None) => Vec3::ZERO,
            (Aov::Depth, None) => Vec3::INFINITY,
            (Aov::Prim, None) => Vec3::new(-1.0, -1.0, 0.0),
            (Aov::Normal, Some(hit)) => {
                let surface = self.scene.surface(ray, &hit);
                surface.shading_normal * side_of(surface.geometric_normal, ray)
            }
            (Aov::Depth, Some(hit)) => Vec3::splat(hit.t * ray.dir.length()),
            (Aov::Prim, Some(hit)) => Vec3::new(hit.geom_id as f32, hit.prim_id as f32, 1.0),
        }
    }
}

/// What puts `normal` on the side that `ray` comes from: 1 or -1.
fn side_of(normal: Vec3, ray: &Ray) -> f32 {
    if normal.dot(ray.dir) > 0.0 { -1.0 } else { 1.0 }
}
