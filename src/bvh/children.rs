//! Which binary nodes are the children of a node of eight: what the `plan` says.

use super::binary::Cursor;
use super::node::WIDTH;

/// The up to eight children of a node.
pub(super) struct Children<'a> {
    all: [Cursor<'a>; WIDTH],
    pub(super) count: usize,
}

impl<'a> Children<'a> {
    /// Those of the node that is made of `root`.
    #[inline]
    pub(super) fn of(root: Cursor<'a>) -> Self {
        let mut children = Self { all: [root; WIDTH], count: 0 };
        if root.node().plan.is_leaf() {
            // Only a tree that is one leaf as a whole.
            children.count = 1;
        } else {
            children.open(root, WIDTH);
        }
        children
    }

    /// Adds `root` as a forest of at most so many subtrees.
    fn open(&mut self, root: Cursor<'a>, forest: usize) {
        if let Some([to_the_left, to_the_right]) = root.node().plan.parts(forest) {
            let [left, right] = root.children();
            self.open(left, to_the_left);
            self.open(right, to_the_right);
        } else {
            self.all[self.count] = root;
            self.count += 1;
        }
    }

    /// In the order of the binary tree.
    #[inline]
    pub(super) fn iter(&self) -> impl Iterator<Item = Cursor<'a>> {
        self.all[..self.count].iter().copied()
    }
}
