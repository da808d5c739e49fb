//! A binary tree over boxes by the surface area heuristic, and the plan of the tree of eight.
//!
//! The builder sees boxes, kinds and ids, never primitives. Splits partition one array in place, so
//! the order of its entries afterwards is the order of the tree's leaves. The top of the tree is
//! split by all threads; below [`TREELET`] primitives a *treelet* belongs to one thread. What is
//! done follows from the counts alone: the tree is the same for every number of threads.
//!
//! Invariants: every leaf holds primitives of one kind, at most [`MAX_LEAF`]; no way from the root
//! is longer than [`MAX_DEPTH`] (after `SAH_DEPTH` splits, ranges are halved).

use rayon::prelude::*;

use super::binning::{Bins, Grid, MAX_BINS, Range, Split};
use super::node::MAX_LEAF;
use super::plan::{self, Costs, Plan};
use super::primitive::BuildPrimitive;
use super::quality::BuildQuality;
use crate::geometry::Aabb;

/// No way from the root to a leaf has more nodes: `SAH_DEPTH` splits by cost, then the 26 halvings
/// that the largest scene needs, then two to part the kinds of a mixed leaf.
pub const MAX_DEPTH: usize = SAH_DEPTH + 28;

/// How many splits are chosen by cost on one way before ranges are halved.
const SAH_DEPTH: usize = 48;

/// Up to this many primitives of one kind are not split any further. Deciding at 8, before the plan
/// does, builds a third faster and costs the rays a tenth of their speed.
const SMALLEST_SPLIT: usize = 2;

/// Below this count a range has half as many bins: the search of the bins is most of its time.
const FEW: usize = 64;

/// Up to this count a range is built by the thread that has it.
pub(super) const TREELET: usize = 4096;

/// Larger ranges are binned and partitioned in chunks of this size.
const CHUNK: usize = 16_384;

/// A node of the binary tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinaryNode {
    pub(super) bounds: Aabb,
    /// The first primitive of its range.
    pub(super) first: u32,
    /// How many there are.
    pub(super) count: u32,
    /// How far on its second child is; the first comes right after the node. 0 in a leaf, and in
    /// a node of the top that stands for a treelet, `first` is then the treelet's number.
    second: u32,
    pub(super) plan: Plan,
}

/// The binary tree: its top, and the treelets that hang from it, in order.
#[derive(Debug, Default)]
pub(super) struct BinaryTree {
    top: Vec<BinaryNode>,
    treelets: Vec<Vec<BinaryNode>>,
}

/// A node of a [`BinaryTree`].
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a> {
    tree: &'a BinaryTree,
    nodes: &'a [BinaryNode],
    index: usize,
}

impl BinaryTree {
    pub(super) fn root(&self) -> Cursor<'_> {
        Cursor { tree: self, nodes: &self.top, index: 0 }.resolved()
    }
}

impl<'a> Cursor<'a> {
    #[inline(always)]
    pub(super) fn node(&self) -> &'a BinaryNode {
        &self.nodes[self.index]
    }

    /// Its two children. It must not be a leaf.
    #[inline(always)]
    pub(super) fn children(self) -> [Self; 2] {
        let second = self.index + self.node().second as usize;
        [self.index + 1, second].map(|index| Self { index, ..self }.resolved())
    }

    /// From a node of the top that stands for a treelet to the treelet's root.
    #[inline(always)]
    fn resolved(self) -> Self {
        let node = self.node();
        if std::ptr::eq(self.nodes, self.tree.top.as_slice()) && node.second == 0 {
            Self { nodes: &self.tree.treelets[node.first as usize], index: 0, ..self }
        } else {
            self
        }
    }
}

/// Sorts `primitives` into leaf order and returns the tree over them, and the box around them.
pub(super) fn build(
    primitives: &mut [BuildPrimitive],
    _quality: BuildQuality,
) -> (BinaryTree, Aabb) {
    if primitives.is_empty() {
        return (BinaryTree::default(), Aabb::EMPTY);
    }
    let range = primitives.par_chunks(CHUNK).map(Range::of).reduce(Range::empty, Range::union);
    let mixed = primitives.par_chunks(CHUNK).any(|chunk| !one_kind(chunk, primitives[0]));
    let bounds = range.bounds.aabb();
    let extent = bounds.min.abs().max(bounds.max.abs()).max_element();
    let builder = Builder { area_scale: (1.0 / extent).min(f32::MAX), mixed };
    let (mut tree, _) = builder.top(primitives, range, 0, 0);
    let links = tree.top.iter_mut().filter(|node| node.second == 0);
    links.zip(0..).for_each(|(link, treelet)| link.first = treelet);
    (tree, bounds)
}

fn one_kind(primitives: &[BuildPrimitive], like: BuildPrimitive) -> bool {
    primitives.iter().all(|one| one.kind() == like.kind())
}

struct Builder {
    /// What coordinates are multiplied by before areas are taken.
    area_scale: f32,
    /// True if primitives are of several kinds.
    mixed: bool,
}

impl Builder {
    /// Builds with all threads the tree over `primitives`, which start at `first`.
    fn top(
        &self,
        primitives: &mut [BuildPrimitive],
        range: Range,
        first: usize,
        depth: usize,
    ) -> (BinaryTree, Costs) {
        let count = primitives.len();
        let root = BinaryNode {
            bounds: range.bounds.aabb(),
            first: first as u32,
            count: count as u32,
            second: 0,
            plan: Plan::default(),
        };
        if count <= TREELET {
            let mut nodes = Vec::with_capacity(count);
            let costs = self.subtree(primitives, range, first, depth, &mut nodes);
            return (BinaryTree { top: vec![root], treelets: vec![nodes] }, costs);
        }
        let (middle, [left_range, right_range]) =
            self.split(primitives, range, depth).expect("too many for a leaf");
        let (left, right) = primitives.split_at_mut(middle);
        let ((left, left_costs), (right, right_costs)) = rayon::join(
            || self.top(left, left_range, first, depth + 1),
            || self.top(right, right_range, first + middle, depth + 1),
        );
        let area = range.bounds.half_area(self.area_scale);
        let (costs, plan) = plan::fork(area, None, &left_costs, &right_costs);
        let mut top = vec![BinaryNode { second: 1 + left.top.len() as u32, plan, ..root }];
        top.extend(left.top.into_iter().chain(right.top));
        let mut treelets = left.treelets;
        treelets.extend(right.treelets);
        (BinaryTree { top, treelets }, costs)
    }

    /// Builds the tree over `primitives`, which start at `first`, at the end of `nodes`.
    fn subtree(
        &self,
        primitives: &mut [BuildPrimitive],
        range: Range,
        first: usize,
        depth: usize,
        nodes: &mut Vec<BinaryNode>,
    ) -> Costs {
        let (count, place) = (primitives.len(), nodes.len());
        let area = range.bounds.half_area(self.area_scale);
        let node = BinaryNode {
            bounds: range.bounds.aabb(),
            first: first as u32,
            count: count as u32,
            second: 0,
            plan: Plan::default(),
        };
        nodes.push(node);
        let Some((middle, [left_range, right_range])) = self.split(primitives, range, depth) else {
            let (costs, plan) = plan::leaf(area, count);
            nodes[place].plan = plan;
            return costs;
        };
        let leaf_count = self.leaf_fits(primitives).then_some(count);
        let (left, right) = primitives.split_at_mut(middle);
        let left_costs = self.subtree(left, left_range, first, depth + 1, nodes);
        nodes[place].second = (nodes.len() - place) as u32;
        let right_costs = self.subtree(right, right_range, first + middle, depth + 1, nodes);
        let (costs, plan) = plan::fork(area, leaf_count, &left_costs, &right_costs);
        nodes[place].plan = plan;
        costs
    }

    /// True if these primitives can be a leaf.
    #[inline(always)]
    fn leaf_fits(&self, primitives: &[BuildPrimitive]) -> bool {
        primitives.len() <= MAX_LEAF && (!self.mixed || one_kind(primitives, primitives[0]))
    }

    /// Partitions the range: the size of its first part, and both parts' boxes. `None` if it is not
    /// to be split.
    #[inline(always)]
    fn split(
        &self,
        primitives: &mut [BuildPrimitive],
        range: Range,
        depth: usize,
    ) -> Option<(usize, [Range; 2])> {
        let count = primitives.len();
        if count <= SMALLEST_SPLIT && self.leaf_fits(primitives) {
            return None;
        }
        if depth < SAH_DEPTH
            && let Some(split) = self.cheapest_split(primitives, range)
        {
            return Some(split.partition(primitives));
        }
        // All centres in one bin, or too deep for the heuristic: halve what is too large.
        if self.leaf_fits(primitives) {
            return None;
        }
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

    #[inline(always)]
    fn cheapest_split(&self, primitives: &[BuildPrimitive], range: Range) -> Option<Split> {
        let count = primitives.len();
        let bins = if count < FEW { MAX_BINS / 2 } else { MAX_BINS };
        let grid = Grid::new(range.centers, bins);
        let bins = if count > CHUNK {
            let chunks = primitives.par_chunks(CHUNK).map(|chunk| Bins::of(chunk, &grid));
            chunks.reduce_with(Bins::merged).expect("not empty")
        } else {
            Bins::of(primitives, &grid)
        };
        bins.cheapest_split(&grid, self.area_scale)
    }
}
