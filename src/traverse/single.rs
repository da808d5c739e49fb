//! One ray on its own: eight boxes of a node side by side, or the primitives of a leaf.
//!
//! Whether a ray meets anything in a leaf is anyone's guess. Where other rays have work meanwhile, triangles
//! are tested to the end, and the closest is kept without a branch; a wrong guess costs more than the rest
//! of the test. A ray that comes alone gains more by guesses that come true.

use std::hint::select_unpredictable;

use super::Closest;
use crate::bvh::{Bvh, Leaf, Node, PrimKind, WIDTH};
use crate::hit::NO_HIT;
use crate::kernels::{
    Met, Projected, ScaledRay, Sheared, SlabRay, intersect_quad, intersect_sphere,
    intersect_triangle, intersect_triangles_straight,
};
use crate::simd::{F32x8, LaneMask, Lanes, each};

/// A side of a box: how far its bounds are from the lower ones in a [`Node`], in floats.
///
/// The compiler knows that there is no other value, and so that all bounds are within the node.
#[derive(Clone, Copy, Debug, Default)]
#[repr(u32)]
pub(super) enum Side {
    #[default]
    Lower = 0,
    Upper = 3 * WIDTH as u32,
}

/// One scaled ray, all that its tests need.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Single {
    pub(super) origin: [f32; 3],
    pub(super) dir: [f32; 3],
    pub(super) t_min: f32,
    /// For boxes: see [`SlabRay`].
    pub(super) inverse: [f32; 3],
    pub(super) near: [f32; 3],
    pub(super) far: [f32; 3],
    /// The bound that is met first on each axis, and the other one.
    pub(super) near_side: [Side; 3],
    pub(super) far_side: [Side; 3],
    /// For triangles and quads: see [`Sheared`], for the origin's order too.
    pub(super) sheared_origin: [f32; 3],
    pub(super) shear: [f32; 2],
    pub(super) inverse_main: f32,
    /// The axes in the order of [`Sheared`].
    pub(super) order: [u32; 3],
}

impl Single {
    /// Where the ray is inside the boxes of a node; empty (the first value is larger) if it misses.
    #[inline(always)]
    pub(super) fn interval(&self, node: &Node, t_max: f32) -> (F32x8, F32x8) {
        let slab = SlabRay {
            inverse: each(|axis| F32x8::splat(self.inverse[axis])),
            near: each(|axis| F32x8::splat(self.near[axis])),
            far: each(|axis| F32x8::splat(self.far[axis])),
        };
        let bounds = node.bounds.as_flattened();
        let planes =
            |side: Side, axis: usize| F32x8::load(&bounds[WIDTH * axis + side as usize..][..WIDTH]);
        let near_planes = each(|axis| planes(self.near_side[axis], axis));
        let far_planes = each(|axis| planes(self.far_side[axis], axis));
        let (t_min, t_max) = (F32x8::splat(self.t_min), F32x8::splat(t_max));
        slab.interval(near_planes, far_planes, t_min, t_max)
    }

    /// Tests so many primitives of a leaf from the first on, and keeps the closest hit in `best`; triangles
    /// without a branch if `STRAIGHT`.
    #[inline(always)]
    pub(super) fn meet<const ANY: bool, const STRAIGHT: bool>(
        &self,
        bvh: &Bvh,
        kind: PrimKind,
        (first, count): (u32, u32),
        best: &mut Closest,
    ) {
        crate::traverse::visits::count(|visits| {
            visits.leaves += 1;
            visits.primitives += u64::from(count);
        });
        let active = F32x8::mask((1 << count) - 1);
        let leaves = &bvh.leaves;
        let (met, ids) = match kind {
            PrimKind::Triangle => {
                let (ray, leaf) = (self.sheared(best.t), leaves.triangles.leaf(first, count));
                let corner = |corner| self.project(&ray, leaf, corner);
                let corners = [corner(0), corner(1), corner(2)];
                if STRAIGHT {
                    let met = intersect_triangles_straight(&ray, corners, active);
                    return keep::<ANY>(&met, &leaves.triangles.ids[first as usize..], best);
                }
                (intersect_triangle(&ray, corners, active), &leaves.triangles.ids)
            }
            PrimKind::Quad => {
                let (ray, leaf) = (self.sheared(best.t), leaves.quads.leaf(first, count));
                let corner = |corner| self.project(&ray, leaf, corner);
                let corners = [corner(0), corner(1), corner(2), corner(3)];
                (intersect_quad(&ray, corners, active), &leaves.quads.ids)
            }
            PrimKind::Sphere => {
                let leaf = leaves.spheres.leaf(first, count);
                let field = |field| F32x8::load(leaf.lanes(field));
                let ray = ScaledRay {
                    origin: each(|axis| F32x8::splat(self.origin[axis])),
                    dir: each(|axis| F32x8::splat(self.dir[axis])),
                    t_min: F32x8::splat(self.t_min),
                    t_max: F32x8::splat(best.t),
                    scale: F32x8::splat(1.0),
                    valid: active,
                };
                let center = [field(0), field(1), field(2)];
                (intersect_sphere(&ray, center, field(3), active), &leaves.spheres.ids)
            }
        };
        if let Some(met) = met {
            keep::<ANY>(&met, &ids[first as usize..], best);
        }
    }

    #[inline(always)]
    fn sheared(&self, t_max: f32) -> Sheared<F32x8> {
        Sheared {
            origin: each(|place| F32x8::splat(self.sheared_origin[place])),
            shear: [F32x8::splat(self.shear[0]), F32x8::splat(self.shear[1])],
            inverse: F32x8::splat(self.inverse_main),
            t_min: F32x8::splat(self.t_min),
            t_max: F32x8::splat(t_max),
        }
    }

    #[inline(always)]
    fn project(&self, ray: &Sheared<F32x8>, leaf: Leaf<'_>, corner: usize) -> Projected<F32x8> {
        // The mask is for the compiler, as in `interval`.
        let field = |place: usize| 3 * corner + (self.order[place] & 3) as usize;
        ray.project(each(|place| F32x8::load(leaf.lanes(field(place)))))
    }
}

/// Keeps the closest of the lanes in `best`, by `t` and then by id, without a branch but for ties. If `ANY`,
/// the id tells only that there was a hit.
#[inline(always)]
fn keep<const ANY: bool>(met: &Met<F32x8>, ids: &[u32], best: &mut Closest) {
    if ANY {
        best.id = select_unpredictable(met.mask.any(), 0, best.id);
        return;
    }
    let nearest = Lanes::select(met.mask, met.t, F32x8::splat(best.t)).reduce_min();
    let lanes = (met.mask & met.t.eq(F32x8::splat(nearest))).bits();
    if (lanes & lanes.wrapping_sub(1) != 0) | ((lanes != 0) & (nearest == best.t)) {
        return keep_closest(met, ids, best);
    }
    let hit = lanes != 0;
    let lane = lanes.trailing_zeros() as usize & 7;
    let id = ids.get(lane).copied().unwrap_or(NO_HIT);
    *best = Closest {
        t: nearest,
        u: select_unpredictable(hit, met.u.lane(lane), best.u),
        v: select_unpredictable(hit, met.v.lane(lane), best.v),
        id: select_unpredictable(hit, id, best.id),
    };
}

/// The closest of the lanes, by `t` and then by id.
#[cold]
#[inline(never)]
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
