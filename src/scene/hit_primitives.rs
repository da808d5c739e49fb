//! The primitives at sixteen hits, field by field.
//!
//! They are taken out one by one, unless all lanes hit the same one, which is kept for the next lanes.

use glam::Vec3;

use crate::bvh::Primitive;
use crate::hit::NO_HIT;
use crate::scene::Scene;
use crate::scene::vectors::LANES;
use crate::simd::{F32x16, each};

/// Values of the largest primitive.
pub(super) const FIELDS: usize = 12;
/// Values of the normals at a triangle's corners.
pub(super) const NORMALS: usize = 9;

/// The primitives of sixteen hits, field by field.
pub(super) struct Found {
    /// Corners, or centre and radius.
    pub(super) fields: [F32x16; FIELDS],
    pub(super) triangles: u32,
    pub(super) quads: u32,
    pub(super) spheres: u32,
    /// The lanes whose mesh has normals, and those.
    pub(super) smooth: u32,
    pub(super) normals: [F32x16; NORMALS],
    pub(super) material: [u32; LANES],
    /// The primitive's unit normal, if all hit the same one and it is flat.
    pub(super) shared_normal: Option<Vec3>,
}

/// The primitive that all of the last sixteen hits shared. Neighbours mostly hit the same one next, and
/// finding it and its normal takes longer than all else that is computed of their surfaces.
pub(crate) struct SharedPrimitive {
    geom_id: u32,
    prim_id: u32,
    one: OnePrimitive,
    normal: Option<Vec3>,
}

impl Default for SharedPrimitive {
    /// None that is ever hit.
    fn default() -> Self {
        let one = OnePrimitive {
            kind: Kind::Triangle,
            fields: [0.0; FIELDS],
            normals: None,
            material: 0,
        };
        Self { geom_id: NO_HIT, prim_id: NO_HIT, one, normal: None }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Triangle,
    Quad,
    Sphere,
}

/// What is looked up of a primitive.
struct OnePrimitive {
    kind: Kind,
    fields: [f32; FIELDS],
    normals: Option<[f32; NORMALS]>,
    material: u32,
}

impl Scene {
    /// The primitives of the hits in `mask`, of which there is at least one.
    #[inline(always)]
    pub(super) fn found(
        &self,
        mask: u32,
        (geom_ids, prim_ids): (&[u32; LANES], &[u32; LANES]),
        last: &mut SharedPrimitive,
    ) -> Found {
        let first = mask.trailing_zeros() as usize % LANES;
        let (geom_id, prim_id) = (geom_ids[first], prim_ids[first]);
        let mut others = 0;
        for lane in 0..LANES {
            let differs = (geom_ids[lane] ^ geom_id) | (prim_ids[lane] ^ prim_id);
            others |= u32::from(differs != 0) << lane;
        }
        if others & mask != 0 {
            return self.gathered(mask, (geom_ids, prim_ids));
        }
        if (last.geom_id, last.prim_id) != (geom_id, prim_id) {
            let (one, normal) =
                (self.one_primitive(geom_id, prim_id), self.flat_normal(geom_id, prim_id));
            *last = SharedPrimitive { geom_id, prim_id, one, normal };
        }
        let one = &last.one;
        let of_kind = |kind| if one.kind == kind { mask } else { 0 };
        let normals = one.normals.as_ref();
        Found {
            fields: each(|field| F32x16::splat(one.fields[field])),
            triangles: of_kind(Kind::Triangle),
            quads: of_kind(Kind::Quad),
            spheres: of_kind(Kind::Sphere),
            smooth: if normals.is_some() { mask } else { 0 },
            normals: match normals {
                Some(normals) => each(|field| F32x16::splat(normals[field])),
                None => [F32x16::splat(0.0); NORMALS],
            },
            material: [one.material; LANES],
            shared_normal: last.normal,
        }
    }

    /// The primitives of hits that differ.
    #[inline(always)]
    fn gathered(&self, mask: u32, (geom_ids, prim_ids): (&[u32; LANES], &[u32; LANES])) -> Found {
        let (mut fields, mut normals) = ([[0.0; LANES]; FIELDS], [[0.0; LANES]; NORMALS]);
        let (mut of_kind, mut smooth) = ([0; 3], 0);
        let first = mask.trailing_zeros() as usize % LANES;
        let mut material = [self.geometries[geom_ids[first] as usize].material; LANES];
        let mut rest = mask;
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % LANES;
            let (geom_id, prim_id) = (geom_ids[lane], prim_ids[lane]);
            material[lane] = self.geometries[geom_id as usize].material;
            // Written where they stay: by way of an array a primitive's values take a third longer.
            let kind = self.fields_of(geom_id, prim_id, |field, value| fields[field][lane] = value);
            of_kind[kind as usize] |= 1 << lane;
            if self.normals_of(geom_id, prim_id, |field, value| normals[field][lane] = value) {
                smooth |= 1 << lane;
            }
            rest &= rest - 1;
        }
        let [triangles, quads, spheres] = of_kind;
        Found {
            fields: each(|field| F32x16::new(fields[field])),
            triangles,
            quads,
            spheres,
            smooth,
            normals: each(|field| F32x16::new(normals[field])),
            material,
            shared_normal: None,
        }
    }

    fn one_primitive(&self, geom_id: u32, prim_id: u32) -> OnePrimitive {
        let (mut fields, mut normals) = ([0.0; FIELDS], [0.0; NORMALS]);
        let kind = self.fields_of(geom_id, prim_id, |field, value| fields[field] = value);
        let smooth = self.normals_of(geom_id, prim_id, |field, value| normals[field] = value);
        let material = self.geometries[geom_id as usize].material;
        OnePrimitive { kind, fields, normals: smooth.then_some(normals), material }
    }

    /// Has the corners, or centre and radius, written.
    #[inline(always)]
    fn fields_of(&self, geom_id: u32, prim_id: u32, mut write: impl FnMut(usize, f32)) -> Kind {
        let mut point = |first: usize, point: Vec3| {
            for axis in 0..3 {
                write(first + axis, point[axis]);
            }
        };
        let primitive = self.primitive(geom_id, prim_id);
        match primitive.expect("a hit names a primitive that is in the tree") {
            Primitive::Triangle([a, b, c]) => {
                point(0, a);
                point(3, b);
                point(6, c);
                Kind::Triangle
            }
            Primitive::Quad([a, b, c, d]) => {
                point(0, a);
                point(3, b);
                point(6, c);
                point(9, d);
                Kind::Quad
            }
            Primitive::Sphere(center, radius) => {
                point(0, center);
                write(3, radius);
                Kind::Sphere
            }
        }
    }

    /// Has the normals at a triangle's corners written; false if its mesh has none.
    #[inline(always)]
    fn normals_of(&self, geom_id: u32, prim_id: u32, mut write: impl FnMut(usize, f32)) -> bool {
        let Some(of) = &self.geometries[geom_id as usize].normals else {
            return false;
        };
        for (corner, &index) in of.indices[prim_id as usize].iter().enumerate() {
            let normal = of.normals[index as usize];
            for axis in 0..3 {
                write(3 * corner + axis, normal[axis]);
            }
        }
        true
    }
}
