//! One ray through the tree: eight boxes of a node side by side, then up to eight primitives of a
//! leaf side by side.
//!
//! A node's children are not sorted. Their distances wait as eight keys, and whenever the ray comes
//! back to the node the smallest key says which child is next: a few steps without a branch, where
//! sorting costs a mispredicted one for most nodes. A child that starts behind the best hit is
//! dropped; one that starts at it is not, since a hit at the same `t` may have a smaller id. Any hit
//! needs no order: a set of children waits, the largest first.

use super::Closest;
use super::visits::count;
use crate::bvh::{Bvh, Child, MAX_DEPTH, Node, PrimKind};
use crate::hit::NO_HIT;
use crate::kernels::{
    Met, Projected, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_sphere,
    intersect_triangle,
};
use crate::simd::{F32x8, Keys, LaneMask, Lanes};

/// One scaled ray, all that its tests need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Single {
    pub(super) origin: [f32; 3],
    pub(super) dir: [f32; 3],
    pub(super) t_min: f32,
    pub(super) t_max: f32,
    /// For boxes: see [`SlabRay`].
    pub(super) inverse: [f32; 3],
    pub(super) near: [f32; 3],
    pub(super) far: [f32; 3],
    /// For triangles and quads: see [`Sheared`].
    pub(super) shear: [f32; 2],
    pub(super) inverse_main: f32,
    pub(super) main: usize,
}

/// A node on the way from the root with children that wait.
#[derive(Clone, Copy, Default)]
struct Waiting {
    keys: Keys,
    children: u32,
    node: u32,
}

/// The nodes on the way: one for each level of the tree at most.
pub(super) struct Stack([Waiting; MAX_DEPTH]);

impl Stack {
    pub(super) fn new() -> Self {
        Self([Waiting::default(); MAX_DEPTH])
    }
}

/// The closest hit of a ray, `t` in terms of the scaled ray; its id is [`NO_HIT`] if there is none.
pub(super) fn intersect(bvh: &Bvh, ray: &Single, stack: &mut Stack) -> Closest {
    count(|visits| visits.singles += 1);
    let mut best = Closest { t: ray.t_max, u: 0.0, v: 0.0, id: NO_HIT };
    let boxes = BoxRay::new(ray);
    let leaf_ray = LeafRay::new(ray);
    let mut waiting = 0;
    let mut current = 0;
    loop {
        count(|visits| visits.nodes += 1);
        let mut node = &bvh.nodes[current as usize];
        let (near, far) = boxes.interval(node, ray.t_min, best.t);
        let met = near.le(far);
        let mut keys = Keys::new(near, met);
        let mut children = met.bits();
        // The children of `current`, then of the nodes before it, nearest first.
        current = loop {
            let key = keys.nearest();
            if children == 0 || Keys::distance(key) > best.t.max(0.0) {
                if waiting == 0 {
                    return best;
                }
                waiting -= 1;
                let back = &stack.0[waiting];
                (keys, children, current) = (back.keys, back.children, back.node);
                node = &bvh.nodes[current as usize];
                continue;
            }
            let slot = Keys::lane(key);
            keys.remove(slot);
            children &= children - 1;
            match node.child(slot) {
                Child::Leaf { kind, first, count } => {
                    leaf_ray.meet(bvh, kind, first, count, &mut best);
                }
                Child::Inner(inner) => {
                    if children != 0 {
                        stack.0[waiting] = Waiting { keys, children, node: current };
                        waiting += 1;
                    }
                    break inner;
                }
            }
        };
    }
}

/// True if a ray hits anything.
pub(super) fn occluded(bvh: &Bvh, ray: &Single, stack: &mut Stack) -> bool {
    count(|visits| visits.singles += 1);
    let mut best = Closest { t: ray.t_max, u: 0.0, v: 0.0, id: NO_HIT };
    let boxes = BoxRay::new(ray);
    let leaf_ray = LeafRay::new(ray);
    let mut waiting = 0;
    let mut current = 0;
    loop {
        count(|visits| visits.nodes += 1);
        let mut node = &bvh.nodes[current as usize];
        let (near, far) = boxes.interval(node, ray.t_min, ray.t_max);
        let mut children = near.le(far).bits();
        current = loop {
            if children == 0 {
                if waiting == 0 {
                    return false;
                }
                waiting -= 1;
                (children, current) = (stack.0[waiting].children, stack.0[waiting].node);
                node = &bvh.nodes[current as usize];
                continue;
            }
            let slot = children.trailing_zeros() as usize;
            children &= children - 1;
            match node.child(slot) {
                Child::Leaf { kind, first, count } => {
                    leaf_ray.meet(bvh, kind, first, count, &mut best);
                    if best.id != NO_HIT {
                        return true;
                    }
                }
                Child::Inner(inner) => {
                    if children != 0 {
                        let place = &mut stack.0[waiting];
                        (place.children, place.node) = (children, current);
                        waiting += 1;
                    }
                    break inner;
                }
            }
        };
    }
}

/// One ray in all lanes, ready for the boxes of a node.
struct BoxRay {
    slab: SlabRay<F32x8>,
    near_plane: [usize; 3],
}

impl BoxRay {
    #[inline(always)]
    fn new(ray: &Single) -> Self {
        Self {
            slab: SlabRay {
                inverse: ray.inverse.map(F32x8::splat),
                near: ray.near.map(F32x8::splat),
                far: ray.far.map(F32x8::splat),
            },
            near_plane: std::array::from_fn(
                |axis| {
                    if ray.inverse[axis] < 0.0 { axis + 3 } else { axis }
                },
            ),
        }
    }

    #[inline(always)]
    fn interval(&self, node: &Node, t_min: f32, t_max: f32) -> (F32x8, F32x8) {
        let planes = |place: usize| F32x8::load(&node.bounds[place]);
        let far_plane: [usize; 3] =
            std::array::from_fn(|axis| 2 * axis + 3 - self.near_plane[axis]);
        let (t_min, t_max) = (F32x8::splat(t_min), F32x8::splat(t_max));
        self.slab.interval(self.near_plane.map(planes), far_plane.map(planes), t_min, t_max)
    }
}

/// One ray in all lanes, ready for the primitives of a leaf.
struct LeafRay<'a> {
    ray: &'a Single,
    sheared: Sheared<F32x8>,
    order: [usize; 3],
}

impl<'a> LeafRay<'a> {
    #[inline(always)]
    fn new(ray: &'a Single) -> Self {
        let order = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][ray.main];
        Self {
            ray,
            sheared: Sheared {
                origin: order.map(|axis| F32x8::splat(ray.origin[axis])),
                shear: ray.shear.map(F32x8::splat),
                inverse: F32x8::splat(ray.inverse_main),
                t_min: F32x8::splat(ray.t_min),
                t_max: F32x8::splat(ray.t_max),
            },
            order,
        }
    }

    /// Tests a leaf and keeps the closest hit in `best`.
    #[inline(always)]
    fn meet(&self, bvh: &Bvh, kind: PrimKind, first: u32, count: u32, best: &mut Closest) {
        crate::traverse::visits::count(|visits| {
            visits.leaves += 1;
            visits.primitives += u64::from(count);
        });
        let active = F32x8::mask((1 << count) - 1);
        let t_max = F32x8::splat(best.t);
        let (met, ids) = match kind {
            PrimKind::Triangle => {
                let leaf = &bvh.leaves.triangles;
                let ray = Sheared { t_max, ..self.sheared };
                let corners = self.project(|field| leaf.lanes(first, count, field));
                (intersect_triangle(&ray, corners, active), &leaf.ids)
            }
            PrimKind::Quad => {
                let leaf = &bvh.leaves.quads;
                let ray = Sheared { t_max, ..self.sheared };
                let corners = self.project(|field| leaf.lanes(first, count, field));
                (intersect_quad(&ray, corners, active), &leaf.ids)
            }
            PrimKind::Sphere => {
                let leaf = &bvh.leaves.spheres;
                let field = |field| F32x8::load(leaf.lanes(first, count, field));
                let ray = ScaledRay {
                    origin: self.ray.origin.map(F32x8::splat),
                    dir: self.ray.dir.map(F32x8::splat),
                    t_min: F32x8::splat(self.ray.t_min),
                    t_max,
                    scale: F32x8::splat(1.0),
                    valid: active,
                };
                let center = [field(0), field(1), field(2)];
                (intersect_sphere(&ray, center, field(3), active), &leaf.ids)
            }
        };
        if let Some(met) = met {
            keep_closest(&met, &ids[first as usize..], best);
        }
    }

    #[inline(always)]
    fn project<'b, const CORNERS: usize>(
        &self,
        field: impl Fn(usize) -> &'b [f32],
    ) -> [Projected<F32x8>; CORNERS] {
        std::array::from_fn(|corner| {
            self.sheared.project(self.order.map(|axis| F32x8::load(field(3 * corner + axis))))
        })
    }
}

/// The closest of the lanes, by `t` and then by id.
#[inline(always)]
fn keep_closest(met: &Met<F32x8>, ids: &[u32], best: &mut Closest) {
    let mut mask = met.mask.bits();
    while mask != 0 {
        let lane = mask.trailing_zeros() as usize;
        mask &= mask - 1;
        let (t, id) = (met.t.lane(lane), ids[lane]);
        if t < best.t || (t == best.t && id < best.id) {
            *best = Closest { t, u: met.u.lane(lane), v: met.v.lane(lane), id };
        }
    }
}
