//! Shafts of sixteen groups, and the one around all of them: which boxes they may meet.

use super::group::Aim;
use crate::kernels::{Beam, Bounds};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes};

/// How many groups go down the tree together: one a lane of the widest test.
pub(super) const GROUPS: usize = 16;

/// A beam for each of up to sixteen groups, and the one around all of them. It turns away no box that a
/// member of a group meets.
pub(super) struct Shafts {
    aim: Aim,
    groups: Beam<F32x16>,
    all: Beam<F32x8>,
}

/// Eight boxes in the axes of the shafts, minima and maxima.
pub(super) type Turned = [[f32; 8]; 6];

impl Shafts {
    pub(super) fn new(aim: Aim, groups: Beam<F32x16>) -> Self {
        let low = |lanes: F32x16| F32x8::splat(lanes.reduce_min());
        let high = |lanes: F32x16| F32x8::splat(lanes.reduce_max());
        let all = Beam {
            origin: Bounds { min: groups.origin.min.map(low), max: groups.origin.max.map(high) },
            slope_min: groups.slope_min.map(low),
            slope_max: groups.slope_max.map(high),
            start: low(groups.start),
        };
        Self { aim, groups, all }
    }

    /// Turns boxes (`min.x .. max.z`); a bit for each that some group may meet, and for each that lies
    /// where members of groups start.
    #[inline(always)]
    pub(super) fn boxes(&self, bounds: [F32x8; 6]) -> (Turned, [u32; 2]) {
        let turned = self.aim.axes.turn_box(bounds);
        let met = self.all.meets(&turned, F32x8::splat(self.aim.end)).bits();
        let near = turned.touches(&self.all.origin).bits();
        let mut boxes = [[0.0; 8]; 6];
        for axis in 0..3 {
            turned.min[axis].store(&mut boxes[axis]);
            turned.max[axis].store(&mut boxes[axis + 3]);
        }
        (boxes, [met, near])
    }

    /// The groups that may meet box `slot`.
    #[inline(always)]
    pub(super) fn groups(&self, boxes: &Turned, slot: usize) -> u32 {
        self.groups.meets(&one_box(boxes, slot), F32x16::splat(self.aim.end)).bits()
    }
}

/// One of eight boxes, in sixteen lanes.
#[inline(always)]
pub(super) fn one_box(boxes: &Turned, slot: usize) -> Bounds<F32x16> {
    let of = |place: usize| F32x16::splat(boxes[place][slot & 7]);
    Bounds { min: [of(0), of(1), of(2)], max: [of(3), of(4), of(5)] }
}

/// The beams of groups, taken together one by one.
pub(super) struct Beams {
    min: [[f32; GROUPS]; 3],
    max: [[f32; GROUPS]; 3],
    slope_min: [[f32; GROUPS]; 2],
    slope_max: [[f32; GROUPS]; 2],
    start: [f32; GROUPS],
}

impl Beams {
    /// No beam in any lane: it meets nothing.
    pub(super) fn new() -> Self {
        let (inf, neg) = ([f32::INFINITY; GROUPS], [f32::NEG_INFINITY; GROUPS]);
        Self { min: [inf; 3], max: [neg; 3], slope_min: [inf; 2], slope_max: [neg; 2], start: inf }
    }

    /// Sets lane `group`: where origins are, the margin added, and the slopes, both as minima and
    /// maxima.
    #[inline(always)]
    pub(super) fn set(&mut self, group: usize, origin: [[f32; 3]; 2], slopes: [[f32; 2]; 2]) {
        let [low, high] = origin;
        for (axis, (low, high)) in low.into_iter().zip(high).enumerate() {
            self.min[axis][group] = low;
            self.max[axis][group] = high;
        }
        let [low, high] = slopes;
        for (axis, (low, high)) in low.into_iter().zip(high).enumerate() {
            self.slope_min[axis][group] = low;
            self.slope_max[axis][group] = high;
        }
        self.start[group] = origin[0][2];
    }

    pub(super) fn beam(&self) -> Beam<F32x16> {
        let load = |lanes: [f32; GROUPS]| F32x16::load(&lanes);
        Beam {
            origin: Bounds { min: self.min.map(load), max: self.max.map(load) },
            slope_min: self.slope_min.map(load),
            slope_max: self.slope_max.map(load),
            start: load(self.start),
        }
    }
}
