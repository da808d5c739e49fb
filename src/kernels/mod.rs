//! Kernels: one primitive against the lanes of a packet, or one ray against the lanes of a leaf.
//!
//! Each kernel is written once, generic over [`crate::simd::Lanes`]; either side may be the one
//! that is the same in all lanes. The operations and their order are the numerical contract: they
//! give the same bits for any number of lanes and in every build.
//!
//! A kernel says where its primitive is met within `t_min ..= t_max`. Whether that is closer than
//! what was met before is the traversal's business.

mod beam;
mod cone;
mod occlusion;
mod outline;
mod pyramid;
mod quad;
mod scaled;
mod slab;
mod sphere;
mod triangle;
mod vectors;

pub use beam::{Beam, BeamAxes, Bounds, beam_margin};
pub use cone::Footprint;
pub use occlusion::occluded_by_sphere;
pub use outline::Outlines;
pub use pyramid::{Pyramids, Verdict};
pub use quad::intersect_quad;
pub use scaled::{Projected, ScaledRay, Sheared};
pub use slab::SlabRay;
pub use sphere::intersect_sphere;
pub use triangle::{
    intersect_triangle, intersect_triangle_after, intersect_triangles_straight,
    may_meet_triangle_after,
};

use crate::simd::Lanes;

/// Lanes in which a primitive was met, and where.
#[derive(Clone, Copy, Debug)]
pub struct Met<F: Lanes> {
    /// The lanes that met it; the other fields mean something in these alone.
    pub mask: F::Mask,
    /// Distance along the scaled ray.
    pub t: F,
    /// First surface coordinate.
    pub u: F,
    /// Second surface coordinate.
    pub v: F,
}

/// Triangles and quads whose sheared area is smaller are missed: products of their sides would
/// lose bits below the smallest float.
const SMALLEST_AREA: f32 = 1.0e-30;

/// Triangles and quads whose sheared area is larger, `2^126`, are missed: its inverse would lose
/// bits, or the area is the infinity of an overflow.
const LARGEST_AREA: f32 = 1.0 / f32::MIN_POSITIVE;

/// The lanes whose sheared area is one that can be divided by; false on NaN.
#[inline(always)]
fn area_counts<F: Lanes>(area: F) -> F::Mask {
    area.abs().ge(F::splat(SMALLEST_AREA)) & area.abs().le(F::splat(LARGEST_AREA))
}

/// `a.x * b.y - a.y * b.x` of two sheared points, within 1.5 units in the last place, so that its
/// sign is exact (Kahan; Jeannerod, Louvet, Muller 2013). That replaces the rounded products of
/// Woop's edge test and their second try in doubles, and keeps barycentrics accurate for triangles
/// that are seen edge-on, which the margins of the slab test rely on.
#[inline(always)]
fn edge<F: Lanes>(a: [F; 2], b: [F; 2]) -> F {
    let product = a[1] * b[0];
    let error = a[1].neg_mul_add(b[0], product);
    let difference = a[0].mul_add(b[1], -product);
    difference + error
}
