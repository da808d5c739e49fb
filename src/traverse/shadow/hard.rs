//! Points that look at a point light: one ray each, as tiles.
//!
//! Nothing is shared by the samples of a point here, and rays that end at one point are what tiles are
//! good at. So sixteen neighbours make a bundle, straight from the points' own arrays.

use std::ops::Range;

use super::group::{LANES, loaded};
use super::placed::facing;
use super::tiled::Tiled;
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, each};

/// Gives each point of `range`; all samples are one.
pub(super) fn trace<S: LightSamples + ?Sized>(
    bvh: &Bvh,
    query: &Query<'_, S>,
    range: Range<usize>,
    done: &mut impl FnMut(usize, Seen<'_>),
) {
    let mut tiled = Tiled::taken(bvh);
    let light = query.light.corner;
    let mut give = |tiled: &mut Tiled| {
        tiled.trace(bvh, |start, seen| {
            let points = (1_u32 << (range.end - start).min(LANES)) - 1;
            done(start, Seen::Wholly { points, seen });
        });
    };
    for start in range.clone().step_by(LANES) {
        let count = (range.end - start).min(LANES);
        let load = |from: &[f32]| loaded(from, start, count);
        let origin = each(|axis| load(query.points.position[axis]));
        let dir = each(|axis| F32x16::splat(light[axis]) - origin[axis]);
        let normal = query.points.normal.map(|normal| each(|axis| load(normal[axis])));
        let active = facing(normal, &dir) & ((1_u32 << count) - 1);
        tiled.push(origin, dir, active, start);
        if tiled.is_full() {
            give(&mut tiled);
        }
    }
    give(&mut tiled);
    tiled.leave();
}
