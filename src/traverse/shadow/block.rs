//! A block: up to 256 points that go down the tree together.

use std::ops::Range;

use super::group::{Aim, LANES, PointGroup, around};
use super::{BLOCK_POINTS, Query, Seen};
use crate::bvh::{Bvh, Child, PrimKind};
use crate::kernels::{Beam, Bounds, Verdict};
use crate::points::{LightSamples, SHADOW_T_MAX};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes};
use crate::traverse::tile::Leaf;
use crate::traverse::visits::count;
use crate::traverse::{ones, stack_size};

/// How many groups a block has.
const GROUPS: usize = BLOCK_POINTS / LANES;

/// A node or leaf that waits, and the groups that are to enter it.
#[derive(Clone, Copy, Default)]
struct Waiting {
    index: u32,
    meta: u32,
    groups: u32,
}

/// Up to 256 points, and the arrays that they need.
pub(super) struct Block<'a, S: ?Sized> {
    bvh: &'a Bvh,
    query: &'a Query<'a, S>,
    points: Range<usize>,
    groups: Vec<PointGroup>,
    stack: Vec<Waiting>,
    /// The groups with a point that is not settled.
    live: u32,
}

/// The shafts of a block's groups, and the one around all of them.
struct Shafts {
    aim: Aim,
    groups: Beam<F32x16>,
    all: Beam<F32x8>,
}

impl Shafts {
    fn new(aim: Aim, groups: &[PointGroup]) -> Self {
        let groups = around(groups.iter());
        let low = |lanes: F32x16| F32x8::splat(lanes.reduce_min());
        let high = |lanes: F32x16| F32x8::splat(lanes.reduce_max());
        let all = Beam {
            origin: Bounds { min: groups.origin.min.map(low), max: groups.origin.max.map(high) },
            slope_min: groups.slope_min.map(low),
            slope_max: groups.slope_max.map(high),
            start: low(groups.start),
        };
        Self { aim, groups, all }
    }

    /// Boxes in the axes of the shafts, and a bit for each that some shaft may meet.
    #[inline(always)]
    fn boxes(&self, bounds: [F32x8; 6]) -> ([[f32; 8]; 6], u32) {
        let turned = self.aim.axes.turn_box(bounds);
        let met = self.all.meets(&turned, F32x8::splat(self.aim.end)).bits();
        let ([a, b, c], [d, e, f]) = (turned.min, turned.max);
        ([a, b, c, d, e, f].map(F32x8::to_array), met)
    }
}

/// One of eight boxes, in sixteen lanes.
#[inline(always)]
fn one_box(boxes: &[[f32; 8]; 6], slot: usize) -> Bounds<F32x16> {
    let of = |place: usize| F32x16::splat(boxes[place][slot]);
    Bounds { min: [of(0), of(1), of(2)], max: [of(3), of(4), of(5)] }
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
        }
    }

    /// Gives each point of `points`, of which there are at most [`BLOCK_POINTS`], but for those that
    /// [`Block::unsettled`] has afterwards.
    pub(super) fn trace(&mut self, points: Range<usize>, done: &mut impl FnMut(usize, Seen<'_>)) {
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
        if self.live != 0 && !self.bvh.nodes.is_empty() {
            self.descend(&Shafts::new(aim, &self.groups));
        }
        self.give(done);
    }

    /// The points that are to be traced by rays.
    pub(super) fn unsettled(&self) -> impl Iterator<Item = usize> {
        let groups = self.groups.iter().zip(self.points.clone().step_by(LANES));
        groups.flat_map(|(group, start)| ones(group.unsure).map(move |lane| start + lane))
    }

    fn give(&mut self, done: &mut impl FnMut(usize, Seen<'_>)) {
        for (group, start) in self.groups.iter_mut().zip(self.points.clone().step_by(LANES)) {
            group.unsure |= group.live & !group.faces;
            let lit = group.live & group.faces;
            let here = (self.points.end - start).min(LANES);
            for lane in ones(((1 << here) - 1) & !group.unsure) {
                done(start + lane, if lit >> lane & 1 != 0 { Seen::All } else { Seen::None });
            }
        }
    }

    fn descend(&mut self, shafts: &Shafts) {
        count(|visits| visits.beams += 1);
        let bvh = self.bvh;
        let mut waiting = 1;
        self.stack[0] = Waiting { groups: self.live, ..Waiting::default() };
        while waiting > 0 {
            waiting -= 1;
            let next = self.stack[waiting];
            let groups = next.groups & self.live;
            if groups == 0 {
                continue;
            }
            match Child::unpack(next.index, next.meta) {
                Child::Inner(node) => waiting = self.enter_node(shafts, node, groups, waiting),
                Child::Leaf { kind: PrimKind::Triangle, first, count } => {
                    let leaf = Leaf::new(&bvh.leaves.triangles, first, count);
                    self.enter_leaf(shafts, groups, &leaf, Triangle::new);
                }
                Child::Leaf { kind: PrimKind::Quad, first, count } => {
                    let leaf = Leaf::new(&bvh.leaves.quads, first, count);
                    self.enter_leaf(shafts, groups, &leaf, Quad::new);
                }
                Child::Leaf { kind: PrimKind::Sphere, first, count } => {
                    let leaf = Leaf::new(&bvh.leaves.spheres, first, count);
                    self.enter_leaf(shafts, groups, &leaf, Sphere);
                }
            }
        }
    }

    /// Puts the children that some point may have before its light on the stack, the largest on top.
    #[inline(always)]
    fn enter_node(&mut self, shafts: &Shafts, node: u32, groups: u32, mut waiting: usize) -> usize {
        count(|visits| visits.nodes += 1);
        let node = &self.bvh.nodes[node as usize];
        let base = waiting;
        let (boxes, slots) =
            shafts.boxes(std::array::from_fn(|place| F32x8::load(&node.bounds[place])));
        let end = F32x16::splat(shafts.aim.end);
        for slot in ones(slots) {
            let bounds = one_box(&boxes, slot);
            let mut met = shafts.groups.meets(&bounds, end).bits() & groups;
            for index in ones(met) {
                count(|visits| visits.box_groups += 1);
                let group = &self.groups[index];
                if group.beam.meets(&bounds, end).bits() & group.live == 0 {
                    met &= !(1 << index);
                }
            }
            if met != 0 {
                let (index, meta) = (node.index[slot], node.meta[slot]);
                self.stack[waiting] = Waiting { index, meta, groups: met };
                waiting += 1;
            }
        }
        self.stack[base..waiting].reverse();
        waiting
    }

    /// Tests the primitives of a leaf.
    #[inline(always)]
    fn enter_leaf<P: Occluder, const FIELDS: usize>(
        &mut self,
        shafts: &Shafts,
        groups: u32,
        leaf: &Leaf<'_, FIELDS>,
        occluder: impl Fn([f32; FIELDS]) -> P,
    ) {
        count(|visits| visits.leaves += 1);
        let (boxes, places) = shafts.boxes(leaf.bounds());
        let fields = leaf.lanes.map(F32x8::to_array);
        let end = F32x16::splat(shafts.aim.end);
        for place in ones(places & ((1 << leaf.count) - 1)) {
            let bounds = one_box(&boxes, place);
            let met = shafts.groups.meets(&bounds, end).bits() & groups & self.live;
            if met == 0 {
                continue;
            }
            count(|visits| visits.primitives += 1);
            let occluder = occluder(fields.map(|lanes| lanes[place]));
            for index in ones(met) {
                let group = &self.groups[index];
                let points = group.beam.meets(&bounds, end).bits() & group.live;
                if points != 0 {
                    self.meet(index, points, &occluder);
                }
            }
        }
    }

    /// Settles the points of a group whose shaft the primitive may reach.
    #[inline(always)]
    fn meet(&mut self, index: usize, points: u32, occluder: &impl Occluder) {
        count(|visits| visits.primitive_groups += 1);
        let group = &mut self.groups[index];
        let verdict = occluder.verdict(group);
        let reached = points & !verdict.missed.bits();
        group.live &= !reached;
        group.unsure |= reached & !verdict.covered.bits();
        self.live &= !(u32::from(group.live == 0) << index);
    }
}

/// A primitive that may stand before the light.
trait Occluder {
    /// What it is to sixteen points.
    fn verdict(&self, group: &PointGroup) -> Verdict<F32x16>;
}

fn corners<const CORNERS: usize>(fields: &[f32]) -> [[f32; 3]; CORNERS] {
    std::array::from_fn(|corner| std::array::from_fn(|axis| fields[3 * corner + axis]))
}

struct Triangle([[f32; 3]; 3]);

impl Triangle {
    #[inline(always)]
    fn new(fields: [f32; 9]) -> Self {
        Self(corners(&fields))
    }
}

impl Occluder for Triangle {
    #[inline(always)]
    fn verdict(&self, group: &PointGroup) -> Verdict<F32x16> {
        group.view.triangle(self.0, SHADOW_T_MAX)
    }
}

struct Quad([[f32; 3]; 4]);

impl Quad {
    #[inline(always)]
    fn new(fields: [f32; 12]) -> Self {
        Self(corners(&fields))
    }
}

impl Occluder for Quad {
    #[inline(always)]
    fn verdict(&self, group: &PointGroup) -> Verdict<F32x16> {
        group.view.quad(self.0, SHADOW_T_MAX)
    }
}

/// Centre and radius.
struct Sphere([f32; 4]);

impl Occluder for Sphere {
    #[inline(always)]
    fn verdict(&self, group: &PointGroup) -> Verdict<F32x16> {
        let [x, y, z, radius] = self.0;
        group.view.sphere([x, y, z], radius, SHADOW_T_MAX)
    }
}
