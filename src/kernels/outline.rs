//! Outlines of triangles as seen from one point: which rays from there may pass inside.
//!
//! A ray from the origin passes inside a triangle with the corners `a`, `b`, `c` if its direction is on
//! the same side of the planes through the origin and each edge: three products with `a x b`, `b x c`,
//! `c x a` (Davidovic and others 2012, "3D Rasterization: A Bridge between Rasterization and Ray
//! Tracing"). That is a third of the triangle's own test and needs no division, but it rounds otherwise:
//! it turns a ray away only if that is outside by more than all rounding of both.

use super::vectors::{cross, dot, sub};
use crate::simd::{F32x8, LaneMask, Lanes, each};

/// What products of a direction with a side may be off, in units of the distance times the edge: the
/// side's own rounding is below 2^-19 of it, what the triangle's test makes of the corners below
/// 2^-19 more.
const ROUNDING: f32 = 1.0 / (1 << 17) as f32;

/// What rounding moves a corner by as the triangle's test sees it, at most, in units of the distance.
const STEP: f32 = 1.0 / (1 << 20) as f32;

/// Eight triangles, seen from the origin.
pub struct Outlines {
    /// The inner normals of the three sides.
    sides: [[[f32; 8]; 3]; 3],
    /// Infinite for a triangle that is seen nearly edge-on.
    slack: [f32; 8],
}

impl Outlines {
    /// The outlines of triangles, `v0.x .. v2.z`, all relative to where the rays start. A NaN or an
    /// overflow makes one that keeps all rays.
    #[inline(always)]
    pub fn new(corners: &[F32x8; 9]) -> Self {
        let corner = |corner: usize| each(|axis| corners[3 * corner + axis]);
        let (a, b, c) = (corner(0), corner(1), corner(2));
        let (ab, bc, ca) = (sub(b, a), sub(c, b), sub(a, c));
        let size = |v: [F32x8; 3]| Lanes::abs(v[0]) + Lanes::abs(v[1]) + Lanes::abs(v[2]);
        let largest = |x: F32x8, y: F32x8, z: F32x8| Lanes::max(Lanes::max(x, y), z);
        let distance = largest(size(a), size(b), size(c));
        // Where rounding moves corners farther than they are apart, that is what edges are.
        let edge = Lanes::max(largest(size(ab), size(bc), size(ca)), F32x8::splat(STEP) * distance);
        let slack = F32x8::splat(ROUNDING) * distance * edge;
        // The volume tells the inside, if it is sure: it is neither within its rounding, nor did any part of
        // it overflow.
        let volume = dot(a, cross(ca, ab));
        let unsure = slack * edge + F32x8::splat(f32::MIN_POSITIVE);
        let sure = Lanes::gt(Lanes::abs(volume), unsure)
            & Lanes::lt(unsure, F32x8::splat(ROUNDING * f32::MAX / 16.0));
        let (one, zero) = (F32x8::splat(1.0), F32x8::splat(0.0));
        let sign = Lanes::select(Lanes::lt(volume, zero), -one, one);
        let side = |from: [F32x8; 3], along: [F32x8; 3]| {
            let normal = cross(from, along);
            each(|axis| (normal[axis] * sign).to_array())
        };
        // The smallest normal number covers what denormals lose.
        let slack = slack + F32x8::splat(f32::MIN_POSITIVE);
        let slack = Lanes::select(sure, slack, F32x8::splat(f32::INFINITY));
        Self { sides: [side(a, ab), side(b, bc), side(c, ca)], slack: slack.to_array() }
    }

    /// True if a ray with one of these directions, whose largest part is at most 2, may pass inside
    /// triangle `place`.
    #[inline(always)]
    pub fn may_meet<F: Lanes>(&self, place: usize, dir: &[F; 3]) -> bool {
        let product = |side: usize| {
            let part = |axis: usize| F::splat(self.sides[side][axis][place & 7]);
            dir[0].mul_add_fast(part(0), dir[1].mul_add_fast(part(1), dir[2] * part(2)))
        };
        let least = product(0).min(product(1)).min(product(2));
        let outside = least.lt(F::splat(-self.slack[place & 7]));
        (!outside).any()
    }
}
