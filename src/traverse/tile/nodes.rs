//! A tile at a node: which of its groups go on to which child, and which rays go there on their own.

use super::{Tile, Waiting};
use crate::bvh::{Bvh, Child, Node, WIDTH};
use crate::simd::{F32x8, LaneMask, Lanes, each};
use crate::traverse::cull::Cull;
use crate::traverse::planes::Planes;
use crate::traverse::visits::count;
use crate::traverse::{ones, pace};

impl<F: Lanes> Tile<F> {
    /// Puts the children that some group may meet on the stack, the next one on top.
    #[inline(always)]
    pub(super) fn enter_node<const ANY: bool, C: Cull>(
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

    /// The groups of `met` with rays that meet the box of a slot; none if these are few: then they get the
    /// child on their lists.
    #[inline(always)]
    fn split_off_few(&mut self, node: &Node, slot: usize, mut met: u32, share: f32) -> u32 {
        let rays = self.count_rays(node, slot, &mut met);
        if pace::is_worth(rays, met, share, node.meta[slot]) {
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
    pub(super) fn count_rays(&mut self, node: &Node, slot: usize, met: &mut u32) -> u32 {
        let mut rays = 0;
        let planes = Planes::new(node, slot, self.octant);
        for index in ones(*met) {
            count(|visits| visits.box_groups += 1);
            let (near, far) = self.groups[index & 15].interval(&planes);
            let lanes = near.le(far).bits();
            self.near[index & 15] = near;
            self.lanes[index & 15] = lanes;
            rays += lanes.count_ones();
            *met &= !(u32::from(lanes == 0) << index);
        }
        rays
    }
}
