//! Primitives that no ray of a pyramid gets to, since they all stay on one side of it: the surface that a
//! point lies on, and what is behind the light.
//!
//! Points of surfaces start so close to them that volumes tell nothing. But a ray that starts on one side of
//! a plane and runs away from it meets it at a negative `t`, and one that ends before the plane at a `t`
//! beyond its end. How far from the plane that is sure for what the kernels compute, with `u = 2^-24`, `n` the
//! plane's normal, `r` the largest distance of a corner from the ray's origin along each axis, and `m` the
//! ray's main axis:
//!
//! 1. A corner as the ray sees it is off by `u r` along each axis (the difference), on the two others than
//!    `m` also by `u (r + r_m)` (the shear). As a corner of the scene moved as much, it moves the plane by
//!    `u (|n_m| r_m + |n_k| (2 r_k + r_m))` at most, summed over both `k`.
//! 2. The weights are off by `3 u` each (2 for an edge, Jeannerod, Louvet, Muller 2013), but for a factor in
//!    common, the two sums that `t` is made of by `u r_m` each: a depth of `5 u r_m`, which is a distance
//!    from the plane of `5 u r_m (|n_x| + |n_y| + |n_z|)` at most, since no part of a direction is larger than
//!    that along `m`.
//!
//! Both are below `u (6 R (|n_x| + |n_y| + |n_z|) + 2 (|n_x| r_x + |n_y| r_y + |n_z| r_z))`, with `R` the
//! largest part of `r`. The last roundings of `t` keep its sign, and move it by less than the margin of the
//! directions does.

use super::{Pyramids, SMALLEST};
use crate::simd::{Lanes, each};

/// `6 u` and `2 u`, and a little more for this file's own rounding and that of the normal.
const FROM_CORNERS: f32 = 6.25 / (1 << 24) as f32;
const FROM_NORMAL: f32 = 2.125 / (1 << 24) as f32;

/// Narrower triangles, by their area over the product of two sides, have no normal that is exact enough: a
/// product of doubles is off by 2^-50, so the normal by a quarter of what the constants above leave.
const NARROWEST: f64 = 1.0 / (1 << 20) as f64;

/// How much larger than the sphere a point's distance from its centre must be for doubles to tell, squared.
const OUTSIDE: f64 = 1.0 / (1_u64 << 40) as f64;

/// The most lanes of any [`Lanes`].
const MAX_LANES: usize = 16;

impl<F: Lanes> Pyramids<F> {
    /// The lanes whose rays all stay on one side of a triangle's plane from `t = 0` to `t_max`, so that the
    /// triangle's kernel finds none of them to meet it there.
    #[inline(never)]
    pub fn clear_of_triangle(&self, corners: [[f32; 3]; 3], t_max: f32) -> F::Mask {
        let [a, b, c]: [[f64; 3]; 3] = each(|corner| each(|axis| f64::from(corners[corner][axis])));
        let along = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
        let (ab, ac) = (along(b), along(c));
        let part = |i: usize, j: usize| ab[i] * ac[j] - ab[j] * ac[i];
        let normal = [part(1, 2), part(2, 0), part(0, 1)];
        let largest = |v: [f64; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let (length, sides) = (largest(normal), [largest(ab), largest(ac)]);
        // Asked this way round, a NaN is no normal.
        let known = length > sides[0] * sides[1] * NARROWEST;
        if !known || sides[0] < f64::from(SMALLEST) {
            return F::mask(0);
        }
        let normal: [f64; 3] = each(|axis| normal[axis] / length);
        let height = self.in_doubles(|apex| {
            let [x, y, z] = along(apex);
            normal[0] * x + normal[1] * y + normal[2] * z
        });

        let normal: [F; 3] = each(|axis| F::splat(normal[axis] as f32));
        let reach = |axis: usize| {
            let far = |corner: usize| (F::splat(corners[corner][axis]) - self.apex[axis]).abs();
            far(0).max(far(1)).max(far(2))
        };
        let (x, y, z) = (reach(0), reach(1), reach(2));
        let size: [F; 3] = each(|axis| normal[axis].abs());
        let tilted = size[0] * x + size[1] * y + size[2] * z;
        let needed = (size[0] + size[1] + size[2]) * x.max(y).max(z) * F::splat(FROM_CORNERS)
            + tilted * F::splat(FROM_NORMAL);
        let (low, high) = self.products(normal);
        // Twice: the kernels shear along directions that are rounded once more.
        let error = self.product_error(normal) * F::splat(2.0);
        let stays = |height: F, toward: F| {
            let ends_before = (height + toward * F::splat(t_max)).gt(needed + error);
            height.gt(needed) & (toward.gt(error) | ends_before)
        };
        stays(height, low) | stays(-height, -high)
    }

    /// As [`Pyramids::clear_of_triangle`], for a quad, its corners in order around it.
    #[inline(always)]
    pub fn clear_of_quad(&self, [a, b, c, d]: [[f32; 3]; 4], t_max: f32) -> F::Mask {
        self.clear_of_triangle([a, b, c], t_max) & self.clear_of_triangle([a, c, d], t_max)
    }

    /// The lanes whose rays all start outside of a sphere and run away from its centre: both roots of its
    /// kernel are below 0 then.
    #[inline(never)]
    pub fn clear_of_sphere(&self, center: [f32; 3], radius: f32) -> F::Mask {
        if radius < SMALLEST {
            return F::mask(0);
        }
        let [x, y, z]: [f64; 3] = each(|axis| f64::from(center[axis]));
        let square = f64::from(radius) * f64::from(radius);
        let outside = self.in_doubles(|apex| {
            let from = [apex[0] - x, apex[1] - y, apex[2] - z];
            let far = from[0] * from[0] + from[1] * from[1] + from[2] * from[2];
            far - square - (far + square) * OUTSIDE
        });
        let out: [F; 3] = each(|axis| self.apex[axis] - F::splat(center[axis]));
        let (low, _) = self.products(out);
        outside.gt(F::splat(0.0)) & low.gt(self.product_error(out) * F::splat(2.0))
    }

    /// What `of` gives for each point, in a loop without branches that is compiled to registers of doubles.
    #[inline(always)]
    fn in_doubles(&self, of: impl Fn([f64; 3]) -> f64) -> F {
        let apex: [[f32; MAX_LANES]; 3] = each(|axis| {
            let mut lanes = [0.0; MAX_LANES];
            self.apex[axis].store(&mut lanes);
            lanes
        });
        let mut values = [0.0; MAX_LANES];
        for lane in 0..F::LANES {
            values[lane] = of(each(|axis| f64::from(apex[axis][lane]))) as f32;
        }
        F::load(&values)
    }
}
