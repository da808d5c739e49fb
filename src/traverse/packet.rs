//! A packet: one group of rays through the tree, box by box.
//!
//! Each child's box is tested with all rays; the child whose first ray enters it first comes next.
//! This is what eight rays get that come alone; more rays that run alike go by [`super::tile`].

use super::corners::{self, Corners};
use super::group::Group;
use super::planes::{Octant, Planes};
use super::stack_size;
use crate::bvh::{Bvh, Child, PrimKind, WIDTH};
use crate::simd::{F32x8, LaneMask, Lanes};

/// A child that waits, and where the first ray enters it.
#[derive(Clone, Copy)]
struct Waiting {
    near: f32,
    index: u32,
    meta: u32,
}

/// Traces the rays of `group`: their closest hits, or any hits if `ANY`.
pub(super) fn trace<const ANY: bool>(bvh: &Bvh, group: &mut Group<F32x8>) {
    if bvh.nodes.is_empty() {
        return;
    }
    let main = corners::most_common(std::iter::once(group.axes));
    let octant = Octant::most(std::iter::once(group.octant));
    let mut stack = Vec::with_capacity(stack_size(bvh));
    stack.push(Waiting { near: f32::NEG_INFINITY, index: 0, meta: 0 });
    while let Some(next) = stack.pop() {
        if !F32x8::splat(next.near).le(group.ray.t_max).any() {
            continue;
        }
        match Child::unpack(next.index, next.meta) {
            Child::Inner(node) => {
                let node = &bvh.nodes[node as usize];
                let base = stack.len();
                for slot in 0..WIDTH {
                    let (near, far) = group.interval(&Planes::new(node, slot, octant));
                    let meets = near.le(far);
                    if !meets.any() {
                        continue;
                    }
                    let near = Lanes::select(meets, near, F32x8::splat(f32::INFINITY)).reduce_min();
                    let child = Waiting { near, index: node.index[slot], meta: node.meta[slot] };
                    let nearer = |waiting: &Waiting| waiting.near < near;
                    let place = match stack[base..].iter().position(nearer) {
                        Some(place) if !ANY => base + place,
                        _ => stack.len(),
                    };
                    stack.insert(place, child);
                }
                if ANY {
                    stack[base..].reverse();
                }
            }
            Child::Leaf { kind, first, count } => {
                for place in 0..count {
                    let slot = (first + place) as usize;
                    match kind {
                        PrimKind::Triangle => {
                            let leaf = &bvh.leaves.triangles;
                            let fields = leaf.get(first, count, place);
                            let corners = Corners::new(main, |field| fields[field]);
                            group.meet_triangle::<ANY, true>(0, &corners, false, leaf.ids[slot]);
                        }
                        PrimKind::Quad => {
                            let leaf = &bvh.leaves.quads;
                            let fields = leaf.get(first, count, place);
                            let corners = Corners::new(main, |field| fields[field]);
                            group.meet_quad::<ANY>(0, &corners, false, leaf.ids[slot]);
                        }
                        PrimKind::Sphere => {
                            let leaf = &bvh.leaves.spheres;
                            let sphere = leaf.get(first, count, place);
                            group.meet_sphere::<ANY>(0, &sphere, leaf.ids[slot]);
                        }
                    }
                }
                if ANY && group.is_dead() {
                    return;
                }
            }
        }
    }
}
