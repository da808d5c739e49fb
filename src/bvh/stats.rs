//! What a tree is like: for `octray info` and for whoever compares builds.

use super::node::{Child, WIDTH};
use super::{Bvh, LEAF};

/// Size, shape and cost of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BvhStats {
    /// Nodes of eight children.
    pub nodes: usize,
    /// Leaves, empty slots not counted.
    pub leaves: usize,
    /// Primitives in them.
    pub primitives: usize,
    /// Nodes on the longest way from the root.
    pub depth: usize,
    /// The expected cost of a random line through the root's box: one a node visited and one a
    /// primitive tested, weighted by the share of the root's area (Goldsmith and Salmon 1987).
    pub sah_cost: f64,
    /// The memory of nodes and leaves.
    pub bytes: usize,
}

impl Bvh {
    /// Size, shape and cost of the tree.
    pub fn stats(&self) -> BvhStats {
        let root_area = f64::from(self.bounds.half_area());
        let (mut leaves, mut primitives) = (0, 0);
        let mut cost = if self.nodes.is_empty() { 0.0 } else { root_area };
        for node in self.nodes.iter() {
            for slot in (0..WIDTH).filter(|&slot| node.meta[slot] != LEAF) {
                let area = f64::from(node.child_bounds(slot).half_area());
                match node.child(slot) {
                    Child::Inner(_) => cost += area,
                    Child::Leaf { count, .. } => {
                        leaves += 1;
                        primitives += count as usize;
                        cost += area * f64::from(count);
                    }
                }
            }
        }
        BvhStats {
            nodes: self.nodes.len(),
            leaves,
            primitives,
            depth: self.depth,
            sah_cost: if root_area > 0.0 { cost / root_area } else { 0.0 },
            bytes: self.nodes.bytes() + self.leaves.bytes(),
        }
    }
}
