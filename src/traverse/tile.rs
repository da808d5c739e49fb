//! A tile: up to sixteen groups of rays, taken through the tree together as long as many of them go the
//! same way.
//!
//! Layout: a group is sixteen rays: one register with AVX-512, else two. What is known of a group as a
//! whole is one lane of sixteen in the tile's [`Aim`]. Groups of eight rays without AVX-512, of one register,
//! take twice the nodes: camera rays 0.84 to 0.89, mirrors 1.00, shadow rays 0.86 to 1.03, diffuse ones 0.93.
//!
//! A descent keeps a set of groups for each waiting node:
//! 1. The node's eight boxes against the whole tile, in eight lanes.
//! 2. Each box that is left against the groups, in sixteen lanes: a set of groups.
//! 3. If the groups' bounds are loose, each group of the set tests the box with its own rays and
//!    leaves the set if none meets it. If few rays are left, the child goes to their lists in
//!    [`Rest`], for them to be traced one by one (see [`pace::is_worth`]).
//! 4. In a leaf, the boxes of its primitives go the same way, and the groups that are left test the
//!    primitive with all their rays, register by register.
//!
//! Invariants: bounds, slab tests and the primitives' own tests never contradict each other, so a
//! descent finds what the scalar reference finds.

mod first;
mod leaves;
mod nodes;

use first::First;

use super::aim::{Aim, Run};
use super::corners;
use super::cull::Cull;
use super::group::{Group, MAX_LANES};
use super::open::Open;
use super::pace::{self, Pace};
use super::planes::Octant;
use super::rest::Rest;
use super::starts::Starts;
use super::visits::count;
use super::{ones, stack_size};
use crate::bvh::{Bvh, Child};
use crate::kernels::ScaledRay;
use crate::prefetch::{Ahead, Shelves};
use crate::ray::Rays;
use crate::simd::{LaneMask, Lanes};

/// How many groups a tile has: one a lane of the widest culling test.
pub(super) const GROUPS: usize = 16;

/// A node or leaf that waits, and the groups that are to enter it.
#[derive(Clone, Copy, Default)]
struct Waiting {
    index: u32,
    meta: u32,
    groups: u32,
    /// The coordinate along the rays' main axis at which its box starts.
    start: f32,
}

/// Up to sixteen groups of rays.
pub(super) struct Tile<F: Lanes> {
    pub(super) groups: [Group<F>; GROUPS],
    /// The groups with a ray that is still to be traced.
    live: u32,
    /// What the descent leaves to single rays.
    pub(super) rest: Rest,
    /// Where rays that ask for any hit look first.
    pub(super) first: First,
    stack: Vec<Waiting>,
    /// Of the last box: where each group's rays enter it, and which.
    near: [F; GROUPS],
    lanes: [u32; GROUPS],
    /// Where most of the groups run, and the axis along which most of them run.
    octant: Octant,
    main: usize,
    /// What is left of the descent's budget.
    budget: u32,
    /// Boxes in which rays that look for any hit look first.
    starts: Starts,
    shelves: Shelves<4>,
    /// What the next tile reads and this one writes, asked for while this one is under way.
    pub(super) reads: Ahead<8>,
    pub(super) writes: Ahead<5>,
}

impl<F: Lanes> Tile<F> {
    /// The most rays that a tile takes.
    pub(super) const RAYS: usize = GROUPS * F::LANES;

    pub(super) fn new(bvh: &Bvh) -> Self {
        Self {
            groups: [Group::new(); GROUPS],
            live: 0,
            rest: Rest::new(Self::RAYS),
            first: First::default(),
            near: [F::splat(0.0); GROUPS],
            lanes: [0; GROUPS],
            stack: vec![Waiting::default(); stack_size(bvh)],
            octant: Octant::SEVERAL,
            main: 0,
            budget: 0,
            starts: Starts::NONE,
            shelves: bvh.shelves(),
            reads: Ahead::new([&[]; 8]),
            writes: Ahead::new([&[]; 5]),
        }
    }

    /// Turns to another scene, of which nothing is known: for tiles that outlive one.
    pub(super) fn turn_to(&mut self, bvh: &Bvh) {
        self.stack.resize(stack_size(bvh), Waiting::default());
        self.shelves = bvh.shelves();
        self.first.nodes.clear();
        (self.reads, self.writes) = (Ahead::new([&[]; 8]), Ahead::new([&[]; 5]));
    }

    /// Takes up to [`Tile::RAYS`] rays.
    pub(super) fn load(&mut self, rays: Rays<'_>) {
        debug_assert!(rays.len() <= Self::RAYS);
        self.live = 0;
        for (group, start) in (0..rays.len()).step_by(F::LANES).enumerate() {
            let count = (rays.len() - start).min(F::LANES);
            let load = |from: &[f32]| {
                if count == F::LANES {
                    F::load(&from[start..])
                } else {
                    let mut lanes = [0.0; MAX_LANES];
                    lanes[..count].copy_from_slice(&from[start..]);
                    F::load(&lanes)
                }
            };
            let group_rays = rays.scaled(load, F::mask((1_u32 << count) - 1));
            self.groups[group].load(&group_rays);
            self.live |= u32::from(group_rays.valid.any()) << group;
        }
    }

    /// Takes a group of rays, in place of all others if it is the first.
    #[inline(always)]
    pub(super) fn load_group(&mut self, index: usize, ray: &ScaledRay<F>) {
        self.live &= (1 << index) - 1;
        self.live |= u32::from(ray.valid.any()) << index;
        self.groups[index].load(ray);
    }

    /// Traces all groups: their closest hits, or any hits if `ANY`. What is left to single rays is in
    /// [`Tile::rest`].
    pub(super) fn trace<const ANY: bool>(&mut self, bvh: &Bvh, aim: &mut Aim, pace: &mut Pace) {
        self.rest.clear();
        if bvh.nodes.is_empty() || self.live == 0 {
            return;
        }
        (self.first.settled, self.first.cost) = (0, 0);
        let live = self.live;
        let mut aimed = 0;
        if let Some((run, groups)) = aim.take(&self.groups, live, bvh) {
            aimed = groups;
            self.live = aimed;
            match run {
                Run::Fan if !pace.takes_fans() => self.leave_whole(),
                Run::Fan => {
                    self.budget = pace::budget(aimed.count_ones() * F::LANES as u32);
                    let spent = self.descend::<ANY, _>(bvh, &mut aim.fan);
                    pace.fan_ended(spent);
                    if spent {
                        // What it found stands: single rays look for what is closer, or as close.
                        self.leave_whole();
                    }
                }
                Run::Cone => _ = self.descend::<ANY, _>(bvh, &mut aim.cone),
                Run::Beams => _ = self.descend::<ANY, _>(bvh, &mut aim.beams),
            }
        }
        self.live = live & !aimed;
        if self.live != 0 {
            self.descend::<ANY, _>(bvh, &mut Open);
        }
    }

    /// Leaves the whole tree to the rays of all live groups.
    fn leave_whole(&mut self) {
        for index in ones(self.live) {
            self.rest.add_whole(index, self.groups[index].ray.valid.bits());
        }
    }

    /// One descent with all live groups. True if it gave up, its budget spent.
    fn descend<const ANY: bool, C: Cull>(&mut self, bvh: &Bvh, cull: &mut C) -> bool {
        count(|visits| {
            if C::LOOSE {
                visits.beams += 1;
            } else {
                visits.cones += 1;
            }
        });
        self.main = corners::most_common(ones(self.live).map(|index| self.groups[index].axes));
        if C::LOOSE {
            for index in ones(self.live) {
                self.groups[index].prepare_boxes(bvh.extent);
            }
            self.octant = Octant::most(ones(self.live).map(|index| self.groups[index].octant));
        }
        if ANY {
            self.starts = Starts::new(&self.groups, self.live, bvh.extent);
        }
        if C::FAN || ANY && self.starts.are_shared() {
            return self.walk::<ANY, false, C>(bvh, cull);
        }
        for index in ones(self.live) {
            self.groups[index].prepare_primitives(bvh.extent);
        }
        self.walk::<ANY, true, C>(bvh, cull)
    }

    /// Goes from node to node. `APART` if rays start apart from each other, and often on triangles: see
    /// [`Group::meet_triangle`].
    fn walk<const ANY: bool, const APART: bool, C: Cull>(
        &mut self,
        bvh: &Bvh,
        cull: &mut C,
    ) -> bool {
        if ANY && !self.first.nodes.is_empty() {
            self.enter_first::<APART, C>(bvh, cull);
        }
        let mut waiting = 1;
        self.stack[0] =
            Waiting { groups: self.live, start: f32::NEG_INFINITY, ..Waiting::default() };
        while waiting > 0 {
            if !C::LOOSE && self.budget == 0 {
                return true;
            }
            waiting -= 1;
            self.reads.ask();
            self.writes.ask();
            let next = self.stack[waiting];
            let groups = next.groups & self.live & cull.reach(next.start);
            if groups == 0 {
                continue;
            }
            if let Child::Inner(node) = Child::unpack(next.index, next.meta) {
                waiting = self.enter_node::<ANY, C>(bvh, cull, node, groups, waiting);
            } else {
                self.enter_child::<ANY, APART, C>(bvh, cull, groups, (next.index, next.meta));
            }
        }
        false
    }

    #[inline(always)]
    fn spend(&mut self, cost: u32) {
        self.budget = self.budget.saturating_sub(cost);
    }
}
