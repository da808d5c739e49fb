//! Moves subtrees to where the tree is cheaper (Meister and Bittner 2018, "Parallel reinsertion for
//! bounding volume hierarchy optimization").
//!
//! In each round all threads look for the best new place of every node, in the tree as it is. Then
//! one thread moves nodes, the largest gain first, unless a move before it has touched the same
//! place. Ties go by the nodes' numbers: the same tree for every number of threads.

use rayon::prelude::*;

use super::binary::{BinaryNode, BinaryTree, Cursor};
use super::build::{MAX_DEPTH, one_kind};
use super::node::MAX_LEAF;
use super::plan::{self, Costs};
use super::primitive::{BuildPrimitive, SignedBox};
use super::watch::{Cancelled, Watch};

/// How often all nodes look for a better place.
pub(super) const ROUNDS: usize = 3;

/// So many nodes are looked at in a row; then the build's watch is told.
const CHUNK: usize = 4096;

/// A search ends after so many nodes: those that take longer find next to nothing.
const PATIENCE: usize = 1024;

/// What a leaf has in place of children.
const LEAF: [u32; 2] = [u32::MAX; 2];

/// Improves the tree and sorts `primitives` into its new order.
pub(super) fn improve(
    tree: &mut BinaryTree,
    primitives: &mut [BuildPrimitive],
    area_scale: f32,
    watch: &Watch<'_>,
) -> Result<(), Cancelled> {
    let mut loose = Loose { area_scale, mixed: tree.mixed, ..Loose::default() };
    loose.take(tree.root(), u32::MAX);
    for round in 1..=ROUNDS {
        watch.check()?;
        if !loose.round(primitives.len(), watch) {
            watch.add((ROUNDS - round) * primitives.len());
            break;
        }
    }
    watch.check()?;
    let mut order = Vec::with_capacity(primitives.len());
    let mut nodes = Vec::with_capacity(loose.nodes.len());
    // A tree that got too deep stays as it was.
    if loose.give(0, 1, primitives, &mut order, &mut nodes).is_some() {
        primitives.copy_from_slice(&order);
        *tree = BinaryTree::treelet(nodes, tree.mixed);
    }
    Ok(())
}

/// A node that knows its neighbours; the root is the first.
#[derive(Clone, Copy)]
struct LooseNode {
    bounds: SignedBox,
    /// Half the surface of its box, scaled.
    area: f32,
    parent: u32,
    children: [u32; 2],
    /// Its primitives, if it is a leaf.
    first: u32,
    count: u32,
}

#[derive(Default)]
struct Loose {
    nodes: Vec<LooseNode>,
    area_scale: f32,
    mixed: bool,
}

/// Where a node had better be: beside `target`.
struct Move {
    gain: f32,
    node: u32,
    target: u32,
}

impl Loose {
    /// Appends what is below a node; its number.
    fn take(&mut self, from: Cursor<'_>, parent: u32) -> u32 {
        let BinaryNode { bounds, first, count, plan, .. } = *from.node();
        let place = self.nodes.len() as u32;
        let bounds = SignedBox::of_aabb(&bounds);
        let area = self.area(bounds);
        self.nodes.push(LooseNode { bounds, area, parent, children: LEAF, first, count });
        if !plan.is_leaf() {
            let children = from.children().map(|child| self.take(child, place));
            self.nodes[place as usize].children = children;
        }
        place
    }

    fn node(&self, node: u32) -> &LooseNode {
        &self.nodes[node as usize]
    }

    fn area(&self, bounds: SignedBox) -> f32 {
        bounds.half_area(self.area_scale)
    }

    /// The other child of a node's parent.
    fn sibling(&self, node: u32) -> u32 {
        let [left, right] = self.node(self.node(node).parent).children;
        if left == node { right } else { left }
    }

    /// Moves what can be moved; false if there is nothing. Tells `watch` of so many steps.
    fn round(&mut self, steps: usize, watch: &Watch<'_>) -> bool {
        let len = self.nodes.len();
        let chunk = |chunk: usize| {
            let (start, end) = (chunk * CHUNK, len.min((chunk + 1) * CHUNK));
            // Cancelled, the tree will be thrown away.
            let end = if watch.is_cancelled() { start } else { end };
            let mut stack = Vec::with_capacity(64);
            let search = |node: usize| self.search(node as u32, &mut stack);
            let moves: Vec<Move> = (start..end).filter_map(search).collect();
            let share = |end: usize| (steps as u64 * end as u64 / len as u64) as usize;
            watch.add(share(end) - share(start));
            moves
        };
        let chunks = (0..len.div_ceil(CHUNK)).into_par_iter();
        let mut moves: Vec<Move> = chunks.flat_map_iter(chunk).collect();
        moves.par_sort_unstable_by(|a, b| {
            b.gain.total_cmp(&a.gain).then_with(|| a.node.cmp(&b.node))
        });
        let mut touched = vec![false; self.nodes.len()];
        let mut any = false;
        for Move { node, target, .. } in moves {
            let parent = self.node(node).parent;
            let places = [
                node,
                parent,
                self.sibling(node),
                self.node(parent).parent,
                target,
                self.node(target).parent,
            ];
            if places.iter().any(|&place| touched[place as usize]) || self.is_below(target, node) {
                continue;
            }
            places.iter().for_each(|&place| touched[place as usize] = true);
            self.put(node, target);
            any = true;
        }
        self.refit(0);
        any
    }

    /// The best new place of a node, if there is a better one. The stack is empty before and after.
    fn search(&self, node: u32, stack: &mut Vec<(u32, f32)>) -> Option<Move> {
        let parent = self.node(node).parent;
        if node == 0 || parent == 0 {
            return None;
        }
        let bounds = self.node(node).bounds;
        let own = self.node(node).area;
        // What is saved without the node: its parent, and what the nodes above shrink by.
        let mut saved = self.node(parent).area;
        let mut best = Move { gain: saved * 1e-3, node, target: 0 };
        let mut patience = PATIENCE;
        let (mut from, mut without) = (node, SignedBox::empty());
        while from != 0 {
            let beside = self.sibling(from);
            stack.push((beside, saved));
            while let Some((place, saved)) = stack.pop() {
                if patience == 0 || saved - own <= best.gain {
                    continue;
                }
                patience -= 1;
                let at = self.node(place);
                let grown = self.area(at.bounds.union(bounds));
                if saved - grown > best.gain {
                    best = Move { gain: saved - grown, node, target: place };
                }
                let saved = saved - (grown - at.area);
                // Looked at here as well as later, since most would wait in vain.
                if saved - own > best.gain && at.children != LEAF {
                    stack.extend(at.children.map(|child| (child, saved)));
                }
            }
            from = self.node(from).parent;
            without = without.union(self.node(beside).bounds);
            if from != parent {
                saved += self.node(from).area - self.area(without);
            }
        }
        (best.target != 0).then_some(best)
    }

    /// True if `node` is `above` or below it.
    fn is_below(&self, mut node: u32, above: u32) -> bool {
        while node != above {
            if node == 0 {
                return false;
            }
            node = self.node(node).parent;
        }
        true
    }

    /// Takes a node and its parent out, and puts both above `target`.
    fn put(&mut self, node: u32, target: u32) {
        let (parent, sibling) = (self.node(node).parent, self.sibling(node));
        let above = self.node(parent).parent;
        self.replace(above, parent, sibling);
        let above = self.node(target).parent;
        self.replace(above, target, parent);
        self.nodes[parent as usize].children = [target, node];
        self.nodes[target as usize].parent = parent;
    }

    fn replace(&mut self, parent: u32, old: u32, new: u32) {
        for child in &mut self.nodes[parent as usize].children {
            if *child == old {
                *child = new;
            }
        }
        self.nodes[new as usize].parent = parent;
    }

    fn refit(&mut self, node: u32) -> SignedBox {
        let children = self.node(node).children;
        if children != LEAF {
            let [left, right] = children.map(|child| self.refit(child));
            let bounds = left.union(right);
            let area = self.area(bounds);
            let node = &mut self.nodes[node as usize];
            (node.bounds, node.area) = (bounds, area);
        }
        self.node(node).bounds
    }

    /// Appends what is below a node to `nodes` and its primitives to `order`; `None` if that is too
    /// deep.
    fn give(
        &self,
        node: u32,
        depth: usize,
        primitives: &[BuildPrimitive],
        order: &mut Vec<BuildPrimitive>,
        nodes: &mut Vec<BinaryNode>,
    ) -> Option<Costs> {
        if depth > MAX_DEPTH {
            return None;
        }
        let LooseNode { bounds, area, children, first, count, .. } = *self.node(node);
        let (place, start) = (nodes.len(), order.len());
        nodes.push(BinaryNode::new(bounds, start, count as usize));
        let (costs, plan) = if children == LEAF {
            order.extend_from_slice(&primitives[first as usize..][..count as usize]);
            plan::leaf(area, count as usize)
        } else {
            let left = self.give(children[0], depth + 1, primitives, order, nodes)?;
            nodes[place].second = (nodes.len() - place) as u32;
            let right = self.give(children[1], depth + 1, primitives, order, nodes)?;
            nodes[place].count = (order.len() - start) as u32;
            let below = &order[start..];
            if below.len() <= MAX_LEAF && (!self.mixed || one_kind(below, below[0])) {
                plan::fork_or_leaf(area, &left, &right, below.len())
            } else {
                plan::fork(area, &left, &right)
            }
        };
        nodes[place].plan = plan;
        Some(costs)
    }
}
