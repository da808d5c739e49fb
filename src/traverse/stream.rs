//! Rays one by one, several at a time: each has a stack of its own, and they take turns.
//!
//! A step of a ray, a node or a leaf, is a long chain of dependent operations; which child comes next
//! is known only at its end, and a guess that fails costs as much again. With turns, a step's outcome
//! is looked at when the others have made their steps, so their operations overlap, and what comes
//! next is known in time.
//!
//! A node's children wait on the stack as sorted keys, the nearest on top. A child that starts behind
//! the best hit is dropped; one that starts at it is not, since a hit at the same `t` may have a
//! smaller id. Any hit needs no order: a set of children waits, the first of their node first.

use super::group::Group;
use super::rest::{ROOM, Rest};
use super::single::Single;
use super::visits::count;
use super::{Closest, ones};
use crate::bvh::{Bvh, Child, MAX_DEPTH, WIDTH};
use crate::hit::NO_HIT;
use crate::prefetch::Shelves;
use crate::simd::{Keys, LaneMask, Lanes};

/// How many rays take turns.
const SIDE_BY_SIDE: usize = 16;

/// How many entries a stack needs: what it starts with, then each node on the way leaves at most seven,
/// the last one eight.
const STACK: usize = ROOM + (WIDTH - 1) * MAX_DEPTH + WIDTH;

/// Where a stack starts: below lie zeros, so that a whole register below any entry can be read.
const BOTTOM: usize = WIDTH;

/// A ray on its way.
#[derive(Clone)]
struct Cursor {
    ray: Single,
    best: Closest,
    /// Where the ray comes from, and its hit goes.
    group: usize,
    lane: usize,
    /// What comes next: the reference and the description of a [`Child`].
    index: u32,
    meta: u32,
    /// The end of the stack.
    waiting: usize,
    /// What waits: a key of a child, or the bits of some children if any hit counts.
    keys: [u32; BOTTOM + STACK],
    /// The node whose children wait.
    nodes: [u32; BOTTOM + STACK],
}

impl Cursor {
    fn new() -> Self {
        Self {
            ray: Single::default(),
            best: Closest { t: 0.0, u: 0.0, v: 0.0, id: NO_HIT },
            group: 0,
            lane: 0,
            index: 0,
            meta: 0,
            waiting: BOTTOM,
            keys: [0; BOTTOM + STACK],
            nodes: [0; BOTTOM + STACK],
        }
    }

    /// Takes the next ray that has anything left, and what comes first for it. False if there is none.
    #[inline(always)]
    fn start<const ANY: bool, F: Lanes>(&mut self, work: &mut Work<'_, F>) -> bool {
        while let Some((index, lane)) = work.next_ray() {
            let group = &work.groups[index];
            let (t, id) = (group.ray.t_max.lane(lane), group.id(lane));
            if ANY && id != NO_HIT {
                continue;
            }
            (self.index, self.meta, self.waiting) = (0, 0, BOTTOM);
            let (keys, nodes) = (&mut self.keys[BOTTOM..], &mut self.nodes[BOTTOM..]);
            match work.rest.take::<ANY, F>((index, lane), t, keys, nodes) {
                Some(0) => continue,
                Some(entries) => {
                    self.waiting += entries;
                    self.next::<ANY>(work.bvh, &work.shelves);
                }
                None => {}
            }
            count(|visits| visits.singles += 1);
            (self.group, self.lane) = (index, lane);
            self.best = Closest { t, u: 0.0, v: 0.0, id };
            group.take_single(lane, &mut self.ray);
            return true;
        }
        false
    }

    /// Puts the children of the next node that the ray meets on the stack.
    #[inline(always)]
    fn enter<const ANY: bool>(&mut self, bvh: &Bvh) {
        count(|visits| visits.nodes += 1);
        let (near, far) = self.ray.interval(&bvh.nodes[self.index as usize], self.best.t);
        let met = near.le(far);
        let bits = met.bits();
        let end = self.waiting;
        if ANY {
            (self.keys[end], self.nodes[end]) = (bits, self.index);
            self.waiting += usize::from(bits != 0);
        } else {
            self.keys[end..][..WIDTH].copy_from_slice(&Keys::farthest_first(near, met));
            self.nodes[end..][..WIDTH].fill(self.index);
            self.waiting += bits.count_ones() as usize;
        }
    }

    /// Tests the next leaf.
    #[inline(always)]
    fn meet<const ANY: bool>(&mut self, bvh: &Bvh) {
        if let Child::Leaf { kind, first, count } = Child::unpack(self.index, self.meta) {
            self.ray.meet(bvh, kind, first, count, &mut self.best);
            if !ANY {
                let window: &[u32; WIDTH] =
                    self.keys[self.waiting - WIDTH..self.waiting].try_into().expect("eight keys");
                self.waiting -= Keys::run_behind(window, self.best.t.max(0.0));
            } else if self.best.id != NO_HIT {
                self.waiting = BOTTOM;
            }
        }
    }

    /// Takes what comes next from the stack. False if nothing is left.
    #[inline(always)]
    fn next<const ANY: bool>(&mut self, bvh: &Bvh, shelves: &Shelves<4>) -> bool {
        if self.waiting == BOTTOM {
            return false;
        }
        let top = self.waiting - 1;
        let key = self.keys[top];
        let slot = if ANY {
            let rest = key & (key - 1);
            self.keys[top] = rest;
            self.waiting -= usize::from(rest == 0);
            key.trailing_zeros() as usize & 7
        } else {
            self.waiting = top;
            Keys::lane(key)
        };
        let node = &bvh.nodes[self.nodes[top] as usize];
        (self.index, self.meta) = (node.index[slot], node.meta[slot]);
        shelves.ask(Child::shelf(self.meta), self.index as usize);
        true
    }
}

/// The rays of one turn, by what comes next for them.
#[derive(Clone, Copy, Default)]
struct Turn {
    at_node: [u8; SIDE_BY_SIDE],
    at_leaf: [u8; SIDE_BY_SIDE],
    nodes: usize,
    leaves: usize,
}

impl Turn {
    /// Adds a ray, without a branch.
    #[inline(always)]
    fn add(&mut self, place: usize, meta: u32) {
        let leaf = (meta >> 31) as usize;
        self.at_node[self.nodes & (SIDE_BY_SIDE - 1)] = place as u8;
        self.at_leaf[self.leaves & (SIDE_BY_SIDE - 1)] = place as u8;
        self.nodes += 1 - leaf;
        self.leaves += leaf;
    }
}

/// Rays that take turns.
pub(super) struct Stream(Vec<Cursor>);

impl Stream {
    /// For many rays.
    pub(super) fn new() -> Self {
        Self(vec![Cursor::new(); SIDE_BY_SIDE])
    }

    /// For a ray that comes alone.
    pub(super) fn one() -> Self {
        Self(vec![Cursor::new()])
    }

    /// Traces what is left to rays of the groups: their closest hits, or any hits if `ANY`.
    pub(super) fn trace<const ANY: bool, F: Lanes>(
        &mut self,
        bvh: &Bvh,
        groups: &mut [Group<F>],
        rest: &Rest,
    ) {
        let which = rest.groups();
        if which == 0 || bvh.nodes.is_empty() {
            return;
        }
        for index in ones(which) {
            groups[index].prepare_boxes(bvh.extent);
        }
        let shelves = bvh.shelves();
        let mut work = Work { bvh, shelves, groups, rest, which, group: 0, lanes: 0 };
        let (mut now, mut next) = (&mut Turn::default(), &mut Turn::default());
        for (place, cursor) in self.0.iter_mut().enumerate() {
            if !cursor.start::<ANY, F>(&mut work) {
                break;
            }
            next.add(place, cursor.meta);
        }
        while next.nodes + next.leaves > 0 {
            std::mem::swap(&mut now, &mut next);
            (next.nodes, next.leaves) = (0, 0);
            for &place in &now.at_node[..now.nodes] {
                self.0[usize::from(place)].enter::<ANY>(bvh);
                self.go_on::<ANY, F>(usize::from(place), &mut work, next);
            }
            for &place in &now.at_leaf[..now.leaves] {
                self.0[usize::from(place)].meet::<ANY>(bvh);
                self.go_on::<ANY, F>(usize::from(place), &mut work, next);
            }
        }
    }

    /// Adds the ray to the next turn, or another one if it is done.
    #[inline(always)]
    fn go_on<const ANY: bool, F: Lanes>(
        &mut self,
        place: usize,
        work: &mut Work<'_, F>,
        next: &mut Turn,
    ) {
        let cursor = &mut self.0[place];
        if !cursor.next::<ANY>(work.bvh, &work.shelves) {
            work.groups[cursor.group].set(cursor.lane, &cursor.best);
            if !cursor.start::<ANY, F>(work) {
                return;
            }
        }
        next.add(place, cursor.meta);
    }
}

/// The rays that are still to start, and what all of them need.
struct Work<'a, F: Lanes> {
    bvh: &'a Bvh,
    shelves: Shelves<4>,
    groups: &'a mut [Group<F>],
    rest: &'a Rest,
    /// The groups that come after `group`.
    which: u32,
    group: usize,
    /// The lanes of `group` that are still to start.
    lanes: u32,
}

impl<F: Lanes> Work<'_, F> {
    /// The group and the lane of the next ray.
    #[inline(always)]
    fn next_ray(&mut self) -> Option<(usize, usize)> {
        while self.lanes == 0 {
            if self.which == 0 {
                return None;
            }
            self.group = self.which.trailing_zeros() as usize;
            self.which &= self.which - 1;
            self.lanes = self.rest.lanes(self.group);
        }
        let lane = self.lanes.trailing_zeros() as usize;
        self.lanes &= self.lanes - 1;
        Some((self.group, lane))
    }
}
