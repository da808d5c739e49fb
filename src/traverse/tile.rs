//! A tile: up to sixteen groups of rays, taken through the tree together as long as many of them go the
//! same way.
//!
//! Layout: a group is one register of rays (sixteen with AVX-512, else eight). What is known of a
//! group as a whole is one lane of sixteen in the tile's [`Aim`].
//!
//! A descent keeps a set of groups for each waiting node:
//! 1. The node's eight boxes against the whole tile, in eight lanes.
//! 2. Each box that is left against the groups, in sixteen lanes: a set of groups.
//! 3. If the groups' bounds are loose, each group of the set tests the box with its own rays and
//!    leaves the set if none meets it. If [`pace::few`] rays are left, the child goes to their lists
//!    in [`Rest`], for them to be traced one by one.
//! 4. In a leaf, the boxes of its primitives go the same way, and the groups that are left test the
//!    primitive with all their rays.
//!
//! Invariants: bounds, slab tests and the primitives' own tests never contradict each other, so a
//! descent finds what the scalar reference finds.

use super::aim::Aim;
use super::cull::Cull;
use super::group::{Group, MAX_LANES};
use super::leaf::{Leaf, SPHERE_FIELDS};
use super::open::Open;
use super::pace::{self, Pace};
use super::rest::Rest;
use super::starts::Starts;
use super::visits::count;
use super::{ones, stack_size};
use crate::bvh::{Bvh, Child, Node, PrimKind, WIDTH};
use crate::kernels::ScaledRay;
use crate::prefetch::Shelves;
use crate::ray::Rays;
use crate::simd::{F32x8, LaneMask, Lanes, each};

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

/// Leaves that a tile enters before the tree: somebody's guess where its rays will meet something.
#[derive(Default)]
pub(super) struct First {
    /// The leaves as children of nodes that are not in the tree.
    pub(super) nodes: Vec<Node>,
    /// How many rays met something there, and what that cost, in units of [`pace`].
    pub(super) settled: u32,
    pub(super) cost: u32,
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
    /// What is left of the descent's budget.
    budget: u32,
    /// Boxes in which rays that look for any hit look first.
    starts: Starts,
    shelves: Shelves<4>,
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
            budget: 0,
            starts: Starts::NONE,
            shelves: bvh.shelves(),
        }
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
    pub(super) fn trace<const ANY: bool>(&mut self, bvh: &Bvh, pace: &mut Pace) {
        self.rest.clear();
        if bvh.nodes.is_empty() {
            return;
        }
        (self.first.settled, self.first.cost) = (0, 0);
        let live = self.live;
        let mut aimed = 0;
        if let Some((mut aim, groups)) = Aim::new(&self.groups, live, bvh) {
            aimed = groups;
            self.live = aimed;
            match &mut aim {
                Aim::Fan(_) if !pace.takes_fans() => self.leave_whole(),
                Aim::Fan(fan) => {
                    self.budget = pace::budget(aimed.count_ones() * F::LANES as u32);
                    let spent = self.descend::<ANY, _>(bvh, fan);
                    pace.fan_ended(spent);
                    if spent {
                        // What it found stands: single rays look for what is closer, or as close.
                        self.leave_whole();
                    }
                }
                Aim::Cone(cone) => _ = self.descend::<ANY, _>(bvh, cone),
                Aim::Beams(beams) => _ = self.descend::<ANY, _>(bvh, beams),
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
        if C::LOOSE {
            for index in ones(self.live) {
                self.groups[index].prepare_boxes(bvh.extent);
            }
        }
        if ANY {
            self.starts = Starts::new(&self.groups, self.live, bvh.extent);
        }
        if ANY && !self.first.nodes.is_empty() {
            self.enter_first::<C>(bvh, cull);
        }
        let mut waiting = 1;
        self.stack[0] =
            Waiting { groups: self.live, start: f32::NEG_INFINITY, ..Waiting::default() };
        while waiting > 0 {
            if !C::LOOSE && self.budget == 0 {
                return true;
            }
            waiting -= 1;
            let next = self.stack[waiting];
            let groups = next.groups & self.live & cull.reach(next.start);
            if groups == 0 {
                continue;
            }
            if let Child::Inner(node) = Child::unpack(next.index, next.meta) {
                waiting = self.enter_node::<ANY, C>(bvh, cull, node, groups, waiting);
            } else {
                self.enter_child::<ANY, C>(bvh, cull, groups, (next.index, next.meta));
            }
        }
        false
    }

    /// Tests a leaf of that description with these groups.
    #[inline(always)]
    fn enter_child<const ANY: bool, C: Cull>(
        &mut self,
        bvh: &Bvh,
        cull: &mut C,
        groups: u32,
        (index, meta): (u32, u32),
    ) {
        let leaves = &bvh.leaves;
        match Child::unpack(index, meta) {
            Child::Inner(_) => {}
            Child::Leaf { kind: PrimKind::Triangle, first, count } => {
                let leaf = Leaf::new(&leaves.triangles, first, count);
                self.enter_leaf::<ANY, C, 9>(cull, groups, leaf, |group, fields, id| {
                    group.meet_triangle::<ANY>(fields, C::FAN, id)
                });
            }
            Child::Leaf { kind: PrimKind::Quad, first, count } => {
                let leaf = Leaf::new(&leaves.quads, first, count);
                self.enter_leaf::<ANY, C, 12>(cull, groups, leaf, |group, fields, id| {
                    group.meet_quad::<ANY>(fields, C::FAN, id)
                });
            }
            Child::Leaf { kind: PrimKind::Sphere, first, count } => {
                let leaf = Leaf::new(&leaves.spheres, first, count);
                self.enter_leaf::<ANY, C, 4>(cull, groups, leaf, |group, fields, id| {
                    group.meet_sphere::<ANY>(fields, id)
                });
            }
        }
    }

    /// Tests the leaves that come first, each with the groups that it may settle.
    #[inline(never)]
    fn enter_first<C: Cull>(&mut self, bvh: &Bvh, cull: &mut C) {
        let groups = self.live;
        let met_rays = |tile: &Self| -> u32 {
            ones(groups).map(|index| tile.groups[index].met().count_ones()).sum()
        };
        let met_before = met_rays(self);
        let budget = std::mem::replace(&mut self.budget, u32::MAX);
        for at in 0..self.first.nodes.len() {
            let node = self.first.nodes[at];
            let (boxes, slots) = cull.boxes(each(|place| F32x8::load(&node.bounds[place])));
            for slot in ones(slots) {
                let mut met = cull.groups(&boxes, slot).0 & self.live;
                if met == 0 {
                    continue;
                }
                if C::LOOSE {
                    self.spend(met.count_ones());
                    let rays = self.count_rays(&node, slot, &mut met);
                    // The tree will lead them here, too.
                    if rays <= pace::few(met, 1.0, node.meta[slot]) {
                        continue;
                    }
                }
                let child = (node.index[slot], node.meta[slot]);
                self.enter_child::<true, C>(bvh, cull, met, child);
            }
        }
        self.first.cost += u32::MAX - std::mem::replace(&mut self.budget, budget);
        self.first.settled += met_rays(self) - met_before;
    }

    #[inline(always)]
    fn spend(&mut self, cost: u32) {
        self.budget = self.budget.saturating_sub(cost);
    }

    /// Puts the children that some group may meet on the stack, the next one on top.
    #[inline(always)]
    fn enter_node<const ANY: bool, C: Cull>(
        &mut self,
        bvh: &Bvh,
        cull: &C,
        number: u32,
        groups: u32,
        mut waiting: usize,
    ) -> usize {
        count(|visits| visits.nodes += 1);
        self.spend(pace::NODE);
        let node = &bvh.nodes[number as usize];
        let base = waiting;
        let bounds = each(|place| F32x8::load(&node.bounds[place]));
        let (boxes, slots) = cull.boxes(bounds);
        let mut met = [0; WIDTH];
        let mut starts = [0.0; WIDTH];
        let mut tests = 0;
        for slot in ones(slots) {
            let slot = slot & 7;
            let (may_meet, start) = cull.groups(&boxes, slot);
            (met[slot], starts[slot]) = (may_meet & groups, start);
            tests += met[slot].count_ones();
        }
        let share = tests as f32 / groups.count_ones() as f32;
        let near = if ANY { self.starts.near(&bounds) } else { 0 };
        for slot in ones(slots & near).chain(ones(slots & !near)) {
            let slot = slot & 7;
            let mut met = met[slot];
            if C::LOOSE {
                met = self.split_off_few(node, slot, met, share);
            }
            if met == 0 {
                continue;
            }
            let start = starts[slot];
            let (index, meta) = (node.index[slot], node.meta[slot]);
            self.shelves.ask::<true>(Child::shelf(meta), index as usize);
            let mut place = waiting;
            while !ANY && place > base && self.stack[place - 1].start < start {
                self.stack[place] = self.stack[place - 1];
                place -= 1;
            }
            self.stack[place] = Waiting { index, meta, groups: met, start };
            waiting += 1;
        }
        if ANY {
            self.stack[base..waiting].reverse();
        }
        waiting
    }

    /// The groups of `met` with rays that meet the box of a slot; none if [`pace::few`] rays do: these
    /// get the child on their lists.
    #[inline(always)]
    fn split_off_few(&mut self, node: &Node, slot: usize, mut met: u32, share: f32) -> u32 {
        let rays = self.count_rays(node, slot, &mut met);
        if rays > pace::few(met, share, node.meta[slot]) {
            return met;
        }
        let child = (node.index[slot], node.meta[slot]);
        for index in ones(met) {
            let (near, lanes) = (self.near[index & 15], self.lanes[index & 15]);
            self.rest.add::<F>(index, lanes, near, child);
        }
        0
    }

    /// How many rays of `met` meet the box of a slot; takes the groups without any out of the set.
    #[inline(always)]
    fn count_rays(&mut self, node: &Node, slot: usize, met: &mut u32) -> u32 {
        let mut rays = 0;
        for index in ones(*met) {
            count(|visits| visits.box_groups += 1);
            let bounds = |place: usize| F::splat(node.bounds[place][slot]);
            let (near, far) = self.groups[index & 15].interval(bounds);
            let lanes = near.le(far).bits();
            self.near[index & 15] = near;
            self.lanes[index & 15] = lanes;
            rays += lanes.count_ones();
            *met &= !(u32::from(lanes == 0) << index);
        }
        rays
    }

    /// Tests the primitives of a leaf.
    #[inline(always)]
    fn enter_leaf<const ANY: bool, C: Cull, const FIELDS: usize>(
        &mut self,
        cull: &mut C,
        groups: u32,
        mut leaf: Leaf<'_, FIELDS>,
        meet: impl Fn(&mut Group<F>, &[f32; FIELDS], u32) -> bool,
    ) {
        count(|visits| visits.leaves += 1);
        self.spend(pace::LEAF);
        let (boxes, places) = cull.boxes(leaf.bounds());
        if C::FAN && FIELDS != SPHERE_FIELDS {
            leaf.shift(cull.origin());
        }
        let outlines = if C::FAN { leaf.outlines() } else { None };
        let mut places = places & ((1 << leaf.count) - 1);
        let mut closer = 0;
        while places != 0 {
            let place = places.trailing_zeros();
            places &= places - 1;
            let mut met = cull.groups(&boxes, place as usize).0 & groups & self.live;
            if met == 0 {
                continue;
            }
            count(|visits| visits.primitives += 1);
            self.spend(pace::PRIMITIVE * met.count_ones());
            if let Some(outlines) = &outlines {
                let inside = |index: usize| {
                    outlines.may_meet(place as usize, &self.groups[index & 15].ray.dir)
                };
                met = ones(met).fold(0, |met, index| met | u32::from(inside(index)) << index);
            }
            let fields = leaf.fields(place as usize);
            let id = leaf.ids[place as usize];
            for index in ones(met) {
                count(|visits| visits.primitive_groups += 1);
                let group = &mut self.groups[index];
                if meet(group, &fields, id) {
                    count(|visits| visits.met_groups += 1);
                    closer |= 1 << index;
                    if ANY && group.is_dead() {
                        self.live &= !(1 << index);
                    }
                }
            }
        }
        // As long as a ray has met nothing, its group reaches as far as before.
        let mut drawn_in = false;
        for index in ones(closer & self.live).filter(|&index| self.groups[index].missing == 0) {
            cull.draw_in(index, &self.groups[index].ray);
            drawn_in = true;
        }
        if drawn_in {
            cull.settle();
        }
    }
}
