//! The slab test: rays against boxes, never missing a box whose primitive would be hit.
//!
//! `t = plane * inv - origin * inv` as one fused operation a plane. Its rounding errors, and those of
//! the primitive kernels, whose hits may lie beside the true surface, are covered by one margin: a
//! distance of [`MARGIN`] times the largest coordinate in play, on either side of every plane (after
//! Ize 2013, "Robust BVH Ray Traversal", who widens `t` by its relative error; that does not cover a
//! primitive's own error along a ray that is nearly parallel to the plane).
//!
//! Invariant: for boxes `a` inside `b`, the interval of `a` lies inside that of `b`, exactly, since
//! every step rounds monotonically.

use super::ScaledRay;
use crate::simd::{Lanes, each};

/// The margin in units of the largest coordinate: 32 roundings of 2^-24. The projection of a corner
/// takes 6 of them, its edge functions 4, the weighted sum 4, the planes themselves 5.
pub(super) const MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// A direction's part is at least this times the largest part, so that its inverse times a
/// coordinate stays finite. Over the whole scene that moves the ray by a 2^-20th of the margin.
const SMALLEST_PART: f32 = 1.0 / (1_u64 << 40) as f32;

/// Where coordinates are larger, their products with an inverse may overflow: there the margin is
/// infinite, and rays meet every box.
pub(super) const LARGEST_COORDINATE: f32 = (1_u64 << 60) as f32;

/// Rays made ready for the slab test.
#[derive(Clone, Copy, Debug)]
pub struct SlabRay<F: Lanes> {
    /// One over the direction.
    pub inverse: [F; 3],
    /// Minus origin over direction, less the margin: added to the nearer plane.
    pub near: [F; 3],
    /// Minus origin over direction, plus the margin: added to the farther plane.
    pub far: [F; 3],
}

impl<F: Lanes> SlabRay<F> {
    /// Makes rays ready for boxes whose coordinates are at most `extent` away from zero.
    #[inline(always)]
    pub fn new(ray: &ScaledRay<F>, extent: f32) -> Self {
        let [x, y, z] = ray.dir.map(F::abs);
        // The largest is from 1 to 2, but for directions of denormals, which scale to less.
        let smallest = x.max(y).max(z) * F::splat(SMALLEST_PART);
        let inverse = ray.dir.map(|part| {
            let clamped = F::select(part.abs().ge(smallest), part, smallest);
            F::splat(1.0) / clamped
        });
        let [x, y, z] = ray.origin.map(F::abs);
        let largest = F::splat(extent) + x.max(y).max(z);
        let covered = largest.le(F::splat(LARGEST_COORDINATE));
        let margin = F::select(covered, largest * F::splat(MARGIN), F::splat(f32::INFINITY));
        let at: [F; 3] = each(|axis| -(ray.origin[axis] * inverse[axis]));
        let wide: [F; 3] = each(|axis| margin * inverse[axis].abs());
        Self {
            inverse,
            near: each(|axis| at[axis] - wide[axis]),
            far: each(|axis| at[axis] + wide[axis]),
        }
    }

    /// Where the rays are inside the boxes within `t_min ..= t_max`: from the first to the second
    /// value, empty if the first is larger. `near_planes` are those that the rays meet first: the
    /// minima where the direction is positive, the maxima where it is negative. A NaN (infinity
    /// times zero) widens the interval, never narrows it.
    #[inline(always)]
    pub fn interval(&self, near_planes: [F; 3], far_planes: [F; 3], t_min: F, t_max: F) -> (F, F) {
        let near =
            |axis: usize| near_planes[axis].mul_add_fast(self.inverse[axis], self.near[axis]);
        let far = |axis: usize| far_planes[axis].mul_add_fast(self.inverse[axis], self.far[axis]);
        (near(0).max(near(1).max(near(2).max(t_min))), far(0).min(far(1).min(far(2).min(t_max))))
    }

    /// As [`SlabRay::interval`] for rays whose directions differ in sign: which plane comes first is
    /// decided lane by lane.
    #[inline(always)]
    pub fn interval_any_sign(&self, min: [F; 3], max: [F; 3], t_min: F, t_max: F) -> (F, F) {
        let mut interval = (t_min, t_max);
        for axis in 0..3 {
            let (a, b) = (min[axis] * self.inverse[axis], max[axis] * self.inverse[axis]);
            interval.0 = (a.min(b) + self.near[axis]).max(interval.0);
            interval.1 = (a.max(b) + self.far[axis]).min(interval.1);
        }
        interval
    }
}
