//! One descent through the tree with up to sixteen groups: of points, or of shadow rays.
//!
//! A node's boxes are tested against the shaft around all groups in eight lanes, each that is left
//! against the groups' shafts in sixteen, and then by the groups that are left themselves. In a leaf
//! the boxes of its primitives go the same way.

use super::leaf::Leaf;
use super::shafts::{Shafts, Turned};
use crate::bvh::{Bvh, Child, LEAF, Node, PrimKind};
use crate::simd::{F32x8, Lanes, each};
use crate::traverse::ones;
use crate::traverse::visits::count;

/// Groups that go down the tree together.
pub(super) trait Party {
    /// The groups that are not settled.
    fn live(&self) -> u32;
    /// Tests a leaf, in slot `slot` of `node`, with those groups that are better tested in another
    /// way than primitive by primitive. Returns the groups that are left, and if somebody was settled.
    fn apart<const FIELDS: usize>(
        &mut self,
        groups: u32,
        _node: &Node,
        _slot: usize,
        _leaf: &Leaf<'_, FIELDS>,
    ) -> (u32, bool) {
        (groups, false)
    }
    /// True if a member of a group may meet the box in slot `slot` of `node`, which is one of `boxes`,
    /// too.
    fn meets_box(&self, group: usize, boxes: &Turned, node: &Node, slot: usize) -> bool;
    /// Tests a triangle, `v0.x .. v2.z`, whose box is box `place`. True if it settled somebody.
    fn triangle(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 9]) -> bool;
    /// Tests a quad, its corners in order around it, likewise.
    fn quad(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 12]) -> bool;
    /// Tests a sphere, centre and radius, likewise.
    fn sphere(&mut self, group: usize, at: (&Turned, usize), fields: &[f32; 4]) -> bool;
    /// Hears of a leaf that settled somebody.
    fn leaf_met(&mut self, _leaf: Place) {}
}

/// A child: slot `slot` of node `node`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    node: u32,
    slot: u32,
}

impl Place {
    #[inline(always)]
    pub(super) fn node(self, bvh: &Bvh) -> &Node {
        &bvh.nodes[self.node as usize]
    }

    #[inline(always)]
    pub(super) fn slot(self) -> usize {
        self.slot as usize & 7
    }
}

/// A node or leaf that waits, and the groups that are to enter it.
#[derive(Clone, Copy, Default)]
pub(super) struct Waiting {
    child: Place,
    groups: u32,
}

/// Takes all live groups from the root to the leaves.
pub(super) fn descend(bvh: &Bvh, shafts: &Shafts, party: &mut impl Party, stack: &mut [Waiting]) {
    count(|visits| visits.beams += 1);
    let mut waiting = enter_node(shafts, party, bvh, 0, party.live(), stack, 0);
    while waiting > 0 {
        waiting -= 1;
        let Waiting { child, groups } = stack[waiting];
        let groups = groups & party.live();
        if groups == 0 {
            continue;
        }
        let node = child.node(bvh);
        if node.meta[child.slot()] & LEAF == 0 {
            let index = node.index[child.slot()];
            waiting = enter_node(shafts, party, bvh, index, groups, stack, waiting);
        } else {
            enter_leaf(bvh, shafts, party, groups, child);
        }
    }
}

/// Puts the children that some group may meet on the stack: on top those where its members start, then
/// the others in the node's order.
#[inline(always)]
fn enter_node(
    shafts: &Shafts,
    party: &impl Party,
    bvh: &Bvh,
    index: u32,
    groups: u32,
    stack: &mut [Waiting],
    mut waiting: usize,
) -> usize {
    count(|visits| visits.nodes += 1);
    let (base, node) = (waiting, &bvh.nodes[index as usize]);
    let (boxes, [slots, near]) = shafts.boxes(each(|place| F32x8::load(&node.bounds[place])));
    // The surface at which rays start is before all of them if it faces away from the light.
    for slot in ones(slots & near).chain(ones(slots & !near)) {
        let mut met = shafts.groups(&boxes, slot) & groups;
        for group in ones(met) {
            count(|visits| visits.box_groups += 1);
            if !party.meets_box(group, &boxes, node, slot) {
                met &= !(1 << group);
            }
        }
        if met != 0 {
            let child = Place { node: index, slot: slot as u32 };
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
    at: Place,
) {
    let (node, slot) = (at.node(bvh), at.slot());
    let Child::Leaf { kind, first, count } = node.child(slot) else { return };
    let leaves = &bvh.leaves;
    let met = match kind {
        PrimKind::Triangle => {
            let leaf = Leaf::new(&leaves.triangles, first, count);
            meet_all(shafts, party, groups, (node, slot), &leaf, P::triangle)
        }
        PrimKind::Quad => {
            let leaf = Leaf::new(&leaves.quads, first, count);
            meet_all(shafts, party, groups, (node, slot), &leaf, P::quad)
        }
        PrimKind::Sphere => {
            let leaf = Leaf::new(&leaves.spheres, first, count);
            meet_all(shafts, party, groups, (node, slot), &leaf, P::sphere)
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
    (node, slot): (&Node, usize),
    leaf: &Leaf<'_, FIELDS>,
    meet: impl Fn(&mut P, usize, (&Turned, usize), &[f32; FIELDS]) -> bool,
) -> bool {
    count(|visits| visits.leaves += 1);
    let (groups, mut any) = party.apart(groups, node, slot, leaf);
    if groups == 0 {
        return any;
    }
    let (boxes, [places, _]) = shafts.boxes(leaf.bounds());
    for place in ones(places & ((1 << leaf.count) - 1)) {
        let met = shafts.groups(&boxes, place) & groups & party.live();
        if met == 0 {
            continue;
        }
        count(|visits| visits.primitives += 1);
        let fields = leaf.primitive(place);
        for index in ones(met) {
            count(|visits| visits.primitive_groups += 1);
            if meet(party, index, (&boxes, place), &fields) {
                count(|visits| visits.met_groups += 1);
                any = true;
            }
        }
    }
    any
}
