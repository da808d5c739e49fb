//! Points that look at a point light: one ray each, as batches.
//!
//! Nothing is shared by the samples of a point here, and rays that end at one point are what tiles are
//! good at. So the rays are made side by side, and their origins are the points' own arrays.

use std::ops::Range;

use super::group::{LANES, loaded};
use super::placed::facing;
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::{LightSamples, SHADOW_T_MAX};
use crate::ray::Rays;
use crate::simd::{F32x16, Lanes, each};
use crate::traverse::batch;

/// How many points are traced at once: some tiles, whose arrays stay in the cache.
const BATCH_POINTS: usize = 2048;

/// Gives each point of `range`; all samples are one.
pub(super) fn trace<S: LightSamples + ?Sized>(
    bvh: &Bvh,
    query: &Query<'_, S>,
    range: Range<usize>,
    done: &mut impl FnMut(usize, Seen<'_>),
) {
    let room = range.len().min(BATCH_POINTS).next_multiple_of(LANES);
    let mut dir = [(); 3].map(|()| vec![0.0; room]);
    let t_min = vec![0.0; room];
    let mut t_max = vec![0.0; room];
    let mut facing_lanes = vec![0; room / LANES];
    let mut occluded = vec![false; room];
    let light = query.light.corner;
    for first in range.clone().step_by(BATCH_POINTS) {
        let len = BATCH_POINTS.min(range.end - first);
        for start in (0..len).step_by(LANES) {
            let count = (len - start).min(LANES);
            let load = |from: &[f32]| loaded(from, first + start, count);
            let origin = query.points.position.map(load);
            let to = each(|axis| F32x16::splat(light[axis]) - origin[axis]);
            for (dir, to) in dir.iter_mut().zip(to) {
                dir[start..start + LANES].copy_from_slice(to.as_array());
            }
            let all = (1_u32 << count) - 1;
            let lanes = facing(query.points.normal.map(|normal| normal.map(load)), &to) & all;
            facing_lanes[start / LANES] = lanes;
            // An empty range: no ray of a surface that faces away is traced.
            let (to_light, nowhere) = (F32x16::splat(SHADOW_T_MAX), F32x16::splat(-1.0));
            let end = Lanes::select(F32x16::mask(lanes), to_light, nowhere);
            t_max[start..start + LANES].copy_from_slice(end.as_array());
        }
        let points = query.points.position.map(|part| &part[first..first + len]);
        let rays = Rays {
            origin_x: points[0],
            origin_y: points[1],
            origin_z: points[2],
            dir_x: &dir[0][..len],
            dir_y: &dir[1][..len],
            dir_z: &dir[2][..len],
            t_min: &t_min[..len],
            t_max: &t_max[..len],
        };
        batch::occluded(bvh, rays, &mut occluded[..len]);
        for (group, occluded) in occluded[..len].chunks(LANES).enumerate() {
            let free = (0..)
                .zip(occluded)
                .fold(0, |free, (lane, &occluded)| free | u32::from(!occluded) << lane);
            let points = (1_u32 << occluded.len()) - 1;
            let seen = free & facing_lanes[group];
            done(first + group * LANES, Seen::Wholly { points, seen });
        }
    }
}
