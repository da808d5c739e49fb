//! Points against an area light: which samples of the light each point sees.
//!
//! A ray batch asks each ray what is in its way. Here, blocks of neighbouring points ask first what
//! is between them and the light at all:
//! 1. A block of points goes down the tree in one descent ([`block`]). A node's boxes are tested
//!    against the shaft around all points and the light, then against the shafts of sixteen groups of
//!    points, then against the points' own, sixteen points side by side ([`group`]).
//! 2. A primitive that is left is tested against the pyramids from sixteen points to the light
//!    ([`crate::kernels::Pyramids`]): some it misses, some it covers wholly.
//! 3. A point that some primitive neither misses nor covers for sure is in penumbra, or behind many
//!    small primitives. Its samples are placed, and sixteen make a bundle of rays. Sixteen bundles go
//!    down the tree as a volley ([`volley`]), culled by beams ([`shafts`]); or as a tile of a batch
//!    ([`tiled`]), whichever was faster lately ([`tempo`]), and as a tile at once if the samples of one
//!    point fill it. The leaves in which the one before met something come first.
//! 4. Points whose directions to the light spread too far for shafts, or are not finite, go as tiles; if
//!    they have so few samples that bundles would not be full, as rays of a batch ([`rays`]). So do all
//!    points for a while if blocks settle too few, of such as have few samples; then tiles hold the samples of
//!    sixteen points, or a cell of the light from sixty-four ([`cells`]), as is faster ([`duel`]).
//!
//! The bundles of a volley hold the samples of one point, or one sample each of sixteen neighbours
//! ([`crossed`]), as [`sampled`] finds better. Points in no order are sorted before ([`order`]).
//!
//! What all of this needs is kept by the thread from query to query ([`super::kept`]).
//!
//! Points that look at a point light are rays of a batch at once ([`hard`]).
//!
//! A point that nothing was between sees the whole light without one ray, and one that a single
//! primitive covers is dark without one.
//!
//! Invariant: a sample is unseen exactly if its ray is occluded, bit for bit.

mod block;
mod bundle;
mod cells;
mod crossed;
mod descent;
mod duel;
mod group;
mod hard;
mod leaf;
mod order;
mod placed;
mod rays;
mod sampled;
mod shafts;
mod tempo;
mod tiled;
mod views;
mod volley;

use std::ops::Range;

use glam::Vec3;

use self::block::Block;
use self::group::LANES;
pub(crate) use self::order::Ordered;
use self::rays::SampleRays;
use self::sampled::Sampled;
use crate::bvh::Bvh;
use crate::points::{LightSamples, Points};

/// How many points a block has.
pub(crate) const BLOCK_POINTS: usize = block::BLOCK_POINTS;

/// Fewer samples than this are traced as rays: a register of lanes would be mostly empty.
const FEWEST_SAMPLES: usize = 4;

/// A parallelogram that shines; with edges of zero a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AreaLight {
    pub(crate) corner: Vec3,
    pub(crate) edge_u: Vec3,
    pub(crate) edge_v: Vec3,
}

/// Points, a light, and samples on it.
#[derive(Clone, Copy)]
pub(crate) struct Query<'a, S: ?Sized> {
    pub(crate) points: Points<'a>,
    pub(crate) light: AreaLight,
    pub(crate) samples: &'a S,
}

/// Which samples a point sees.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Seen<'a> {
    /// Of sixteen points from the given one: those that are given, one bit each, and those among them
    /// that see all samples; the others see none.
    Wholly { points: u32, seen: u32 },
    /// One bit a sample, sixteen samples in each number.
    Masks(&'a [u16]),
}

/// Gives each point of `range` with the samples that it sees, in no particular order.
pub(crate) fn visibility<S: LightSamples + ?Sized>(
    bvh: &Bvh,
    query: &Query<'_, S>,
    range: Range<usize>,
    mut done: impl FnMut(usize, Seen<'_>),
) {
    if query.light.edge_u == Vec3::ZERO && query.light.edge_v == Vec3::ZERO {
        return hard::trace(bvh, query, range, &mut done);
    }
    let samples = query.samples.per_point();
    let mut rays = SampleRays::new(samples);
    if samples < FEWEST_SAMPLES {
        range.for_each(|point| rays.add(bvh, query, point, &mut done));
    } else {
        let mut block = Block::new(bvh, query);
        let mut sampled = Sampled::new(bvh, samples);
        // Where registers of a point's samples are mostly full.
        let is_dense = 4 * samples >= 3 * samples.next_multiple_of(LANES);
        for start in range.clone().step_by(BLOCK_POINTS) {
            let end = (start + BLOCK_POINTS).min(range.end);
            if !block.pays() {
                if is_dense {
                    sampled.trace_all(query, start..end);
                    sampled.give(&mut done);
                } else {
                    (start..end).for_each(|point| rays.add(bvh, query, point, &mut done));
                }
                continue;
            }
            let aim = block.trace(start..end, &mut done);
            block.unsettled().for_each(|point| sampled.add(query, &aim, point));
            if is_dense {
                block.unfit().for_each(|point| sampled.trace_alone(query, point));
            } else {
                block.unfit().for_each(|point| rays.add(bvh, query, point, &mut done));
            }
            sampled.finish(query, &aim, &mut done);
        }
        sampled.leave();
        block.leave();
    }
    rays.trace(bvh, &mut done);
}
