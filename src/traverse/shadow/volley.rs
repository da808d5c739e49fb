//! A volley: up to sixteen bundles of shadow rays that go down the tree together.
//!
//! The leaves in which the volley before met something are entered first: what stands before a point
//! mostly stands before its neighbours, too. A bundle whose rays all end there needs no descent.

use super::bundle::Bundle;
use super::descent::{Party, Place, Waiting, descend, enter_leaf};
use super::group::Aim;
use super::leaf::Leaf;
use super::shafts::{Beams, GROUPS, Shafts, Turned};
use crate::bvh::{Bvh, LEAF, Node};
use crate::simd::{F32x8, F32x16, Lanes, each};
use crate::traverse::kept::{self, Kept};
use crate::traverse::{ones, stack_size};

/// How many leaves are entered first.
const RECENT: usize = 16;

/// Leaves in which a volley met something.
pub(super) type Recent = Vec<Place>;

thread_local! {
    static KEPT: Kept<Volley> = const { Kept::new(None) };
}

/// Up to sixteen bundles.
pub(super) struct Volley {
    /// How far the scene reaches.
    extent: f32,
    /// The first [`Volley::len`] count.
    bundles: [Bundle; GROUPS],
    len: usize,
    beams: Beams,
    /// The bundles with a ray that has met nothing.
    live: u32,
    /// The leaves in which this volley met something.
    met: Recent,
    /// Those of the volley before.
    recent: Recent,
    stack: Vec<Waiting>,
    /// How many rays were tested against a leaf by themselves.
    alone: usize,
}

impl Volley {
    /// For a query of this thread; to be given back by [`Volley::leave`].
    pub(super) fn taken(bvh: &Bvh) -> Box<Self> {
        let mut volley = kept::take(&KEPT, Self::new);
        (volley.len, volley.live, volley.alone) = (0, 0, 0);
        volley.beams = Beams::new();
        volley.extent = bvh.extent;
        volley.met.clear();
        volley.recent.clear();
        volley.stack.resize(stack_size(bvh), Waiting::default());
        volley
    }

    /// Leaves it to the thread's next query.
    pub(super) fn leave(self: Box<Self>) {
        kept::keep(&KEPT, self);
    }

    fn new() -> Self {
        Self {
            extent: 0.0,
            bundles: [Bundle::empty(); GROUPS],
            len: 0,
            beams: Beams::new(),
            live: 0,
            met: Vec::with_capacity(RECENT),
            recent: Vec::with_capacity(RECENT),
            stack: Vec::new(),
            alone: 0,
        }
    }

    /// True if no bundle has room.
    pub(super) fn is_full(&self) -> bool {
        self.len == GROUPS
    }

    /// Adds the rays from `origin` along `dir`, the lanes in `active`, all of which `aim` bounds;
    /// `around` is where the origins are, if that is known.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        aim: &Aim,
        origin: [F32x16; 3],
        dir: [F32x16; 3],
        active: u32,
        around: Option<[[f32; 3]; 2]>,
    ) {
        let place = self.len;
        let bundle = &mut self.bundles[place];
        bundle.load(origin, dir, active, self.extent);
        let axes = aim.axes;
        let [mut low, mut high] = around.unwrap_or_else(|| bundle.origins(axes));
        for axis in 0..3 {
            low[axis] -= aim.margin;
            high[axis] += aim.margin;
        }
        self.beams.set(place, [low, high], bundle.slopes(axes));
        self.live |= u32::from(bundle.live() != 0) << place;
        self.len += 1;
    }

    /// Exchanges the leaves that the next volley enters first.
    pub(super) fn swap_recent(&mut self, recent: &mut Recent) {
        std::mem::swap(&mut self.met, recent);
    }

    /// How many rays were tested against a leaf by themselves since the last call.
    pub(super) fn take_alone(&mut self) -> usize {
        std::mem::take(&mut self.alone)
    }

    /// Traces all bundles, gives for each the lanes whose rays have met nothing, and takes them out.
    pub(super) fn trace(&mut self, bvh: &Bvh, aim: &Aim, mut give: impl FnMut(u32)) {
        if self.live != 0 && !bvh.nodes.is_empty() {
            self.trace_in(bvh, &Shafts::new(*aim, self.beams.beam()));
        }
        self.bundles[..self.len].iter().for_each(|bundle| give(bundle.seen()));
        self.len = 0;
        self.beams = Beams::new();
        self.live = 0;
    }

    fn trace_in(&mut self, bvh: &Bvh, shafts: &Shafts) {
        std::mem::swap(&mut self.met, &mut self.recent);
        self.met.clear();
        for recent in 0..self.recent.len() {
            if self.live == 0 {
                return;
            }
            let leaf = self.recent[recent];
            let bounds = leaf.node(bvh).bounds;
            let (boxes, [met, _]) = shafts.boxes(each(|at| F32x8::load(&bounds[at])));
            if met >> leaf.slot() & 1 != 0 {
                let groups = shafts.groups(&boxes, leaf.slot()) & self.live;
                if groups != 0 {
                    enter_leaf(bvh, shafts, self, groups, leaf);
                }
            }
        }
        if self.live != 0 {
            let mut stack = std::mem::take(&mut self.stack);
            descend(bvh, shafts, self, &mut stack);
            self.stack = stack;
        }
    }

    #[inline(always)]
    fn meet(&mut self, index: usize, test: impl FnOnce(&mut Bundle) -> bool) -> bool {
        let bundle = &mut self.bundles[index];
        let met = test(bundle);
        self.live &= !(u32::from(bundle.live() == 0) << index);
        met
    }
}

impl Party for Volley {
    fn live(&self) -> u32 {
        self.live
    }

    /// Few rays against many primitives are tested ray by ray, all primitives side by side.
    #[inline(always)]
    fn apart<const FIELDS: usize>(
        &mut self,
        groups: u32,
        node: &Node,
        slot: usize,
        leaf: &Leaf<'_, FIELDS>,
    ) -> (u32, bool) {
        let (mut rest, mut any) = (groups, false);
        for group in ones(groups) {
            let lanes = self.bundles[group].lanes_in_box(node, slot);
            if 2 * lanes.count_ones() <= leaf.count {
                rest &= !(1 << group);
                if lanes != 0 {
                    self.alone += lanes.count_ones() as usize;
                    any |= self.meet(group, |bundle| bundle.singly(lanes, leaf));
                }
            }
        }
        (rest, any)
    }

    #[inline(always)]
    fn meets_box(&self, group: usize, _: &Turned, node: &Node, slot: usize) -> bool {
        // Those of leaves are tested when they are entered: then fewer rays are left.
        node.meta[slot] & LEAF != 0 || self.bundles[group].lanes_in_box(node, slot) != 0
    }

    #[inline(always)]
    fn triangle(&mut self, group: usize, _: (&Turned, usize), fields: &[f32; 9]) -> bool {
        self.meet(group, |bundle| bundle.triangle(fields))
    }

    #[inline(always)]
    fn quad(&mut self, group: usize, _: (&Turned, usize), fields: &[f32; 12]) -> bool {
        self.meet(group, |bundle| bundle.quad(fields))
    }

    #[inline(always)]
    fn sphere(&mut self, group: usize, _: (&Turned, usize), fields: &[f32; 4]) -> bool {
        self.meet(group, |bundle| bundle.sphere(fields))
    }

    #[inline(always)]
    fn leaf_met(&mut self, leaf: Place) {
        if self.met.len() < RECENT && !self.met.contains(&leaf) {
            self.met.push(leaf);
        }
    }
}
