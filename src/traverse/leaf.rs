//! A leaf in registers: its primitives side by side, and the box of each.

use crate::bvh;
use crate::kernels::Outlines;
use crate::simd::{F32x8, Lanes, each};

/// How many fields a sphere has; all other primitives are points alone.
pub(super) const SPHERE_FIELDS: usize = 4;

/// A leaf of one kind of primitives, taken out of its array: one lane a primitive.
pub(super) struct Leaf<const FIELDS: usize>([F32x8; FIELDS]);

impl<const FIELDS: usize> Leaf<FIELDS> {
    /// The fields as they are.
    #[inline(always)]
    pub(super) fn new(leaf: bvh::Leaf<'_>) -> Self {
        Self(each(|field| F32x8::load(leaf.lanes(field))))
    }

    /// All points relative to `origin`, as each ray that starts there would make them.
    #[inline(always)]
    pub(super) fn seen_from(origin: [F32x8; 3], leaf: bvh::Leaf<'_>) -> Self {
        Self(each(|field| F32x8::load(leaf.lanes(field)) - origin[field % 3]))
    }

    /// The outlines of triangles that are seen from where all rays start; `None` for other primitives.
    #[inline(always)]
    pub(super) fn outlines(&self) -> Option<Outlines> {
        <&[F32x8; 9]>::try_from(self.0.as_slice()).ok().map(Outlines::new)
    }

    /// A field of one primitive.
    #[inline(always)]
    pub(super) fn field(&self, place: usize, field: usize) -> f32 {
        self.0[field].lane(place & 7)
    }
}

/// The boxes of primitives, by their fields.
#[inline(always)]
pub(super) fn boxes<const FIELDS: usize>(lanes: impl Fn(usize) -> F32x8) -> [F32x8; 6] {
    if FIELDS == SPHERE_FIELDS {
        let radius = lanes(3);
        return each(|place| {
            let center = lanes(place % 3);
            if place < 3 { center - radius } else { center + radius }
        });
    }
    let mut bounds: [F32x8; 6] = each(|place| lanes(place % 3));
    for field in 3..FIELDS {
        bounds[field % 3] = Lanes::min(bounds[field % 3], lanes(field));
        bounds[3 + field % 3] = Lanes::max(bounds[3 + field % 3], lanes(field));
    }
    bounds
}
