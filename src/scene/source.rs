//! The geometries of a scene as the builder got them, and as the tree's builder sees them.

use glam::Vec3;
use rayon::prelude::*;

use crate::bvh::{BuildPrimitive, PrimKind, PrimitiveSource};
use crate::error::BuildError;
use crate::geometry::{Aabb, Mesh, Quads, Spheres};
use crate::scene::Dropped;

/// One geometry as it was added.
#[derive(Clone, Debug)]
pub(super) enum Source {
    Spheres(Spheres),
    Quads(Quads),
    Mesh(Mesh),
}

impl Source {
    pub(super) fn kind(&self) -> PrimKind {
        match self {
            Self::Spheres(_) => PrimKind::Sphere,
            Self::Quads(_) => PrimKind::Quad,
            Self::Mesh(_) => PrimKind::Triangle,
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::Spheres(spheres) => spheres.len(),
            Self::Quads(quads) => quads.len(),
            Self::Mesh(mesh) => mesh.len(),
        }
    }

    pub(super) fn validate(&self, geom_id: u32) -> Result<(), BuildError> {
        match self {
            Self::Spheres(spheres) => spheres.validate(geom_id),
            Self::Quads(quads) => quads.validate(geom_id),
            Self::Mesh(mesh) => mesh.validate(geom_id),
        }
    }
}

/// The geometries as the tree's builder sees them.
pub(super) struct Parts<'a> {
    pub(super) sources: &'a [(Source, u32)],
    /// The id of the first primitive of each.
    pub(super) first_ids: &'a [u32],
}

impl Parts<'_> {
    /// The geometry that a primitive belongs to, and its number there.
    #[inline(always)]
    fn find(&self, id: u32) -> (&Source, usize) {
        let geometry = self.first_ids.partition_point(|&first| first <= id) - 1;
        (&self.sources[geometry].0, (id - self.first_ids[geometry]) as usize)
    }

    /// The boxes of all `count` primitives but those that are to be dropped.
    pub(super) fn primitives(&self, count: usize) -> (Vec<BuildPrimitive>, Dropped) {
        let mut all = Vec::new();
        (0..count as u32).into_par_iter().map(|id| self.boxed(id)).collect_into_vec(&mut all);
        let left_out = all.par_iter().filter(|one| one.is_left_out()).count();
        let mut dropped = Dropped::default();
        if left_out > 0 {
            for id in (0..count as u32).filter(|&id| all[id as usize].is_left_out()) {
                if is_finite(&self.triangle(id)) {
                    dropped.degenerate += 1;
                } else {
                    dropped.not_finite += 1;
                }
            }
            all.retain(|one| !one.is_left_out());
        }
        (all, dropped)
    }

    #[inline(always)]
    fn boxed(&self, id: u32) -> BuildPrimitive {
        let (source, index) = self.find(id);
        let bounds = match source {
            Source::Spheres(spheres) => spheres.bounds(index),
            Source::Quads(quads) => Aabb::of_points(&quads.corners(index)),
            Source::Mesh(mesh) => return BuildPrimitive::of_triangle(&mesh.triangle(index), id),
        };
        BuildPrimitive::new(bounds, source.kind(), id)
    }
}

impl PrimitiveSource for Parts<'_> {
    #[inline(always)]
    fn triangle(&self, id: u32) -> [Vec3; 3] {
        match self.find(id) {
            (Source::Mesh(mesh), index) => mesh.triangle(index),
            _ => unreachable!("primitive {id} is no triangle"),
        }
    }

    fn quad(&self, id: u32) -> [Vec3; 4] {
        match self.find(id) {
            (Source::Quads(quads), index) => quads.corners(index),
            _ => unreachable!("primitive {id} is no quad"),
        }
    }

    fn sphere(&self, id: u32) -> (Vec3, f32) {
        match self.find(id) {
            (Source::Spheres(spheres), index) => (spheres.center(index), spheres.radius[index]),
            _ => unreachable!("primitive {id} is no sphere"),
        }
    }
}

fn is_finite(corners: &[Vec3; 3]) -> bool {
    corners.iter().all(|corner| corner.is_finite())
}
