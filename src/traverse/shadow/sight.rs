//! What an apex sees: the shafts of groups whose rays all start at one point.
//!
//! Seen from the apex a box is a rectangle of slopes, and so is each group: four comparisons keep
//! them apart, where beams ([`super::shafts`]) take ten times as many steps.

use super::group::Aim;
use super::shafts::{Beams, Cull, GROUPS, overlaps};
use crate::kernels::{BeamAxes, Bounds, Footprint};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes, each};

/// Up to sixteen groups around an apex.
pub(super) struct Sight {
    /// From the apex to the groups' other ends.
    axes: BeamAxes,
    apex: [F32x8; 3],
    margin: F32x8,
    groups: Footprint<F32x16>,
    all: Footprint<F32x8>,
    /// How far each group reaches from the apex.
    reach: F32x16,
    farthest: F32x8,
}

/// Eight boxes as the apex sees them.
pub(super) struct Footprints {
    min: [[f32; 8]; 2],
    max: [[f32; 8]; 2],
    start: [f32; 8],
}

impl Sight {
    /// For rays that all start at `apex`.
    pub(super) fn from_point(aim: &Aim, apex: [f32; 3], beams: &Beams) -> Self {
        let apex = aim.axes.turn(apex);
        let reach = F32x16::splat(aim.end - apex[2]);
        let (min, max) = beams.slopes();
        Self::new(aim, aim.axes, apex, Footprint { min, max }, reach)
    }

    fn new(
        aim: &Aim,
        axes: BeamAxes,
        apex: [f32; 3],
        groups: Footprint<F32x16>,
        reach: F32x16,
    ) -> Self {
        let all = Footprint {
            min: groups.min.map(|lanes| F32x8::splat(lanes.reduce_min())),
            max: groups.max.map(|lanes| F32x8::splat(lanes.reduce_max())),
        };
        Self {
            axes,
            apex: apex.map(F32x8::splat),
            margin: F32x8::splat(aim.margin),
            groups,
            all,
            reach,
            farthest: F32x8::splat(reach.reduce_max()),
        }
    }
}

impl Cull for Sight {
    type Boxes = Footprints;

    #[inline(always)]
    fn boxes(&self, bounds: [F32x8; 6]) -> (Footprints, [u32; 2]) {
        let turned = self.axes.turn_box(bounds);
        let near = overlaps(
            &turned,
            &Bounds {
                min: each(|axis| self.apex[axis] - self.margin),
                max: each(|axis| self.apex[axis] + self.margin),
            },
        );
        let (footprint, start, end) = Footprint::new(self.apex, &turned, self.margin);
        let apart = footprint.apart(&self.all)
            | Lanes::lt(end, F32x8::splat(0.0))
            | Lanes::gt(start, self.farthest);
        let boxes = Footprints {
            min: [footprint.min[0].to_array(), footprint.min[1].to_array()],
            max: [footprint.max[0].to_array(), footprint.max[1].to_array()],
            start: start.to_array(),
        };
        (boxes, [(!apart).bits(), near])
    }

    #[inline(always)]
    fn groups(&self, boxes: &Footprints, slot: usize) -> u32 {
        let of = |lanes: &[f32; 8]| F32x16::splat(lanes[slot & 7]);
        let footprint = Footprint {
            min: [of(&boxes.min[0]), of(&boxes.min[1])],
            max: [of(&boxes.max[0]), of(&boxes.max[1])],
        };
        let apart = footprint.apart(&self.groups) | Lanes::gt(of(&boxes.start), self.reach);
        (!apart).bits()
    }
}

const _: () = assert!(GROUPS == F32x16::LANES);
