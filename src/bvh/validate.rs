//! What the traversals rely on, checked from outside: for tests, and for debug builds.

use thiserror::Error;

use super::build::MAX_DEPTH;
use super::leaves::{DROPPED, LeafArray, Primitive};
use super::node::{Child, MAX_LEAF, PrimKind, WIDTH};
use super::{Bvh, LEAF};
use crate::geometry::{Aabb, Spheres};

/// What is wrong with a tree.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum BvhError {
    /// A child, or a primitive of a leaf, sticks out of the box that its parent has for it.
    #[error("slot {slot} of node {node} does not contain what is below it")]
    Containment {
        /// The node.
        node: usize,
        /// The child slot.
        slot: usize,
    },
    /// A reference out of range, a leaf that is too large, or an occupied slot after an empty one.
    #[error("slot {slot} of node {node} is malformed")]
    Slot {
        /// The node.
        node: usize,
        /// The child slot.
        slot: usize,
    },
    /// A node or a leaf slot that the tree reaches twice or never.
    #[error("{what} {index} is reached {times} times instead of once")]
    Coverage {
        /// `node`, `triangle`, `quad` or `sphere`.
        what: &'static str,
        /// Which one.
        index: usize,
        /// How often.
        times: u32,
    },
    /// An id that does not lead back to the slot that holds it.
    #[error("primitive {id} is not where its slot says")]
    Lookup {
        /// The primitive.
        id: u32,
    },
    /// The tree is deeper than it says, or than the traversal stacks allow.
    #[error("the tree has depth {found}, says {stated}, and may have {MAX_DEPTH}")]
    Depth {
        /// The longest way from the root.
        found: usize,
        /// What it says.
        stated: usize,
    },
}

impl Bvh {
    /// Checks containment, coverage, lookups and depth.
    ///
    /// # Errors
    /// The first [`BvhError`] that is met.
    pub fn validate(&self) -> Result<(), BvhError> {
        let mut visits = Visits {
            nodes: vec![0; self.nodes.len()],
            slots: [
                vec![0; self.leaves.triangles.len()],
                vec![0; self.leaves.quads.len()],
                vec![0; self.leaves.spheres.len()],
            ],
            depth: 0,
        };
        if !self.nodes.is_empty() {
            self.visit(0, 1, &mut visits)?;
        }
        if visits.depth != self.depth || visits.depth > MAX_DEPTH {
            return Err(BvhError::Depth { found: visits.depth, stated: self.depth });
        }
        once("node", &visits.nodes)?;
        for (what, slots) in ["triangle", "quad", "sphere"].into_iter().zip(&visits.slots) {
            once(what, slots)?;
        }
        let leaves = &self.leaves;
        check_ids(&leaves.triangles, &leaves.slot_of)?;
        check_ids(&leaves.quads, &leaves.slot_of)?;
        check_ids(&leaves.spheres, &leaves.slot_of)
    }

    /// The box around what is below `node`.
    fn visit(&self, node: usize, depth: usize, visits: &mut Visits) -> Result<Aabb, BvhError> {
        visits.depth = visits.depth.max(depth);
        visits.nodes[node] += 1;
        if visits.nodes[node] > 1 || depth > MAX_DEPTH {
            return Ok(Aabb::EMPTY);
        }
        let mut all = Aabb::EMPTY;
        let mut ended = false;
        for slot in 0..WIDTH {
            let malformed = BvhError::Slot { node, slot };
            let stated = self.nodes[node].child_bounds(slot);
            let below = match self.nodes[node].child(slot) {
                Child::EMPTY => {
                    ended = true;
                    if !stated.is_empty() || self.nodes[node].meta[slot] != LEAF {
                        return Err(malformed);
                    }
                    continue;
                }
                Child::Inner(child) if (child as usize) < self.nodes.len() => {
                    self.visit(child as usize, depth + 1, visits)?
                }
                Child::Leaf { kind, first, count }
                    if (1..=MAX_LEAF as u32).contains(&count)
                        && (first + count) as usize <= visits.slots[kind as usize].len() =>
                {
                    self.visit_leaf(kind, first, count, visits)
                }
                _ => return Err(malformed),
            };
            if ended {
                return Err(malformed);
            }
            if !stated.contains(&below) {
                return Err(BvhError::Containment { node, slot });
            }
            all = all.union(stated);
        }
        Ok(all)
    }

    fn visit_leaf(&self, kind: PrimKind, first: u32, count: u32, visits: &mut Visits) -> Aabb {
        let mut all = Aabb::EMPTY;
        for place in 0..count {
            let slot = (first + place) as usize;
            visits.slots[kind as usize][slot] += 1;
            let id = match kind {
                PrimKind::Triangle => self.leaves.triangles.ids[slot],
                PrimKind::Quad => self.leaves.quads.ids[slot],
                PrimKind::Sphere => self.leaves.spheres.ids[slot],
            };
            all = all.union(match self.leaves.primitive(kind, id) {
                Some(Primitive::Triangle(points)) => Aabb::of_points(&points),
                Some(Primitive::Quad(points)) => Aabb::of_points(&points),
                Some(Primitive::Sphere(center, radius)) => Spheres::one(center, radius).bounds(0),
                None => Aabb::EMPTY,
            });
        }
        all
    }
}

struct Visits {
    nodes: Vec<u32>,
    slots: [Vec<u32>; 3],
    depth: usize,
}

fn once(what: &'static str, times: &[u32]) -> Result<(), BvhError> {
    match times.iter().position(|&times| times != 1) {
        Some(index) => Err(BvhError::Coverage { what, index, times: times[index] }),
        None => Ok(()),
    }
}

fn check_ids<const FIELDS: usize>(
    array: &LeafArray<FIELDS>,
    slot_of: &[u32],
) -> Result<(), BvhError> {
    for (slot, &id) in array.ids.iter().enumerate() {
        match slot_of.get(id as usize) {
            Some(&packed) if packed != DROPPED && (packed >> 6) as usize == slot => {}
            _ => return Err(BvhError::Lookup { id }),
        }
    }
    Ok(())
}
