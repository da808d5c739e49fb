//! What a tile leaves to single rays: for each ray, the children that it still has to enter.
//!
//! Layout: a list for each ray, in the order of groups and lanes; what tells of its entries lies in
//! arrays, eight to a register, as it does on the stack of a single ray. A ray with more than [`ROOM`]
//! entries starts again at the root.

use super::group::MAX_LANES;
use super::ones;
use super::stack::Stack;
use super::tile::GROUPS;
use crate::bvh::WIDTH;
use crate::simd::{F32x8, Lanes};

/// How many entries a ray's list has room for.
pub(super) const ROOM: usize = 2 * WIDTH;

/// Eight entries: where the ray enters a child, its reference and its description.
#[derive(Clone, Copy)]
struct Entries {
    near: [f32; WIDTH],
    index: [u32; WIDTH],
    meta: [u32; WIDTH],
}

/// The entries of one ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct List([Entries; ROOM / WIDTH]);

impl List {
    const EMPTY: Self =
        Self([Entries { near: [0.0; WIDTH], index: [0; WIDTH], meta: [0; WIDTH] }; ROOM / WIDTH]);
}

/// What is left to do for the rays of some groups.
pub(super) struct Rest {
    lists: Vec<List>,
    /// How many entries each list has.
    counts: Vec<u8>,
    /// The lanes of each group with anything left.
    lanes: [u32; GROUPS],
    /// The lanes of each group that have the whole tree left.
    whole: [u32; GROUPS],
}

impl Rest {
    /// For so many rays.
    pub(super) fn new(rays: usize) -> Self {
        Self {
            lists: vec![List::EMPTY; rays],
            counts: vec![0; rays],
            lanes: [0; GROUPS],
            whole: [0; GROUPS],
        }
    }

    /// The lanes of a group that have something left.
    #[inline(always)]
    pub(super) fn lanes(&self, group: usize) -> u32 {
        self.lanes[group]
    }

    /// The groups with a lane that has something left.
    pub(super) fn groups(&self) -> u32 {
        (0..GROUPS).fold(0, |which, group| which | u32::from(self.lanes[group] != 0) << group)
    }

    /// Forgets all entries.
    pub(super) fn clear(&mut self) {
        self.counts.fill(0);
        self.lanes = [0; GROUPS];
        self.whole = [0; GROUPS];
    }

    /// Leaves the whole tree to these lanes of a group.
    pub(super) fn add_whole(&mut self, group: usize, lanes: u32) {
        self.lanes[group] |= lanes;
        self.whole[group] |= lanes;
    }

    /// Leaves a child, by its reference and description, to those lanes of a group that meet its box,
    /// `near` along the ray.
    #[inline(always)]
    pub(super) fn add<F: Lanes>(
        &mut self,
        group: usize,
        lanes: u32,
        near: F,
        (index, meta): (u32, u32),
    ) {
        let mut distances = [0.0; MAX_LANES];
        near.store(&mut distances);
        let rays = group * F::LANES..(group + 1) * F::LANES;
        let (lists, counts) = (&mut self.lists[rays.clone()], &mut self.counts[rays]);
        for lane in ones(lanes) {
            let lane = lane & (F::LANES - 1);
            let count = usize::from(counts[lane]);
            if count == ROOM {
                self.whole[group] |= 1 << lane;
                continue;
            }
            let (entries, place) = (&mut lists[lane].0[(count / WIDTH) & 1], count % WIDTH);
            entries.near[place] = distances[lane];
            (entries.index[place], entries.meta[place]) = (index, meta);
            counts[lane] = count as u8 + 1;
        }
        self.lanes[group] |= lanes;
    }

    /// Puts the entries of a ray on its stack, the next one last, without those behind `t_max`.
    #[inline(always)]
    pub(super) fn take<const ANY: bool, F: Lanes>(
        &self,
        (group, lane): (usize, usize),
        t_max: f32,
        stack: &mut Stack,
    ) {
        let ray = group * F::LANES + lane;
        let (list, count) = (&self.lists[ray].0, usize::from(self.counts[ray]));
        if self.whole[group] >> lane & 1 != 0 {
            return stack.start::<ANY>();
        }
        stack.clear();
        let mut push = |entries: &Entries, count: usize| {
            let near = F32x8::load(&entries.near);
            let mut met = F32x8::mask((1_u32 << count) - 1);
            if !ANY {
                met = met & near.le(F32x8::splat(t_max));
            }
            stack.push::<ANY>((near, met), (&entries.index, &entries.meta));
        };
        // What came later to the list is farther away, or smaller.
        if count > WIDTH {
            push(&list[1], count - WIDTH);
        }
        push(&list[0], count.min(WIDTH));
    }
}
