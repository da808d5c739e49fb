//! The primitives of a leaf as the shadow traversals read them: only what is asked for is loaded.

use crate::bvh::{self, LeafArray};
use crate::simd::{F32x8, Lanes, each};

/// The fields of a sphere: its centre and its radius.
const SPHERE_FIELDS: usize = 4;

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
        if FIELDS == SPHERE_FIELDS {
            let radius = self.lanes(3);
            return each(|place| {
                let center = self.lanes(place % 3);
                if place < 3 { center - radius } else { center + radius }
            });
        }
        let mut bounds: [F32x8; 6] = each(|place| self.lanes(place % 3));
        for field in 3..FIELDS {
            let lanes = self.lanes(field);
            bounds[field % 3] = Lanes::min(bounds[field % 3], lanes);
            bounds[3 + field % 3] = Lanes::max(bounds[3 + field % 3], lanes);
        }
        bounds
    }

    /// The fields of one primitive.
    #[inline(always)]
    pub(super) fn primitive(&self, place: usize) -> [f32; FIELDS] {
        each(|field| self.fields.lanes(field)[place & 7])
    }
}
