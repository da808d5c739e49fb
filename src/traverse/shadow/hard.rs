//! Points that look at a point light: one ray each, sixteen neighbours in a bundle.

use std::ops::Range;

use super::group::{Aim, LANES, loaded};
use super::placed::facing;
use super::rays::SampleRays;
use super::shafts::GROUPS;
use super::volley::{Apex, Volley};
use super::{BLOCK_POINTS, Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, LaneMask};
use crate::traverse::ones;

/// The largest share of the scene's size over which the points of a bundle may be spread, both axes
/// across added. Pictures stay far below it; points in no order do not, and are traced one by one.
const LARGEST_SHARE: f32 = 0.25;

/// Gives each point of `range`; all samples are one.
pub(super) fn trace<S: LightSamples + ?Sized>(
    bvh: &Bvh,
    query: &Query<'_, S>,
    range: Range<usize>,
    rays: &mut SampleRays,
    done: &mut impl FnMut(usize, Seen<'_>),
) {
    let mut volley = Volley::new(bvh);
    let largest = LARGEST_SHARE * bvh.bounds.diagonal();
    for first in range.clone().step_by(BLOCK_POINTS) {
        let block = first..(first + BLOCK_POINTS).min(range.end);
        let aim = Aim::new(&query.points.range(block.start, block.end), query.light, bvh.extent);
        let mut fits = [0; GROUPS];
        for (group, start) in block.clone().step_by(LANES).enumerate() {
            let count = (block.end - start).min(LANES);
            let load = |from: &[f32]| loaded(from, start, count);
            let origin = query.points.position.map(load);
            let light = query.light.corner;
            let dir = std::array::from_fn(|axis| F32x16::splat(light[axis]) - origin[axis]);
            let facing = facing(query.points.normal.map(|normal| normal.map(load)), &dir);
            let all = (1_u32 << count) - 1;
            let mut fit = aim.fit([aim.axes.turn(dir)]).bits() & all;
            if volley.push(&aim, origin, dir, fit & facing, None) > largest {
                volley.pop();
                volley.push(&aim, origin, dir, 0, None);
                fit = 0;
            }
            ones(all & !fit).for_each(|lane| rays.add(bvh, query, start + lane, done));
            fits[group] = fit;
        }
        let mut groups = fits.iter().zip(block.step_by(LANES));
        volley.trace(&aim, Apex::End(query.light.corner.to_array()), |seen| {
            let Some((&fit, start)) = groups.next() else { return };
            done(start, Seen::Wholly { points: fit, seen });
        });
    }
}
