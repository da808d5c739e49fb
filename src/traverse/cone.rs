//! Cones: a tile whose rays all run through one point.

use super::cull::{Cull, Reach, Slopes};
use crate::kernels::{BeamAxes, Footprint, ScaledRay};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes, each};

/// Groups whose rays all run through the apex; `FAN` if they all start there, exactly.
pub(super) struct Cone<const FAN: bool> {
    /// As the rays run, or against it if they run towards the apex: from the apex to the rays.
    axes: BeamAxes,
    apex: [F32x8; 3],
    /// Where all rays of a fan start, in the scene's axes.
    origin: [F32x8; 3],
    margin: F32x8,
    groups: Footprint<F32x16>,
    whole: Footprint<F32x8>,
    reach: Reach,
}

/// Eight boxes as seen from the apex, field by field.
pub(super) struct Footprints {
    min: [[f32; 8]; 2],
    max: [[f32; 8]; 2],
    start: [f32; 8],
    end: [f32; 8],
}

impl<const FAN: bool> Cone<FAN> {
    /// No rays yet.
    pub(super) fn new() -> Self {
        let (zero, zeros) = (F32x8::ZERO, F32x16::ZERO);
        Self {
            axes: BeamAxes { main: 0, mirrored: false },
            apex: [zero; 3],
            origin: [zero; 3],
            margin: zero,
            groups: Footprint { min: [zeros; 2], max: [zeros; 2] },
            whole: Footprint { min: [zero; 2], max: [zero; 2] },
            reach: Reach::NOWHERE,
        }
    }

    /// Takes the rays of other groups, whose reach `reach` fills in. False if the apex lies amidst them.
    // Within its three callers it made camera rays 3 to 5% slower.
    #[inline(never)]
    pub(super) fn take(
        &mut self,
        axes: BeamAxes,
        apex: [f32; 3],
        origin: [f32; 3],
        slopes: &Slopes,
        reach: impl Fn(&mut Reach),
    ) -> bool {
        reach(&mut self.reach);
        let margin = self.reach.margin;
        let diverge = self.reach.whole_start.lane(0) >= apex[2] - 2.0 * margin;
        let converge = self.reach.whole_end.lane(0) <= apex[2] + 2.0 * margin;
        if !(diverge || converge) {
            return false;
        }
        let ((min, max), (whole_min, whole_max)) = (slopes.lanes(), slopes.whole());
        self.axes = axes;
        self.apex = apex.map(F32x8::splat);
        self.origin = origin.map(F32x8::splat);
        self.margin = F32x8::splat(margin);
        if diverge {
            self.groups = Footprint { min, max };
            self.whole = Footprint { min: whole_min, max: whole_max };
        } else {
            self.axes.mirrored = !axes.mirrored;
            self.apex[2] = -self.apex[2];
            self.groups = Footprint { min: max.map(|s| -s), max: min.map(|s| -s) };
            self.whole = Footprint { min: whole_max.map(|s| -s), max: whole_min.map(|s| -s) };
        }
        true
    }
}

impl<const FAN: bool> Cull for Cone<FAN> {
    type Boxes = Footprints;
    const LOOSE: bool = !FAN;
    const BOUNDED: bool = true;
    const FAN: bool = FAN;

    #[inline(always)]
    fn origin(&self) -> [F32x8; 3] {
        self.origin
    }

    #[inline(always)]
    fn boxes(&self, bounds: [F32x8; 6]) -> (Footprints, u32) {
        let forward = self.reach.axes.turn_box(bounds);
        let (start, end) = (forward.min[2], forward.max[2]);
        let seen = self.axes.turn_box(bounds);
        let (footprint, _, depth) = Footprint::new(self.apex, &seen, self.margin);
        let apart = footprint.apart(&self.whole)
            | Lanes::lt(depth, F32x8::splat(0.0))
            | Lanes::gt(start, self.reach.whole_end)
            | Lanes::gt(self.reach.whole_start, end);
        let boxes = Footprints {
            min: each(|axis| footprint.min[axis].to_array()),
            max: each(|axis| footprint.max[axis].to_array()),
            start: start.to_array(),
            end: end.to_array(),
        };
        (boxes, (!apart).bits())
    }

    #[inline(always)]
    fn groups(&self, boxes: &Footprints, slot: usize) -> (u32, f32) {
        let of = |lanes: &[[f32; 8]; 2]| each(|axis| F32x16::splat(lanes[axis][slot]));
        let footprint = Footprint { min: of(&boxes.min), max: of(&boxes.max) };
        let start = boxes.start[slot];
        let apart = footprint.apart(&self.groups)
            | Lanes::gt(F32x16::splat(start), self.reach.end)
            | Lanes::gt(self.reach.start, F32x16::splat(boxes.end[slot]));
        ((!apart).bits(), start)
    }

    #[inline(always)]
    fn reach(&self, start: f32) -> u32 {
        Lanes::le(F32x16::splat(start), self.reach.end).bits()
    }

    #[inline(always)]
    fn draw_in<F: Lanes>(&mut self, group: usize, ray: &ScaledRay<F>) {
        self.reach.draw_in(group, ray);
    }

    #[inline(always)]
    fn settle(&mut self) {
        self.reach.settle();
    }
}
