//! Points whose samples go as rays of a batch, the samples of a point one after the other.
//!
//! Rays are made sixteen at a time, with the operations of `LightShape::at` and in its order.

use super::{AreaLight, Query, Seen};
use crate::bvh::Bvh;
use crate::points::{LightSamples, Points, SHADOW_T_MAX};
use crate::ray::RayBatch;
use crate::simd::{F32x16, LaneMask, Lanes};
use crate::traverse::batch;

/// How many rays are traced at once, about: some tiles, whose arrays stay in the cache.
const BATCH_RAYS: usize = 2048;

/// Samples in one mask.
const LANES: usize = 16;

/// Rays that wait, and the points that they belong to.
pub(super) struct SampleRays {
    points: Vec<usize>,
    rays: RayBatch,
    occluded: Vec<bool>,
    /// The samples that have a ray, then those that are seen: for each point as many as it takes.
    masks: Vec<u16>,
    /// How many samples a point has, and room for whole registers of them.
    samples: usize,
    u: Vec<f32>,
    v: Vec<f32>,
}

impl SampleRays {
    /// For points of so many samples.
    pub(super) fn new(samples: usize) -> Self {
        let padded = samples.next_multiple_of(LANES);
        Self {
            points: Vec::new(),
            rays: RayBatch::with_capacity(BATCH_RAYS + samples),
            occluded: Vec::new(),
            masks: Vec::new(),
            samples,
            u: vec![0.0; padded],
            v: vec![0.0; padded],
        }
    }

    /// Adds a point, and traces all if there are enough.
    pub(super) fn add<S: LightSamples + ?Sized>(
        &mut self,
        bvh: &Bvh,
        query: &Query<'_, S>,
        point: usize,
        done: &mut impl FnMut(usize, Seen<'_>),
    ) {
        let samples = self.samples;
        self.points.push(point);
        query.samples.place(point, &mut self.u[..samples], &mut self.v[..samples]);
        let origin = query.points.position.map(|part| part[point]);
        for start in (0..samples).step_by(LANES) {
            let (u, v) = (F32x16::load(&self.u[start..]), F32x16::load(&self.v[start..]));
            let dir = query.light.directions(origin, u, v);
            let active = (1_u32 << (samples - start).min(LANES)) - 1;
            let mask = (facing(&query.points, point, &dir) & active) as u16;
            self.masks.push(mask);
            self.push(origin, dir, mask);
        }
        if self.rays.len() >= BATCH_RAYS {
            self.trace(bvh, done);
        }
    }

    /// Appends the rays of the lanes in `mask`.
    fn push(&mut self, origin: [f32; 3], dir: [F32x16; 3], mask: u16) {
        let rays = &mut self.rays;
        let to = [&mut rays.dir_x, &mut rays.dir_y, &mut rays.dir_z];
        for (to, lanes) in to.into_iter().zip(dir) {
            let lanes = lanes.to_array();
            if mask == u16::MAX {
                to.extend_from_slice(&lanes);
            } else {
                to.extend((0..LANES).filter(|lane| mask >> lane & 1 != 0).map(|lane| lanes[lane]));
            }
        }
        let len = rays.dir_x.len();
        rays.origin_x.resize(len, origin[0]);
        rays.origin_y.resize(len, origin[1]);
        rays.origin_z.resize(len, origin[2]);
        rays.t_min.resize(len, 0.0);
        rays.t_max.resize(len, SHADOW_T_MAX);
    }

    /// Traces all that wait.
    pub(super) fn trace(&mut self, bvh: &Bvh, done: &mut impl FnMut(usize, Seen<'_>)) {
        self.occluded.resize(self.rays.len(), false);
        batch::occluded(bvh, self.rays.as_rays(), &mut self.occluded);
        let mut rest = &self.occluded[..];
        for mask in &mut self.masks {
            if let (u16::MAX, Some((own, others))) = (*mask, rest.split_first_chunk::<LANES>()) {
                rest = others;
                *mask = (0..LANES).fold(0, |seen, lane| seen | u16::from(!own[lane]) << lane);
                continue;
            }
            let (own, others) = rest.split_at(mask.count_ones() as usize);
            rest = others;
            let mut lanes = *mask;
            for &occluded in own {
                *mask ^= u16::from(occluded) << lanes.trailing_zeros();
                lanes &= lanes - 1;
            }
        }
        let per_point = self.samples.div_ceil(LANES);
        for (index, &point) in self.points.iter().enumerate() {
            done(point, Seen::Masks(&self.masks[index * per_point..][..per_point]));
        }
        self.rays.clear();
        self.points.clear();
        self.masks.clear();
    }
}

impl AreaLight {
    /// From a point to samples of the light.
    #[inline(always)]
    fn directions(&self, origin: [f32; 3], u: F32x16, v: F32x16) -> [F32x16; 3] {
        let (zero, one) = (F32x16::splat(0.0), F32x16::splat(1.0));
        // Of NaN, `max` gives the other.
        let inside = |at| Lanes::min(Lanes::max(at, zero), one);
        let (u, v) = (inside(u), inside(v));
        std::array::from_fn(|axis| {
            let part = |of: glam::Vec3| F32x16::splat(of[axis]);
            let target = part(self.corner) + part(self.edge_u) * u + part(self.edge_v) * v;
            target - F32x16::splat(origin[axis])
        })
    }
}

/// The lanes that leave the surface of a point on its outer side: the operations of
/// [`Points::faces`].
#[inline(always)]
fn facing(points: &Points<'_>, point: usize, dir: &[F32x16; 3]) -> u32 {
    let Some(normal) = points.normal else { return u32::MAX };
    let part = |axis: usize| dir[axis] * F32x16::splat(normal[axis][point]);
    Lanes::gt(part(0) + part(1) + part(2), F32x16::splat(0.0)).bits()
}
