//! Culling: what the bounds of a tile's groups must answer, and what all of them share.
//!
//! Coordinates are forwards: along the main axis of the rays, mirrored if they run towards smaller
//! coordinates.

use super::group::Group;
use super::ones;
use super::tile::GROUPS;
use crate::kernels::{BeamAxes, ScaledRay};
use crate::simd::{F32x8, F32x16, LaneMask, Lanes};

/// Culls boxes for the groups of a tile.
pub(super) trait Cull {
    /// Eight boxes made ready.
    type Boxes;
    /// True if groups should test boxes with their own rays too.
    const LOOSE: bool;
    /// True if all rays start at [`Cull::origin`], exactly.
    const FAN: bool;
    /// Where all rays of a fan start; else zero.
    fn origin(&self) -> [F32x8; 3] {
        [F32x8::ZERO; 3]
    }
    /// Makes boxes (`min.x .. max.z`) ready; a bit for each that some group may meet.
    fn boxes(&self, bounds: [F32x8; 6]) -> (Self::Boxes, u32);
    /// The groups that may meet box `slot`, and where it starts.
    fn groups(&self, boxes: &Self::Boxes, slot: usize) -> (u32, f32);
    /// The groups that reach as far as `start`.
    fn reach(&self, start: f32) -> u32;
    /// Draws in a group to the `t_max` of its rays; takes effect with [`Cull::settle`].
    fn draw_in<F: Lanes>(&mut self, group: usize, ray: &ScaledRay<F>);
    /// Ends a run of [`Cull::draw_in`].
    fn settle(&mut self);
}

/// The slopes of the groups, one lane each.
pub(super) struct Slopes {
    pub(super) min: [[f32; GROUPS]; 2],
    pub(super) max: [[f32; GROUPS]; 2],
}

impl Slopes {
    pub(super) fn new() -> Self {
        Self { min: [[f32::INFINITY; GROUPS]; 2], max: [[f32::NEG_INFINITY; GROUPS]; 2] }
    }

    pub(super) fn lanes(&self) -> ([F32x16; 2], [F32x16; 2]) {
        let load = |of: &[[f32; GROUPS]; 2]| [F32x16::load(&of[0]), F32x16::load(&of[1])];
        (load(&self.min), load(&self.max))
    }

    pub(super) fn whole(&self) -> ([F32x8; 2], [F32x8; 2]) {
        let (min, max) = self.lanes();
        (
            min.map(|lanes| F32x8::splat(lanes.reduce_min())),
            max.map(|lanes| F32x8::splat(lanes.reduce_max())),
        )
    }
}

/// Where the ranges of the groups start and end, forwards, widened by the margin.
#[derive(Clone)]
pub(super) struct Reach {
    pub(super) axes: BeamAxes,
    pub(super) margin: f32,
    pub(super) start: F32x16,
    pub(super) end: F32x16,
    pub(super) ends: [f32; GROUPS],
    pub(super) whole_start: F32x8,
    pub(super) whole_end: F32x8,
}

impl Reach {
    pub(super) fn new<F: Lanes>(
        groups: &[Group<F>; GROUPS],
        live: u32,
        axes: BeamAxes,
        margin: f32,
    ) -> Self {
        let (inf, neg) = (f32::INFINITY, f32::NEG_INFINITY);
        let mut reach = Self {
            axes,
            margin,
            start: F32x16::splat(inf),
            end: F32x16::splat(neg),
            ends: [neg; GROUPS],
            whole_start: F32x8::splat(inf),
            whole_end: F32x8::splat(neg),
        };
        let mut starts = [inf; GROUPS];
        for index in ones(live) {
            let ray = &groups[index].ray;
            // No range starts before its origin.
            let origin = axes.forward(&ray.origin);
            starts[index] = F::select(ray.valid, origin, F::splat(inf)).reduce_min() - margin;
            reach.ends[index] = reach.end_of(ray);
        }
        reach.start = F32x16::load(&starts);
        reach.whole_start = F32x8::splat(reach.start.reduce_min());
        reach.settle();
        reach
    }

    #[inline(always)]
    fn end_of<F: Lanes>(&self, ray: &ScaledRay<F>) -> f32 {
        if ray.t_max.eq(F::splat(f32::INFINITY)).any() {
            return f32::INFINITY;
        }
        let (origin, dir) = (self.axes.forward(&ray.origin), self.axes.forward(&ray.dir));
        let end = ray.t_max.mul_add_fast(dir, origin);
        let end = F::select(ray.t_max.ge(ray.t_min), end, F::splat(f32::NEG_INFINITY));
        end.reduce_max() + self.margin
    }

    #[inline(always)]
    pub(super) fn draw_in<F: Lanes>(&mut self, group: usize, ray: &ScaledRay<F>) {
        self.ends[group] = self.end_of(ray);
    }

    #[inline(always)]
    pub(super) fn settle(&mut self) {
        self.end = F32x16::load(&self.ends);
        self.whole_end = F32x8::splat(self.end.reduce_max());
    }
}
