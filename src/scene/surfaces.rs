//! The surfaces at sixteen hits, side by side: what [`super::Surface`] is for one.
//!
//! Each lane has the bits of [`Scene::surface`]: the same operations in the same order, none fused.
//! All is computed for all lanes of a kind at once. Lanes that hit nothing hold numbers without a
//! meaning.

use super::surface::gamma;
use crate::scene::Scene;
use crate::scene::hit_primitives::{FIELDS, Found, NORMALS, SharedPrimitive};
use crate::scene::vectors::{
    LANES, Vectors, across, arrays, dot, doubles, next_towards, normalized_or, unit_or,
};
use crate::simd::{F32x16, Lanes, each};

/// Sixteen rays and what they hit.
pub(crate) struct HitLanes<'a> {
    /// The lanes that hit something, one bit each.
    pub(crate) mask: u32,
    pub(crate) origin: Vectors,
    pub(crate) dir: Vectors,
    pub(crate) t: F32x16,
    pub(crate) u: F32x16,
    pub(crate) v: F32x16,
    pub(crate) prim_id: &'a [u32; LANES],
    pub(crate) geom_id: &'a [u32; LANES],
}

/// What sixteen hits mean; see [`super::Surface`] for the fields.
pub(crate) struct SurfaceLanes {
    pub(crate) position: Vectors,
    pub(crate) error: Vectors,
    pub(crate) geometric_normal: Vectors,
    pub(crate) shading_normal: Vectors,
    /// The number of a material even in lanes that hit nothing.
    pub(crate) material: [u32; LANES],
}

impl SurfaceLanes {
    /// [`super::Surface::offset_origin`] along the geometric normal.
    #[inline(always)]
    pub(crate) fn offset_origin(&self) -> Vectors {
        let normal = &self.geometric_normal;
        let distance = dot(&each(|axis| normal[axis].abs()), &self.error);
        // Written out: a loop over the axes, with one over the lanes in it, would leave all three in memory.
        let [x, y, z] = &self.position;
        [
            moved(*x, normal[0] * distance),
            moved(*y, normal[1] * distance),
            moved(*z, normal[2] * distance),
        ]
    }
}

/// The floats beyond `position + offset`.
#[inline(always)]
fn moved(position: F32x16, offset: F32x16) -> F32x16 {
    let (moved, offset) = ((position + offset).to_array(), offset.to_array());
    let mut away = [0.0; LANES];
    for lane in 0..LANES {
        away[lane] = next_towards(moved[lane], offset[lane]);
    }
    F32x16::new(away)
}

impl Scene {
    /// The surfaces at the hits of `at`, of which there is at least one. `last` is what the call before,
    /// for the same scene, left there.
    #[inline(always)]
    pub(crate) fn surfaces(&self, at: &HitLanes<'_>, last: &mut SharedPrimitive) -> SurfaceLanes {
        let found = self.found(at.mask, (at.geom_id, at.prim_id), last);
        let zero = [F32x16::splat(0.0); 3];
        let mut position = zero;
        let mut error = zero;
        let mut normal = zero;
        let mut put = |lanes: u32, [new_position, new_error, new_normal]: [Vectors; 3]| {
            let mask = F32x16::mask(lanes);
            position = each(|axis| Lanes::select(mask, new_position[axis], position[axis]));
            error = each(|axis| Lanes::select(mask, new_error[axis], error[axis]));
            normal = each(|axis| Lanes::select(mask, new_normal[axis], normal[axis]));
        };
        if found.triangles != 0 {
            put(found.triangles, triangles(at, &found));
        }
        if found.quads != 0 {
            put(found.quads, quads(at, &found));
        }
        if found.spheres != 0 {
            put(found.spheres, spheres(at, &found.fields));
        }
        let mut shading_normal = normal;
        if found.smooth != 0 {
            let mask = F32x16::mask(found.smooth);
            let blended = blended(at, &found.normals, &normal);
            shading_normal = each(|axis| Lanes::select(mask, blended[axis], normal[axis]));
        }
        SurfaceLanes {
            position,
            error,
            geometric_normal: normal,
            shading_normal,
            material: found.material,
        }
    }
}

/// Position, error, normal.
#[inline(always)]
fn triangles(at: &HitLanes<'_>, found: &Found) -> [Vectors; 3] {
    let fields = &found.fields;
    let (a, b, c) = (point(fields, 0), point(fields, 3), point(fields, 6));
    let w = F32x16::splat(1.0) - at.u - at.v;
    let part = |axis: usize| (a[axis] * w, b[axis] * at.u, c[axis] * at.v);
    let position = each(|axis| {
        let (a, b, c) = part(axis);
        a + b + c
    });
    let retest = retest_error(&position, &[a, b, c]);
    let error = each(|axis| {
        let (a, b, c) = part(axis);
        (a.abs() + b.abs() + c.abs()) * F32x16::splat(gamma(9.0)) + retest
    });
    [position, error, flat_normal(found, &from_to(&a, &b), &from_to(&a, &c))]
}

#[inline(always)]
fn quads(at: &HitLanes<'_>, found: &Found) -> [Vectors; 3] {
    let fields = &found.fields;
    let corners = [point(fields, 0), point(fields, 3), point(fields, 6), point(fields, 9)];
    let [a, b, _, d] = &corners;
    let (edge_u, edge_v) = (from_to(a, b), from_to(a, d));
    let position = each(|axis| a[axis] + edge_u[axis] * at.u + edge_v[axis] * at.v);
    let retest = retest_error(&position, &corners);
    let error = each(|axis| {
        let (a, b, d) = (a[axis].abs(), b[axis].abs(), d[axis].abs());
        let magnitude = a + (b + a) * at.u + (d + a) * at.v;
        magnitude * F32x16::splat(gamma(9.0)) + retest
    });
    [position, error, flat_normal(found, &edge_u, &edge_v)]
}

/// The unit normals across two edges: doubles, with a root and divisions, that one primitive needs once.
#[inline(always)]
fn flat_normal(found: &Found, edge_u: &Vectors, edge_v: &Vectors) -> Vectors {
    match found.shared_normal {
        Some(normal) => each(|axis| F32x16::splat(normal[axis])),
        None => across(edge_u, edge_v),
    }
}

#[inline(always)]
fn spheres(at: &HitLanes<'_>, fields: &[F32x16; FIELDS]) -> [Vectors; 3] {
    let (center, radius) = (point(fields, 0), fields[3]);
    let met = each(|axis| at.origin[axis] + at.dir[axis] * at.t);
    let (out, middle, size) = (arrays(&from_to(&center, &met)), arrays(&center), radius.to_array());
    let (mut position, mut normal) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    // Arrays, and loops without branches, so that the compiler makes registers of doubles of it.
    for lane in 0..LANES {
        let unit = unit_or(doubles(&out, lane), [1.0, 0.0, 0.0]);
        for axis in 0..3 {
            let far = f64::from(middle[axis][lane]) + unit[axis] * f64::from(size[lane]);
            position[axis][lane] = far as f32;
            normal[axis][lane] = unit[axis] as f32;
        }
    }
    let position: Vectors = each(|axis| F32x16::new(position[axis]));
    let bound = F32x16::splat(gamma(2.0));
    let error = each(|axis| position[axis].abs() * bound + radius * bound);
    [position, error, each(|axis| F32x16::new(normal[axis]))]
}

/// The interpolated normals, on the side of the primitives' own.
#[inline(always)]
fn blended(at: &HitLanes<'_>, normals: &[F32x16; NORMALS], geometric: &Vectors) -> Vectors {
    let w = F32x16::splat(1.0) - at.u - at.v;
    let of = |corner: usize, axis: usize| normals[3 * corner + axis];
    let sum = each(|axis| of(0, axis) * w + of(1, axis) * at.u + of(2, axis) * at.v);
    let blend = normalized_or(&sum, geometric);
    let turned = Lanes::lt(dot(&blend, geometric), F32x16::splat(0.0));
    each(|axis| Lanes::select(turned, -blend[axis], blend[axis]))
}

#[inline(always)]
fn retest_error<const CORNERS: usize>(position: &Vectors, corners: &[Vectors; CORNERS]) -> F32x16 {
    let mut reach = F32x16::splat(0.0);
    for corner in corners {
        for axis in 0..3 {
            reach = Lanes::max((corner[axis] - position[axis]).abs(), reach);
        }
    }
    reach * F32x16::splat(gamma(8.0))
}

#[inline(always)]
fn from_to(a: &Vectors, b: &Vectors) -> Vectors {
    each(|axis| b[axis] - a[axis])
}

#[inline(always)]
fn point(fields: &[F32x16; FIELDS], first: usize) -> Vectors {
    each(|axis| fields[first + axis])
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::geometry::shapes;
    use crate::hit::Hit;
    use crate::ray::Ray;
    use crate::{Mesh, Quads, SceneBuilder, Spheres};

    /// Smooth and flat triangles, quads, spheres, some of them tiny or far away.
    fn scene() -> Scene {
        let mut builder = SceneBuilder::new();
        for material in 0..4 {
            let _ = builder.add_material(crate::Material::matt(Vec3::splat(material as f32 * 0.1)));
        }
        let ball = shapes::icosphere(2);
        let moved = |by: Vec3, scale: f32| {
            ball.positions.iter().map(|&p| p * scale + by).collect::<Vec<_>>()
        };
        builder.add_mesh(Mesh { positions: moved(Vec3::X * 3.0, 1.0), ..ball.clone() }, 0);
        let flat = Mesh { positions: moved(Vec3::X * -3.0, 1.0), normals: vec![], ..ball.clone() };
        builder.add_mesh(flat, 1);
        let tiny = Mesh { positions: moved(Vec3::Y * 2.0, 1e-3), ..ball.clone() };
        builder.add_mesh(tiny, 2);
        builder.add_spheres(Spheres::one(Vec3::new(0.0, 0.3, 0.2), 0.9), 3);
        builder.add_spheres(Spheres::one(Vec3::ZERO, 400.0), 1);
        builder
            .add_quads(Quads::one(Vec3::new(-5.0, -1.0, 5.0), Vec3::X * 10.0, Vec3::Z * -10.0), 2);
        builder.add_quads(
            Quads::one(
                Vec3::new(-1.0, 1.5, -1.0),
                Vec3::new(2.0, 0.2, 0.0),
                Vec3::new(0.1, 1.0, 2.0),
            ),
            0,
        );
        builder.build().unwrap()
    }

    #[test]
    fn sixteen_surfaces_have_the_bits_of_one() {
        let scene = scene();
        let mut rays = Vec::new();
        let eye = Vec3::new(0.3, 1.1, 7.0);
        let targets = [Vec3::X * 3.0, Vec3::X * -3.0, Vec3::Y * 2.0, Vec3::ZERO, Vec3::Y * 9.0];
        for step in 0..16 * 600 {
            // Neighbours on a spiral, so that lanes hit both one primitive and many.
            let (turn, out) = (step as f32 * 0.7, (step % 960) as f32 * 1.5e-3);
            let (target, spread) =
                (targets[step / 1920], if step % 1920 < 960 { 1.0 } else { 1e-3 });
            let aside = Vec3::new(turn.cos(), turn.sin(), 0.0) * (out * spread);
            rays.push(Ray::new(eye, target + aside - eye));
        }
        let hits: Vec<_> =
            rays.iter().map(|ray| scene.intersect(ray).unwrap_or(Hit::MISS)).collect();
        let (mut kinds, mut last) = ([0; 7], SharedPrimitive::default());
        let mut check = |rays: &[Ray], hits: &[Hit], asked: u32| {
            let lanes = |of: &dyn Fn(usize) -> f32| F32x16::new(std::array::from_fn(of));
            let id = |lane: usize, id: u32| if asked >> lane & 1 != 0 { id } else { u32::MAX };
            let at = HitLanes {
                mask: asked,
                origin: std::array::from_fn(|axis| lanes(&|lane| rays[lane].origin[axis])),
                dir: std::array::from_fn(|axis| lanes(&|lane| rays[lane].dir[axis])),
                t: lanes(&|lane| hits[lane].t),
                u: lanes(&|lane| hits[lane].u),
                v: lanes(&|lane| hits[lane].v),
                prim_id: &std::array::from_fn(|lane| id(lane, hits[lane].prim_id)),
                geom_id: &std::array::from_fn(|lane| id(lane, hits[lane].geom_id)),
            };
            let found = scene.surfaces(&at, &mut last);
            let origin = found.offset_origin();
            for lane in (0..LANES).filter(|lane| asked >> lane & 1 != 0) {
                kinds[hits[lane].geom_id as usize] += 1;
                let one = scene.surface(&rays[lane], &hits[lane]);
                let bits = |vectors: &Vectors| arrays(vectors).map(|part| part[lane].to_bits());
                let of = |vector: Vec3| vector.to_array().map(f32::to_bits);
                assert_eq!(bits(&found.position), of(one.position), "{:?}", hits[lane]);
                assert_eq!(bits(&found.error), of(one.error), "{:?}", hits[lane]);
                assert_eq!(bits(&found.geometric_normal), of(one.geometric_normal));
                assert_eq!(bits(&found.shading_normal), of(one.shading_normal));
                assert_eq!(bits(&origin), of(one.offset_origin(one.geometric_normal)));
                assert_eq!(found.material[lane], one.material);
            }
        };
        for (index, (rays, hits)) in rays.chunks(LANES).zip(hits.chunks(LANES)).enumerate() {
            // Lanes that are not asked for hold ids of nothing.
            check(rays, hits, if index % 3 == 0 { 0x5a5a } else { 0xffff });
        }
        // One primitive in all lanes, then another one of the same mesh.
        for (ray, hit) in rays.iter().zip(&hits).step_by(7) {
            check(&[*ray; LANES], &[*hit; LANES], 0xffff);
        }
        assert!(kinds.iter().filter(|&&hits| hits > 10).count() >= 7, "{kinds:?}");
    }
}
