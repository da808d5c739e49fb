//! Lays primitives out: from their ids to leaves, in parts of the arrays that threads fill apart.

use std::sync::atomic::{AtomicU32, Ordering};

use rayon::prelude::*;

use super::PrimitiveSource;
use super::leaves::{DROPPED, FreshArray, LeafPart, Leaves, packed_slot};
use super::node::{Child, MAX_LEAF, PrimKind};
use super::primitive::{PrimitiveKey, SignedBox};
use crate::geometry::Spheres;
use crate::pages::Term;

/// The leaves of a tree while they are filled.
pub(super) struct Room {
    triangles: FreshArray<9>,
    quads: FreshArray<12>,
    spheres: FreshArray<4>,
    slot_of: Vec<AtomicU32>,
}

/// The slots of all primitives, as long as they are not known.
pub(super) struct Slots(Vec<AtomicU32>);

impl Slots {
    /// For ids below this.
    pub(super) fn new(ids: usize) -> Self {
        Self((0..ids).into_par_iter().map(|_| AtomicU32::new(DROPPED)).collect())
    }
}

/// A part of the room.
pub(super) struct Layer<'a> {
    slot_of: &'a [AtomicU32],
    triangles: LeafPart<'a, 9>,
    quads: LeafPart<'a, 12>,
    spheres: LeafPart<'a, 4>,
}

/// A leaf that is in its place.
pub(super) struct Laid {
    pub(super) child: Child,
    /// The box around its primitives.
    pub(super) bounds: SignedBox,
    /// Half the surface of all their boxes.
    pub(super) surface: f32,
}

impl Room {
    /// Room for parts with so many primitives of each kind, for that term.
    pub(super) fn new(slots: Slots, counts: &[[usize; 3]], term: Term) -> Self {
        let total = |kind: PrimKind| counts.iter().map(|counts| counts[kind as usize]).sum();
        let [triangles, quads, spheres] = PrimKind::ALL.map(total);
        Self {
            triangles: FreshArray::with_len(triangles, term),
            quads: FreshArray::with_len(quads, term),
            spheres: FreshArray::with_len(spheres, term),
            slot_of: slots.0,
        }
    }

    /// Its parts, by the same counts.
    pub(super) fn layers(&mut self, counts: &[[usize; 3]]) -> Vec<Layer<'_>> {
        let of_kind = |kind: PrimKind| counts.iter().map(move |counts| counts[kind as usize]);
        let triangles = self.triangles.parts(of_kind(PrimKind::Triangle));
        let quads = self.quads.parts(of_kind(PrimKind::Quad));
        let spheres = self.spheres.parts(of_kind(PrimKind::Sphere));
        let slot_of = self.slot_of.as_slice();
        let layer = |((triangles, quads), spheres)| Layer { slot_of, triangles, quads, spheres };
        triangles.into_iter().zip(quads).zip(spheres).map(layer).collect()
    }

    /// The leaves, once all are filled.
    pub(super) fn leaves(self) -> Leaves {
        Leaves {
            triangles: self.triangles.freeze(),
            quads: self.quads.freeze(),
            spheres: self.spheres.freeze(),
            slot_of: self.slot_of.into_iter().map(AtomicU32::into_inner).collect(),
        }
    }
}

/// What a leaf holds of a primitive, and its box.
#[derive(Clone, Copy)]
pub(super) struct Shape {
    key: PrimitiveKey,
    /// Those of its kind, then zeros.
    fields: [f32; 12],
    bounds: SignedBox,
}

impl Shape {
    /// Stands for none.
    pub(super) fn none() -> Self {
        Self { key: PrimitiveKey::default(), fields: [0.0; 12], bounds: SignedBox::empty() }
    }

    #[inline(always)]
    pub(super) fn of(key: PrimitiveKey, source: &impl PrimitiveSource) -> Self {
        let (mut fields, id) = ([0.0; 12], key.id());
        let bounds = match key.kind() {
            PrimKind::Triangle => {
                let corners = source.triangle(id);
                fields[..9].copy_from_slice(corners.map(|corner| corner.to_array()).as_flattened());
                SignedBox::of_points(&corners)
            }
            PrimKind::Quad => {
                let corners = source.quad(id);
                fields.copy_from_slice(corners.map(|corner| corner.to_array()).as_flattened());
                SignedBox::of_points(&corners)
            }
            PrimKind::Sphere => {
                let (center, radius) = source.sphere(id);
                fields[..4].copy_from_slice(&center.extend(radius).to_array());
                SignedBox::of_aabb(&Spheres::bounds_of(center, radius))
            }
        };
        Self { key, fields, bounds }
    }

    pub(super) fn kind(&self) -> PrimKind {
        self.key.kind()
    }
}

impl Layer<'_> {
    /// Lays out a leaf of primitives of one kind, at most [`MAX_LEAF`], in the order of their ids.
    #[inline(always)]
    pub(super) fn leaf(&mut self, shapes: &[Shape]) -> Laid {
        let (kind, count) = (shapes[0].kind(), shapes.len() as u32);
        let (mut bounds, mut surface) = (SignedBox::empty(), 0.0);
        for shape in shapes {
            bounds = bounds.union(shape.bounds);
            surface += shape.bounds.half_area(1.0);
        }
        let places = ranks(shapes);
        let first = match kind {
            PrimKind::Triangle => self.triangles.push_leaf(count, &rows(shapes, &places)),
            PrimKind::Quad => self.quads.push_leaf(count, &rows(shapes, &places)),
            PrimKind::Sphere => self.spheres.push_leaf(count, &rows(shapes, &places)),
        };
        let ids = match kind {
            PrimKind::Triangle => self.triangles.ids(first, count),
            PrimKind::Quad => self.quads.ids(first, count),
            PrimKind::Sphere => self.spheres.ids(first, count),
        };
        for (shape, place) in shapes.iter().zip(places) {
            let id = shape.key.id();
            ids[place as usize] = id;
            self.slot_of[id as usize].store(packed_slot(first, count, place), Ordering::Relaxed);
        }
        Laid { child: Child::Leaf { kind, first, count }, bounds, surface }
    }
}

/// How many have a smaller id than each: its place in a leaf. Without branches, which would be
/// mispredicted all the time.
#[inline(always)]
fn ranks(shapes: &[Shape]) -> [u32; MAX_LEAF] {
    let mut keys = [u32::MAX; MAX_LEAF];
    for (key, shape) in keys.iter_mut().zip(shapes) {
        *key = shape.key.bits();
    }
    let mut ranks = [0; MAX_LEAF];
    for one in keys {
        for (rank, other) in ranks.iter_mut().zip(keys) {
            *rank += u32::from(one < other);
        }
    }
    ranks
}

/// The fields of a leaf, a row for each; what is beyond its primitives means nothing.
#[inline(always)]
fn rows<const FIELDS: usize>(
    shapes: &[Shape],
    places: &[u32; MAX_LEAF],
) -> [[f32; MAX_LEAF]; FIELDS] {
    let mut rows = [[0.0; MAX_LEAF]; FIELDS];
    for (shape, &place) in shapes.iter().zip(places) {
        for (row, field) in rows.iter_mut().zip(shape.fields) {
            row[place as usize % MAX_LEAF] = field;
        }
    }
    rows
}
