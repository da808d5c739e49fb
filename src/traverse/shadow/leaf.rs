//! The primitives of a leaf as the shadow traversals read them: only what is asked for is loaded.

use crate::bvh::{self, LeafArray};
use crate::simd::{F32x8, Lanes, each};
use crate::traverse::leaf::boxes;

/// Up to eight primitives of one kind.
pub(super) struct Leaf<'a, const FIELDS: usize> {
    fields: bvh::Leaf<'a>,
    pub(super) count: u32,
}

impl<'a, const FIELDS: usize> Leaf<'a, FIELDS> {
    #[inline(always)]
    pub(super) fn new(array: &'a LeafArray<FIELDS>, first: u32, count: u32) -> Self {
        Self { fields: array.leaf(first, count), count }
    }

    /// A field of all primitives; the lanes after the last hold something.
    #[inline(always)]
    pub(super) fn lanes(&self, field: usize) -> F32x8 {
        F32x8::load(self.fields.lanes(field))
    }

    /// The boxes of the primitives.
    #[inline(always)]
    pub(super) fn bounds(&self) -> [F32x8; 6] {
        boxes::<FIELDS>(|field| self.lanes(field))
    }

    /// The fields of one primitive.
    #[inline(always)]
    pub(super) fn primitive(&self, place: usize) -> [f32; FIELDS] {
        each(|field| self.fields.lanes(field)[place & 7])
    }
}
