//! What all tiles of a picture share: the scene, the view, the settings, checked once.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{Vec2, Vec3};

use crate::hit::Hit;
use crate::ray::Ray;
use crate::render::RenderError;
use crate::scene::{Camera, Scene, Settings, Shading, Surface, View};
use crate::shading::phong;

/// What the three values of a pixel are.
///
/// All but [`Aov::Color`] are taken by one ray through the pixel's centre, whatever the samples a
/// pixel: the mean of two ids or of a depth and infinity would mean nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Aov {
    /// Linear RGB.
    #[default]
    Color,
    /// The unit shading normal on the viewer's side, in scene coordinates; zero for a miss.
    Normal,
    /// The distance from the camera in scene units, three times; infinity for a miss.
    Depth,
    /// `geom_id`, `prim_id`, 1; and -1, -1, 0 for a miss. Ids above 2^24 are rounded.
    Prim,
}

/// A part of a picture: columns `x0..x1` of the rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Crop {
    /// The first column.
    pub x0: u32,
    /// The first row.
    pub y0: u32,
    /// The column after the last one.
    pub x1: u32,
    /// The row after the last one.
    pub y1: u32,
}

impl Crop {
    /// Pixels from left to right.
    pub fn width(&self) -> u32 {
        self.x1.saturating_sub(self.x0)
    }

    /// Pixels from top to bottom.
    pub fn height(&self) -> u32 {
        self.y1.saturating_sub(self.y0)
    }
}

impl fmt::Display for Crop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{},{},{}", self.x0, self.y0, self.x1, self.y1)
    }
}

/// The picture is to be given up: the tile is not finished.
#[derive(Debug)]
pub(super) struct Cancelled;

/// A picture about to be made.
pub(super) struct Frame<'a> {
    pub(super) scene: &'a Scene,
    pub(super) settings: Settings,
    pub(super) aov: Aov,
    /// The part to render, in full-picture pixels.
    pub(super) area: Crop,
    pub(super) ambient: Vec3,
    pub(super) view: View,
    cancel: Option<&'a AtomicBool>,
}

impl<'a> Frame<'a> {
    pub(super) fn new(
        scene: &'a Scene,
        camera: &Camera,
        settings: &Settings,
        crop: Option<Crop>,
        aov: Aov,
    ) -> Result<Self, RenderError> {
        settings.validate()?;
        let (width, height) = (settings.width, settings.height);
        let area = crop.unwrap_or(Crop { x0: 0, y0: 0, x1: width, y1: height });
        if area.width() == 0 || area.height() == 0 || area.x1 > width || area.y1 > height {
            return Err(RenderError::Crop { crop: area, width, height });
        }
        let mut settings = *settings;
        if aov != Aov::Color {
            settings.spp = 1;
        }
        let view = camera.view(width as f32 / height as f32)?;
        let ambient = phong::ambient_light(scene.lights());
        Ok(Self { scene, settings, aov, area, ambient, view, cancel: None })
    }

    /// The same frame, to be given up when `cancel` becomes true.
    pub(super) fn cancelled_by(self, cancel: Option<&'a AtomicBool>) -> Self {
        Self { cancel, ..self }
    }

    /// Errs if the picture is to be given up.
    pub(super) fn check_cancelled(&self) -> Result<(), Cancelled> {
        let is_cancelled = self.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed));
        if is_cancelled { Err(Cancelled) } else { Ok(()) }
    }

    /// The camera ray through the point `at`, from (0, 0) to (1, 1), of pixel (`x`, `y`).
    pub(super) fn camera_ray(&self, x: u32, y: u32, at: Vec2) -> Ray {
        // In doubles: a float has no bits left for the place in the pixel of a large picture.
        let across = (f64::from(x) + f64::from(at.x)) / f64::from(self.settings.width);
        let down = (f64::from(y) + f64::from(at.y)) / f64::from(self.settings.height);
        Ray::new(self.view.eye, self.view.dir(Vec2::new(across as f32, down as f32)))
    }

    /// True if a pixel is settled by what its camera ray hits, without light.
    pub(super) fn is_unlit(&self) -> bool {
        self.aov != Aov::Color || self.settings.shading == Shading::Flat
    }

    /// The pixel of a frame that is unlit.
    pub(super) fn unlit(&self, ray: &Ray, hit: &Hit, surface: Option<&Surface>) -> Vec3 {
        let Some(surface) = surface else {
            return match self.aov {
                Aov::Color => self.settings.background,
                Aov::Normal => Vec3::ZERO,
                Aov::Depth => Vec3::INFINITY,
                Aov::Prim => Vec3::new(-1.0, -1.0, 0.0),
            };
        };
        match self.aov {
            Aov::Color => self.scene.materials()[surface.material as usize].diffuse,
            Aov::Normal if surface.geometric_normal.dot(ray.dir) > 0.0 => -surface.shading_normal,
            Aov::Normal => surface.shading_normal,
            Aov::Depth => Vec3::splat(hit.t * ray.dir.length()),
            Aov::Prim => Vec3::new(hit.geom_id as f32, hit.prim_id as f32, 1.0),
        }
    }

    /// The distances from the eye between which the scene lies.
    pub(super) fn depth_range(&self) -> [f32; 2] {
        let (bounds, eye) = (self.scene.bounds(), self.view.eye);
        if bounds.is_empty() {
            return [0.0, 0.0];
        }
        let nearest = eye.clamp(bounds.min, bounds.max);
        let farthest = (eye - bounds.min).abs().max((eye - bounds.max).abs());
        [nearest.distance(eye), farthest.length()]
    }
}
