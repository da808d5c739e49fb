//! Leaves that a tile enters before the tree: a guess at where its rays meet something.

use super::Tile;
use crate::bvh::{Bvh, Node};
use crate::simd::{F32x8, Lanes, each};
use crate::traverse::cull::Cull;
use crate::traverse::{ones, pace};

/// Leaves that a tile enters before the tree: somebody's guess where its rays will meet something.
#[derive(Default)]
pub(in crate::traverse) struct First {
    /// The leaves as children of nodes that are not in the tree.
    pub(in crate::traverse) nodes: Vec<Node>,
    /// How many rays met something there, and what that cost, in units of [`pace`].
    pub(in crate::traverse) settled: u32,
    pub(in crate::traverse) cost: u32,
}

impl<F: Lanes> Tile<F> {
    /// Tests the leaves that come first, each with the groups that it may settle.
    #[inline(never)]
    pub(super) fn enter_first<const APART: bool, C: Cull>(&mut self, bvh: &Bvh, cull: &mut C) {
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
                    if !pace::is_worth(rays, met, 1.0, node.meta[slot]) {
                        continue;
                    }
                }
                let child = (node.index[slot], node.meta[slot]);
                self.enter_child::<true, APART, C>(bvh, cull, met, child);
            }
        }
        self.first.cost += u32::MAX - std::mem::replace(&mut self.budget, budget);
        self.first.settled += met_rays(self) - met_before;
    }
}
