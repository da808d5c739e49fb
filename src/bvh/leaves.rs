//! The primitives in the order of the leaves: what the kernels read.
//!
//! Layout: one flat array of floats for each kind. The `count` primitives of a leaf that starts at
//! slot `first` lie at `first * FIELDS ..`, field by field: all `count` values of field 0, then all
//! of field 1, and so on. So a leaf is contiguous without padding, one primitive is `FIELDS` loads
//! of one float, and a whole leaf is `FIELDS` loads of eight lanes (the lanes after `count` hold
//! whatever follows; the array ends with enough zeros for that, and the caller masks them).
//!
//! A primitive's *id* is its number over all geometries in the order in which they were added, so
//! ids compare as `(geom_id, prim_id)` do. [`Leaves::slot_of`] leads from an id to its slot.

use glam::Vec3;

use super::node::{Child, MAX_LEAF, PrimKind};
use crate::geometry::Aabb;
use crate::pages::{Fresh, Frozen, Term};

/// Stands in [`Leaves::slot_of`] for a primitive that was dropped (no area, not finite).
pub const DROPPED: u32 = u32::MAX;

/// The largest number of primitives of a scene: a slot, its leaf's count and its place in the leaf
/// share 32 bits.
pub const MAX_PRIMITIVES: u64 = (1 << 26) - 1;

/// The primitives of one kind, `FIELDS` floats each.
#[derive(Clone, Debug, Default)]
pub struct LeafArray<const FIELDS: usize> {
    /// Leaf by leaf, field by field; see the top of this file.
    pub fields: Frozen<f32>,
    /// The id of each slot.
    pub ids: Frozen<u32>,
}

/// A [`LeafArray`] while it is filled.
pub(super) struct FreshArray<const FIELDS: usize> {
    fields: Fresh<f32>,
    ids: Fresh<u32>,
}

/// The three vertices of triangles: `v0.x v0.y v0.z v1.x .. v2.z`.
pub type TriangleLeaves = LeafArray<9>;
/// The four corners of quads in order around them.
pub type QuadLeaves = LeafArray<12>;
/// The centre and the radius of spheres.
pub type SphereLeaves = LeafArray<4>;

impl<const FIELDS: usize> LeafArray<FIELDS> {
    /// How many floats a primitive has.
    pub const FIELDS: usize = FIELDS;

    /// How many primitives there are.
    pub fn len(&self) -> usize {
        self.ids.len()
    }

    /// True if there are none.
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// All fields of one primitive of a leaf.
    #[inline(always)]
    pub fn get(&self, first: u32, count: u32, place: u32) -> [f32; FIELDS] {
        let start = first as usize * FIELDS + place as usize;
        let fields = &self.fields[start..start + (FIELDS - 1) * count as usize + 1];
        std::array::from_fn(|field| fields[field * count as usize])
    }

    /// A leaf of `count` primitives, at most [`MAX_LEAF`].
    #[inline(always)]
    pub fn leaf(&self, first: u32, count: u32) -> Leaf<'_> {
        let start = first as usize * FIELDS;
        // What a compiler must know to see that no load is out of range: 1 to 8 primitives.
        let count = (count.wrapping_sub(1) as usize & (MAX_LEAF - 1)) + 1;
        Leaf { fields: &self.fields[start..start + Self::WINDOW], count }
    }

    /// Where loads of any field of a leaf end at the latest, seen from its start.
    const WINDOW: usize = (FIELDS + 1) * MAX_LEAF;
}

impl<const FIELDS: usize> FreshArray<FIELDS> {
    /// Room for `len` primitives, and for what a load of a whole register may read past the last;
    /// that even for none, since a ray whose margin is infinite enters empty slots too.
    pub(super) fn with_len(len: usize, term: Term) -> Self {
        let window = LeafArray::<FIELDS>::WINDOW;
        Self { fields: Fresh::new(len * FIELDS + window, term), ids: Fresh::new(len, term) }
    }

    /// Cuts the array into parts of so many primitives, to be filled apart.
    pub(super) fn parts(
        &mut self,
        counts: impl Iterator<Item = usize>,
    ) -> Vec<LeafPart<'_, FIELDS>> {
        let (mut fields, mut ids) = (&mut *self.fields, &mut *self.ids);
        let mut first = 0;
        let part = |count: usize| {
            let part = LeafPart {
                fields: fields.split_off_mut(..count * FIELDS).expect("room for all parts"),
                ids: ids.split_off_mut(..count).expect("room for all parts"),
                first,
                used: 0,
            };
            first += count as u32;
            part
        };
        counts.map(part).collect()
    }

    /// The array, once all is filled.
    pub(super) fn freeze(self) -> LeafArray<FIELDS> {
        LeafArray { fields: self.fields.freeze(), ids: self.ids.freeze() }
    }
}

/// One leaf, field by field.
#[derive(Clone, Copy)]
pub struct Leaf<'a> {
    fields: &'a [f32],
    count: usize,
}

impl Leaf<'_> {
    /// A field of all primitives; at least [`MAX_LEAF`] values, those after the leaf's foreign.
    #[inline(always)]
    pub fn lanes(&self, field: usize) -> &[f32] {
        &self.fields[field * self.count..][..MAX_LEAF]
    }
}

/// A part of a [`FreshArray`] that is filled leaf by leaf.
pub(super) struct LeafPart<'a, const FIELDS: usize> {
    fields: &'a mut [f32],
    ids: &'a mut [u32],
    /// The slot of its first primitive in the whole array.
    first: u32,
    used: usize,
}

impl<const FIELDS: usize> LeafPart<'_, FIELDS> {
    /// Appends a leaf of `count` primitives but for its ids: a row for each field. Its first slot.
    #[inline(always)]
    pub(super) fn push_leaf(&mut self, count: u32, rows: &[[f32; MAX_LEAF]; FIELDS]) -> u32 {
        let (start, count) = (self.used, count as usize);
        self.used += count;
        let fields = &mut self.fields[start * FIELDS..];
        // A row is written whole; what is too much is overwritten by what follows.
        if fields.len() >= FIELDS * MAX_LEAF {
            for (field, row) in rows.iter().enumerate() {
                fields[field * count..][..MAX_LEAF].copy_from_slice(row);
            }
        } else {
            for (field, row) in rows.iter().enumerate() {
                fields[field * count..][..count].copy_from_slice(&row[..count]);
            }
        }
        self.first + start as u32
    }

    /// The ids of a leaf.
    #[inline(always)]
    pub(super) fn ids(&mut self, first: u32, count: u32) -> &mut [u32] {
        &mut self.ids[(first - self.first) as usize..][..count as usize]
    }
}

/// A primitive taken out of its leaf: for lookups, and for the scalar reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Primitive {
    /// Three vertices.
    Triangle([Vec3; 3]),
    /// Four corners in order around it.
    Quad([Vec3; 4]),
    /// Centre and radius.
    Sphere(Vec3, f32),
}

/// All primitives of a scene in leaf order.
#[derive(Clone, Debug, Default)]
pub struct Leaves {
    /// Triangles.
    pub triangles: TriangleLeaves,
    /// Quads.
    pub quads: QuadLeaves,
    /// Spheres.
    pub spheres: SphereLeaves,
    /// For each id: slot, the leaf's count less one (3 bits) and the place in the leaf (3 bits),
    /// or [`DROPPED`].
    pub slot_of: Vec<u32>,
}

impl Leaves {
    /// The primitive with this id, of this kind; `None` if it was dropped.
    pub fn primitive(&self, kind: PrimKind, id: u32) -> Option<Primitive> {
        let packed = self.slot_of[id as usize];
        if packed == DROPPED {
            return None;
        }
        let (place, count) = (packed & 7, ((packed >> 3) & 7) + 1);
        let first = (packed >> 6) - place;
        Some(match kind {
            PrimKind::Triangle => {
                Primitive::Triangle(points(&self.triangles.get(first, count, place)))
            }
            PrimKind::Quad => Primitive::Quad(points(&self.quads.get(first, count, place))),
            PrimKind::Sphere => {
                let [x, y, z, radius] = self.spheres.get(first, count, place);
                Primitive::Sphere(Vec3::new(x, y, z), radius)
            }
        })
    }

    /// The leaf of the primitive with this id; an empty slot if it was dropped.
    pub fn leaf_of(&self, id: u32) -> Child {
        let packed = self.slot_of[id as usize];
        if packed == DROPPED {
            return Child::EMPTY;
        }
        let (slot, place, count) = ((packed >> 6) as usize, packed & 7, ((packed >> 3) & 7) + 1);
        let is_in = |ids: &[u32]| ids.get(slot) == Some(&id);
        let kind = if is_in(&self.triangles.ids) {
            PrimKind::Triangle
        } else if is_in(&self.quads.ids) {
            PrimKind::Quad
        } else {
            PrimKind::Sphere
        };
        Child::Leaf { kind, first: slot as u32 - place, count }
    }

    /// The box of a leaf's primitives.
    pub fn bounds_of(&self, leaf: Child) -> Aabb {
        let Child::Leaf { kind, first, count } = leaf else { return Aabb::EMPTY };
        (0..count).fold(Aabb::EMPTY, |bounds, place| {
            bounds.union(match kind {
                PrimKind::Triangle => {
                    Aabb::of_points(&points::<3, 9>(&self.triangles.get(first, count, place)))
                }
                PrimKind::Quad => {
                    Aabb::of_points(&points::<4, 12>(&self.quads.get(first, count, place)))
                }
                PrimKind::Sphere => {
                    let [x, y, z, radius] = self.spheres.get(first, count, place);
                    let center = Vec3::new(x, y, z);
                    Aabb { min: center - radius, max: center + radius }
                }
            })
        })
    }

    /// The memory that the arrays take, in bytes.
    pub fn bytes(&self) -> usize {
        fn array<const FIELDS: usize>(array: &LeafArray<FIELDS>) -> usize {
            array.fields.bytes() + array.ids.bytes()
        }
        array(&self.triangles)
            + array(&self.quads)
            + array(&self.spheres)
            + 4 * self.slot_of.capacity()
    }
}

/// Where primitive `place` of a leaf of `count` is, as [`Leaves::slot_of`] has it.
pub(super) fn packed_slot(first: u32, count: u32, place: u32) -> u32 {
    (first + place) << 6 | (count - 1) << 3 | place
}

fn points<const POINTS: usize, const FIELDS: usize>(fields: &[f32; FIELDS]) -> [Vec3; POINTS] {
    std::array::from_fn(|point| Vec3::from_slice(&fields[3 * point..]))
}
