//! A block: up to 256 points that go down the tree together.

use std::ops::Range;

use super::group::{Aim, LANES, PointGroup};
use super::shafts::GROUPS;
use super::views::Views;
use super::{Query, Seen};
use crate::bvh::Bvh;
use crate::points::LightSamples;
use crate::traverse::ones;

/// How many points a block has: sixteen groups of sixteen.
pub(super) const BLOCK_POINTS: usize = GROUPS * LANES;

/// What a point saves that is settled, in tests of a primitive with a group of points, if it has at most
/// sixteen samples. With more, blocks are never left out: one that settles its points pays for dozens that
/// do not (with 64 samples, pauses made the dense scan 0.85, the sphereflake 0.81 times as fast).
///
/// 1, 2, 4 and 6 were tried on lights near, huge, edge-on and sixty-four of them, in four scenes: 1.00, 1.07,
/// 1.08 times as fast as without pauses on the mean with the first three, but 0.63 at worst with 1.
const WORTH: f32 = 5.0;

/// What it takes to get a group ready, likewise.
const SET_UP: usize = 4;

/// The most blocks that go without a descent.
const LONGEST_PAUSE: u32 = 15;

/// Up to 256 points, and the arrays that they need.
pub(super) struct Block<'a, S: ?Sized> {
    bvh: &'a Bvh,
    query: &'a Query<'a, S>,
    points: Range<usize>,
    views: Box<Views>,
}

impl<'a, S: LightSamples + ?Sized> Block<'a, S> {
    pub(super) fn new(bvh: &'a Bvh, query: &'a Query<'a, S>) -> Self {
        Self { bvh, query, points: 0..0, views: Views::taken(bvh) }
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
        self.views.clear();
        // With sixteen samples and fewer, to ask again costs as much as it saves.
        self.views.thorough = self.query.samples.per_point() > LANES;
        for start in points.clone().step_by(LANES) {
            let count = (points.end - start).min(LANES);
            self.views.push(PointGroup::new(self.query, start, count, &aim));
        }
        self.points = points;
        self.views.settle(self.bvh, &aim);
        self.give(done);
        self.judge();
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
        let groups = self.views.groups.iter().zip(self.points.clone().step_by(LANES));
        groups.flat_map(move |(group, start)| ones(which(group)).map(move |lane| start + lane))
    }

    /// False if the next points are better traced without: lately, descents cost more than they saved.
    pub(super) fn pays(&mut self) -> bool {
        self.query.samples.per_point() > LANES || self.views.pause.is_over()
    }

    /// Notes what the descent saved and cost.
    fn judge(&mut self) {
        if self.query.samples.per_point() > LANES {
            return;
        }
        let unsure: u32 = self.views.groups.iter().map(|group| group.unsure.count_ones()).sum();
        let settled = self.points.len() - unsure as usize;
        let cost = self.views.tests + SET_UP * self.views.groups.len();
        let (saved, cost) = (WORTH * settled as f32, cost as f32);
        self.views.pause.ended(saved, cost, LONGEST_PAUSE);
    }

    /// Ends a query: what is kept stays with the thread.
    pub(super) fn leave(self) {
        self.views.leave();
    }

    fn give(&mut self, done: &mut impl FnMut(usize, Seen<'_>)) {
        for (group, start) in self.views.groups.iter_mut().zip(self.points.clone().step_by(LANES)) {
            group.unsure |= group.live & !group.faces;
            let lit = group.live & group.faces;
            let here = (self.points.end - start).min(LANES);
            let points = ((1 << here) - 1) & !group.unsure;
            done(start, Seen::Wholly { points, seen: lit });
        }
    }
}
