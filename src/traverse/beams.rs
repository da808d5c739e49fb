//! Beams: a tile whose groups have bounds of their own.

use super::cull::{Cull, Reach, Slopes};
use super::group::Group;
use super::ones;
use super::tile::GROUPS;
use crate::kernels::{Beam, BeamAxes, Bounds, ScaledRay};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes, each};

/// Groups that each have bounds of their own.
pub(super) struct Beams {
    groups: Beam<F32x16>,
    whole: Beam<F32x8>,
    reach: Reach,
}

impl Beams {
    /// No rays yet.
    pub(super) fn new() -> Self {
        let (zero, zeros) = (F32x8::ZERO, F32x16::ZERO);
        let none = [zeros; 3];
        Self {
            groups: Beam {
                origin: Bounds { min: none, max: none },
                slope_min: [zeros; 2],
                slope_max: [zeros; 2],
                start: zeros,
            },
            whole: Beam {
                origin: Bounds { min: [zero; 3], max: [zero; 3] },
                slope_min: [zero; 2],
                slope_max: [zero; 2],
                start: zero,
            },
            reach: Reach::NOWHERE,
        }
    }

    /// Takes the rays of other groups.
    pub(super) fn take<F: Lanes>(
        &mut self,
        groups: &[Group<F>; GROUPS],
        live: u32,
        axes: BeamAxes,
        margin: f32,
        slopes: &Slopes,
    ) {
        let mut min = [[f32::INFINITY; GROUPS]; 3];
        let mut max = [[f32::NEG_INFINITY; GROUPS]; 3];
        let (inf, neg) = (F::splat(f32::INFINITY), F::splat(f32::NEG_INFINITY));
        for index in ones(live) {
            let ray = &groups[index].ray;
            let origin = axes.turn(ray.origin);
            let low: [F; 3] = each(|axis| F::select(ray.valid, origin[axis], inf));
            let high: [F; 3] = each(|axis| F::select(ray.valid, origin[axis], neg));
            let [first, last] = F::reduce_bounds([low[0], low[1]], [high[0], high[1]]);
            let (start, end) = (low[2].reduce_min(), high[2].reduce_max());
            for (axis, first, last) in
                [(0, first[0], last[0]), (1, first[1], last[1]), (2, start, end)]
            {
                min[axis][index] = first - margin;
                max[axis][index] = last + margin;
            }
        }
        self.reach.take_starts(groups, live, axes, margin, &min[2]);
        let origin = Bounds {
            min: each(|axis| F32x16::load(&min[axis])),
            max: each(|axis| F32x16::load(&max[axis])),
        };
        let whole_origin = Bounds {
            min: each(|axis| F32x8::splat(origin.min[axis].reduce_min())),
            max: each(|axis| F32x8::splat(origin.max[axis].reduce_max())),
        };
        let ((slope_min, slope_max), (whole_min, whole_max)) = (slopes.lanes(), slopes.whole());
        self.groups = Beam { origin, slope_min, slope_max, start: self.reach.start };
        self.whole = Beam {
            origin: whole_origin,
            slope_min: whole_min,
            slope_max: whole_max,
            start: self.reach.whole_start,
        };
    }
}

impl Cull for Beams {
    /// Minima and maxima in the beams' axes.
    type Boxes = [[f32; 8]; 6];
    const LOOSE: bool = true;
    const BOUNDED: bool = true;
    const FAN: bool = false;

    #[inline(always)]
    fn boxes(&self, bounds: [F32x8; 6]) -> (Self::Boxes, u32) {
        let turned = self.reach.axes.turn_box(bounds);
        let met = self.whole.meets(&turned, self.reach.whole_end);
        let ([a, b, c], [d, e, f]) = (turned.min, turned.max);
        (each(|place| [a, b, c, d, e, f][place].to_array()), met.bits())
    }

    #[inline(always)]
    fn groups(&self, boxes: &Self::Boxes, slot: usize) -> (u32, f32) {
        let of = |place: usize| F32x16::splat(boxes[place][slot]);
        let bounds = Bounds { min: [of(0), of(1), of(2)], max: [of(3), of(4), of(5)] };
        (self.groups.meets(&bounds, self.reach.end).bits(), boxes[2][slot])
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
