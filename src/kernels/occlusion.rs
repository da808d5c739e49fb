//! Whether spheres are in the way of rays, with doubles only where floats can't tell.
//!
//! [`super::intersect_sphere`] finds where a ray meets a sphere, in doubles and lane by lane. A shadow
//! ray wants to know less: most rays pass far from the surface, or enter the sphere well within
//! their range, and floats with a margin can say so. The rest is asked of that kernel.

use super::{ScaledRay, intersect_sphere};
use crate::simd::{LaneMask, Lanes};

/// How far a distance may be off, in units of the centre's distance: 16 roundings of 2^-24, as in
/// [`super::intersect_sphere`], and as many again.
const MARGIN: f32 = 1.0 / (1 << 19) as f32;

/// Spheres with smaller radii, in units of the margin, are left to doubles.
const LEAST_RADIUS: f32 = 4.0;

/// Smaller values are left to doubles: their squares would vanish.
const SMALLEST: f32 = 1.0e-15;
/// Larger ones, too: their squares would overflow.
const LARGEST: f32 = 1.0e15;

/// The lanes of `active` whose rays meet a sphere: exactly those in which [`intersect_sphere`] finds
/// a hit.
#[inline(always)]
pub fn occluded_by_sphere<F: Lanes>(
    ray: &ScaledRay<F>,
    center: [F; 3],
    radius: F,
    active: F::Mask,
) -> u32 {
    let from: [F; 3] = std::array::from_fn(|axis| ray.origin[axis] - center[axis]);
    let length = dot(ray.dir, ray.dir);
    let along = -(dot(from, ray.dir) / length);
    let next: [F; 3] = std::array::from_fn(|axis| ray.dir[axis].mul_add_fast(along, from[axis]));
    let distance = from[0].abs() + from[1].abs() + from[2].abs();
    let margin = distance * F::splat(MARGIN);
    let wide = radius + margin;
    let narrow = radius - margin;
    let apart = dot(next, next);
    // Nothing is certain where squares lose bits, where a step of `t` is shorter than one unit, or
    // where the start of the range is far from where the ray starts.
    let certain = radius.gt(margin * F::splat(LEAST_RADIUS))
        & radius.gt(F::splat(SMALLEST))
        & distance.lt(F::splat(LARGEST))
        & length.ge(F::splat(1.0))
        & ray.t_min.abs().le(distance);
    let missed =
        apart.gt(wide * wide) | (along + wide).lt(ray.t_min) | (along - wide).gt(ray.t_max);
    let rest = active & !(certain & missed);
    if !rest.any() {
        return 0;
    }
    // Outside at the start of the range, inside at the middle, which is in the range.
    let start: [F; 3] =
        std::array::from_fn(|axis| ray.dir[axis].mul_add_fast(ray.t_min, from[axis]));
    let met = certain
        & apart.lt(narrow * narrow)
        & dot(start, start).gt(wide * wide)
        & along.gt(ray.t_min + margin)
        & along.lt(ray.t_max - margin);
    let hit = (rest & met).bits();
    let unsure = rest.bits() & !hit;
    let mut lanes = unsure;
    let mut found = hit;
    while lanes != 0 {
        let lane = lanes.trailing_zeros() as usize;
        lanes &= lanes - 1;
        let of = |part: [F; 3]| part.map(|part| part.lane(lane));
        let one = ScaledRay {
            origin: of(ray.origin),
            dir: of(ray.dir),
            t_min: ray.t_min.lane(lane),
            t_max: ray.t_max.lane(lane),
            scale: ray.scale.lane(lane),
            valid: true,
        };
        found |= u32::from(intersect_sphere(&one, of(center), radius.lane(lane), true).is_some())
            << lane;
    }
    found
}

#[inline(always)]
fn dot<F: Lanes>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add_fast(b[0], a[1].mul_add_fast(b[1], a[2] * b[2]))
}
