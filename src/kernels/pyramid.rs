//! Pyramids: all that a point sees of a parallelogram, and what one primitive does to it.
//!
//! A shadow ray of a point runs inside the pyramid from the point to the light. One primitive against
//! the pyramids of many points says, lane by lane, that no such ray meets it ([`Verdict::missed`]),
//! that every such ray does ([`Verdict::covered`]), or nothing.
//!
//! A verdict speaks for what the primitive's own kernel will find, whatever the sample. It is a sign
//! of a volume: which side of the plane through the point and an edge the four corners of the light
//! lie on. A margin covers the rounding of this file, of the kernel, and of the samples' own
//! positions; a volume within it gives no verdict. Written so that NaN gives none, too.

mod clear;

use super::vectors::{add, cross, dot, sub};
use crate::simd::{LaneMask, Lanes};

/// What is known of a primitive for each point.
#[derive(Clone, Copy, Debug)]
pub struct Verdict<F: Lanes> {
    /// No ray to the light meets the primitive.
    pub missed: F::Mask,
    /// Every ray to the light meets it, before the light.
    pub covered: F::Mask,
}

/// The margin of [`Verdict::missed`] for an edge: a hit keeps the projected corners within the size
/// of the triangle, so their rounding is 2^-22 of that; the rest is the direction's.
const EDGE_MARGIN: f32 = 1.0 / (1 << 17) as f32;
/// The margin for the side on which the triangle shows itself: three edge functions, each wrong by
/// 2^-20 of the squared size, weighted with depths.
const SIDE_MARGIN: f32 = 1.0 / (1 << 15) as f32;
/// The margin of [`Verdict::covered`]: wide, so that weights, and with them `t`, are accurate.
const COVER_MARGIN: f32 = 1.0 / (1 << 10) as f32;
/// How accurate `t` is then, in distances of the farthest corner.
const COVER_DEPTH: f32 = 1.0 / (1 << 8) as f32;
/// Smaller primitives, and nearer ones, have no verdict: products would lose bits below the smallest
/// float.
const SMALLEST: f32 = 1.0e-8;

/// The pyramids of points, one lane each.
#[derive(Clone, Copy, Debug)]
pub struct Pyramids<F: Lanes> {
    /// The points.
    apex: [F; 3],
    /// From the point to the light's corner, and the light's edges.
    corner: [F; 3],
    edges: [[F; 3]; 2],
    /// A bound for any part of a direction, and of the coordinates that it was made from.
    reach: F,
    /// Directions are at least this long.
    shortest: F,
    /// The inner unit normals of the four sides, and how far off each is; NaN if unsure.
    sides: [([F; 3], F); 4],
}

impl<F: Lanes> Pyramids<F> {
    /// The pyramids from `apex` to the light, whose coordinates are at most `extent` away from zero,
    /// as are those of the points. All directions to the light are at least `shortest` long.
    #[inline(always)]
    pub fn new(apex: [F; 3], light: [[f32; 3]; 3], extent: f32, shortest: F) -> Self {
        let [corner, edge_u, edge_v] = light.map(|point| point.map(F::splat));
        let corner = sub(corner, apex);
        let largest = |v: [F; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let length = largest(corner) + largest(edge_u) + largest(edge_v);
        let reach = length + F::splat(extent);
        // The volume of the pyramid tells its inside, if it is sure.
        let volume = dot(corner, cross(edge_u, edge_v));
        let unsure = F::splat(SIDE_MARGIN) * reach * largest(edge_u) * largest(edge_v);
        let sure = volume.abs().gt(unsure);
        let sign = F::select(volume.lt(F::splat(0.0)), F::splat(-1.0), F::splat(1.0));
        let sign = F::select(sure, sign, F::splat(f32::NAN));
        let other = add(add(corner, edge_u), edge_v);
        let side = |from: [F; 3], along: [F; 3], sign: F| {
            let normal = cross(from, along);
            let scale = sign / dot(normal, normal).sqrt();
            let off = reach * largest(along) * scale.abs() * F::splat(EDGE_MARGIN);
            (normal.map(|part| part * scale), off)
        };
        Self {
            apex,
            corner,
            edges: [edge_u, edge_v],
            reach,
            shortest,
            sides: [
                side(corner, edge_u, sign),
                side(other, edge_v, sign),
                side(other, edge_u, -sign),
                side(corner, edge_v, -sign),
            ],
        }
    }

    /// The smallest and the largest product of `normal` with a direction to the light.
    #[inline(always)]
    pub fn products(&self, normal: [F; 3]) -> (F, F) {
        let zero = F::splat(0.0);
        let at_corner = dot(normal, self.corner);
        let (u, v) = (dot(normal, self.edges[0]), dot(normal, self.edges[1]));
        (at_corner + u.min(zero) + v.min(zero), at_corner + u.max(zero) + v.max(zero))
    }

    /// How far [`Pyramids::products`] are off from those with the rays' own directions, at most.
    #[inline(always)]
    pub fn product_error(&self, normal: [F; 3]) -> F {
        self.reach * (normal[0].abs() + normal[1].abs() + normal[2].abs()) * F::splat(EDGE_MARGIN)
    }

    /// A triangle, `v0.x .. v2.z`, `t` of whose hits must not be above `t_max`, which is below 1.
    #[inline(always)]
    pub fn triangle(&self, corners: [[f32; 3]; 3], t_max: f32) -> Verdict<F> {
        // The same differences as in the kernels.
        let [a, b, c] = corners.map(|corner| sub(corner.map(F::splat), self.apex));
        let (ab, ac, bc) = (sub(b, a), sub(c, a), sub(c, b));
        let largest = |v: [F; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let size = largest(ab).max(largest(ac)).max(largest(bc));
        let distance = largest(a).max(largest(b)).max(largest(c));

        let normal = cross(ab, ac);
        let volume = dot(a, normal);
        let size_distance = size * distance;
        let sure = volume.abs().gt(F::splat(SIDE_MARGIN) * size * size_distance)
            & size.gt(F::splat(SMALLEST));
        // Turned so that rays forwards through the triangle have three positive products.
        let sign = F::select(volume.lt(F::splat(0.0)), F::splat(-1.0), F::splat(1.0));
        let [of_ab, of_bc, of_ca] = [cross(a, ab), cross(b, bc), cross(a, ac).map(|part| -part)]
            .map(|edge| {
                let edge = edge.map(|part| part * sign);
                self.products(edge)
            });
        let outside = -(F::splat(EDGE_MARGIN) * size_distance * self.reach);
        let missed = sure & (of_ab.1.lt(outside) | of_bc.1.lt(outside) | of_ca.1.lt(outside));

        let inside = F::splat(COVER_MARGIN) * distance * distance * self.reach;
        let lowest = of_ab.0.min(of_bc.0).min(of_ca.0);
        let mut covered = sure & lowest.gt(inside);
        if covered.any() {
            // `t` is the volume divided by this product.
            let (low, high) = self.products(normal.map(|part| part * sign));
            let before_light = volume.abs().lt(low * F::splat(0.9 * t_max));
            let depth = F::splat(COVER_DEPTH) * distance;
            let after_start = (volume.abs() * self.shortest).gt(depth * high);
            let near = distance.lt(F::splat(4.0) * self.shortest);
            covered = covered & before_light & after_start & near & distance.gt(F::splat(SMALLEST));
        }
        Verdict { missed, covered }
    }

    /// A quad, its corners in order around it: two triangles, as its kernel has it.
    #[inline(always)]
    pub fn quad(&self, [a, b, c, d]: [[f32; 3]; 4], t_max: f32) -> Verdict<F> {
        let (one, other) = (self.triangle([a, b, c], t_max), self.triangle([a, c, d], t_max));
        Verdict { missed: one.missed & other.missed, covered: one.covered | other.covered }
    }

    /// The points whose rays meet no triangle with these corners, whatever it looks like, since one side of
    /// the pyramid has all of them outside. The sides of the triangle, which [`Pyramids::triangle`] asks, do
    /// not tell this of a small triangle close to a large light, nor of one that is seen edge-on.
    #[inline(always)]
    pub fn beside<const CORNERS: usize>(&self, corners: [[f32; 3]; CORNERS]) -> F::Mask {
        let zero = F::splat(0.0);
        let (mut distance, mut highest) = (zero, [F::splat(f32::NEG_INFINITY); 4]);
        for corner in corners {
            let [x, y, z] = sub(corner.map(F::splat), self.apex);
            distance = (x.abs() + y.abs() + z.abs()).max(distance);
            for (highest, (normal, _)) in highest.iter_mut().zip(&self.sides) {
                *highest = highest.max(dot(*normal, [x, y, z]));
            }
        }
        let mut beside = F::mask(0);
        for (highest, (_, off)) in highest.into_iter().zip(self.sides) {
            // Of an unsure side `off` is NaN, and of an overflow the distance is infinite.
            beside = beside | highest.lt(-(distance * (F::splat(EDGE_MARGIN) + off)));
        }
        beside
    }

    /// A sphere, `t` of whose hits must not be above `t_max`, which is below 1.
    #[inline(always)]
    pub fn sphere(&self, center: [f32; 3], radius: f32, t_max: f32) -> Verdict<F> {
        let center = sub(center.map(F::splat), self.apex);
        let distance = center[0].abs() + center[1].abs() + center[2].abs();
        let radius = F::splat(radius);
        let rounding = distance * F::splat(EDGE_MARGIN);
        let mut missed = F::mask(0);
        for (normal, off) in &self.sides {
            let below = -(radius + rounding + distance * *off);
            missed = missed | dot(*normal, center).lt(below);
        }
        // A cone of directions, so all are in it if the four corners are.
        let square = dot(center, center);
        let tangent = square - radius * radius;
        let margin = F::splat(COVER_MARGIN);
        let outside = tangent.gt(square * margin);
        let ends = F::splat(0.9 * t_max) * self.shortest;
        let mut covered = outside & tangent.lt(ends * ends);
        if covered.any() {
            let [u, v] = self.edges;
            let corners = [
                self.corner,
                add(self.corner, u),
                add(self.corner, v),
                add(add(self.corner, u), v),
            ];
            for dir in corners {
                let along = dot(center, dir);
                let needed = tangent * dot(dir, dir) + square * self.reach * self.reach * margin;
                covered = covered & along.gt(F::splat(0.0)) & (along * along).gt(needed);
            }
        }
        Verdict { missed, covered }
    }
}
