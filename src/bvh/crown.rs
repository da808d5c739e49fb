//! The top of the tree, split by clusters of primitives instead of single ones.
//!
//! Where clusters get few, their primitives are copied to their place in the order of the leaves,
//! and [`Builder`] goes on with them one by one.

use super::binary::{BinaryNode, BinaryTree};
use super::binning::Range;
use super::build::{Builder, SAH_DEPTH, TREELET};
use super::clusters::Cluster;
use super::outsized;
use super::plan::{self, Costs};
use super::primitive::BuildPrimitive;

/// Fewer clusters than this are split primitive by primitive,
const FEW_CLUSTERS: usize = 8;
/// and so are clusters with no more primitives than this.
const FEW_PRIMITIVES: usize = 128;

/// A part of the scene that is still in clusters.
pub(super) struct Bunch<'a> {
    /// All primitives, cluster by cluster.
    pub(super) sorted: &'a [BuildPrimitive],
    pub(super) clusters: &'a mut [Cluster],
    /// Where the part's primitives go, and where that is in the whole.
    pub(super) primitives: &'a mut [BuildPrimitive],
    pub(super) first: usize,
    /// The clusters' boxes, and their centres.
    pub(super) range: Range,
    pub(super) depth: usize,
}

impl<'a> Bunch<'a> {
    fn root(&self) -> BinaryNode {
        BinaryNode::new(self.range.bounds, self.first, self.primitives.len())
    }

    /// Copies the primitives one cluster after the other. Their range.
    fn gather(&mut self) -> Range {
        let (mut place, mut range) = (0, Range::empty());
        for cluster in &*self.clusters {
            let run = &self.sorted[cluster.first as usize..][..cluster.count as usize];
            self.primitives[place..][..run.len()].copy_from_slice(run);
            place += run.len();
            range = range.union(cluster.range);
        }
        range
    }

    /// Two parts, the first of so many clusters.
    fn cut(self, middle: usize, [left_range, right_range]: [Range; 2]) -> [Self; 2] {
        let Self { sorted, clusters, primitives, first, depth, .. } = self;
        let (left, right) = clusters.split_at_mut(middle);
        let count = left.iter().map(|cluster| cluster.count as usize).sum();
        let (left_primitives, right_primitives) = primitives.split_at_mut(count);
        let depth = depth + 1;
        let part = |clusters, primitives, first, range| Self {
            sorted,
            clusters,
            primitives,
            first,
            range,
            depth,
        };
        [
            part(left, left_primitives, first, left_range),
            part(right, right_primitives, first + count, right_range),
        ]
    }
}

impl Builder<'_> {
    /// Builds the tree over a bunch with all threads.
    pub(super) fn crown(&self, mut bunch: Bunch<'_>) -> (BinaryTree, Costs) {
        let (root, area) = (bunch.root(), bunch.range.bounds.half_area(self.area_scale));
        if bunch.primitives.len() <= TREELET {
            return self.treelet(root, |nodes| self.sprout(bunch, nodes));
        }
        let Some((middle, ranges)) = self.split_clusters(&mut bunch) else {
            let range = bunch.gather();
            return self.top(bunch.primitives, range, bunch.first, bunch.depth);
        };
        let [left, right] = bunch.cut(middle, ranges);
        let (left, right) = rayon::join(|| self.crown(left), || self.crown(right));
        let (costs, plan) = plan::fork(area, &left.1, &right.1);
        (BinaryTree::fork(BinaryNode { plan, ..root }, left.0, right.0), costs)
    }

    /// Builds the tree over a bunch with one thread, at the end of `nodes`.
    fn sprout(&self, mut bunch: Bunch<'_>, nodes: &mut Vec<BinaryNode>) -> Costs {
        let Some((middle, ranges)) = self.split_clusters(&mut bunch) else {
            let range = bunch.gather();
            return self.subtree(bunch.primitives, range, bunch.first, bunch.depth, nodes);
        };
        let area = bunch.range.bounds.half_area(self.area_scale);
        let place = nodes.len();
        nodes.push(bunch.root());
        let [left, right] = bunch.cut(middle, ranges);
        let left = self.sprout(left, nodes);
        nodes[place].second = (nodes.len() - place) as u32;
        let right = self.sprout(right, nodes);
        let (costs, plan) = plan::fork(area, &left, &right);
        nodes[place].plan = plan;
        costs
    }

    /// Partitions the clusters; `None` if the primitives are to be split one by one.
    #[inline(always)]
    fn split_clusters(&self, bunch: &mut Bunch<'_>) -> Option<(usize, [Range; 2])> {
        let few = bunch.clusters.len() < FEW_CLUSTERS || bunch.primitives.len() <= FEW_PRIMITIVES;
        if few || bunch.depth >= SAH_DEPTH {
            return None;
        }
        outsized::split(bunch.clusters, &mut bunch.range, self.area_scale)
    }
}
