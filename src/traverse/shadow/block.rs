//! A block: up to 256 points that go down the tree together.

use std::ops::Range;

use super::descent::{Party, Waiting, descend};
use super::group::{Aim, LANES, PointGroup, around};
use super::shafts::{GROUPS, Shafts, Turned, one_box};
use super::{Query, Seen};
use crate::bvh::{Bvh, Node};
use crate::kernels::{Pyramids, Verdict};
use crate::points::{LightSamples, SHADOW_T_MAX};
use crate::simd::{F32x16, LaneMask};
use crate::traverse::{ones, stack_size};

/// How many points a block has: sixteen groups of sixteen.
pub(super) const BLOCK_POINTS: usize = GROUPS * LANES;

/// Up to 256 points, and the arrays that they need.
pub(super) struct Block<'a, S: ?Sized> {
    bvh: &'a Bvh,
    query: &'a Query<'a, S>,
    points: Range<usize>,
    groups: Vec<PointGroup>,
    stack: Vec<Waiting>,
    /// The groups with a point that is not settled.
    live: u32,
    /// Where the light ends along the main axis, plus the margin.
    end: F32x16,
}

impl<'a, S: LightSamples + ?Sized> Block<'a, S> {
    pub(super) fn new(bvh: &'a Bvh, query: &'a Query<'a, S>) -> Self {
        Self {
            bvh,
            query,
            points: 0..0,
            groups: Vec::with_capacity(GROUPS),
            stack: vec![Waiting::default(); stack_size(bvh)],
            live: 0,
            end: F32x16::splat(0.0),
        }
    }

    /// Gives each point of `points`, of which there are at most [`BLOCK_POINTS`], but for those that
    /// [`Block::unsettled`] and [`Block::unfit`] have afterwards. Returns how the shafts run.
    pub(super) fn trace(
        &mut self,
        points: Range<usize>,
        done: &mut impl FnMut(usize, Seen<'_>),
    ) -> Aim {
        let own = self.query.points.range(points.start, points.end);
        let aim = Aim::new(&own, self.query.light, self.bvh.extent);
        self.groups.clear();
        self.live = 0;
        for start in points.clone().step_by(LANES) {
            let count = (points.end - start).min(LANES);
            let group = PointGroup::new(self.query, start, count, &aim);
            self.live |= u32::from(group.live != 0) << self.groups.len();
            self.groups.push(group);
        }
        self.points = points;
        self.end = F32x16::splat(aim.end);
        if self.live != 0 && !self.bvh.nodes.is_empty() {
            let shafts = Shafts::new(aim, around(self.groups.iter()));
            let mut stack = std::mem::take(&mut self.stack);
            descend(self.bvh, &shafts, self, &mut stack);
            self.stack = stack;
        }
        self.give(done);
        aim
    }

    /// The points whose samples are to be traced by rays.
    pub(super) fn unsettled(&self) -> impl Iterator<Item = usize> {
        self.points_of(|group| group.unsure & group.fit)
    }

    /// Such points that have no shaft.
    pub(super) fn unfit(&self) -> impl Iterator<Item = usize> {
        self.points_of(|group| group.unsure & !group.fit)
    }

    fn points_of(&self, which: fn(&PointGroup) -> u32) -> impl Iterator<Item = usize> {
        let groups = self.groups.iter().zip(self.points.clone().step_by(LANES));
        groups.flat_map(move |(group, start)| ones(which(group)).map(move |lane| start + lane))
    }

    fn give(&mut self, done: &mut impl FnMut(usize, Seen<'_>)) {
        for (group, start) in self.groups.iter_mut().zip(self.points.clone().step_by(LANES)) {
            group.unsure |= group.live & !group.faces;
            let lit = group.live & group.faces;
            let here = (self.points.end - start).min(LANES);
            let points = ((1 << here) - 1) & !group.unsure;
            done(start, Seen::Wholly { points, seen: lit });
        }
    }

    /// Settles the points of a group whose shafts a primitive may reach. True if it does any.
    #[inline(always)]
    fn meet(
        &mut self,
        index: usize,
        (boxes, slot): (&Turned, usize),
        verdict: impl FnOnce(&Pyramids<F32x16>) -> Verdict<F32x16>,
    ) -> bool {
        let group = &mut self.groups[index];
        let points = group.beam.meets(&one_box(boxes, slot), self.end).bits() & group.live;
        if points == 0 {
            return false;
        }
        let verdict = verdict(&group.view);
        let reached = points & !verdict.missed.bits();
        group.live &= !reached;
        group.unsure |= reached & !verdict.covered.bits();
        self.live &= !(u32::from(group.live == 0) << index);
        reached != 0
    }
}

impl<S: LightSamples + ?Sized> Party for Block<'_, S> {
    fn live(&self) -> u32 {
        self.live
    }

    #[inline(always)]
    fn meets_box(&self, group: usize, boxes: &Turned, _: &Node, slot: usize) -> bool {
        let group = &self.groups[group];
        group.beam.meets(&one_box(boxes, slot), self.end).bits() & group.live != 0
    }

    #[inline(always)]
    fn triangle(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 9]) -> bool {
        self.meet(group, at, |view| view.triangle(corners(fields), SHADOW_T_MAX))
    }

    #[inline(always)]
    fn quad(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 12]) -> bool {
        self.meet(group, at, |view| view.quad(corners(fields), SHADOW_T_MAX))
    }

    #[inline(always)]
    fn sphere(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 4]) -> bool {
        let [x, y, z, radius] = *fields;
        self.meet(group, at, |view| view.sphere([x, y, z], radius, SHADOW_T_MAX))
    }
}

fn corners<const CORNERS: usize>(fields: &[f32]) -> [[f32; 3]; CORNERS] {
    std::array::from_fn(|corner| std::array::from_fn(|axis| fields[3 * corner + axis]))
}
