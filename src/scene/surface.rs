//! What a hit means: position, normals, material, and where secondary rays start.

use glam::Vec3;

use crate::bvh::Primitive;
use crate::hit::Hit;
use crate::ray::Ray;
use crate::scene::Scene;

/// Half the distance between 1 and the next float.
const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// The surface at a hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point, computed on the primitive and not along the ray.
    pub position: Vec3,
    /// How far each part of `position` may be from the surface as rays from there meet it, at most.
    pub error: Vec3,
    /// The unit normal of the primitive itself. Triangles: `(v1 - v0) x (v2 - v0)`; quads:
    /// `edge_u x edge_v`; spheres: outwards. Not turned towards the ray.
    pub geometric_normal: Vec3,
    /// The unit normal for shading: interpolated where the mesh has normals, on the side of the
    /// geometric one; else that.
    pub shading_normal: Vec3,
    /// The number of the material.
    pub material: u32,
}

impl Surface {
    /// The origin of a ray that leaves the surface along `dir`: moved along the geometric normal
    /// so far that rounding can't put it on the other side (Pharr, Jakob, Humphreys, "Physically
    /// Based Rendering", 4th edition, section 6.8).
    pub fn offset_origin(&self, dir: Vec3) -> Vec3 {
        let normal = self.geometric_normal;
        let distance = normal.abs().dot(self.error);
        let side = if dir.dot(normal) < 0.0 { -distance } else { distance };
        let offset = normal * side;
        let away = |exact: f32, offset: f32| {
            if offset > 0.0 {
                exact.next_up()
            } else if offset < 0.0 {
                exact.next_down()
            } else {
                exact
            }
        };
        let moved = self.position + offset;
        Vec3::new(away(moved.x, offset.x), away(moved.y, offset.y), away(moved.z, offset.z))
    }
}

/// The bound of `operations` roundings in a row, as Higham writes it.
pub(super) fn gamma(operations: f32) -> f32 {
    operations * UNIT_ROUNDOFF / (1.0 - operations * UNIT_ROUNDOFF)
}

impl Scene {
    /// The unit geometric normal of a triangle or quad, as [`Surface::geometric_normal`] has it.
    /// `None` for a sphere, for a triangle that was dropped, and for ids that name nothing.
    pub fn flat_normal(&self, geom_id: u32, prim_id: u32) -> Option<Vec3> {
        match self.primitive(geom_id, prim_id)? {
            Primitive::Triangle([a, b, c]) => Some(normal(b - a, c - a)),
            Primitive::Quad([a, b, _, d]) => Some(normal(b - a, d - a)),
            Primitive::Sphere(..) => None,
        }
    }

    pub(super) fn primitive(&self, geom_id: u32, prim_id: u32) -> Option<Primitive> {
        let geometry = self.geometries.get(geom_id as usize)?;
        if prim_id >= geometry.count {
            return None;
        }
        self.bvh.leaves.primitive(geometry.kind, self.first_ids[geom_id as usize] + prim_id)
    }

    /// The surface at `hit`, which a query gave for `ray`. Panics on a miss, or if the hit is of
    /// another scene.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Surface {
        let geometry = &self.geometries[hit.geom_id as usize];
        let primitive = self.primitive(hit.geom_id, hit.prim_id);
        let primitive = primitive.expect("a hit names a primitive that is in the tree");
        let (u, v) = (hit.u, hit.v);
        let (position, error, geometric_normal) = match primitive {
            Primitive::Triangle([a, b, c]) => {
                let w = 1.0 - u - v;
                let magnitude = (a * w).abs() + (b * u).abs() + (c * v).abs();
                let position = a * w + b * u + c * v;
                let error = magnitude * gamma(9.0) + retest_error(position, &[a, b, c]);
                (position, error, normal(b - a, c - a))
            }
            Primitive::Quad([a, b, c, d]) => {
                let (edge_u, edge_v) = (b - a, d - a);
                let magnitude = a.abs() + (b.abs() + a.abs()) * u + (d.abs() + a.abs()) * v;
                let position = a + edge_u * u + edge_v * v;
                let error = magnitude * gamma(9.0) + retest_error(position, &[a, b, c, d]);
                (position, error, normal(edge_u, edge_v))
            }
            Primitive::Sphere(center, radius) => {
                // Along the ray the point is as wrong as `t`: put it back onto the sphere.
                let out = (ray.at(hit.t) - center).as_dvec3().normalize_or(glam::DVec3::X);
                let position = (center.as_dvec3() + out * f64::from(radius)).as_vec3();
                let normal = out.as_vec3();
                (position, position.abs() * gamma(2.0) + Vec3::splat(radius * gamma(2.0)), normal)
            }
        };
        let shading_normal = match &geometry.normals {
            Some(of) => {
                let [a, b, c] = of.indices[hit.prim_id as usize].map(|i| of.normals[i as usize]);
                let blend = (a * (1.0 - u - v) + b * u + c * v).normalize_or(geometric_normal);
                if blend.dot(geometric_normal) < 0.0 { -blend } else { blend }
            }
            None => geometric_normal,
        };
        let material = geometry.material;
        Surface { position, error, geometric_normal, shading_normal, material }
    }
}

/// How far off its plane a primitive may seem to be to a ray that starts at `position`: the test
/// shears its corners as they lie from there, so the error grows with their distance and does not
/// vanish for a plane such as `y = 0`, on which `position` itself is exact.
fn retest_error(position: Vec3, corners: &[Vec3]) -> Vec3 {
    let reach = corners.iter().map(|corner| (*corner - position).abs().max_element());
    Vec3::splat(reach.fold(0.0, f32::max) * gamma(8.0))
}

/// The unit vector across both, in doubles: the product of two short edges would vanish in floats.
fn normal(a: Vec3, b: Vec3) -> Vec3 {
    a.as_dvec3().cross(b.as_dvec3()).normalize_or(glam::DVec3::Z).as_vec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Mesh, Quads, SceneBuilder, Spheres};

    #[test]
    fn flat_normals_are_those_of_surfaces_and_no_id_panics() {
        let mut builder = SceneBuilder::new();
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, 2.0, 1.0)];
        let indices = vec![[0, 1, 2], [0, 0, 1], [2, 1, 0]];
        builder.add_mesh(Mesh { positions, indices, normals: Vec::new() }, 0);
        builder.add_quads(Quads::one(Vec3::Z, Vec3::Y, Vec3::new(1.0, 0.0, 3.0)), 0);
        builder.add_spheres(Spheres::one(Vec3::ZERO, 1.0), 0);
        let scene = builder.build().unwrap();
        let ray = Ray::new(Vec3::ZERO, Vec3::Z);
        for (geom_id, prim_id) in [(0, 0), (0, 2), (1, 0)] {
            let surface = scene.surface(&ray, &Hit { geom_id, prim_id, ..Hit::MISS });
            assert_eq!(scene.flat_normal(geom_id, prim_id), Some(surface.geometric_normal));
        }
        for (geom_id, prim_id) in [(0, 1), (0, 3), (1, 1), (2, 0), (3, 0), (u32::MAX, u32::MAX)] {
            assert_eq!(scene.flat_normal(geom_id, prim_id), None);
        }
    }
}
