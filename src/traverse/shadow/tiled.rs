//! Bundles of shadow rays as the groups of a tile: traced as rays of a batch are.
//!
//! The leaves in which the tile before met something are entered first, as long as that pays.

use super::tempo::Pause;
use crate::bvh::{Bvh, Child, Node, WIDTH};
use crate::geometry::Aabb;
use crate::kernels::ScaledRay;
use crate::points::SHADOW_T_MAX;
use crate::simd::{F32x16, Lanes};
use crate::traverse::kept::{self, Kept};
use crate::traverse::tile::GROUPS;
use crate::traverse::tracer::Tracer;

/// How many leaves are entered first.
const MOST_LEAVES: usize = 2 * WIDTH;

/// What a ray saves that met something in these leaves, in units of [`crate::traverse::pace`].
const WORTH: f32 = 3.0;

/// The most tiles that go without them.
const LONGEST_PAUSE: u32 = 15;

thread_local! {
    static KEPT: Kept<Tiled> = const { Kept::new(None) };
}

/// Up to sixteen bundles, each with a place that it is known by.
pub(super) struct Tiled {
    tracer: Tracer<F32x16>,
    /// The lanes of each bundle that have a ray, and its place; the first [`Tiled::len`] count.
    active: [u32; GROUPS],
    places: [usize; GROUPS],
    len: usize,
    /// The leaves that are entered first, and their boxes.
    recent: Vec<(Child, Aabb)>,
    /// Those in which this tile met something.
    met: Vec<(Child, Aabb)>,
    pause: Pause,
}

impl Tiled {
    /// For a query of this thread; to be given back by [`Tiled::leave`].
    pub(super) fn taken(bvh: &Bvh) -> Box<Self> {
        let mut tiled = kept::take(&KEPT, || Self::new(bvh));
        tiled.len = 0;
        tiled.tracer.turn_to(bvh);
        tiled.recent.clear();
        tiled
    }

    /// Leaves it to the thread's next query.
    pub(super) fn leave(self: Box<Self>) {
        kept::keep(&KEPT, self);
    }

    fn new(bvh: &Bvh) -> Self {
        Self {
            tracer: Tracer::new(bvh),
            active: [0; GROUPS],
            places: [0; GROUPS],
            len: 0,
            recent: Vec::with_capacity(MOST_LEAVES),
            met: Vec::with_capacity(MOST_LEAVES),
            pause: Pause::default(),
        }
    }

    /// True if no bundle has room.
    pub(super) fn is_full(&self) -> bool {
        self.len == GROUPS
    }

    /// Adds the rays from `origin` along `dir`, the lanes in `active`.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        origin: [F32x16; 3],
        dir: [F32x16; 3],
        active: u32,
        place: usize,
    ) {
        let (zero, t_max) = (F32x16::splat(0.0), F32x16::splat(SHADOW_T_MAX));
        let ray = ScaledRay::new(origin, dir, zero, t_max, F32x16::mask(active));
        self.tracer.tile.load_group(self.len, &ray);
        (self.active[self.len], self.places[self.len]) = (active, place);
        self.len += 1;
    }

    /// Traces all bundles, gives for the place of each the lanes whose rays have met nothing, and takes
    /// them out.
    pub(super) fn trace(&mut self, bvh: &Bvh, mut give: impl FnMut(usize, u32)) {
        if self.len == 0 {
            return;
        }
        self.tracer.trace::<true>(bvh);
        for (index, group) in self.tracer.tile.groups[..self.len].iter().enumerate() {
            give(self.places[index], self.active[index] & !group.met());
        }
        self.remember(bvh);
        self.len = 0;
    }

    /// Puts the leaves first in which something was met.
    fn remember(&mut self, bvh: &Bvh) {
        let first = &self.tracer.tile.first;
        if !first.nodes.is_empty() {
            self.pause.ended(WORTH * first.settled as f32, first.cost as f32, LONGEST_PAUSE);
        }
        self.met.clear();
        if self.pause.is_over() {
            self.collect(bvh);
        }
        if self.met == self.recent {
            return;
        }
        std::mem::swap(&mut self.met, &mut self.recent);
        self.tracer.tile.first.nodes.clear();
        for leaves in self.recent.chunks(WIDTH) {
            let mut node = Node::empty();
            for (slot, (leaf, bounds)) in leaves.iter().enumerate() {
                node.set(slot, bounds, *leaf);
            }
            self.tracer.tile.first.nodes.push(node);
        }
    }

    /// Collects the leaves in which a first or a last ray of a bundle met something.
    fn collect(&mut self, bvh: &Bvh) {
        let leaves = &bvh.leaves;
        for group in &self.tracer.tile.groups[..self.len] {
            let lanes = group.met();
            let ends = if lanes == 0 { [0; 2] } else { [lanes.trailing_zeros(), lanes.ilog2()] };
            for lane in ends.into_iter().filter(|_| lanes != 0) {
                let leaf = leaves.leaf_of(group.id(lane as usize));
                if self.met.len() < MOST_LEAVES && self.met.iter().all(|(other, _)| *other != leaf)
                {
                    let known = self.recent.iter().find(|(other, _)| *other == leaf);
                    let bounds = known.map_or_else(|| leaves.bounds_of(leaf), |known| known.1);
                    self.met.push((leaf, bounds));
                }
            }
        }
    }
}
