//! From the binary tree and its plan to nodes of eight children, and the primitives in leaf order.
//!
//! The nodes near the root are made first. What hangs below them is cut into tasks of up to
//! [`TASK`] primitives, each with its own part of every leaf array: all threads lay them out at
//! once, and nodes and leaves come in the same order for every number of threads.

use std::cell::Cell;
use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::binary::{BinaryTree, Cursor};
use super::leaves::{DROPPED, LeafArray, LeafPart, Leaves, packed_slot};
use super::node::{Child, MAX_LEAF, Node, WIDTH};
use super::outlook::{self, Outlook, Slot};
use super::primitive::PrimitiveKey;
use super::watch::{Cancelled, Watch};
use super::{PrimKind, PrimitiveSource};
use crate::geometry::Aabb;

/// A subtree of up to this many primitives is laid out by one thread.
const TASK: usize = 8192;

/// Nodes, leaves and the depth of the wide tree.
pub(super) fn collapse(
    tree: &BinaryTree,
    primitives: &[PrimitiveKey],
    ids: usize,
    source: &impl PrimitiveSource,
    watch: &Watch<'_>,
) -> Result<(Vec<Node>, Leaves, usize), Cancelled> {
    if primitives.is_empty() {
        let leaves = Leaves {
            triangles: LeafArray::with_len(0),
            quads: LeafArray::with_len(0),
            spheres: LeafArray::with_len(0),
            slot_of: vec![DROPPED; ids],
        };
        return Ok((Vec::new(), leaves, 0));
    }
    let mut top = Top::default();
    top.add(tree.root(), 1);
    let Top { nodes: mut top, tasks } = top;

    let counts: Vec<[usize; 3]> =
        tasks.par_iter().map(|task| task.kinds(primitives, tree.mixed)).collect();
    let of_kind = |kind: PrimKind| counts.iter().map(move |counts| counts[kind as usize]);
    let slot_of: Vec<AtomicU32> =
        (0..ids).into_par_iter().map(|_| AtomicU32::new(DROPPED)).collect();
    let mut leaves = Leaves {
        triangles: LeafArray::with_len(of_kind(PrimKind::Triangle).sum()),
        quads: LeafArray::with_len(of_kind(PrimKind::Quad).sum()),
        spheres: LeafArray::with_len(of_kind(PrimKind::Sphere).sum()),
        slot_of: Vec::new(),
    };
    let triangles = leaves.triangles.parts(of_kind(PrimKind::Triangle)).into_par_iter();
    let quads = leaves.quads.parts(of_kind(PrimKind::Quad)).into_par_iter();
    let spheres = leaves.spheres.parts(of_kind(PrimKind::Sphere)).into_par_iter();
    let parts: Vec<Part> = (tasks.par_iter(), triangles, quads, spheres)
        .into_par_iter()
        .map(|(task, triangles, quads, spheres)| {
            let nodes = Vec::new();
            let (slot_of, depth) = (slot_of.as_slice(), 0);
            let mut layout =
                Layout { primitives, source, slot_of, triangles, quads, spheres, nodes, depth };
            // Cancelled, nobody will see what is missing.
            let (root, outlook) = match watch.is_cancelled() {
                true => (Child::EMPTY, Outlook::default()),
                false => layout.child(task.root, task.depth),
            };
            watch.add(task.root.node().count as usize);
            Part { root, outlook, nodes: layout.nodes, depth: layout.depth }
        })
        .collect();
    watch.check()?;
    leaves.slot_of = slot_of.into_iter().map(AtomicU32::into_inner).collect();

    let made: usize = parts.iter().map(|part| part.nodes.len()).sum();
    let mut nodes = Vec::with_capacity(top.len() + made);
    nodes.resize(top.len(), Node::empty());
    let mut depth = 0;
    for (task, part) in tasks.iter().zip(parts) {
        // A part's nodes know each other by their places in it.
        let first = nodes.len() as u32;
        let slot = &mut top[task.node].slots[task.slot];
        (slot.child, slot.outlook) = (part.root.moved(first), part.outlook);
        nodes.extend(part.nodes.iter().map(|node| node.moved(first)));
        depth = depth.max(task.depth).max(part.depth);
    }
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
    Ok((nodes, leaves, depth))
}

/// The up to eight children of the node that is made of `root`.
struct Children<'a> {
    all: [Cursor<'a>; WIDTH],
    count: usize,
}

impl<'a> Children<'a> {
    fn of(root: Cursor<'a>) -> Self {
        let mut children = Self { all: [root; WIDTH], count: 0 };
        if root.node().plan.is_leaf() {
            // Only a tree that is one leaf as a whole.
            children.count = 1;
        } else {
            children.open(root, WIDTH);
        }
        children
    }

    fn open(&mut self, root: Cursor<'a>, mut forest: usize) {
        let plan = root.node().plan;
        while forest > 1 {
            let to_the_left = plan.left_of(forest);
            if to_the_left > 0 {
                let [left, right] = root.children();
                self.open(left, to_the_left);
                return self.open(right, forest - to_the_left);
            }
            forest -= 1;
        }
        self.all[self.count] = root;
        self.count += 1;
    }

    fn iter(&self) -> impl Iterator<Item = Cursor<'a>> {
        self.all[..self.count].iter().copied()
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
        let (mut counts, range) = ([0; 3], range(self.root, primitives));
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
fn range<'a>(root: Cursor<'_>, primitives: &'a [PrimitiveKey]) -> &'a [PrimitiveKey] {
    let node = root.node();
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

/// Makes the nodes and leaves of one task.
struct Layout<'a, S> {
    primitives: &'a [PrimitiveKey],
    source: &'a S,
    slot_of: &'a [AtomicU32],
    triangles: LeafPart<'a, 9>,
    quads: LeafPart<'a, 12>,
    spheres: LeafPart<'a, 4>,
    nodes: Vec<Node>,
    depth: usize,
}

impl<S: PrimitiveSource> Layout<'_, S> {
    /// What a node at `depth` holds for `root`.
    fn child(&mut self, root: Cursor<'_>, depth: usize) -> (Child, Outlook) {
        if root.node().plan.is_leaf() {
            return self.leaf(root);
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
                (slot.child, slot.outlook) = self.leaf(child);
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
        outlook::arrange(&mut self.nodes[node], &mut slots[..children.count], &root.node().bounds)
    }

    /// Lays out the primitives of a leaf, in the order of their ids.
    fn leaf(&mut self, root: Cursor<'_>) -> (Child, Outlook) {
        let range = range(root, self.primitives);
        let (kind, count) = (range[0].kind(), range.len());
        let mut ids = [u32::MAX; MAX_LEAF];
        for (id, one) in ids.iter_mut().zip(range) {
            *id = one.id();
        }
        let ids = &mut ids[..count];
        ids.sort_unstable();
        let (source, surface) = (self.source, Cell::new(0.0));
        let first = match kind {
            PrimKind::Triangle => self.triangles.push_leaf(ids, |id| {
                let [a, b, c] = source.triangle(id);
                surface.update(|all| all + Aabb::of_points(&[a, b, c]).half_area());
                [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
            }),
            PrimKind::Quad => self.quads.push_leaf(ids, |id| {
                let [a, b, c, d] = source.quad(id);
                surface.update(|all| all + Aabb::of_points(&[a, b, c, d]).half_area());
                [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y, d.z]
            }),
            PrimKind::Sphere => self.spheres.push_leaf(ids, |id| {
                let (center, radius) = source.sphere(id);
                surface.update(|all| all + 12.0 * radius * radius);
                [center.x, center.y, center.z, radius]
            }),
        };
        for (place, &id) in (0..).zip(&*ids) {
            let packed = packed_slot(first, count as u32, place);
            self.slot_of[id as usize].store(packed, Ordering::Relaxed);
        }
        let child = Child::Leaf { kind, first, count: count as u32 };
        (child, Outlook::of_leaf(surface.get(), &root.node().bounds))
    }
}
