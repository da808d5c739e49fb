//! Beams: what is known of many rays at once, and whether any of them can meet a box.
//!
//! A beam bounds rays that all run forwards along one axis of the scene: their origins by a box,
//! their slopes across that axis by intervals, their ends by two planes. Slope intervals may span
//! zero and still cull, which intervals of reciprocal directions do not (the idea is that of interval
//! traversal: Wald and others 2006, "Ray Tracing Animated Scenes using Coherent Grid Traversal").
//!
//! Either side may be the one that is the same in all lanes: one beam against eight boxes, or one box
//! against sixteen beams. A beam never turns away a box that one of its rays meets.

use crate::simd::Lanes;

/// The margin in units of the largest coordinate: slopes of up to 8 multiply rounding errors.
const MARGIN: f32 = 4.0 * super::slab::MARGIN;

/// The margin of beams for rays whose origins, and boxes whose coordinates, are at most `extent`
/// away from zero. Infinite where products might overflow: there all boxes are met.
pub fn beam_margin(extent: f32) -> f32 {
    if extent <= super::slab::LARGEST_COORDINATE { extent * MARGIN } else { f32::INFINITY }
}

/// The axes of beams that are tested together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BeamAxes {
    /// The axis along which the rays run.
    pub main: usize,
    /// True if they run towards smaller coordinates: then the main axis is mirrored.
    pub mirrored: bool,
}

impl BeamAxes {
    /// The two axes across, and the main one.
    #[inline(always)]
    pub fn order(self) -> [usize; 3] {
        [(self.main + 1) % 3, (self.main + 2) % 3, self.main]
    }

    /// A point in the order of the beam's axes, the main one mirrored if it is to be.
    #[inline(always)]
    pub fn turn<F: Lanes>(self, point: [F; 3]) -> [F; 3] {
        let [a, b, main] = self.order();
        [point[a], point[b], if self.mirrored { -point[main] } else { point[main] }]
    }

    /// The main part of a point or a direction, mirrored if it is to be.
    #[inline(always)]
    pub fn forward<F: Lanes>(self, point: &[F; 3]) -> F {
        if self.mirrored { -point[self.main] } else { point[self.main] }
    }

    /// The bounds `min.x .. max.z` as minima and maxima in the beam's axes.
    #[inline(always)]
    pub fn turn_box<F: Lanes>(self, bounds: [F; 6]) -> Bounds<F> {
        let [a, b, main] = self.order();
        let (near, far) = (bounds[main], bounds[main + 3]);
        let (near, far) = if self.mirrored { (-far, -near) } else { (near, far) };
        Bounds { min: [bounds[a], bounds[b], near], max: [bounds[a + 3], bounds[b + 3], far] }
    }
}

/// Boxes in the axes of a beam.
#[derive(Clone, Copy, Debug)]
pub struct Bounds<F: Lanes> {
    /// The smallest coordinates.
    pub min: [F; 3],
    /// The largest coordinates.
    pub max: [F; 3],
}

impl<F: Lanes> Bounds<F> {
    /// The lanes in which both have a point in common.
    #[inline(always)]
    pub fn touches(&self, other: &Self) -> F::Mask {
        let along =
            |axis: usize| self.min[axis].le(other.max[axis]) & other.min[axis].le(self.max[axis]);
        along(0) & along(1) & along(2)
    }
}

/// Bounds of rays, lane by lane, in the order of [`BeamAxes::order`].
#[derive(Clone, Copy, Debug)]
pub struct Beam<F: Lanes> {
    /// Where origins are, widened by the margin.
    pub origin: Bounds<F>,
    /// The smallest change across for one step along the main axis.
    pub slope_min: [F; 2],
    /// The largest change across for one step along the main axis.
    pub slope_max: [F; 2],
    /// The first main coordinate at which a ray's range starts, less the margin.
    pub start: F,
}

impl<F: Lanes> Beam<F> {
    /// The boxes that some ray may meet before the main coordinate `end` (the margin added).
    #[inline(always)]
    pub fn meets(&self, boxes: &Bounds<F>, end: F) -> F::Mask {
        let (enter, leave) = (boxes.min[2].max(self.start), boxes.max[2].min(end));
        // Ranges start at or after the origins: no step is backwards.
        let step_min = (enter - self.origin.max[2]).max(F::splat(0.0));
        let step_max = leave - self.origin.min[2];
        let mut apart = enter.gt(leave);
        for across in 0..2 {
            let (slope_min, slope_max) = (self.slope_min[across], self.slope_max[across]);
            let lowest = (slope_min * step_min).min(slope_min * step_max);
            let highest = (slope_max * step_min).max(slope_max * step_max);
            // Asked this way round, a NaN from an overflow keeps the box.
            apart = apart
                | (self.origin.min[across] + lowest).gt(boxes.max[across])
                | boxes.min[across].gt(self.origin.max[across] + highest);
        }
        !apart
    }
}
