//! The top of the fastest build's tree: blocks of the curve put together by the surface area
//! heuristic.
//!
//! A tree over `n` blocks has `2 n - 1` nodes, so each half has its place before it is made: all
//! threads write into one array.

use glam::Vec4;

use super::binary::BinaryNode;
use super::binning::{Binned, Range};
use super::build::MAX_DEPTH;
use super::outsized;
use super::plan::{self, Costs};
use super::primitive::SignedBox;

/// Up to so many blocks are put together by one thread.
const ALONE: usize = 256;

/// A part of the tree that is made.
#[derive(Clone, Copy)]
pub(super) struct Block {
    pub(super) bounds: SignedBox,
    pub(super) costs: Costs,
    /// The nodes on the longest way down.
    pub(super) height: u32,
    pub(super) count: u32,
    /// Where its root is: which treelet, and which node there.
    pub(super) task: u32,
    pub(super) node: u32,
}

impl Binned for Block {
    #[inline(always)]
    fn signed_box(&self) -> SignedBox {
        self.bounds
    }

    #[inline(always)]
    fn center(&self) -> Vec4 {
        self.bounds.center()
    }

    #[inline(always)]
    fn weight(&self) -> u32 {
        self.count
    }

    /// A block stays together, so it can be outsized as a primitive can.
    #[inline(always)]
    fn lone_area(&self, area_scale: f32) -> f32 {
        self.bounds.half_area(area_scale)
    }
}

/// The nodes above the blocks, each after its parent and its elder siblings' children.
pub(super) fn build(blocks: &mut [Block], area_scale: f32) -> Vec<BinaryNode> {
    let height = blocks.iter().map(|block| block.height).max().unwrap_or(0) as usize;
    let mut nodes = vec![BinaryNode::new(SignedBox::empty(), 0, 0); 2 * blocks.len() - 1];
    let range = Range::of(blocks);
    Roof { area_scale, most: MAX_DEPTH - height }.fill(blocks, range, 0, &mut nodes);
    nodes
}

struct Roof {
    area_scale: f32,
    /// No way to a block has more nodes.
    most: usize,
}

impl Roof {
    /// Fills `nodes` with the tree over `blocks`, `depth` below the root.
    fn fill(
        &self,
        blocks: &mut [Block],
        mut range: Range,
        depth: usize,
        nodes: &mut [BinaryNode],
    ) -> (u32, Costs) {
        if let [block] = blocks {
            nodes[0] = BinaryNode::link(block.task, block.node);
            return (block.count, block.costs);
        }
        // Halved from here on it would be so deep. A split may leave all but one on one side, which
        // takes one more.
        let halved = depth + blocks.len().next_power_of_two().ilog2() as usize;
        let (middle, ranges) = self.split(blocks, &mut range, halved < self.most);
        let alone = blocks.len() <= ALONE;
        let (left, right) = blocks.split_at_mut(middle);
        let (root, below) = nodes.split_first_mut().expect("two nodes less one for each block");
        let (left_nodes, right_nodes) = below.split_at_mut(2 * middle - 1);
        let mut left = || self.fill(left, ranges[0], depth + 1, left_nodes);
        let mut right = || self.fill(right, ranges[1], depth + 1, right_nodes);
        let (left, right) = if alone { (left(), right()) } else { rayon::join(left, right) };
        let area = range.bounds.half_area(self.area_scale);
        let (costs, plan) = plan::fork(area, &left.1, &right.1);
        let (count, second) = (left.0 + right.0, 2 * middle as u32);
        *root = BinaryNode { second, plan, ..BinaryNode::new(range.bounds, 0, count as usize) };
        (count, costs)
    }

    /// Partitions the blocks, by cost if they may: how many are of the first part, and both parts' boxes.
    fn split(&self, blocks: &mut [Block], range: &mut Range, by_cost: bool) -> (usize, [Range; 2]) {
        if by_cost && let Some(parts) = outsized::split(blocks, range, self.area_scale) {
            return parts;
        }
        let (left, right) = blocks.split_at(blocks.len() / 2);
        (left.len(), [Range::of(left), Range::of(right)])
    }
}
