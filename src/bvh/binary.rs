//! The binary tree that comes before the tree of eight.

use super::plan::Plan;
use super::primitive::SignedBox;
use crate::geometry::Aabb;

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
    pub(super) second: u32,
    pub(super) plan: Plan,
}

/// The binary tree: its top, and the treelets that hang from it, in order.
#[derive(Debug, Default)]
pub(super) struct BinaryTree {
    pub(super) top: Vec<BinaryNode>,
    pub(super) treelets: Vec<Vec<BinaryNode>>,
    /// True if its primitives are of several kinds.
    pub(super) mixed: bool,
}

/// A node of a [`BinaryTree`].
#[derive(Clone, Copy)]
pub(super) struct Cursor<'a> {
    tree: &'a BinaryTree,
    nodes: &'a [BinaryNode],
    index: usize,
}

impl BinaryNode {
    /// A node without children and without plan.
    pub(super) fn new(bounds: SignedBox, first: usize, count: usize) -> Self {
        let (first, count) = (first as u32, count as u32);
        Self { bounds: bounds.aabb(), first, count, second: 0, plan: Plan::default() }
    }
}

impl BinaryTree {
    /// A tree that is one treelet, the root of which is a copy of `root`.
    pub(super) fn treelet(root: BinaryNode, nodes: Vec<BinaryNode>, mixed: bool) -> Self {
        Self { top: vec![root], treelets: vec![nodes], mixed }
    }

    /// A tree with these two below its root.
    pub(super) fn fork(root: BinaryNode, left: Self, right: Self) -> Self {
        let mut top = Vec::with_capacity(1 + left.top.len() + right.top.len());
        top.push(BinaryNode { second: 1 + left.top.len() as u32, ..root });
        top.extend(left.top.into_iter().chain(right.top));
        let mut treelets = left.treelets;
        treelets.extend(right.treelets);
        Self { top, treelets, mixed: left.mixed }
    }

    /// Numbers the treelets, once the tree is whole.
    pub(super) fn link(&mut self) {
        let links = self.top.iter_mut().filter(|node| node.second == 0);
        links.zip(0..).for_each(|(link, treelet)| link.first = treelet);
    }

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
