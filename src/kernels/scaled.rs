//! Rays made ready for the kernels: scaled, checked and sheared.

use crate::ray::Rays;
use crate::simd::{LaneMask, Lanes, each};

impl Rays<'_> {
    /// The rays that `load` takes out of each array, scaled; lanes not in `active` are invalid.
    #[inline(always)]
    pub(crate) fn scaled<F: Lanes>(
        &self,
        load: impl Fn(&[f32]) -> F,
        active: F::Mask,
    ) -> ScaledRay<F> {
        ScaledRay::new(
            [load(self.origin_x), load(self.origin_y), load(self.origin_z)],
            [load(self.dir_x), load(self.dir_y), load(self.dir_z)],
            load(self.t_min),
            load(self.t_max),
            active,
        )
    }
}

/// Rays whose directions are scaled by a power of two, so that their largest part is from 1 to 2.
///
/// The scale is exact, so `t` of the caller's ray is [`ScaledRay::scale`] times `t` of this one, bit
/// for bit, and directions of any length from 1e-38 to 1e+38 trace alike.
#[derive(Clone, Copy, Debug)]
pub struct ScaledRay<F: Lanes> {
    /// Where the rays start.
    pub origin: [F; 3],
    /// Their scaled directions.
    pub dir: [F; 3],
    /// The smallest scaled `t`.
    pub t_min: F,
    /// The largest scaled `t`.
    pub t_max: F,
    /// What the direction was multiplied by, and what gives back the caller's `t`.
    pub scale: F,
    /// The lanes whose rays can hit something. The others hold a harmless ray with an empty range:
    /// they meet no box and no primitive.
    pub valid: F::Mask,
}

impl<F: Lanes> ScaledRay<F> {
    /// Scales the rays of the lanes in `active`; all others become invalid, and so does a ray with
    /// a NaN or infinite part, without direction, or with an empty or NaN range.
    #[inline(always)]
    pub fn new(origin: [F; 3], dir: [F; 3], t_min: F, t_max: F, active: F::Mask) -> Self {
        let largest = dir[0].abs().max(dir[1].abs()).max(dir[2].abs());
        let zero = F::splat(0.0);
        // Zero times NaN or infinity is NaN, and stays so in the sum.
        let finite = [origin[1], origin[2], dir[0], dir[1], dir[2]]
            .into_iter()
            .fold(origin[0] * zero, |sum, part| part.mul_add_fast(zero, sum));
        let valid = active & finite.eq(zero) & largest.gt(zero) & t_min.le(t_max);
        let scale = F::select(valid, largest, F::splat(1.0)).power_to_one();
        let inverse = scale.power_to_one();
        let or = |value: F, other: f32| F::select(valid, value, F::splat(other));
        // No hit is at infinity: not along the scaled ray, and not along the caller's.
        let finite = |t: F| t.min(F::splat(f32::MAX)).max(F::splat(f32::MIN));
        let (t_min, t_max) = (finite(finite(t_min) * inverse), finite(finite(t_max) * inverse));
        Self {
            // Adding zero makes -0 and 0 one origin: rays that start at it then share all differences.
            origin: origin.map(|part| or(part + zero, 0.0)),
            dir: [or(dir[0] * scale, 0.0), or(dir[1] * scale, 0.0), or(dir[2] * scale, 1.0)],
            t_min: or(t_min, f32::INFINITY),
            t_max: or(t_max, f32::NEG_INFINITY),
            scale,
            valid,
        }
    }

    /// The rays of one register.
    #[inline(always)]
    pub fn register(&self, index: usize) -> ScaledRay<F::Register> {
        ScaledRay {
            origin: each(|axis| self.origin[axis].register(index)),
            dir: each(|axis| self.dir[axis].register(index)),
            t_min: self.t_min.register(index),
            t_max: self.t_max.register(index),
            scale: self.scale.register(index),
            valid: F::mask_register(self.valid, index),
        }
    }

    /// The lanes whose rays run most along axis 0, 1 and 2; of equals the first counts.
    #[inline(always)]
    pub fn axis_masks(&self) -> [u32; 3] {
        let [x, y, z] = self.dir.map(F::abs);
        let valid = self.valid.bits();
        let along_x = (x.ge(y) & x.ge(z)).bits() & valid;
        let along_y = y.ge(z).bits() & valid & !along_x;
        [along_x, along_y, valid & !along_x & !along_y]
    }

    /// The shear that turns the rays into the axis `main` (Woop, Benthin, Wald 2013). Meaningful in
    /// the lanes that run most along it.
    #[inline(always)]
    pub fn sheared(&self, main: usize) -> Sheared<F> {
        let (x, y) = ((main + 1) % 3, (main + 2) % 3);
        let inverse = F::splat(1.0) / self.dir[main];
        Sheared {
            origin: [self.origin[x], self.origin[y], self.origin[main]],
            shear: [self.dir[x] * inverse, self.dir[y] * inverse],
            inverse,
            t_min: self.t_min,
            t_max: self.t_max,
        }
    }
}

/// Coordinates of which a depth times an area, at most a hundred times their cube, is still far from
/// overflowing.
const LARGEST_WITH_MOMENTS: f32 = (1_u64 << 30) as f32;

/// Rays in the space where each runs along the third axis. All arrays are in the order `main + 1`,
/// `main + 2`, `main` (modulo 3) of the scene's axes.
#[derive(Clone, Copy, Debug)]
pub struct Sheared<F: Lanes> {
    /// Where the rays start.
    pub origin: [F; 3],
    /// How far the rays move on the first two axes for one step on the third.
    pub shear: [F; 2],
    /// One over the direction's part along the third axis.
    pub inverse: F,
    /// The smallest scaled `t`.
    pub t_min: F,
    /// The largest scaled `t`.
    pub t_max: F,
}

impl<F: Lanes> Sheared<F> {
    /// A `t` so far before `t_min` that a triangle that is met before it, but for a few roundings, is
    /// surely met before `t_min` as its test sees it. No coordinate of a triangle is farther from zero
    /// than `extent`.
    ///
    /// The test's own `t` is off by at most 9 roundings (2^-24) of the largest depth over the direction's
    /// part, `t` times area without a division by 6 more, and by 3 of `start` itself.
    #[inline(always)]
    pub fn sure_start(&self, extent: f32) -> F {
        let [x, y, z] = self.origin.map(F::abs);
        let largest = F::splat(extent) + x.max(y).max(z);
        let off = (largest * self.inverse.abs() + self.t_min.abs()) * F::splat(super::slab::MARGIN);
        // Of anything larger, moments might overflow.
        let covered = largest.le(F::splat(LARGEST_WITH_MOMENTS));
        F::select(covered, self.t_min - off, F::splat(f32::NEG_INFINITY))
    }

    /// A point (its parts in the order of this space) as the ray sees it. It depends on the ray and
    /// the point alone, so primitives that share a corner share its projection.
    #[inline(always)]
    pub fn project(&self, point: [F; 3]) -> Projected<F> {
        let from =
            [point[0] - self.origin[0], point[1] - self.origin[1], point[2] - self.origin[2]];
        self.project_from_origin(from)
    }

    /// As [`Sheared::project`], of a point that is already relative to the ray's origin.
    #[inline(always)]
    pub fn project_from_origin(&self, from: [F; 3]) -> Projected<F> {
        Projected {
            at: [
                self.shear[0].neg_mul_add(from[2], from[0]),
                self.shear[1].neg_mul_add(from[2], from[1]),
            ],
            depth: from[2],
        }
    }
}

/// A point in sheared space; the ray is at `(0, 0)`.
#[derive(Clone, Copy, Debug)]
pub struct Projected<F> {
    /// Across the ray.
    pub at: [F; 2],
    /// Along the main axis, in scene units.
    pub depth: F,
}
