//! Cones: rays that all run through one point, the apex, and whether any of them can meet a box.
//!
//! Camera rays start at their apex, shadow rays of a point light end at it, rays off a flat mirror
//! have it behind the mirror. Seen from the apex a box covers a rectangle of slopes, and so does each
//! group of rays: a box and many groups are compared by four numbers. A cone never turns away a box
//! that one of its rays meets.
//!
//! All depths are measured from the apex along the main axis towards the rays' side.

use super::beam::Bounds;
use crate::simd::Lanes;

/// What boxes look like from the apex: intervals of slopes.
#[derive(Clone, Copy, Debug)]
pub struct Footprint<F: Lanes> {
    /// The smallest slopes.
    pub min: [F; 2],
    /// The largest slopes.
    pub max: [F; 2],
}

impl<F: Lanes> Footprint<F> {
    /// The footprint of boxes, and the depths at which they start and end, all widened by `margin`.
    /// Parts of a box behind the apex do not count; a box that is all behind it ends below zero.
    #[inline(always)]
    pub fn new(apex: [F; 3], boxes: &Bounds<F>, margin: F) -> (Self, F, F) {
        // Slopes are at most 8: what is nearer than this stays within one margin of the apex.
        let nearest = margin * F::splat(0.125);
        let wide = margin + margin;
        let start = boxes.min[2] - apex[2] - margin;
        let end = boxes.max[2] - apex[2] + margin;
        let one = F::splat(1.0);
        let (inverse_start, inverse_end) = (one / start.max(nearest), one / end.max(nearest));
        let lowest = |axis: usize| {
            let side = boxes.min[axis] - apex[axis] - wide;
            (side * inverse_start).min(side * inverse_end)
        };
        let highest = |axis: usize| {
            let side = boxes.max[axis] - apex[axis] + wide;
            (side * inverse_start).max(side * inverse_end)
        };
        (Self { min: [lowest(0), lowest(1)], max: [highest(0), highest(1)] }, start, end)
    }

    /// The lanes in which both have no slope in common.
    #[inline(always)]
    pub fn apart(&self, other: &Self) -> F::Mask {
        // Asked this way round, a NaN from an overflow keeps the box.
        (self.min[0].gt(other.max[0]) | other.min[0].gt(self.max[0]))
            | (self.min[1].gt(other.max[1]) | other.min[1].gt(self.max[1]))
    }
}
