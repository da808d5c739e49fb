//! What rays in no order may have in common: a point near which all of them start, or end.
//!
//! Rays of one camera and rays towards one light run alike if they leave that point alike, in whatever
//! order they come. A direction is two coordinates on the faces of an octahedron, unfolded so that the
//! rays' main direction is in the middle (Cigolle and others 2014, "A Survey of Efficient
//! Representations for Independent Unit Vectors"); a key is its cell's number along Morton's curve.

use glam::{Vec2, Vec3};

use super::strewn::{LARGEST_SHARE, LOOKS, bounds, run};
use crate::batch_rays::BatchRays;
use crate::ray::RayBatch;
use crate::rows::BLOCK;

/// Fewer rays are left as they come. Camera rays and shadow rays of bunny, atrium and terrain, shuffled,
/// over unsorted ones: 2^16 rays 1.11, 0.91, 0.95 and 1.28, 1.34, 1.23; 2^18 1.38, 1.23, 1.39 and 1.51, 1.51,
/// 1.46; 2^22 1.52, 2.12, 2.36 and 1.87, 2.00, 2.30.
const FEWEST: usize = 1 << 17;

/// Starts that are spread by at most this share of the scene's size are near one point.
const NEAR_START: f32 = 1.0 / 64.0;

/// So are ends that are spread by at most this share of what the starts are.
const NEAR_END: f32 = 0.25;

/// The bits of a key.
pub(super) const KEY_BITS: u32 = 2 * AXIS_BITS;
const AXIS_BITS: u32 = 11;

/// Rays that all run through about one point.
#[derive(Debug)]
pub(super) struct Pencil {
    /// Where all rays end; `None` if they share their start.
    end: Option<Vec3>,
    /// The axes of the scene as the octahedron has them, the last one through its middle.
    order: [usize; 3],
    mirrored: bool,
    /// What of the octahedron is in use.
    low: Vec2,
    scale: f32,
}

impl Pencil {
    /// The pencil of rays that come in no order in a scene of that size; `None` if they have an order, are
    /// few, or have no such point.
    pub(super) fn of(rays: &BatchRays<'_>, size: f32) -> Option<Self> {
        if rays.len() < FEWEST || u32::try_from(rays.len()).is_err() {
            return None;
        }
        let looks = || looks(rays.len());
        let starts = bounds(looks().map(|index| rays.get(index).origin));
        let ends = bounds(looks().map(|index| {
            let ray = rays.get(index);
            ray.origin + ray.dir * ray.t_max
        }));
        let spread = |(low, high): (Vec3, Vec3)| (high - low).max_element();
        // Asked this way round, a NaN or an infinity is no point.
        let end = if spread(starts) <= NEAR_START * size {
            None
        } else if spread(ends) <= NEAR_END * spread(starts) {
            Some(0.5 * (ends.0 + ends.1))
        } else {
            return None;
        };
        let mut pencil =
            Self { end, order: [0, 1, 2], mirrored: false, low: Vec2::ZERO, scale: 1.0 };
        let sum: Vec3 = looks()
            .map(|index| pencil.direction(rays, index).normalize_or_zero())
            .filter(|dir| dir.is_finite())
            .sum();
        let main = (0..3).max_by(|&a, &b| sum[a].abs().total_cmp(&sum[b].abs()))?;
        pencil.order = [(main + 1) % 3, (main + 2) % 3, main];
        pencil.mirrored = sum[main] < 0.0;

        let place = |index: usize| Vec3::from((pencil.place(pencil.direction(rays, index)), 0.0));
        let (low, high) = bounds(looks().map(place));
        let whole = spread((low, high));
        let shares = (0..LOOKS).map(|look| spread(bounds(run(look, rays.len()).map(place))));
        // False as well if all run alike, or none is any good.
        let strewn = shares.sum::<f32>() > LARGEST_SHARE * LOOKS as f32 * whole;
        let scale = ((1 << AXIS_BITS) as f32) / whole;
        strewn.then_some(Self { low: low.truncate(), scale, ..pencil })
    }

    /// Some of the rays, run by run: enough to tell how all of them are.
    pub(super) fn sample(rays: &BatchRays<'_>) -> RayBatch {
        looks(rays.len()).map(|index| rays.get(index)).collect()
    }

    /// Gives each ray its key, [`KEY_BITS`] bits. A ray without a direction has any key.
    pub(super) fn keys(&self, rays: &BatchRays<'_>, keys: &mut [u32]) {
        // Without an end, directions are from no other point.
        let from = self.end.unwrap_or(Vec3::ZERO);
        let from = self.order.map(|axis| from[axis]);
        for (number, keys) in keys.chunks_mut(BLOCK).enumerate() {
            let block = rays.block(self.end.is_some(), number * BLOCK, keys.len());
            let [x, y, z] = self.order.map(|axis| &block[axis]);
            let mut all = [0; BLOCK];
            // Always as many as there are lanes, and without branches: the compiler takes registers.
            for lane in 0..BLOCK {
                let dir = [x[lane] - from[0], y[lane] - from[1], z[lane] - from[2]];
                let [u, v] = self.unfold(dir);
                let (u, v) = ((u - self.low.x) * self.scale, (v - self.low.y) * self.scale);
                all[lane] = spread_bits(whole_number(u)) | spread_bits(whole_number(v)) << 1;
            }
            match keys.first_chunk_mut() {
                Some(keys) => *keys = all,
                None => keys.copy_from_slice(&all[..keys.len()]),
            }
        }
    }

    /// Where a ray leaves the point.
    fn direction(&self, rays: &BatchRays<'_>, index: usize) -> Vec3 {
        let ray = rays.get(index);
        self.end.map_or(ray.dir, |end| ray.origin - end)
    }

    /// The same on the octahedron, from -1 to 1.
    fn place(&self, dir: Vec3) -> Vec2 {
        self.unfold(self.order.map(|axis| dir[axis])).into()
    }

    /// Likewise, in the octahedron's order of axes.
    #[inline(always)]
    fn unfold(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let z = if self.mirrored { -z } else { z };
        let inverse = 1.0 / (x.abs() + y.abs() + z.abs());
        let (u, v) = (x * inverse, y * inverse);
        let beyond = |of: f32, other: f32| (1.0 - other.abs()).copysign(of);
        let folded = [beyond(u, v), beyond(v, u)];
        [if z < 0.0 { folded[0] } else { u }, if z < 0.0 { folded[1] } else { v }]
    }
}

/// The rays of all looks.
fn looks(rays: usize) -> impl Iterator<Item = usize> {
    (0..LOOKS).flat_map(move |look| run(look, rays))
}

/// Rounded, from 0 to the largest that fits; NaN is 0. The bits below 2^23 are the number, which a
/// register of lanes can do; it can't cast.
#[inline(always)]
fn whole_number(value: f32) -> u32 {
    let most = ((1 << AXIS_BITS) - 1) as f32;
    (value.max(0.0).min(most) + 8_388_608.0).to_bits() & ((1 << AXIS_BITS) - 1)
}

/// Puts a zero after each of the bits.
#[inline(always)]
fn spread_bits(bits: u32) -> u32 {
    let bits = (bits | bits << 8) & 0x00ff_00ff;
    let bits = (bits | bits << 4) & 0x0f0f_0f0f;
    let bits = (bits | bits << 2) & 0x3333_3333;
    (bits | bits << 1) & 0x5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;

    /// Rays in rows; the numbers are strewn if they are multiplied by `step`.
    fn rays(step: usize, ray: impl Fn(Vec3) -> Ray) -> RayBatch {
        let at = |index: usize| {
            let number = index * step % FEWEST;
            let (row, column) = (number / 512, number % 512);
            Vec3::new(column as f32 / 512.0 - 0.5, row as f32 / 256.0 - 0.5, 1.0)
        };
        (0..FEWEST).map(|index| ray(at(index))).collect()
    }

    #[test]
    fn strewn_rays_of_one_start_or_end_are_found() {
        let start = Vec3::new(3.0, -1.0, 0.5);
        let far = f32::INFINITY;
        let ray = |origin, dir, t_max| Ray { origin, dir, t_min: 0.0, t_max };
        let camera = |at: Vec3| ray(start, -at, far);
        let shadow = |at: Vec3| ray(at, (start - at) * 2.0, 0.5);
        let parallel = |at: Vec3| ray(at, Vec3::Z, far);
        let is_found = |rays: RayBatch| Pencil::of(&rays.as_rays().into(), 1.0).is_some();
        for (name, step, found) in [("rows", 1, false), ("strewn", 40_503, true)] {
            assert_eq!(is_found(rays(step, camera)), found, "camera, {name}");
            assert_eq!(is_found(rays(step, shadow)), found, "shadow, {name}");
            assert!(!is_found(rays(step, parallel)), "parallel, {name}");
        }
        let mut bad = rays(40_503, camera);
        bad.origin_x[3] = f32::NAN;
        (bad.dir_x[5], bad.dir_y[6]) = (f32::NAN, f32::INFINITY);
        assert!(is_found(bad));
        assert!(!is_found(rays(40_503, |_| ray(start, Vec3::NAN, far))));
        assert!(!is_found(rays(40_503, |_| ray(start, Vec3::Y, far))));
    }

    #[test]
    fn rays_with_neighbouring_keys_run_alike() {
        for middle in [Vec3::X, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
            let (right, up) = middle.any_orthonormal_pair();
            let dir = |at: Vec3| right * at.x + up * at.y + middle;
            let camera = |at: Vec3| Ray::new(Vec3::ZERO, dir(at));
            let rays = rays(40_503, camera);
            let pencil = Pencil::of(&rays.as_rays().into(), 1.0).expect("a pencil");
            let mut keys = vec![0; FEWEST];
            pencil.keys(&rays.as_rays().into(), &mut keys);
            let mut order: Vec<usize> = (0..FEWEST).collect();
            order.sort_by_key(|&index| keys[index]);
            let dir = |index: usize| rays.as_rays().get(order[index]).dir;
            let steps: f32 = (1..FEWEST).map(|index| dir(index).distance(dir(index - 1))).sum();
            assert!(steps < 0.01 * FEWEST as f32, "{middle}: {steps}");
        }
    }
}
