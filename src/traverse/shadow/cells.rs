//! Tiles across points: sixty-four neighbours look at one cell of the light.
//!
//! A tile of sixteen points with sixteen samples each holds the whole view of the light. One of four times
//! as many points with four samples of one number each is as many rays, and a quarter as wide where it
//! meets something far from the points. Before many small things, or a large light, that is up to 1.5 times as
//! fast; where the points lie among small triangles, down to 0.65 times, since the rays of a bundle no longer
//! start at one point. So it is one of two ways to choose from by the clock ([`super::duel`]).

use std::ops::Range;

use super::Query;
use super::crossed::transposed;
use super::group::loaded;
use super::placed::{LANES, facing};
use super::tiled::Tiled;
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::simd::{F32x16, Lanes, each};

/// How many points look at a cell together.
pub(super) const CELL_POINTS: usize = 64;

/// The samples of up to [`CELL_POINTS`] points, and which of them are seen.
pub(super) struct Cells {
    /// Those of one point side by side.
    own: [Vec<f32>; 2],
    /// Those of one number side by side, [`CELL_POINTS`] of each.
    across: [Vec<f32>; 2],
    /// For each sixteen points the points that see each sample, one bit each; padded to whole registers.
    seen: Vec<u16>,
    registers: usize,
}

impl Cells {
    /// For points of so many samples.
    pub(super) fn new(samples: usize) -> Self {
        let arrays = |len: usize| [vec![0.0; len], vec![0.0; len]];
        let padded = samples.next_multiple_of(LANES);
        Self {
            own: arrays(samples),
            across: arrays(samples * CELL_POINTS),
            seen: vec![0; padded * CELL_POINTS / LANES],
            registers: padded / LANES,
        }
    }

    /// Traces the samples of at most [`CELL_POINTS`] points, and appends the samples that each sees, sixteen
    /// in a number.
    pub(super) fn trace<S: LightSamples + ?Sized>(
        &mut self,
        bvh: &Bvh,
        query: &Query<'_, S>,
        points: Range<usize>,
        tiled: &mut Tiled,
        masks: &mut Vec<u16>,
    ) {
        self.place(query, points.clone());
        let Self { own, across, seen, registers } = self;
        seen.fill(0);
        let groups = points.len().div_ceil(LANES);
        // All points of a sample, then of the next one: sixteen groups are four samples.
        for sample in 0..own[0].len() {
            for group in 0..groups {
                let start = points.start + group * LANES;
                let count = (points.end - start).min(LANES);
                let load = |from: &[f32]| loaded(from, start, count);
                let origin = each(|axis| load(query.points.position[axis]));
                let at =
                    |of: usize| F32x16::load(&across[of][sample * CELL_POINTS + group * LANES..]);
                let dir = query.light.directions(origin, at(0), at(1));
                let normal = query.points.normal.map(|normal| each(|axis| load(normal[axis])));
                let active = facing(normal, &dir) & ((1_u32 << count) - 1);
                if active != 0 {
                    let place = group * *registers * LANES + sample;
                    tiled.push(origin, dir, active, place);
                }
                if tiled.is_full() {
                    tiled.trace(bvh, |place, lanes| seen[place] = lanes as u16);
                }
            }
        }
        tiled.trace(bvh, |place, lanes| seen[place] = lanes as u16);
        self.append(points.len(), masks);
    }

    fn place<S: LightSamples + ?Sized>(&mut self, query: &Query<'_, S>, points: Range<usize>) {
        let Self { own: [u, v], across, .. } = self;
        for (lane, point) in points.enumerate() {
            query.samples.place(point, u, v);
            for (across, own) in across.iter_mut().zip([&*u, &*v]) {
                for (to, &from) in across.iter_mut().skip(lane).step_by(CELL_POINTS).zip(own) {
                    *to = from;
                }
            }
        }
    }

    /// Turns the bits of samples, a point each, to bits of points, a sample each.
    fn append(&self, points: usize, masks: &mut Vec<u16>) {
        let first = masks.len();
        masks.resize(first + points * self.registers, 0);
        for (block, seen) in self.seen.as_chunks::<LANES>().0.iter().enumerate() {
            let (group, register) = (block / self.registers, block % self.registers);
            let turned = transposed(*seen);
            let here = points.saturating_sub(group * LANES).min(LANES);
            for (lane, &own) in turned[..here].iter().enumerate() {
                masks[first + (group * LANES + lane) * self.registers + register] = own;
            }
        }
    }
}
