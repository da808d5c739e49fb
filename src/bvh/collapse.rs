//! From the binary tree and its plan to nodes of eight children, and the primitives in leaf order.
//!
//! The nodes near the root are made first. What hangs below them is cut into tasks of up to
//! [`TASK`] primitives, each with its own part of every leaf array if leaves are laid out here: all
//! threads work at once, and nodes and leaves come in the same order for every number of threads.

use rayon::prelude::*;

use super::PrimitiveSource;
use super::binary::{BinaryNode, BinaryTree, Cursor};
use super::children::Children;
use super::lay::{Layer, Room, Shape, Slots};
use super::leaves::Leaves;
use super::node::{Child, MAX_LEAF, Node, WIDTH};
use super::outlook::{self, Outlook, Slot};
use super::primitive::PrimitiveKey;
use super::watch::{Cancelled, Watch};
use crate::geometry::Aabb;
use crate::pages::{Fresh, Frozen, Term};

/// A subtree of up to this many primitives is laid out by one thread.
const TASK: usize = 8192;

/// There are rarely more nodes than one for so many primitives.
const PER_NODE: usize = 16;

/// Nodes and the depth of the wide tree over primitives that are not laid out yet, and their leaves.
pub(super) fn collapse(
    tree: &BinaryTree,
    primitives: &[PrimitiveKey],
    ids: usize,
    source: &impl PrimitiveSource,
    term: Term,
    watch: &Watch<'_>,
) -> Result<(Frozen<Node>, Leaves, usize), Cancelled> {
    if primitives.is_empty() {
        return Ok((Frozen::default(), Room::new(Slots::new(ids), &[], term).leaves(), 0));
    }
    let top = Top::of(tree);
    let counts: Vec<[usize; 3]> =
        top.tasks.par_iter().map(|task| task.kinds(primitives, tree.mixed)).collect();
    let mut room = Room::new(Slots::new(ids), &counts, term);
    let layers = room.layers(&counts).into_iter();
    let hands = layers.map(|layer| Laying { primitives, source, layer }).collect();
    let (nodes, depth) = top.nodes(hands, term, watch)?;
    Ok((nodes, room.leaves(), depth))
}

/// Nodes and the depth of the wide tree whose leaves are laid out already.
pub(super) fn collapse_laid(
    tree: &BinaryTree,
    watch: &Watch<'_>,
) -> Result<(Frozen<Node>, usize), Cancelled> {
    if tree.top.is_empty() {
        return Ok((Frozen::default(), 0));
    }
    let top = Top::of(tree);
    let hands = top.tasks.iter().map(|_| Laid).collect();
    top.nodes(hands, Term::Open, watch)
}

/// What makes leaves of binary ones.
trait Hand {
    fn leaf(&mut self, leaf: &BinaryNode) -> (Child, Outlook);
}

/// Lays the primitives of a leaf out.
struct Laying<'a, S> {
    primitives: &'a [PrimitiveKey],
    source: &'a S,
    layer: Layer<'a>,
}

impl<S: PrimitiveSource> Hand for Laying<'_, S> {
    fn leaf(&mut self, leaf: &BinaryNode) -> (Child, Outlook) {
        let keys = range(leaf, self.primitives);
        let mut shapes = [Shape::none(); MAX_LEAF];
        for (shape, &key) in shapes.iter_mut().zip(keys) {
            *shape = Shape::of(key, self.source);
        }
        let laid = self.layer.leaf(&shapes[..keys.len()]);
        (laid.child, Outlook::of_leaf(laid.surface, &leaf.bounds))
    }
}

/// Finds leaves laid out.
struct Laid;

impl Hand for Laid {
    #[inline(always)]
    fn leaf(&mut self, leaf: &BinaryNode) -> (Child, Outlook) {
        leaf.as_laid()
    }
}

/// A subtree whose nodes and leaves are made apart from the others.
struct Task<'a> {
    root: Cursor<'a>,
    /// The node and the slot that will refer to it, and how deep that node is.
    node: usize,
    slot: usize,
    depth: usize,
}

impl Task<'_> {
    /// How many primitives there are of each kind.
    fn kinds(&self, primitives: &[PrimitiveKey], mixed: bool) -> [usize; 3] {
        let (mut counts, range) = ([0; 3], range(self.root.node(), primitives));
        if mixed {
            range.iter().for_each(|one| counts[one.kind() as usize] += 1);
        } else {
            counts[range[0].kind() as usize] = range.len();
        }
        counts
    }
}

/// What came of a task; its nodes are numbered from 0.
struct Part {
    root: Child,
    outlook: Outlook,
    nodes: Vec<Node>,
    depth: usize,
}

/// The primitives below a binary node.
fn range<'a>(node: &BinaryNode, primitives: &'a [PrimitiveKey]) -> &'a [PrimitiveKey] {
    &primitives[node.first as usize..][..node.count as usize]
}

/// The nodes near the root.
#[derive(Default)]
struct Top<'a> {
    nodes: Vec<TopNode>,
    tasks: Vec<Task<'a>>,
}

/// A node near the root, as long as its children are not known.
struct TopNode {
    bounds: Aabb,
    slots: [Slot; WIDTH],
    count: usize,
}

impl<'a> Top<'a> {
    fn of(tree: &'a BinaryTree) -> Self {
        let mut top = Self::default();
        top.add(tree.root(), 1);
        top
    }

    /// All nodes and the depth; there is one of `hands` for each task.
    fn nodes<H: Hand + Send>(
        self,
        hands: Vec<H>,
        term: Term,
        watch: &Watch<'_>,
    ) -> Result<(Frozen<Node>, usize), Cancelled> {
        let Self { nodes: mut top, tasks } = self;
        let part = |(task, hand): (&Task<'a>, H)| {
            let count = task.root.node().count as usize;
            let nodes = Vec::with_capacity(count / PER_NODE);
            let mut layout = Layout { hand, nodes, depth: 0 };
            // Cancelled, nobody will see what is missing.
            let (root, outlook) = match watch.is_cancelled() {
                true => (Child::EMPTY, Outlook::default()),
                false => layout.child(task.root, task.depth),
            };
            watch.add(count);
            Part { root, outlook, nodes: layout.nodes, depth: layout.depth }
        };
        let parts: Vec<Part> = (&tasks, hands).into_par_iter().map(part).collect();
        watch.check()?;

        let made: usize = parts.iter().map(|part| part.nodes.len()).sum();
        let mut nodes = Fresh::<Node>::new(top.len() + made, term);
        let (upper, mut rest) = nodes.split_at_mut(top.len());
        upper.fill(Node::empty());
        let (mut first, mut depth) = (top.len() as u32, 0);
        let mut places = Vec::with_capacity(parts.len());
        for (task, part) in tasks.iter().zip(&parts) {
            let slot = &mut top[task.node].slots[task.slot];
            (slot.child, slot.outlook) = (part.root.moved(first), part.outlook);
            let place = rest.split_off_mut(..part.nodes.len()).expect("room for all parts");
            places.push((first, place));
            first += part.nodes.len() as u32;
            depth = depth.max(task.depth).max(part.depth);
        }
        // A part's nodes know each other by their places in it.
        parts.into_par_iter().zip(places).for_each(|(part, (first, place))| {
            for (node, made) in place.iter_mut().zip(&part.nodes) {
                *node = made.moved(first);
            }
        });
        // From below, since what is expected of a node follows from its children.
        let mut outlooks = vec![Outlook::default(); top.len()];
        for (place, node) in top.iter_mut().enumerate().rev() {
            let slots = &mut node.slots[..node.count];
            for slot in &mut *slots {
                if let Child::Inner(child) = slot.child
                    && let Some(outlook) = outlooks.get(child as usize)
                {
                    slot.outlook = *outlook;
                }
            }
            outlooks[place] = outlook::arrange(&mut nodes[place], slots, &node.bounds);
        }
        Ok((nodes.freeze(), depth))
    }

    /// Adds the node that is made of `root`, `depth` from the root, and those below.
    fn add(&mut self, root: Cursor<'a>, depth: usize) {
        let (children, node) = (Children::of(root), self.nodes.len());
        let (bounds, slots, count) = (root.node().bounds, Default::default(), children.count);
        self.nodes.push(TopNode { bounds, slots, count });
        for (slot, child) in children.iter().enumerate() {
            let binary = child.node();
            self.nodes[node].slots[slot].bounds = binary.bounds;
            if binary.plan.is_leaf() || binary.count as usize <= TASK {
                self.tasks.push(Task { root: child, node, slot, depth });
            } else {
                self.nodes[node].slots[slot].child = Child::Inner(self.nodes.len() as u32);
                self.add(child, depth + 1);
            }
        }
    }
}

/// Makes the nodes of one task.
struct Layout<H> {
    hand: H,
    nodes: Vec<Node>,
    depth: usize,
}

impl<H: Hand> Layout<H> {
    /// What a node at `depth` holds for `root`.
    fn child(&mut self, root: Cursor<'_>, depth: usize) -> (Child, Outlook) {
        if root.node().plan.is_leaf() {
            return self.hand.leaf(root.node());
        }
        self.nodes.push(Node::empty());
        let node = self.nodes.len() - 1;
        (Child::Inner(node as u32), self.fill(node, root, depth + 1))
    }

    /// Fills node `node`, `depth` from the root, with what is under `root`.
    fn fill(&mut self, node: usize, root: Cursor<'_>, depth: usize) -> Outlook {
        self.depth = self.depth.max(depth);
        let children = Children::of(root);
        let mut slots = [Slot::default(); WIDTH];
        // The children's nodes lie side by side, so that siblings share pages.
        for (slot, child) in slots.iter_mut().zip(children.iter()) {
            slot.bounds = child.node().bounds;
            if child.node().plan.is_leaf() {
                (slot.child, slot.outlook) = self.hand.leaf(child.node());
            } else {
                slot.child = Child::Inner(self.nodes.len() as u32);
                self.nodes.push(Node::empty());
            }
        }
        for (slot, child) in slots.iter_mut().zip(children.iter()) {
            if let Child::Inner(place) = slot.child {
                slot.outlook = self.fill(place as usize, child, depth + 1);
            }
        }
        outlook::arrange(&mut self.nodes[node], &slots[..children.count], &root.node().bounds)
    }
}
