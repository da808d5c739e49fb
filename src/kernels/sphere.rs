//! Ray-sphere intersection by the stable quadratic, decided in doubles.
//!
//! The discriminant comes from the point of the ray next to the centre, not from `b² - ac`, and the
//! smaller root from the product of both, so nothing cancels (Haines, Günther, Akenine-Möller 2019,
//! "Precision Improvements for Ray/Sphere Intersection"). Doubles make it right for a radius of
//! 1e-4 seen from 1e+4 away, where the difference of two float coordinates alone is off by more than
//! the radius. Most rays are turned away before by the same quantity in floats, with a margin.

use super::{Met, ScaledRay};
use crate::simd::{LaneMask, Lanes, each};

/// How far the float test may be off, in units of the centre's distance: 16 roundings of 2^-24.
const MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// The float test takes smaller spheres for as large as this: squares would vanish.
const SMALLEST_REACH: f32 = 1.0e-18;

/// Where rays meet spheres: the first of both points in range. `None` if no lane of `active` does.
#[inline(always)]
pub fn intersect_sphere<F: Lanes>(
    ray: &ScaledRay<F>,
    center: [F; 3],
    radius: F,
    active: F::Mask,
) -> Option<Met<F>> {
    let from: [F; 3] = each(|axis| ray.origin[axis] - center[axis]);
    let along = dot(from, ray.dir) / dot(ray.dir, ray.dir);
    let next: [F; 3] = each(|axis| ray.dir[axis].neg_mul_add(along, from[axis]));
    let distance = from[0].abs() + from[1].abs() + from[2].abs();
    let reach = distance.mul_add_fast(F::splat(MARGIN), radius).max(F::splat(SMALLEST_REACH));
    // Written so that a NaN or an overflow goes on to the doubles.
    let near = !dot(next, next).gt(reach * reach) & active;
    if !near.any() {
        return None;
    }
    // Arrays, and a loop without branches, so that the compiler makes registers of doubles of it.
    let lanes = |values: F| {
        let mut lanes = [0.0_f32; MAX_LANES];
        values.store(&mut lanes);
        lanes
    };
    let (origin, dir) = (ray.origin.map(lanes), ray.dir.map(lanes));
    let (center, radius) = (center.map(lanes), lanes(radius));
    let (t_min, t_max) = (lanes(ray.t_min), lanes(ray.t_max));
    let mut distances = [f32::NAN; MAX_LANES];
    for lane in 0..F::LANES {
        let at = |parts: &[[f32; MAX_LANES]; 3]| {
            [f64::from(parts[0][lane]), f64::from(parts[1][lane]), f64::from(parts[2][lane])]
        };
        distances[lane] = first_root(
            at(&origin),
            at(&dir),
            [t_min[lane], t_max[lane]],
            at(&center),
            f64::from(radius[lane]),
        );
    }
    let t = F::load(&distances);
    let mask = near & t.eq(t);
    mask.any().then(|| Met { mask, t, u: F::splat(0.0), v: F::splat(0.0) })
}

/// The most lanes of any [`Lanes`].
const MAX_LANES: usize = 16;

/// The first root in range, rounded to a float; NaN if there is none.
#[inline(always)]
fn first_root(
    origin: [f64; 3],
    dir: [f64; 3],
    [t_min, t_max]: [f32; 2],
    center: [f64; 3],
    radius: f64,
) -> f32 {
    let from = [origin[0] - center[0], origin[1] - center[1], origin[2] - center[2]];
    let a = dot64(dir, dir);
    let b = -dot64(from, dir);
    let along = b / a;
    let next = [from[0] + dir[0] * along, from[1] + dir[1] * along, from[2] + dir[2] * along];
    let rest = radius * radius - dot64(next, next);
    let root = (rest * a).sqrt();
    let c = dot64(from, from) - radius * radius;
    let q = b + root.copysign(b);
    let (one, other) = ((c / q) as f32, (q / a) as f32);
    // Sorted by value: rounding may swap the roots of a ray that touches the sphere at its origin.
    let (near, far) = (one.min(other), one.max(other));
    let in_range = |t: f32| (t >= t_min) & (t <= t_max);
    // A negative rest has no root: both are NaN then, and in no range.
    let far = if in_range(far) { far } else { f32::NAN };
    if in_range(near) { near } else { far }
}

#[inline(always)]
fn dot<F: Lanes>(a: [F; 3], b: [F; 3]) -> F {
    a[0].mul_add_fast(b[0], a[1].mul_add_fast(b[1], a[2] * b[2]))
}

#[inline(always)]
fn dot64(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
