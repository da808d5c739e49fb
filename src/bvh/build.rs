//! A binary tree over boxes by the surface area heuristic, and the plan of the tree of eight.
//!
//! The builder sees boxes, kinds and ids, never primitives. Neighbours are put together first
//! (`clusters`), and the top of the tree is split by clusters (`crown`). What follows partitions one
//! array in place, so the order of its entries afterwards is that of the tree's leaves. The top is
//! split by all threads; below [`TREELET`] primitives a *treelet* belongs to one thread. What is done
//! follows from the counts alone: the tree is the same for every number of threads.
//!
//! Invariants: every leaf holds primitives of one kind, at most [`MAX_LEAF`]; no way from the root
//! is longer than [`MAX_DEPTH`] (after `SAH_DEPTH` splits, ranges are halved).

use rayon::prelude::*;

use super::PrimitiveSource;
use super::binary::{BinaryNode, BinaryTree};
use super::binning::Range;
use super::clusters::{self, Sorted};
use super::crown::Bunch;
use super::node::MAX_LEAF;
use super::outsized;
use super::plan::{self, Costs};
use super::primitive::BuildPrimitive;
use super::quality::BuildQuality;
use super::reinsert;
use super::watch::{Cancelled, Watch};
use crate::geometry::Aabb;

/// No way from the root to a leaf has more nodes: `SAH_DEPTH` splits by cost, then the 26 halvings
/// that the largest scene needs, then two to part the kinds of a mixed leaf.
pub const MAX_DEPTH: usize = SAH_DEPTH + 28;

/// How many splits are chosen by cost on one way before ranges are halved.
pub(super) const SAH_DEPTH: usize = 48;

/// Up to this count a range is built by the thread that has it.
pub(super) const TREELET: usize = 4096;

/// What gets moved afterwards is split down to so many primitives, so that halves of leaves can move, too.
/// Down to two, rays are as fast, and the build takes 1.6 times as long.
const LOOSE_LEAF: usize = 4;

/// Larger ranges are binned and partitioned in chunks of this size.
pub(super) const CHUNK: usize = 16_384;

/// The boxes of all primitives.
pub(super) fn boxes(ids: usize, source: &impl PrimitiveSource) -> Vec<BuildPrimitive> {
    let blank = (0..ids).into_par_iter().map(|_| BuildPrimitive::left_out());
    let mut primitives: Vec<BuildPrimitive> = blank.collect();
    primitives.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, primitives)| {
        source.boxes((chunk * CHUNK) as u32, primitives);
    });
    primitives
}

/// Sorts `primitives` into leaf order and returns the tree over them, and the box around them.
pub(super) fn build(
    primitives: &mut [BuildPrimitive],
    quality: BuildQuality,
    watch: &Watch<'_>,
) -> Result<(BinaryTree, Aabb), Cancelled> {
    if primitives.is_empty() {
        return Ok((BinaryTree::default(), Aabb::EMPTY));
    }
    let range = primitives.par_chunks(CHUNK).map(Range::of).reduce(Range::empty, Range::union);
    let mixed = primitives.par_chunks(CHUNK).any(|chunk| !one_kind(chunk, primitives[0]));
    let bounds = range.bounds.aabb();
    let area_scale = area_scale(&bounds);
    let most = if quality == BuildQuality::High { LOOSE_LEAF } else { MAX_LEAF };
    let builder = Builder { area_scale, mixed, most, watch };
    let Sorted { primitives: sorted, mut clusters } = clusters::sort(primitives, range);
    watch.check()?;
    let range = clusters.par_chunks(CHUNK).map(Range::of).reduce(Range::empty, Range::union);
    let (clusters, sorted) = (clusters.as_mut_slice(), sorted.as_slice());
    let bunch = Bunch { sorted, clusters, primitives, first: 0, range, depth: 0 };
    let (mut tree, _) = builder.crown(bunch);
    watch.check()?;
    tree.link();
    if quality == BuildQuality::High {
        reinsert::improve(&mut tree, primitives, area_scale, watch)?;
    }
    Ok((tree, bounds))
}

/// What coordinates within `bounds` are multiplied by before areas are taken.
pub(super) fn area_scale(bounds: &Aabb) -> f32 {
    let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
    (1.0 / extent).min(f32::MAX)
}

/// True if all are of one kind.
pub(super) fn one_kind(primitives: &[BuildPrimitive], like: BuildPrimitive) -> bool {
    primitives.iter().all(|one| one.kind() == like.kind())
}

/// Splits ranges of primitives until they are leaves.
pub(super) struct Builder<'a> {
    /// What coordinates are multiplied by before areas are taken.
    pub(super) area_scale: f32,
    /// True if primitives are of several kinds.
    pub(super) mixed: bool,
    /// Larger ranges are split.
    most: usize,
    watch: &'a Watch<'a>,
}

impl Builder<'_> {
    /// A tree of one treelet, whose nodes `fill` makes unless nobody waits for them any more.
    pub(super) fn treelet(
        &self,
        root: BinaryNode,
        fill: impl FnOnce(&mut Vec<BinaryNode>) -> Costs,
    ) -> (BinaryTree, Costs) {
        let count = root.count as usize;
        let mut nodes = Vec::new();
        let costs = if self.watch.is_cancelled() {
            // The tree will be thrown away, so any will do.
            nodes.push(root);
            plan::leaf(0.0, count).0
        } else {
            nodes.reserve(count / 2);
            fill(&mut nodes)
        };
        self.watch.add(count);
        (BinaryTree::treelet(nodes, self.mixed), costs)
    }

    /// Builds with all threads the tree over `primitives`, which start at `first`.
    pub(super) fn top(
        &self,
        primitives: &mut [BuildPrimitive],
        range: Range,
        first: usize,
        depth: usize,
    ) -> (BinaryTree, Costs) {
        let root = BinaryNode::new(range.bounds, first, primitives.len());
        if primitives.len() <= TREELET {
            return self
                .treelet(root, |nodes| self.subtree(primitives, range, first, depth, nodes));
        }
        let area = range.bounds.half_area(self.area_scale);
        let (middle, [left_range, right_range]) =
            self.split(primitives, range, depth).expect("too many for a leaf");
        let (left, right) = primitives.split_at_mut(middle);
        let (left, right) = rayon::join(
            || self.top(left, left_range, first, depth + 1),
            || self.top(right, right_range, first + middle, depth + 1),
        );
        let (costs, plan) = plan::fork(area, &left.1, &right.1);
        (BinaryTree::fork(BinaryNode { plan, ..root }, left.0, right.0), costs)
    }

    /// Builds the tree over `primitives`, which start at `first`, at the end of `nodes`.
    pub(super) fn subtree(
        &self,
        primitives: &mut [BuildPrimitive],
        range: Range,
        first: usize,
        depth: usize,
        nodes: &mut Vec<BinaryNode>,
    ) -> Costs {
        let (count, place) = (primitives.len(), nodes.len());
        let area = range.bounds.half_area(self.area_scale);
        nodes.push(BinaryNode::new(range.bounds, first, count));
        let Some((middle, [left_range, right_range])) = self.split(primitives, range, depth) else {
            let (costs, plan) = plan::leaf(area, count);
            nodes[place].plan = plan;
            return costs;
        };
        let (left, right) = primitives.split_at_mut(middle);
        let left_costs = self.subtree(left, left_range, first, depth + 1, nodes);
        nodes[place].second = (nodes.len() - place) as u32;
        let right_costs = self.subtree(right, right_range, first + middle, depth + 1, nodes);
        let (costs, plan) = plan::fork(area, &left_costs, &right_costs);
        nodes[place].plan = plan;
        costs
    }

    /// True if these primitives become a leaf.
    #[inline(always)]
    fn leaf_fits(&self, primitives: &[BuildPrimitive]) -> bool {
        primitives.len() <= self.most && (!self.mixed || one_kind(primitives, primitives[0]))
    }

    /// Partitions the range: the size of its first part, and both parts' boxes. `None` if it is not
    /// to be split.
    #[inline(always)]
    fn split(
        &self,
        primitives: &mut [BuildPrimitive],
        mut range: Range,
        depth: usize,
    ) -> Option<(usize, [Range; 2])> {
        let count = primitives.len();
        // What one leaf can hold stays together: splits down to two and leaves by the plan cost a
        // third of the time, and the rays are no faster for it.
        if self.leaf_fits(primitives) {
            return None;
        }
        if depth < SAH_DEPTH
            && let Some(parts) = outsized::split(primitives, &mut range, self.area_scale)
        {
            return Some(parts);
        }
        // All centres in one bin, or too deep for the heuristic: halve what is too large.
        let by_kind = count <= MAX_LEAF || !(SAH_DEPTH..MAX_DEPTH - 4).contains(&depth);
        let middle = if self.mixed && by_kind && !one_kind(primitives, primitives[0]) {
            primitives.sort_unstable_by_key(|one| (one.kind() as u8, one.id()));
            let kind = primitives[0].kind();
            primitives.partition_point(|one| one.kind() == kind)
        } else {
            count / 2
        };
        let (left, right) = primitives.split_at(middle);
        Some((middle, [Range::of(left), Range::of(right)]))
    }
}
