//! Which binary nodes become nodes of eight: the cheapest choice by the surface area heuristic,
//! found by dynamic programming (Ylitie, Karras, Laine 2017, "Efficient incoherent ray traversal on
//! GPUs through compressed wide BVHs").
//!
//! For each binary node: the cost of what is below it as a forest of at most 1, 2, .. 7 subtrees.
//! A forest of one is a leaf, or a node of eight whose children are a forest of eight; a forest of
//! `j` is one of `k` to the left and `j - k` to the right.

use super::node::WIDTH;

/// The cost of a leaf that is entered, in nodes entered. Swept from 0.5 to 3 with
/// [`PRIMITIVE_COST`] from 0.02 to 0.3 over bunny and atrium, primary, shadow and diffuse rays: flat
/// from 1.5 up, 10% slower and larger at 0.5. All lanes of a leaf are tested at once.
const LEAF_COST: f32 = 2.0;
/// What each of its primitives adds to that.
const PRIMITIVE_COST: f32 = 0.05;

/// More than any tree costs: boxes are scaled to the scene's extent before areas are taken.
const NEVER: f32 = 1e30;

/// The bits of a cost that name the choice that led to it.
const CHOICE: u32 = 7;

/// The costs of a binary node as a forest of at most `1 + i` subtrees. The last is not used.
#[derive(Clone, Copy, Debug)]
pub(super) struct Costs([f32; WIDTH]);

/// The choices for a binary node: for a forest of `j` from 2 to 8 how many go to the left, 0 if a
/// forest of `j - 1` is no dearer; or that it is a leaf.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Plan(u32);

impl Plan {
    const LEAF: u32 = 1 << 31;

    /// True if it is a leaf.
    pub(super) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// How many subtrees a forest of at most `most` has left and right of the binary split; `None` if one
    /// is no dearer than more.
    #[inline(always)]
    pub(super) fn parts(self, most: usize) -> Option<[usize; 2]> {
        // The choices of smaller forests are in lower bits: the highest that is set is the largest forest
        // that pays. A loop down to it would end where nobody can guess.
        let choices = self.0 & ((1 << (3 * (most - 1))) - 1);
        let forest = choices.checked_ilog2()? as usize / 3 + 2;
        let left = (choices >> (3 * (forest - 2))) as usize;
        Some([left, forest - left])
    }
}

/// The costs of a leaf. `area` is that of its box.
pub(super) fn leaf(area: f32, count: usize) -> (Costs, Plan) {
    (Costs([area * (LEAF_COST + PRIMITIVE_COST * count as f32); WIDTH]), Plan(Plan::LEAF))
}

/// The costs of a binary node with these children that can be a leaf of so many primitives, which it
/// becomes if that is no dearer than a node.
///
/// It is not weighed against its children as two leaves of the node above: that makes leaves of 4.6
/// primitives in place of 5.9, camera rays and hard shadows 0.97, others the same.
pub(super) fn fork_or_leaf(area: f32, left: &Costs, right: &Costs, count: usize) -> (Costs, Plan) {
    let (as_fork, as_leaf) = (fork(area, left, right), leaf(area, count));
    if as_leaf.0.0[0] <= as_fork.0.0[0] { as_leaf } else { as_fork }
}

/// The costs of a binary node with these children.
#[inline(always)]
pub(super) fn fork(area: f32, left: &Costs, right: &Costs) -> (Costs, Plan) {
    // Costs are not negative, so their bits compare as they do; the choice rides in the lowest.
    let mut forests = [u32::MAX; WIDTH];
    let mut shifted = right.0;
    for a in 0..WIDTH - 1 {
        for (cheapest, right) in forests.iter_mut().zip(shifted) {
            let cost = left.0[a] + right;
            *cheapest = (*cheapest).min(cost.to_bits() & !CHOICE | (a + 1) as u32);
        }
        let [b, c, d, e, f, g, h, _] = shifted;
        shifted = [NEVER, b, c, d, e, f, g, h];
    }
    let mut plan = forests[WIDTH - 2] & CHOICE;
    let node = area + f32::from_bits(forests[WIDTH - 2]);
    let mut costs = [node; WIDTH];
    for forest in (2..WIDTH).rev() {
        plan = plan << 3 | forests[forest - 2] & CHOICE;
    }
    for forest in 2..WIDTH {
        let (fewer, split) = (costs[forest - 2], f32::from_bits(forests[forest - 2]));
        if fewer <= split {
            plan &= !(CHOICE << (3 * (forest - 2)));
        }
        costs[forest - 1] = if fewer <= split { fewer } else { split };
    }
    (Costs(costs), Plan(plan))
}
