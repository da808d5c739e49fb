//! Rays one by one, several at a time: each has a stack of its own, and they take turns.
//!
//! A step of a ray, a node or a leaf, is a long chain of dependent operations; what comes next is known
//! only at its end, and a guess that fails costs as much again. With turns, a step's outcome is looked
//! at when the others have made their steps, so their operations overlap, and what comes next is known
//! in time: a node, a leaf, or nothing, in which case another ray takes the place. No branch waits for a
//! step of its own turn.
//!
//! A child that starts behind the best hit is dropped; one that starts at it is not, since a hit at the
//! same `t` may have a smaller id.

use super::group::Group;
use super::rest::Rest;
use super::single::Single;
use super::stack::{DONE, Stack, orders};
use super::visits::count;
use super::{Closest, ones};
use crate::bvh::{Bvh, Child, LEAF, Node};
use crate::hit::NO_HIT;
use crate::prefetch::Shelves;
use crate::simd::{F32x8, Lanes, VectorMask, each};

/// How many rays take turns: a bit each of a word. Against 16, shuffled and ordered diffuse rays and ao on
/// bunny, atrium and terrain are 1.01 to 1.06 times as fast.
const SIDE_BY_SIDE: usize = 32;

/// How many rays enter their nodes in one go. A processor looks only so many operations ahead, most of
/// which wait for one step of a sort; those of several rays in turns wait less.
const ABREAST: usize = 2;

/// A ray on its way.
#[derive(Clone)]
#[repr(align(64))]
pub(super) struct Cursor {
    ray: Single,
    pub(super) best: Closest,
    /// Where the ray comes from, and its hit goes.
    from: Place,
    /// What comes next: the reference and the description of a [`Child`].
    index: u32,
    meta: u32,
    stack: Stack,
}

/// A lane of a group.
#[derive(Clone, Copy, Default)]
struct Place {
    group: u8,
    lane: u8,
}

impl Cursor {
    pub(super) fn new() -> Self {
        Self {
            ray: Single::default(),
            best: Closest { t: 0.0, u: 0.0, v: 0.0, id: NO_HIT },
            from: Place::default(),
            index: 0,
            meta: 0,
            stack: Stack::new(),
        }
    }

    /// Takes a ray, and what is left for it.
    #[inline(always)]
    fn start<const ANY: bool, F: Lanes>(&mut self, from: Place, group: &Group<F>, rest: &Rest) {
        count(|visits| visits.singles += 1);
        let lane = usize::from(from.lane);
        self.from = from;
        self.best = group.best(lane);
        rest.take::<ANY, F>((usize::from(from.group), lane), self.best.t, &mut self.stack);
        group.take_single(lane, &mut self.ray);
    }

    /// Takes the first ray of a group, which has the whole tree left.
    #[inline(always)]
    pub(super) fn start_whole<const ANY: bool, F: Lanes>(&mut self, group: &Group<F>) {
        count(|visits| visits.singles += 1);
        self.best = group.best(0);
        self.stack.start::<ANY>();
        group.take_single(0, &mut self.ray);
    }

    /// Goes on to what waits next, and gives its description: [`DONE`] if nothing does.
    #[inline(always)]
    pub(super) fn next(&mut self) -> u32 {
        (self.index, self.meta) = self.stack.pop();
        self.meta
    }

    /// Puts the children of the next node that the ray meets on the stack.
    #[inline(always)]
    pub(super) fn enter<const ANY: bool>(&mut self, bvh: &Bvh) {
        let node = &bvh.nodes[self.index as usize];
        self.stack.push::<ANY>(self.boxes(node), (&node.index, &node.meta));
    }

    /// Where the ray enters the children of a node, and which it meets.
    #[inline(always)]
    fn boxes(&self, node: &Node) -> (F32x8, VectorMask<F32x8>) {
        count(|visits| visits.nodes += 1);
        let (near, far) = self.ray.interval(node, self.best.t);
        (near, near.le(far))
    }

    /// Tests the next leaf.
    #[inline(always)]
    fn meet<const ANY: bool>(&mut self, bvh: &Bvh) {
        if let Child::Leaf { kind, first, count } = Child::unpack(self.index, self.meta) {
            self.ray.meet::<ANY, true>(bvh, kind, (first, count), &mut self.best);
            if ANY {
                self.stack.clear_if(self.best.id != NO_HIT);
            } else {
                self.stack.drop_behind(self.best.t.max(0.0));
            }
        }
    }

    /// As [`Cursor::meet`], by branches that guess that nothing is met.
    #[inline(always)]
    pub(super) fn meet_alone<const ANY: bool>(&mut self, bvh: &Bvh) {
        if let Child::Leaf { kind, first, count } = Child::unpack(self.index, self.meta) {
            let before = self.best.id;
            self.ray.meet::<ANY, false>(bvh, kind, (first, count), &mut self.best);
            if self.best.id == before {
                return;
            }
            if ANY {
                self.stack.clear();
            } else {
                self.stack.drop_behind(self.best.t.max(0.0));
            }
        }
    }
}

/// The rays of one turn, by what comes next for them: a bit for each place.
#[derive(Clone, Copy, Default)]
struct Turn {
    all: u32,
    /// Those at a leaf.
    leaves: u32,
    /// Those that are done.
    ends: u32,
}

impl Turn {
    /// Takes what comes next for the ray from its stack, and notes it.
    #[inline(always)]
    fn add<const ANY: bool>(&mut self, place: usize, cursor: &mut Cursor, shelves: &Shelves<4>) {
        let meta = cursor.next();
        // Any hit has no use for ids, which lie beside the leaves.
        if ANY {
            shelves.ask::<false>(Child::shelf(meta), cursor.index as usize);
        } else {
            shelves.ask::<true>(Child::shelf(meta), cursor.index as usize);
        }
        self.leaves |= u32::from(meta & LEAF != 0) << place;
        self.ends |= u32::from(meta & DONE != 0) << place;
    }

    /// Those at a node.
    #[inline(always)]
    fn nodes(&self) -> u32 {
        self.all & !self.leaves & !self.ends
    }
}

/// As [`Cursor::enter`], for several rays.
#[inline(always)]
fn enter<const ANY: bool>(
    cursors: &mut [Cursor; SIDE_BY_SIDE],
    places: [usize; ABREAST],
    bvh: &Bvh,
) {
    let places: [usize; ABREAST] = each(|ray| places[ray] % SIDE_BY_SIDE);
    let nodes: [&Node; ABREAST] = each(|ray| &bvh.nodes[cursors[places[ray]].index as usize]);
    let boxes: [_; ABREAST] = each(|ray| cursors[places[ray]].boxes(nodes[ray]));
    let keys = orders::<ANY, ABREAST>(boxes);
    for ray in 0..ABREAST {
        let node = nodes[ray];
        let stack = &mut cursors[places[ray]].stack;
        stack.put::<ANY>(keys[ray], boxes[ray].1, (&node.index, &node.meta));
    }
}

/// Rays that take turns.
pub(super) struct Stream {
    cursors: Vec<Cursor>,
    /// The rays that are still to start, the next one last.
    queue: Vec<Place>,
}

impl Stream {
    /// For many rays.
    pub(super) fn new() -> Self {
        Self { cursors: vec![Cursor::new(); SIDE_BY_SIDE], queue: Vec::new() }
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
        self.queue.clear();
        for index in ones(which) {
            groups[index].prepare_boxes(bvh.extent);
            let lanes = rest.lanes(index) & if ANY { groups[index].missing } else { u32::MAX };
            let place = |lane| Place { group: index as u8, lane: lane as u8 };
            self.queue.extend(ones(lanes).map(place));
        }
        self.queue.reverse();
        // An array, and places masked where they are used, need no checks.
        let Some(cursors) = self.cursors.first_chunk_mut::<SIDE_BY_SIDE>() else {
            return;
        };
        let shelves = bvh.shelves();
        let mut next = Turn::default();
        for (place, cursor) in cursors.iter_mut().enumerate() {
            let Some(from) = self.queue.pop() else {
                break;
            };
            cursor.start::<ANY, F>(from, &groups[usize::from(from.group)], rest);
            next.all |= 1 << place;
            next.add::<ANY>(place, cursor, &shelves);
        }
        while next.all != 0 {
            let now = next;
            next = Turn { all: now.all & !now.ends, ..Turn::default() };
            for place in ones(now.ends) {
                let cursor = &mut cursors[place % SIDE_BY_SIDE];
                let from = cursor.from;
                groups[usize::from(from.group)].set(usize::from(from.lane), &cursor.best);
                if let Some(from) = self.queue.pop() {
                    cursor.start::<ANY, F>(from, &groups[usize::from(from.group)], rest);
                    next.all |= 1 << place;
                    next.add::<ANY>(place, cursor, &shelves);
                }
            }
            let mut left = now.nodes();
            while left.count_ones() as usize >= ABREAST {
                let mut places = [0; ABREAST];
                for place in &mut places {
                    *place = left.trailing_zeros() as usize;
                    left &= left - 1;
                }
                enter::<ANY>(cursors, places, bvh);
            }
            for place in ones(left) {
                cursors[place % SIDE_BY_SIDE].enter::<ANY>(bvh);
            }
            for place in ones(now.nodes()) {
                next.add::<ANY>(place, &mut cursors[place % SIDE_BY_SIDE], &shelves);
            }
            for place in ones(now.leaves) {
                cursors[place % SIDE_BY_SIDE].meet::<ANY>(bvh);
            }
            for place in ones(now.leaves) {
                next.add::<ANY>(place, &mut cursors[place % SIDE_BY_SIDE], &shelves);
            }
        }
    }
}
