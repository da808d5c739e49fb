//! Watertight ray-triangle intersection (Woop, Benthin, Wald 2013, "Watertight Ray/Triangle
//! Intersection"), with edge functions whose sign is exact: see [`super::edge`].
//!
//! A ray through a shared edge or vertex meets at least one of the triangles around it: the
//! projected corners depend on ray and corner alone, and which side of an edge the ray passes is
//! decided exactly. Both faces are hit; edges and corners belong to the triangle.

use super::scaled::{Projected, Sheared};
use super::{Met, area_counts, edge};
use crate::simd::{LaneMask, Lanes};

/// Where rays meet triangles, given the triangles' corners as the rays see them. `None` if no lane
/// of `active` does; a NaN or an overflow anywhere is a miss in its lane. `u` and `v` are the
/// weights of the second and the third corner.
#[inline(always)]
pub fn intersect_triangle<F: Lanes>(
    ray: &Sheared<F>,
    corners: [Projected<F>; 3],
    active: F::Mask,
) -> Option<Met<F>> {
    let (weights, inside) = weights(&corners, active);
    if !inside.any() {
        return None;
    }
    let met = at(ray, &corners, weights, inside);
    met.mask.any().then_some(met)
}

/// As [`intersect_triangle`], without a branch: for lanes of which nobody knows beforehand whether any
/// of them meets.
#[inline(always)]
pub fn intersect_triangles_straight<F: Lanes>(
    ray: &Sheared<F>,
    corners: [Projected<F>; 3],
    active: F::Mask,
) -> Met<F> {
    let (weights, inside) = weights(&corners, active);
    at(ray, &corners, weights, inside)
}

/// The weights of the corners, not yet divided by their sum, and the lanes whose rays pass inside.
#[inline(always)]
fn weights<F: Lanes>([a, b, c]: &[Projected<F>; 3], active: F::Mask) -> ([F; 3], F::Mask) {
    let weights = [edge(c.at, b.at), edge(a.at, c.at), edge(b.at, a.at)];
    let [weight_a, weight_b, weight_c] = weights;
    let zero = F::splat(0.0);
    let inside = weight_a.min(weight_b).min(weight_c).ge(zero)
        | weight_a.max(weight_b).max(weight_c).le(zero);
    (weights, inside & active)
}

#[inline(always)]
fn at<F: Lanes>(
    ray: &Sheared<F>,
    [a, b, c]: &[Projected<F>; 3],
    [weight_a, weight_b, weight_c]: [F; 3],
    inside: F::Mask,
) -> Met<F> {
    let area = weight_a + weight_b + weight_c;
    let inverse = F::splat(1.0) / area;
    // From 0 to 1, so that a product with a depth neither overflows nor vanishes.
    let (w, u, v) = (weight_a * inverse, weight_b * inverse, weight_c * inverse);
    let t = w.mul_add(a.depth, u.mul_add(b.depth, v * c.depth)) * ray.inverse;
    let mask = inside & area_counts(area) & t.ge(ray.t_min) & t.le(ray.t_max);
    Met { mask, t, u, v }
}
