//! The geometries of a scene as the builder got them, and as the tree's builder sees them.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use crate::bvh::{BuildPrimitive, DROPPED, Leaves, PrimKind, PrimitiveSource};
use crate::error::BuildError;
use crate::geometry::{Aabb, Mesh, Quads, Spheres};
use crate::scene::Dropped;

/// So many vertices are looked at by a thread in a row.
const CHUNK: usize = 16_384;

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

    /// What was dropped of the primitives of which a tree has these leaves.
    pub(super) fn dropped(&self, leaves: &Leaves) -> Dropped {
        let mut dropped = Dropped::default();
        let kept = leaves.triangles.len() + leaves.quads.len() + leaves.spheres.len();
        if kept < leaves.slot_of.len() {
            let all = (0..).zip(&leaves.slot_of);
            for (id, _) in all.filter(|&(_, &slot)| slot == DROPPED) {
                if is_finite(&self.triangle(id)) {
                    dropped.degenerate += 1;
                } else {
                    dropped.not_finite += 1;
                }
            }
        }
        dropped
    }
}

impl PrimitiveSource for Parts<'_> {
    fn guess(&self) -> Aabb {
        let boxes = self.sources.iter().map(|(source, _)| match source {
            // The centres themselves, by the tree's own formula: the corners of a large ground would make
            // a poor guess, and so would what is rounded in another way.
            Source::Spheres(spheres) => {
                around_each(spheres.len(), |at| spheres.bounds(at).center())
            }
            Source::Quads(quads) => {
                around_each(quads.len(), |at| Aabb::of_points(&quads.corners(at)).center())
            }
            Source::Mesh(mesh) => {
                mesh.positions.par_chunks(CHUNK).map(around_all).reduce(|| Aabb::EMPTY, Aabb::union)
            }
        });
        boxes.fold(Aabb::EMPTY, Aabb::union)
    }

    #[inline(always)]
    fn boxes(&self, first: u32, into: &mut [BuildPrimitive]) {
        let (mut first, mut rest) = (first, into);
        while !rest.is_empty() {
            // As many as are of one geometry.
            let (source, start) = self.find(first);
            let (these, others) = rest.split_at_mut(rest.len().min(source.len() - start));
            let each = these.iter_mut().zip(first..).zip(start..);
            match source {
                Source::Mesh(mesh) => each.for_each(|((one, id), index)| {
                    *one = BuildPrimitive::of_triangle(&mesh.triangle(index), id);
                }),
                Source::Spheres(spheres) => each.for_each(|((one, id), index)| {
                    *one = BuildPrimitive::new(spheres.bounds(index), PrimKind::Sphere, id);
                }),
                Source::Quads(quads) => each.for_each(|((one, id), index)| {
                    let bounds = Aabb::of_points(&quads.corners(index));
                    *one = BuildPrimitive::new(bounds, PrimKind::Quad, id);
                }),
            }
            first += these.len() as u32;
            rest = others;
        }
    }

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

/// The box around some points, or any other if a coordinate is NaN.
fn around(points: impl Iterator<Item = Vec3>) -> Aabb {
    let empty = (Vec4::INFINITY, Vec4::NEG_INFINITY);
    let (min, max) = points.fold(empty, |(min, max), point| {
        let point = point.extend(0.0);
        (min.min(point), max.max(point))
    });
    Aabb { min: min.truncate(), max: max.truncate() }
}

/// The box around so many points, found by all threads.
fn around_each(points: usize, point: impl Fn(usize) -> Vec3 + Sync) -> Aabb {
    let chunk = |chunk: usize| {
        let first = chunk * CHUNK;
        around((first..points.min(first + CHUNK)).map(&point))
    };
    let chunks = (0..points.div_ceil(CHUNK)).into_par_iter().map(chunk);
    chunks.reduce(|| Aabb::EMPTY, Aabb::union)
}

/// As [`around`]: four boxes that are joined at last, since each step on one has to wait for the one before.
fn around_all(points: &[Vec3]) -> Aabb {
    let (fours, others) = points.as_chunks::<4>();
    let empty = (Vec4::INFINITY, Vec4::NEG_INFINITY);
    let mut boxes = [empty; 4];
    for four in fours {
        for ((min, max), point) in boxes.iter_mut().zip(four) {
            let point = point.extend(0.0);
            (*min, *max) = (min.min(point), max.max(point));
        }
    }
    let boxes = boxes.map(|(min, max)| Aabb { min: min.truncate(), max: max.truncate() });
    boxes.into_iter().fold(around(others.iter().copied()), Aabb::union)
}

fn is_finite(corners: &[Vec3; 3]) -> bool {
    corners.iter().all(|corner| corner.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mesh_guesses_the_box_of_its_vertices() {
        for vertices in 0..20 {
            let at = |place: i32| Vec3::new(place as f32, (place * 7 % 11) as f32, -place as f32);
            let positions: Vec<Vec3> = (0..vertices).map(at).collect();
            let expected = Aabb::of_points(&positions);
            let mesh = Source::Mesh(Mesh { positions, ..Mesh::default() });
            let parts = Parts { sources: &[(mesh, 0)], first_ids: &[0] };
            assert_eq!(parts.guess(), expected, "{vertices}");
        }
    }

    #[test]
    fn spheres_and_quads_guess_the_box_of_the_trees_own_centres() {
        let count = CHUNK + 100;
        let at = |place: usize| Vec3::new((place % 97) as f32, place as f32, -1.0) * 0.123;
        let (mut spheres, mut quads) = (Spheres::default(), Quads::default());
        for place in 0..count {
            spheres.push(at(place), 0.3 + place as f32 * 1e-3);
            quads.push(at(place), Vec3::X * 1e4, Vec3::Z * 0.7);
        }
        for source in [Source::Spheres(spheres), Source::Quads(quads)] {
            let parts = Parts { sources: &[(source, 0)], first_ids: &[0] };
            let mut boxes = vec![BuildPrimitive::left_out(); count];
            parts.boxes(0, &mut boxes);
            let centers: Vec<Vec3> = boxes.iter().map(|one| one.bounds().center()).collect();
            assert_eq!(parts.guess(), Aabb::of_points(&centers));
        }
    }
}
