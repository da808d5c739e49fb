//! Shadows: which fraction of a light each point of a wave sees.
//!
//! All points that one light gives something go to the visibility query together. Points that the
//! light gives nothing, because it is behind them or black, are left out. Samples below the plane of
//! the surface count as unseen. A point's samples are placed only if the query asks for them.

use std::sync::atomic::{AtomicU64, Ordering};

use bumpalo::Bump;

use crate::error::ShapeError;
use crate::points::{LightSamples, Points};
use crate::render::arena::{array, pack, sixteen};
use crate::render::camera::Paths;
use crate::render::colors::Colors;
use crate::render::frame::{Cancelled, Frame};
use crate::render::shade::ShadingPoints;
use crate::render::stats::{Lap, RenderStats};
use crate::scene::{LANES, LightShape, normalized_or};
use crate::shading::sampling::{SampleKey, StratifiedSet, light_dimension};
use crate::shading::{phong, phong_lanes};
use crate::simd::{F32x16, LaneMask, Lanes, each};

/// The points that look at a light, in SoA arrays.
pub(super) struct ShadowBatch<'b> {
    len: usize,
    path: &'b mut [u32],
    position: [&'b mut [f32]; 3],
    normal: [&'b mut [f32]; 3],
    /// What the path gains if its point sees the whole light.
    gain: [&'b mut [f32]; 3],
    fraction: &'b mut [f32],
}

/// The stratified sets of the points' paths.
struct PathSets<'a> {
    paths: &'a Paths<'a>,
    path: &'a [u32],
    dimension: u64,
    count: u32,
    /// Any set of so many points.
    set: StratifiedSet,
    /// How many points have asked for theirs.
    asked: AtomicU64,
}

impl LightSamples for PathSets<'_> {
    fn per_point(&self) -> usize {
        self.count as usize
    }

    fn check(&self, points: usize) -> Result<(), ShapeError> {
        ShapeError::check("paths", self.path.len(), "points", points)
    }

    fn place(&self, point: usize, u: &mut [f32], v: &mut [f32]) {
        // One thread asks: this is no place where others could come between.
        self.asked.store(self.asked.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
        let key = self.paths.key(self.path[point]).dimension(self.dimension);
        self.set.named(key).fill(0, u, v);
    }
}

impl<'b> ShadowBatch<'b> {
    /// For up to `points` points at once.
    pub(super) fn new_in(frame: &Frame<'_>, points: usize, arena: &'b Bump) -> Self {
        let capacity = if frame.scene.lights().is_empty() { 0 } else { points };
        let floats = || array(capacity, 0.0, arena);
        Self {
            len: 0,
            path: array(capacity, 0, arena),
            position: [floats(), floats(), floats()],
            normal: [floats(), floats(), floats()],
            gain: [floats(), floats(), floats()],
            fraction: floats(),
        }
    }

    /// Forgets all points.
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds the light number `of.1`, seen after `of.0` bounces, to the colours of the paths of the points,
    /// which look at that light.
    pub(super) fn light(
        &mut self,
        frame: &Frame<'_>,
        of: (u32, usize),
        (paths, colors): (&Paths<'_>, &mut Colors<'_>),
        stats: &mut RenderStats,
    ) -> Result<(), Cancelled> {
        frame.check_cancelled()?;
        let (bounce, index) = of;
        let lights = frame.scene.lights();
        let light = &lights[index];
        let mut lap = Lap::start();
        let count = match light.shape {
            LightShape::Point(_) => 1,
            LightShape::Quad { .. } => frame.settings.shadow_samples,
        };
        let len = self.len;
        let path = &self.path[..len];
        let dimension = light_dimension(bounce, index, lights.len());
        let set = StratifiedSet::new(SampleKey::new(0, 0, 0, 0), count);
        let asked = AtomicU64::new(0);
        let samples = PathSets { paths, path, dimension, count, set, asked };
        let [x, y, z] = self.position.each_ref().map(|part| &part[..len]);
        let [nx, ny, nz] = self.normal.each_ref().map(|part| &part[..len]);
        let answered = Points::new(x, y, z)
            .and_then(|points| points.with_normals(nx, ny, nz))
            .and_then(|points| {
                let fraction = &mut self.fraction[..len];
                frame.scene.visibility(&points, &light.shape, &samples, fraction)
            });
        debug_assert!(answered.is_ok(), "all arrays have an entry a point");
        stats.phases.shadow += lap.seconds();
        stats.shadow_rays += len as u64 * u64::from(count);
        stats.placed_samples += samples.asked.into_inner() * u64::from(count);

        for start in (0..len).step_by(LANES) {
            let mask = (1 << (len - start).min(LANES)) - 1;
            let fraction = F32x16::load(&self.fraction[start..]);
            let color = each(|axis| F32x16::load(&self.gain[axis][start..]) * fraction);
            colors.add(sixteen(self.path, start), mask, &color);
        }
        stats.phases.shade += lap.seconds();
        Ok(())
    }

    /// Adds those of sixteen points that a light gives something.
    #[inline(always)]
    pub(super) fn push(&mut self, frame: &Frame<'_>, light: usize, points: &ShadingPoints) {
        let light = &frame.scene.lights()[light];
        let center = phong::light_center(&light.shape);
        let zero = F32x16::splat(0.0);
        let to_light = each(|axis| F32x16::splat(center[axis]) - points.position[axis]);
        let to_light = normalized_or(&to_light, &[zero; 3]);
        let materials = (frame.scene.materials(), &points.material);
        let (normal, dir) = (&points.normal, &points.dir);
        let color = phong_lanes::reflected(light, materials, normal, &to_light, dir);
        // Colours are not negative.
        let any = Lanes::gt(color[0] + color[1] + color[2], zero);
        let mask = any.bits() & points.mask;
        for (axis, color) in color.into_iter().enumerate() {
            pack(&points.origin[axis].to_array(), mask, self.position[axis], self.len);
            pack(&points.geometric_normal[axis].to_array(), mask, self.normal[axis], self.len);
            let gain = color * points.weight;
            pack(&gain.to_array(), mask, self.gain[axis], self.len);
        }
        pack(&points.path, mask, self.path, self.len);
        self.len += mask.count_ones() as usize;
    }
}
