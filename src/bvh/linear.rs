//! The fastest build: primitives along Morton's curve are laid out as leaves right away, and the tree
//! over them follows the curve.
//!
//! Runs of the curve are cut where it crosses from one half of a box of cells to the other, and where
//! [`FEW`] primitives are left, into full leaves; no costs are compared. [`BLOCK`]s of it hang from a
//! `roof` that is made by costs. Boxes come from the corners as they are laid out: no box of a
//! primitive is stored for long, since memory that is touched for the first time costs a page fault.

use rayon::prelude::*;

use super::PrimitiveSource;
use super::binary::{BinaryNode, BinaryTree};
use super::build::area_scale;
use super::lay::{Layer, Room, Shape, Slots};
use super::leaves::Leaves;
use super::marks::{self, Mark};
use super::node::MAX_LEAF;
use super::order::{self, Sorted};
use super::outlook::Outlook;
use super::plan::{self, Costs};
use super::primitive::SignedBox;
use super::roof::{self, Block};
use super::watch::{Cancelled, Watch};
use crate::geometry::Aabb;
use crate::pages::Term;

/// A block has at most so many primitives. Larger ones make the tree sooner and worse.
const BLOCK: usize = 256;

/// So many primitives make as few leaves as can be. With more, or none, trees are made sooner or
/// later by 5%, and rays are slower or faster by 3%.
const FEW: usize = 32;

/// A thread makes the blocks of about so many primitives, then asks for more: the less, the sooner the last
/// is done.
const TASK: usize = 2048;

/// The tree over all primitives of `source`, its leaves, and the box around everything.
pub(super) fn build(
    ids: usize,
    source: &impl PrimitiveSource,
    watch: &Watch<'_>,
) -> Result<(BinaryTree, Leaves, Aabb), Cancelled> {
    // Slots are new memory, which one thread can touch while others mark primitives.
    let (Sorted { marks, range, kinds }, slots) =
        rayon::join(|| order::sort(source, ids), || Slots::new(ids));
    watch.start(2 * marks.len());
    watch.check()?;
    if marks.is_empty() {
        return Ok((
            BinaryTree::default(),
            Room::new(slots, &[], Term::Open).leaves(),
            Aabb::EMPTY,
        ));
    }
    let bounds = range.bounds.aabb();
    let area_scale = area_scale(&bounds);

    let tasks = tasks(&marks);
    let mixed = !kinds.is_power_of_two();
    let count = |runs: &Vec<(usize, usize)>| {
        let (first, count) = span(runs);
        if mixed {
            return marks::count_kinds(&marks[first..][..count]);
        }
        let mut counts = [0; 3];
        counts[kinds.trailing_zeros() as usize] = count;
        counts
    };
    let counts: Vec<[usize; 3]> = tasks.par_iter().map(count).collect();
    let mut room = Room::new(slots, &counts, Term::Open);
    let layers = room.layers(&counts).into_par_iter();
    let grown: Vec<(Vec<BinaryNode>, Vec<Block>)> = (&tasks, layers)
        .into_par_iter()
        .enumerate()
        .map(|(number, (runs, layer))| {
            let mut growth = Growth {
                marks: &marks,
                area_scale,
                source,
                layer,
                shapes: [Shape::none(); BLOCK],
                nodes: Vec::with_capacity(span(runs).1 / 2),
                blocks: Vec::new(),
            };
            if !watch.is_cancelled() {
                growth.blocks(runs, number as u32);
            }
            watch.add(span(runs).1);
            (growth.nodes, growth.blocks)
        })
        .collect();
    watch.check()?;
    let (treelets, blocks): (Vec<_>, Vec<_>) = grown.into_iter().unzip();
    let mut blocks = blocks.concat();
    drop(marks);
    let tree = BinaryTree { top: roof::build(&mut blocks, area_scale), treelets, mixed };
    Ok((tree, room.leaves(), bounds))
}

/// Runs of the curve, some to a task.
fn tasks(marks: &[Mark]) -> Vec<Vec<(usize, usize)>> {
    let mut runs = Vec::new();
    marks::cut_by_all(marks, 0, TASK, &mut runs);
    let (mut tasks, mut task, mut size) = (Vec::new(), Vec::new(), 0);
    for run in runs {
        task.push(run);
        size += run.1;
        if size >= TASK {
            tasks.push(std::mem::take(&mut task));
            size = 0;
        }
    }
    if !task.is_empty() {
        tasks.push(task);
    }
    tasks
}

/// Where a task starts, and how many primitives it has.
fn span(runs: &[(usize, usize)]) -> (usize, usize) {
    (runs[0].0, runs.iter().map(|run| run.1).sum())
}

/// The blocks that one thread makes one after the other.
struct Growth<'a, S> {
    marks: &'a [Mark],
    area_scale: f32,
    source: &'a S,
    layer: Layer<'a>,
    /// Those of the block: fetched all together, so that none is waited for.
    shapes: [Shape; BLOCK],
    nodes: Vec<BinaryNode>,
    blocks: Vec<Block>,
}

/// What a node's parent has to know of it.
struct Grown {
    bounds: SignedBox,
    costs: Costs,
    /// The nodes on the longest way down.
    height: u32,
}

impl<S: PrimitiveSource> Growth<'_, S> {
    fn blocks(&mut self, runs: &[(usize, usize)], task: u32) {
        let mut blocks = Vec::new();
        for &(first, count) in runs {
            marks::cut(&self.marks[first..][..count], first, BLOCK, &mut blocks);
        }
        let marks = self.marks;
        for (first, count) in blocks {
            let (marks, node) = (&marks[first..][..count], self.nodes.len() as u32);
            for (shape, mark) in self.shapes.iter_mut().zip(marks) {
                *shape = Shape::of(mark.key(), self.source);
            }
            let Grown { bounds, costs, height } = self.branch(marks, 0);
            let count = count as u32;
            self.blocks.push(Block { bounds, costs, height, count, task, node });
        }
    }

    /// Appends the tree over a range of the block that starts at `first`.
    fn branch(&mut self, marks: &[Mark], first: usize) -> Grown {
        let count = marks.len();
        if count <= MAX_LEAF {
            return self.leaf(first, count);
        }
        let middle = if count <= FEW { marks::middle_of_few(marks) } else { marks::middle(marks) };
        let place = self.nodes.len();
        self.nodes.push(BinaryNode::new(SignedBox::empty(), 0, count));
        let left = self.branch(&marks[..middle], first);
        let second = self.nodes.len();
        let right = self.branch(&marks[middle..], first + middle);
        self.join(place, second, count, &left, &right)
    }

    /// Appends a leaf, or if they are of several kinds one for each.
    #[inline(always)]
    fn leaf(&mut self, first: usize, count: usize) -> Grown {
        let shapes = &mut self.shapes[first..first + count];
        if shapes.iter().any(|shape| shape.kind() != shapes[0].kind()) {
            return self.leaves(first, count);
        }
        let laid = self.layer.leaf(shapes);
        let bounds = laid.bounds.aabb();
        let (costs, plan) = plan::leaf(laid.bounds.half_area(self.area_scale), count);
        let outlook = Outlook::of_leaf(laid.surface, &bounds);
        self.nodes.push(BinaryNode { plan, ..BinaryNode::laid(laid.bounds, laid.child, outlook) });
        Grown { bounds: laid.bounds, costs, height: 1 }
    }

    /// Appends a leaf for each kind that there is.
    #[inline(never)]
    fn leaves(&mut self, first: usize, count: usize) -> Grown {
        let shapes = &mut self.shapes[first..first + count];
        shapes.sort_by_key(|shape| shape.kind() as u8);
        let kind = shapes[0].kind();
        let middle = shapes.partition_point(|shape| shape.kind() == kind);
        let place = self.nodes.len();
        self.nodes.push(BinaryNode::new(SignedBox::empty(), 0, count));
        let left = self.leaf(first, middle);
        let second = self.nodes.len();
        let right = self.leaf(first + middle, count - middle);
        self.join(place, second, count, &left, &right)
    }

    #[inline(always)]
    fn join(
        &mut self,
        place: usize,
        second: usize,
        count: usize,
        left: &Grown,
        right: &Grown,
    ) -> Grown {
        let bounds = left.bounds.union(right.bounds);
        let (costs, plan) =
            plan::fork(bounds.half_area(self.area_scale), &left.costs, &right.costs);
        let node = BinaryNode::new(bounds, 0, count);
        self.nodes[place] = BinaryNode { second: (second - place) as u32, plan, ..node };
        Grown { bounds, costs, height: 1 + left.height.max(right.height) }
    }
}
