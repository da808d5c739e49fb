//! The lowest part of the fastest build: primitives along Morton's curve are split where the curve
//! crosses from one half of a box of cells to the other. No costs are compared.

use super::binary::BinaryNode;
use super::binning::{Binned, Range};
use super::build::{Builder, SAH_DEPTH};
use super::curve;
use super::node::MAX_LEAF;
use super::plan::{self, Costs};
use super::primitive::{BuildPrimitive, SignedBox};

impl Builder<'_> {
    /// Builds the tree over `primitives`, which start at `first` and have these keys, at the end of
    /// `nodes`. The box around them.
    pub(super) fn linear(
        &self,
        primitives: &mut [BuildPrimitive],
        keys: &[u32],
        first: usize,
        depth: usize,
        nodes: &mut Vec<BinaryNode>,
    ) -> (SignedBox, Costs) {
        let (count, place) = (primitives.len(), nodes.len());
        if self.leaf_fits(primitives) {
            let empty = SignedBox::empty();
            let bounds = primitives.iter().fold(empty, |all, one| all.union(one.signed_box()));
            let (costs, plan) = plan::leaf(bounds.half_area(self.area_scale), count);
            nodes.push(BinaryNode { plan, ..BinaryNode::new(bounds, first, count) });
            return (bounds, costs);
        }
        if count <= MAX_LEAF {
            // Of several kinds, which are parted there.
            let range = Range::of(primitives);
            return (range.bounds, self.subtree(primitives, range, first, depth, nodes));
        }
        let middle = if depth < SAH_DEPTH { curve::middle(keys) } else { count / 2 };
        let (left, right) = primitives.split_at_mut(middle);
        let (left_keys, right_keys) = keys.split_at(middle);
        nodes.push(BinaryNode::new(SignedBox::empty(), first, count));
        let left = self.linear(left, left_keys, first, depth + 1, nodes);
        let second = (nodes.len() - place) as u32;
        let right = self.linear(right, right_keys, first + middle, depth + 1, nodes);
        let bounds = left.0.union(right.0);
        let (costs, plan) = plan::fork(bounds.half_area(self.area_scale), &left.1, &right.1);
        nodes[place] = BinaryNode { second, plan, ..BinaryNode::new(bounds, first, count) };
        (bounds, costs)
    }
}
