//! The binary tree that comes before the tree of eight.

use super::node::Child;
use super::outlook::Outlook;
use super::plan::Plan;
use super::primitive::{PrimitiveKey, SignedBox};
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
    /// a node of the top that stands for a node of a treelet: `first` is then the treelet's number,
    /// `count` the node's.
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

    /// A leaf of primitives that are laid out, without plan: `first` is their kind and slot, `second`
    /// what is expected of it.
    pub(super) fn laid(bounds: SignedBox, child: Child, outlook: Outlook) -> Self {
        let Child::Leaf { kind, first, count } = child else { unreachable!("it is a leaf") };
        let node = Self::new(bounds, 0, count as usize);
        let first = PrimitiveKey::new(kind, first).bits();
        Self { first, second: outlook.stopped_bits(), ..node }
    }

    /// What [`BinaryNode::laid`] was given.
    pub(super) fn as_laid(&self) -> (Child, Outlook) {
        let slot = PrimitiveKey::from_bits(self.first);
        let child = Child::Leaf { kind: slot.kind(), first: slot.id(), count: self.count };
        (child, Outlook::of_stopped_bits(self.second))
    }

    /// Stands for a node of a treelet.
    pub(super) fn link(treelet: u32, node: u32) -> Self {
        Self { first: treelet, ..Self::new(SignedBox::empty(), 0, node as usize) }
    }
}

impl BinaryTree {
    /// A tree that is one treelet.
    pub(super) fn treelet(nodes: Vec<BinaryNode>, mixed: bool) -> Self {
        Self { top: vec![BinaryNode::link(0, 0)], treelets: vec![nodes], mixed }
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

    /// From a node of the top that stands for a node of a treelet to that.
    #[inline(always)]
    fn resolved(self) -> Self {
        let node = self.node();
        if std::ptr::eq(self.nodes, self.tree.top.as_slice()) && node.second == 0 {
            let (treelet, index) = (node.first as usize, node.count as usize);
            Self { nodes: &self.tree.treelets[treelet], index, ..self }
        } else {
            self
        }
    }
}
