//! Ray-parallelogram intersection, as the two triangles that share a diagonal.
//!
//! The plane equation in sheared space with signs that are exact: quads and triangles whose corners
//! agree leave no gap between them, and a ray along the plane sees no area and misses. Four edge
//! tests alone would not do: a quad that is seen edge-on is, after rounding, no longer convex, and
//! their quotients put the hit far beside it.

use super::scaled::{Projected, Sheared};
use super::{Met, area_counts, edge};
use crate::simd::{LaneMask, Lanes};

/// Where rays meet quads, given the four corners in order around them as the rays see them. `None`
/// if no lane of `active` does. `u` and `v` run from 0 to 1 along the edges from the first corner to
/// the second and to the fourth.
#[inline(always)]
pub fn intersect_quad<F: Lanes>(
    ray: &Sheared<F>,
    [a, b, c, d]: [Projected<F>; 4],
    active: F::Mask,
) -> Option<Met<F>> {
    let (ab, bc, ca) = (edge(a.at, b.at), edge(b.at, c.at), edge(c.at, a.at));
    let (cd, da) = (edge(c.at, d.at), edge(d.at, a.at));
    let ac = -ca;
    let zero = F::splat(0.0);
    let one_sign = |x: F, y: F, z: F| x.min(y).min(z).ge(zero) | x.max(y).max(z).le(zero);
    let (in_first, in_second) = (one_sign(ab, bc, ca), one_sign(ac, cd, da));
    let inside = (in_first | in_second) & active;
    if !inside.any() {
        return None;
    }
    let first_area = bc + ca + ab;
    let first = in_first & area_counts(first_area);
    let area = F::select(first, first_area, cd + ac + da);
    let inverse = F::splat(1.0) / area;
    // Weights of `a`, of `c`, and of the corner that is the triangle's own.
    let weight_a = F::select(first, bc, cd);
    let weight_c = F::select(first, ab, da);
    let weight_own = F::select(first, ca, ac);
    let own_depth = F::select(first, b.depth, d.depth);
    let (of_a, of_own, of_c) = (weight_a * inverse, weight_own * inverse, weight_c * inverse);
    let t = of_a.mul_add(a.depth, of_own.mul_add(own_depth, of_c * c.depth)) * ray.inverse;
    let mask = inside & (first | in_second) & area_counts(area) & t.ge(ray.t_min) & t.le(ray.t_max);
    let (one, both) = (of_c, of_c + of_own);
    let (u, v) = (F::select(first, both, one), F::select(first, one, both));
    mask.any().then_some(Met { mask, t, u, v })
}
