//! Shadows: which fraction of a light each point of a wave sees.
//!
//! All points that one light gives something go to the visibility query together. Points that the
//! light gives nothing, because it is behind them or black, are left out. Samples below the plane of
//! the surface count as unseen. A point's samples are placed only if the query asks for them.

use bumpalo::Bump;
use bumpalo::collections::Vec as ArenaVec;
use glam::Vec3;

use crate::error::ShapeError;
use crate::points::{LightSamples, Points};
use crate::render::frame::{Cancelled, Frame};
use crate::render::stats::{Lap, RenderStats};
use crate::render::wave::{Paths, ShadingPoint};
use crate::scene::LightShape;
use crate::shading::phong;
use crate::shading::sampling::{SampleKey, StratifiedSet, light_dimension};

/// The points that look at a light, in SoA arrays.
pub(super) struct ShadowBatch<'b> {
    position: [ArenaVec<'b, f32>; 3],
    normal: [ArenaVec<'b, f32>; 3],
    keys: ArenaVec<'b, SampleKey>,
    gains: ArenaVec<'b, Gain>,
    fraction: ArenaVec<'b, f32>,
}

/// What a path gains if its point sees the whole light.
struct Gain {
    path: u32,
    color: Vec3,
}

/// The stratified sets that keys name.
struct KeyedSets<'a> {
    keys: &'a [SampleKey],
    count: u32,
}

impl LightSamples for KeyedSets<'_> {
    fn per_point(&self) -> usize {
        self.count as usize
    }

    fn check(&self, points: usize) -> Result<(), ShapeError> {
        ShapeError::check("keys", self.keys.len(), "points", points)
    }

    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
        StratifiedSet::new(self.keys[point], self.count).fill(u, v);
    }
}

impl<'b> ShadowBatch<'b> {
    /// For up to `points` points at once.
    pub(super) fn new_in(frame: &Frame<'_>, points: usize, arena: &'b Bump) -> Self {
        let capacity = if frame.scene.lights().is_empty() { 0 } else { points };
        let floats = || ArenaVec::with_capacity_in(capacity, arena);
        Self {
            position: [floats(), floats(), floats()],
            normal: [floats(), floats(), floats()],
            keys: ArenaVec::with_capacity_in(capacity, arena),
            gains: ArenaVec::with_capacity_in(capacity, arena),
            fraction: floats(),
        }
    }

    fn clear(&mut self) {
        self.position.iter_mut().chain(&mut self.normal).for_each(|part| part.clear());
        self.keys.clear();
        self.gains.clear();
    }

    /// Adds the light number `of.1`, seen after `of.0` bounces, to the colours of the points'
    /// paths.
    pub(super) fn light(
        &mut self,
        frame: &Frame<'_>,
        of: (u32, usize),
        points: &[ShadingPoint],
        paths: &mut Paths<'_>,
        stats: &mut RenderStats,
    ) -> Result<(), Cancelled> {
        frame.check_cancelled()?;
        let (bounce, index) = of;
        let lights = frame.scene.lights();
        let light = &lights[index];
        let center = phong::light_center(&light.shape);
        let dimension = light_dimension(bounce, index, lights.len());
        let mut lap = Lap::start();
        self.clear();
        for point in points {
            let material = &frame.scene.materials()[point.material as usize];
            let to_light = (center - point.position).normalize_or_zero();
            let color = phong::reflected(light, material, point.normal, to_light, point.to_viewer);
            if color == Vec3::ZERO {
                continue;
            }
            for axis in 0..3 {
                self.position[axis].push(point.origin[axis]);
                self.normal[axis].push(point.geometric_normal[axis]);
            }
            self.keys.push(paths.key[point.path as usize].dimension(dimension));
            self.gains.push(Gain { path: point.path, color: color * point.weight });
        }
        stats.phases.shade += lap.seconds();

        let count = match light.shape {
            LightShape::Point(_) => 1,
            LightShape::Quad { .. } => frame.settings.shadow_samples,
        };
        let samples = KeyedSets { keys: &self.keys, count };
        self.fraction.resize(self.gains.len(), 0.0);
        let ([x, y, z], [nx, ny, nz]) = (&self.position, &self.normal);
        let asked = Points::new(x, y, z)
            .and_then(|points| points.with_normals(nx, ny, nz))
            .and_then(|points| {
                frame.scene.visibility(&points, &light.shape, &samples, &mut self.fraction)
            });
        debug_assert!(asked.is_ok(), "all arrays have an entry a point");
        stats.phases.shadow += lap.seconds();
        stats.shadow_rays += self.gains.len() as u64 * u64::from(count);

        for (gain, &fraction) in self.gains.iter().zip(&self.fraction) {
            paths.color[gain.path as usize] += gain.color * fraction;
        }
        stats.phases.shade += lap.seconds();
        Ok(())
    }
}
