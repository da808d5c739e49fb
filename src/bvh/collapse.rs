//! From the binary tree and its plan to nodes of eight children, and the primitives in leaf order.
//!
//! The nodes near the root are made first. What hangs below them is cut into tasks of up to
//! [`TASK`] primitives, each with its own part of every leaf array: all threads lay them out at
//! once, and nodes and leaves come in the same order for every number of threads.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::binary::{BinaryTree, Cursor};
use super::leaves::{DROPPED, LeafArray, LeafPart, Leaves, packed_slot};
use super::node::{Child, MAX_LEAF, Node, WIDTH};
use super::watch::{Cancelled, Watch};
use super::{BuildPrimitive, PrimKind, PrimitiveSource};

/// A subtree of up to this many primitives is laid out by one thread.
const TASK: usize = 8192;

/// Nodes, leaves and the depth of the wide tree.
pub(super) fn collapse(
    tree: &BinaryTree,
    primitives: &[BuildPrimitive],
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
    let mut top = Top { nodes: vec![Node::empty()], tasks: Vec::new() };
    top.fill(0, tree.root(), 1);
    let Top { nodes: top, tasks } = top;

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
            let root = match watch.is_cancelled() {
                true => Child::EMPTY,
                false => layout.child(task.root, task.depth),
            };
            watch.add(task.root.node().count as usize);
            Part { root, nodes: layout.nodes, depth: layout.depth }
        })
        .collect();
    watch.check()?;
    leaves.slot_of = slot_of.into_iter().map(AtomicU32::into_inner).collect();

    let made: usize = parts.iter().map(|part| part.nodes.len()).sum();
    let mut nodes = Vec::with_capacity(top.len() + made);
    nodes.extend(top);
    let mut depth = 0;
    for (task, part) in tasks.iter().zip(parts) {
        // A part's nodes know each other by their places in it.
        let first = nodes.len() as u32;
        nodes[task.node].set(task.slot, &task.root.node().bounds, part.root.moved(first));
        nodes.extend(part.nodes.iter().map(|node| node.moved(first)));
        depth = depth.max(task.depth).max(part.depth);
    }
    Ok((nodes, leaves, depth))
}

/// The up to eight children of the node that is made of `root`, in order of falling area.
fn children_of<'a>(root: Cursor<'a>, children: &mut Vec<Cursor<'a>>) {
    fn open<'a>(root: Cursor<'a>, mut forest: usize, into: &mut Vec<Cursor<'a>>) {
        let plan = root.node().plan;
        while forest > 1 {
            let to_the_left = plan.left_of(forest);
            if to_the_left > 0 {
                let [left, right] = root.children();
                open(left, to_the_left, into);
                return open(right, forest - to_the_left, into);
            }
            forest -= 1;
        }
        into.push(root);
    }
    children.clear();
    if root.node().plan.is_leaf() {
        // Only a tree that is one leaf as a whole.
        children.push(root);
    } else {
        open(root, WIDTH, children);
    }
    let area = |child: &Cursor<'a>| child.node().bounds.half_area();
    children.sort_by(|a, b| area(b).total_cmp(&area(a)));
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
    fn kinds(&self, primitives: &[BuildPrimitive], mixed: bool) -> [usize; 3] {
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
    nodes: Vec<Node>,
    depth: usize,
}

/// The primitives below a binary node.
fn range<'a>(root: Cursor<'_>, primitives: &'a [BuildPrimitive]) -> &'a [BuildPrimitive] {
    let node = root.node();
    &primitives[node.first as usize..][..node.count as usize]
}

/// The nodes near the root.
struct Top<'a> {
    nodes: Vec<Node>,
    tasks: Vec<Task<'a>>,
}

impl<'a> Top<'a> {
    /// Fills node `node`, `depth` from the root, with what is under `root`.
    fn fill(&mut self, node: usize, root: Cursor<'a>, depth: usize) {
        let mut children = Vec::with_capacity(WIDTH);
        children_of(root, &mut children);
        for (slot, &child) in children.iter().enumerate() {
            let binary = child.node();
            if binary.plan.is_leaf() || binary.count as usize <= TASK {
                self.tasks.push(Task { root: child, node, slot, depth });
            } else {
                let next = self.nodes.len();
                self.nodes.push(Node::empty());
                self.nodes[node].set(slot, &binary.bounds, Child::Inner(next as u32));
                self.fill(next, child, depth + 1);
            }
        }
    }
}

/// Makes the nodes and leaves of one task.
struct Layout<'a, S> {
    primitives: &'a [BuildPrimitive],
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
    fn child(&mut self, root: Cursor<'_>, depth: usize) -> Child {
        if root.node().plan.is_leaf() {
            return self.leaf(root);
        }
        self.nodes.push(Node::empty());
        let node = self.nodes.len() - 1;
        self.fill(node, root, depth + 1);
        Child::Inner(node as u32)
    }

    /// Fills node `node`, `depth` from the root, with what is under `root`.
    fn fill(&mut self, node: usize, root: Cursor<'_>, depth: usize) {
        self.depth = self.depth.max(depth);
        let mut children = Vec::with_capacity(WIDTH);
        children_of(root, &mut children);
        // The children's nodes lie side by side, so that siblings share pages.
        let mut next = self.nodes.len();
        let first = next;
        for (slot, &child) in children.iter().enumerate() {
            let reference = if child.node().plan.is_leaf() {
                self.leaf(child)
            } else {
                self.nodes.push(Node::empty());
                next += 1;
                Child::Inner((next - 1) as u32)
            };
            self.nodes[node].set(slot, &child.node().bounds, reference);
        }
        let inner = children.into_iter().filter(|child| !child.node().plan.is_leaf());
        for (place, child) in (first..next).zip(inner) {
            self.fill(place, child, depth + 1);
        }
    }

    /// Lays out the primitives of a leaf, in the order of their ids.
    fn leaf(&mut self, root: Cursor<'_>) -> Child {
        let range = range(root, self.primitives);
        let (kind, count) = (range[0].kind(), range.len());
        let mut ids = [u32::MAX; MAX_LEAF];
        for (id, one) in ids.iter_mut().zip(range) {
            *id = one.id();
        }
        let ids = &mut ids[..count];
        ids.sort_unstable();
        let source = self.source;
        let first = match kind {
            PrimKind::Triangle => self.triangles.push_leaf(ids, |id| {
                let [a, b, c] = source.triangle(id);
                [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
            }),
            PrimKind::Quad => self.quads.push_leaf(ids, |id| {
                let [a, b, c, d] = source.quad(id);
                [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z, d.x, d.y, d.z]
            }),
            PrimKind::Sphere => self.spheres.push_leaf(ids, |id| {
                let (center, radius) = source.sphere(id);
                [center.x, center.y, center.z, radius]
            }),
        };
        for (place, &id) in (0..).zip(&*ids) {
            let packed = packed_slot(first, count as u32, place);
            self.slot_of[id as usize].store(packed, Ordering::Relaxed);
        }
        Child::Leaf { kind, first, count: count as u32 }
    }
}
