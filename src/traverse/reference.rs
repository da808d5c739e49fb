//! The scalar reference: plain loops over all primitives, one ray, `glam` and nothing else.
//!
//! It shares no code with the kernels and the traversals, on purpose: tests hold every fast path
//! equal to it, bit for bit. What it computes is the numerical contract of `ARCHITECTURE.md`: the
//! operations and their order are the same as in the kernels, because the bits depend on them.

use glam::{DVec3, Vec3};

use super::Closest;
use crate::bvh::{Leaves, PrimKind, Primitive};
use crate::ray::Ray;

/// The closest hit of `ray` over all primitives: smallest `t`, at equal `t` the smallest id.
pub fn intersect(
    leaves: &Leaves,
    kinds: impl Iterator<Item = (u32, PrimKind)>,
    ray: &Ray,
) -> Option<Closest> {
    let ray = Scaled::new(ray)?;
    let mut best: Option<Closest> = None;
    for (id, kind) in kinds {
        let Some(primitive) = leaves.primitive(kind, id) else { continue };
        if let Some((t, u, v)) = ray.meet(&primitive)
            && best.is_none_or(|best| t < best.t || (t == best.t && id < best.id))
        {
            best = Some(Closest { t, u, v, id });
        }
    }
    best.map(|best| Closest { t: best.t * ray.scale, ..best })
}

/// A ray whose direction is scaled by a power of two, so that its largest part is from 1 to 2.
struct Scaled {
    origin: Vec3,
    dir: Vec3,
    t_min: f32,
    t_max: f32,
    scale: f32,
}

impl Scaled {
    /// `None` for a ray that misses everything by definition.
    fn new(ray: &Ray) -> Option<Self> {
        let largest = ray.dir.abs().max_element();
        let usable = ray.origin.is_finite() && ray.dir.is_finite() && largest > 0.0;
        if !usable || ray.t_min.is_nan() || ray.t_max.is_nan() || ray.t_min > ray.t_max {
            return None;
        }
        // The scale and its inverse must both be ordinary powers of two.
        let exponent = (f64::from(largest).log2().floor() as i32).clamp(-126, 126);
        let exponent =
            if 2_f64.powi(exponent) > f64::from(largest) { exponent - 1 } else { exponent };
        let exponent = exponent.clamp(-126, 126);
        let (scale, inverse) = (2_f32.powi(-exponent), 2_f64.powi(exponent) as f32);
        Some(Self {
            // Makes -0 and 0 one origin.
            origin: ray.origin + Vec3::ZERO,
            dir: ray.dir * scale,
            // No hit is at infinity: not along the scaled ray, and not along the caller's.
            t_min: finite(finite(ray.t_min) * inverse),
            t_max: finite(finite(ray.t_max) * inverse),
            scale,
        })
    }

    fn meet(&self, primitive: &Primitive) -> Option<(f32, f32, f32)> {
        let (t, u, v) = match primitive {
            Primitive::Triangle(vertices) => self.meet_triangle(vertices)?,
            Primitive::Quad(corners) => self.meet_quad(corners)?,
            Primitive::Sphere(center, radius) => return self.meet_sphere(*center, *radius),
        };
        (t >= self.t_min && t <= self.t_max).then_some((t, u, v))
    }

    /// The axis along which the ray runs most (the first of equals), and the two after it.
    fn axes(&self) -> (usize, usize, usize) {
        let length = self.dir.abs();
        let main = if length.x >= length.y && length.x >= length.z {
            0
        } else if length.y >= length.z {
            1
        } else {
            2
        };
        ((main + 1) % 3, (main + 2) % 3, main)
    }

    /// A point in the space in which the ray starts at the origin and runs along the third axis;
    /// the third coordinate is left in scene units.
    fn sheared(&self, point: Vec3) -> Vec3 {
        let (x, y, main) = self.axes();
        let shear = 1.0 / self.dir[main];
        let from = point - self.origin;
        Vec3::new(
            (-(self.dir[x] * shear)).mul_add(from[main], from[x]),
            (-(self.dir[y] * shear)).mul_add(from[main], from[y]),
            from[main],
        )
    }

    /// Watertight triangles (Woop, Benthin, Wald 2013) with accurate edge functions.
    fn meet_triangle(&self, vertices: &[Vec3; 3]) -> Option<(f32, f32, f32)> {
        let [a, b, c] = vertices.map(|vertex| self.sheared(vertex));
        let weights = [cross(c, b), cross(a, c), cross(b, a)];
        if !(weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0)) {
            return None;
        }
        let area = weights[0] + weights[1] + weights[2];
        if !(SMALLEST_AREA..=LARGEST_AREA).contains(&area.abs()) {
            return None;
        }
        let inverse = 1.0 / area;
        let [w, u, v] = weights.map(|weight| weight * inverse);
        let depth = w.mul_add(a.z, u.mul_add(b.z, v * c.z));
        Some((depth * self.inverse_main(), u, v))
    }

    /// The triangle of the first three corners, else that of the first, third and fourth.
    fn meet_quad(&self, corners: &[Vec3; 4]) -> Option<(f32, f32, f32)> {
        let [a, b, c, d] = corners.map(|corner| self.sheared(corner));
        let diagonal = cross(c, a);
        let halves = [
            ([cross(b, c), diagonal, cross(a, b)], b.z, true),
            ([cross(c, d), -diagonal, cross(d, a)], d.z, false),
        ];
        for ([weight_a, weight_own, weight_c], own_depth, is_first) in halves {
            let weights = [weight_a, weight_own, weight_c];
            if !(weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0)) {
                continue;
            }
            let area = weight_a + weight_own + weight_c;
            if !(SMALLEST_AREA..=LARGEST_AREA).contains(&area.abs()) {
                continue;
            }
            let inverse = 1.0 / area;
            let [of_a, of_own, of_c] = weights.map(|weight| weight * inverse);
            let depth = of_a.mul_add(a.z, of_own.mul_add(own_depth, of_c * c.z));
            let t = depth * self.inverse_main();
            let (one, both) = (of_c, of_c + of_own);
            return Some(if is_first { (t, both, one) } else { (t, one, both) });
        }
        None
    }

    /// The smallest root in range of the stable quadratic, in doubles.
    fn meet_sphere(&self, center: Vec3, radius: f32) -> Option<(f32, f32, f32)> {
        let (dir, radius) = (self.dir.as_dvec3(), f64::from(radius));
        let from: DVec3 = self.origin.as_dvec3() - center.as_dvec3();
        let a = dot(dir, dir);
        let b = -dot(from, dir);
        // The point of the ray's line next to the centre: its distance decides without cancellation.
        let next = from + dir * (b / a);
        let rest = radius * radius - dot(next, next);
        if rest.is_nan() || rest < 0.0 {
            return None;
        }
        let root = (rest * a).sqrt();
        let c = dot(from, from) - radius * radius;
        let q = b + root.copysign(b);
        let (one, other) = ((c / q) as f32, (q / a) as f32);
        let in_range = |t: f32| t >= self.t_min && t <= self.t_max;
        [one.min(other), one.max(other)].into_iter().find(|&t| in_range(t)).map(|t| (t, 0.0, 0.0))
    }

    fn inverse_main(&self) -> f32 {
        1.0 / self.dir[self.axes().2]
    }
}

/// Triangles and quads that are seen smaller than this are missed: products of their sides would
/// lose bits below the smallest float.
const SMALLEST_AREA: f32 = 1.0e-30;

/// Those seen larger are missed too: the inverse of the area would lose bits.
const LARGEST_AREA: f32 = 1.0 / f32::MIN_POSITIVE;

/// `a.x * b.y - a.y * b.x` within 1.5 units in the last place (Kahan), so its sign is exact.
fn cross(a: Vec3, b: Vec3) -> f32 {
    let product = a.y * b.x;
    let error = (-a.y).mul_add(b.x, product);
    let difference = a.x.mul_add(b.y, -product);
    difference + error
}

fn finite(t: f32) -> f32 {
    t.clamp(f32::MIN, f32::MAX)
}

/// Summed in the order x, y, z.
fn dot(a: DVec3, b: DVec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}
