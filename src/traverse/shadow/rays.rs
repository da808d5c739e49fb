//! Points with few samples, which go as rays of a batch: those of a point one after the other.

use super::placed::{LANES, Placed};
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::{LightSamples, SHADOW_T_MAX};
use crate::ray::RayBatch;
use crate::simd::F32x16;
use crate::traverse::batch;

/// How many rays are traced at once, about: some tiles, whose arrays stay in the cache.
const BATCH_RAYS: usize = 2048;

/// Rays that wait, and the points that they belong to.
pub(super) struct SampleRays {
    points: Vec<usize>,
    rays: RayBatch,
    occluded: Vec<bool>,
    /// The samples that have a ray, then those that are seen: for each point as many as it takes.
    masks: Vec<u16>,
    placed: Placed,
}

impl SampleRays {
    /// For points of so many samples.
    pub(super) fn new(samples: usize) -> Self {
        Self {
            points: Vec::new(),
            rays: RayBatch::with_capacity(BATCH_RAYS + samples),
            occluded: Vec::new(),
            masks: Vec::new(),
            placed: Placed::new(samples),
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
        self.points.push(point);
        let Self { rays, masks, placed, .. } = self;
        let origin = query.points.position.map(|part| part[point]);
        placed.each(query, point, |dir, active| {
            masks.push(active as u16);
            push(rays, origin, dir, active as u16);
        });
        if self.rays.len() >= BATCH_RAYS {
            self.trace(bvh, done);
        }
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
        let per_point = self.placed.registers();
        for (index, &point) in self.points.iter().enumerate() {
            done(point, Seen::Masks(&self.masks[index * per_point..][..per_point]));
        }
        self.rays.clear();
        self.points.clear();
        self.masks.clear();
    }
}

/// Appends the rays of the lanes in `mask`.
fn push(rays: &mut RayBatch, origin: [f32; 3], dir: [F32x16; 3], mask: u16) {
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
