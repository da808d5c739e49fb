//! What a tile leaves to single rays: for each ray, the children that it still has to enter.
//!
//! Layout: a list for each ray, in the order of groups and lanes. An entry is what waits on the stack
//! of a single ray: the key of a child (or the bits of some children if any hit counts) above the
//! node that they belong to. A ray with more than [`ROOM`] entries starts again at the root.

use super::group::MAX_LANES;
use super::ones;
use super::tile::GROUPS;
use crate::simd::{Keys, Lanes};

/// How many entries a ray's list has room for.
pub(super) const ROOM: usize = 15;

/// The entries of one ray.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct List {
    count: usize,
    entries: [u64; ROOM],
}

/// What is left to do for the rays of some groups.
pub(super) struct Rest {
    lists: Vec<List>,
    /// The lanes of each group with anything left.
    lanes: [u32; GROUPS],
    /// The lanes of each group that have the whole tree left.
    whole: [u32; GROUPS],
}

impl Rest {
    /// For so many rays.
    pub(super) fn new(rays: usize) -> Self {
        Self {
            lists: vec![List { count: 0, entries: [0; ROOM] }; rays],
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
        self.lanes = [0; GROUPS];
        self.whole = [0; GROUPS];
    }

    /// Leaves the whole tree to these lanes of a group.
    pub(super) fn add_whole(&mut self, group: usize, lanes: u32) {
        self.lanes[group] |= lanes;
        self.whole[group] |= lanes;
    }

    /// Leaves child `slot` of a node to those lanes of a group that meet its box, `near` along the ray.
    #[inline(always)]
    pub(super) fn add<const ANY: bool, F: Lanes>(
        &mut self,
        group: usize,
        lanes: u32,
        near: F,
        (node, slot): (u32, usize),
    ) {
        let mut distances = [0.0; MAX_LANES];
        near.store(&mut distances);
        let lists = &mut self.lists[group * F::LANES..][..F::LANES];
        for lane in ones(lanes) {
            let list = &mut lists[lane & (F::LANES - 1)];
            if self.lanes[group] >> lane & 1 == 0 {
                list.count = 0;
            }
            if list.count == ROOM {
                self.whole[group] |= 1 << lane;
                continue;
            }
            let key = if ANY { 1 << slot } else { Keys::key(distances[lane], slot) };
            list.entries[list.count] = u64::from(key) << 32 | u64::from(node);
            list.count += 1;
        }
        self.lanes[group] |= lanes;
    }

    /// Puts the entries of a ray on a stack of keys and nodes, the next one last, without those behind
    /// `t_max`. Their number, or `None` if the ray has the whole tree left.
    #[inline(always)]
    pub(super) fn take<const ANY: bool, F: Lanes>(
        &self,
        (group, lane): (usize, usize),
        t_max: f32,
        keys: &mut [u32],
        nodes: &mut [u32],
    ) -> Option<usize> {
        if self.whole[group] >> lane & 1 != 0 {
            return None;
        }
        let list = &self.lists[group * F::LANES + lane];
        let entries = &list.entries[..list.count.min(ROOM)];
        let mut count = 0;
        for place in 0..entries.len() {
            // If any hit counts, the first one is the largest and belongs on top. Else the nearest.
            let entry = entries[if ANY { entries.len() - 1 - place } else { place }];
            let (key, node) = ((entry >> 32) as u32, entry as u32);
            // A range may end before zero, and so may a box.
            if !ANY && Keys::distance(key) > t_max.max(0.0) {
                continue;
            }
            let mut place = count;
            while !ANY && place > 0 && keys[place - 1] < key {
                (keys[place], nodes[place]) = (keys[place - 1], nodes[place - 1]);
                place -= 1;
            }
            (keys[place], nodes[place]) = (key, node);
            count += 1;
        }
        Some(count)
    }
}
