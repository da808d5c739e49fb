//! One descent through the tree with up to sixteen groups: of points, or of shadow rays.
//!
//! A node's boxes are tested against the shaft around all groups in eight lanes, each that is left
//! against the groups' shafts in sixteen, and then by the groups that are left themselves. In a leaf
//! the boxes of its primitives go the same way.

use super::shafts::{Shafts, one_box};
use crate::bvh::{Bvh, Child, Node, PrimKind};
use crate::kernels::Bounds;
use crate::simd::{F32x8, F32x16, Lanes};
use crate::traverse::ones;
use crate::traverse::tile::Leaf;
use crate::traverse::visits::count;

/// Groups that go down the tree together.
pub(super) trait Party {
    /// The groups that are not settled.
    fn live(&self) -> u32;
    /// True if a member of a group may meet the box in slot `slot` of `node`, which in the axes of
    /// the shafts is `turned`.
    fn meets_box(&self, group: usize, turned: &Bounds<F32x16>, node: &Node, slot: usize) -> bool;
    /// Tests a triangle, `v0.x .. v2.z`, with its box. True if it settled somebody.
    fn triangle(&mut self, group: usize, turned: &Bounds<F32x16>, fields: &[f32; 9]) -> bool;
    /// Tests a quad, its corners in order around it, likewise.
    fn quad(&mut self, group: usize, turned: &Bounds<F32x16>, fields: &[f32; 12]) -> bool;
    /// Tests a sphere, centre and radius, likewise.
    fn sphere(&mut self, group: usize, turned: &Bounds<F32x16>, fields: &[f32; 4]) -> bool;
    /// Hears of a leaf (as a node describes it) that settled somebody.
    fn leaf_met(&mut self, _leaf: LeafRef) {}
}

/// A leaf as a node describes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct LeafRef {
    pub(super) index: u32,
    pub(super) meta: u32,
}

/// A node or leaf that waits, and the groups that are to enter it.
#[derive(Clone, Copy, Default)]
pub(super) struct Waiting {
    child: LeafRef,
    groups: u32,
}

/// Takes all live groups from the root to the leaves.
pub(super) fn descend(bvh: &Bvh, shafts: &Shafts, party: &mut impl Party, stack: &mut [Waiting]) {
    count(|visits| visits.beams += 1);
    let mut waiting = 1;
    stack[0] = Waiting { groups: party.live(), ..Waiting::default() };
    while waiting > 0 {
        waiting -= 1;
        let next = stack[waiting];
        let groups = next.groups & party.live();
        if groups == 0 {
            continue;
        }
        match Child::unpack(next.child.index, next.child.meta) {
            Child::Inner(node) => {
                let node = &bvh.nodes[node as usize];
                waiting = enter_node(shafts, party, node, groups, stack, waiting);
            }
            Child::Leaf { .. } => enter_leaf(bvh, shafts, party, groups, next.child),
        }
    }
}

/// Puts the children that some group may meet on the stack, the largest on top.
#[inline(always)]
fn enter_node(
    shafts: &Shafts,
    party: &impl Party,
    node: &Node,
    groups: u32,
    stack: &mut [Waiting],
    mut waiting: usize,
) -> usize {
    count(|visits| visits.nodes += 1);
    let base = waiting;
    let (boxes, slots) =
        shafts.boxes(std::array::from_fn(|place| F32x8::load(&node.bounds[place])));
    for slot in ones(slots) {
        let turned = one_box(&boxes, slot);
        let mut met = shafts.groups(&turned) & groups;
        for index in ones(met) {
            count(|visits| visits.box_groups += 1);
            if !party.meets_box(index, &turned, node, slot) {
                met &= !(1 << index);
            }
        }
        if met != 0 {
            let child = LeafRef { index: node.index[slot], meta: node.meta[slot] };
            stack[waiting] = Waiting { child, groups: met };
            waiting += 1;
        }
    }
    stack[base..waiting].reverse();
    waiting
}

/// Tests the primitives of a leaf with the groups in `groups`.
pub(super) fn enter_leaf<P: Party>(
    bvh: &Bvh,
    shafts: &Shafts,
    party: &mut P,
    groups: u32,
    at: LeafRef,
) {
    let Child::Leaf { kind, first, count } = Child::unpack(at.index, at.meta) else { return };
    let leaves = &bvh.leaves;
    let met = match kind {
        PrimKind::Triangle => {
            let leaf = Leaf::new(&leaves.triangles, first, count);
            meet_all(shafts, party, groups, &leaf, P::triangle)
        }
        PrimKind::Quad => {
            let leaf = Leaf::new(&leaves.quads, first, count);
            meet_all(shafts, party, groups, &leaf, P::quad)
        }
        PrimKind::Sphere => {
            let leaf = Leaf::new(&leaves.spheres, first, count);
            meet_all(shafts, party, groups, &leaf, P::sphere)
        }
    };
    if met {
        party.leaf_met(at);
    }
}

#[inline(always)]
fn meet_all<P: Party, const FIELDS: usize>(
    shafts: &Shafts,
    party: &mut P,
    groups: u32,
    leaf: &Leaf<'_, FIELDS>,
    meet: impl Fn(&mut P, usize, &Bounds<F32x16>, &[f32; FIELDS]) -> bool,
) -> bool {
    count(|visits| visits.leaves += 1);
    let (boxes, places) = shafts.boxes(leaf.bounds());
    let lanes = leaf.lanes.map(F32x8::to_array);
    let mut any = false;
    for place in ones(places & ((1 << leaf.count) - 1)) {
        let turned = one_box(&boxes, place);
        let met = shafts.groups(&turned) & groups & party.live();
        if met == 0 {
            continue;
        }
        count(|visits| visits.primitives += 1);
        let fields: [f32; FIELDS] = std::array::from_fn(|field| lanes[field][place & 7]);
        for index in ones(met) {
            count(|visits| visits.primitive_groups += 1);
            if meet(party, index, &turned, &fields) {
                count(|visits| visits.met_groups += 1);
                any = true;
            }
        }
    }
    any
}
