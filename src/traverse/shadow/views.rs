//! What up to 256 points see of the light: they go down the tree together, and primitives settle some.
//!
//! A point that no primitive comes near is lit, one that a single primitive covers is dark; what else a
//! primitive comes near to only rays can settle.

use super::descent::{Party, Waiting, descend};
use super::group::{Aim, PointGroup, around};
use super::shafts::{GROUPS, Shafts, Turned, one_box};
use super::tempo::Pause;
use crate::bvh::{Bvh, Node};
use crate::kernels::{Pyramids, Verdict};
use crate::points::SHADOW_T_MAX;
use crate::simd::{F32x16, LaneMask};
use crate::traverse::kept::{self, Kept};
use crate::traverse::stack_size;

thread_local! {
    static KEPT: Kept<Views> = const { Kept::new(None) };
}

/// Up to sixteen groups of sixteen points.
pub(super) struct Views {
    pub(super) groups: Vec<PointGroup>,
    /// The groups with a point that is not settled.
    pub(super) live: u32,
    stack: Vec<Waiting>,
    /// True if rays are dear: then a primitive that seems to be in the way is asked twice.
    pub(super) thorough: bool,
    /// How many primitives groups were tested with, each group by itself.
    pub(super) tests: usize,
    /// Whether descents paid lately.
    pub(super) pause: Pause,
    /// Where the light ends along the main axis, plus the margin.
    end: F32x16,
}

impl Views {
    /// For a query of this thread; to be given back by [`Views::leave`].
    pub(super) fn taken(bvh: &Bvh) -> Box<Self> {
        let mut views = kept::take(&KEPT, Self::new);
        views.stack.resize(stack_size(bvh), Waiting::default());
        views
    }

    /// Leaves it to the thread's next query.
    pub(super) fn leave(self: Box<Self>) {
        kept::keep(&KEPT, self);
    }

    fn new() -> Self {
        Self {
            groups: Vec::with_capacity(GROUPS),
            live: 0,
            stack: Vec::new(),
            thorough: false,
            tests: 0,
            pause: Pause::default(),
            end: F32x16::splat(0.0),
        }
    }

    /// Takes all groups out.
    pub(super) fn clear(&mut self) {
        self.tests = 0;
        self.groups.clear();
        self.live = 0;
    }

    /// Adds a group, of which there are at most [`GROUPS`].
    pub(super) fn push(&mut self, group: PointGroup) {
        self.live |= u32::from(group.live != 0) << self.groups.len();
        self.groups.push(group);
    }

    /// Settles what the primitives settle: what is live afterwards is lit.
    pub(super) fn settle(&mut self, bvh: &Bvh, aim: &Aim) {
        self.end = F32x16::splat(aim.end);
        if self.live != 0 && !bvh.nodes.is_empty() {
            let shafts = Shafts::new(*aim, around(self.groups.iter()));
            let mut stack = std::mem::take(&mut self.stack);
            descend(bvh, &shafts, self, &mut stack);
            self.stack = stack;
        }
    }

    /// Settles the points of a group whose shafts a primitive may reach; where the verdict is unsure, `again`
    /// says which points it misses all the same, and is told whether to be thorough. True if it settles any.
    #[inline(always)]
    fn meet(
        &mut self,
        index: usize,
        (boxes, slot): (&Turned, usize),
        verdict: impl FnOnce(&Pyramids<F32x16>) -> Verdict<F32x16>,
        again: impl FnOnce(&Pyramids<F32x16>, bool) -> u32,
    ) -> bool {
        self.tests += 1;
        let group = &mut self.groups[index];
        let points = group.beam.meets(&one_box(boxes, slot), self.end).bits() & group.live;
        if points == 0 {
            return false;
        }
        let verdict = verdict(&group.view);
        let mut reached = points & !verdict.missed.bits();
        let mut unsure = reached & !verdict.covered.bits();
        if unsure != 0 {
            let missed = unsure & again(&group.view, self.thorough);
            reached &= !missed;
            unsure &= !missed;
        }
        group.live &= !reached;
        group.unsure |= unsure;
        self.live &= !(u32::from(group.live == 0) << index);
        reached != 0
    }
}

impl Party for Views {
    fn live(&self) -> u32 {
        self.live
    }

    #[inline(always)]
    fn meets_box(&self, group: usize, boxes: &Turned, _: &Node, slot: usize) -> bool {
        let group = &self.groups[group];
        group.beam.meets(&one_box(boxes, slot), self.end).bits() & group.live != 0
    }

    #[inline(always)]
    fn triangle(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 9]) -> bool {
        let own: [_; 3] = corners(fields);
        self.meet(
            group,
            at,
            |view| view.triangle(own, SHADOW_T_MAX),
            |view, thorough| {
                // Of the surface that they lie on, mostly.
                let clear = view.clear_of_triangle(own, SHADOW_T_MAX).bits();
                if thorough { clear | view.beside(own).bits() } else { clear }
            },
        )
    }

    #[inline(always)]
    fn quad(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 12]) -> bool {
        let own: [_; 4] = corners(fields);
        self.meet(
            group,
            at,
            |view| view.quad(own, SHADOW_T_MAX),
            |view, thorough| {
                let clear = view.clear_of_quad(own, SHADOW_T_MAX).bits();
                if thorough { clear | view.beside(own).bits() } else { clear }
            },
        )
    }

    #[inline(always)]
    fn sphere(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 4]) -> bool {
        let [x, y, z, radius] = *fields;
        let center = [x, y, z];
        self.meet(
            group,
            at,
            |view| view.sphere(center, radius, SHADOW_T_MAX),
            |view, _| view.clear_of_sphere(center, radius).bits(),
        )
    }
}

fn corners<const CORNERS: usize>(fields: &[f32]) -> [[f32; 3]; CORNERS] {
    std::array::from_fn(|corner| std::array::from_fn(|axis| fields[3 * corner + axis]))
}
